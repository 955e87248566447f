"""What a person reads at once: dates beside clocks, units apart from names, factors, tables in Markdown."""

import re
from datetime import datetime, timedelta

import pytest

from tests.io.bench_files import convert
from wirebayes.cli.import_bench import _ask
from wirebayes.errors import InputError
from wirebayes.io.bench.about import About
from wirebayes.io.bench.undecided import Choices, Undecided

ABOUT = About("wire", "line", 1000.0)
DAY_S = 86400.0
ROWS = [(600.0 * hold + time, hold + 1.0, 5.0 * hold + 5.0 - time / 100) for hold in (0, 1, 2) for time in (0, 30, 60)]


def read(tmp_path, header, lines, **choices):
    path = tmp_path / "raw.csv"
    path.write_text("\n".join([*header, *lines]))
    return convert(path, ABOUT, Choices(**choices))


def assert_is_the_test(made):
    assert [hold.setting for hold in made.experiment.holds] == [1.0, 2.0, 3.0]
    assert [list(hold.time_s) for hold in made.experiment.holds] == [[0.0, 30.0, 60.0]] * 3
    assert [value for hold in made.experiment.holds for value in hold.readings] == pytest.approx([y for *_, y in ROWS])


def two_days(time):
    """A moment of the test, whose last hold is made a day later."""
    return datetime(2026, 6, 14, 9) + timedelta(seconds=time, days=time >= 1200.0)


@pytest.mark.parametrize(
    ("form", "merged"),
    [("%d.%m.%Y;%H:%M:%S", False), ("%m/%d/%Y;%I:%M:%S %p", False), ("%Y-%m-%d;%H:%M:%S", True),
     ("%Y-%m-%d 00:00:00;%H:%M:%S", False)],
)  # fmt: skip
def test_a_day_that_passes_unread_is_known_by_a_column_of_dates(tmp_path, form, merged):
    lines, last = [], ""
    for time, x, y in ROWS:
        date, clock = f"{two_days(time):{form}}".split(";")
        lines.append(f"{'' if merged and date == last else date};{clock};{x};{y}")
        last = date
    made = read(tmp_path, ["Datum;Uhrzeit;Weg [mm];Kraft [N]"], lines)
    assert_is_the_test(made)
    assert [hold.start_s for hold in made.experiment.holds] == [0.0, 600.0, 1200.0 + DAY_S]
    assert "dates from 'Datum'" in made.notes[0] and not any("not read" in note for note in made.notes)


@pytest.mark.parametrize(("header", "first"), [("Day", 1), ("Tag", 0), ("Jour", 7)])
def test_a_day_that_passes_unread_is_known_by_the_numbers_of_days(tmp_path, header, first):
    lines = [f"{first + (time >= 1200.0)};{two_days(time):%H:%M:%S};{x};{y}" for time, x, y in ROWS]
    made = read(tmp_path, [f"{header};Time;Position (mm);Force (N)"], lines)
    assert_is_the_test(made)
    assert [hold.start_s for hold in made.experiment.holds] == [0.0, 600.0, 1200.0 + DAY_S]
    assert f"days from '{header}'" in made.notes[0]


@pytest.mark.parametrize(("clocks", "of_day"), [(["0:00", "0:01", "0:03"], False), (["0:00", "6:00", "18:00"], True)])
def test_only_clocks_of_the_day_go_with_dates(tmp_path, clocks, of_day):
    """Durations of holds begin anew at zero, and no date says how long the wire rested."""
    lines = [f"2026-06-{day};{clock}:00;{day};{day - n / 10}" for day in (14, 16) for n, clock in enumerate(clocks)]
    made = read(tmp_path, ["Date;Time;Position (mm);Force (N)"], lines)
    assert [hold.duration_s for hold in made.experiment.holds] == ([2 * DAY_S, 64800.0] if of_day else [180.0] * 2)
    assert ("dates from 'Date'" in made.notes[0]) == of_day


def test_dates_beside_midnights_alone_are_the_times(tmp_path):
    lines = [f"2026-06-{day};00:00:00;{1 + day // 14};{20 - day / 10}" for day in range(10, 18)]
    made = read(tmp_path, ["Date;Time;Position (mm);Force (N)"], lines)
    assert [hold.duration_s for hold in made.experiment.holds] == [4 * DAY_S, 3 * DAY_S]


def test_dates_do_not_go_with_clocks_that_are_said_to_count_from_holds(tmp_path):
    lines = [f"2026-06-{day};{n + 1}:00:00;{day};{day - n / 10}" for day in (14, 16) for n in range(3)]
    head = ["Date;Time;Position (mm);Force (N)"]
    assert [hold.duration_s for hold in read(tmp_path, head, lines).experiment.holds] == [2 * DAY_S, 7200.0]
    of_holds = read(tmp_path, head, lines, time_since="hold")
    assert [hold.duration_s for hold in of_holds.experiment.holds] == [10800.0, 10800.0]


