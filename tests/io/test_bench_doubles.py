"""What stands twice in a file: one quantity in two units, beside a constant of the same; labels that come again."""

import numpy as np
import pytest

from tests.io.bench_files import convert
from wirebayes.errors import InputError
from wirebayes.io.bench.about import About
from wirebayes.io.bench.convert import convert as convert_all
from wirebayes.io.bench.undecided import Choices, Undecided

ABOUT = About("wire", "line", 1000.0)
READINGS = [(x, t, 3.0 * x - t / 100.0) for x in (1.0, 2.0) for t in (0.0, 30.0, 120.0)]


def read(tmp_path, header, rows, **choices):
    path = tmp_path / "raw.csv"
    path.write_text("\n".join([header, *rows]))
    return convert(path, ABOUT, Choices(**choices))


def of_readings(made):
    return [tuple(row[1:4]) for row in made.rows if row[3] is not None]


@pytest.mark.parametrize(("off", "asked"), [(0.0, False), (0.005, False), (0.05, True)])
def test_of_one_force_in_two_units_the_finer_is_read(tmp_path, off, asked):
    """Written to a hundredth and a thousandth; the second is off by a share of what rounding makes."""
    rows = [f"{x / 25.4:.5f},{x},{t},{f:.2f},{(f + off) / 4.4482216:.4f}" for x, t, f in READINGS]
    header = "Extension (in),Extension (mm),t (s),Load (N),Load (lbf)"
    if asked:
        with pytest.raises(Undecided, match=r"Load \(N\) and Load \(lbf\), each of which"):
            read(tmp_path, header, rows)
    else:
        made = read(tmp_path, header, rows)
        assert of_readings(made) == [pytest.approx((x, t, f + off), abs=3e-4) for x, t, f in READINGS]
        assert "tension from 'Load (lbf)'" in made.notes[0]


@pytest.mark.parametrize(("places", "asked"), [(1, True), (3, False)])
def test_sensors_of_two_names_are_one_only_to_fine_steps(tmp_path, places, asked):
    """At 2 % less, to a tenth, an extensometer looks like a crosshead; to a thousandth both say the same or do not."""
    rows = [f"{x:.{places}f},{x * (0.98 if asked else 1.0) / 25.4:.5f},{t},{f}" for x, t, f in READINGS]
    header = "Crosshead (mm),Extension (in),t (s),Load (N)"
    if asked:
        with pytest.raises(Undecided, match=r"Crosshead \(mm\) and Extension \(in\), each of which"):
            read(tmp_path, header, rows)
    else:
        assert of_readings(read(tmp_path, header, rows)) == [pytest.approx(r, abs=3e-4) for r in READINGS]


def test_a_constant_beside_a_force_is_none(tmp_path):
    rows = [f"220,{x},{t},{f:.2f}" for x, t, f in READINGS]
    assert of_readings(read(tmp_path, "Breaking load (N),x (mm),t (s),Load (N)", rows)) == [
        pytest.approx(r) for r in READINGS
    ]
    with pytest.raises(Undecided, match="each of which may be the tension"):
        read(tmp_path, "Load 2 (N),x (mm),t (s),Load (N)", [f"{f + 1},{x},{t},{f:.2f}" for x, t, f in READINGS])


@pytest.mark.parametrize("labels", [("low", "high"), ("1", "2")])
def test_labels_of_levels_that_come_again_number_no_holds(tmp_path, labels):
    rows = [f"{labels[i % 2]},{1 + i % 2},{t + 90 * i},{5 + i % 2 - t / 100}" for i in range(4) for t in (0, 30, 60)]
    made = read(tmp_path, "Stage,x (mm),t (s),F (N)", rows)
    assert [hold.number for hold in made.experiment.holds] == [1, 2, 3, 4]
    assert any("numbered in order: what numbers or names them comes again" in note for note in made.notes)
    same = [row.replace(",2,", ",1,", 1) if i in (3, 4, 5) else row for i, row in enumerate(rows)]
    with pytest.raises(InputError, match="expected a hold number above"):  # a misprint at one displacement
        read(tmp_path, "Stage,x (mm),t (s),F (N)", same)


