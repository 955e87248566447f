"""The readings of a sheet: where the header stands, whether a row of units follows, where the numbers begin and end."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from wirebayes.errors import InputError
from wirebayes.io.bench.quantities import ROLES, quantity_unit
from wirebayes.io.bench.sheet import Sheet, SheetRow, is_value
from wirebayes.io.bench.words import are_a_statistic, speaks_of_a_quantity

_ALIKE = 3  # rows that begin the readings: a preamble has a line of numbers now and then
LONGEST_HEADER = 200  # characters: names and units take a few words, prose is no header
LONGEST_MARK = 2  # characters: a number or a letter says nothing without the word specimen
_NUMBER_BEFORE = re.compile(r"^±?[-+−]?\d+([.,]\d+)?\s*")
_WORD = re.compile(r"[^\W\d_]+")
_LAST_WORD = re.compile(r"[^\s_/\[\]()]+")
_SETTINGS_IN_HEADER = (
    "; what was set in the hold of each column stands in the header, beside the time and each with its unit: "
    "Time (s), 1 mm, 2 mm, 3 mm; and the unit of the readings in the line above it: Force (N)"
)
_SHOWN = 5  # rows that show how many columns there are


@dataclass(frozen=True)
class RawTable:
    """Header and readings as they stand in a file.

    Attributes
    ----------
    sheet : Sheet
    header : tuple of str
    units : tuple of str
        Of the row of units under the header; empty texts where there is none.
    rows : tuple of SheetRow
    header_line : int
    above : tuple of str
        Of the row above the header, which may name specimens; empty texts where there is none.
    specimen : str
        Whose readings these are, where the file holds several side by side.
    turned : bool
        Whether the file has a column for each hold or time: then its columns are not those of the table.
    nameless : bool
        Whether there is no header: then columns are called by their numbers.
    pieces : tuple of (int, str)
        Of several files that were joined: the line after which each begins, and its name.
    """

    sheet: Sheet
    header: tuple[str, ...]
    units: tuple[str, ...]
    rows: tuple[SheetRow, ...]
    header_line: int
    above: tuple[str, ...] = ()
    specimen: str = ""
    turned: bool = False
    nameless: bool = False
    pieces: tuple[tuple[int, str], ...] = ()

    @property
    def whose(self) -> str:
        """The specimen, in words."""
        return f"specimen {self.specimen}" if len(self.specimen) <= LONGEST_MARK else self.specimen

    def place(self, line: int, column: int) -> str:
        """Where a cell stands."""
        name = f"{self.header[column]} of {self.whose}" if self.specimen else self.header[column]
        in_line = f"line {self.line_text(line)}"
        return f"{in_line} ({name})" if self.turned else f"{in_line}, column {self.sheet.column_name(column)} ({name})"

    def line_text(self, line: int) -> str:
        """A line as people find it: in its file, where several were joined."""
        begins = [(begin, name) for begin, name in self.pieces if begin < line]
        return f"{line - begins[-1][0]} of {begins[-1][1]}" if begins else str(line)

    def where(self, line: int, column: int) -> str:
        """The file, and where a cell stands in it."""
        return f"{self.sheet.path}, {self.place(line, column)}"

    def complain(self, line: int, column: int, found: str, expected: str) -> InputError:
        """The error for one cell.

        Parameters
        ----------
        line, column : int
            Of the sheet, from 0, rows above the readings included.
        found, expected : str
            As the message shows them.

        Returns
        -------
        InputError
            With the file and the cell, as the sheet counts; the caller raises it.
        """
        return InputError(f"{self.where(line, column)}: found {found}, expected {expected}")

    def column(self, column: int) -> list[str]:
        """The cells of a column."""
        if column not in self._columns:
            self._columns[column] = [row.cell(column) for row in self.rows]
        return self._columns[column]

    @cached_property
    def _columns(self) -> dict[int, list[str]]:
        """The columns asked for so far: most are, many times, and a recording has 100,000 rows."""
        return {}

    def check_names(self) -> None:
        """Refuse two columns of one name.

        Raises
        ------
        InputError
        """
        for column, name in enumerate(self.header):
            if name and name in self.header[:column]:
                where = f"line {self.header_line}, column {self.sheet.column_name(column)}"
                how = f"of several specimens, number the columns: {name} 1, {name} 2"
                if _NUMBER_BEFORE.match(name):
                    how = "what was set in the hold of each column is a length or a force with its unit, such as 2 mm"
                raise InputError(f"{self.sheet.path}, {where}: found {name} a second time, expected it once; {how}")


def find_table(sheet: Sheet) -> RawTable:
    """Find header, units and readings.

    Raises
    ------
    InputError
        There are no rows of numbers, or no header above them.
    """
    rows = sheet.rows
    first = _first(rows)
    if first is None:
        line = rows[0].line if rows else 1
        raise InputError(f"{sheet.path}, line {line}: found no rows of numbers, expected a header and readings")
    shown = rows[first : first + _SHOWN]
    above, units = _above_readings(rows[:first])
    if not above:
        return _without_header(sheet, first)
    *others, head = above
    if not _is_header(head) or _is_title(head, shown):
        return _without_header(sheet, first)
    _check_names_are_short(sheet, head)
    head = _joined_to_units(_beside_row_names(head, rows[first:]), rows[first:])
    width = max(len(row.cells) for row in (head, *shown))
    header = _padded(head.cells, width)
    names = _padded(others[-1].cells, width) if others else ()
    body = tuple(row for row in rows[first:] if not row.comment)
    header, names = _with_names_from_above(header, names, shown)
    _check_width(sheet, head, body, width)
    _check_gaps(sheet, head, body)
    _check_headers_repeat(sheet, rows[:first], head, body)
    return RawTable(sheet, header, _padded(units, width), body, head.line, names)


def _with_names_from_above(
    header: Sequence[str], above: Sequence[str], readings: Sequence[SheetRow]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Header and the row above it, with a name that stands there for both of them, as in a merged cell, in the header.

    The row then names two columns or more, and this one a quantity; a single cell is a title.
    """
    if sum(map(bool, above)) < 2:
        return tuple(header), tuple(above)
    names, left = [*header], [*above]
    for i, name in enumerate(above):
        has_values = any(is_value(row.cell(i)) for row in readings)
        if has_values and not header[i] and any(map(speaks_of_a_quantity, _WORD.findall(name))):
            names[i], left[i] = name, ""
    return tuple(names), tuple(left)