@pytest.mark.parametrize(("header", "last"), [("Run", 2), ("Day", 0)])
def test_other_numbers_beside_clocks_are_no_days(tmp_path, header, last):
    lines = [
        f"{last if time >= 1200.0 else 1};{datetime(2026, 6, 14, 9) + timedelta(seconds=time):%H:%M:%S};{x};{y}"
        for time, x, y in ROWS
    ]
    made = read(tmp_path, [f"{header};Time;Position (mm);Force (N)"], lines)
    assert [hold.start_s for hold in made.experiment.holds] == [0.0, 600.0, 1200.0]


def test_dates_that_are_no_clocks_column_stay_unread(tmp_path):
    lines = [f"2026-06-14;{time};{x};{y}" for time, x, y in ROWS]
    made = read(tmp_path, ["Datum;Zeit [s];Weg [mm];Kraft [N]"], lines)
    assert_is_the_test(made)
    assert "not read: 'Datum'" in made.notes


@pytest.mark.parametrize("name", ["When", "Stamp", "Zeitpunkt der Messung"])
def test_moments_are_the_time_whatever_they_are_called(tmp_path, name):
    lines = [f"{two_days(time):%Y-%m-%d %H:%M:%S};{x};{y}" for time, x, y in ROWS]
    assert_is_the_test(read(tmp_path, [f"{name};Weg [mm];Kraft [N]"], lines))


def test_units_in_brackets_belong_to_the_name_before_them_between_spaces(tmp_path):
    lines = [f"{time:10.1f} {x:14.2f} {y:12.3f}" for time, x, y in ROWS]
    assert_is_the_test(read(tmp_path, ["  Tiempo (s)   Desplazamiento (mm)   Carga [N]"], lines))


def test_the_line_under_the_header_of_a_markdown_table_is_none(tmp_path):
    lines = [f"| {time} | {x} | {y} |" for time, x, y in ROWS]
    assert_is_the_test(read(tmp_path, ["| time (s) | position (mm) | force (N) |", "|---|:---:|---:|"], lines))


@pytest.mark.parametrize(
    ("header", "said", "times"),
    [("Force x10 (N)", "10 N", 10.0), ("Load × 100 [N]", "100 N", 100.0), ("Force *10^3 [N]", "1000 N", 1e3),
     ("Force 10x (N)", "10 N", 10.0), ("100 × Load [N]", "100 N", 100.0)],
)  # fmt: skip
def test_a_factor_beside_a_name_is_asked_about(tmp_path, header, said, times):
    lines = [f"{time};{x};{y / times}" for time, x, y in ROWS]
    head = [f"Time (s);Position (mm);{header}"]
    with pytest.raises(Undecided, match=r"beside the name, expected --map .*" + said):
        read(tmp_path, head, lines)
    assert_is_the_test(read(tmp_path, head, lines, mapping=(f"{header}=tension [{said}]",)))


@pytest.mark.parametrize(("said", "times"), [("2 N", 2.0), ("N", 1.0)])
def test_a_share_of_a_force_is_asked_about(tmp_path, said, times):
    lines = [f"{time};{x};{y / times}" for time, x, y in ROWS]
    head = ["Time (s);Position (mm);Force/2 (N)"]
    with pytest.raises(Undecided, match=r"found '/2' beside the name, expected --map .*\[2 N\].*\[0.5 N\].*\[N\]"):
        read(tmp_path, head, lines)
    assert_is_the_test(read(tmp_path, head, lines, mapping=(f"Force/2 (N)=tension [{said}]",)))


@pytest.mark.parametrize(
    ("header", "option"),
    [("log10 time (s);Position (mm);Force (N)", "log10 time (s)=time [s]"),
     ("Time (s);Displacement increment (mm);Force (N)", "Displacement increment (mm)=displacement [mm]"),
     ("Time (s);Position (mm);Force change (N)", "Force change (N)=tension [N]"),
     ("Time (s);Position (mm);Load per strand (N)", "Load per strand (N)=tension [N]"),
     ("Zeit (s);Weg (mm);Kraftänderung (N)", "Kraftänderung (N)=tension [N]")],
)  # fmt: skip
def test_what_was_made_of_a_quantity_is_taken_for_it_only_by_the_user(tmp_path, header, option):
    lines = [f"{time};{x};{y}" for time, x, y in ROWS]
    with pytest.raises(Undecided, match=f"in the name, expected --map .{re.escape(option)}. to say that it is the"):
        read(tmp_path, [header], lines)
    assert_is_the_test(read(tmp_path, [header], lines, mapping=(option,)))


@pytest.mark.parametrize(
    "header", ["Length change (mm)", "Change in length (mm)", "Längenänderung (mm)", "Delta L (mm)"]
)
def test_a_change_in_length_is_a_displacement(tmp_path, header):
    lines = [f"{time};{x};{y}" for time, x, y in ROWS]
    assert_is_the_test(read(tmp_path, [f"Time (s);{header};Force (N)"], lines, mapping=(f"{header}=displacement",)))


