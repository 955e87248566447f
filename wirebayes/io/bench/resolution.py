"""The step to which tensions were rounded, where the readings show it beyond doubt.

A likelihood adds the variance of rounding, step²/12, so a step that is too large widens every interval: only what all
readings agree on counts. Too small a step does no harm.
"""

import math
from collections.abc import Sequence
from decimal import Decimal
from fractions import Fraction

FEWEST = 10  # different readings: that all are multiples of ten times the step by chance is then one in 10^10
BY_CHANCE = 1e-6  # that different readings are all multiples of a step such as 0.02 or 0.05 while that is smaller
MOST_DIGITS = 9  # of a reading: more are a computed number's, not a display's
BINARY_PARTS = (2, 4, 8, 16, 32, 64)  # no ruler is divided finer
COARSEST = 0.1  # of the range of the readings: a coarser grid may be the test's own doing


def evident_step(numbers: Sequence[str]) -> float | None:
    """The step of numbers as they were written.

    Parameters
    ----------
    numbers : sequence of str
        Plain decimal numbers.

    Returns
    -------
    float or None
        In their unit; None where it is not evident.
    """
    values = {Decimal(text).normalize() for text in numbers}
    if len(values) < FEWEST:
        return None
    parts = [value.as_tuple() for value in values]
    most_digits = max(len(part.digits) for part in parts)
    if most_digits > MOST_DIGITS:
        return None
    places = max(-int(part.exponent) for part in parts)
    unit = Decimal(1).scaleb(-places)
    step = max(_decimal_step(values, unit), _binary_step(values, unit))
    span = max(values) - min(values)
    if float(step) > COARSEST * float(span):
        return None
    # one number of steps in ten ends in a zero: many more mean that the last place is not the display's
    steps = [round(value / step) for value in values]
    with_last_digit = sum(count % 10 != 0 for count in steps)
    if with_last_digit / len(steps) < 0.5:
        return None
    return float(step)


def _decimal_step(values: set[Decimal], unit: Decimal) -> Decimal:
    """The largest number of units of the last place of which all values are multiples, not by chance."""
    common = max(math.gcd(*(int(value / unit) for value in values)), 1)
    return unit * common if common ** -len(values) < BY_CHANCE else unit


def _binary_step(values: set[Decimal], unit: Decimal) -> Decimal:
    """The half, quarter, eighth … of which all values are multiples, once rounded to the last place; else that place.

    Rulers in inches are read so, and kitchen scales in pounds.
    """
    if unit >= 1:
        return unit
    per_whole = int(1 / unit)
    last_places = {int(value / unit) % per_whole for value in values}
    for parts in BINARY_PARTS:
        if parts >= per_whole:
            break
        marks = _marks(parts, per_whole)
        by_chance = (len(marks) / per_whole) ** len(values)
        if last_places <= marks and by_chance < BY_CHANCE:
            return 1 / Decimal(parts)
    return unit


def _marks(parts: int, per_whole: int) -> set[int]:
    """Parts of a whole as they are written, in units of the last place; a tie, as .0625 to three places, either way."""
    exact = [Fraction(k * per_whole, parts) for k in range(parts)]
    down = {math.ceil(mark - Fraction(1, 2)) for mark in exact}
    up = {math.floor(mark + Fraction(1, 2)) % per_whole for mark in exact}
    return down | up
