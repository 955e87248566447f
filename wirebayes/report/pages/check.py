"""The pages of ``wirebayes import`` and ``wirebayes check``: what was understood, what a test can determine."""

from pathlib import Path

from wirebayes.answers.headline import check_in_a_sentence
from wirebayes.answers.terminal import of_import
from wirebayes.io.run_folder import read_json
from wirebayes.json_files.check import CheckedExperiment, CheckJson
from wirebayes.json_files.imported import ImportedExperiment, ImportJson
from wirebayes.json_files.read_units import read_value
from wirebayes.report.blocks import (
    Block,
    Columns,
    Configuration,
    Page,
    Picture,
    Pictures,
    Points,
    Section,
    Table,
    as_sentence,
    before_the_answer,
    beside_the_answer,
    files_beside,
    number,
    picture_file,
    seed_of_page,
    span,
)
from wirebayes.report.cells import NONE, unit_or_dash
from wirebayes.report.drawn import embedded
from wirebayes.report.glossary import SYMBOLS, meaning
from wirebayes.result_warnings import warns_of
from wirebayes.sentences import counted, lasting, spoken

_FILES = (
    ("import.json", "what was decided, as JSON"),
    ("*.toml", "the experiment, for every other command"),
    ("*.csv", "its readings"),
    ("check.json", "every number of this page as JSON"),
    ("configuration.json", "the options of this run, with version and seed"),
)
_MOST_SENTENCES = 3  # of experiments at the top of a page, which a first screen holds
_DETERMINED_BY = {"data": "the readings", "data and prior": "readings and prior", "prior": "the prior alone"}


def check_page(folder: Path, configuration: Configuration) -> Page:
    """The content of ``check.json`` or ``import.json``, a section for each experiment."""
    files = files_beside(folder, _FILES)
    if configuration["command"] == "import":
        return _import_page(folder, files)
    content: CheckJson = read_json(folder / "check.json")
    checked = content["experiments"]
    sections = []
    effects = list[str]()
    sentences = []
    for name, experiment in checked.items():
        picture = _picture(folder, name)
        sections.append(Section(name, _checked(experiment, picture)))
        sentence = check_in_a_sentence(name, experiment)
        sentences.append(sentence)
        effects += experiment["effects"]
    sections.append(files)
    terms = ("hold", "90 % interval", "prior")
    sections.append(meaning(terms, effects, symbols=False))
    lead = " ".join(sentences[:_MOST_SENTENCES])
    footer = seed_of_page(configuration)
    return Page("What this test can determine", lead, sections, footer)


def _import_page(folder: Path, files: Section) -> Page:
    """The content of ``import.json``."""
    content: ImportJson = read_json(folder / "import.json")
    sections = []
    understood = []
    for name, experiment in content["experiments"].items():
        picture = _picture(folder, name, " Is this the test that was done?")
        sections.append(Section(name, _imported(experiment, picture)))
        understood.append(of_import(name, experiment)[0])
    lead = "; ".join(understood)
    return Page("What was imported", f"{lead}.", [*sections, files])


def _imported(experiment: ImportedExperiment, picture: list[Block]) -> list[Block]:
    about = [
        f"From {experiment['raw']}.",
        f"{counted(experiment['holds'], 'hold')}, {counted(experiment['readings'], 'reading')}.",
        f"Length {number(experiment['length_mm'])} mm.",
    ]
    done = [f"{note[:1].upper()}{note[1:]}." for note in experiment["notes"]]
    what_it_is = Points("What it is", about)
    what_was_done = Points("What was done", done or ["Nothing had to be decided."])
    return [
        *before_the_answer(experiment),
        *picture,
        *beside_the_answer(experiment),
        Columns([what_it_is, what_was_done]),
    ]


