"""The page of ``wirebayes simulate``: the tests that were made up, and the truth behind them."""

from pathlib import Path
from typing import Any

from wirebayes.effects import CATALOGUE, effect_named
from wirebayes.io.experiment import Experiment
from wirebayes.io.experiment_file import read_experiments
from wirebayes.io.run_folder import read_json
from wirebayes.json_files.truth import TrueWire, TruthJson
from wirebayes.report import figures
from wirebayes.report.blocks import (
    Block,
    Page,
    Picture,
    Pictures,
    Section,
    Table,
    Text,
    drawn,
    files_beside,
    number,
    seed_of_page,
    unit_text,
)
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


def simulate_page(folder: Path, configuration: dict[str, Any]) -> Page:
    """The content of ``truth.json`` and of the experiments beside it."""
    content: TruthJson = read_json(folder / "truth.json")
    truths = content["experiments"]
    experiments = read_experiments(folder / "experiments.toml")
    sections = [_section(e, truths[e.name]) for e in experiments[:_MOST]]
    if len(experiments) > _MOST:
        more = Text(f"The first {_MOST} of {len(experiments)} tests are shown; the files hold all.")
        sections.append(Section("More tests", [more]))
    sections.append(files_beside(folder, _FILES))
    sections.append(meaning(("hold",), configuration["effects"]))
    stiff = listed([f"{number(truth['parameters']['k1'])} N" for truth in list(truths.values())[:_MOST]])
    lead = f"Simulated readings of {counted(len(experiments), 'test')}, whose true parameters are known: k1 is {stiff}."
    return Page("Simulated tests", lead, sections, seed_of_page(configuration))


def _section(e: Experiment, truth: TrueWire) -> Section:
    effects = truth.get("effects", [])
    beyond = ", ".join(spoken(name) for name in effects) or "nothing: the plain model made these readings"
    picture = Picture(
        drawn(figures.measured(e.protocol(), e.readings(), e.name)),
        f"Readings of {e.name} against what was set.",
        "Within each hold the readings go from the blue point to the red ones.",
    )
    known = tuple(effect_named(effect) for effect in effects if effect.split("@")[0] in CATALOGUE)
    lines = [
        [
            name,
            number(value),
            unit_text(unit_of(name, known, (e.control,))) or "–",
            SYMBOLS.get(name, "size of an effect"),
        ]
        for name, value in truth["parameters"].items()
    ]
    blocks: list[Block] = [
        Pictures([picture]),
        Text(f"{e.material}, {e.length_mm:g} mm. Beyond the plain model: {beyond}."),
        Table(["parameter", "true value", "unit", "what it is"], lines, "What an analysis should find."),
    ]
    return Section(e.name, blocks)
