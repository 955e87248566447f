"""LabVIEW's measurement files (LVM): two preambles, units in the second one, and segments below each other."""

from pathlib import Path

from wirebayes.errors import InputError
from wirebayes.io.bench.numerals import plain_number
from wirebayes.io.bench.sheet import Sheet, SheetRow, is_value
from wirebayes.io.bench.undecided import Decimal

_SIGNATURE = "LabVIEW Measurement"
_END = "***End_of_Header***"
_TIMES = "X_Value"  # one column of times for all channels, or one before each of them


def is_measurement(lines: list[str]) -> bool:
    """Whether lines are those of an LVM file."""
    return lines[0].strip("\ufeff\t ,").startswith(_SIGNATURE)


def sheet_of_measurement(path: Path, lines: list[str], encoding: str = "utf-8") -> Sheet:
    """The cells of an LVM file: the header of its channels, their units, and the readings of all segments.

    Parameters
    ----------
    path : Path
        Named in messages.
    lines : list of str
    encoding : str
        In which they were written.

    Raises
    ------
    InputError
        There is no table of channels, or a later segment has other ones.
    """
    split = _split(lines)
    heads = []
    for i, cells in enumerate(split):
        if cells[0].startswith(_TIMES) or _is_head(split, i):
            heads.append(i)
    if not heads:
        raise InputError(f"{path}, line {len(lines)}: found no line {_TIMES}, expected a table of channels below it")
    header, *others = heads
    for head in others:
        if split[head] != split[header]:
            channels = ", ".join(filter(None, split[head]))
            where = f"{path}, line {head + 1}"
            raise InputError(f"{where}: found the channels {channels}, expected those of line {header + 1}")
    names = SheetRow(header + 1, _filled(split[header]))
    units = _units(split, header)
    rows = [names, units, *_readings(split, header)]
    filled = tuple(row for row in rows if row.cells)
    return Sheet(path, filled, described="LabVIEW measurement", encoding=encoding)


def _split(lines: list[str]) -> list[list[str]]:
    """The cells of lines, between the signs that the file states."""
    stated = next((line for line in lines if line.startswith("Separator")), "")
    sign = "," if "comma" in stated.lower() else "\t"
    return [[cell.strip() for cell in line.split(sign)] for line in lines]


def _readings(split: list[list[str]], header: int) -> list[SheetRow]:
    """The readings of all segments below the header."""
    clocks = _clocks(split)
    rows = []
    for i in range(header + 1, len(split)):
        time, *channels = split[i]
        first = next(filter(None, split[i]), "")
        if not is_value(first):  # the preamble of another segment begins with words
            continue
        if time == "":
            time = clocks.get(i, "")
        rows.append(SheetRow(i + 1, _filled([time, *channels])))
    return rows


def _clocks(split: list[list[str]]) -> dict[int, str]:
    """The time of each line of readings, where their preamble says when they begin and how far apart they are."""
    comma = any(cells[0] == "Decimal_Separator" and "," in "".join(cells[1:]) for cells in split)
    sign: Decimal = "comma" if comma else "point"
    times = dict[int, str]()
    begin, step = set[str](), set[str]()
    head = 0
    for i, cells in enumerate(split):
        key = cells[0]
        stated = set(filter(None, cells[1:]))
        if key == "X0":
            begin = stated
        elif key == "Delta_X":
            step = stated
        elif key == _END or key.startswith(_TIMES):
            head = i
        elif len(begin) == len(step) == 1:
            (first_text,) = begin
            (apart_text,) = step
            first = plain_number(first_text, sign)
            apart = plain_number(apart_text, sign)
            if first and apart:
                steps = i - head - 1
                time = f"{float(first) + steps * float(apart):.6f}"
                times[i] = time.replace(".", ",") if comma else time
    return times


def _is_head(split: list[list[str]], i: int) -> bool:
    """Whether a line stands below the second end of a header, in files whose times have another name."""
    if i == 0 or split[i - 1][0] != _END or is_value(split[i][0]):
        return False
    filled = [cell for cell in split[i] if cell]
    return len(filled) > 1


def _units(split: list[list[str]], header: int) -> SheetRow:
    """The row of units that the preamble of the channels states: one for each of them, times before or between."""
    names = split[header]
    labels, dimensions = list[str](), list[str]()
    line = header
    for i, cells in enumerate(split[:header]):
        key, *stated = cells
        if key == "Y_Unit_Label":
            labels = stated
            line = i
        elif key == "X_Dimension":
            dimensions = stated
    are_times = bool(dimensions) and set(dimensions) <= {"", "Time"}
    units = list[str]()
    channel = 0
    for name in names:
        if name.startswith(_TIMES):
            units.append("s" if are_times else "")
            continue
        has_label = channel < len(labels) and name != "Comment"
        units.append(labels[channel] if has_label else "")
        channel += 1
    return SheetRow(line + 1, _filled(units))


def _filled(cells: list[str]) -> tuple[str, ...]:
    """Cells without the empty ones at the end."""
    count = max((i for i, cell in enumerate(cells, start=1) if cell), default=0)
    return tuple(cells[:count])
