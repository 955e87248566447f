"""Rests between holds: kept with the test where the times of the file tell them, and said to be unknown elsewhere."""

import pytest

from tests.io.bench_files import convert
from wirebayes.io.bench.about import About
from wirebayes.io.bench.undecided import Choices
from wirebayes.simulation.synthetic import Bench, Truth, draw

ABOUT = About("wire", "line", 1000.0)
WIRE = {"k1": 900.0, "B": 0.15, "U": 0.9, "k2": 0.05, "N": 0.8, "preload": 0.5, "sensor_sd": 0.01, "setting_sd": 0.002}
READ_S, REST_S = (0.0, 10.0, 30.0, 60.0), 90.0


def rested(tmp_path, header, *, weights, since):
    """Holds of a known wire, read for 60 s and left as they are until 90 s; times of the test or of the hold."""
    settings = (5.0, 10.0, 15.0, 20.0)
    set_ = {"weights_N": settings, "resolution_mm": 0.0} if weights else {"displacements_mm": settings}
    made = draw([Bench(times_s=(*READ_S, REST_S), **set_)], Truth(WIRE), 3)
    lines = [header]
    for hold, readings in enumerate(made.problem.samples[0].readings[..., 0]):
        start = hold * REST_S if since == "test" else 0.0
        lines += [
            f"{settings[hold]},{start + time},{y:.3f}" for time, y in zip(READ_S, readings[: len(READ_S)], strict=True)
        ]
    path = tmp_path / "raw.csv"
    path.write_text("\n".join(lines))
    return convert(path, ABOUT, Choices())


HEADERS = [("Displacement [mm],Time [s],Force [N]", False), ("Load [N],Time [s],Extension [mm]", True)]


@pytest.mark.parametrize(("header", "weights"), HEADERS)
def test_times_of_the_test_tell_rests_and_they_stay_with_it(tmp_path, header, weights):
    made = rested(tmp_path, header, weights=weights, since="test")
    assert [hold.duration_s for hold in made.experiment.holds] == [REST_S, REST_S, REST_S, READ_S[-1]]
    assert [hold.start_s for hold in made.experiment.holds] == [0.0, REST_S, 2 * REST_S, 3 * REST_S]
    assert not any("not known" in note for note in made.notes)


@pytest.mark.parametrize(("header", "weights"), HEADERS)
def test_times_of_each_hold_do_not_tell_rests_which_is_said(tmp_path, header, weights):
    made = rested(tmp_path, header, weights=weights, since="hold")
    assert [hold.duration_s for hold in made.experiment.holds] == [READ_S[-1]] * 4
    what = "a weight was taken off" if weights else "a hold ended"
    assert any(f"when {what} is not known" in note for note in made.notes)


@pytest.mark.parametrize(
    ("levels", "said"),
    [([2, 4, 6, 4], ""), ([2, 2, 4, 6], "hold 2 begins only"), ([2, 2, 4, 4, 6], "holds 2 and 4 begin only")],
)
def test_a_clock_that_starts_again_where_the_setting_stays_is_warned_of(tmp_path, levels, said):
    path = tmp_path / "raw.csv"
    rows = [f"{level},{t},{7 * level - t / 1000:.3f}" for level in levels for t in READ_S]
    path.write_text("\n".join([HEADERS[0][0], *rows]) + "\n")
    made = convert(path, About("wire", "line", 1000.0), Choices())
    assert len(made.experiment.holds) == len(levels)
    texts = [notice.text for notice in made.warnings if notice.kind == "data"]
    assert len(texts) == bool(said) and all(said in text for text in texts)
