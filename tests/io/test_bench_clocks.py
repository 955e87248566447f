"""Times written in two units or three: hours and minutes, minutes and seconds, with colons, points, dashes or words."""

import pytest

from tests.io.bench_files import convert
from wirebayes.errors import InputError
from wirebayes.io.bench.about import About
from wirebayes.io.bench.compound_times import spelt_s
from wirebayes.io.bench.undecided import Choices, Undecided

ABOUT = About("wire", "line", 1000.0)


def bench_file(tmp_path, header, cells):
    path = tmp_path / "raw.csv"
    sign = "," if "," in cells[0] else "."
    rows = [f"{hold};{hold};{cell};{hold}{sign}{9 - i}\n" for hold in (1, 2) for i, cell in enumerate(cells)]
    path.write_text(f"Hold;Displacement [mm];{header};Force [N]\n" + "".join(rows))
    return path


def times_of(tmp_path, header, cells, **choices):
    """Times in s of the first hold."""
    made = convert(bench_file(tmp_path, header, cells), ABOUT, Choices(**choices))
    return [row[2] for row in made.rows[: len(cells)]]


@pytest.mark.parametrize(
    "header",
    ["Time [h-min]", "Time (h:min)", "Time hh:mm", "Zeit [Std:Min]", "Time (hours and minutes)", "Time in h:mm",
     "Zeit in Stunden und Minuten", "Temps (h:min)", "Duration [h min]", "Hours:minutes"],
)  # fmt: skip
def test_a_header_says_that_clocks_are_hours_and_minutes(tmp_path, header):
    assert times_of(tmp_path, header, ["0:00", "0:30", "26:05"]) == [0.0, 1800.0, 93900.0]


@pytest.mark.parametrize("header", ["Time [min:ss]", "Time [min-s]", "Time m:s", "Dauer (Minuten und Sekunden)"])
def test_a_header_says_that_clocks_are_minutes_and_seconds(tmp_path, header):
    assert times_of(tmp_path, header, ["0:00", "0:30", "75:05.5"]) == [0.0, 30.0, 4505.5]


def test_what_clocks_were_taken_for_is_said(tmp_path):
    notes = convert(bench_file(tmp_path, "Time [h-min]", ["0:00", "0:30"]), ABOUT, Choices()).notes
    assert "time from 'Time [h-min]' (hours and minutes)" in notes[0]


@pytest.mark.parametrize(
    ("header", "cells"),
    [
        ("Time [hh.mm]", ["0.00", "0.30", "1.05"]),
        ("Time [hh.mm]", ["0,00", "0,30", "1,05"]),
        ("Time [h-min]", ["0-00", "0-30", "1-05"]),
        ("Time [h-min]", ["0-0", "0-30", "1-5"]),
    ],
)
def test_points_and_dashes_divide_clocks_where_the_header_has_them(tmp_path, header, cells):
    assert times_of(tmp_path, header, cells) == [0.0, 1800.0, 3900.0]


@pytest.mark.parametrize(
    "cells",
    [
        ("0h00", "0h01m30", "1h05"),
        ("0 h 0 min", "0 h 1 min 30 s", "1 h 5 min"),
        ("0", "90 s", "1 h 5 min"),
        ("0'00''", "1'30''", "65'0''"),
        ("0 m 0 s", "1 m 30 s", "65 m"),
    ],
)
def test_cells_that_name_their_units_need_no_header(tmp_path, cells):
    assert times_of(tmp_path, "Time", cells) == [0.0, 90.0, 3900.0]


@pytest.mark.parametrize(
    ("cells", "seconds"),
    [(("0:30", "59:30", "1:00:30"), [30.0, 3570.0, 3630.0]), (("0:30", "0:30:30", "0:31"), [1800.0, 1830.0, 1860.0])],
)
def test_beside_clocks_of_three_parts_those_of_two_are_what_makes_times_rise(tmp_path, cells, seconds):
    assert times_of(tmp_path, "Time", cells) == seconds


@pytest.mark.parametrize("header", ["Time (durations in minutes)", "Duration in minutes", "Durée (min)", "Dauer [min]"])
def test_durations_are_times(tmp_path, header):
    assert times_of(tmp_path, header, ["0", "5", "30"]) == [0.0, 300.0, 1800.0]


def test_a_column_called_time_stands_before_one_called_duration(tmp_path):
    path = tmp_path / "raw.csv"
    path.write_text("x [mm];Time [s];Hold duration [s];F [N]\n1;0;60;2.0\n1;30;60;1.9\n1;60;60;1.8\n")
    assert [row[2] for row in convert(path, ABOUT, Choices()).rows] == [0.0, 30.0, 60.0]


