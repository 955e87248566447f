"""The page of ``wirebayes batch``: how many experiments have which verdict, outlying specimens, and the table."""

from collections import Counter
from pathlib import Path

from wirebayes.answers.headline import batch_in_sentences
from wirebayes.discovery.settings import ALPHA
from wirebayes.io.run_folder import read_json
from wirebayes.json_files.batch import BatchJson, OutlierRow, Row
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
    seed_of_page,
)
from wirebayes.report.cells import NONE, with_unit
from wirebayes.report.drawn import drawn
from wirebayes.report.glossary import meaning
from wirebayes.report.pictures.batch import specimens_of_materials
from wirebayes.results.outliers import FALSE_ALARMS, LEAST_SPECIMENS
from wirebayes.results.parameters import unit_of
from wirebayes.sentences import spoken

_MOST_WARNINGS = 10  # shown at once; more push the summary's pictures off the screen
_MOST_ROWS = 500  # a page of more takes seconds to open; the CSV holds all
_SHOWN = ("k1", "B", "U", "k2", "N")


def batch_page(folder: Path, configuration: Configuration) -> Page:
    """The content of ``batch.json``."""
    found: BatchJson = read_json(folder / "batch.json")
    rows = found["experiments"]
    far = found["outliers"]
    fitted = [row for row in rows if row["parameters"]]
    lead, *others = batch_in_sentences(found)
    summary = _summary(others, rows, fitted, far)
    sections = [Section("Summary", summary)]
    warned: list[Block] = before_the_answer(found)
    warned += beside_the_answer(found)
    if warned:
        many = len(found["warnings"]) > _MOST_WARNINGS
        sections.append(Section("Warnings", warned, folded=many))
    sections.append(Section("Outlying specimens", _outliers(fitted, far)))
    is_long = len(rows) > 50
    sections.append(Section("Experiments", _table(rows), folded=is_long))
    sections.append(files_beside(folder, _FILES))
    terms = ("90 % interval", "p", "robust z")
    effects = _effects_in(fitted)
    sections.append(meaning(terms, effects))
    footer = seed_of_page(configuration)
    return Page("Many experiments", lead, sections, footer)


def _effects_in(fitted: list[Row]) -> list[str]:
    """All that the page names."""
    effects = []
    for row in fitted:
        effects += row["effects"]
        effects.append(row["best_effect"] or "")
    return effects


def _summary(sentences: list[str], rows: list[Row], fitted: list[Row], far: list[OutlierRow]) -> list[Block]:
    """What was found, the parameters of all specimens, and how far to trust them."""
    blocks: list[Block] = [Text(sentence) for sentence in sentences]
    if fitted:
        source = drawn(specimens_of_materials(fitted, far))
        picture = Picture(source, "Parameters of all specimens by material.", _PICTURE, wide=True)
        blocks.append(Pictures([picture]))
    blocks.append(Columns([_reliability(rows)]))
    return blocks


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
    points = []
    stopped = [row["name"] for row in rows if row["converged"] is False]
    if stopped:
        points.append(f"Not converged: {_some(stopped)}.")
    checked = sum(row["p_global"] is not None for row in rows)
    if checked:
        by_chance = number(ALPHA * checked, 2)
        points.append(
            f"If nothing were missing anywhere, about {by_chance} of {checked} checks would fail by "
            f"chance, each at its level of {ALPHA:g}."
        )
    odd = [row["name"] for row in rows if row["warnings"]]
    if odd:
        points.append(f"Suspicious readings or fits: {_some(odd)}; see the warnings.")
    return Points("How far it can be trusted", points or ["All fits converged."])


_COMPARED = "Of B, the creep per metre of length at the typical tension; of k2, k2 t^N after the typical hold."


def _outliers(fitted: list[Row], far: list[OutlierRow]) -> list[Block]:
    specimens = Counter(row["material"] for row in fitted if row["material"])
    small = sorted(material for material, count in specimens.items() if count < LEAST_SPECIMENS)
    if len(small) == len(specimens):
        none = f"None is looked for: that takes {LEAST_SPECIMENS} specimens or more of one material."
        return [Text(none)]
    rule = (
        "A specimen is an outlier when a parameter's median is farther from the median of its material than the "
        f"scatter of the others and its own uncertainty explain. If all specimens are "
        f"alike, {100 * FALSE_ALARMS:g} % of materials have an outlier by chance."
    )
    if small:
        rule += f" Not compared, with fewer than {LEAST_SPECIMENS} specimens: {_some(small)}."
    if not far:
        return [Text("No specimen is an outlier of its material.", strong=True), Text(rule)]
    lines = []
    for row in far[:_MOST_ROWS]:
        which = [row["experiment"], row["material"], row["parameter"]]
        figures = [number(row["value"]), number(row["median"]), number(row["z"], 2)]
        lines.append([*which, *figures])
    header = ["experiment", "material", "parameter", "its median", "median of the material", "robust z"]
    table = Table(header, lines, _COMPARED)
    return [table, Text(rule)]


def _table(rows: list[Row]) -> list[Block]:
    shown = rows[:_MOST_ROWS]
    parameters = [with_unit(name, unit_of(name)) for name in _SHOWN]
    header = ["experiment", "material", "converged", *parameters, "verdict", "most probable"]
    caption = "Posterior medians; intervals stand in summary.csv."
    if len(rows) > len(shown):
        caption = f"The first {len(shown)} of {len(rows)}. {caption}"
    return [Table(header, [_line(row) for row in shown], caption)]


def _line(row: Row) -> list[str]:
    """One experiment's row of the table."""
    medians = [_value(row, name) for name in _SHOWN]
    verdict = row["verdict"] or row["check"] or NONE
    return [
        row["name"],
        row["material"] or NONE,
        {True: "yes", False: "no", None: NONE}[row["converged"]],
        *medians,
        row["error"] or verdict.replace("-", " "),
        spoken(row["best_effect"]) if row["best_effect"] else NONE,
    ]


def _value(row: Row, name: str) -> str:
    parameter = row["parameters"].get(name)
    return NONE if parameter is None else number(parameter["q50"])


def _some(names: list[str], most: int = 10) -> str:
    shown = ", ".join(names[:most])
    return f"{shown} and {len(names) - most} more" if len(names) > most else shown
