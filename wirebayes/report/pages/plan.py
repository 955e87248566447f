"""The page of ``wirebayes plan``: tests that could be done, best first, with what each would teach and show."""

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from wirebayes.answers.headline import plan_in_a_sentence
from wirebayes.io.run_folder import read_json
from wirebayes.json_files.plan import ExpectedWidth, JudgedProtocol, PlanJson
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
    Text,
    before_the_answer,
    beside_the_answer,
    files_beside,
    number,
    picture_file,
    seed_of_page,
    span,
)
from wirebayes.report.cells import NONE, unit_or_dash, with_unit
from wirebayes.report.drawn import embedded
from wirebayes.report.glossary import meaning
from wirebayes.report.pictures.plan import is_given
from wirebayes.sentences import counted, short, spoken

_AIMS = {
    "parameters": "how much they say about the material",
    "creep": "how well the creep after an hour would be known",
}
_CREEP: tuple[Literal["creep_longest_hold_mm"], Literal["creep_1h_mm"]] = ("creep_longest_hold_mm", "creep_1h_mm")


def plan_page(folder: Path, configuration: Configuration) -> Page:
    """The content of ``plan.json``."""
    found: PlanJson = read_json(folder / "plan.json")
    rows = found["protocols"]
    sections = [Section("Summary", _summary(folder, found))]
    effects = list[str]()
    for row in rows:
        rank = row["rank"]
        title = f"{rank}. {row['name']}"
        sections.append(Section(title, _protocol(row), folded=rank > 1))
        effects += row["effects"]
    sections.append(files_beside(folder, _FILES))
    terms = ("hold", "90 % interval", "information", "δ")
    sections.append(meaning(terms, effects))
    lead = plan_in_a_sentence(found)
    footer = seed_of_page(configuration)
    return Page("What a test would teach", lead, sections, footer)


def _summary(folder: Path, found: PlanJson) -> list[Block]:
    """What was asked, the picture and the ranking."""
    blocks = before_the_answer(found)
    picture = picture_file(folder, "plan")
    if picture is not None:
        alt = "Expected widths and detectable effects of each test."
        blocks.append(Pictures([Picture(embedded(picture), alt, _PICTURE, wide=True)]))
    columns = Columns([_requested(found), _reliability(found["protocols"])])
    return [*blocks, *beside_the_answer(found), columns, _ranking(found)]


_PICTURE = (
    "Left: the uncertainty that each test would leave of each quantity, as a share of the guess's; right: how easily "
    "it would show each effect."
)
_FILES = (
    ("plan.json", "every number of this page as JSON"),
    ("configuration.json", "the options of this run, with version and seed"),
)


def _requested(found: PlanJson) -> Points:
    aim = found["aim"]
    by = _AIMS.get(aim[0], "")
    if len(aim) == 2:
        by = f"how well {_words(aim[0])} and {_words(aim[1])} would be distinguished"
    points = [f"The guess: {found['guess']['source']}.", f"The tests are ranked by {by}."]
    if found["budget_min"] is not None:
        points.append(f"Available time: {short(found['budget_min'])} min.")
    return Points("What was requested", points)


def _reliability(rows: list[JudgedProtocol]) -> Points:
    least = min(row["simulated_tests"] for row in rows)
    return Points(
        "How far it can be trusted",
        [
            f"Each test was simulated and fitted {least} times or more, with the priors of the later fit. Half of the "
            "tests would do better than a median, half worse; the range says by how much.",
            "These figures hold if the wire is as guessed and the model is missing nothing.",
        ],
    )


def _ranking(found: PlanJson) -> Table:
    rows = found["protocols"]
    first = rows[0]
    parameters = first["parameters"]
    names = [name for name in ("k1", "B", "U", "k2", "N") if name in parameters]
    header = ["rank", "test", "minutes", "bits"]
    header += [with_unit(f"sd of {name}", parameters[name]["unit"]) for name in names]
    header.append("sd of creep in 1 h, mm")
    if first["robot"] is not None:
        header.append("sd of the robot's drift in 1 h, mm")
    header.append("within budget")
    lines = [_ranked(row, names) for row in rows]
    caption = "Standard deviations of the posterior, median over the simulated tests."
    return Table(header, lines, caption)


def _ranked(row: JudgedProtocol, names: Sequence[str]) -> list[str]:
    """A row of the ranking."""
    widths = [row["parameters"][name]["sd"] for name in names]
    widths.append(row["creep"]["creep_1h_mm"]["sd"])
    if row["robot"] is not None:
        widths.append(row["robot"]["drift_sd_mm"])
    return [
        str(row["rank"]),
        row["name"],
        short(row["duration_min"]),
        number(row["information_bits"]),
        *(number(width, 2) for width in widths),
        "yes" if row["within_budget"] else "too long",
    ]


def _protocol(row: JudgedProtocol) -> list[Block]:
    holds = counted(row["holds"], "hold")
    readings = counted(row["readings"], "reading")
    words = f": {row['words']}" if row["words"] else ""
    minutes = short(row["duration_min"])
    what = f"{holds} with {readings}, {minutes} min{words}."
    blocks: list[Block] = [Text(what), _widths(row)]
    if row["effects"]:
        blocks.append(_effects(row))
    if row["not_identifiable"]:
        lines = []
        for sentence in row["not_identifiable"]:
            what, _, reason = sentence.partition(": ")
            lines.append([_words(what), reason])
        blocks.append(Table(["what", "why not"], lines, "What it would not show."))
    return blocks


def _widths(row: JudgedProtocol) -> Table:
    """How well parameters and creep would be known."""
    creep = row["creep"]
    quantities = row["parameters"] | {name: creep[name] for name in _CREEP}
    lines = [[with_unit(_words(name), width["unit"]), *_width(width)] for name, width in quantities.items()]
    header = ["quantity", "sd", "90 % width", "in 90 % of tests", "sd of the guess"]
    wire = f"Creep of {number(creep['length_mm'])} mm at {number(creep['tension_N'])} N"
    longest = number(creep["longest_hold_s"])
    return Table(header, lines, f"{wire}; the longest hold lasts {longest} s.")


def _width(width: ExpectedWidth) -> list[str]:
    """Standard deviation, width, in most tests, and what was known before."""
    most_tests = span(width["width_90_low"], width["width_90_high"], 2)
    guess = "given" if is_given(width) else number(width["guess_sd"], 2)
    return [number(width["sd"], 2), number(width["width_90"], 2), most_tests, guess]


def _effects(row: JudgedProtocol) -> Table:
    """What sizes of effects would be seen."""
    lines = []
    for name, seen in row["effects"].items():
        amplitude = number(seen["amplitude_80"], 2)
        delta = number(seen["delta_80"], 2)
        confused = ", ".join(map(_words, seen["confused_with"])) or NONE
        lines.append([_words(name), amplitude, unit_or_dash(seen["unit"]), delta, confused])
    header = ["effect", "amplitude", "unit", "δ", "hard to distinguish from"]
    caption = "Smallest amplitude seen in 80 % of tests, its size δ in standard deviations, and what it looks like."
    return Table(header, lines, caption)


def _words(name: str) -> str:
    return _SPOKEN.get(name, spoken(name))


_SPOKEN = {
    "creep_longest_hold_mm": "creep after the longest hold",
    "creep_1h_mm": "creep after 1 h",
    "sensor_sd": "error of a reading (sensor_sd)",
    "setting_sd": "error of a setting (setting_sd)",
}
