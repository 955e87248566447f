"""Each threshold by which an import decides, asks or refuses, on both of its sides."""

import re

import numpy as np
import pytest

from tests.io.bench_files import convert, convert_all
from wirebayes.errors import InputError
from wirebayes.io.bench import control, holds
from wirebayes.io.bench.about import About
from wirebayes.io.bench.resolution import evident_step
from wirebayes.io.bench.undecided import Choices, Undecided

ABOUT = About("wire", "line", 1000.0)


def file_of(tmp_path, header, rows):
    path = tmp_path / "raw.csv"
    path.write_text(header + "\n" + "".join(",".join(str(cell) for cell in row) + "\n" for row in rows))
    return path


@pytest.mark.parametrize(
    ("numbers", "step"),
    [
        ([f"{i / 10 + 0.01:.2f}" for i in range(9)], None),  # ten different readings
        ([f"{i / 10 + 0.01:.2f}" for i in range(10)], 0.01),
        ([f"{0.02 * i:.2f}" for i in range(1, 20)], 0.01),  # 2^-19, that of all readings none is odd by chance
        ([f"{0.02 * i:.2f}" for i in range(1, 21)], 0.02),
        ([f"{0.5 * i:.1f}" for i in range(1, 12)], 0.5),  # 5^-11
        ([f"{i / 2:.2f}" for i in range(1, 12)], 0.5),
        ([f"{10 * i}" for i in range(1, 12)], 10.0),
        ([f"{i / 64:.3f}" for i in range(1, 20)], 1 / 64),  # a ruler in inches
        ([f"{i / 16:.3f}" for i in range(1, 20)], 1 / 16),  # .0625 may be .062 or .063
        ([f"{i / 64:.2f}" for i in range(1, 36)], 0.01),  # 0.68^35
        ([f"{i / 64:.2f}" for i in range(1, 37)], 1 / 64),
        ([f"{i / 64 + 0.001 * (i == 7):.3f}" for i in range(1, 20)], 0.001),  # one of them lies on no such line
        ([f"{i / 10}2345671" for i in range(11, 23)], 1e-8),  # nine digits
        ([f"{i / 10}23456711" for i in range(11, 23)], None),
        ([f"{i / 10:.1f}" for i in range(11, 22)], 0.1),  # a tenth of the range
        ([f"{i / 10:.1f}" for i in range(11, 21)], None),
    ],
)
def test_a_step_is_evident_from_enough_readings_with_few_digits_and_fine_enough(numbers, step):
    assert evident_step(numbers) == step


@pytest.mark.parametrize(
    ("after_s", "times_s", "said"),
    [
        (49.0, [0.0, 20.0, 40.0, 60.0, 80.0, 100.0], False),  # half of the time that was read
        (51.0, [0.0, 20.0, 40.0, 60.0, 80.0, 100.0], True),
        (89.0, [0.0, 40.0, 100.0], False),  # one and a half times the longest pause
        (91.0, [0.0, 40.0, 100.0], True),
        (300.0, [0.0, 5.0, 10.0, 20.0, 40.0, 80.0, 150.0, 300.0], True),  # a rest as long as the hold
    ],
)
def test_a_hold_goes_on_unread_beyond_half_of_what_was_read_and_one_and_a_half_of_its_pauses(after_s, times_s, said):
    times = [np.array(times_s), np.array([0.0, 20.0])]
    assert bool(holds._unread_ends(times, [times_s[-1] + after_s, None], "displacement")) == said


@pytest.mark.parametrize(("first", "asked"), [(29, False), (31, True)])
def test_an_only_hold_begins_within_three_of_its_readings_or_its_clock_is_asked_about(first, asked, tmp_path):
    path = file_of(tmp_path, "x [mm],Time [s],Force [N]", [(2, first + 10 * i, 5 - i / 10) for i in range(5)])
    if asked:
        with pytest.raises(Undecided, match="found 31 s at the first reading of the only hold, expected --time-since"):
            convert(path, ABOUT, Choices())
        assert [convert(path, ABOUT, Choices(time_since=s)).rows[0][2] for s in ("hold", "test")] == [31.0, 0.0]
    else:
        assert convert(path, ABOUT, Choices()).rows[0][2] == 29.0


@pytest.mark.parametrize(("falling", "refused"), [(10, False), (11, True)])
def test_rows_stand_the_other_way_round_where_most_times_fall(falling, refused, tmp_path):
    """Of twenty steps in time within one hold."""
    times = np.cumsum([0, *([3] * (20 - falling)), *([-1] * falling)])
    rows = [(1, 1.0, t, 5.0) for t in times + 90]
    expected = "turn them round" if refused else "a time amid those above"
    with pytest.raises(InputError, match=expected):
        convert(file_of(tmp_path, "Hold,x [mm],Time [s],Force [N]", rows), ABOUT, Choices())


