"""Units in the names of columns and keys: another unit is named with its factor, never mistaken for a typing error."""

import math
import re
from collections.abc import Sequence
from difflib import get_close_matches

# What one of each unit is, in the unit that the files use.
_FACTORS: dict[str, dict[str, float]] = {
    "mm": {"m": 1e3, "cm": 10.0, "um": 1e-3, "µm": 1e-3, "μm": 1e-3, "km": 1e6, "in": 25.4, "inch": 25.4, "ft": 304.8},
    "N": {
        "kN": 1e3, "MN": 1e6, "mN": 1e-3, "uN": 1e-6, "µN": 1e-6, "μN": 1e-6, "cN": 1e-2, "daN": 10.0, "kgf": 9.80665,
        "kp": 9.80665, "kg": 9.80665, "gf": 9.80665e-3, "g": 9.80665e-3, "t": 9806.65, "tf": 9806.65,
        "lbf": 4.4482216152605, "lb": 4.4482216152605, "lbs": 4.4482216152605, "ozf": 0.27801385095378125,
        "oz": 0.27801385095378125,
    },
    "rad": {"deg": math.pi / 180.0, "degree": math.pi / 180.0, "degrees": math.pi / 180.0},
    "s": {"ms": 1e-3, "us": 1e-6, "µs": 1e-6, "μs": 1e-6, "min": 60.0, "h": 3600.0, "hr": 3600.0, "d": 86400.0},
}  # fmt: skip
_FACTORS["m"] = {unit: factor / 1e3 for unit, factor in (_FACTORS["mm"] | {"mm": 1.0}).items() if unit != "m"}
_TEMPERATURES = {"F": "°C = (°F - 32) / 1.8", "K": "°C = K - 273.15"}
_LONGEST = 80  # a word that is longer is no misspelt name, and is not compared with one
_NAME = re.compile(r".*?[\s_\-/([]+°?(?P<unit>[^\W\d_]+)[\])]?")


def hint(word: str, known: Sequence[str]) -> str:
    """A hint for a word that is not known, or nothing.

    Parameters
    ----------
    known : sequence of str
        What is expected; a last part ``_mm``, ``_m``, ``_rad``, ``_N``, ``_s`` or ``_C`` is a unit.

    Returns
    -------
    str
        The nearest known word, or, where `word` names the same quantity in another unit, the factor between the two.
        A word in one unit is never suggested for a word in another.
    """
    if len(word) > _LONGEST:
        return ""
    unit = _unit(word) or _unit_without_a_gap(word, known)
    if unit:
        converted = _converted(word, unit, known)
        if converted:
            return converted
    candidates = [name for name in known if not unit or _in_the_same_unit(unit, _unit(name))]
    close = get_close_matches(word, candidates, 1)
    return f" (did you mean {close[0]}?)" if close else ""


def _unit_without_a_gap(word: str, known: Sequence[str]) -> str:
    """What stands behind the quantity of a known name, as in ``lengthmm``."""
    for name in known:
        quantity = name.rpartition("_")[0]
        rest = word[len(quantity) :]
        if quantity and rest and word.lower().startswith(quantity.lower()):
            return rest
    return ""


def _converted(word: str, unit: str, known: Sequence[str]) -> str:
    """The hint that a word names a known quantity in another unit, or nothing."""
    quantity = word.rstrip("])")[: -len(unit)].strip("_ -/([°")
    convertible: dict[str, str] = {}
    for name in known:
        conversion = _conversion(unit, _unit(name)) if _unit(name) else ""
        if conversion:
            convertible.setdefault(name.rpartition("_")[0], f" (another unit: {conversion}; convert it to {name})")
    match = get_close_matches(quantity.lower(), list(convertible), 1)
    return convertible[match[0]] if match else ""


def _in_the_same_unit(unit: str, other: str) -> bool:
    """Whether a name's last part is no other unit."""
    return other not in (*_FACTORS, "C") or other.lower() == unit.lower()


def _unit(name: str) -> str:
    """The last part of a name, which may be a unit: letters after an underscore, a space or a bracket."""
    match = _NAME.fullmatch(name)
    return match["unit"] if match else ""


def _conversion(unit: str, expected: str) -> str:
    """How a unit is turned into the expected one; nothing for the same unit, or for another quantity's."""
    if expected == "C":
        return _TEMPERATURES.get(unit, "")
    factors = _FACTORS.get(expected, {})
    alike = [known for known in factors if known.lower() == unit.lower()]
    if unit not in factors and len(alike) == 1 and unit != expected:  # mN and MN differ in more than spelling
        unit = alike[0]
    return f"1 {unit} = {factors[unit]:.10g} {expected}" if unit in factors else ""
