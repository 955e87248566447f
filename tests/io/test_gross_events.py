"""Gross events are named at any scale with the readings to leave out, and hardly ever on sound tests."""

from dataclasses import replace

import numpy as np
import pytest

import wirebayes as wb
from tests.simulated import SOFTER
from wirebayes.io import data_checks, gross_events, paper
from wirebayes.io.experiment_file import read_experiments
from wirebayes.simulation.synthetic import Bench, Truth, draw


def broken(tension):
    out = tension.copy()
    out[11, 2:] = (0.02, 0.0, 0.01)
    return out


def dropped(tension):
    out = tension.copy()
    out[6, 1:3] = 0.0
    return out


def zeroed(tension):
    out = tension.copy()
    away = out[5, 3]
    out[5, 3:] -= away
    out[6:] -= away
    return out


def limited(tension):
    return np.minimum(tension, np.round(0.6 * tension.max(), 2))


def floored(tension):
    return np.maximum(tension, np.round(0.4 * tension.max(), 2))


EVENTS = [
    (broken, "break", "hold 12 from 60 s on and stays there", 3),
    (dropped, "dropout", "hold 7 from 30 s on for 2 readings", 2),
    (zeroed, "tared", "hold 6 from 90 s on and rises", 32),
    (limited, "saturation", "to 12 all read", None),
    (floored, "clipped", "holds 1 to", None),
]


@pytest.mark.parametrize(("spoilt", "kind", "words", "count"), EVENTS)
@pytest.mark.parametrize("scale", [(1.0, 1.0), (1e-6, 0.01), (3e5, 1e3)])
def test_each_event_is_named_at_any_scale(sound, spoilt, kind, words, count, scale):
    protocol, tension = sound
    tension, resolution = spoilt(tension) * scale[0], 0.01 * scale[0]
    scaled = replace(protocol, length_mm=protocol.length_mm * scale[1], setting=protocol.setting * scale[1])
    (event,) = gross_events.of_readings(scaled, tension, resolution)
    assert event.kind == kind
    assert words in event.text
    assert count is None or len(event.readings) == count
    assert [(n.kind, n.text) for n in data_checks.warnings(scaled, tension, resolution)][0] == (kind, event.text)


@pytest.mark.parametrize(("share", "named"), [(0.02, True), (0.05, False)])
def test_a_fall_counts_where_next_to_nothing_is_left(sound, share, named):
    protocol, tension = sound
    tension = tension.copy()
    tension[11, 2:] = share * tension[11, 1]
    assert bool(gross_events.of_readings(protocol, tension, 0.01)) == named


HUNG = SOFTER | {"sensor_sd": 0.003, "setting_sd": 0.002}
TWICE = (2.0, 4.0, 6.0, 8.0, 6.0, 4.0)


def hung(seed=0, weights=TWICE):
    """Protocol and (H, R) displacements of a test under weights."""
    made = draw([Bench(weights_N=weights, resolution_mm=0.001)], Truth(HUNG), seed)
    return made.problem.samples[0].protocol, made.problem.samples[0].readings[..., 0]


@pytest.mark.parametrize(
    ("jump", "hold", "found"),
    [(15.0, 4, True), (-15.0, 4, True), (1.0, 4, False), (15.0, 6, True), (-15.0, 6, False)],
)
@pytest.mark.parametrize("scale", [1.0, 1e-3, 1e3])
def test_a_line_that_breaks_under_weights_is_named(jump, hold, found, scale):
    """In hold 6 the weight is less than before: the line may give back what it likes."""
    protocol, read = hung()
    read = read.copy()
    read[hold - 1, 3:] += jump
    read[hold:] = read[hold - 1, -1] if found else read[hold:] + jump  # the gauge stays where the line left it
    events = gross_events.of_readings(protocol, scale * read, scale * 0.001)
    assert [event.kind for event in events] == ["break"] * found
    if found:
        assert len(events[0].readings) == 2 + 5 * (len(read) - hold)
        assert f"in hold {hold} from 90 s on and stays there" in events[0].text


def test_a_jump_counts_where_it_exceeds_all_elongation_before():
    protocol, read = hung(weights=(2.0, 4.0, 6.0))
    before = float(np.ptp(read.ravel()[:13]))
    for share, found in ((0.95, False), (1.05, True)):
        jumped = read.copy()
        jumped[2, 3:] = read[2, 2] + share * before
        assert bool(gross_events.of_readings(protocol, jumped, 0.001)) == found


def test_sound_tests_under_weights_have_no_break():
    steep = (0.5, 1.0, 4.0, 16.0, 2.0, 20.0)
    assert not any(gross_events.of_readings(*hung(seed, w), 0.001) for seed in range(20) for w in (TWICE, steep))


def test_a_wire_that_goes_slack_on_unloading_is_no_break(sound):
    protocol, tension = sound
    protocol = replace(protocol, setting=np.concatenate([protocol.setting[:11], [1.0]]))
    tension = tension.copy()
    tension[11] = 0.0
    assert gross_events.of_readings(protocol, tension, 0.01) == []


def test_the_papers_wires_have_none():
    assert [gross_events.gross_events_of(e) for e in paper.experiments()] == [[], [], [], []]


def test_events_that_are_dropped_leave_a_sound_test(tmp_path, sound):
    protocol, tension = sound
    lines = ["hold,displacement_mm,time_s,tension_N"]
    for j, row in enumerate(limited(dropped(tension))):
        lines += [f"{j + 1},{protocol.setting[j]},{t},{f:.2f}" for t, f in zip(protocol.time_s[j], row, strict=True)]
    (tmp_path / "a.csv").write_text("\n".join(lines) + "\n")
    (tmp_path / "a.toml").write_text(
        '[[experiment]]\nname = "a"\nmaterial = "m"\nlength_mm = 1000.0\nresolution_N = 0.01\nreadings = "a.csv"\n'
    )
    (experiment,) = read_experiments(tmp_path / "a.toml")
    kept = gross_events.without_gross_events(experiment, gross_events.gross_events_of(experiment))
    assert gross_events.gross_events_of(kept) == []
    assert kept.holds[6].duration_s == 120.0
    assert kept.holds[6].time_s.size == 3
    # import writes the same test
    rows = [line.split(",", 1)[1] for line in lines]
    (tmp_path / "raw.csv").write_text("x [mm],t [s],F [N]\n" + "\n".join(rows[1:]) + "\n")
    made = wb.import_bench(tmp_path / "raw.csv", length_mm=1000, drop_breaks=True, output=tmp_path / "out")
    (again,) = made.experiments
    assert [h.readings.tolist() for h in again.recorded_holds] == [h.readings.tolist() for h in kept.recorded_holds]
    assert any(
        note.startswith("left out: tension falls to 0 in hold 7")
        for note in made.summary()["experiments"]["raw"]["notes"]
    )
