"""Specimens whose columns stand side by side in one table: each becomes a table of its own.

A row above the header names them over equal names of columns, or columns of equal names follow each other, or names
differ by a number, a letter or a word: ``Kraft 1; Weg 1; Kraft 2; Weg 2``. A specimen has a column of tensions and one
of displacements of its own; what has no such mark, as a common clock, belongs to all. Names that differ by a word are
those of two sensors as often as of two specimens, and so are two of one quantity alone: then ``--specimens`` decides.
"""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from wirebayes.io.bench.header import header_meant, is_of, name_and_unit
from wirebayes.io.bench.mapping import IGNORE
from wirebayes.io.bench.quantities import ROLES, Role
from wirebayes.io.bench.table import RawTable
from wirebayes.io.bench.undecided import Specimens, Undecided
from wirebayes.io.bench.unit_names import with_quantities
from wirebayes.io.bench.unread import speaks_of_specimens
from wirebayes.io.bench.words import speaks_of_a_quantity
from wirebayes.numeric.typing import Floats

SAME_WIRE = 0.005  # of the range: two sensors of one wire agree so well, and two specimens hardly
FEWEST = 3  # readings to compare
_BOTH: frozenset[Role] = frozenset({"tension", "displacement"})
_AGAIN = re.compile(r"(.+)\.\d+")  # what programs write for a name that was there already
_AXES = "XYZ"  # of one specimen, as two directions of a table
_TOKEN = re.compile(r"[^\W\d_]+|\d+")


@dataclass(frozen=True)
class _Marked:
    """The columns of a table, each with what tells its specimen from others, and its name without it.

    Attributes
    ----------
    mark, name, full : tuple of str
        Of each column: the specimen's mark, empty where there is none; the name that all specimens have in common; and
        the one by which a user means this column alone.
    certain : bool
        Whether marks can only be those of specimens.
    """

    mark: tuple[str, ...]
    name: tuple[str, ...]
    full: tuple[str, ...]
    certain: bool

    def own(self, mark: str) -> list[int]:
        """The columns of a specimen."""
        return [i for i, other in enumerate(self.mark) if other == mark]


def specimen_tables(
    table: RawTable, mapping: Sequence[str], stated: Specimens | None
) -> list[tuple[RawTable, tuple[str, ...]]]:
    """The table of each specimen, and what a user says of its columns.

    Parameters
    ----------
    mapping : sequence of str
        What the user says of columns: by a common name of every specimen's, by the whole name of one specimen's, which
        is then the only one that is read unless the column is to be ignored.
    stated : {"several", "one"} or None
        Whether columns side by side are of several specimens, where the user says so.

    Returns
    -------
    list of (RawTable, mapping)
        One that is the table itself where it holds one specimen.

    Raises
    ------
    InputError
        Two columns have one name and are not of two specimens; `Undecided` where two specimens read nearly the same.
    """
    table = with_quantities(table)
    marked = None
    if stated != "one":
        marked = _marked(table, mapping, stated == "several")
    if marked is None:
        table.check_names()
        return [(table, tuple(mapping))]
    marks = _specimens(table, marked)
    in_doubt = len(marks) > 1 and stated is None and not marked.certain
    if in_doubt and _read_alike(table, marked, marks):
        raise _sensors_or_specimens(table, marked, marks)
    wanted = _wanted(marked, marks, mapping)
    tables = [_table_of(table, marked, mark, marks) for mark in wanted]
    with_mapping = []
    for mark, each in tables:
        own = _mapping_of(marked, mark, tables, mapping)
        with_mapping.append((each, own))
    return with_mapping


def _sensors_or_specimens(table: RawTable, marked: _Marked, marks: Sequence[str]) -> Undecided:
    """The question whether columns with nearly the same numbers are of one specimen."""
    answers = {
        "--specimens several": "specimens of their own",
        "--specimens one": "one specimen, read by several sensors",
    }
    names = dict.fromkeys(table.header[i] for mark in marks[:2] for i in marked.own(mark)[:1])
    found = f"found {' and '.join(names)} with nearly the same numbers, and the columns beside them too"
    return Undecided(f"{table.sheet.path}, line {table.header_line}: {found}", "what they are of", answers)


def _wanted(marked: _Marked, marks: Sequence[str], mapping: Sequence[str]) -> list[str]:
    """The specimens whose columns a user names to be read; all of them where the user names none."""
    named = {_meant(marked, text) for text in mapping if _role(text) != IGNORE}
    wanted = [mark for mark in marks if mark in named]
    return wanted or list(marks)


