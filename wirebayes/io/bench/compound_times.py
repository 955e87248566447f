"""Times in two units or three: as headers announce them (h-min, hh:mm:ss), and as cells spell them (1 h 30 min)."""

import re
from dataclasses import dataclass

HOURS = r"hh?|hrs?|hours?|std\.?|stunden?|heures?|horas?|ore"
MINUTES = r"mm?|mn|mins?\.?|minut[eo]s?|minuten|minuti"
SECONDS = r"ss?|secs?\.?|seconds?|sek\.?|sekunden?|secondes?|segundos?|secondi"
_DAYS = r"d|days?|tage?|jours?|dias?|días?|giorn[oi]|dagen|dag"
_AND = r"\s+(?:and|und|et|y|e|en)\s+"
_JOINT = rf"(?:{_AND}|\s*[:.,'\-–_]\s*|\s+)"
_FRACTION = r"(?:[.,](?:f+|0+|x+|z+|s+|ms))?"
_ANNOUNCED = re.compile(
    rf"(?P<hours>{HOURS})(?P<of_hours>{_JOINT})(?:{MINUTES})(?P<seconds>{_JOINT}(?:{SECONDS}){_FRACTION})?"
    rf"|(?:{MINUTES})(?P<of_minutes>{_JOINT})(?:{SECONDS}){_FRACTION}",
    re.IGNORECASE,
)
_ORDER = re.compile(  # of a date, in the languages of the columns, and how a clock behind it is written
    r"(?:(?P<day_first>[dtjg]{1,2}([./-])m{1,2}\2)|m{1,2}([./-])d{1,2}\3)[yja]{2,4}(?:[ T]+(?P<clock>.+))?",
    re.IGNORECASE,
)
_SPELT = re.compile(
    rf"(?:(?P<days>\d+)\s*(?:{_DAYS})[\s,]*)?(?:(?P<clock>\d{{1,2}}:\d\d:\d\d(?:[.,]\d+)?)"
    rf"|(?:(?P<hours>\d+)\s*(?:{HOURS})[\s,]*)?(?:(?P<minutes>\d+)\s*(?:{MINUTES}|['′])[\s,]*)?"
    rf"(?:(?P<seconds>\d+(?:[.,]\d+)?)\s*(?:{SECONDS}|''|[\"″]))?(?P<rest>\d\d)?)",
    re.IGNORECASE,
)
_PRIMES = re.compile(r"['′]$|''$|″$")  # minutes, seconds; a straight double quote is an inch as well


@dataclass(frozen=True)
class Announced:
    """What a header says of the clocks under it.

    Attributes
    ----------
    leading_s : float or None
        Of the first part where cells have two; None where they have three.
    joint : str
        What stands between the first two parts.
    day_first : bool or None
        Whether dates begin with the day, else with the month; None where nothing is said of dates.
    """

    leading_s: float | None
    joint: str
    day_first: bool | None = None


def announced(text: str) -> Announced | None:
    """How a text such as ``h-min``, ``hh:mm:ss`` or ``mm/dd/yyyy`` says times are written; None where it does not."""
    order = _ORDER.fullmatch(text)
    if order is not None:
        of_clock = announced(order["clock"] or "hh:mm:ss")
        leading_s = None if of_clock is None else of_clock.leading_s
        return Announced(leading_s, ":", day_first=order["day_first"] is not None)
    found = _ANNOUNCED.fullmatch(text)
    if found is None:
        return None
    if found["hours"] is None:
        return Announced(60.0, found["of_minutes"])
    return Announced(None if found["seconds"] else 3600.0, found["of_hours"])


def spelt_s(cell: str) -> float | None:
    """Seconds of a cell that names its units, as ``1 h 30 min``, ``1h30``, ``2'30''``, ``30 s`` or ``1 day, 0:10:00``.

    None of others, but for a clock alone. A part after a larger one counts to 59, or to 23, and has two digits where it
    does not name its unit.
    """
    found = _SPELT.fullmatch(cell)
    if found is None or not any(found.group("days", "clock", "hours", "minutes", "seconds")):
        return None
    days = 86400.0 * float(found["days"] or 0)
    if found["clock"]:
        hours, minutes, seconds = (float(part.replace(",", ".")) for part in found["clock"].split(":"))
        return None if minutes >= 60.0 or seconds >= 60.0 else days + 3600.0 * hours + 60.0 * minutes + seconds
    rest = found["rest"]
    if rest and found["seconds"]:
        return None
    hours, minutes, seconds = (
        float((found[part] or "0").replace(",", ".")) for part in ("hours", "minutes", "seconds")
    )
    if rest and found["minutes"]:
        seconds = float(rest)
    elif rest:
        minutes = float(rest)
    too_many = (
        found["days"]
        and hours >= 24.0
        or found["hours"]
        and minutes >= 60.0
        or (found["hours"] or found["minutes"])
        and seconds >= 60.0
    )
    return None if too_many else days + 3600.0 * hours + 60.0 * minutes + seconds


def is_spelt(cell: str) -> bool:
    """Whether a cell names a time in two units or more, or by primes; another unit alone may be any quantity's."""
    found = _SPELT.fullmatch(cell)
    parts = 0 if found is None else sum(map(bool, found.groups()))
    return (parts > 1 or (parts == 1 and bool(_PRIMES.search(cell)))) and spelt_s(cell) is not None