def _beside_row_names(head: SheetRow, below: Sequence[SheetRow]) -> SheetRow:
    """The header with an empty cell for the numbers 1, 2, 3 … that stand before each row and have no name in it."""
    readings = [row for row in below if not row.comment]
    one_more = all(len(row.cells) == len(head.cells) + 1 for row in readings)
    numbers = [str(i) for i in range(1, len(readings) + 1)]
    if not one_more or [row.cells[0] for row in readings] != numbers:
        return head
    return replace(head, cells=("", *head.cells))


def _joined_to_units(head: SheetRow, below: Sequence[SheetRow]) -> SheetRow:
    """The header with each unit beside its name, where the sign between cells parts them: ``Time, s,Force, N``."""
    names, units = head.cells[::2], head.cells[1::2]
    in_pairs = len(names) == len(units) and all(map(_is_a_unit, units)) and not any(map(_is_a_unit, names))
    if not in_pairs or any(len(row.cells) != len(names) for row in below if row.may_be_a_reading):
        return head
    return replace(head, cells=tuple(f"{name} [{unit}]" for name, unit in zip(names, units, strict=True)))


def _padded(cells: Sequence[str], width: int) -> tuple[str, ...]:
    """So many cells, empty ones at the end."""
    missing = max(width - len(cells), 0)
    return (*cells[:width], *[""] * missing)


