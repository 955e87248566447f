"""Slips of hands and loggers that would change a test without a word: they are refused with their line, or left out."""

import numpy as np
import pytest

import wirebayes as wb
from tests.io.bench_files import convert
from wirebayes.io.bench.about import About
from wirebayes.io.bench.glitches import glitches
from wirebayes.io.bench.undecided import Choices

ABOUT = About("wire", "line", 1000.0)
HEADER = "Time (s);Position (mm);Force (N)"
ROWS = [(70.0 * hold + t, hold + 1.0, 10 * hold + 9 - t / 100) for hold in range(5) for t in (0, 10, 20, 40)]
LINES = [f"{t:.1f};{x:.2f};{force:.3f}" for t, x, force in ROWS]


def read(folder, lines, end="\n", header=HEADER, **choices):
    path = folder / "raw.csv"
    path.write_text("\n".join([header, *lines]) + end)
    return convert(path, ABOUT, Choices(**choices))


def readings(made):
    return [(row[1], row[3]) for row in made.rows if row[1] is not None and row[3] is not None]


EVERY = [(x, round(force, 3)) for _, x, force in ROWS]


@pytest.mark.parametrize("misprint", [20.0, 0.2, -2.0])
def test_a_setting_that_is_off_in_one_row_while_nothing_follows_is_a_misprint(tmp_path, misprint):
    lines = [line.replace(";2.00;", f";{misprint:.2f};") if i == 5 else line for i, line in enumerate(LINES)]
    with pytest.raises(wb.InputError, match=r"line 7, column 2 .*: found .* in a single row between 2 and 2 mm"):
        read(tmp_path, lines)
    made = read(tmp_path, lines, drop_breaks=True)
    assert readings(made) == EVERY[:5] + EVERY[6:]
    assert "left out: 1 row in which the displacement alone is far off, from line 7 on" in made.notes


def test_a_weight_that_is_off_in_one_row_is_one_too(tmp_path):
    header = "Weight (N);Time (s);Dial (mm)"
    rows = [(2.0 * hold + 2, 100.0 * hold + t, hold + 3 + t / 500) for hold in range(4) for t in (0, 20, 40, 80)]
    lines = [f"{20.0 if i == 6 else w:.1f};{t:.1f};{x:.3f}" for i, (w, t, x) in enumerate(rows)]
    with pytest.raises(wb.InputError, match=r"line 8, column 1 .*: found 20 N in a single row between 4 and 4 N"):
        read(tmp_path, lines, header=header)


def test_a_wire_that_follows_in_a_single_row_was_moved(tmp_path):
    rows = [*ROWS]
    rows[5] = (80.0, 5.0, 48.0)
    made = read(tmp_path, [f"{t:.1f};{x:.2f};{force:.3f}" for t, x, force in rows])
    assert (5.0, 48.0) in readings(made)


def test_a_glitch_of_an_encoder_cuts_no_hold_of_a_recording(tmp_path):
    rows = [(0.1 * i, 1.0 + i // 200 + 1e-3 * (i % 3), 10.0 * (i // 200) + 9 - (i % 200) / 1e3) for i in range(800)]
    lines = [f"{t:.1f};{99.0 if i == 350 else x:.3f};{force:.3f}" for i, (t, x, force) in enumerate(rows)]
    with pytest.raises(wb.InputError, match=r"line 352, column 2 .*: found 99 mm in a single row"):
        read(tmp_path, lines)
    made = read(tmp_path, lines, drop_breaks=True)
    assert [hold.setting for hold in made.experiment.holds] == pytest.approx([1.0, 2.0, 3.0, 4.0], abs=2e-3)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("count", [0, 1, 2, 3])
def test_a_few_rows_have_none(count):
    assert not len(glitches(np.array([1.0, 2.0, 1.0])[:count], np.array([5.0, 10.0, 5.0])[:count]))


def test_a_number_with_the_other_decimal_sign_is_no_thousands(tmp_path):
    lines = [line.replace("18.900", "18,900") for line in LINES]
    with pytest.raises(wb.InputError, match=r"line 7, column 3 .*: found '18,900', expected the decimal point"):
        read(tmp_path, lines)


def test_thousands_that_grow_from_what_was_less_are_thousands(tmp_path):
    lines = [f"{t:.1f};{x:.2f};{100 * force:,.1f}" for t, x, force in ROWS]
    assert readings(read(tmp_path, lines)) == [(x, round(100 * force, 1)) for _, x, force in ROWS]
    lines = [f"{t:.1f};{x:.2f};{10 * force:.1f}" for t, x, force in ROWS[:-1]]
    assert readings(read(tmp_path, [*lines, "320.0;5.00;1,215"]))[-1] == (5.0, 1215.0)


@pytest.mark.parametrize(
    ("holds", "said"),
    [((0, 1, 3, 2, 4), "a time amid those above"), ((0, 3, 1, 2, 4), "which is between two holds above")],
)
def test_rows_of_a_hold_that_stand_elsewhere_start_no_clock_again(tmp_path, holds, said):
    """In the second file the settings would rise in the order of the rows: it is the order of time that goes astray."""
    settings = holds if said == "which is between two holds above" else range(5)
    placed = [
        (70.0 * hold + t, settings.index(hold) + 1.0, 5.0 + hold - t / 100) for hold in holds for t in (0, 10, 40)
    ]
    lines = [f"{t:.1f};{x:.2f};{force:.3f}" for t, x, force in placed]
    with pytest.raises(wb.InputError, match=rf"line \d+, column 1 .*: found \d+ s after \d+ s, {said}"):
        read(tmp_path, lines)


@pytest.mark.parametrize("lost", [1, 2, 3, 5, 8])
def test_a_last_line_that_was_not_finished_is_left_out(tmp_path, lost):
    lines = [*LINES[:-1], LINES[-1][:-lost]]
    made = read(tmp_path, lines, end="")
    assert readings(made) == EVERY[:-1]
    assert "the last line left out, which is cut off" in made.notes[0]


def test_a_last_line_that_only_lacks_its_end_is_read(tmp_path):
    assert readings(read(tmp_path, LINES, end="")) == EVERY
    short = [f"{t:g};{x:g};{force:g}" for t, x, force in ROWS]  # as many digits as each number needs
    assert readings(read(tmp_path, [*short[:-1], "320;5;49"], end=""))[-1] == (5.0, 49.0)
