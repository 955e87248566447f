"""Logs that people's programs write: a stamp before each line, names before values, moves in lines of their own."""

import pytest

from tests.io.bench_files import convert
from wirebayes.io.bench.about import About
from wirebayes.io.bench.undecided import Choices, Undecided

ABOUT = About("wire", "line", 1000.0)
TIMES = (0, 30, 60)
HOLDS = (1, 2, 3)


def clock(hold, time):
    of_day = 36000 + 200 * hold + time
    return f"{of_day // 3600:02d}:{of_day // 60 % 60:02d}:{of_day % 60:02d}"


def tension(hold, time):
    return 5 * hold - time / 100


def read(tmp_path, lines, **choices):
    path = tmp_path / "rig.log"
    path.write_text("\n".join(lines) + "\n")
    return convert(path, ABOUT, Choices(**choices))


def assert_is_the_test(made):
    assert [hold.setting for hold in made.experiment.holds] == [1.0, 2.0, 3.0]
    assert [hold.start_s for hold in made.experiment.holds] == [0.0, 200.0, 400.0]
    readings = [value for hold in made.experiment.holds for value in hold.readings]
    assert readings == pytest.approx([tension(hold, time) for hold in HOLDS for time in TIMES])


@pytest.mark.parametrize(
    "form",
    [
        "2026-11-12 {clock},125 INFO pos={x:.2f} mm force={f:.3f} N",
        "2026-11-12T{clock}Z x_mm: {x:.2f}, F_N: {f:.3f}",
        "[{clock}] [INFO] pos: {x:.2f} mm | force: {f:.3f} N",
        "{clock} - pos = {x:.2f} mm; force = {f:.3f} N",
    ],
)
def test_a_stamp_before_pairs_is_the_time(tmp_path, form):
    lines = [form.format(clock=clock(h, t), x=h, f=tension(h, t)) for h in HOLDS for t in TIMES]
    assert_is_the_test(read(tmp_path, lines))


def test_seconds_in_brackets_before_pairs_ask_for_their_unit(tmp_path):
    lines = [f"[{200 * h + t}.000] x: {h:.2f} mm, F: {tension(h, t):.3f} N" for h in HOLDS for t in TIMES]
    with pytest.raises(Undecided, match=r'expected --map "timestamp=time \[s\]"'):
        read(tmp_path, lines)
    assert_is_the_test(read(tmp_path, lines, mapping=("timestamp=time [s]",)))


def test_moves_stand_in_lines_of_their_own(tmp_path):
    lines = []
    for hold in HOLDS:
        lines.append(f">> stage moved to {hold:.1f} mm")
        lines += [f"2026-11-12 {clock(hold, time)} force: {tension(hold, time):.3f} N" for time in TIMES]
    assert_is_the_test(read(tmp_path, lines))
    by = [line.replace("moved to", "moved by") for line in lines]
    with pytest.raises(Undecided, match="found no column of displacement"):
        read(tmp_path, by)


def test_a_letter_without_a_unit_is_offered_for_what_is_missing(tmp_path):
    lines = [f'{{"t": {200 * h + t}, "x_mm": {h}, "force_n": {tension(h, t):.3f}}}' for h in HOLDS for t in TIMES]
    with pytest.raises(Undecided, match=r'say which with --map "t=time \[s\]"'):
        read(tmp_path, lines)
    assert_is_the_test(read(tmp_path, lines, mapping=("t=time [s]",)))


def test_units_in_the_header_of_each_time_are_those_of_what_was_read(tmp_path):
    header = "Stretch mm," + ",".join(f"{time} s [N]" for time in TIMES)
    lines = [f"{h}," + ",".join(f"{tension(h, t):.3f}" for t in TIMES) for h in HOLDS]
    made = read(tmp_path, [header, *lines])
    assert [hold.setting for hold in made.experiment.holds] == [1.0, 2.0, 3.0]
    assert [row[3] for row in made.rows[:3]] == pytest.approx([tension(1, time) for time in TIMES])
