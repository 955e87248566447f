"""Numbers that loggers write where nothing was read: 9999, -999.9 and the like are no readings."""

import pytest

import wirebayes as wb
from tests.io.bench_files import convert
from wirebayes.io.bench.about import About
from wirebayes.io.bench.undecided import Choices

ABOUT = About("wire", "line", 1000.0)
HEADER = "Time (s),Position (mm),Force (N),Temperature (C)"
ROWS = [(70 * hold + t, hold + 1, f"{10 * hold + 9 - t / 100:.2f}") for hold in (0, 1, 2) for t in (0, 10, 20, 40)]


def read(folder, cells, **choices):
    """The test with some cells replaced: (row, column) and what stands there."""
    lines = [[str(t), str(x), force, "21.5"] for t, x, force in ROWS]
    for (row, column), cell in cells.items():
        lines[row][column] = cell
    path = folder / "raw.csv"
    path.write_text("\n".join([HEADER, *(",".join(line) for line in lines)]))
    return convert(path, ABOUT, Choices(**choices))


@pytest.mark.parametrize("column", [1, 2])
@pytest.mark.parametrize("mark", ["9999", "-9999", "999.0", "-999.9", "99999.99", "-999.25", "9.9E37", "-9.91E+37"])
def test_nines_far_beyond_all_readings_are_refused_and_left_out_where_that_is_said(tmp_path, mark, column):
    cells = {(5, column): mark, (6, column): mark}
    with pytest.raises(wb.InputError, match=rf"line 7, column {column + 1} .* far beyond all other .*--drop-breaks"):
        read(tmp_path, cells)
    made = read(tmp_path, cells, drop_breaks=True)
    assert "left out: 2 rows in which a number such as 9999 stands for none, from line 7 on" in made.notes
    readings = [row[3] for row in made.rows if row[3] is not None]
    assert readings == [float(force) for i, (_, _, force) in enumerate(ROWS) if i not in (5, 6)]


def test_a_temperature_that_was_not_read_loses_no_reading(tmp_path):
    with pytest.raises(wb.InputError, match=r"line 4, column 4 \(Temperature \(C\)\): found '-999'"):
        read(tmp_path, {(2, 3): "-999"}, drop_breaks=True)


@pytest.mark.parametrize("reading", ["99.9", "999", "9999"])
def test_nines_among_numbers_of_their_size_are_readings(tmp_path, reading):
    size = float(reading) / 29
    cells = {(row, 2): f"{size * float(force):.2f}" for row, (_, _, force) in enumerate(ROWS)} | {(8, 2): reading}
    assert float(reading) in [row[3] for row in read(tmp_path, cells).rows]


def test_a_test_that_breaks_in_a_recording_of_times_is_written_without_its_last_holds(tmp_path):
    rows = [f"{t},{x},{0.0 if i >= 6 else force}" for i, (t, x, force) in enumerate(ROWS)]
    path = tmp_path / "raw.csv"
    path.write_text("\n".join(["Time (s),Position (mm),Force (N)", *rows]))
    made = wb.import_bench(path, length_mm=1000, drop_breaks=True, output=tmp_path / "out")
    assert [hold.setting for hold in made.experiments[0].holds] == [1.0, 2.0]
    assert (tmp_path / "out" / "raw.svg").is_file()


def test_a_file_without_a_whole_row_is_refused(tmp_path):
    cells = {(row, 1 + row % 2): "-" for row in range(len(ROWS))}
    with pytest.raises(wb.InputError, match="found no row with a time, a displacement and a tension, all of them numb"):
        read(tmp_path, cells, drop_breaks=True)
