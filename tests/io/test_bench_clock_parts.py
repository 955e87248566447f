"""Hours, minutes and seconds in columns of their own; minutes that begin again with the hour."""

from datetime import datetime, timedelta

import pytest

from tests.io.bench_files import convert
from wirebayes.errors import InputError
from wirebayes.io.bench.about import About
from wirebayes.io.bench.undecided import Choices

ABOUT = About("wire", "line", 1000.0)
READ_S = (0, 30, 90, 600, 4000)


def read(tmp_path, header, times, **choices):
    """Times of each of two holds, by a test whose time stands in cells of `times(hold, time)`."""
    rows = [f"{times(hold, t)},{hold + 1},{5 * hold + 8 - t / 1e4}" for hold in (0, 1) for t in READ_S]
    path = tmp_path / "raw.csv"
    path.write_text("\n".join([f"{header},x (mm),F (N)", *rows]))
    made = convert(path, ABOUT, Choices(**choices))
    found = [[row[2] for row in made.rows if row[0] == hold and row[3] is not None] for hold in (1, 2)]
    return found, [*made.notes, f"lasts {made.experiment.holds[0].duration_s:g} s"]


def parts(of_test, begin=0, days=""):
    def cells(hold, t):
        seconds = begin + t + (5000 * hold if of_test else 0)
        return f"{days}{seconds // 3600},{seconds // 60 % 60},{seconds % 60}"

    return cells


@pytest.mark.parametrize(
    "header",
    [
        "h,min,s",
        "Hours,Minutes,Seconds",
        "Hours (h),Minutes (min),Seconds (s)",
        "Time (h),Time (min),Time (s)",
        "Time h,min,s",
        "HH,MM,SS",
    ],
)
@pytest.mark.parametrize("of_test", [False, True])
def test_parts_of_a_time_side_by_side_are_one(tmp_path, header, of_test):
    found, notes = read(tmp_path, header, parts(of_test))
    assert found == [[*READ_S], [*READ_S]]
    assert f"time from {', '.join(header.split(','))}" in notes[0]


def test_parts_of_a_date_go_with_those_of_a_clock(tmp_path):
    """The first hold passes midnight, and a day and a half pass before the second."""

    def cells(hold, t):
        moment = datetime(2026, 6, 30, 23) + timedelta(seconds=t + 134000 * hold)
        return f"{moment:%Y,%m,%d,%H,%M,%S}"

    found, notes = read(tmp_path, "Year,Month,Day,Hour,Minute,Second", cells)
    assert found == [[*READ_S], [*READ_S]]
    assert "date from Year, Month, Day, time from Hour, Minute, Second, dates from 'date'" in notes[0]
    assert notes[-1] == "lasts 134000 s"


def test_minutes_and_seconds_go_beyond_the_hour(tmp_path):
    found, _ = read(tmp_path, "Time (min),Time (s)", lambda hold, t: f"{t // 60},{t % 60}.5")
    assert found == [[t + 0.5 for t in READ_S], [t + 0.5 for t in READ_S]]


def test_one_time_in_two_units_is_no_parts(tmp_path):
    found, _ = read(tmp_path, "Time (min),Time (s)", lambda hold, t: f"{t / 60:.6f},{t}")
    assert found == [pytest.approx(READ_S, abs=1e-3)] * 2
    with pytest.raises(InputError, match="which tell different times"):
        read(tmp_path, "Time (min),Time (s)", lambda hold, t: f"{t // 60},{t % 100}")  # nobody counts to 60


def test_columns_of_two_names_are_no_parts(tmp_path):
    """How long holds are to last, beside the time; minutes of the test beside seconds of the hold."""
    found, notes = read(tmp_path, "Duration (h),Time (min)", lambda hold, t: f"2,{READ_S.index(t)}")
    assert found == [[0, 60, 120, 180, 240]] * 2
    assert "not read: 'Duration (h)'" in notes
    with pytest.raises(InputError, match=r"Time \(min\)"):
        read(tmp_path, "Time (min),t in hold (s)", lambda hold, t: f"{2 * hold},{10 * READ_S.index(t)}")


def test_a_mass_and_a_way_are_no_minutes_and_seconds(tmp_path):
    path = tmp_path / "raw.csv"
    rows = [f"{kg},{kg + t / 1e4:.5f},{t}" for kg in (5, 10) for t in READ_S]
    path.write_text("\n".join(["m,s,t", "kg,mm,s", *rows]))
    made = convert(path, ABOUT, Choices(mapping=("m=tension",)))
    assert [row[2] for row in made.rows if row[1] is not None] == [*READ_S, *READ_S]
    path.write_text("\n".join(["mm,s,N", *(f"{x},{t},{5 * x}" for x in (1, 2) for t in (0, 30, 50))]))
    assert [tuple(row[1:]) for row in convert(path, ABOUT, Choices()).rows][:2] == [(1.0, 0.0, 5.0), (1.0, 30.0, 5.0)]


def test_columns_that_the_user_names_are_read_as_they_are_called(tmp_path):
    mapping = ("Time (s)=time", "Time (min)=ignore")
    found, _ = read(
        tmp_path, "Time (min),Time (s)", lambda hold, t: f"{READ_S.index(t)},{READ_S.index(t)}", mapping=mapping
    )
    assert found == [[0, 1, 2, 3, 4], [0, 1, 2, 3, 4]]


def clock(begin, of_test=True):
    """A third of the times, as a clock shows them that goes round within the hour."""

    def cell(hold, t):
        seconds = int(begin + t // 3) + 2000 * hold * of_test
        return f"{seconds // 60 % 60:02d}:{seconds % 60:02d}"

    return cell


def test_minutes_that_begin_again_with_the_hour_go_on(tmp_path):
    found, notes = read(tmp_path, "Time (mm:ss)", clock(3000))
    assert found == [[t // 3 for t in READ_S]] * 2
    assert "the clock passes the hour 1 time" in notes


@pytest.mark.parametrize("begin", [0, 600])
def test_durations_that_begin_anew_pass_no_hour(tmp_path, begin):
    """Holds of more than half an hour that are timed anew, their first readings alike."""

    def cell(hold, t):
        return clock(begin, of_test=False)(hold, 2 * t)

    found, notes = read(tmp_path, "Time (mm:ss)", cell)
    assert found[0] == found[1] and found[0][0] == begin
    assert not any("passes the hour" in note for note in notes)