@pytest.mark.parametrize(
    "header", ["Force 10 (N)", "Sensor 1/2 force (N)", "Box 10 force (N)", "Force 2x (N)", "ax10 force (N)"]
)
def test_other_numbers_beside_names_are_no_factors(tmp_path, header):
    lines = [f"{time};{x};{y}" for time, x, y in ROWS]
    assert_is_the_test(read(tmp_path, [f"Time (s);Position (mm);{header}"], lines))


def test_an_ambiguous_date_in_a_column_of_its_own_is_refused(tmp_path):
    lines = [f"{two_days(time).replace(day=4 + (time >= 1200.0)):%d/%m/%Y;%H:%M:%S};{x};{y}" for time, x, y in ROWS]
    with pytest.raises(InputError, match="may begin with the day or with the month"):
        read(tmp_path, ["Date;Time;Position (mm);Force (N)"], lines)


@pytest.mark.parametrize("header", ["Load no", "No. of load", "load #", "Weight number", "Stufe Nr.", "Nr. Last"])
def test_what_numbers_the_loads_of_a_test_numbers_its_holds(tmp_path, header):
    lines = [f"{x:.0f};{time};{x};{y}" for time, x, y in ROWS]
    made = read(tmp_path, [f"{header};Time (s);Position (mm);Force (N)"], lines)
    assert_is_the_test(made)
    assert any(f"hold from '{header}'" in note for note in made.notes)


@pytest.mark.parametrize("header", ["Força no fio (N)", "Load, sensor no. 2 (N)"])
def test_a_number_amid_other_words_numbers_no_holds(tmp_path, header):
    lines = [f"{time};{x};{y}" for time, x, y in ROWS]
    assert_is_the_test(read(tmp_path, [f"Time (s);Position (mm);{header}"], lines))


@pytest.mark.parametrize("name", ["carriage_um", "Slide [µm]", "Schlitten (µm)", "Carrello (µm)"])
def test_what_moves_on_a_rig_is_the_displacement_where_nothing_else_is(tmp_path, name):
    rows = [
        f"{1000 * (61 * hold + t)}\t{100.0 * hold - t / 10:.1f}\t{1000 * hold}" for hold in (1, 2) for t in (0, 5, 10)
    ]
    made = read(tmp_path, [f"millis\tload_g\t{name}"], rows, time_since="test")
    assert [hold.setting for hold in made.experiment.holds] == [1.0, 2.0]
    with_displacement = [f"{row}\t{row.split()[-1]}7" for row in rows]
    beside = read(tmp_path, [f"millis\tload_g\t{name}\tdisplacement_um"], with_displacement, time_since="test")
    assert [hold.setting for hold in beside.experiment.holds] == [10.007, 20.007]


def test_readings_without_a_clock_may_be_counted(tmp_path):
    lines = [f"{i},{x},{y}" for i, (_, x, y) in enumerate(ROWS, start=1)]
    header = ["No.,Displacement (mm),Force (N)"]
    with pytest.raises(
        Undecided, match=r'say which with --map "No.=time \[0.5 s\]" \(with the time between two readings'
    ):
        read(tmp_path, header, lines)
    with pytest.raises(
        InputError, match=r'found numbers that count the readings, expected --map "No.=time \[0.5 s\]", with'
    ):
        read(tmp_path, header, lines, mapping=("No.=time",))
    made = read(tmp_path, header, lines, mapping=("No.=time [30 s]",), time_since="test")
    assert [list(hold.time_s[:3]) for hold in made.experiment.holds] == [[0.0, 30.0, 60.0]] * 3


def test_columns_in_the_unit_of_what_is_missing_are_named_to_be_copied(tmp_path):
    lines = [f"{time},{y + 3.2},{y},{x}" for time, x, y in ROWS]
    header = ["t [s],Gross [N],Net [N],Position [mm]"]
    with pytest.raises(Undecided, match=r'say which with --map "Gross \[N\]=tension" or --map "Net \[N\]=tension"$'):
        read(tmp_path, header, lines)
    assert_is_the_test(read(tmp_path, header, lines, mapping=("Net [N]=tension",)))


def test_a_person_at_a_terminal_sees_options_that_can_be_copied(monkeypatch, capsys):
    question = Undecided("raw.csv: found no unit", "the unit of time", {"--map My time=time [s]": "s"})
    monkeypatch.setattr("typer.prompt", lambda *_, **__: 1)
    assert _ask(question) == "--map My time=time [s]"
    assert '  1  s  (--map "My time=time [s]")' in capsys.readouterr().err


def test_units_behind_the_sign_that_parts_cells_belong_to_the_names_before_them(tmp_path):
    lines = [f"{time},{x},{y}" for time, x, y in ROWS]
    assert_is_the_test(read(tmp_path, ["Time, s,Displacement, mm,Force, N"], lines))
    with pytest.raises(InputError):  # readings of six columns
        read(tmp_path, ["Time, s,Displacement, mm,Force, N"], [f"{line},1,2,3" for line in lines])
