"""A measured setting that stays is written now one way, now the other in its last digit: it is one hold."""

import numpy as np
import pytest

from tests.io.bench_files import convert
from tests.io.test_bench_recordings import Pull, record
from wirebayes.io.bench.about import About
from wirebayes.io.bench.undecided import Choices

TIMES = (0, 30, 60, 90, 120)
LEVELS = (1.0, 2.0, 3.0, 4.0, 5.0, 4.0, 3.0)


def read(tmp_path, rows):
    """Holds of rows of time, displacement and tension."""
    path = tmp_path / "raw.csv"
    lines = [f"{time:.1f},{x:.2f},{tension:.3f}\n" for time, x, tension in rows]
    path.write_text("Time (s),Extension (mm),Load (N)\n" + "".join(lines))
    return convert(path, About("wire", "line", 1000.0), Choices()).experiment.holds


def written(levels, runs_on, off=None):
    """Rows of a test that was written down; `off` says by how much some of the displacements are."""
    rows = []
    for hold, level in enumerate(levels):
        for time in TIMES:
            there = level + (off or {}).get(len(rows), 0.0)
            rows.append((time + 130 * hold * runs_on, there, level - 1e-3 * time))
    return rows


@pytest.mark.parametrize("runs_on", [False, True])
@pytest.mark.parametrize(
    "off",
    [
        {12: 0.01},
        {12: 0.01, 23: -0.01},
        {14: 0.01},
        {10: -0.01},
        {13: 0.01, 14: 0.01},
        {2: 0.01, 7: 0.01, 29: 0.01},
    ],
)
def test_the_last_digit_of_some_readings_divides_no_hold(off, runs_on, tmp_path):
    holds = read(tmp_path, written(LEVELS, runs_on, off))
    assert [hold.displacement_mm for hold in holds] == list(LEVELS)
    assert all(list(hold.time_s) == list(TIMES) for hold in holds)


@pytest.mark.parametrize("levels", [(0.0, 0.1, 10.0, 20.0, 30.0), (1.0, 2.0, 1.0, 2.0), (1.0, 1.01, 1.02, 1.03, 1.04)])
def test_small_moves_are_holds(levels, tmp_path):
    assert [hold.displacement_mm for hold in read(tmp_path, written(levels, True))] == list(levels)


def test_a_short_hold_far_from_the_least_step_is_a_hold(tmp_path):
    rows = written(LEVELS, True)
    rows[12] = (rows[12][0], 3.5, 3.5)
    assert [hold.displacement_mm for hold in read(tmp_path, rows)] == [1.0, 2.0, 3.0, 3.5, 3.0, *LEVELS[3:]]


@pytest.mark.parametrize("quantum", [0.05, 0.1])
def test_an_encoder_that_flickers_between_two_steps_records_holds(quantum, tmp_path):
    rng = np.random.default_rng(2)
    x, time, truth = record(Pull(step=1.04, holds=5, noise=0.02, quantum=quantum), rng)
    holds = read(tmp_path, zip(time, x, 2.0 * x, strict=True))
    assert [hold.displacement_mm for hold in holds] == pytest.approx([level for *_, level in truth], abs=quantum)
