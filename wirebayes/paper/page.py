"""The page of ``wirebayes reproduce``: the paper's results with their uncertainty."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from wirebayes.io.run_folder import read_json
from wirebayes.paper import page_tables as paper_tables
from wirebayes.paper.page_summary import creep_of_each_wire, in_a_minute, of_table_4, unbroken
from wirebayes.paper.page_tables import LEAST_COVERAGE, Rows, column_values
from wirebayes.report.blocks import Block, Page, Picture, Pictures, Section, Text, files_beside
from wirebayes.report.drawn import embedded
from wirebayes.report.glossary import meaning
from wirebayes.report.pages.robot_view import robot_view
from wirebayes.sentences import listed

Tables = dict[str, Rows]
Gallery = Callable[..., list[Block]]
_ROBOT_TABLES = ("robot", "robot_claim", "robot_mass")
_TABLES = ("measured", "least_squares", "posterior", "creep", "held_out", "sampling", *_ROBOT_TABLES)
_FILES = (
    ("*.csv", "the numbers of a table on this page"),
    ("*.json", "the same as JSON, or the configuration"),
    ("*/*/summary.json", "one fit: parameters and convergence"),
    ("*/*/posterior.nc", "one fit: all draws, opens with ArviZ"),
)
_TERMS = ("hold", "90 % interval", "prior", "contraction", "held out", "rms", "drift", "tilt", "specimen spread")


def paper_page(folder: Path, configuration: dict[str, Any]) -> Page:
    """Assemble the page from the folder's tables and pictures; what is not there yet is left out."""
    tables: Tables = {}
    for name in _TABLES:
        file = folder / f"{name}.json"
        if file.is_file():
            tables[name] = read_json(file)
    gallery = _gallery(folder / "figures")
    sections = [build(tables, gallery) for needed, build in _SECTIONS if all(name in tables for name in needed)]
    sections.append(Section("The robot in three dimensions", robot_view(folder / "figures")))
    sections.append(files_beside(folder, _FILES))
    sections.append(meaning(_TERMS))
    lead = creep_of_each_wire(tables["creep"]) if tables.get("creep") else _ABOUT
    filled = [section for section in sections if section.blocks]
    seed = configuration.get("seed")
    footer = (
        f"Seed {seed}. The tables beside this page (CSV and JSON) hold every number shown; each "
        "fit has a folder with posterior.nc, which opens with ArviZ."
    )
    return Page("Four wires that creep", lead, filled, footer)


def _gallery(folder: Path) -> Gallery:
    """Pictures of a section, by the index that was written with them."""
    index = read_json(folder / "index.json") if (folder / "index.json").is_file() else []

    def pictures(section: str, small: bool = False) -> list[Block]:
        found = []
        for entry in index:
            file = folder / entry["file"]
            if entry["section"] == section and file.is_file():
                found.append(Picture(embedded(file), entry["alt"], entry["caption"]))
        return [Pictures(found, small)] if found else []

    return pictures


def _summary(tables: Tables, gallery: Gallery) -> Section:
    return Section("Summary", [*gallery("measured"), Text(_ABOUT), in_a_minute(tables)])


_ABOUT = (
    "A paper measured four wires that are held at a stretch and lose tension, and published five numbers for each. "
    "Here are its tables again, with what they leave open: how well each number is known."
)


def _measured(tables: Tables, gallery: Gallery) -> Section:
    doubts = Text(
        "One cell of the print (.161 N) is read as 1.61 N. The positions 5 mm (Roc line, 1 m) and 4 mm (kite line) "
        "are absent from the print and taken as held for two minutes. The data's README lists every correction and "
        "doubt."
    )
    return Section("What was measured", [paper_tables.test_table(tables["measured"]), doubts], folded=True)


def _table_4(tables: Tables, gallery: Gallery) -> Section:
    rows = tables["least_squares"]
    words = Text(
        "Least squares on the first five holds, the rest left for testing. Hold by hold, each hold's first "
        "reading fixes the stretched length and the later ones are predicted. As one history (a chain), the "
        "displacements and one unknown preload must explain everything; Table 4 lacks the preload, so it is "
        "fitted for it."
    )
    by_hold = "Hold by hold, law (1): the interpretation under which Table 4 reproduces the tables."
    as_chain = "One history, creep saturating towards B τᵁ, law (1)."
    blocks = [
        words,
        paper_tables.table_4(rows, "hold", "", "hooke", by_hold),
        *_on_a_ridge(of_table_4(rows, "refitted")),
        *_not_that_fit_alone(of_table_4(rows, "published"), of_table_4(rows, "refitted")),
        paper_tables.table_4(rows, "chain", "saturating", "hooke", as_chain),
    ]
    return Section("Table 4 reproduced", blocks, folded=True)


