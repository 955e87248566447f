"""Units as benches write them: which quantity a unit belongs to, and how it is turned into mm, s, N or °C."""

import re
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

Role = Literal["hold", "displacement", "time", "tension", "temperature"]
ROLES: tuple[Role, ...] = get_args(Role)
UNITS: dict[Role, str] = {"displacement": "mm", "time": "s", "tension": "N", "temperature": "°C"}
COMMON: dict[Role, tuple[str, ...]] = {
    "displacement": ("mm", "cm", "m", "in"), "time": ("s", "min", "h", "ms"), "tension": ("N", "kN", "kgf", "lbf"),
    "temperature": ("°C", "°F", "K"),
}  # fmt: skip
# seconds that the first number of a two-part clock counts; three parts leave no doubt
CLOCKS = {"mm:ss": 60.0, "m:ss": 60.0, "min:s": 60.0, "hh:mm": 3600.0, "h:mm": 3600.0, "hh:mm:ss": 1.0, "h:mm:ss": 1.0}

# Spellings that pint does not know, or knows as something else.
_SPELLINGS = {
    "sek": "s", "sek.": "s", "sekunden": "s", "sekunde": "s", "secs": "s", "sec.": "s", "segundos": "s",
    "secondes": "s",
    "min.": "min", "mins": "min", "minuten": "min", "minutos": "min", "std": "h", "std.": "h", "hrs": "h",
    "stunden": "h", "heures": "h", "newton": "N", "newtons": "N", "kn": "kN", "kp": "kgf", "pond": "gf", "p": "gf",
    "kg-f": "kgf", "kg_f": "kgf", "lb-f": "lbf", "lb_f": "lbf", "lbsf": "lbf", "lbs": "lb", "n": "N",
    "millimeter": "mm", "inches": "inch", "\"": "inch",
}  # fmt: skip
_TEMPERATURES = {
    "c": "degC", "°c": "degC", "ºc": "degC", "℃": "degC", "degc": "degC", "deg c": "degC", "celsius": "degC",
    "f": "degF", "°f": "degF", "ºf": "degF", "℉": "degF", "degf": "degF", "deg f": "degF", "fahrenheit": "degF",
    "k": "kelvin", "kelvin": "kelvin",
}  # fmt: skip
_UNIT = re.compile(r"[-−]?[A-Za-zµμ°º℃℉\"][A-Za-zµμ°ºC._ -]{0,15}")
_PINT = {"displacement": "mm", "time": "s", "tension": "N", "temperature": "degC"}


@dataclass(frozen=True)
class Unit:
    """A unit of one quantity.

    Attributes
    ----------
    text : str
        As it was written.
    factor, offset : float
        Of a value in the unit, to have it in ours.
    clock : float or None
        Where values are written ``a:b`` or ``a:b:c``: seconds of one of the first part of two.
    is_mass : bool
        A mass that stands for its weight.
    """

    text: str
    factor: float = 1.0
    offset: float = 0.0
    clock: float | None = None
    is_mass: bool = False

    def convert(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values in our unit; to twelve digits, as factors are binary and units decimal."""
        if self.factor == 1.0 and self.offset == 0.0:
            return values
        return np.array([float(f"{value * self.factor + self.offset:.12g}") for value in values])


def unit_of(text: str, role: Role) -> Unit | None:
    """A unit of a quantity, or None where the text is none.

    A minus before it changes the sign. Where a force is needed, a mass stands for its weight (kg, g, lb).
    """
    text = text.strip()
    if role == "hold":
        return None
    if role == "time" and text.lower() in CLOCKS:
        return Unit(text, clock=CLOCKS[text.lower()])
    if not _UNIT.fullmatch(text):
        return None
    bare = text.lstrip("-−").strip()
    name = _TEMPERATURES.get(bare.lower()) if role == "temperature" else _spelling(bare)
    found = None if name is None else _converted(name, role)
    if found is None:
        return None
    sign = -1.0 if bare != text else 1.0
    return Unit(text, sign * found[0], found[1], is_mass=found[2])


def _spelling(text: str) -> str:
    if text.endswith("N"):  # mN and MN differ in more than spelling
        return text
    return _SPELLINGS.get(text.lower(), text)


@cache
def _converted(name: str, role: Role) -> tuple[float, float, bool] | None:
    """Factor, offset, and whether it is a mass."""
    units = _registry()
    for spelling in dict.fromkeys((name, name.lower())):
        try:
            unit = units.parse_units(spelling)
        except Exception:  # pint raises whatever its parser raises
            continue
        target, is_mass = units.parse_units(_PINT[role]), False
        if role == "tension" and unit.dimensionality == units.kilogram.dimensionality:
            unit, is_mass = unit * units.standard_gravity, True
        if unit.dimensionality != target.dimensionality:
            continue
        zero, one = (float(units.Quantity(v, unit).to(target).magnitude) for v in (0.0, 1.0))
        return float(f"{one - zero:.12g}"), float(f"{zero:.12g}"), is_mass
    return None


@cache
def _registry() -> Any:
    import pint  # a second to load: only where there are units to read

    return pint.UnitRegistry()
