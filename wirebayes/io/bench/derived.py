"""Columns of what was made of a quantity: ten times it, its logarithm, what it changed by. They are asked about."""

import re

from wirebayes.io.bench.header import name_and_unit
from wirebayes.io.bench.quantities import Role, Unit
from wirebayes.io.bench.table import RawTable
from wirebayes.io.bench.undecided import Undecided
from wirebayes.io.bench.words import words_in

_FACTOR = re.compile(
    r"(?:^|[\s\d])[x×*·]\s?(?P<ten>10+)(?:\^(?P<power>-?\d))?(?!\w)"  # Force x10, and no axis x1
    r"|(?<![\w.,])(?P<before>10+)\s?[x×](?!\w)"  # Force 10x, and no box of 2x
    r"|(?<![\d\s])\s?/\s?(?P<divisor>[2-9]|\d{2,})(?!\w)"  # Force/2, and no sensor 1/2
)
DECIMALS = 1  # of a change that somebody makes
_ANY = {"log", "lg", "ln", "increment", "inkrement", "added", "additional"}
# A change in length is a displacement, one of the force is no force.
_WORDS: dict[Role, set[str]] = {
    "displacement": _ANY,
    "time": _ANY,
    "tension": _ANY
    | {"change", "difference", "loss", "drop", "per", "delta", "δ", "δf", "df", "anderung", "kraftanderung", "abfall"},
}


def check_itself(table: RawTable, index: int, role: Role, unit: Unit) -> None:
    """Ask what a factor beside a name means, or whether the column is the quantity itself where its name doubts it.

    Parameters
    ----------
    table : RawTable
    index : int
        Of the column.
    role : str
        The quantity.
    unit : Unit
        Of the column, as the file states it.

    Raises
    ------
    Undecided
    """
    header = table.header[index]
    name = name_and_unit(header, role).name
    map_to = f"--map {header}={role}"
    as_it_is = f"{map_to} [{unit.text}]"
    where = table.where(table.header_line, index)
    found = _FACTOR.search(name)
    if found is not None:
        times = _factor_of(found)
        beside_it = found[0].strip()
        answers = {
            f"{map_to} [{times:g} {unit.text}]": f"one is {times:g} {unit.text}",
            f"{map_to} [{1 / times:g} {unit.text}]": f"{times:g} are one {unit.text}",
            as_it_is: f"it is in {unit.text} already",
        }
        raise Undecided(f"{where}: found {beside_it!r} beside the name", "what it means", answers)
    doubtful = words_in(name) & _WORDS.get(role, set())
    if doubtful:
        word = min(doubtful)
        answers = {as_it_is: f"it is the {role}, whatever its name"}
        raise Undecided(f"{where}: found {word!r} in the name", f"that it is the {role} itself", answers)
    if role in ("displacement", "tension") and _are_signed(table, index):
        cell = next(cell for cell in table.column(index) if cell.startswith("+"))
        found_sign = f"found {cell}, with a sign as before a change, and in no other column"
        answers = {as_it_is: f"it is the {role} itself, and no change of it"}
        raise Undecided(f"{where}: {found_sign}", f"that it is the {role}", answers)


def _are_signed(table: RawTable, index: int) -> bool:
    """Whether one column alone has a sign before all its numbers but zero, as people write changes."""
    signed = [i for i in range(len(table.header)) if _has_signs([cell for cell in table.column(i) if cell])]
    return signed == [index]


def _has_signs(cells: list[str]) -> bool:
    """Whether cells have signs, and so few decimals as people write; instruments print signs, too."""
    if not any(cell.startswith("+") for cell in cells):
        return False
    if any(len(re.split("[.,]", cell)[-1]) > DECIMALS for cell in cells if re.search("[.,]", cell)):
        return False
    return all(cell[0] in "+-\u2212" or not cell.strip("0.,") for cell in cells)


def _factor_of(found: re.Match[str]) -> float:
    if found["divisor"] or found["before"]:
        return float(found["divisor"] or found["before"])
    return float(10 ** (int(found["power"]) if found["power"] else len(found["ten"]) - 1))