@pytest.mark.parametrize("round_s", [0, 270])
def test_numbers_of_holds_that_begin_again_with_the_clock_may_be_of_another_specimen(tmp_path, round_s):
    """The second test differs by 1 N; on a clock that goes on it is a second cycle of the same wire."""
    rows = [
        f"{x},{x},{t + 90 * x + i * round_s},{5 * x + i - t / 100}"
        for i in (0, 1)
        for x in (1, 2, 3)
        for t in (0, 30, 60)
    ]
    header = "Hold,x (mm),t (s),F (N)"
    if round_s:
        assert [hold.number for hold in read(tmp_path, header, rows).experiment.holds] == [1, 2, 3, 4, 5, 6]
        return
    with pytest.raises(Undecided, match="found '1' after '3' where what was set begins again") as asked:
        read(tmp_path, header, rows)
    assert set(asked.value.answers) == {"--specimens several", "--specimens one"}
    assert len(read(tmp_path, header, rows, specimens="one").experiment.holds) == 6
    several = convert_all(tmp_path / "raw.csv", ABOUT, Choices(specimens="several", time_since="test"))
    assert [made.experiment.name for made in several] == ["wire-1", "wire-2"]
    assert [made.rows[0][3] for made in several] == [5.0, 6.0]


@pytest.mark.parametrize("numbered", [True, False])
def test_readings_before_a_trigger_are_left_out(tmp_path, numbered):
    """They are of the hold before, at whose displacement they may stand."""
    rows = []
    for x in (1, 2, 3):
        rows += [f"{x},{x - numbered},{t},0.5" for t in (-2, -1)] + [
            f"{x},{x},{t},{5 * x - t / 100}" for t in (0, 30, 60)
        ]
    made = read(tmp_path, "Hold,x (mm),t (s),F (N)" if numbered else "Set,x (mm),t (s),F (N)", rows)
    assert of_readings(made) == [(x, t, 5 * x - t / 100) for x in (1, 2, 3) for t in (0, 30, 60)]
    assert "readings before time zero left out: 6" in made.notes


@pytest.mark.parametrize(
    ("header", "cell", "day_s"),
    [
        ("Date", lambda d: f"2026-06-{1 + d:02d}", 86400.0),
        ("Datum", lambda d: f"{1 + d:02d}.06.2026", 86400.0),
        ("Day", str, 86400.0),
        ("Tag", str, 86400.0),
        ("Zeit (Tage)", str, 86400.0),
        ("Week", str, 604800.0),
    ],
)
def test_dates_and_days_alone_are_the_time(tmp_path, header, cell, day_s):
    days = [(kg, d) for kg, begin in ((5, 0), (10, 10)) for d in (begin, begin + 1, begin + 3, begin + 8)]
    rows = [f"{cell(d)},{kg},{kg + d / 10}" for kg, d in days]
    made = read(tmp_path, f"{header},Load (kg),Elongation (mm)", rows, time_since="test")
    assert [row[2] / day_s for row in made.rows if row[1] is not None] == [0, 1, 3, 8, 0, 1, 3, 8]


@pytest.mark.parametrize("header", ["Hour", "h"])
def test_dates_beside_a_part_of_their_times_are_not_taken_for_midnights(tmp_path, header):
    rows = [f"2026-06-{1 + d:02d},{8 + d % 3},{5 if d < 4 else 10},{5 + d / 10}" for d in range(8)]
    with pytest.raises(Undecided, match="found no column of time"):
        read(tmp_path, f"Date,{header},Load (kg),Elongation (mm)", rows)


def test_a_day_beside_another_clock_is_no_clock(tmp_path):
    rows = [f"2026-06-{1 + x},{x},{t},{5 * x - t / 100}" for x in (1, 2) for t in (0, 30, 60)]
    assert [row[2] for row in read(tmp_path, "Date,x (mm),t (s),F (N)", rows).rows] == [0, 30, 60] * 2


def test_a_pause_before_a_move_is_no_part_of_it(tmp_path):
    """A logger that reads ever less often in a hold, and often again when the wire is moved for 4 s."""
    rows, now = [], 0.0
    since = np.unique(np.round(np.geomspace(0.5, 600.0, 60) * 2) / 2)
    for x in (4, 8, 12):
        rows += [f"{now + t},{x - 4 + t},{x}" for t in np.arange(0.5, 4.0, 0.5)]
        rows += [f"{now + 4.0 + t},{x},{5 * x - np.log1p(t) / 10:.3f}" for t in since[since < 540.0]]
        now += 604.0
    made = read(tmp_path, "t (s),x (mm),F (N)", rows)
    assert [hold.setting for hold in made.experiment.holds] == [4.0, 8.0, 12.0]
    assert not made.warnings
    assert made.experiment.holds[1].time_s[0] < 10.0
