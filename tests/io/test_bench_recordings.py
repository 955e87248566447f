"""Continuous recordings: holds are found whatever the noise, the speed of the moves and the rate."""

from typing import NamedTuple

import numpy as np
import pytest

import wirebayes as wb
from analyses.field.recordings import Drive, imported
from analyses.field.recordings import record as recorded
from tests.io.bench_files import convert
from wirebayes.io.bench.about import About
from wirebayes.io.bench.continuous import _slow
from wirebayes.io.bench.plateaus import plateaus
from wirebayes.io.bench.thinning import KEPT, MOST, kept_readings
from wirebayes.io.bench.undecided import Choices
from wirebayes.wire.staircase import simulate


class Pull(NamedTuple):
    """A recording: rates in Hz, mm, s."""

    rate: float = 10.0
    holds: int = 10
    step: float = 1.0
    lasts: float = 60.0
    speed: float = 1.0
    noise: float = 0.01
    unload: int = 0
    quantum: float = 0.0
    settle: float = 0.0


def record(pull, rng):
    """Displacements, times, and (first, end, level) of each hold."""
    up = list(np.arange(1, pull.holds + 1) * pull.step)
    levels = up + up[-2 : -2 - pull.unload : -1] if pull.unload else up
    x, truth, here = [0.0], [], 0.0
    for level in levels:
        rows = max(1, round(abs(level - here) / pull.speed * pull.rate))
        x += list(np.linspace(here, level, rows + 1)[1:])
        begin, n = len(x) - 1, round(pull.lasts * pull.rate)
        x += list(level + pull.settle * np.exp(-np.arange(n) / pull.rate / 5.0))
        truth.append((begin, len(x), level))
        here = level
    measured = np.array(x) + rng.normal(0.0, pull.noise, len(x))
    if pull.quantum:
        measured = np.round(measured / pull.quantum) * pull.quantum
    return measured, np.arange(len(x)) / pull.rate, truth


@pytest.mark.parametrize(
    "pull",
    [
        Pull(),
        Pull(noise=0.0, quantum=0.001),
        Pull(noise=0.006, quantum=0.01),
        Pull(noise=0.1),
        Pull(speed=0.1, noise=0.02),
        Pull(speed=1e6),
        Pull(unload=8),
        Pull(rate=100.0, lasts=30.0),
        Pull(rate=1.0),
        Pull(rate=1.0, lasts=20.0, speed=0.2, noise=0.02),
        Pull(holds=50, step=0.2, lasts=20.0),
        Pull(noise=0.0005, settle=-0.04),
        Pull(holds=4, step=0.05, noise=0.01),
    ],
    ids=str,
)
def test_holds_are_found_where_they_are(pull):
    for seed in range(3):
        x, time, truth = record(pull, np.random.default_rng(seed))
        found = plateaus(x, time, pull.quantum)
        assert len(found) == len(truth)
        for hold, (begin, end, level) in zip(found, truth, strict=True):
            passed = max(2.0 / pull.rate, 9.0 * pull.noise / pull.speed)  # a move hides in the noise so long
            assert abs(hold.begin - begin) / pull.rate <= passed
            assert -6.0 / pull.rate <= (hold.end - end) / pull.rate <= passed
            assert hold.level == pytest.approx(level, abs=max(0.3 * pull.noise, 0.01 * pull.step, pull.quantum))


def test_a_pull_without_holds_has_none():
    rng = np.random.default_rng(0)
    x = np.linspace(0.0, 10.0, 3000) + rng.normal(0.0, 0.01, 3000)
    found = plateaus(x, np.arange(3000) / 10.0, 0.0)
    assert sum(hold.end - hold.begin for hold in found) < 1500


