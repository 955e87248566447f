"""The refusal of a table that lacks a column of a quantity, with what a user may say of its columns."""

from collections.abc import Sequence

from wirebayes.errors import InputError
from wirebayes.io.bench.header import may_be, name_and_unit
from wirebayes.io.bench.quantities import UNITS, Role, quantity_unit
from wirebayes.io.bench.table import RawTable
from wirebayes.io.bench.undecided import Undecided
from wirebayes.io.bench.words import COUNTED, LETTERS, plain_letters, speaks_of, words_in
from wirebayes.sentences import listed

# Stands for the length of a turn or a step, or for the time between two readings, which only the user knows.
_ONE_COUNT: dict[Role, str] = {"displacement": "0.5 mm", "time": "0.5 s"}
_ONE_OF = {"displacement": "the length of one", "time": "the time between two readings"}
_FEWEST_RUNS = 3  # two may be two sensors
_MOST_TO_CHOOSE = 3  # options in a line; more are no help


def missing_columns(table: RawTable, unread: Sequence[int], missing: Sequence[Role]) -> Undecided:
    """The question which column is the first of the missing quantities, with the same question for the others.

    Parameters
    ----------
    table : RawTable
    unread : sequence of int
        Columns that are no quantity's yet.
    missing : sequence of Role
        Quantities that have no column.
    """
    role, *more = missing
    found = "found no column of"
    names = [name for name in table.header if name]
    in_doubt = _encoding_in_doubt(table, names)
    if table.nameless:
        found = "found numbers without a header, and no column of"
        first_row = table.rows[0].cells
        names = [f"{name} ({cell})" for name, cell in zip(names, first_row, strict=False)]
    place = f"{table.sheet.path}, line {table.header_line}: {found}"
    how = _how_to_say(table, unread, missing)
    wanted = "one of each" if more else "one"
    named = ", ".join(names)
    message = f"{place} {listed(missing, 'or')} among {named}, expected {wanted}{how}{in_doubt}"
    answers = {}
    for i in unread:
        header = table.header[i]
        answers[f"--map {header}={role}"] = header
    others = []
    if more:
        others.append(missing_columns(table, unread, more))
    return Undecided(f"{place} {role}", f"which column is the {role}", answers, others, message)


def check_settings_of_runs(table: RawTable, of_tension: Sequence[int]) -> None:
    """Refuse runs side by side, each with times and tensions of its own, of which nothing says what was set.

    Parameters
    ----------
    table : RawTable
        Without a column of displacement.
    of_tension : sequence of int
        Its columns that may be a tension.

    Raises
    ------
    InputError
    """
    of_time = [i for i, name in enumerate(table.header) if name and may_be(table, i, "time")]
    if not _FEWEST_RUNS <= len(of_tension) == len(of_time):
        return
    first, *_, last = (table.header[i] for i in of_tension)
    found = f"{len(of_tension)} columns of tension, {first} to {last}, each with its times, and none of displacement"
    expected = "a row above the header with what was set in each: 1 mm over the first column of one, 2 mm of the next"
    raise InputError(f"{table.sheet.path}, line {table.header_line}: found {found}, expected {expected}")


def _how_to_say(table: RawTable, unread: Sequence[int], missing: Sequence[Role]) -> str:
    """How a user says which columns the missing quantities are."""
    if not unread and missing == ["displacement"]:  # a record of tension over time
        return "; to a hold at one displacement add a column with it, the same in every row"
    if len(missing) == 1:
        options = " or ".join(_options(table, unread, missing[0]))
    else:
        likely = [_options(table, unread, role) for role in missing]
        options = " ".join(
            of_role[0] if len(of_role) == 1 else _stated_by_name(role)
            for role, of_role in zip(missing, likely, strict=True)
        )
    if table.nameless:
        options = options.replace("HEADER=", "N=")
        return f"; say which with {options}, N the number of the column"
    about_units = ""
    if "HEADER=" in options:
        about_units = " (HEADER is one of these names; leave the unit out if the name has one)"
    about_counts = ""
    for role, one in _ONE_COUNT.items():
        if one in options:
            about_counts += f" (with {_ONE_OF[role]} in place of {one})"
    return f"; say which with {options}{about_units}{about_counts}"


def _options(table: RawTable, unread: Sequence[int], role: Role) -> list[str]:
    """What to write for a missing quantity: the columns in a unit of it, if there are few; the user decides."""
    likely = [i for i in unread if quantity_unit(table.units[i], role) or name_and_unit(table.header[i], role).unit]
    likely = likely or [i for i in unread if quantity_unit(table.header[i], role)]  # named by nothing but its unit
    if 0 < len(likely) <= _MOST_TO_CHOOSE:
        return [f'--map "{table.header[i]}={role}"' for i in likely]
    letters = [i for i in unread if plain_letters(table.header[i]) in LETTERS.get(role, ())]
    if len(letters) == 1:  # t, x, F: names of quantities beside a unit, which is lacking
        return [f'--map "{table.header[letters[0]]}={role} [{UNITS[role]}]"']
    counts = []
    if role == "displacement":
        counts = [i for i in unread if words_in(table.header[i]) & COUNTED]
    elif role == "time":
        counts = [i for i in unread if _counts_rows(table, i)]
    if len(counts) == 1:
        return [f'--map "{table.header[counts[0]]}={role} [{_ONE_COUNT[role]}]"']
    return [_stated_by_name(role)]


def _stated_by_name(role: Role) -> str:
    return f'--map "HEADER={role} [{UNITS[role]}]"'


def what_is_counted(table: RawTable, index: int, role: Role) -> tuple[str, str] | None:
    """What a column without a unit counts in place of a quantity, and what one of it is; None where it does not count.

    Parameters
    ----------
    table : RawTable
    index : int
        Of the column.
    role : str
        The quantity.
    """
    header = table.header[index]
    if role == "displacement" and not words_in(header).isdisjoint(COUNTED):
        return "steps or turns that are counted", _ONE_OF[role]
    if role == "time" and not speaks_of(header, role) and _counts_rows(table, index):
        return "numbers that count the readings", _ONE_OF[role]
    return None


def _counts_rows(table: RawTable, index: int) -> bool:
    """Whether a column counts the readings: 1, 2, 3 …"""
    cells = table.column(index)
    if not all(cell.isdecimal() for cell in cells):
        return False
    first = int(cells[0])
    return all(int(cell) == first + i for i, cell in enumerate(cells))


def _encoding_in_doubt(table: RawTable, names: Sequence[str]) -> str:
    """A sentence that names may look wrong, for they were read by a code page; empty where there is no doubt."""
    encoding = table.sheet.encoding
    if encoding in ("utf-8", "utf-8-sig") or " ".join(names).isascii():
        return ""
    return f"; the file is not UTF-8 and was read as {encoding.upper()}: if names look wrong, save it as UTF-8"
