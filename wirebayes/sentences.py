"""Pieces of the sentences that people read on a terminal, on a page and in a message."""

import math
from collections.abc import Iterable, Sequence
from typing import Any

from wirebayes.json_files.discovery import SharedFindings


def listed(words: Sequence[str], last: str = "and") -> str:
    """Words as a sentence lists them."""
    if len(words) < 2:
        return words[0] if words else "nothing"
    return f"{', '.join(words[:-1])} {last} {words[-1]}"


def some_of(names: Sequence[str], most: int = 6) -> str:
    """Names as a sentence lists them, the first of many."""
    more = [f"{len(names) - most} more"] if len(names) > most else []
    return listed([*names[:most], *more])


def holds_in_words(numbers: Iterable[object]) -> str:
    """Holds by their numbers: hold 3, holds 3 and 4."""
    names = [str(number) for number in numbers]
    plural = "s" if len(names) > 1 else ""
    return f"hold{plural} {listed(names)}"


def counted(count: int, what: str) -> str:
    """How many there are of something, in words: 1 hold, 2 holds."""
    return f"{count} {what}{'s' * (count != 1)}"


def lasting(seconds: float) -> str:
    """A time as people say it: 45 s, 12 min, 24 h, 25 days."""
    if seconds >= _IN_DAYS:
        return f"{short(seconds / _DAY, 3)} days"
    unit, size = unit_of_time(seconds)
    return f"{short(seconds / size, 3)} {unit}"


def unit_of_time(seconds: float) -> tuple[str, float]:
    """The unit in which people say a time, and its seconds."""
    return next((unit, size) for unit, size in _TIMES if seconds >= size or size == 1.0)


def to_be_held(seconds: float) -> str:
    """A time that somebody is to set, to four digits: in hours or minutes where it is a whole number of them."""
    exact = round(seconds, 6)
    unit, size = next((unit, size) for unit, size in _TIMES if (exact and exact % size == 0) or size == 1.0)
    return f"{short(exact / size)} {unit}"


_DAY = 86400.0  # s
_IN_DAYS = 3.0 * _DAY  # from here on people do not say a time in hours
_TIMES = (("h", 3600.0), ("min", 60.0), ("s", 1.0))  # s, the longest first


def specimens_are(spread: float) -> str:
    """How much the wires of a robot are taken to differ: the share is a standard deviation."""
    return f"wires cut from one line differ by {100 * spread:g} %" if spread else "all wires are alike"


def spoken(effect: str) -> str:
    """An effect's name as people say it; files and options keep the name itself."""
    name, _, hold = effect.partition("@")
    at = f" at hold {hold}" if hold.isdigit() else _FORMS.get(hold, "")
    return "something unknown" if name == "unknown" else f"{name.replace('_', ' ')}{at}"


_FORMS = {"carried": " (recovered)", "strain": " (all along)"}  # of effects that stand beside their other form


def likely(found: SharedFindings) -> str:
    """Names of the set among which the largest share lies, each with its probability; empty where there is no name.

    Parameters
    ----------
    found : dict
        Of one experiment, as in ``discovery.json``.
    """
    shares = [(name, found["probabilities"][name]) for name in found["set"] if name in found["probabilities"]]
    ranked = sorted(shares, key=lambda item: (item[0] == "unknown", -item[1]))
    if all(name == "unknown" for name, _ in ranked):
        return ""
    said = {name: "none of the catalogue" if name == "unknown" else spoken(name) for name, _ in ranked}
    return listed([f"{said[name]} ({100 * p:.0f} %)" for name, p in ranked], "or")


def families_said(found: SharedFindings) -> list[str]:
    """Sentences of the established families that have several members.

    Parameters
    ----------
    found : dict
        Of one experiment, as in ``discovery.json``.
    """
    families = found.get("families", [])
    return [family["sentence"] for family in families if family["established"] and family["members"][1:]]


def undecided(found: SharedFindings) -> str:
    """What an ambiguous answer is undecided between: an established family in its own words, else the likely names.

    Parameters
    ----------
    found : dict
        Of one experiment, as in ``discovery.json``.
    """
    families = families_said(found)
    if families:
        return f"{listed(families)}; these readings do not tell which"
    return f"something is missing; these readings do not tell what: {likely(found)}"


def said_beside(found: SharedFindings) -> list[str]:
    """What is said beside the verdict: families that it does not speak of itself, and a remainder that does not count.

    Parameters
    ----------
    found : dict
        Of one experiment, as in ``discovery.json``.
    """
    out = [] if found["verdict"] == "ambiguous" else families_said(found)
    rest = found["remainder"]["probability"] if "remainder" in found else 0.0
    if found["verdict"] in ("named", "ambiguous") and rest > 0.5:
        out.append(f"something beyond it is likely ({100 * rest:.0f} %), but predicts nothing better")
    return out


