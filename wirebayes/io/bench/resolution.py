"""The step to which tensions were rounded, where the readings show it beyond doubt.

A likelihood adds the variance of rounding, step²/12, so a step that is too large widens every interval: only what all
readings agree on counts. Too small a step does no harm.
"""

import math
from collections.abc import Sequence
from decimal import Decimal

FEWEST = 10  # different readings: that all are multiples of ten times the step by chance is then one in 10^10
BY_CHANCE = 1e-6  # that different readings are all multiples of a step such as 0.02 or 0.05 while that is smaller
MOST_DIGITS = 9  # of a reading: more are a computed number's, not a display's
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
    whole = [int(value / unit) for value in values]
    common = max(math.gcd(*whole), 1)
    by_chance = common ** -len(values)
    coarse = common if by_chance < BY_CHANCE else 1
    step = float(unit * coarse)
    span = float(max(values) - min(values))
    if step > COARSEST * span:
        return None
    # one number of steps in ten ends in a zero: many more mean that the last place is not the display's
    steps = [number // coarse for number in whole]
    with_last_digit = sum(count % 10 != 0 for count in steps)
    if with_last_digit / len(steps) < 0.5:
        return None
    return step
