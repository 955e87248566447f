"""The experiment out of a raw file, checked as one of an experiment file is, and that file."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from wirebayes.errors import InputError
from wirebayes.io.bench.about import About
from wirebayes.io.bench.columns import Column, Columns
from wirebayes.io.bench.quantities import UNITS
from wirebayes.io.bench.recorded import Cycles
from wirebayes.io.bench.table import RawTable
from wirebayes.io.bench.table_numbers import COLUMN_ROLES
from wirebayes.io.bench.undecided import Undecided, quoted
from wirebayes.io.data_checks import falls
from wirebayes.io.experiment import Experiment
from wirebayes.io.experiment_file import RESOLUTION, Entry, experiment_of
from wirebayes.io.readings import SET
from wirebayes.strict.table import CsvTable
from wirebayes.strict.toml_keys import Keys
from wirebayes.wire.protocol import Control


def check_direction(table: RawTable, column: Column, experiment: Experiment, mapping: Sequence[str]) -> None:
    """Refuse a displacement counted downwards: the wire pulls the more, the further it is below zero.

    Under weights zero may be anywhere, and a gauge may read less and less: then the user is asked.

    Parameters
    ----------
    table : RawTable
        Whose place the error names.
    column : Column
        Of the displacement.
    experiment : Experiment
        Read with it.
    mapping : sequence of str
        What the user says of columns.
    """
    holds = experiment.recorded_holds
    place = np.array([np.mean(hold.displacement_mm) for hold in holds])
    pull = np.array([np.mean(hold.tension_N) for hold in holds])
    if not falls(place, pull):
        return
    lowest = f"{place.min():g} mm"
    highest = place.max()
    first_line = table.rows[0].line
    turned = _turned(column)
    as_it_stands = f"{column.header}={column.role} [{UNITS[column.role]}]"
    by_weights = experiment.control == "force"
    if by_weights and as_it_stands not in mapping and _step_down(experiment):
        where = table.where(first_line, column.index)
        found = f"found displacements that fall from {highest:g} to {lowest} as the weights rise"
        answers = {turned: "it counts down", f"--map {as_it_stands}": "as it stands"}
        raise Undecided(f"{where}: {found}", "how it counts", answers)
    if highest > 0:
        return
    found = f"displacements down to {lowest}, the further down the more tension"
    expected = f"what lengthens the wire counted up; change the sign with {quoted(turned)}"
    raise table.complain(first_line, column.index, found, expected)


def _step_down(experiment: Experiment) -> bool:
    """Whether displacements jump down at every larger weight, and up at every smaller one."""
    for before, after in pairwise(experiment.recorded_holds):
        jump = after.displacement_mm[0] - before.displacement_mm[-1]
        move = after.setting - before.setting
        if jump * move > 0.0:
            return False
    return True


def _turned(column: Column) -> str:
    """The option that turns the sign of a column."""
    unit = column.unit.text if column.unit else UNITS[column.role]
    return f"--map {column.header}={column.role} [{unit[1:] if unit[0] in '-−' else f'-{unit}'}]"


def as_experiment(
    table: RawTable,
    columns: Columns,
    header: tuple[str, ...],
    rows: list[list[Any]],
    origin: list[int],
    about: About,
    resolution: float | None,
    control: Control,
    unrecorded: Sequence[Entry],
) -> Experiment:
    """The experiment checked as the reader of files checks its own, blaming the raw file's lines.

    Parameters
    ----------
    columns : dict of Role to Column
        Of the table, which errors name.
    header : tuple of str
        Columns of the readings' CSV.
    rows : list of list
        Its rows.
    origin : list of int
        The row of the table that each comes from.
    resolution : float or None
        Step of what is read, N or mm.
    control : {"displacement", "force"}
    unrecorded : sequence of dict
        Holds without a record, as an experiment file states them.
    """
    keys = {"name": about.name, "material": about.material or about.name, "length_mm": about.length_mm}
    extra: dict[str, Any] = {"control": control} if control != "displacement" else {}
    extra |= {RESOLUTION[control]: resolution} if resolution else {}
    extra |= {"unrecorded_holds": list(unrecorded)} if unrecorded else {}

    def readings() -> CsvTable:
        texts = [["" if value is None else repr(value) for value in row] for row in rows]
        return _RawReadings(table.sheet.path, list(header), texts, table, columns, origin)

    return experiment_of(_Options(table.sheet.path, "", None, keys | extra), readings)


@dataclass(frozen=True)
class _RawReadings(CsvTable):
    """Readings whose complaints name the line and column of the raw file."""

    raw: RawTable
    columns: Columns
    origin: list[int]

    def complain(self, row: int, column: str, found: str, expected: str) -> InputError:
        tension, displacement = (quoted(_turned(self.columns[role])) for role in ("tension", "displacement"))
        both = f"the signs with {displacement} {tension}"
        expected = expected.replace("the signs of displacement_mm and of tension_N", both)
        expected = expected.replace("the sign of tension_N", f"the sign with {tension}")
        return super().complain(row, column, found, expected)

    def place(self, row: int, column: str) -> str:
        role = COLUMN_ROLES[column]
        known = self.columns.get(role) or self.columns["displacement"]
        return self.raw.place(self.raw.rows[self.origin[row]].line, known.index)


class _Options(Keys):
    """Options of a command in place of the keys of a file."""

    def complain(self, key: str, found: str, expected: str) -> InputError:
        if key == "readings":
            return InputError(f"{self.source}: found {found.partition(' in ')[0]}, expected {expected}")
        return InputError(f"--{key.replace('_', '-')}: found {found}, expected {expected}")


def entries_of(cycles: Sequence[Cycles], control: Control) -> list[Entry]:
    """Cycles as an experiment file states holds without a record."""
    return [
        {"before_hold": c.before_hold, SET[control]: c.setting, "duration_s": round(c.end_s - c.begin_s, 3)}
        for c in cycles
    ]
