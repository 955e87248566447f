"""Columns between spaces in which a cell is blank: its place says which, and where none can be told it is refused."""

import pytest

import wirebayes as wb
from tests.io.bench_files import convert
from wirebayes.io.bench.about import About
from wirebayes.io.bench.undecided import Choices

ABOUT = About("wire", "line", 1000.0)
ROWS = [(70.0 * hold + t, hold + 1.0, 10.0 * hold + 9.0 - t / 100) for hold in range(9) for t in (0, 10, 20, 40)]
IGNORE = {"mapping": ("TEMP=ignore",)}


def written(form, every, last=False):
    """The test with a temperature in every so many lines, in front of the other columns or behind them."""
    head = ("TIME", "POS", "LOAD", "TEMP") if last else ("TIME", "TEMP", "POS", "LOAD")
    units = ["(S)", "(MM)", "(N)", "(C)"] if last else ["(S)", "(C)", "(MM)", "(N)"]
    lines = ["".join(form(text) for text in head), "".join(form(text) for text in units)]
    for i, (time, x, force) in enumerate(ROWS):
        cells = [f"{time:.1f}", f"{x:.3f}", f"{force:.2f}"]
        cells.insert(3 if last else 1, "" if i % every else f"{20 + i / 10:.1f}")
        lines.append("".join(form(cell) for cell in cells).rstrip())
    return lines


def read(folder, lines, **choices):
    path = folder / "raw.prn"
    path.write_text("\n".join(lines) + "\n")
    return convert(path, ABOUT, Choices(**choices))


@pytest.mark.parametrize("form", ["{:>10}".format, "{:<10}".format], ids=["right", "left"])
@pytest.mark.parametrize("last", [False, True])
def test_a_blank_cell_is_the_one_above_which_nothing_stands(tmp_path, form, last):
    made = read(tmp_path, written(form, 5, last), **IGNORE)
    of_rows = [row for row in made.rows if row[3] is not None]
    assert [row[1] for row in of_rows] == [x for _, x, _ in ROWS]
    assert [row[3] for row in of_rows] == pytest.approx([force for *_, force in ROWS])


def test_a_temperature_that_is_not_read_in_every_row_may_be_left_out(tmp_path):
    with pytest.raises(wb.InputError, match=r'\(TEMP\): found an empty cell, .* --map "TEMP=ignore" to go without'):
        read(tmp_path, written("{:>10}".format, 5))


def test_a_line_of_fewer_numbers_that_stand_in_no_columns_is_refused(tmp_path):
    lines = written("{:>10}".format, 5)
    loose = [" ".join(line.split()) for line in lines]
    with pytest.raises(wb.InputError, match="line 4: found 3 numbers between spaces, expected 4 .* write NaN"):
        read(tmp_path, loose, **IGNORE)


def test_remarks_behind_some_lines_are_no_gaps(tmp_path):
    lines = [" ".join(line.split()) for line in written("{:>10}".format, 1)[2:]]
    lines[7] += " touched"
    made = read(tmp_path, ["time_s temp_C pos_mm load_N", *lines])
    assert len([row for row in made.rows if row[3] is not None]) == len(ROWS)