def p_in_words(p: float, simulations: int) -> str:
    """A p-value with as much as its simulations can tell.

    Parameters
    ----------
    simulations : int
        Data sets of which it is a share: with them it cannot be less than one in all of them and the data.
    """
    floor = 1.0 / (simulations + 1)
    if p > 1.5 * floor:
        return f"p = {p:.2g}"
    return f"p < {10.0 ** math.ceil(math.log10(floor)):g}"


def quantity(middle: float, low: float, high: float, unit: str = "") -> str:
    """A number with its 90 % interval and unit, as a sentence has it.

    Parameters
    ----------
    middle, low, high : float
    unit : str
        As in files; 1 and - are none.
    """
    shown = unit_text(unit)
    return f"{number_within(middle, low, high)}{' ' if shown else ''}{shown} ({span(low, high)})"


def unit_text(unit: str) -> str:
    """A unit as people write it; nothing for a pure number."""
    return "" if unit in ("1", "-") else unit.replace("^-U", "⁻ᵁ").replace("^-N", "⁻ᴺ")


def short(value: float, digits: int = 4) -> str:
    """A number with at most so many digits, no zeros behind them and no exponent below 10^9: 6, 4.5, 1800, 2100000."""
    return f"{float(f'{value:.{digits}g}'):.9g}"


def coordinates(values: Iterable[float], digits: int = 4) -> str:
    """Metres or radians of a point or a turn; what is less than a millionth of one is zero."""
    return ", ".join(f"{value if abs(value) >= _NOTHING else 0:.{digits}g}" for value in values)


_NOTHING = 1e-6  # m or rad: no robot is set or measured so finely


def number(value: Any, digits: int = 3) -> str:
    """A number for people: significant digits, no exponent where none is needed; a dash for nothing."""
    if value is None or value != value:
        return "–"
    if isinstance(value, bool | str):
        return str(value)
    if isinstance(value, int):
        return f"{value:,}".replace(",", "\u202f").replace("-", "−")
    if value == 0:
        return "0"
    size = abs(value)
    if size >= 1e6 or size < 1e-4:
        mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
        return f"{mantissa}·10{''.join(_RAISED[c] for c in str(int(exponent)))}"
    decimals = max(0, digits - 1 - _order(value, digits))
    if size >= 10.0**_WHOLE:
        value = float(f"{value:.{max(digits, _WHOLE) - 1}e}")  # 612 400, not 612 429
    return f"{value:,.{decimals}f}".replace(",", "\u202f").replace("-", "−")


_WHOLE = 4  # digits of a large number that are shown at least, for years and newtons read oddly with fewer


def _order(value: float, digits: int) -> int:
    """Power of ten of the rounded value."""
    return int(f"{abs(value):.{digits - 1}e}".split("e")[1])


def span(low: Any, high: Any, digits: int | None = None) -> str:
    """An interval for people.

    Parameters
    ----------
    low, high : float
    digits : int, optional
        Significant ones; as many as `number_within` shows when left out.
    """
    ends = [number_within(end, low, high) if digits is None else number(end, digits) for end in (low, high)]
    return " … ".join(ends)


def from_to(low: float, high: float) -> str:
    """The least and the largest of several standard errors, to two digits; one number where they agree."""
    ends = number(low, 2), number(high, 2)
    return ends[0] if ends[0] == ends[1] else " … ".join(ends)


def middle_and_span(middle: float | None, low: float | None, high: float | None) -> list[str]:
    """A median and its interval, as two cells of a table.

    Parameters
    ----------
    middle, low, high : float
    """
    return [number_within(middle, low, high), span(low, high)]


def number_within(value: float | None, low: float | None, high: float | None) -> str:
    """A number for people beside its interval: three digits, or as many as show a fifth of the interval's width.

    Parameters
    ----------
    value, low, high : float
    """
    if not value or low is None or high is None or not 0 < high - low < math.inf:
        return number(value)
    shown = math.floor(math.log10(abs(value))) - math.floor(math.log10((high - low) / 5.0)) + 1
    return number(value, min(max(_DIGITS[0], shown), _DIGITS[1]))


_DIGITS = (3, 8)  # few enough to read; enough for 1e-6 of a number, finer than any bench reads
_RAISED = dict(zip("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻", strict=True))
