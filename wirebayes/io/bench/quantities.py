"""Units as benches write them: which quantity a unit belongs to, and how it is turned into mm, s, N or °C."""

import re
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from wirebayes.io.bench.compound_times import Announced, announced

Role = Literal["hold", "displacement", "time", "tension", "temperature"]
ROLES: tuple[Role, ...] = get_args(Role)
UNITS: dict[Role, str] = {"displacement": "mm", "time": "s", "tension": "N", "temperature": "°C"}
COMMON: dict[Role, tuple[str, ...]] = {
    "displacement": ("mm", "cm", "m", "in"), "time": ("s", "min", "h", "ms", "d"), "tension": ("N", "kN", "kgf", "lbf"),
    "temperature": ("°C", "°F", "K"),
}  # fmt: skip
# What strains and stresses may be in, where a column of that name says no unit; or it is a length or a force after all.
OF_SAMPLE: dict[Role, tuple[str, ...]] = {"displacement": ("mm/mm", "%", "mm"), "tension": ("MPa", "N")}

# Spellings that pint does not know, or knows as something else.
_SPELLINGS = {
    "tag": "d", "tage": "d", "jour": "d", "jours": "d", "dia": "d", "dias": "d", "días": "d", "giorno": "d",
    "giorni": "d", "dagen": "d", "woche": "week", "wochen": "week", "semaines": "week", "semanas": "week",
    "sek": "s", "sek.": "s", "sekunden": "s", "sekunde": "s", "secs": "s", "sec.": "s", "segundos": "s",
    "secondes": "s",
    "min.": "min", "mins": "min", "minuten": "min", "minutos": "min", "std": "h", "std.": "h", "hrs": "h",
    "stunden": "h", "heures": "h", "newton": "N", "newtons": "N", "kn": "kN", "kp": "kgf", "pond": "gf", "p": "gf",
    "kg-f": "kgf", "kg_f": "kgf", "lb-f": "lbf", "lb_f": "lbf", "lbsf": "lbf", "lbs": "lb", "n": "N",
    "sekunder": "s", "minuter": "min", "timmar": "h", "tim": "h", "tim.": "h", "dygn": "d", "dagar": "d",
    "sekund": "s", "sekundy": "s", "minut": "min", "minuty": "min", "hod": "h", "hod.": "h", "hodin": "h",
    "hodiny": "h", "dny": "d", "mp": "s", "mp.": "s", "másodperc": "s", "perc": "min", "óra": "h", "nap": "d",
    "sn": "s", "sn.": "s", "saniye": "s", "dk": "min", "dk.": "min", "dakika": "min", "saat": "h", "gün": "d",
    "millis": "ms", "micros": "µs", "millimeter": "mm", "inches": "inch", "\"": "inch",
    "毫米": "mm", "厘米": "cm", "米": "m", "ミリ": "mm", "秒": "s", "分": "min", "分钟": "min", "小时": "h", "牛": "N",
    "牛顿": "N", "千牛": "kN", "千克": "kg", "公斤": "kg", "克": "g",
    "мм": "mm", "см": "cm", "м": "m", "мкм": "µm", "с": "s", "сек": "s", "мин": "min", "ч": "h", "мс": "ms", "н": "N",
    "χιλ.": "mm", "χιλιοστά": "mm", "εκ.": "cm", "εκατοστά": "cm", "δευτ.": "s", "δευτερόλεπτα": "s", "λεπτά": "min",
    "ώρες": "h", "ημέρες": "d", "ν": "N", "κιλά": "kg", "γραμμάρια": "g",
    "кн": "kN", "кгс": "kgf", "гс": "gf", "кг": "kg", "г": "g",
}  # fmt: skip
_DAY = "dag"  # in Dutch and the Scandinavian languages; ten grams elsewhere
_TEMPERATURES = {
    "c": "degC", "°c": "degC", "ºc": "degC", "℃": "degC", "degc": "degC", "deg c": "degC", "celsius": "degC",
    "f": "degF", "°f": "degF", "ºf": "degF", "℉": "degF", "degf": "degF", "deg f": "degF", "fahrenheit": "degF",
    "k": "kelvin", "kelvin": "kelvin",
}  # fmt: skip
# Elongations as a share of the length.
_STRAINS = {
    "%": 0.01, "percent": 0.01, "prozent": 0.01, "‰": 0.001, "mm/mm": 1.0, "m/m": 1.0, "in/in": 1.0, "mm/m": 0.001,
    "µm/m": 1e-6, "um/m": 1e-6, "µε": 1e-6, "ustrain": 1e-6, "microstrain": 1e-6, "strain": 1.0, "ε": 1.0,
}  # fmt: skip
# Tons are of 2000 lb, of 2240 lb or of 1000 kg: what is called so is asked about.
TONS = {"short_ton": "2000 lb", "long_ton": "2240 lb", "tonne": "1000 kg"}
_TON = {"ton", "tons"}
_LETTER = r"[^\W\d_]"
_UNIT = re.compile(rf"[-−]?({_LETTER}|[°º℃℉\"])({_LETTER}|[°º._ -]){{0,15}}")
_SQUARE = re.compile(r"(\^|\*\*)?2$|²$")
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
    clock : Announced or None
        How clocks are written, such as ``a:b``, where values are none of plain numbers.
    is_mass : bool
        A mass that stands for its weight.
    of_sample : bool
        A strain, which is times the sample's length in mm, or a stress, which is times its area in mm².
    multiple : float
        How many of a unit with a name it is.
    """

    text: str
    factor: float = 1.0
    offset: float = 0.0
    clock: Announced | None = None
    is_mass: bool = False
    of_sample: bool = False
    multiple: float = 1.0

    def convert(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values in our unit; to fifteen digits, as factors are binary and units decimal; clocks count from 1970.

        Units with a zero of their own to nine decimals: a difference of large numbers has fewer digits.
        """
        if self.factor == 1.0 and self.offset == 0.0:
            return values
        if self.offset != 0.0:
            return np.round(values * self.factor + self.offset, 9)
        return np.array([float(f"{value * self.factor:.15g}") for value in values])


