"""A clock of each hold beside one of the test: the one knows when a hold began, the other when it ended."""

import datetime as dt

import pytest

from tests.io.bench_files import convert, convert_all
from wirebayes.io.bench.about import About
from wirebayes.io.bench.undecided import Choices, Undecided

ABOUT = About("wire", "line", 650.0)
READ_MIN = (0.5, 1.0, 4.0, 30.0)  # since a weight was hung; the first reading comes half a minute later
BEGIN_H = (0.0, 2.0, 24.0)  # the second weight hangs over night
WEIGHTS = (6, 10, 14)
MONTH_FIRST = ("Time=time [mm/dd/yyyy]",)


def rig(tmp_path, *, elapsed="Elapsed (min)", row=None):
    """A diary of a creep rig: dates, clocks, and minutes since each weight was hung."""
    lines = [f"Date,Time,{elapsed},Weight (lb),Dial (mm)"]
    first = dt.datetime(2026, 3, 3, 8, 40)
    for hold, (begin, weight) in enumerate(zip(BEGIN_H, WEIGHTS, strict=True)):
        for k, minutes in enumerate(READ_MIN):
            moment = first + dt.timedelta(hours=begin, minutes=minutes)
            shown = minutes if row is None else row(hold, k)
            lines.append(f"{moment:%m/%d/%Y,%I:%M:%S %p},{shown:g},{weight},{10 * (hold + 1) + 0.1 * k:.2f}")
    path = tmp_path / "raw.csv"
    path.write_text("\n".join(lines))
    return path


@pytest.mark.parametrize("mapping", [MONTH_FIRST, (*MONTH_FIRST, "Elapsed (min)=ignore")])
def test_holds_begin_by_their_own_clock_and_end_by_that_of_the_test(tmp_path, mapping):
    made = convert(rig(tmp_path), ABOUT, Choices(mapping=mapping))
    holds = made.experiment.holds
    by_both = len(mapping) == 1
    late_s = 0.0 if by_both else 60.0 * READ_MIN[0]
    assert [hold.time_s.tolist() for hold in made.experiment.recorded_holds] == [
        [60.0 * minutes - late_s for minutes in READ_MIN]
    ] * 3
    assert [hold.start_s for hold in holds] == [3600.0 * begin for begin in BEGIN_H]
    said = "each hold begins where 'Elapsed (min)' counts from and, by 'Time', lasts until the next begins"
    assert (said in made.notes) == by_both
    assert any("not read: 'Elapsed" in note for note in made.notes) != by_both


def test_the_column_that_is_read_may_be_the_clock_of_holds(tmp_path):
    path = tmp_path / "raw.csv"
    lines = ["Elapsed (min),Time,Weight (lb),Dial (mm)"]
    for begin, weight in zip((0, 120, 300), WEIGHTS, strict=True):
        for minutes in READ_MIN:
            total = begin + minutes
            clock = f"{8 + int(total // 60):02d}:{int(total % 60):02d}:{int(60 * (total % 1)):02d}"
            lines.append(f"{minutes:g},{clock},{weight},{weight + 0.01 * minutes:.2f}")
    path.write_text("\n".join(lines))
    made = convert(path, ABOUT, Choices(mapping=("Elapsed (min)=time",)))
    assert [hold.start_s for hold in made.experiment.holds] == [0.0, 7200.0, 18000.0]
    of_holds = convert(path, ABOUT, Choices(mapping=("Elapsed (min)=time",), time_since="hold"))
    assert of_holds.experiment.holds[1].start_s == 60.0 * READ_MIN[-1]


def test_clocks_that_contradict_each_other_are_not_joined(tmp_path):
    """A hold that would have begun before the last reading of the one before."""
    path = rig(tmp_path, row=lambda hold, k: READ_MIN[k] + 1440.0 * (hold == 1))
    made = convert(path, ABOUT, Choices(mapping=MONTH_FIRST))
    assert not any("counts from" in note for note in made.notes)
    assert made.experiment.holds[1].start_s == 3600.0 * BEGIN_H[1]