@pytest.mark.parametrize(
    ("header", "cells", "first"),
    [
        ("Time [hh:mm]", ["0", "5", "30"], "s"),
        ("Hours:minutes", ["0", "0.5", "1.5"], "s"),
        ("Time h:mm:ss", ["0", "0.5", "1.5"], "s"),
        ("Time (h:min)", ["0.00", "0.30", "1.05"], "hh.mm"),
        ("Time (h, min)", ["0,00", "0,30", "1,05"], "hh.mm"),
        ("Time [min:s]", ["0.00", "0.30", "1.05"], "mm.ss"),
    ],
)
def test_plain_numbers_under_a_clock_are_asked_about(tmp_path, header, cells, first):
    """They had been read as seconds."""
    with pytest.raises(Undecided, match=r"line 2, column 3 .*: found '0") as refused:
        times_of(tmp_path, header, cells)
    assert next(iter(refused.value.answers)) == f"--map {header}=time [{first}]"
    factors = {"s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0}
    for answer in refused.value.answers:
        unit = answer[answer.rindex("[") + 1 : -1]
        made = convert(bench_file(tmp_path, header, cells), ABOUT, Choices().with_option(answer))
        clock = {"hh.mm": 3900.0, "mm.ss": 65.0}.get(unit)
        assert made.rows[2][2] == pytest.approx(clock or factors[unit] * float(cells[2].replace(",", ".")))


@pytest.mark.parametrize("cells", [("0:00", "0:60"), ("0:00:00", "0:00:60"), ("0:00:00", "0:60:00")])
def test_a_clock_counts_to_59(tmp_path, cells):
    with pytest.raises(
        InputError, match=rf"line 3, column 3 \(Time \[hh:mm\]\): found '{cells[1]}', expected .*below 60"
    ):
        times_of(tmp_path, "Time [hh:mm]", cells)
    assert times_of(tmp_path, "Time [hh:mm]", [cell.replace("60", "59") for cell in cells])


def test_a_cell_without_its_unit_among_cells_with_theirs_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"line 4, column 3 \(Time\): found '2', expected a time such as 1 h 30 min"):
        times_of(tmp_path, "Time", ["0", "1 h 30 min", "2"])


@pytest.mark.parametrize(
    "cells", [("0 min", "1h75"), ("0 min", "1 h 75 min"), ("0 min", "2'75''"), ("0 min 5 s", "1h5")]
)
def test_a_part_after_a_larger_one_counts_to_59_and_has_two_digits(tmp_path, cells):
    with pytest.raises(InputError, match=rf"line 3, column 3 \(Time\): found \"?'?{cells[1]}"):
        times_of(tmp_path, "Time", ["1 h 0 min", *cells[1:], "3 h 0 min"])


@pytest.mark.parametrize("clock", ["{}h{:02}", "{} h {} min", "{}:{:02}"])
def test_times_of_day_pass_midnight_however_they_are_written(tmp_path, clock):
    moments = [(22, 30), (23, 30), (0, 30), (1, 30)]
    path = tmp_path / "raw.csv"
    rows = [f"{1 + i // 2};{1 + i // 2};{clock.format(*moment)};{9 - i}\n" for i, moment in enumerate(moments)]
    path.write_text("Hold;Displacement [mm];Heure [hh:mm];Force [N]\n" + "".join(rows))
    made = convert(path, ABOUT, Choices(time_since="test"))
    assert [row[2] for row in made.rows] == [0.0, 3600.0, 7200.0, 0.0, 3600.0]  # the first hold lasts until the second
    assert "the clock passes midnight 1 time" in made.notes


@pytest.mark.parametrize(
    ("moments", "refused"),
    [
        (("12:15", "12:30", "6:30", "6:45"), True),  # half a round
        (("12:15", "12:30", "6:31", "6:45"), False),
        (("12:15", "12:59", "1:00", "1:15"), True),
        (("12:15", "12:59", "0:59", "1:15"), False),  # an hour that no clock with hands writes
        (("12:15", "13:00", "1:00", "1:15"), False),  # the other one
        (("12:15", "12:16", "0:59", "1:15"), False),
        (("1:00", "5:00", "12:00", "1:00"), False),  # durations that begin anew
    ],
)
@pytest.mark.parametrize("seconds", ["", ":00"])
def test_a_clock_that_may_go_round_twice_a_day_is_refused(tmp_path, moments, refused, seconds):
    path = tmp_path / "raw.csv"
    rows = [f"{1 + i // 2};{1 + i // 2};{moment}{seconds};{9 - i}\n" for i, moment in enumerate(moments)]
    path.write_text("Hold;x [mm];Time [hh:mm];Force [N]\n" + "".join(rows))
    if refused:
        with pytest.raises(InputError, match="and no hour above 12, expected AM or PM behind the times, hours to 24"):
            convert(path, ABOUT, Choices(time_since="test"))
    else:
        try:
            convert(path, ABOUT, Choices(time_since="test"))
        except InputError as error:
            assert "no hour above 12" not in str(error)