def _marked(table: RawTable, mapping: Sequence[str], by_words: bool) -> _Marked | None:
    """The first way to tell specimens apart that finds two or more; None where none does."""
    ways = [_by_row_above(table), _by_repetition(table), _by_numbers(table)]
    if by_words:
        ways.append(_by_words(table))
    for way in ways:
        if way is None:
            continue
        way = replace(way, certain=way.certain or by_words)
        if len(_specimens(table, way)) < 2:
            continue
        ignored = [_column_meant(way, text) for text in mapping if _role(text) == IGNORE]
        names = ["" if i in ignored else name for i, name in enumerate(way.name)]
        left = replace(way, name=tuple(names))
        return left if _specimens(table, left) else None
    return None


def _by_row_above(table: RawTable) -> _Marked | None:
    """Marks that stand in the row above the header, each over its first column or over all of them."""
    labels = {label for label in table.above if label}
    if len(labels) < 2:
        return None
    marks, named, full = [], [], []
    last = ""
    for label, name in zip(table.above, table.header, strict=True):
        last = label or last
        marks.append(last)
        full.append(f"{last} {name}".strip())
        if name:
            named.append((last, name))
    names = {name for _, name in named}
    if len(set(named)) < len(named) or len(names) == len(named):
        return None
    return _Marked(tuple(marks), table.header, tuple(full), certain=True)


def _by_repetition(table: RawTable) -> _Marked | None:
    """Names that all come as often: the first of each is the first specimen's, and so on; ``Load.1`` repeats Load."""
    header = tuple(_without_count(name, table.header) for name in table.header)
    count = Counter(name for name in header if name)
    repeated = {name for name, times in count.items() if times > 1}
    if len({count[name] for name in repeated}) != 1:
        return None
    marks = []
    for i, name in enumerate(header):
        number = header[: i + 1].count(name)
        marks.append(str(number) if name in repeated else "")
    full = tuple(f"{name} {mark}".strip() for mark, name in zip(marks, header, strict=True))
    return _Marked(tuple(marks), header, full, certain=False)


def _without_count(name: str, names: Sequence[str]) -> str:
    """``Load`` of ``Load.1``, where both are among the names."""
    again = _AGAIN.fullmatch(name)
    return again[1] if again and again[1] in names else name


def _by_numbers(table: RawTable) -> _Marked:
    """Numbers or single letters in the names: ``F1``, ``Kraft Probe 2``, ``Force_A``; the first may have none."""
    split = [_without_number(name) for name in table.header]
    certain = all(speaks_of_specimens(header) for header, (mark, _) in zip(table.header, split, strict=True) if mark)
    names = {name for mark, name in split if mark}
    first = "0" if "1" in [mark for mark, _ in split] else "1"
    split = [(first, name) if not mark and name in names else (mark, name) for mark, name in split]
    return _Marked(tuple(mark for mark, _ in split), tuple(name for _, name in split), table.header, certain)


def _by_words(table: RawTable) -> _Marked:
    """Words in the names that are no quantity's: ``Roc force``, ``nylon force``."""
    mark, name = [], []
    for header in table.header:
        bare, unit = _unit_apart(header)
        words = _TOKEN.findall(bare)
        quantity = [word for word in words if speaks_of_a_quantity(word)]
        mark.append(" ".join(word for word in words if word not in quantity) if quantity else "")
        name.append(f"{' '.join(quantity)}{unit}" if quantity else header)
    return _Marked(tuple(mark), tuple(name), table.header, certain=True)


def _without_number(header: str) -> tuple[str, str]:
    """The number or the single letter in a name, and the name without it."""
    bare, unit = _unit_apart(header)
    tokens = _TOKEN.findall(bare)
    mark = [token for token in tokens if token.isdigit()]
    if not mark and len(tokens) > 1:
        mark = [token for token in tokens if len(token) == 1 and token.isupper() and token not in _AXES]
    kept = [token for token in tokens if token not in mark]
    return (mark[0], " ".join(kept) + unit) if len(mark) == 1 and kept else ("", bare + unit)


def _unit_apart(header: str) -> tuple[str, str]:
    """A header without its unit, and what is left of it."""
    for role in ROLES:
        bare, unit = name_and_unit(header, role)
        if unit is not None:
            return bare, f" [{unit.text}]"
    return header, ""