def _on_a_ridge(refitted: Rows) -> list[Block]:
    """Which wires' refits may lie anywhere along a ridge."""
    loose = [unbroken(row) for row in refitted if row["not_held_back"]]
    if not loose:
        return []
    words = (
        f"On {listed(loose)} the readings leave a ridge along which the refit may run to the edge of the search: "
        "the values of the parameters in the last column mean nothing by themselves."
    )
    return [Text(words)]


def _not_that_fit_alone(published: Rows, refitted: Rows) -> list[Block]:
    """Where Table 4 predicts better what it was not fitted to, and worse what it was."""
    better = []
    for theirs, ours in zip(published, refitted, strict=True):
        if theirs["rms_rest_N"] < ours["rms_rest_N"] and theirs["rms_first_N"] > ours["rms_first_N"]:
            better.append(unbroken(theirs))
    if not better:
        return []
    words = (
        f"On {listed(better)} Table 4 fits the first five holds worse and predicts the rest better than least "
        "squares on the first five does. It is probably not the outcome of that fit alone."
    )
    return [Text(words)]


def _table_4_otherwise(tables: Tables, gallery: Gallery) -> Section:
    readings = (
        ("chain", "additive", "hooke", "One history, creep added again in every hold, law (1)."),
        ("hold", "", "modified", "Hold by hold, modified law (3)."),
        ("chain", "saturating", "modified", "One history, saturating, modified law (3)."),
        ("chain", "additive", "modified", "One history, additive, modified law (3)."),
    )
    blocks = [paper_tables.table_4(tables["least_squares"], *reading) for reading in readings]
    return Section("Table 4 in the other interpretations of the model", blocks, folded=True)


def _known(tables: Tables, gallery: Gallery) -> Section:
    words = Text(
        "Bars are 90 % intervals. The grey bar is the prior, what is known of a thin line before any test; where a "
        "coloured bar is not much shorter, the readings do not determine this number, whatever the published value."
    )
    caption = (
        "Inside or outside: whether the 90 % interval holds the published value. Not determined: on a logarithmic "
        "scale the interval has not shrunk to a third of its width before the test. Contraction is that of the creep "
        "at the test's typical tension and of its rate over a typical hold, however far these are from 1 N and 1 s."
    )
    table = paper_tables.interval_table(tables["posterior"], caption)
    return Section("What the readings say about each published value", [words, *gallery("known"), table], folded=True)


def _figures(tables: Tables, gallery: Gallery) -> Section:
    words = Text(
        "The paper shows one unused hold for each wire, its curve starting from the first reading. Its figures 1 "
        "and 2 carry one caption (“last experiment for the Roc Line, L0=1m”); one of them is likely the 1.71 m "
        "sample, so both are drawn. The bands are predictions: they use the first five holds and this hold's first "
        "reading, nothing else."
    )
    rest = Text("All unused holds in the same way: what is left when the prediction is taken from the measurement.")
    return Section("Figures 1 to 4", [words, *gallery("figures-1-to-4"), rest, *gallery("unused-hold")], folded=True)


def _cannot_know(tables: Tables, gallery: Gallery) -> Section:
    ridge = Text(
        "A stiff wire that creeps little and a soft one that creeps much lose tension alike. Within one hold only "
        "the product k1·B counts, so hold by hold the draws lie along a ridge and the prior decides where on it k1 "
        "is. The steps between holds, which only the chain uses, determine k1."
    )
    rate = Text(
        "Two minutes show the beginning of the creep. Much creep that comes slowly and little that comes soon look "
        "the same, most of all on nylon and the kite line: hold by hold, amount and rate are nearly inseparable, "
        "and the prior decides."
    )
    return Section(
        "What Table 4 does not determine", [ridge, *gallery("ridge"), rate, *gallery("amount-and-rate")], folded=True
    )


