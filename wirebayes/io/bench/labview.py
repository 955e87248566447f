"""LabVIEW's measurement files (LVM): two preambles, units in the second one, and segments below each other."""

from pathlib import Path

from wirebayes.errors import InputError
from wirebayes.io.bench.numerals import plain_number
from wirebayes.io.bench.sheet import Sheet, SheetRow, is_value

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
    stated = next((line for line in lines if line.startswith("Separator")), "Separator\tTab")
    sign = "," if "comma" in stated.lower() else "\t"
    split = [[cell.strip() for cell in line.split(sign)] for line in lines]
    heads = [i for i, cells in enumerate(split) if cells[0].startswith(_TIMES) or _is_head(split, i)]
    if not heads:
        raise InputError(f"{path}, line {len(lines)}: found no line {_TIMES}, expected a table of channels below it")
    header, *others = heads
    rows = [SheetRow(header + 1, _filled(split[header])), _units(split, header)]
    for head in others:
        if split[head] != split[header]:
            found = f"the channels {', '.join(filter(None, split[head]))}"
            raise InputError(f"{path}, line {head + 1}: found {found}, expected those of line {header + 1}")
    clocks = _clocks(split)
    for number, cells in enumerate(split[header + 1 :], start=header + 2):
        first = next((cell for cell in cells if cell), "")
        if is_value(first):  # the preamble of another segment begins with words
            time = clocks.get(number - 1, "") if cells[0] == "" else cells[0]
            rows.append(SheetRow(number, _filled([time, *cells[1:]])))
    return Sheet(path, tuple(row for row in rows if row.cells), described="LabVIEW measurement", encoding=encoding)


def _clocks(split: list[list[str]]) -> dict[int, str]:
    """The time of each line of readings, where their preamble says when they begin and how far apart they are."""
    comma = any(cells[0] == "Decimal_Separator" and "," in "".join(cells[1:]) for cells in split)
    times, begin, step, head = dict[int, str](), set[str](), set[str](), 0
    for i, cells in enumerate(split):
        if cells[0] == "X0":
            begin = set(filter(None, cells[1:]))
        elif cells[0] == "Delta_X":
            step = set(filter(None, cells[1:]))
        elif cells[0] == _END or cells[0].startswith(_TIMES):
            head = i
        elif len(begin) == len(step) == 1:
            first, apart = (plain_number(text, "comma" if comma else "point") for (text,) in (begin, step))
            if first and apart:
                time = f"{float(first) + (i - head - 1) * float(apart):.6f}"
                times[i] = time.replace(".", ",") if comma else time
    return times


def _is_head(split: list[list[str]], i: int) -> bool:
    """Whether a line stands below the second end of a header, in files whose times have another name."""
    return i > 0 and split[i - 1][0] == _END and not is_value(split[i][0]) and len([c for c in split[i] if c]) > 1


def _units(split: list[list[str]], header: int) -> SheetRow:
    """The row of units that the preamble of the channels states: one for each of them, times before or between."""
    names = split[header]
    labels, dimensions, line = list[str](), list[str](), header
    for i, cells in enumerate(split[:header]):
        if cells[0] == "Y_Unit_Label":
            labels, line = cells[1:], i
        elif cells[0] == "X_Dimension":
            dimensions = cells[1:]
    seconds = "s" if dimensions and all(d in ("", "Time") for d in dimensions) else ""
    units, channel = list[str](), 0
    for name in names:
        if name.startswith(_TIMES):
            units.append(seconds)
        else:
            units.append(labels[channel] if channel < len(labels) and name != "Comment" else "")
            channel += 1
    return SheetRow(line + 1, _filled(units))


def _filled(cells: list[str]) -> tuple[str, ...]:
    """Cells without the empty ones at the end."""
    count = max((i for i, cell in enumerate(cells, start=1) if cell), default=0)
    return tuple(cells[:count])
