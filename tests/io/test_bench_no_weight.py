"""Rows without a weight: rests in which the wire recovers, and what stands before and after the loads."""

import numpy as np
import pytest

from tests.io.bench_files import convert
from wirebayes.io.bench.about import About
from wirebayes.io.bench.no_weight import SCATTER, without_weight
from wirebayes.io.bench.recorded import Cut
from wirebayes.io.bench.undecided import Choices
from wirebayes.simulation.synthetic import Bench, Truth, draw

ABOUT = About("wire", "line", 1000.0)
G = 9.80665
WIRE = {"k1": 900.0, "B": 0.15, "U": 0.9, "k2": 0.05, "N": 0.8, "preload": 0.5, "sensor_sd": 0.005, "setting_sd": 0.002}
READ_S = (0.0, 10.0, 30.0, 120.0, 300.0)
LOADS_KG = (0.5, 1.0, 2.0, 1.5)


def simulated():
    """(7, 5) displacements under the loads, with rests of nearly no weight between them."""
    weights = [w for load in LOADS_KG for w in (load * G, 1e-6)][:-1]
    made = draw([Bench(weights_N=weights, times_s=READ_S, resolution_mm=0.0)], Truth(WIRE), 3)
    return np.round(made.problem.samples[0].readings[..., 0], 3)


def written(tmp_path, first_rows, last_rows=()):
    rows = [*first_rows]
    for hold, lengths in enumerate(simulated()):
        load = LOADS_KG[hold // 2] if hold % 2 == 0 else 0
        rows += [f"{load};{60 + 300 * hold + time};{x}" for time, x in zip(READ_S[:-1], lengths, strict=False)]
    path = tmp_path / "raw.csv"
    path.write_text("\n".join(["Gewicht [kg];Zeit [s];Messuhr [mm]", *rows, *last_rows]))
    return convert(path, ABOUT, Choices())


def test_rests_without_a_weight_are_time_in_which_the_wire_recovers(tmp_path):
    made = written(tmp_path, ["0;0;0.000", "0;30;0.001"], ["0;2200;0.1", "0;2300;0.05"])
    holds = made.experiment.holds
    assert [hold.recorded for hold in holds] == [True, False] * 3 + [True]
    assert [hold.duration_s for hold in holds] == pytest.approx([300.0] * 6 + [340.0])
    assert [hold.setting for hold in holds[::2]] == pytest.approx([G * load for load in LOADS_KG])
    assert all(0.0 < hold.setting < 1e-5 for hold in holds[1::2])
    assert np.array_equal([hold.readings for hold in holds[::2]], simulated()[::2, :-1])
    assert any("before the first load and after the last one left out" in note for note in made.notes)
    assert any(note.startswith("holds 3, 5 and 7 without a weight: the wire recovers") for note in made.notes)


def test_without_such_rows_nothing_is_said(tmp_path):
    path = tmp_path / "raw.csv"
    rows = [f"{load};{300 * i + t};{load * 10 + t / 900}" for i, load in enumerate(LOADS_KG) for t in READ_S[:-1]]
    path.write_text("\n".join(["Gewicht [kg];Zeit [s];Messuhr [mm]", *rows]))
    assert not any("the wire recovers" in note for note in convert(path, ABOUT, Choices()).notes)


@pytest.mark.parametrize(("times", "rest"), [(0.99, True), (1.01, False)])
def test_a_measured_tension_within_its_scatter_of_zero_is_no_weight(times, rest):
    level = 0.03 * SCATTER * times
    tension = np.array([5.0, 5.0, 5.0, level - 0.03, level, level + 0.03, 5.0, 5.0, 5.0])
    rows = [np.arange(3 * i, 3 * i + 3) for i in range(3)]
    holds = Cut(rows, [1, 2, 3], [5.0, level, 5.0], [np.arange(3.0)] * 3, [9.0, 9.0, None], True, [], np.arange(9.0))
    assert without_weight(holds, tension).unread == ({2} if rest else set())
