"""Experiment files: TOML that says what was done, beside a CSV of the readings."""

import json
import os
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any
from unicodedata import normalize

from wirebayes.errors import InputError, shown
from wirebayes.io import mistaken_table
from wirebayes.io.experiment import ENOUGH, Experiment, enough, folder_key, holds_and_readings, in_sequence
from wirebayes.io.readings import HANGS_FREE, READ, SET, STRETCH, Hold, checked_readings, readings_table
from wirebayes.numeric.frozen import frozen
from wirebayes.strict.files import given_path, read_text
from wirebayes.strict.hint import hint
from wirebayes.strict.table import LARGEST, CsvTable
from wirebayes.strict.toml_keys import Keys
from wirebayes.wire.control import READ_UNIT
from wirebayes.wire.protocol import Control

_KEYS = (
    "name",
    "material",
    "length_mm",
    "resolution_N",
    "resolution_mm",
    "readings",
    "control",
    "preload_mm",
    "unrecorded_holds",
    "prior",
)
Entry = dict[str, Any]  # of a hold without a record: before_hold, what was set, duration_s
RESOLUTION: dict[Control, str] = {"displacement": "resolution_N", "force": "resolution_mm"}
_NAME = re.compile(r"[A-Za-z0-9._-]{1,100}", re.ASCII)
# a folder beside the results' own files, and a name beside the key of the warnings
_TAKEN = re.compile(
    r"\.{1,2}|\.(lock|computing|checkpoint)|summary\.csv|warnings|.*\.(json|html|svg|partial)", re.IGNORECASE
)
SAME_FOLDER = "where upper and lower case are one, both would have the same folder of results"
SHORTEST = 1e-3  # mm, below any specimen; strains of far shorter ones overflow


def select(experiments: list[Experiment], name: str | None) -> list[Experiment]:
    """All experiments, or the named one.

    Raises
    ------
    InputError
        When there is none of that name.
    """
    if name is None:
        return experiments
    names = [experiment.name for experiment in experiments]
    if name not in names:
        raise InputError(
            f"{experiments[0].source}: found no experiment {shown(name)}{hint(name, names)}, "
            f"expected one of {', '.join(names)}"
        )
    return [experiments[names.index(name)]]


def read_experiments(path: str | Path) -> list[Experiment]:
    """Read an experiment file and the CSV files beside it.

    Parameters
    ----------
    path : str or Path
        A TOML file in the format of the reference page "experiment file".

    Returns
    -------
    list of Experiment
        In order of the file.

    Raises
    ------
    InputError
        On anything wrong, with the file, the line and column or the key, what was found and what was expected.

    Examples
    --------
    >>> import wirebayes as wb
    >>> [test.name for test in wb.read_experiments("experiments.toml")]
    ['roc-line-1m', 'roc-line-1.71m', 'nylon-1.5m', 'kite-1.5m']
    """
    source = given_path("path", path)
    try:
        text = read_text(source, "TOML with at least one [[experiment]]")
        top = Keys.of_file(source, text)
    except InputError as error:
        raise mistaken_table.complaint(source, error) from None
    if "leg" in top.table:
        raise top.complain("leg", "a robot's file", "tests, [[experiment]]; robots are read by wirebayes pose")
    top.only(("experiment", "prior"))
    tables = top.tables("experiment")
    shared = top.priors()
    lines = {name: top.line(f"prior.{name}") for name in shared}
    experiments: list[Experiment] = []
    for keys in tables:
        experiment = _read_one(keys, shared, lines)
        refuse_second(keys, experiment.name, [other.name for other in experiments])
        experiments.append(experiment)
    return experiments


def refuse_second(keys: Keys, name: str, others: Sequence[str]) -> None:
    """Refuse a name that another table of the file has, or whose folder of results would be that table's.

    Parameters
    ----------
    keys : Keys
        Of the table.
    name : str
    others : sequence of str
        Names of the tables before it.
    """
    if name in others:
        raise keys.complain("name", shown(name) + " a second time", "a name used once in the file")
    taken = {folder_key(other): other for other in others}
    if folder_key(name) in taken:
        found = f"{shown(name)} beside {shown(taken[folder_key(name)])}"
        raise keys.complain("name", found, f"another name: {SAME_FOLDER}")