def _checked(experiment: CheckedExperiment, picture: list[Block]) -> list[Block]:
    known = Points("What it is", _about(experiment))
    blind = Points("What it cannot determine", _blind(experiment))
    return [
        *before_the_answer(experiment),
        *picture,
        *beside_the_answer(experiment),
        Columns([known, blind]),
        _parameters(experiment),
        _effects(experiment),
        _holds(experiment),
    ]


def _about(experiment: CheckedExperiment) -> list[str]:
    """The sample and the test in sentences."""
    holds = counted(experiment["recorded_holds"], "recorded hold")
    if experiment["unrecorded_holds"]:
        holds += f", {experiment['unrecorded_holds']} unrecorded"
    about = [
        f"{experiment['material']}, {number(experiment['length_mm'])} mm.",
        f"{holds}, {counted(experiment['readings'], 'reading')}.",
        f"{lasting(experiment['duration_s'])} in all.",
    ]
    ends = experiment.get("hold_ends")
    if ends and not warns_of(experiment, "hold-ends"):
        about.append(as_sentence(ends["sentence"]))
    return about


def _blind(experiment: CheckedExperiment) -> list[str]:
    """Effects that the test cannot show, and parameters that it does not determine."""
    hidden = [spoken(name) for name, effect in experiment["effects"].items() if effect["shows"] == "no"]
    prior = [name for name, parameter in experiment["parameters"].items() if parameter["determined_by"] == "prior"]
    blind = []
    if hidden:
        blind.append(f"Effects it cannot show: {', '.join(hidden)}.")
    if prior:
        blind.append(f"Parameters it does not determine: {', '.join(prior)}.")
    return blind or ["Nothing to report."]


def _parameters(experiment: CheckedExperiment) -> Table:
    """What is known of each parameter before and after the test."""
    rows = []
    for name, parameter in experiment["parameters"].items():
        rows.append(
            [
                name,
                unit_or_dash(parameter["unit"]),
                number(parameter["q50"]),
                span(parameter["q05"], parameter["q95"]),
                span(parameter["prior_q05"], parameter["prior_q95"]),
                _DETERMINED_BY[parameter["determined_by"]],
                SYMBOLS.get(name, NONE),
            ]
        )
    header = ["parameter", "unit", "median", "90 % interval", "prior's 90 %", "determined by", "what it is"]
    return Table(header, rows, "A first estimate by a short run of the sampler; fit gives the posterior.")


def _effects(experiment: CheckedExperiment) -> Table:
    """How small an effect the test would show."""
    rows = []
    for name, effect in experiment["effects"].items():
        if effect["shows"] != "no":
            amplitude = number(effect["amplitude_80"])
            rows.append([spoken(name), amplitude, unit_or_dash(effect["unit"]), effect["shows"]])
    caption = "The smallest amplitude of each effect that discover would detect in four tests of five like this one."
    return Table(["effect", "amplitude", "unit", "shows"], rows, caption)


def _holds(experiment: CheckedExperiment) -> Table:
    """The holds, a row each."""
    weights = experiment["control"] == "force"
    what, unit = ("weight (N)", "mm") if weights else ("displacement (mm)", "N")
    rows = []
    for hold in experiment["holds"]:
        rows.append(
            [
                str(hold["number"] or NONE),
                number(hold["tension_N" if weights else "displacement_mm"]),
                number(hold["start_s"]),
                number(hold["duration_s"]),
                str(hold["readings"]),
                number(read_value(hold, "first")),
                number(read_value(hold, "last")),
            ]
        )
    header = ["hold", what, "begins (s)", "lasts (s)", "readings", f"first ({unit})", f"last ({unit})"]
    return Table(header, rows, "The holds as they were read; one without a number was not recorded.")


def _picture(folder: Path, name: str, question: str = "") -> list[Block]:
    file = picture_file(folder, name)
    if file is None:
        return []
    alt = f"Displacement and tension of {name} over the whole test."
    caption = "What was set above, what was read below, over the whole test. Shading marks every second hold."
    caption += question
    return [Pictures([Picture(embedded(file), alt, caption, wide=True)])]