def _held_out(tables: Tables, gallery: Gallery) -> Section:
    rows = tables["held_out"]
    poor = [row for row in rows if row["coverage_90"] < LEAST_COVERAGE]
    chain = [unbroken(row) for row in poor if row["likelihood"] == "chain"]
    alone = [unbroken(row) for row in poor if row["likelihood"] == "hold"]
    blocks: list[Block] = []
    if chain:
        words = (
            "Fitted to the first five holds as one history, the plain model does not predict the others on "
            f"{listed(chain)}. The model lacks something; “wirebayes discover” looks for what it is."
        )
        blocks.append(Text(words, strong=True))
    if alone:
        words = (
            "Hold by hold the errors are smaller, because every hold brings its own first reading, but the bands "
            f"are too narrow on {listed(alone)} as well."
        )
        blocks.append(Text(words))
    caption = (
        "Predictions of the unused holds from the first five. A band counts as reliable when at least "
        f"{100 * LEAST_COVERAGE:.0f} % of the readings lie in it; 90 % should."
    )
    table = paper_tables.forecast_table(rows, caption)
    return Section("Where the model fails", [*blocks, *gallery("unused-chain"), table], folded=True)


def _creep(tables: Tables, gallery: Gallery) -> Section:
    words = Text(
        "The units of B and k2 depend on the exponents, so elongations are compared: creep of a fresh sample under a "
        "constant tension, the one with which a hold began that is nearest to the geometric mean of all readings."
    )
    caption = "Only 2 min lies within what was measured; an hour and a day are extrapolated."
    return Section(
        "Creep after two minutes, an hour, a day", [words, paper_tables.creep(tables["creep"], caption)], folded=True
    )


def _robot(tables: Tables, gallery: Gallery) -> Section:
    words = Text(
        "The paper simulates that a platform moves less than 0.3 mm and tilts less than 0.055 degrees within a "
        "minute. It gives no coordinates of its robot; here are two representative ones with linear actuators and "
        "pulley blocks, over their workspace, on wires as the chain knows them. Bands hold 90 % of poses and "
        "posterior draws."
    )
    blocks: list[Block] = [words]
    if "robot_claim" in tables:
        claim = tables["robot_claim"]
        blocks += [Text(_claim(claim)), paper_tables.robot_claim(claim)]
    blocks.append(paper_tables.drift_claim(tables["robot"]))
    if "robot_mass" in tables:
        blocks.append(paper_tables.robot_mass(tables["robot_mass"]))
    blocks += [*gallery("robot"), *gallery("robot-map", small=True)]
    return Section("What it means for a robot", blocks, folded=True)


def _claim(rows: Rows) -> str:
    """Where the paper's claim holds and what takes it away."""
    wires = column_values(rows, "experiment")
    drift_mm = {(row["experiment"], row["step"]): row["q50_drift_mm"] for row in rows}
    holds = sum(row["within_claim"] for row in rows if row["step"] == "table_4_elongation")
    factors = [drift_mm[wire, "table_4_strain"] / drift_mm[wire, "table_4_elongation"] for wire in wires]
    return (
        f"With the paper's own parameters and its eq. (5) as printed, {holds} of {len(wires)} wires keep the platform "
        "within 0.3 mm at the home pose. Equation (5) gives every wire the elongation of the tested sample; if creep "
        "is a strain, as it must be for longer wires to creep more, the drift is "
        f"{min(factors):.1f} to {max(factors):.1f} times as large. The rest of the difference comes from parameters "
        "that fit all holds of the test, and from other places in the workspace."
    )


def _computed(tables: Tables, gallery: Gallery) -> Section:
    rows = tables["sampling"]
    done = sum(r["converged"] for r in rows)
    words = Text(
        f"{done} of {len(rows)} fits converged: four independent ensembles each, nested R-hat at most 1.01, at least "
        "4000 effective draws of every parameter. Evaluations count everything, burn-in and the search for modes "
        "included; autocorrelation time and ESS are those of the worst parameter."
    )
    prior = Text("Prior predictions of each test (grey), and the measurements:")
    return Section("How it was computed", [words, paper_tables.sampling(rows), prior, *gallery("prior")], folded=True)


_SECTIONS: tuple[tuple[tuple[str, ...], Callable[[Tables, Gallery], Section]], ...] = (
    (("measured", "posterior", "held_out"), _summary),
    (("measured",), _measured),
    (("least_squares",), _table_4),
    (("posterior",), _known),
    ((), _figures),
    ((), _cannot_know),
    (("held_out",), _held_out),
    (("creep",), _creep),
    (("robot",), _robot),
    (("sampling",), _computed),
    (("least_squares",), _table_4_otherwise),
)