def test_a_gauge_that_reads_weights_may_stand_anywhere(tmp_path):
    """What it shows of the wire without tension is estimated."""
    rows = [(load, time, 500 + load + time / 900) for load in (5, 10, 15) for time in (0, 30, 60, 120)]
    made = convert(file_of(tmp_path, "Load [kg],Time [s],Dial [mm]", rows), ABOUT, Choices())
    assert made.experiment.control == "force" and made.experiment.holds[0].readings[0] == 505.0


@pytest.mark.parametrize(
    ("first", "spread", "asked"),
    [(99.0, 1.0, False), (101.0, 1.0, True), (190.0, 94.0, True), (190.0, 96.0, False)],
)
def test_a_position_is_a_machine_s_beyond_a_tenth_of_the_length_and_twice_the_test(first, spread, asked, tmp_path):
    rows = [(first + spread * hold / 3, time, 5 + hold - time / 100) for hold in range(4) for time in (0, 30, 60)]
    path = file_of(tmp_path, "x [mm],Time [s],Force [N]", rows)
    if asked:
        with pytest.raises(Undecided, match="--zero-mm"):
            convert(path, ABOUT, Choices(time_since="hold"))
    else:
        assert convert(path, ABOUT, Choices(time_since="hold")).experiment.holds[0].setting == first


def replace_times(path):
    """The same file with times that run on."""
    head, *rows = path.read_text().splitlines()
    cells = [row.split(",") for row in rows]
    path.write_text("\n".join([head, *(",".join([a, b, str(30 * i), d]) for i, (a, b, _, d) in enumerate(cells))]))
    return path


@pytest.mark.parametrize(
    ("second", "several"),
    [
        ([1.0, 2.0, 3.0, 4.0, 5.0], True),
        ([1.95, 3.0, 4.0, 5.0], True),  # begins a quarter of the range from where the first began
        ([2.05, 3.0, 4.0, 5.0], False),
        ([1.0, 2.0, 3.1], True),  # and goes over half of it
        ([1.0, 2.0, 2.9], False),
    ],
)
def test_a_column_names_specimens_where_the_same_test_begins_again(second, several, tmp_path):
    each = [("A", x) for x in (1.0, 2.0, 3.0, 4.0, 5.0)] + [("B", x) for x in second]
    rows = [(name, x, time, x - time / 100) for name, x in each for time in (0, 30, 60)]
    path = file_of(tmp_path, "Sample,x [mm],Time [s],Force [N]", rows)
    if several:
        assert len(convert_all(path, ABOUT, Choices())) == 2
    else:
        with pytest.raises(
            Undecided, match="found 'B' after 'A' where times begin again, expected --specimens several"
        ):
            convert_all(path, ABOUT, Choices())
        assert [len(convert_all(path, ABOUT, Choices(specimens=s))) for s in ("several", "one")] == [2, 1]
        running = replace_times(path)
        assert "not read: 'Sample'" in " ".join(convert(running, ABOUT, Choices(time_since="test")).notes)


@pytest.mark.parametrize(
    ("chances", "drifts", "decided"),
    [
        ((0.95e-3, 1.0), (0.5, 0.1), "force"),  # the displacement has a trend
        ((1.05e-3, 1.0), (0.5, 0.1), "displacement"),
        ((0.0, 0.0), (0.301, 0.1), "force"),  # three times as much drift decides
        ((0.0, 0.0), (0.299, 0.1), "asked"),
        ((0.0, 0.0), (0.1, 0.301), "displacement"),
        ((0.0, 0.0), (0.1, 0.299), "asked"),
        ((0.0, 1.05e-3), (0.1, 0.1), "displacement"),  # the tension has none
        ((0.0, 0.95e-3), (0.1, 0.1), "asked"),
        ((0.0, 0.0), (0.0199, 0.02), "displacement"),  # neither drifts as anything creeps
        ((0.0, 0.0), (0.0201, 0.02), "asked"),
    ],
)
def test_what_was_set_is_decided_by_trends_and_by_how_much_drifts(chances, drifts, decided, monkeypatch):
    x, tension = np.array([1.0, 1.1, 1.2]), np.array([5.0, 4.9, 5.1])
    for name, (of_displacement, of_tension) in (("trend_by_chance", chances), ("drift", drifts)):
        each = {id(x): of_displacement, id(tension): of_tension}
        monkeypatch.setattr(control, name, lambda rows, values, each=each: each[id(values)])
    try:
        found = control.recognised([np.arange(3)], x, tension, False, "raw.csv, line 1")
    except Undecided as question:
        assert re.search("both drift within holds", str(question))
        found = "asked"
    assert found == decided


@pytest.mark.parametrize(("chance", "decided"), [(0.0099, "force"), (0.0101, "displacement")])
def test_one_tension_to_the_last_digit_was_set_where_the_displacement_creeps(chance, decided, monkeypatch):
    monkeypatch.setattr(control, "trend_by_chance", lambda rows, values: chance)
    x = np.array([1.0, 1.1, 1.2])
    assert control.recognised([np.arange(3)], x, np.full(3, 5.0), False, "raw.csv, line 1") == decided
