"""Tests and protocols that stand in memory: columns of numbers, checked as the reader of files checks its own."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from wirebayes.errors import InputError
from wirebayes.io.experiment import Experiment
from wirebayes.io.experiment_file import experiment_of
from wirebayes.io.readings import OPTIONAL, READ, REQUIRED, protocol_columns
from wirebayes.strict.columns import columns_table, is_table, names_of
from wirebayes.strict.table import CsvTable, Header
from wirebayes.strict.toml_keys import Keys
from wirebayes.wire.protocol import Control

SOURCE = Path("from_arrays")  # stands where the file's name would: in errors and as an experiment's source


def from_arrays(
    hold: Any,
    displacement_mm: Iterable[float] | None = None,
    time_s: Iterable[float] | None = None,
    tension_N: Iterable[float] | None = None,
    *,
    length_mm: float,
    name: str,
    material: str,
    temperature_C: Iterable[float] | None = None,
    resolution_N: float = 0.0,
    resolution_mm: float = 0.0,
    unrecorded_holds: Sequence[Mapping[str, float]] | None = None,
    control: Control = "displacement",
    preload_mm: float | None = None,
) -> Experiment:
    """One test of one wire from columns in memory.

    The same rules hold as for the files of `read_experiments`.

    Parameters
    ----------
    hold : (r,) array of int, or DataFrame, or mapping
        Number of the hold of each reading; numbers rise and may skip. A table with the columns ``hold``,
        ``displacement_mm``, ``time_s``, ``tension_N`` and optionally ``temperature_C`` stands for all of them.
    displacement_mm, time_s, tension_N : (r,) array
        One value a row: position in mm, time since the hold began in s, tension in N. NaN in what is read says that the
        hold lasted until then and that nothing was read.
    length_mm : float
        Zero-tension length of the sample before the test.
    name : str
        Letters, digits, ``.``, ``_`` and ``-``: results are stored under it.
    material : str
        Samples of one material may be fitted together.
    temperature_C : (r,) array, optional
    resolution_N, resolution_mm : float
        Step to which tensions, or displacements with ``control="force"``, were rounded; 0 where they were not.
    unrecorded_holds : sequence of mapping, optional
        Holds without readings: ``before_hold``, what was set (``displacement_mm`` or ``tension_N``) and ``duration_s``
        each.
    control : {"displacement", "force"}
        What was set in each hold: the displacement, and tensions were read; or the tension (dead weights, force
        control), and displacements were read.
    preload_mm : float, optional
        The stretch at displacement zero, where it is known.

    Returns
    -------
    Experiment

    Raises
    ------
    InputError
        With the row (counted from 0) and the column, or the argument, what was found and what was expected.

    Examples
    --------
    >>> import wirebayes as wb
    >>> test = wb.from_arrays(
    ...     hold=[1, 1, 1, 2, 2, 2],
    ...     displacement_mm=[1, 1, 1, 2, 2, 2],
    ...     time_s=[0, 30, 60, 0, 30, 60],
    ...     tension_N=[2.12, 1.91, 1.86, 2.50, 2.27, 2.21],
    ...     length_mm=1200, name="my-wire", material="Dyneema 1 mm", resolution_N=0.01,
    ... )
    >>> test.tension().shape
    (2, 3)
    """
    columns: Any = hold
    if not is_table(hold):
        given = {"hold": hold, "displacement_mm": displacement_mm, "time_s": time_s, "tension_N": tension_N}
        columns = _stated(given)
    elif any(values is not None for values in (displacement_mm, time_s, tension_N)):
        raise InputError(f"{SOURCE}: found a table and single columns, expected one or the other")
    if temperature_C is not None:
        columns = {column: columns[column] for column in names_of(columns)}
        columns["temperature_C"] = temperature_C
    about: dict[str, Any] = {"name": name, "material": material, "length_mm": length_mm, "control": control}
    if resolution_N:
        about["resolution_N"] = resolution_N
    if resolution_mm:
        about["resolution_mm"] = resolution_mm
    if preload_mm is not None:
        about["preload_mm"] = preload_mm
    if unrecorded_holds is not None:
        about["unrecorded_holds"] = _tables(unrecorded_holds)
    experiment_name = name if isinstance(name, str) else ""
    keys = _Arguments(SOURCE, "", None, _plain(about), experiment_name)
    read = READ.get(control, "") if isinstance(control, str) else ""
    empty = (read, "temperature_C")

    def readings() -> CsvTable:
        return table_of(columns, SOURCE, REQUIRED, OPTIONAL, may_be_empty=empty)

    return experiment_of(keys, readings)


def _tables(given: Any) -> Any:
    """Mappings as the tables that a file would have; what is no list, or in it no mapping, as it is, to be refused."""
    if isinstance(given, str | Mapping) or not isinstance(given, Iterable):
        return given
    return [dict(each) if isinstance(each, Mapping) else each for each in given]


def _stated(values: Mapping[str, Any]) -> dict[str, Any]:
    """The arguments that are not left out."""
    return {name: value for name, value in values.items() if value is not None}


def protocol_of_columns(columns: Any, control: Control) -> CsvTable:
    """The table of a protocol from a DataFrame or a mapping of columns; NaN in what is read is an empty cell."""
    return table_of(columns, Path("protocol"), *protocol_columns(control), may_be_empty=(READ[control],))


def table_of(
    columns: Any, source: Path, required: Sequence[str], optional: Sequence[str], may_be_empty: Sequence[str] = ()
) -> CsvTable:
    """Columns in memory as the table that the readers of files check.

    Parameters
    ----------
    columns : DataFrame, or mapping of name to (r,) array
    source : Path
        What errors call it.
    required, optional : sequence of str
        Names of the columns.
    may_be_empty : sequence of str
        Columns in which NaN or None means that there is nothing.

    Raises
    ------
    InputError
        A column is missing or unknown, is not one value a row, or there are no rows.
    """
    table = columns_table(columns, source, lambda name: name in may_be_empty)
    table.check_header(Header(tuple(required), tuple((name,) for name in optional)))
    if not table.rows:
        raise InputError(f"{source}: found no readings, expected at least one")
    return table


class _Arguments(Keys):
    """Arguments of a call in place of the keys of a file."""

    def complain(self, key: str, found: str, expected: str) -> InputError:
        given = key.partition("[")[0] in self.table
        place = f", argument {self.prefix}{key}" if self.prefix or given or found == "nothing" else ""
        return InputError(f"{self.source}{place}: found {found}, expected {expected}")


def _plain(value: Any) -> Any:
    """Numbers of numpy's as Python's, so that the same checks hold."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_plain(item) for item in value]
    return value.item() if isinstance(value, np.generic) else value
