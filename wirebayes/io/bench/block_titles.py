"""Lines above blocks of readings that say what no column does: ``Step 2: 5 mm``, ``Load,10,kg``, ``Specimen 3``.

Every block has such a line, and the lines are alike but for their numbers.
"""

import re
from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from wirebayes.io.bench.header import name_and_unit
from wirebayes.io.bench.joined import lacking
from wirebayes.io.bench.quantities import ROLES, Role, quantity_unit
from wirebayes.io.bench.table import RawTable
from wirebayes.io.bench.unread import names_a_specimen
from wirebayes.io.bench.words import LENGTHS, are_a_statistic, speaks_of_a_quantity, words_in

_NUMBER = r"[+\-\u2212]?\d+(?:[.,]\d+)?"
_MEASURE = re.compile(rf"(?<![\w.,])({_NUMBER})[ _]?([^\W\d_]+)(?=$|[\s,;:.)\]])")
_LAST = re.compile(rf"(.*?)[\s:=]+({_NUMBER})")
_MOVED_TO = re.compile(r"\b(moved?|moving|go|going) to\b", re.IGNORECASE)  # moved by, or without a word, is a change
# Words of titles beside those of quantities; of others, such as Rope 6 mm, a measure may be a thickness.
_OF_TITLES = {
    "level", "niveau", "phase", "block", "run", "test", "versuch", "messung", "essai", "mesure", "prueba", "prova",
    "part", "teil", "no", "nr", "at", "bei", "a", "to", "auf", "bis", "target", "soll", "set", "setpoint", "held",
    "constant", "for", "of", "in", "fur", "pendant",
}  # fmt: skip
Said = dict[str, tuple[str, str]]  # by a line without its numbers: what it says, and the unit of that


@dataclass(frozen=True)
class _Block:
    """Readings that follow each other without other lines between them, and the lines above.

    Attributes
    ----------
    begin : int
        Line of the first reading.
    above : list of str
        The lines between it and the block before.
    """

    begin: int
    above: list[str]


def with_titles_as_columns(table: RawTable, mapping: Sequence[str]) -> RawTable:
    """The table with what lines above its blocks say as columns: the setting, if none has it, and the specimen.

    Parameters
    ----------
    table : RawTable
    mapping : sequence of str
        What the user says of columns.
    """
    if table.turned or table.pieces:
        return table
    blocks = _blocks(table)
    if len(blocks) < 2:
        return table
    missing = lacking(table, mapping)
    if len(missing) == 1:
        table = _with_column(table, blocks, missing[0], lambda line: _settings(line, missing[0]))
    return _with_column(table, blocks, "specimen", _specimen)


def _blocks(table: RawTable) -> list[_Block]:
    blocks: list[_Block] = []
    above: list[str] = []
    in_block = False
    for row in table.sheet.rows:
        is_reading = row.line > table.header_line and row.may_be_a_reading and not row.comment
        if is_reading and not are_a_statistic(row.filled):
            if not in_block:
                blocks.append(_Block(row.line, above))
                above = []
            in_block = True
        else:
            above.append(" ".join(row.filled))
            in_block = False
    return blocks


def _with_column(table: RawTable, blocks: Sequence[_Block], name: str, said: Callable[[str], Said]) -> RawTable:
    """The table with a column of what one line above each block says; itself where none or several do."""
    each = [_said_above(block, said) for block in blocks]
    key = _telling(each)
    if key is None:
        return table
    values = [found[key] for found in each]
    begins = [block.begin for block in blocks]
    width = len(table.header)
    rows = []
    for row in table.rows:
        cells = [row.cell(i) for i in range(width)]
        value = ""
        if row.may_be_a_reading:
            block = max(bisect_right(begins, row.line) - 1, 0)
            value, _ = values[block]
        rows.append(replace(row, cells=(*cells, value)))
    first = _in_a_word(values[0])
    last = _in_a_word(values[-1])
    _, unit = values[0]
    above = table.above
    if above:
        above = (*above, "")
    return replace(
        table,
        sheet=table.sheet.also(f"the {name} of each block from the line above it ({first} to {last})"),
        header=(*table.header, name),
        units=(*table.units, unit),
        rows=tuple(rows),
        above=above,
    )


def _in_a_word(value: tuple[str, str]) -> str:
    """A number with its unit, where it has one."""
    return " ".join(filter(None, value))


def _said_above(block: _Block, said: Callable[[str], Said]) -> Said:
    """What the lines above a block say."""
    found: Said = {}
    for line in block.above:
        found |= said(line)
    return found


def _telling(each: Sequence[Said]) -> str | None:
    """The only line above all blocks that says different things in one unit; a quantity's before others."""
    varied = []
    for key in each[0]:
        found = [of_block[key] for of_block in each if key in of_block]
        units = {unit for _, unit in found}
        if len(found) == len(each) and len(units) == 1 and len(set(found)) > 1:
            varied.append(key)
    if len(varied) > 1:
        varied = [key for key in varied if any(map(speaks_of_a_quantity, re.findall(r"[^\W\d_]+", key)))]
    return varied[0] if len(varied) == 1 else None


def may_state_a_setting(title: str) -> bool:
    """Whether all words of a title are those of quantities, of units, or of parts of a test."""
    words = words_in(_MOVED_TO.sub("to", title))
    units = {word for word in words if any(quantity_unit(word, role) for role in ROLES)}
    if words & set(LENGTHS):  # of a specimen
        return False
    return all(word in _OF_TITLES or speaks_of_a_quantity(word) for word in words - units)


def _settings(line: str, role: Role) -> Said:
    """Numbers with a unit of a quantity in a line, or the last one under a name that has it: ``Weg [mm]: 2``."""
    said: Said = {}
    if not may_state_a_setting(line):
        return said
    key = _without_numbers(line)
    for place, found in enumerate(_MEASURE.finditer(line)):
        number, unit_text = found.groups()
        if quantity_unit(unit_text, role) and not _is_change(number):
            said[f"{place} {key}"] = number, unit_text
    last = _LAST.fullmatch(line)
    if said or last is None:
        return said
    name, number = last.groups()
    _, unit = name_and_unit(name, role)
    if unit and not _is_change(number):
        said[key] = number, unit.text
    return said


def _is_change(number: str) -> bool:
    """Whether a number with its sign is a change, which is no setting."""
    return number.startswith("+")


def _specimen(line: str) -> Said:
    name = names_a_specimen(line)
    return {_without_numbers(line.replace(name, "")): (name, "")} if name else {}


def _without_numbers(line: str) -> str:
    return re.sub(_NUMBER, "#", line)