def test_durations_that_begin_anew_at_zero_pass_no_midnight(tmp_path):
    assert times_of(tmp_path, "Time", ["0 h 0 min", "14 h 0 min"]) == [0.0, 50400.0]
    path = bench_file(tmp_path, "Time", ["0 h 0 min", "14 h 0 min"])
    second = [row for row in convert(path, ABOUT, Choices()).rows if row[0] == 2]
    assert [row[2] for row in second] == [0.0, 50400.0]


@pytest.mark.parametrize("header", ["Time (in minutes)", "Time (IN MINUTES)", "Time (durations in minutes)"])
def test_a_unit_in_brackets_may_begin_with_in(tmp_path, header):
    assert times_of(tmp_path, header, ["0", "5"]) == [0.0, 300.0]


@pytest.mark.parametrize(
    ("header", "cells"),
    [("Time [hh,mm]", ["0,00", "0,30", "1,00"]), ("Date;Time [s]", ["14,06;0", "14,06;30", "14,06;60"])],
)
def test_clocks_and_columns_that_are_not_read_do_not_decide_the_decimal_sign(tmp_path, header, cells):
    path = tmp_path / "raw.csv"
    path.write_text(f"Displacement [mm];{header};Force [N]\n" + "".join(f"2;{cell};1.234\n" for cell in cells))
    with pytest.raises(Undecided, match="found '1.234', which is 1.234 or 1234, expected --decimal point"):
        convert(path, ABOUT, Choices())
    assert convert(path, ABOUT, Choices(decimal="point")).rows[0][3] == 1.234


@pytest.mark.parametrize(
    ("header", "clock", "beside", "read"),
    [
        ("Time [hh:mm]", ("8:00", "8:01", "8:05"), ("50", "110", "348"), "seconds"),  # 8:00:50
        (
            "Time",
            ("14.06.2026 8:00:50", "14.06.2026 8:01:50", "14.06.2026 8:05:48"),
            ("0.2", "60.4", "297.9"),
            "seconds",
        ),
        ("Time", ("8:00:50.25", "8:01:50.50", "8:05:48.00"), ("0", "60", "298"), "Time"),
    ],
)
def test_of_a_clock_and_a_stopwatch_the_finer_is_read(tmp_path, header, clock, beside, read):
    path = tmp_path / "raw.csv"
    rows = [f"{time};{seconds};2;{5 - i}.25\n" for i, (time, seconds) in enumerate(zip(clock, beside, strict=True))]
    path.write_text(f"{header};seconds (s);Displacement [mm];Force [N]\n" + "".join(rows))
    notes = convert(path, ABOUT, Choices()).notes
    assert f"time from '{read}" in notes[0]


def test_a_clock_that_runs_a_minute_apart_from_a_stopwatch_is_asked_about(tmp_path):
    path = tmp_path / "raw.csv"
    path.write_text("Time [hh:mm];seconds (s);x [mm];Force [N]\n8:00;0;2;5.1\n8:01;60;2;5.0\n8:05;362;2;4.9\n")
    with pytest.raises(Undecided, match="which tell different times from line 4 on"):
        convert(path, ABOUT, Choices())


def test_durations_of_hours_may_begin_anew_where_the_user_says_what_they_count_from(tmp_path):
    cells = ["1:00:00", "1:04:00", "8:04:00"]
    with pytest.raises(InputError, match="1:00:00' after '8:04:00', .* or --time-since hold, if they are durations"):
        times_of(tmp_path, "Time", cells)
    assert times_of(tmp_path, "Time", cells, time_since="hold") == [3600.0, 3840.0, 29040.0]
    dated = [f"2026-06-14 {cell:0>8}" for cell in cells]
    with pytest.raises(InputError, match="found moments of a day"):
        times_of(tmp_path, "Time", dated, time_since="hold")


@pytest.mark.parametrize(
    "cells",
    [
        ["0 days 00:00:00", "0 days 00:30:00.500000", "2 days 01:00:00"],
        ["0:00:00", "0:30:00.500000", "2 days, 1:00:00"],
        ["0d 00:00:00", "0d 00:30:00,5", "2d 01:00:00"],
        ["0 d 0 h", "30 min 0.5 s", "2 d 1 h"],
        ["0 Tage 0 h", "30 min 0,5 s", "2 Tage 1 h"],
    ],
)
def test_durations_may_have_days(cells, tmp_path):
    rows = [f"{x};{cell};{x * 2.5 - i / 7:.2f}" for x in (1, 2) for i, cell in enumerate(cells)]
    path = tmp_path / "raw.csv"
    path.write_text("\n".join(["x (mm);Elapsed;F (N)", *rows]))
    assert [row[2] for row in convert(path, ABOUT, Choices()).rows] == [0.0, 1800.5, 176400.0] * 2