def test_a_clock_too_coarse_to_show_the_end_of_a_hold_is_not_joined(tmp_path):
    path = tmp_path / "raw.csv"
    rows = [f"{hold + 1},{10 * k},{hold + 1}.5,{9 - 0.1 * k:.1f}" for hold in range(3) for k in range(4)]
    path.write_text("\n".join(["Duration (h),Time (s),Displacement (mm),Force (N)", *rows]))
    made = convert(path, ABOUT, Choices(mapping=("Time (s)=time",)))
    assert [hold.duration_s for hold in made.experiment.holds] == [30.0] * 3


@pytest.mark.parametrize(("unit", "day_h"), [("mm/dd/yyyy", 24.0), ("dd/mm/yyyy", 24.0 * 31)])
def test_the_user_says_whether_dates_begin_with_the_month(tmp_path, unit, day_h):
    made = convert(rig(tmp_path), ABOUT, Choices(mapping=(f"Time=time [{unit}]",)))
    assert made.experiment.holds[2].start_s == 3600.0 * day_h


def test_the_question_about_dates_names_both_answers(tmp_path):
    with pytest.raises(Undecided) as question:
        convert(rig(tmp_path), ABOUT, Choices())
    assert list(question.value.answers) == ["--map Time=time [dd/mm/yyyy]", "--map Time=time [mm/dd/yyyy]"]


@pytest.mark.parametrize("order", ["mm/dd/yyyy", "MM/DD/YY", "mm/dd/yyyy hh:mm:ss"])
def test_a_header_says_what_dates_begin_with(tmp_path, order):
    path = tmp_path / "raw.csv"
    rows = [f"0{3 + (k > 2)}/0{3 + (k > 2)}/26 8:00:0{k},{1 + (k > 2)},{5 - 0.1 * k:.1f}" for k in range(6)]
    path.write_text("\n".join([f"Time ({order}),Displacement (mm),Force (N)", *rows]).replace("04/04", "03/04"))
    made = convert(path, ABOUT, Choices())
    assert made.experiment.holds[1].start_s == 86400.0 + 3.0


@pytest.mark.parametrize(("order", "begin_h"), [("mm/dd/yyyy", 24.0), ("dd/mm/yyyy", 24.0 * 31)])
def test_the_header_of_dates_in_a_column_of_their_own_says_it_too(tmp_path, order, begin_h):
    path = rig(tmp_path)
    path.write_text(path.read_text().replace("Date,", f"Date ({order}),"))
    assert convert(path, ABOUT, Choices()).experiment.holds[2].start_s == 3600.0 * begin_h


def machine(tmp_path, intervals_s):
    """Two specimens, each below a line of its own: a logger that every move starts anew, as its intervals show."""
    lines = ["Laboratorio;;;"]
    clock = dt.datetime(2026, 5, 11, 9, 12, 33, 500000)
    for specimen in (1, 2):
        lines += [f"Campione {specimen};;;", "Data e ora;Traversa;Forza;Gradino", ";mm;kN;"]
        for hold in (1, 2, 3):
            for k, interval in enumerate((0, *intervals_s)):
                clock += dt.timedelta(seconds=interval)
                force = f"{hold - 0.002 * k:.3f}".replace(".", ",")
                lines.append(f"{clock:%d/%m/%Y %H:%M:%S},5;{5 * hold},00;{force};{hold}")
            clock += dt.timedelta(seconds=10)
    path = tmp_path / "raw.csv"
    path.write_text("\n".join(lines))
    return convert_all(path, ABOUT, Choices())


def test_dates_with_times_between_lines_of_words_need_no_name(tmp_path):
    made = machine(tmp_path, (2, 3, 5, 10, 20, 20, *(60,) * 30))
    assert [len(each.experiment.holds) for each in made] == [3, 3]
    assert all("displacement from 'Traversa', time from 'Data e ora'" in " ".join(each.notes) for each in made)


@pytest.mark.parametrize(("early_s", "first_s"), [((2, 3, 5, 10, 20), 0.0), ((10, 10, 10, 10, 10), 5.0)])
def test_a_logger_that_a_move_starts_reads_often_after_it(tmp_path, early_s, first_s):
    """Ten seconds lie between holds: less than the late intervals of a minute, more than those after a move."""
    made = machine(tmp_path, (*early_s, *(60,) * 30))[0]
    assert [hold.time_s[0] for hold in made.experiment.holds] == [0.0, first_s, first_s]
