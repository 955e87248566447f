"""Rows of a recording that do not stand in the order of time: sorted, doubled or jumbled by what wrote them."""

import numpy as np
import pytest

import wirebayes as wb
from tests.io.bench_files import convert
from wirebayes.io.bench.about import About
from wirebayes.io.bench.undecided import Choices

ABOUT = About("wire", "line", 1000.0)
HOLD_ROWS = 100
LEVELS = np.repeat([1.0, 2.0, 3.0, 4.0], HOLD_ROWS)
TIMES = np.arange(len(LEVELS)) * 0.5
FORCES = 2.0 * LEVELS - 0.001 * (np.arange(len(LEVELS)) % HOLD_ROWS)
EVERY = np.arange(len(LEVELS))


def read(folder, order, *, scatter_mm=0.0, hold=False, times=TIMES):
    path = folder / "raw.csv"
    scattered = LEVELS + np.random.default_rng(1).normal(0.0, scatter_mm, len(LEVELS))
    lines = ["Step,Time (s),Position (mm),Force (N)"] if hold else ["Time (s),Position (mm),Force (N)"]
    for row in order:
        number = f"{row // HOLD_ROWS + 1}," if hold else ""
        lines.append(f"{number}{times[row]:.2f},{scattered[row]:.4f},{FORCES[row]:.4f}")
    path.write_text("\n".join(lines) + "\n")
    return convert(path, ABOUT, Choices())


JUMBLED = {
    "everywhere": np.random.default_rng(2).permutation(EVERY),
    "by some rows": np.argsort(EVERY + np.random.default_rng(3).normal(0.0, 1.5, len(EVERY))),
    "a block later in its hold": np.concatenate([EVERY[:120], EVERY[140:170], EVERY[120:140], EVERY[170:]]),
    "a block twice": np.concatenate([EVERY[:140], EVERY[120:]]),
    "two rows": np.concatenate([EVERY[:120], EVERY[[121, 120]], EVERY[122:]]),
}


@pytest.mark.parametrize("order", JUMBLED.values(), ids=list(JUMBLED))
@pytest.mark.parametrize("scatter_mm", [0.0, 0.002])
def test_rows_out_of_the_order_of_time_are_refused_with_the_first_of_them(tmp_path, order, scatter_mm):
    with pytest.raises(wb.InputError) as refused:
        read(tmp_path, order, scatter_mm=scatter_mm)
    line = int(str(refused.value).partition("line ")[2].partition(",")[0])
    row = line - 2
    assert TIMES[order[row]] < TIMES[order[row - 1]]
    assert "rows in the order of time, the oldest first" in str(refused.value)


@pytest.mark.parametrize("hold", [False, True])
def test_clocks_that_start_again_are_no_disorder(tmp_path, hold):
    """Each hold counts its own time, from another moment on; no two rows show the same time."""
    began = np.repeat([0.0, 3.13, 7.29, 5.41], HOLD_ROWS)
    of_hold = TIMES % (0.5 * HOLD_ROWS) + began
    found = read(tmp_path, EVERY, hold=hold, times=of_hold)
    assert [tuple(h.time_s[[0]]) for h in found.experiment.holds] == [(0.0,), (3.13,), (7.29,), (5.41,)]
