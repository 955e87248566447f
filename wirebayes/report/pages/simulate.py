"""The page of ``wirebayes simulate``: the tests that were made up, and the truth behind them."""

from pathlib import Path

from wirebayes.effects import CATALOGUE, effect_named
from wirebayes.io.experiment import Experiment
from wirebayes.io.experiment_file import read_experiments
from wirebayes.io.run_folder import read_json
from wirebayes.json_files.truth import TrueWire, TruthJson
from wirebayes.report import figures
from wirebayes.report.blocks import (
    Block,
    Configuration,
    Page,
    Picture,
    Pictures,
    Section,
    Table,
    Text,
    files_beside,
    number,
    seed_of_page,
)
from wirebayes.report.cells import unit_or_dash
from wirebayes.report.drawn import drawn
from wirebayes.report.glossary import SYMBOLS, meaning
from wirebayes.results.parameters import unit_of
from wirebayes.sentences import counted, listed, spoken

_MOST = 12  # tests of which a page shows the readings
_FILES = (
    ("experiments.toml", "the tests, for every other command"),
    ("*.csv", "readings of one test"),
    ("truth.json", "the true parameters and effects"),
    ("configuration.json", "the options of this run, with version and seed"),
)


def simulate_page(folder: Path, configuration: Configuration) -> Page:
    """The content of ``truth.json`` and of the experiments beside it."""
    content: TruthJson = read_json(folder / "truth.json")
    truths = content["experiments"]
    experiments = read_experiments(folder / "experiments.toml")
    count = len(experiments)
    sections = [_section(experiment, truths[experiment.name]) for experiment in experiments[:_MOST]]
    if count > _MOST:
        more = Text(f"The first {_MOST} of {count} tests are shown; the files hold all.")
        sections.append(Section("More tests", [more]))
    sections.append(files_beside(folder, _FILES))
    sections.append(meaning(("hold",), configuration["effects"]))
    stiffness = []
    for truth in list(truths.values())[:_MOST]:
        k1 = truth["parameters"]["k1"]
        stiffness.append(f"{number(k1)} N")
    tests = counted(count, "test")
    lead = f"Simulated readings of {tests}, whose true parameters are known: k1 is {listed(stiffness)}."
    footer = seed_of_page(configuration)
    return Page("Simulated tests", lead, sections, footer)


def _section(experiment: Experiment, truth: TrueWire) -> Section:
    effects = truth.get("effects", [])
    beyond = ", ".join(spoken(name) for name in effects) or "nothing: the plain model made these readings"
    source = drawn(figures.measured(experiment.protocol(), experiment.readings(), experiment.name))
    alt = f"Readings of {experiment.name} against what was set."
    caption = "Within each hold the readings go from the blue point to the red ones."
    picture = Picture(source, alt, caption)
    blocks: list[Block] = [
        Pictures([picture]),
        Text(f"{experiment.material}, {experiment.length_mm:g} mm. Beyond the plain model: {beyond}."),
        _true_values(experiment, truth),
    ]
    return Section(experiment.name, blocks)


def _true_values(experiment: Experiment, truth: TrueWire) -> Table:
    effects = truth.get("effects", [])
    known = tuple(effect_named(effect) for effect in effects if effect.split("@")[0] in CATALOGUE)
    lines = []
    for name, value in truth["parameters"].items():
        unit = unit_or_dash(unit_of(name, known, (experiment.control,)))
        what = SYMBOLS.get(name, "size of an effect")
        lines.append([name, number(value), unit, what])
    header = ["parameter", "true value", "unit", "what it is"]
    return Table(header, lines, "What an analysis should find.")