def test_hours_after_days_count_to_23():
    assert spelt_s("1 d 23 h") == 169200.0 and spelt_s("1 d 24 h") is None and spelt_s("1 day, 1:60:00") is None


def on_the_wall(folder, moments):
    rows = [f"{moment},{1 + i // 5},{2 + i // 5 - i / 100}" for i, moment in enumerate(moments)]
    path = folder / "raw.csv"
    path.write_text("Time,Displacement (mm),Force (N)\n" + "\n".join(rows) + "\n")
    return convert(path, ABOUT, Choices())


MINUTES_APART = ["{}:56:00", "{}:56:30", "{}:57:00", "{}:57:30", "{}:58:00", "{}:59:00", "{}:59:30"]
MINUTES_AFTER = ["{}:00:00", "{}:00:30", "{}:01:00"]


@pytest.mark.parametrize("date", ["", "2024-10-27 "])
@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("01", "03", "put forward by an hour at line 9"),
        ("02", "02", "put back by an hour at line 9"),
        ("01", "02", None),
        ("09", "11", None),  # an hour's rest of the day
    ],
)
def test_a_clock_that_is_put_forward_or_back_counts_on(tmp_path, date, before, after, said):
    moments = [date + m.format(before) for m in MINUTES_APART] + [date + m.format(after) for m in MINUTES_AFTER]
    found = on_the_wall(tmp_path, moments)
    assert any(said in note for note in found.notes) if said else not any("by an hour" in n for n in found.notes)
    first, second = found.experiment.holds
    assert (first.duration_s, second.duration_s) == (180.0, 3720.0 if before == "09" else 120.0)


@pytest.mark.parametrize(
    "moments",
    [
        ("00:10:00", "00:40:00", "01:40:00", "03:20:00", "05:00:00"),  # an hour just passes
        ("01:58:00", "01:59:00", "03:20:00", "03:21:00", "03:22:00"),  # more than an hour, by a rest
        ("01:57:00", "01:59:00", "02:59:30", "03:00:00", "03:00:30"),  # not the hour that clocks leave out
    ],
)
def test_an_hour_of_the_night_in_which_nothing_was_read_is_left_as_it_is(tmp_path, moments):
    found = on_the_wall(tmp_path, moments)
    assert not any("by an hour" in note for note in found.notes)


def test_an_offset_from_utc_leaves_no_doubt_of_an_hour(tmp_path):
    moments = [f"2024-03-31T{clock}+01:00" for clock in ("01:58:00", "01:58:30", "01:59:30", "03:00:00", "03:00:30")]
    (hold,) = on_the_wall(tmp_path, moments).experiment.holds
    assert hold.duration_s == 3750.0


@pytest.mark.parametrize("form", ["{h:02d}.{m:02d}.{s:02d}", "{h:02d}:{m:02d}:{s:02d}:250"])
def test_clocks_with_points_and_with_thousandths_behind_a_colon(tmp_path, form):
    times = (0, 40, 80)
    lines = []
    for hold in (1, 2, 3):
        for time in times:
            of_day = 35400 + 300 * hold + time  # from 9.55.00
            lines.append(
                f"{form.format(h=of_day // 3600, m=of_day // 60 % 60, s=of_day % 60)};{hold};{5 * hold - time / 100}"
            )
    path = tmp_path / "raw.csv"
    path.write_text("\n".join(["Zeit;Weg [mm];Kraft [N]", *lines]))
    made = convert(path, About("wire", "line", 1000.0), Choices())
    assert [hold.start_s for hold in made.experiment.holds] == [0.0, 300.0, 600.0]
    assert [row[2] for row in made.rows if row[3] is not None] == [*times] * 3


def test_a_date_stands_beside_a_clock_with_points(tmp_path):
    lines = [f"1{d}.06.2026;{h}.30.00;{x};{f}" for d, h, x, f in [(4, 22, 1, 5.0), (4, 23, 1, 4.9), (5, 1, 2, 9.0)]]
    path = tmp_path / "raw.csv"
    path.write_text("\n".join(["Datum;Uhrzeit;Weg [mm];Kraft [N]", *lines, "15.06.2026;2.30.00;2;8.9"]))
    made = convert(path, About("wire", "line", 1000.0), Choices())
    assert [hold.start_s for hold in made.experiment.holds] == [0.0, 10800.0]
