"""Units counted in shares or multiples of another: ``0.01 mm``, ``1/100 mm``, ``mm/100``."""

import re
from dataclasses import replace

from wirebayes.io.bench.quantities import Role, Unit, quantity_unit

COARSEST = 0.1  # of the graduations of gauges; of larger numbers before a unit a name may end: Force 2 N
_NUMBER = r"(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+]?\d+)?"
_BEFORE = re.compile(rf"([-−]?)\s*({_NUMBER})(?:\s*/\s*(\d+))?\s*[·×*]?\s*(\D.*)")
_AFTER = re.compile(r"(?P<unit>\D+?)\s*/\s*(?P<count>\d+)")


def multiple_of_unit(text: str, role: Role) -> Unit | None:
    """A number of units as one unit, or None where the text is none."""
    after = _AFTER.fullmatch(text.strip())
    if after:
        return _times(1.0, after["count"], after["unit"], text, role)
    before = _BEFORE.fullmatch(text.strip())
    if before is None:
        return None
    sign, number, divisor, unit = before.groups()
    return _times(float(number.replace(",", ".")), divisor or "1", sign + unit, text, role)


def _times(number: float, divisor: str, unit: str, text: str, role: Role) -> Unit | None:
    one = quantity_unit(unit, role)
    times = number / float(divisor) if float(divisor) else 0.0
    if one is None or one.clock is not None or one.offset or not times:
        return None
    return replace(one, text=text.strip(), factor=float(f"{times * one.factor:.12g}"), multiple=times)


def unit_in_header(text: str, role: Role) -> Unit | None:
    """A unit, or a graduation in it such as ``0.01 mm``: a whole number of times in a tenth of it or less."""
    unit = quantity_unit(text, role)
    if unit is not None:
        return unit
    share = multiple_of_unit(text, role)
    if share is None or share.multiple > COARSEST:
        return None
    times = 1.0 / share.multiple
    return share if abs(times - round(times)) < 1e-6 * times else None
