"""The page of ``wirebayes batch``: how many experiments have which verdict, outlying specimens, and the table."""

from collections import Counter
from pathlib import Path
from typing import Any

from wirebayes.answers.headline import batch_in_sentences
from wirebayes.discovery.settings import ALPHA
from wirebayes.io.run_folder import read_json
from wirebayes.json_files.batch import BatchJson, OutlierRow, Row
from wirebayes.report.blocks import (
    Block,
    Columns,
    Page,
    Picture,
    Pictures,
    Points,
    Section,
    Table,
    Text,
    before_the_answer,
    beside_the_answer,
    drawn,
    files_beside,
    number,
    seed_of_page,
    unit_text,
)
from wirebayes.report.glossary import meaning
from wirebayes.report.pictures.batch import specimens_of_materials
from wirebayes.results.outliers import FALSE_ALARMS, LEAST_SPECIMENS
from wirebayes.results.parameters import unit_of
from wirebayes.sentences import spoken

_MOST_WARNINGS = 10  # shown at once; more push the summary's pictures off the screen
_MOST_ROWS = 500  # a page of more takes seconds to open; the CSV holds all
_SHOWN = ("k1", "B", "U", "k2", "N")


def batch_page(folder: Path, configuration: dict[str, Any]) -> Page:
    """The content of ``batch.json``."""
    found: BatchJson = read_json(folder / "batch.json")
    rows, far = found["experiments"], found["outliers"]
    fitted = [row for row in rows if row["parameters"]]
    lead, *others = batch_in_sentences(found)
    first: list[Block] = [Text(sentence) for sentence in others]
    if fitted:
        alt = "Parameters of all specimens by material."
        picture = Picture(drawn(specimens_of_materials(fitted, far)), alt, _PICTURE, wide=True)
        first.append(Pictures([picture]))
    first.append(Columns([_reliability(rows)]))
    warned: list[Block] = [*before_the_answer(found), *beside_the_answer(found)]
    sections = [Section("Summary", first)]
    sections += [Section("Warnings", warned, folded=len(found["warnings"]) > _MOST_WARNINGS)] if warned else []
    sections += [Section("Outlying specimens", _outliers(fitted, far))]
    sections.append(Section("Experiments", _table(rows), folded=len(rows) > 50))
    sections.append(files_beside(folder, _FILES))
    effects = [effect for row in fitted for effect in (*row["effects"], row["best_effect"] or "")]
    sections.append(meaning(("90 % interval", "p", "robust z"), effects))
    return Page("Many experiments", lead, sections, seed_of_page(configuration))


_PICTURE = "Each dot is a specimen: its median and 90 % interval. Red ones are outliers of their material."
_FILES = (
    ("summary.csv", "a row an experiment, with intervals"),
    ("batch.json", "the same as JSON, with outliers"),
    ("*/discovery.json", "what one experiment's model is missing"),
    ("*/summary.json", "one experiment's parameters"),
    ("*/*.svg", "one experiment's readings against its models"),
    ("configuration.json", "the options of this run, with version and seed"),
)


def _reliability(rows: list[Row]) -> Points:
    stopped = [row["name"] for row in rows if row["converged"] is False]
    points = [f"Not converged: {_some(stopped)}."] if stopped else []
    checked = sum(row["p_global"] is not None for row in rows)
    if checked:
        points.append(
            f"If nothing were missing anywhere, about {number(ALPHA * checked, 2)} of {checked} checks would fail by "
            f"chance, each at its level of {ALPHA:g}."
        )
    odd = [row["name"] for row in rows if row["warnings"]]
    points += [f"Suspicious readings or fits: {_some(odd)}; see the warnings."] if odd else []
    return Points("How far it can be trusted", points or ["All fits converged."])


def _outliers(fitted: list[Row], far: list[OutlierRow]) -> list[Block]:
    specimens = Counter(row["material"] for row in fitted if row["material"])
    small = sorted(material for material, count in specimens.items() if count < LEAST_SPECIMENS)
    rule = (
        "A specimen is an outlier when a parameter's median is farther from the median of its material than the "
        f"scatter of the others and its own uncertainty explain. If all specimens are "
        f"alike, {100 * FALSE_ALARMS:g} % of materials have an outlier by chance."
    )
    rest = f" Not compared, with fewer than {LEAST_SPECIMENS} specimens: {_some(small)}." if small else ""
    if set(small) == set(specimens):
        none = f"None is looked for: that takes {LEAST_SPECIMENS} specimens or more of one material."
        return [Text(none)]
    if not far:
        return [Text("No specimen is an outlier of its material.", strong=True), Text(rule + rest)]
    lines = [
        [o["experiment"], o["material"], o["parameter"], number(o["value"]), number(o["median"]), number(o["z"], 2)]
        for o in far[:_MOST_ROWS]
    ]
    header = ["experiment", "material", "parameter", "its median", "median of the material", "robust z"]
    return [Table(header, lines, "B is per metre of length."), Text(rule + rest)]


def _table(rows: list[Row]) -> list[Block]:
    lines = [
        [
            row["name"],
            row["material"] or "–",
            {True: "yes", False: "no", None: "–"}[row["converged"]],
            *(_value(row, name) for name in _SHOWN),
            row["error"] or (row["verdict"] or row["check"] or "–").replace("-", " "),
            spoken(row["best_effect"]) if row["best_effect"] else "–",
        ]
        for row in rows[:_MOST_ROWS]
    ]
    header = ["experiment", "material", "converged", *map(_with_unit, _SHOWN), "verdict", "most probable"]
    more = f"The first {_MOST_ROWS} of {len(rows)}. " if len(rows) > _MOST_ROWS else ""
    return [Table(header, lines, more + "Posterior medians; intervals stand in summary.csv.")]


def _with_unit(name: str) -> str:
    unit = unit_text(unit_of(name))
    return f"{name}, {unit}" if unit else name


def _value(row: Row, name: str) -> str:
    return number(row["parameters"][name]["q50"]) if name in row["parameters"] else "–"


def _some(names: list[str], most: int = 10) -> str:
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")