def test_a_recording_becomes_holds_of_thinned_readings(tmp_path):
    rng = np.random.default_rng(1)
    x, time, truth = record(Pull(unload=4), rng)
    tension = np.round(2.0 * x + rng.normal(0.0, 0.01, len(x)), 3)
    rows = [f"{t + 100:.1f}\t{a:.4f}\t{f:.3f}\n" for t, a, f in zip(time, x, tension, strict=True)]
    path = tmp_path / "raw.txt"
    path.write_text("Time (s)\tExtension (mm)\tLoad (N)\n" + "".join(rows))
    made = convert(path, About("wire", "line", 1000.0), Choices())
    holds = made.experiment.holds
    assert [hold.displacement_mm for hold in holds] == pytest.approx([level for *_, level in truth], abs=0.005)
    assert all(
        1.3 < hold.time_s[0] < 1.9 and 59.5 < hold.time_s[-1] < hold.duration_s <= 61.1 for hold in holds
    )  # moves take 1 s
    assert all(15 < hold.time_s.size <= KEPT for hold in holds)
    readings = [row for row in made.rows if row[3] is not None]
    assert any(f"{len(readings)} of" in note for note in made.notes)
    # a hold lasts until the next one begins, in the middle of the move between them
    starts = made.recording.start_s
    assert [hold.duration_s for hold in holds[:-1]] == pytest.approx(np.diff(starts))
    assert made.experiment.resolution_N == 0.001
    assert made.recording is not None
    assert made.recording.start_s == pytest.approx([begin / 10.0 - 0.5 for begin, *_ in truth], abs=0.1)
    recorded = {f for _, f in zip(time, tension, strict=True)}
    assert all(value in recorded for row in readings for value in row[3:])  # readings are kept, not averaged


@pytest.mark.parametrize("pause", [None, (180.0, 190.0), (170.0, 200.0)])
def test_a_pause_of_the_recording_over_a_move_is_said(pause, tmp_path):
    rng = np.random.default_rng(2)
    x, time, _ = record(Pull(holds=5), rng)  # from hold 3 to hold 4 at 182 s
    in_hold = (time > 80.0) & (time < 100.0)  # a pause that hides no move matters to no hold
    left = ~in_hold if pause is None else ~in_hold & ((time < pause[0]) | (time > pause[1]))
    tension = 2.0 * x + rng.normal(0.0, 0.01, len(x))
    rows = [f"{t:.1f}\t{a:.4f}\t{f:.3f}\n" for t, a, f in zip(time[left], x[left], tension[left], strict=True)]
    path = tmp_path / "raw.txt"
    path.write_text("Time (s)\tExtension (mm)\tLoad (N)\n" + "".join(rows))
    made = convert(path, About("wire", "line", 1000.0), Choices())
    assert len(made.experiment.holds) == 5
    said = [notice.text for notice in made.warnings if "pauses" in notice.text]
    if pause is None:
        assert not said
    else:
        assert [notice.kind for notice in made.warnings] == ["hold-ends"]
        assert said[0].startswith(f"the recording pauses before hold 4, for up to {pause[1] - pause[0]:.0f}")


WIRE = {"k1": 1200.0, "B": 0.5, "U": 0.8, "k2": 0.03, "N": 0.7, "preload": 0.4, "sensor_sd": 0.0, "setting_sd": 0.0}


@pytest.mark.parametrize(
    "drive",
    [
        Drive(),
        pytest.param(Drive(speed=0.1), marks=pytest.mark.slow),
        Drive(shape="settling"),
        pytest.param(Drive(rate=1.0), marks=pytest.mark.slow),
        Drive(rate=1.0, shape="jump"),
        Drive(rate=1.0, shape="jump", noise_mm=0.0, before=1.0),
    ],
    ids=str,
)
def test_a_wire_that_creeps_while_it_moves_is_the_models_that_jumps(drive, tmp_path):
    """Time zero in the middle of the move leaves of 0.02 to 0.06 N, from its end, what no bench resolves."""
    levels = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.3, 8.0, 6.0, 4.0]
    made = imported(tmp_path, recorded(WIRE, 1300.0, levels, drive, np.random.default_rng(1)), 1300.0)
    protocol = made.experiment.protocol()
    expected = simulate(protocol, {name: np.array([value]) for name, value in WIRE.items()})[..., 0]
    left = [hold.tension_N - e[m] for hold, e, m in zip(made.experiment.holds, expected, protocol.mask, strict=True)]
    assert len(left) == len(levels)
    assert np.abs(np.concatenate(left)).max() < (0.005 if drive.speed > 0.1 else 0.02)