def length_of(keys: Keys) -> float:
    """The length of a sample, mm."""
    largest = LARGEST["displacement_mm"]
    expected = f"a length above 0 mm, from {SHORTEST:.0e} to {largest:.0e} mm"
    return keys.number("length_mm", expected, least=SHORTEST, most=largest)


def _read_one(keys: Keys, shared: dict[str, dict[str, Any]], shared_lines: dict[str, int]) -> Experiment:
    keys.only(_KEYS)
    experiment = experiment_of(keys, lambda: readings_table(_readings_path(keys)))
    lines = shared_lines | {parameter: keys.line(f"prior.{parameter}") for parameter in experiment.priors}
    return replace(experiment, priors=shared | experiment.priors, prior_lines=lines)


def experiment_of(keys: Keys, readings: Callable[[], CsvTable]) -> Experiment:
    """Check what is said of one test, then its readings.

    Parameters
    ----------
    keys : Keys
        ``name``, ``material``, ``length_mm`` and the optional keys of an experiment file.
    readings : function that returns a CsvTable
        Called once the keys before the readings are known to be right.

    Raises
    ------
    InputError
    """
    expected = "a name of letters, digits, '.', '_' and '-', at most 100, for a folder of results"
    name = keys.string("name", expected)
    if not _NAME.fullmatch(name):
        raise keys.complain("name", shown(name), expected)
    if _TAKEN.fullmatch(name):
        raise keys.complain("name", shown(name), f"{expected}, and not one that results have for themselves")
    expected = "a name of at most 100 characters without '/', '\\' or control characters"
    # one spelling of an accent: as two letters it would be another material
    material = normalize("NFC", keys.string("material", expected))
    if (
        len(material) > 100
        or _TAKEN.fullmatch(material.strip())
        or any(c in "/\\" or not c.isprintable() for c in material)
    ):
        raise keys.complain("material", shown(material), expected)
    length = length_of(keys)
    control = control_of(keys)
    resolution = _resolution(keys, control)
    priors = keys.priors()
    preload = _preload(keys, priors, length)
    table = readings()
    recorded = checked_readings(table, length, control)
    if not enough(recorded):
        raise keys.complain("readings", f"{holds_and_readings(recorded)} in {table.path.name}", ENOUGH)
    holds = _with_unrecorded(keys, recorded, length, control)
    return Experiment(
        name, material, length, resolution, holds, keys.source, priors, control=control, preload_mm=preload
    )


def control_of(keys: Keys) -> Control:
    """What the experiment sets; the displacement where it does not say."""
    expected = '"displacement" (displacements are set, tensions are read) or "force" (the reverse)'
    match keys.table.get("control", "displacement"):
        case "displacement":
            return "displacement"
        case "force":
            return "force"
        case other:
            raise keys.complain("control", shown(other), expected)


def _resolution(keys: Keys, control: Control) -> float:
    """The step to which readings were rounded; 0 where it is not stated."""
    key, unit = RESOLUTION[control], READ_UNIT[control]
    most = LARGEST[READ[control]]
    for other in RESOLUTION.values():
        if other != key and other in keys.table:
            raise keys.complain(other, other, f"{key}, because the test has control = {shown(control)}")
    if key not in keys.table:
        return 0.0
    return keys.number(key, f"a step above 0 {unit}, at most {most:.0e} {unit}, or no such key", above=0.0, most=most)


def _preload(keys: Keys, priors: dict[str, dict[str, Any]], length_mm: float) -> float | None:
    """The known stretch at displacement zero, which becomes the preload's prior."""
    if "preload_mm" not in keys.table:
        return None
    if "preload" in priors:
        raise keys.complain("preload_mm", "preload_mm beside prior.preload", "one of them")
    expected = f"a stretch above -{length_mm:g} mm, the wire's length, and of at most {STRETCH:g} times it"
    preload = keys.number("preload_mm", expected, above=-length_mm, most=STRETCH * length_mm)
    priors["preload"] = {"fixed": preload}
    return preload


def _readings_path(keys: Keys) -> Path:
    expected = "a CSV file inside this file's folder, relative to it"
    readings = keys.string("readings", expected)
    folder = keys.source.parent
    try:
        inside = not Path(readings).is_absolute() and (folder / readings).resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError, ValueError):  # a loop of links, a NUL in the name
        inside = False
    if not inside:
        raise keys.complain("readings", shown(readings), expected)
    if not os.path.isfile(folder / readings):
        raise keys.complain("readings", f"{shown(readings)}, which is no file there", expected)
    return folder / readings