def _above_readings(rows: Sequence[SheetRow]) -> tuple[list[SheetRow], tuple[str, ...]]:
    """The rows above readings up to the header, and the units that stand in a row below it."""
    above = [*rows]
    while len(above) > 1 and _is_subheading(above[-1]):
        above.pop()
    if len(above) > 1 and _are_ranges(above[-1]) and _names_more(above[-2], above[-1]):
        above.pop()
    above = _without_channels(above)
    units: tuple[str, ...] = ()
    if len(above) > 1:
        head, below = above[-2:]
        enough = max(2, len(below.filled))
        if _are_units(below) and len(head.filled) >= enough:
            units = tuple(cell.strip("[]() ") for cell in below.cells)
            above.pop()
    return _without_channels(above), units


def _without_header(sheet: Sheet, first: int) -> RawTable:
    """Readings without a header: their columns are called by their numbers."""
    body = tuple(row for row in sheet.rows[first:] if not row.comment)
    width = max(len(row.cells) for row in body[:_SHOWN])
    names = tuple(str(column + 1) for column in range(width))
    unnamed = sheet.also("no header")
    return RawTable(unnamed, names, ("",) * width, body, body[0].line, nameless=True)


def _is_title(row: SheetRow, readings: Sequence[SheetRow]) -> bool:
    """Whether a row of words above readings names nothing of them: no quantity, and fewer cells, or a comment's."""
    widths = [len(reading.cells) for reading in readings]
    other = len(row.cells) < min(widths) or (row.comment and len(row.cells) > max(widths))
    return other and not any(map(speaks_of_a_quantity, row.filled))


def _is_subheading(row: SheetRow) -> bool:
    """Whether a row between header and readings names a part of the test, as ``Cycle 1``."""
    return len(row.filled) == 1 and not is_value(row.filled[0]) and not row.comment and not _are_units(row)


def _are_ranges(row: SheetRow) -> bool:
    """Whether all cells are numbers with units, as the ranges of sensors under their names: ``500 N; 50 mm``."""
    if not all(map(_NUMBER_BEFORE.match, row.filled)):
        return False
    units = [_NUMBER_BEFORE.sub("", cell) for cell in row.filled]
    return all(any(quantity_unit(unit, role) for role in ROLES) for unit in units)


def _without_channels(above: list[SheetRow]) -> list[SheetRow]:
    """Rows above readings, without a last one of channels or sensors below one that names more quantities.

    A row of units may stand between the two; a row that has units itself is the header.
    """
    upper = next((row for row in reversed(above[:-1]) if not _are_units(row)), None)
    if upper is None or not _names_more(upper, above[-1]) or _are_units(above[-1]):
        return above
    named, below = (sum(map(speaks_of_a_quantity, row.filled)) for row in (upper, above[-1]))
    with_unit = any(_is_a_unit(_LAST_WORD.findall(cell)[-1]) for cell in above[-1].filled if _LAST_WORD.findall(cell))
    return above[:-1] if named > below and not with_unit else above


def _is_a_unit(text: str) -> bool:
    return any(quantity_unit(text, role) for role in ROLES)


def _names_more(row: SheetRow, below: SheetRow) -> bool:
    """Whether a row names as many columns as the one below it or more, each by another name."""
    names = set(row.filled)
    named = sum(map(speaks_of_a_quantity, names))
    return named > 1 and len(names) == len(row.filled) >= len(below.filled)


def _is_header(row: SheetRow) -> bool:
    """Whether a row names two columns or more, by words rather than by numbers."""
    return len(row.filled) > 1 and sum(map(is_value, row.filled)) <= len(row.filled) // 2


def _check_names_are_short(sheet: Sheet, head: SheetRow) -> None:
    for column, cell in enumerate(head.cells):
        if len(cell) > LONGEST_HEADER:
            where = f"line {head.line}, column {sheet.column_name(column)}"
            found = f"a header of {len(cell)} characters"
            raise InputError(f"{sheet.path}, {where}: found {found}, expected at most {LONGEST_HEADER}")