@pytest.mark.parametrize(("move_s", "warned"), [(6.0, False), (60.0, True)])
def test_moves_that_are_slow_beside_their_holds_are_said_to_be_no_part_of_the_model(move_s, warned, tmp_path):
    drive = Drive(speed=1.0 / move_s, noise_mm=0.0)
    made = recorded(WIRE, 1300.0, [1.0, 2.0, 3.0, 4.0, 5.0], drive, np.random.default_rng(1))
    path = tmp_path / "raw.csv"
    rows = (f"{t:.3f},{x:.4f},{f:.4f}\n" for t, x, f in zip(*made, strict=True))
    path.write_text("Time (s),Displacement (mm),Force (N)\n" + "".join(rows))
    said = wb.import_bench(path, length_mm=1300.0, output=tmp_path / "out").summary()["warnings"]
    assert [notice["kind"] for notice in said] == ["left-out"] * warned
    if warned:
        assert said[0]["text"].startswith("raw: moves took 57.9 s, 48 % of their holds (medians): what the wire does")


@pytest.mark.parametrize(("moves_s", "warned"), [([9.9, 9.9, 90.0], False), ([1.0, 10.1, 10.1], True)])
def test_moves_are_slow_from_a_tenth_of_their_holds_on(moves_s, warned):
    """At a tenth parameters are as right as their intervals; at a fifth the creep rate is up to 4 deviations off."""
    assert bool(_slow(np.array(moves_s), np.full(3, 100.0))) == warned


def test_a_hold_that_is_reached_between_two_readings_begins_between_them(tmp_path):
    path = tmp_path / "raw.csv"

    def starts(pause):
        rows = []
        for j in range(4):
            rows += [f"{j * (39.0 + pause) + i:.1f},{j + 1},{j + 2.0 - 0.01 * i:.2f}\n" for i in range(40)]
        path.write_text("Time (s),Displacement (mm),Force (N)\n" + "".join(rows))
        return [
            float(hold.time_s[0]) for hold in convert(path, About("wire", "line", 1000.0), Choices()).experiment.holds
        ]

    assert starts(1.0) == [0.0, 0.5, 0.5, 0.5]
    assert starts(8.0) == [0.0, 0.0, 0.0, 0.0]  # the recording paused, and began again when the wire was there


def stamped(path, rate, tick, *, clock=False, channel="", columns="Time (s),Displacement (mm),Force (N)"):
    """A recording whose times are cut down to whole ticks; tensions agree with those before them now and then."""
    x, time, _ = record(Pull(rate=rate, holds=4, noise=0.0), np.random.default_rng(2))
    tension = 2.0 * x - 0.02 * np.log1p(time % 61.0)
    stamps = np.floor((time + 0.37) / tick + 1e-9) * tick
    rows = []
    for i, (t, a, f) in enumerate(zip(stamps, x, tension, strict=True)):
        stamp = f"10:{int(t) // 60:02d}:{int(t) % 60:02d}" if clock else f"{t:.2f}"
        rows.append(f"{stamp},{a:.3f},{f:.2f}{channel.format(i % round(rate * tick))}\n")
    path.write_text(columns + "\n" + "".join(rows))
    return x, time, tension