def _with_unrecorded(keys: Keys, holds: tuple[Hold, ...], length_mm: float, control: Control) -> tuple[Hold, ...]:
    """Insert the unrecorded holds, each before the first recorded hold whose number reaches its `before_hold`."""
    entries = keys.elements("unrecorded_holds", f"a list of {{ before_hold, {SET[control]}, duration_s }}")
    numbers = [hold.number for hold in holds if hold.number is not None]
    last = int(numbers[-1])
    where = str(keys.table.get("readings", "the readings"))
    before: dict[int, list[Hold]] = {}
    known = None
    for index, entry in enumerate(entries):
        before_hold, unrecorded = _unrecorded(entry, last, where, length_mm, control)
        if control == "force" and unrecorded.setting == 0:
            unrecorded = replace(unrecorded, setting=HANGS_FREE * min(hold.setting for hold in holds))
        if entry.table == known:
            raise keys.complain(f"unrecorded_holds[{index}]", "the hold before it once more", "each hold once")
        known = entry.table
        next_number = next(number for number in numbers if number >= before_hold)
        before.setdefault(next_number, []).append(unrecorded)
    ordered: list[Hold] = []
    for hold in holds:
        if hold.number is not None:
            ordered += before.get(hold.number, [])
        ordered.append(hold)
    return in_sequence(tuple(ordered))


def _unrecorded(keys: Keys, last: int, where: str, length_mm: float, control: Control) -> tuple[int, Hold]:
    """One unrecorded hold, and the number of the hold that it came before.

    Parameters
    ----------
    last : int
        Number of the last recorded hold.
    where : str
        What errors call the readings.
    control : {"displacement", "force"}
    """
    keys.only(("before_hold", SET[control], "duration_s"))
    before = keys.whole("before_hold", f"a hold number from 0 to {last}, the last in {where}", 0, last)
    setting = _unrecorded_setting(keys, length_mm, control)
    longest = LARGEST["time_s"]
    expected = f"a duration of 0 s or more, at most {longest:.0e} s"
    duration = keys.number("duration_s", expected, least=0.0, most=longest)
    return before, Hold(None, setting, duration, frozen([]), frozen([]), control=control)


def _unrecorded_setting(keys: Keys, length_mm: float, control: Control) -> float:
    """The displacement or the tension of one unrecorded hold."""
    if control == "force":
        most = LARGEST["tension_N"]
        expected = f"a tension of 0 N (no weight) or more, at most {most:.0e} N"
        return keys.number("tension_N", expected, least=0.0, most=most)
    expected = f"a displacement above -{length_mm:g} mm, the wire's length, and of at most {STRETCH:g} times it"
    return keys.number("displacement_mm", expected, above=-length_mm, most=STRETCH * length_mm)


def toml_of(experiment: Experiment, comments: Sequence[str] = (), unrecorded: Sequence[Entry] = ()) -> str:
    """The experiment file of a test whose readings stand in ``NAME.csv`` beside it.

    Parameters
    ----------
    comments : sequence of str
        Sentences at its head.
    unrecorded : sequence of dict
        Holds without a record.
    """
    lines = [f"# {comment}" for comment in comments]
    lines.append("[[experiment]]")
    lines.append(f"name = {_string(experiment.name)}")
    lines.append(f"material = {_string(experiment.material)}")
    lines.append(f"length_mm = {float(experiment.length_mm)!r}")
    if experiment.control != "displacement":
        lines.append(f"control = {_string(experiment.control)}")
    if experiment.resolution:
        lines.append(f"{RESOLUTION[experiment.control]} = {float(experiment.resolution)!r}")
    lines.append(f"readings = {_string(experiment.name + '.csv')}")
    if unrecorded:
        entries = ", ".join(map(_toml_of_entry, unrecorded))
        lines.append(f"unrecorded_holds = [{entries}]")
    return "\n".join(lines) + "\n"


def _toml_of_entry(entry: Entry) -> str:
    """A hold without a record, as a table in a line."""
    values = ", ".join(f"{key} = {value!r}" for key, value in entry.items())
    return f"{{ {values} }}"


def _string(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)
