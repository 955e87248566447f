"""What hobby electronics write: logs of a serial monitor, and clocks that count milliseconds."""

import pytest

from tests.io.bench_files import convert
from wirebayes.errors import InputError
from wirebayes.io.bench.about import About
from wirebayes.io.bench.undecided import Choices

ABOUT = About("wire", "line", 1000.0)
SENT = ("2.00,500.0", "2.00,490.0", "2.00,485.0", "3.00,800.0", "3.00,790.0", "3.00,785.0")
ARRIVED = ("23:59:00.500", "23:59:10.500", "23:59:30.500", "0:01:00.500", "0:01:10.500", "0:01:30.500")


def log(tmp_path, header, sent=SENT, before="tare done, offset kept"):
    path = tmp_path / "raw.log"
    stamps = ("23:58:00.000", "23:58:01.000", *ARRIVED)
    path.write_text("".join(f"{a} -> {line}\n" for a, line in zip(stamps, (before, header, *sent), strict=True)))
    return path


@pytest.mark.parametrize(
    "before", ["tare done", "tare done, offset kept", "Waiting time 5", "tare done, time out 5", ""]
)
def test_times_of_arrival_are_the_clock_where_nothing_else_is(tmp_path, before):
    made = convert(log(tmp_path, "pos_mm,load_g", before=before), ABOUT, Choices())
    assert "time from 'Time of arrival'" in made.notes[0]
    assert "the clock passes midnight 1 time" in made.notes
    assert [row[2] for row in made.rows] == [0.0, 10.0, 30.0, 120.0, 0.0, 10.0, 30.0]
    assert made.rows[0][3] == pytest.approx(0.5 * 9.80665)


def test_a_message_between_readings_is_no_header(tmp_path):
    sent = (*SENT[:3], "new position, tare kept", *SENT[4:])
    made = convert(log(tmp_path, "pos_mm,load_g", sent), ABOUT, Choices())
    assert "line 6 (new position) left out: words or statistics in place of readings" in made.notes


def test_a_device_s_own_clock_stands_before_times_of_arrival(tmp_path):
    sent = [f"{line},{1000 * (4 + 10 * i)}" for i, line in enumerate(SENT)]
    made = convert(log(tmp_path, "pos_mm,load_g,millis", sent), ABOUT, Choices(time_since="test"))
    assert "time from 'millis'" in made.notes[0]
    assert "times of arrival not read" in made.notes[0]
    assert [row[2] for row in made.rows if row[3] is not None] == [0.0, 10.0, 20.0] * 2


def test_a_reading_that_is_missing_is_missed_in_its_own_column(tmp_path):
    path = log(tmp_path, "pos_mm,load_g")
    lines = path.read_text().splitlines()
    lines[4] = lines[4].rpartition(",")[0]
    path.write_text("\n".join(lines))
    with pytest.raises(InputError, match=r"line 5, column 2 \(load_g\): found an empty cell"):
        convert(path, ABOUT, Choices())


def test_a_stamp_that_is_missing_makes_it_no_such_log(tmp_path):
    path = log(tmp_path, "pos_mm,load_g")
    path.write_text(path.read_text() + "2.00,480.0\n")
    with pytest.raises(InputError):
        convert(path, ABOUT, Choices())


@pytest.mark.parametrize(
    ("header", "cells", "seconds"),
    [
        ("millis", ("0", "1500", "3000"), [0.0, 1.5, 3.0]),
        ("micros", ("0", "1500", "3000"), [0.0, 0.0015, 0.003]),
        ("Time [d]", ("46187.25", "46187.50", "46188.25"), [0.0, 21600.0, 86400.0]),
        (
            "時刻",
            ("2026年6月14日 9時58分0秒", "2026年6月14日 9時58分5秒", "2026年6月15日 9時58分0秒"),
            [0.0, 5.0, 86400.0],
        ),
        ("时间", ("9时58分0秒", "9时58分5秒", "10时0分0秒"), [0.0, 5.0, 120.0]),
    ],
)
def test_clocks_of_loggers_and_spreadsheets(tmp_path, header, cells, seconds):
    path = tmp_path / "raw.csv"
    rows = [f"{cell};2;{5.05 - i / 10}\n" for i, cell in enumerate(cells)]
    path.write_text(f"{header};x (mm);Force (N)\n" + "".join(rows))
    made = convert(path, ABOUT, Choices(time_since=None if header in ("時刻", "时间") else "test"))
    assert [row[2] for row in made.rows] == pytest.approx(seconds)