@pytest.mark.parametrize(
    ("rate", "tick", "clock"),
    [(10.0, 1.0, False), (10.0, 1.0, True), (3.3, 1.0, False), pytest.param(100.0, 0.1, False, marks=pytest.mark.slow)],
)
def test_readings_of_a_clock_too_coarse_for_its_rate_are_spread_over_its_ticks(tmp_path, rate, tick, clock):
    path = tmp_path / "raw.csv"
    header = "Uhrzeit,Displacement (mm),Force (N)" if clock else "Time (s),Displacement (mm),Force (N)"
    _, time, _ = stamped(path, rate, tick, clock=clock, columns=header)
    made = convert(path, About("wire", "line", 1000.0), Choices())
    assert any(f"of {tick:g} s, is that of {rate * tick:.2g} readings" in note for note in made.notes)
    assert made.recording is not None
    assert made.recording.time_s == pytest.approx(time, abs=1.01 * tick)  # no row is lost
    assert np.diff(made.recording.time_s).min() > 0.0
    middle = np.diff(made.recording.time_s)[len(time) // 4 : -len(time) // 4]
    assert middle == pytest.approx(1.0 / rate, abs=0.4 / rate)
    assert len(made.experiment.holds) == 4


def test_coarse_stamps_that_begin_again_with_each_hold_are_spread_too(tmp_path):
    path = tmp_path / "raw.csv"
    rows = [f"{i // 10},{h},{2 * h - i // 7 / 100:.2f}\n" for h in (1, 2, 3) for i in range(50)]
    path.write_text("Time (s),Displacement (mm),Force (N)\n" + "".join(rows))
    made = convert(path, About("wire", "line", 1000.0), Choices())
    for hold in made.experiment.holds:
        assert hold.time_s == pytest.approx(np.arange(50) / 10.0)


def test_stamps_that_repeat_for_another_reason_are_refused(tmp_path):
    path = tmp_path / "raw.csv"

    def refused(match):
        with pytest.raises(wb.InputError, match=f"raw.csv, line .*{match}"):
            convert(path, About("wire", "line", 1000.0), Choices())

    header = "Time (s),Displacement (mm),Force (N)"
    stamped(path, 2.0, 1.0, channel=",wire {}", columns=f"{header},Channel")  # two wires in turn
    refused("times that rise")
    stamped(path, 10.0, 1000.0)
    refused("times that rise")
    rows = [f"{30 * (i // 2)},{1 + i // 12},{2 + i // 12 - i / 100:.2f}\n" for i in range(48)]  # no tick of a clock
    path.write_text(header + "\n" + "".join(rows))
    refused("times that rise")
    rows = [f"{i + (i % 20 == 7)},{1 + i // 12},{2 + i // 12 - i / 100:.2f}\n" for i in range(48)]  # now and then
    path.write_text(header + "\n" + "".join(rows))
    refused("times that rise")


def test_rows_that_are_written_twice_are_left_out_as_before(tmp_path):
    path = tmp_path / "raw.csv"
    rows = [f"{i},{1 + i // 12},{2 + i // 12 - i / 100:.2f}\n" * 2 for i in range(48)]
    path.write_text("Time (s),Displacement (mm),Force (N)\n" + "".join(rows))
    made = convert(path, About("wire", "line", 1000.0), Choices())
    assert sum(row[3] is not None for row in made.rows) == 48
    assert "rows that repeat the row above left out: 48" in made.notes


def two_holds(path, counts, move_s, number=True):
    """Two displacements held for so many readings at 10 Hz, and the move between them, which has no number."""
    rows = round(10 * move_s)
    x = [0.5] * counts[0] + list(np.linspace(0.5, 3.0, rows + 2)[1:-1]) + [3.0] * counts[1]
    of_move = range(counts[0], counts[0] + rows)
    lines = ["Number,Time (s),Displacement (mm),Force (N)"]
    for i, level in enumerate(x):
        if number and i in of_move:
            continue
        lines.append(f"{1 + (i >= counts[0])},{i / 10:.1f},{level:.4f},{2.0 * level - 1e-5 * i:.5f}")
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize(
    ("counts", "found"),
    [
        ((100, 3900), "line 1[56][0-9], column 3 .*, from here on; the 1[56][0-9] readings before"),
        ((3900, 100), "line 39[0-9][0-9], column 3 .*, up to here; the 1[56][0-9] readings after"),
    ],
)
def test_a_hold_that_is_hardly_longer_than_the_move_beside_the_only_other_one_is_refused(tmp_path, counts, found):
    raw = two_holds(tmp_path / "raw.csv", counts, move_s=6.0, number=False)
    with pytest.raises(wb.InputError, match=rf"{found} were taken"):
        convert(raw, About("wire", "line", 1000.0), Choices())
    raw = two_holds(tmp_path / "raw.csv", counts, move_s=6.0)
    made = convert(raw, About("wire", "line", 1000.0), Choices(mapping=("Number=hold",)))  # as the message advises
    assert [hold.displacement_mm for hold in made.experiment.holds] == [0.5, 3.0]


@pytest.mark.parametrize("counts", [(100, 3900), (3900, 100)])
@pytest.mark.parametrize("move_s", [0.0, 2.0])
def test_a_hold_that_is_long_beside_its_move_is_one_however_long_the_other_is(tmp_path, counts, move_s):
    raw = two_holds(tmp_path / "raw.csv", counts, move_s, number=False)
    made = convert(raw, About("wire", "line", 1000.0), Choices())
    assert [hold.displacement_mm for hold in made.experiment.holds] == [0.5, 3.0]


@pytest.mark.parametrize("noise_mm", [0.0, 0.002])
@pytest.mark.parametrize("move_s", [0, 3])
def test_holds_of_seconds_stand_beside_holds_of_hours(tmp_path, noise_mm, move_s):
    """A recording at 1 Hz; stops of a move that is made bit by bit are none of its holds."""
    rng = np.random.default_rng(4)
    x, held = [], [20, 3600, 60, 30, 7200, 120]
    for level, lasts in enumerate(held, start=1):
        x += [level - 1.0 + part / (move_s + 1) for part in range(1, move_s + 1)] if x else []
        x += [float(level)] * lasts
    for level in (6.3, 6.6, 7.0):  # 4 s at each of two stops
        x += [*np.linspace(x[-1], level, 5)[1:], *[level] * (4 if level < 7.0 else 600)]
    measured = np.array(x) + rng.normal(0.0, noise_mm, len(x))
    rows = [f"{i},{level:.4f},{2.0 * level - 1e-6 * i:.5f}\n" for i, level in enumerate(measured)]
    raw = tmp_path / "raw.csv"
    raw.write_text("Time (s),Displacement (mm),Force (N)\n" + "".join(rows))
    holds = convert(raw, About("wire", "line", 1000.0), Choices()).experiment.holds
    assert [hold.displacement_mm for hold in holds] == pytest.approx([1, 2, 3, 4, 5, 6, 7], abs=0.002)
    assert [hold.duration_s for hold in holds[:-2]] == pytest.approx(held[:-1], abs=move_s + 1.0)


@pytest.mark.parametrize("count", [1, 2, MOST, MOST + 1, 100, 5000])
def test_thinned_readings_are_early_and_few(count):
    kept = kept_readings(np.arange(count) * 0.1)
    assert kept[0] == 0
    assert kept[-1] == count - 1
    assert (np.diff(kept) > 0).all()
    assert len(kept) == count if count <= MOST else len(kept) <= KEPT


@pytest.mark.parametrize(("pause_s", "recorded_move"), [(30.0, False), (0.0, True)])
def test_a_move_in_a_pause_of_the_recording_has_no_duration(pause_s, recorded_move, tmp_path):
    """Measured displacements, read at doubling times: between two holds is no more than the pause before a reading."""
    noise = np.random.default_rng(1)
    times = np.array([0.0, 1.0, 2.0, 4.0, 8.0, 15.0, 30.0, 60.0]) if pause_s > 1.0 else np.arange(0.0, 60.0, 0.1)
    path = tmp_path / "raw.csv"
    rows = [
        f"{hold * (60.0 + pause_s) + t:.2f},{hold + noise.normal(0.0, 0.0005):.5f},{5 * hold - t / 200:.4f}\n"
        for hold in range(1, 5)
        for t in times
    ]
    path.write_text("Time (s),Displacement (mm),Force (N)\n" + "".join(rows))
    imported = wb.import_bench(path, length_mm=1300.0, output=tmp_path / "out").summary()
    notes = " ".join(imported["experiments"]["raw"]["notes"])
    assert imported["warnings"] == []
    assert ("each hold begins at its first reading, for no move to one was recorded" in notes) != recorded_move
    assert ("fit with --effect late_clock" in notes) != recorded_move
    assert ("moves took 0.1 s (median)" in notes) == recorded_move


AT_THE_FOOT = [[5.0, 0.0, 5.0, 0.0], [12.0, 0.0, 12.0, 0.0], [12.0, 0.0], [40.0, 0.0, 40.0, 0.0]]


@pytest.mark.parametrize(
    ("turns", "named"),
    [([], False), *((turns, True) for turns in AT_THE_FOOT), ([4.5], False), ([4.5, 3.8, 4.1], False), ([7.0], True)],
)
def test_cycles_before_a_hold_are_no_part_of_the_move_to_it(tmp_path, turns, named):
    """At 1 mm/s, to 4 mm and later to 8 mm; an overshoot of an eighth is one of the move."""
    places = [0.0, *turns, 4.0]
    legs = [np.linspace(a, b, int(2 * abs(b - a)) + 1)[1:] for a, b in zip(places, places[1:], strict=False)]
    way = np.concatenate(legs)
    x = np.concatenate([[0.0], way, np.full(400, 4.0), np.linspace(4.0, 8.0, 9)[1:], np.full(400, 8.0)])
    time = 0.5 * np.arange(len(x))
    path = tmp_path / "raw.csv"
    path.write_text(
        "t (s),x (mm),F (N)\n" + "\n".join(f"{t},{place},{5 * place + 1}" for t, place in zip(time, x, strict=True))
    )
    made = convert(path, About("wire", "line", 1000.0), Choices())
    first = made.experiment.recorded_holds[0]
    middle = 0.5 * len(way) - 2.0 if turns in ([], *AT_THE_FOOT) else None
    assert made.recording is not None
    if middle is not None:
        assert made.recording.start_s[int(named)] == pytest.approx(middle, abs=0.3)
    assert first.setting == 4.0
    assert any("went to and fro between" in note for note in made.notes) == named
    assert len(made.unrecorded) == named


@pytest.mark.parametrize(("low", "pulls_as_at"), [(0.0, 2.0), (-4.0, 1.0)])
@pytest.mark.parametrize("before_hold", [1, 2])
def test_cycles_are_a_hold_without_readings_where_the_wire_pulls_as_in_their_mean(
    tmp_path, low, pulls_as_at, before_hold
):
    """Ten times from 0 or -4 to 4 mm, as fast as the moves: where it is slack the wire pulls with nothing, not less."""
    way = np.linspace(low, 4.0, 41)
    cycles = np.tile(np.concatenate([way, way[-2:0:-1]]), 10)
    low_again = [low]
    held = [np.full(900, 2.0), np.full(900, 3.0)]
    pieces = [np.full(10, low), np.linspace(low, 2.0, 21)[1:-1], held[0], np.linspace(2.0, 3.0, 11)[1:-1], held[1]]
    if before_hold == 1:
        pieces[1:1] = [cycles, low_again]
    else:
        pieces[3:4] = [np.linspace(2.0, low, 21)[1:-1], cycles, low_again, np.linspace(low, 3.0, 31)[1:-1]]
    x = np.concatenate(pieces)
    rows = [f"{0.5 * i},{place:.4f},{max(5.0 * place, 0.0):.4f}" for i, place in enumerate(x)]
    path = tmp_path / "raw.csv"
    path.write_text("t (s),x (mm),F (N)\n" + "\n".join(rows))
    made = convert(path, About("wire", "line", 1000.0), Choices())
    (stated,) = made.unrecorded
    assert stated["before_hold"] == before_hold
    assert stated["displacement_mm"] == pytest.approx(pulls_as_at, abs=0.1)
    assert stated["duration_s"] == pytest.approx(0.5 * len(cycles), abs=25.0)
    durations = [hold.duration_s for hold in made.experiment.holds]
    assert sum(durations) == pytest.approx(0.5 * len(x), abs=60.0)
    assert [hold.recorded for hold in made.experiment.holds].index(False) == before_hold - 1
    imported = wb.import_bench(path, length_mm=1000.0, name="wire", output=tmp_path / "out")
    written = wb.read_experiments(tmp_path / "out" / "wire.toml")[0]
    assert [h.setting for h in written.holds] == [h.setting for h in imported.experiments[0].holds]
    assert [h.duration_s for h in written.holds] == pytest.approx(durations)


def test_cycles_under_which_the_wire_creeps_count_from_where_it_first_pulled(tmp_path):
    """The mean of what is read falls as it creeps; a hold of the same creep begins where the wire first pulled so."""
    way = np.linspace(0.0, 4.0, 41)
    cycles = np.tile(np.concatenate([way, way[-2:0:-1]]), 10)
    x = np.concatenate([np.zeros(10), cycles, np.linspace(0.0, 2.0, 21), np.full(900, 2.0), np.full(900, 3.0)])
    crept = np.minimum(np.maximum(np.arange(len(x)) - 10, 0) / len(cycles), 1.0) * 0.4
    rows = [
        f"{0.5 * i},{place:.4f},{5.0 * (place - e) + 10.0:.4f}"
        for i, (place, e) in enumerate(zip(x, crept, strict=True))
    ]
    path = tmp_path / "raw.csv"
    path.write_text("t (s),x (mm),F (N)\n" + "\n".join(rows))
    (stated,) = convert(path, About("wire", "line", 1000.0), Choices()).unrecorded
    assert stated["displacement_mm"] == pytest.approx(1.8, abs=0.03)
