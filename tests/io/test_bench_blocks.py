"""Tests written in blocks, each with lines of its own above its readings, and perhaps its header again."""

import re

import pytest

from tests.io.bench_files import convert
from wirebayes.errors import InputError
from wirebayes.io.bench.about import About
from wirebayes.io.bench.undecided import Choices

ABOUT = About("wire", "line", 1000.0)
HEADER = "Axial Displacement\tAxial Force\tRunning Time\nmm\tkN\tSec\n"
ABOVE = "Data Acquisition:\tTimed\t\t\tTime:\t0.5\tSec\t6/14/2026 10:00:03 AM\nStored at:\t{block}\tcycle\nPoints:\t3\n"


def in_blocks(tmp_path, above=ABOVE + HEADER, first=ABOVE + HEADER):
    blocks = []
    for block in (1, 2, 3):
        rows = [f"{block}\t{block / 100 - i / 1e5}\t{100 * block + 10 * i}\n" for i in range(3)]
        blocks.append((above if block > 1 else first).format(block=block) + "".join(rows))
    path = tmp_path / "raw.dat"
    path.write_text("\n".join(blocks))
    return convert(path, ABOUT, Choices())


def test_lines_above_a_block_and_its_header_are_left_out_and_named(tmp_path):
    made = in_blocks(tmp_path)
    assert [hold.setting for hold in made.experiment.holds] == [1.0, 2.0, 3.0]
    assert [row[3] for row in made.rows[:3]] == [10.0, 9.99, 9.98]
    assert any(
        "lines 10 (Data Acquisition:), 11 (Stored at:), 12 (Points:) and 7 more left out" in n for n in made.notes
    )


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("mm\tkN\tSec", "mm\tN\tSec", "line 14: found another header, mm, N, Sec, expected the one of line 4"),
        ("Force\tRunning Time", "Force 2\tRunning Time", "line 13: found another header"),
        ("Axial Displacement\tAxial Force", "Axial Force\tAxial Displacement", "line 13: found another header"),
    ],
)  # fmt: skip
def test_a_block_with_another_header_is_refused(tmp_path, old, new, named):
    with pytest.raises(InputError, match=re.escape(named)):
        in_blocks(tmp_path, above=(ABOVE + HEADER).replace(old, new))


@pytest.mark.parametrize(
    "line", ["n/a\tNaN\t115", "1\tNULL\t115", "NaN\tNaN\tNaN", "1\t0.01\tNaN", "1\tnull\t", "1\tNone\tnull"]
)
def test_a_missing_number_is_no_word(tmp_path, line):
    path = tmp_path / "raw.dat"
    rows = [f"1\t{0.01 - i / 1e5}\t{10 * i}\n" for i in range(3)]
    path.write_text(HEADER + "".join(rows) + line + "\n1\t0.009\t200\n")
    if line == "NaN\tNaN\tNaN":  # nothing of it was read
        assert len(convert(path, ABOUT, Choices()).rows) == 4
    else:
        with pytest.raises(InputError, match="line 6, .* expected a number|line 6, column 1 .*n/a"):
            convert(path, ABOUT, Choices())


def test_a_reading_without_a_time_is_no_line_of_words(tmp_path):
    path = tmp_path / "raw.csv"
    rows = [f"load {1 + i // 3},{1 + i // 3},{10 * i if i != 4 else ''},{5 - i / 10}\n" for i in range(6)]
    path.write_text("Step,x (mm),Time (s),Force (N)\n" + "".join(rows))
    with pytest.raises(InputError, match="line 6, .*found an empty cell, expected a number"):
        convert(path, ABOUT, Choices(time_since="test"))


@pytest.mark.parametrize(("below", "read"), [("", True), ("Mean\t0.01\t10\n", True), ("2\t0.01\t400\n", False)])
def test_words_under_all_readings_are_no_header(tmp_path, below, read):
    path = tmp_path / "raw.dat"
    rows = [f"1\t{0.01 - i / 1e5}\t{10 * i}\n" for i in range(3)]
    path.write_text(HEADER + "".join(rows) + "Force sensor\tExtension sensor\n" + below)
    if read:
        assert len(convert(path, ABOUT, Choices()).rows) == 3
    else:
        with pytest.raises(InputError, match="line 6: found another header, Force sensor, Extension sensor"):
            convert(path, ABOUT, Choices())


def test_names_of_holds_and_remarks_are_no_header(tmp_path):
    path = tmp_path / "raw.csv"
    rows = [f"load {1 + i // 3},{1 + i // 3},{10 * i},{5 - i / 10},time ok\n" for i in range(6)]
    path.write_text("Step,x (mm),Time (s),Force (N),Remark\n" + "".join(rows))
    made = convert(path, ABOUT, Choices(time_since="test"))
    assert len([row for row in made.rows if row[3] is not None]) == 6


def test_a_header_that_stands_again_in_other_letters_is_the_same(tmp_path):
    path = tmp_path / "raw.csv"
    block = "".join(f"{{0}},{10 * i},{5 - i / 10}\n" for i in range(3))
    path.write_text("x (mm),Time (s),Force (N)\n" + block.format(1) + "X (mm),TIME (s),force (N)\n" + block.format(2))
    assert [hold.setting for hold in convert(path, ABOUT, Choices()).experiment.holds] == [1.0, 2.0]
