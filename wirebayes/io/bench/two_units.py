"""Columns of one quantity in several units, ``Load (lbf)`` and ``Load (N)``: compared, so that one of them is read."""

from collections.abc import Sequence

import numpy as np

from wirebayes.io.bench.header import name_and_unit
from wirebayes.io.bench.multiples import unit_in_header
from wirebayes.io.bench.quantities import Role
from wirebayes.io.bench.table import RawTable
from wirebayes.numeric.typing import Floats

FINE = 0.005  # of the range: rounded to larger steps, sensors of two names look alike though they differ
ROUNDED = 0.51  # of a step: by how much a number was rounded, and a last binary digit
SAME_UNIT = 1e-4  # of a number: factors between units are printed to a few digits
FEWEST = 2  # different numbers, to compare


def finest_of_same(table: RawTable, likely: Sequence[int], role: Role) -> list[int]:
    """The column that is written to the finest step, if all say the same in different units; else all of them.

    A crosshead and an extensometer may agree but for the coarser one's rounding: other names need fine steps.

    Parameters
    ----------
    likely : sequence of int
        Columns that may be the quantity.
    role : str
        The quantity.
    """
    columns = []
    for index in likely:
        column = _converted(table, index, role)
        if column is None:
            return [*likely]
        columns.append(column)
    factors = {factor for _, _, factor in columns}
    if len(factors) < len(columns):
        return [*likely]
    first, step, _ = columns[0]
    steps = [own for _, own, _ in columns]
    names = {name_and_unit(table.header[i], role).name.strip().lower() for i in likely}
    if len(names) > 1 and max(steps) > FINE * np.ptp(first):
        return [*likely]
    if len(set(first)) < FEWEST:
        return [*likely]
    for values, own, _ in columns:
        rounding = ROUNDED * (own + step) + SAME_UNIT * np.abs(first)
        agree = np.abs(values - first) <= rounding
        if not agree.all():
            return [*likely]
    finest = int(np.argmin(steps))
    return [likely[finest]]


def _converted(table: RawTable, column: int, role: Role) -> tuple[Floats, float, float] | None:
    """Numbers in our unit, the step to which they are written, and the unit's factor; None where they are not plain."""
    unit = unit_in_header(table.units[column], role) or name_and_unit(table.header[column], role).unit
    cells = [cell.replace(",", ".") for cell in table.column(column)]
    if unit is None or unit.of_sample or unit.offset:
        return None
    try:
        values = np.array([float(cell) for cell in cells])
    except ValueError:
        return None
    places = max(len(cell.partition(".")[2]) for cell in cells)
    return values * unit.factor, abs(unit.factor) * 10.0**-places, unit.factor
