"""Text as cells: the delimiter is inferred from the lines, quotes are removed."""

import csv
import re
from pathlib import Path

from wirebayes.errors import InputError
from wirebayes.io.bench import json_records, keyed_lines, labview, serial_monitor
from wirebayes.io.bench.aligned import with_gaps
from wirebayes.io.bench.cell_units import bare, joined_measures
from wirebayes.io.bench.cut_off import without_cut_line
from wirebayes.io.bench.decode import UNICODE
from wirebayes.io.bench.sheet import Sheet, SheetRow, is_measured, is_value

_NAMES = {";": "semicolons", "\t": "tabs", "|": "bars", ",": "commas", " ": "spaces"}
LONGEST_LINE = 100_000  # characters: thousands of columns; Python's csv refuses longer cells
_LOOKED_AT = 2000  # lines: enough to see a habit
_COMMENT = re.compile(r"\s*[\"']?(#|%|//)+(?![\"'])\s*")  # a cell "#" is a name
_BETWEEN_WORDS = re.compile(r"\s+(?![(\[][^()\[\]]*[)\]])")  # but not before a unit in brackets: Load (N)
_UNDER_A_HEADER = re.compile(r":?-{2,}:?")  # of a table in Markdown
_WITH_UNIT = re.compile(r"[-+]?\d+([.,]\d+)? ?[^\W\d]{1,5}\d?")  # 4 mm, 11.02 N
_QUOTED_LINE = re.compile(r'"([^"]|"")*"')
_QUOTED_FIRST = re.compile(r'"[^"]*"(\s+("[^"]*"|[^"\s]+))*')  # cells between spaces, the first of them quoted
_QUOTED_OR_BARE = re.compile(r'"([^"]*)"|([^"\s]+)')
_SIGN = re.compile(r"[,;\t|]")
_OPEN_CELL = re.compile(
    r'^(?:[^"]|"[^"]*")*(?:^|[,;\t|])\s*"[^"]*$'
)  # a quote that begins a cell, and none that ends it
_CLOSED_CELL = re.compile(r'[^"]*"\s*([,;\t|]|$)')
_MARKUP = re.compile(r"\s*<(!doctype|html|\?xml|table|head|body)\b", re.IGNORECASE)  # some benches call it .xls
_ENDS = ("\n", "\r", "\x1a")  # of a file whose last line was finished
MOST_BREAKS = 20  # of the cells of one line: a name and a unit in each of twenty columns
_SEPARATOR = re.compile(
    r"\ufeff?\"?sep=([^\w\s\"']|\t)\"?\s*", re.IGNORECASE
)  # the first line that Excel writes and obeys


def sheet_of_text(path: Path, text: str, encoding: str) -> Sheet:
    """Split text into cells.

    Parameters
    ----------
    path : Path
        Named in messages.
    encoding : str
        In which it was written.

    Raises
    ------
    InputError
        No sign splits the lines into columns of numbers.
    """
    if _MARKUP.match(text):
        raise InputError(f"{path}, line 1: found HTML or XML, expected text (CSV) or xlsx; save it as xlsx")
    lines = _whole_lines(text.splitlines() or [""])
    if labview.is_measurement(lines):
        return labview.sheet_of_measurement(path, lines, encoding)
    if json_records.are_records(text):
        return json_records.sheet_of_records(path, text, encoding)
    if serial_monitor.is_log(lines):
        sent, arrivals = serial_monitor.without_stamps(lines)
        end = "\n" if text.endswith("\n") else ""
        inner = sheet_of_text(path, "\n".join(sent) + end, encoding)
        return serial_monitor.with_arrivals(inner, arrivals)
    if keyed_lines.are_keyed(lines):
        return keyed_lines.sheet_of_keyed(path, lines, encoding)
    _check_lengths(path, lines)
    stated = _SEPARATOR.fullmatch(lines[0])
    if stated:
        lines[0] = ""
        sign = stated[1]
    else:
        sign = _best_sign(path, lines)
    is_finished = text[-1:] in _ENDS
    return _sheet_of_cells(path, lines, sign, is_finished=is_finished, encoding=encoding)


def _best_sign(path: Path, lines: list[str]) -> str:
    """The sign between cells that splits lines best."""
    filled = [line for line in lines if line.strip() and not _COMMENT.match(line)]
    sample = filled[:_LOOKED_AT]
    scores = {sign: _score(sample, sign) for sign in _NAMES}
    best = max(scores, key=lambda sign: scores[sign])
    if scores[best][0] <= 0.0:
        line = next((i for i, content in enumerate(lines, start=1) if content.strip()), 1)
        raise InputError(f"{path}, line {line}: found no columns of numbers, expected {_wanted(sample)}")
    return best