def quantity_unit(text: str, role: Role) -> Unit | None:
    """A unit of a quantity, or None where the text is none.

    A minus before it changes the sign. Where a force is needed, a mass stands for its weight (kg, g, lb) and a stress
    for that on the sample's area; a strain stands for a displacement.
    """
    text = text.strip()
    if role == "hold":
        return None
    clock = announced(text) if role == "time" else None
    if clock is not None:
        return Unit(text, clock=clock)
    bare = text.lstrip("-−").strip()
    sign = -1.0 if bare != text else 1.0
    share = _of_sample(bare, role)
    if share is not None:
        return Unit(text, sign * share, of_sample=True)
    if not _UNIT.fullmatch(text) or is_ton(bare):
        return None
    if role == "temperature":
        name = _TEMPERATURES.get(bare.lower())
    else:
        name = "d" if role == "time" and bare.lower() == _DAY else _spelling(bare)
    found = None if name is None else _converted(name, role)
    if found is None:
        return None
    return Unit(text, sign * found[0], found[1], is_mass=found[2])


def is_ton(text: str) -> bool:
    """Whether a text is a ton, of which there are several."""
    return text.lower() in _TON


def _of_sample(text: str, role: Role) -> float | None:
    """The factor of a unit of strain, to a share of the length, or of stress, to MPa."""
    if role == "displacement":
        return _STRAINS.get(text.lower().replace("μ", "µ"))
    return _stress(text) if role == "tension" else None


@cache
def _stress(text: str) -> float | None:
    numerator, slash, area = text.partition("/")
    if slash and not _SQUARE.search(area):
        return None
    spelled = f"{_spelling(numerator)}/({_SQUARE.sub('', area)})**2" if slash else text
    return _factor(spelled, "MPa") if _UNIT.fullmatch(numerator) else None


def is_foreign(text: str) -> bool:
    """Whether a text is the unit of a quantity that no column has: a speed, a voltage, a titre."""
    text = text.strip().replace("²", "**2").replace("^", "**")
    if len(text) < 2 and text != "V":
        return False  # a letter tells one sensor from another
    try:
        return bool(_registry().parse_units(text))
    except Exception:  # pint raises whatever its parser raises
        return False


def _spelling(text: str) -> str:
    if text.endswith("N") or text == "Nm":  # mN and MN, a torque and a nanometre differ in more than spelling
        return text.replace("Nm", "N*m").replace("KN", "kN")
    return _SPELLINGS.get(text.lower(), text)


@cache
def _converted(name: str, role: Role) -> tuple[float, float, bool] | None:
    """Factor, offset, and whether it is a mass."""
    units = _registry()
    target = units.parse_units(_PINT[role])
    for spelling in dict.fromkeys((name, name.lower())):
        try:
            unit = units.parse_units(spelling)
        except Exception:  # pint raises whatever its parser raises
            continue
        is_mass = role == "tension" and unit.dimensionality == units.kilogram.dimensionality
        if is_mass:
            unit = unit * units.standard_gravity
        if unit.dimensionality != target.dimensionality:
            continue
        zero = float(units.Quantity(0.0, unit).to(target).magnitude)
        one = float(units.Quantity(1.0, unit).to(target).magnitude)
        return float(f"{one - zero:.12g}"), float(f"{zero:.12g}"), is_mass
    return None


def _factor(text: str, target: str) -> float | None:
    """What a value in a unit is multiplied by to be in another; None where it is no unit, or of another quantity."""
    units = _registry()
    try:
        return float(f"{units.Quantity(1.0, units.parse_units(text)).to(target).magnitude:.12g}")
    except Exception:  # pint raises whatever its parser raises
        return None


@cache
def _registry() -> Any:
    import pint  # a second to load: only where there are units to read

    return pint.UnitRegistry()