def _specimens(table: RawTable, marked: _Marked) -> list[str]:
    """The marks that have tensions and displacements of their own; one of both is enough where marks leave no doubt."""
    named = replace(table, header=marked.name)
    own: dict[str, set[Role]] = {mark: set() for mark in dict.fromkeys(marked.mark)}
    for i, mark in enumerate(marked.mark):
        own[mark] |= {role for role in _BOTH if marked.name[i] and is_of(named, i, role)}
    whole = [mark for mark, roles in own.items() if roles >= _BOTH]
    if len(whole) > 1 or not marked.certain:
        return whole
    kinds: tuple[Role, ...] = ("tension", "displacement")
    each = ([mark for mark, roles in own.items() if mark and role in roles] for role in kinds)
    return next((marks for marks in each if len(marks) > 1), [])


def _read_alike(table: RawTable, marked: _Marked, marks: Sequence[str]) -> bool:
    """Whether two specimens' numbers agree as those of two sensors do: nearly, and not exactly as what is set does."""
    named = replace(table, header=marked.name)
    for role in _BOTH:
        columns = [_first_of(named, marked.own(mark), role) for mark in marks[:2]]
        if None in columns:
            return False
        a, b = (_plain_numbers(table, column) for column in columns if column is not None)
        both = np.isfinite(a) & np.isfinite(b)
        if both.sum() < FEWEST:
            return False
        differences = np.abs(a - b)[both]
        apart = float(np.quantile(differences, 0.9))
        span = float(np.ptp(a[both]))
        if apart <= 0.0 or apart > SAME_WIRE * span:
            return False
    return True


def _first_of(table: RawTable, columns: Sequence[int], role: Role) -> int | None:
    """The first of some columns that is of a quantity."""
    for i in columns:
        if table.header[i] and is_of(table, i, role):
            return i
    return None


def _plain_numbers(table: RawTable, column: int) -> Floats:
    """A column's numbers as far as they can be read before the decimal sign is known; NaN elsewhere."""

    def number(cell: str) -> float:
        try:
            return float(cell.replace(",", "."))
        except ValueError:
            return float("nan")

    return np.array([number(cell) for cell in table.column(column)])


def _table_of(table: RawTable, marked: _Marked, mark: str, marks: Sequence[str]) -> tuple[str, RawTable]:
    """The table of one specimen: its columns, and those that belong to none."""
    own = set(marked.own(mark))
    own_names = {marked.name[i] for i in own}
    header = []
    for i, name in enumerate(table.header):
        is_common = marked.mark[i] not in marks and name not in own_names and marked.name[i]
        if i in own:
            header.append(marked.name[i])
        else:
            header.append(name if is_common else "")
    rows = tuple(row for row in table.rows if any(row.cell(i) for i in own))
    return mark, replace(table, header=tuple(header), rows=rows, specimen=mark or "1")


def _mapping_of(
    marked: _Marked, mark: str, tables: Sequence[tuple[str, RawTable]], mapping: Sequence[str]
) -> tuple[str, ...]:
    """What a user says, as far as it is of this specimen, with the names of its table."""
    own_header = next(each.header for m, each in tables if m == mark)
    of_all = {name for _, each in tables for name in each.header}
    out = []
    for text in mapping:
        before, _, meaning = text.rpartition("=")
        header = before.strip()
        is_own = header in own_header
        column = _column_meant(marked, text)
        of_specimen = "" if column is None else marked.mark[column]
        if column is None or not of_specimen:
            if is_own or header not in of_all:
                out.append(text)
            continue
        if of_specimen == mark and own_header[column]:
            added = header.removeprefix(marked.full[column])
            out.append(f"{own_header[column]}{added}={meaning}")
    return tuple(out)


def _column_meant(marked: _Marked, text: str) -> int | None:
    """The column that a user means by its whole name, perhaps with a unit that the file leaves out."""
    header = header_meant(text)
    for name in (header, _unit_apart(header)[0]):
        if name and name in marked.full and name not in marked.name:
            return marked.full.index(name)
    return None


def _meant(marked: _Marked, text: str) -> str | None:
    """The specimen of which a user names a column."""
    column = _column_meant(marked, text)
    return None if column is None else marked.mark[column]


def _role(text: str) -> str:
    return text.rpartition("=")[2].strip().partition(" ")[0]