def _sheet_of_cells(path: Path, lines: list[str], sign: str, *, is_finished: bool, encoding: str) -> Sheet:
    """The sheet of lines whose cells a sign divides, without a last line that was not finished."""
    rows, of_width = _rows(lines, sign)
    described = "columns of fixed width" if of_width else f"{_NAMES.get(sign, sign)} between cells"
    if not is_finished:
        rows, is_cut = without_cut_line(rows)
        described += ", the last line left out, which is cut off" * is_cut
    if encoding in UNICODE:
        return Sheet(path, rows, described=described)
    return Sheet(path, rows, described=f"{described}, {encoding.upper()}", encoding=encoding)


def _check_lengths(path: Path, lines: list[str]) -> None:
    """Refuse a line that is too long for one of a table."""
    longest = max(range(len(lines)), key=lambda i: len(lines[i]))
    if len(lines[longest]) > LONGEST_LINE:
        found = f"a line of {len(lines[longest])} characters"
        raise InputError(f"{path}, line {longest + 1}: found {found}, expected at most {LONGEST_LINE}")


def _whole_lines(lines: list[str]) -> list[str]:
    """Lines as they were meant: without quotes round each of them, and with cells that are broken in two joined.

    A line that goes on in the next one has its cells in the first of them, and the others are empty.
    """
    filled = [line.strip() for line in lines if line.strip()]
    if all(_QUOTED_LINE.fullmatch(line) for line in filled) and any(map(_SIGN.search, filled)):
        return [line.strip()[1:-1].replace('""', '"') for line in lines]
    whole = list(lines)
    for i in range(len(whole)):
        for k in range(i + 1, min(i + 1 + MOST_BREAKS, len(whole))):
            if not (_OPEN_CELL.search(whole[i]) and _CLOSED_CELL.match(whole[k])):
                break
            whole[i], whole[k] = f"{whole[i]} {whole[k]}", ""
    return whole


def _wanted(lines: list[str]) -> str:
    """What lines should be that no sign splits into columns of numbers."""
    cells = [cell for sign in _NAMES if sign != " " for line in lines for cell in _cells(line, sign)]
    with_unit = next((cell for cell in cells if _WITH_UNIT.fullmatch(cell)), None)
    if with_unit is None:
        return "cells between commas, semicolons, tabs or spaces"
    return f"numbers alone in the cells, not {with_unit!r}, and their units in the header"


def _score(lines: list[str], sign: str) -> tuple[float, int, int]:
    """How well a sign splits lines: share of the cells that are values, headers of as many cells, cells."""
    split = [_cells(line, sign) for line in lines]
    bare_cells = [[bare(cell) for cell in cells] for cells in split]
    measured = [cells for cells in bare_cells if is_measured(cells)]
    if not measured:
        return 0.0, 0, 0
    filled = [cell for cells in measured for cell in cells if cell]
    share = sum(map(is_value, filled)) / max(len(filled), 1)
    widths = sorted(map(len, measured))
    width = widths[len(widths) // 2]
    is_headed = any(len(cells) == width and not any(map(is_value, cells)) for cells in split)
    of_lines = len(measured) / len(lines)
    return round(of_lines * share, 3), int(is_headed), width


def _cells(line: str, sign: str) -> list[str]:
    if sign == " ":
        if _QUOTED_FIRST.fullmatch(line.strip()):
            return [quoted or bare_word for quoted, bare_word in _QUOTED_OR_BARE.findall(line)]
        return _BETWEEN_WORDS.split(joined_measures(line.strip())) if line.strip() else []
    return [_bare_cell(cell.strip()) for cell in next(csv.reader([line], delimiter=sign, skipinitialspace=True), [])]


def _bare_cell(cell: str) -> str:
    """A cell without what keeps spreadsheets from changing it, ``="1.50"``, and without a comment behind its number."""
    if cell.startswith('="') and cell.endswith('"'):
        return cell[2:-1]
    number, sign, _ = cell.partition(" #")
    return number.rstrip() if sign and is_value(number.rstrip()) else cell


def _rows(lines: list[str], sign: str) -> tuple[tuple[SheetRow, ...], bool]:
    """The rows of lines, and whether columns of fixed width told which cells are empty."""
    comments = [_COMMENT.match(line) for line in lines]
    contents = []
    for line, found in zip(lines, comments, strict=True):
        contents.append(line[found.end() :] if found else line)
    split = [_cells(content, sign) for content in contents]
    placed = None
    if sign == " ":
        placed = with_gaps(contents, split)
    rows = []
    for number, (cells, comment) in enumerate(zip(placed or split, comments, strict=True), start=1):
        while cells and not cells[-1]:
            cells.pop()
        if cells and not _is_drawn(cells):
            rows.append(SheetRow(number, tuple(cells), bool(comment)))
    return tuple(rows), placed is not None


def _is_drawn(cells: list[str]) -> bool:
    """Whether a row is a line drawn under a header."""
    begin = 1 if cells[0] == "" else 0
    return all(map(_UNDER_A_HEADER.fullmatch, cells[begin:]))