def _check_width(sheet: Sheet, head: SheetRow, body: Sequence[SheetRow], width: int) -> None:
    """Refuse values to the right of the header."""
    named = len(head.cells)
    remarks = sheet.described.startswith("spaces")  # one at the end of a line is as many cells as it has words
    for row in body:
        too_long = (len(row.cells) > width and not remarks) or any(map(is_value, row.cells[named:]))
        if too_long and row.may_be_a_reading:
            how = ""
            if row is body[0] and not row.cells[0]:  # numbers below a title that stands over all of them
                how = _SETTINGS_IN_HEADER
            elif "comma" in sheet.described:
                how = " (a comma as decimal sign needs another sign between cells)"
            raise InputError(
                f"{sheet.path}, line {row.line}, column {sheet.column_name(named)}: found {len(row.cells)} cells, "
                f"expected {named} as in the header of line {head.line}{how}"
            )


def _check_gaps(sheet: Sheet, head: SheetRow, body: Sequence[SheetRow]) -> None:
    """Refuse fewer numbers than elsewhere between spaces that stand in no columns: which is missing is not known."""
    named = len(head.cells)
    if not sheet.described.startswith("spaces"):
        return
    of_numbers = [row for row in body if row.may_be_a_reading and all(map(is_value, row.cells))]
    short = next((row for row in of_numbers if len(row.cells) < named), None)
    if short is not None and any(len(row.cells) == named for row in of_numbers):
        raise InputError(
            f"{sheet.path}, line {short.line}: found {len(short.cells)} numbers between spaces, expected {named} as in "
            f"the header of line {head.line}: the line does not show which is missing; write NaN in its place"
        )


def _check_headers_repeat(sheet: Sheet, above: Sequence[SheetRow], head: SheetRow, body: Sequence[SheetRow]) -> None:
    """Refuse a header between readings, or its row of units, that is another than the one above the first of them."""
    known = {_in_small_letters(row) for row in above}
    readings = [i for i, row in enumerate(body) if row.may_be_a_reading and not are_a_statistic(row.filled)]
    for row in body[: max(readings, default=0)]:
        if len(row.filled) == 1 or any(map(is_value, row.filled)) or _in_small_letters(row) in known:
            continue
        if _are_units(row) or sum(map(speaks_of_a_quantity, row.filled)) > 1:
            raise InputError(
                f"{sheet.path}, line {row.line}: found another header, {', '.join(row.filled)}, expected the one of "
                f"line {head.line}; readings in other columns or units belong in a file of their own"
            )


def _in_small_letters(row: SheetRow) -> tuple[str, ...]:
    return tuple(cell.casefold() for cell in row.cells)


def _first(rows: tuple[SheetRow, ...]) -> int | None:
    """The first row of readings: one that is followed by rows like it, in one of which a reading may be missing."""
    of_table = [i for i, row in enumerate(rows) if not row.comment]
    measured = {i: rows[i].may_be_a_reading for i in of_table}
    for place, i in enumerate(of_table):
        following = of_table[place : place + _ALIKE]
        gaps = [k for k in following if not measured[k]]
        if measured[i] and len(gaps) < 2 and all(_has_a_gap(rows[k]) for k in gaps):
            return i
    return None


def _has_a_gap(row: SheetRow) -> bool:
    """Whether a row may be one of readings of which one is missing: it begins with a value, a preamble with words."""
    return bool(row.filled) and is_value(row.filled[0])


def _are_units(row: SheetRow) -> bool:
    """Whether most cells are units, in brackets or not, or stand for none."""
    cells = [cell.strip("[]() ") for cell in row.filled]
    named = [cell for cell in cells if cell not in ("", "-", "–", "1", "#")]
    return 2 * sum(any(quantity_unit(cell, role) for role in ROLES) for cell in named) > len(named)
