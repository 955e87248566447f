"""Warnings of readings that a bench hardly gives: said at their thresholds, silent on sound tests."""

from dataclasses import replace

import numpy as np
import pytest

from analyses.hidden_effects.noise import measure
from analyses.hidden_effects.truth import PROTOCOLS, draw_rig
from wirebayes.io import data_checks, isolated_readings, paper
from wirebayes.io.arrays import from_arrays
from wirebayes.simulation.synthetic import Bench, draw
from wirebayes.wire.protocol import Protocol


def warning(protocol, tension, resolution=0.01):
    return " | ".join(notice.text for notice in data_checks.warnings(protocol, tension, resolution))


def test_a_sound_test_gets_no_warning(sound):
    assert warning(*sound) == ""
    assert [notice for e in paper.experiments() for notice in data_checks.of_experiment(e)] == []


def test_times_of_the_whole_test_are_suspected_where_they_are_not_certain():
    protocol = Protocol(
        1000.0,
        np.array([1.0, 2.0]),
        np.arange(10.0).reshape(2, 5),
        np.ones((2, 5), bool),
        np.array([4.0, 9.0]),
        np.array([1, 2]),
    )
    tension = np.array([[1.0] * 5, [2.0] * 5])
    assert "time_s counts from the beginning of each hold" in warning(protocol, tension)
    since = replace(protocol, time_s=protocol.time_s % 5, duration_s=np.array([4.0, 4.0]))
    assert warning(since, tension) == ""


def test_tensions_below_zero_by_more_than_an_offset(sound):
    protocol, tension = sound
    for depth, warned in ((0.04, False), (0.06, True)):
        slack = tension.copy()
        slack[0] = -depth * tension.max()
        assert ("hold 1, while a wire only pulls" in warning(protocol, slack)) == warned


@pytest.mark.parametrize(
    ("slack", "where"), [([], None), ([0], "hold 1 "), ([0, 1, 2], "holds 1, 2 and 3 "), (range(12), None)]
)
def test_holds_of_a_slack_wire_are_named(sound, slack, where):
    protocol, tension = sound
    tension = tension.copy()
    tension[slack] = 0.0
    found = [notice.text for notice in data_checks.warnings(protocol, tension, 0.01) if notice.kind == "slack"]
    assert len(found) == (where is not None)
    assert all(where in text for text in found)


def test_a_wire_that_goes_slack_in_every_hold_is_named(sound):
    """Of 14 such tests whose creep was 8 to 40 times the stretch, four were off by 9 to 59 standard deviations in U."""
    protocol, tension = sound
    tension = tension.copy()
    tension[:, 1:] = 0.0
    found = [notice.text for notice in data_checks.warnings(protocol, tension, 0.01) if notice.kind == "slack"]
    assert len(found) == 1 and "holds 1, 2, 3" in found[0]


@pytest.mark.parametrize("share", [0.015, 0.025])
def test_a_wire_of_two_hundredths_of_the_largest_tension_may_be_slack(sound, share):
    protocol, tension = sound
    tension = tension.copy()
    tension[0] = share * tension[:, 0].max()
    found = data_checks.warnings(protocol, tension, 0.0)
    assert any(notice.kind == "slack" for notice in found) == (share < 0.02)


def test_under_weights_no_wire_is_slack(sound):
    protocol, tension = sound
    weights = replace(protocol, control="force")
    elongation = tension - tension[0, 0]  # the zero of the gauge is arbitrary
    assert not any(notice.kind == "slack" for notice in data_checks.warnings(weights, elongation, 0.01))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t, rng: np.round(5.0 + 0.006 * rng.normal(size=t.shape), 2), "tension stays at 5 N while"),
        (lambda t, rng: np.round(0.006 * rng.normal(size=t.shape), 2), "no reading stands out from the scatter"),
        (lambda t, rng: t[::-1], "tension falls as the displacement rises"),
        (lambda t, rng: t[:, ::-1], "tension rises within 12 of 12 holds on loading"),
        (lambda t, rng: np.where(np.arange(5) % 2, 4.3 * t, t), "rows of other tests are mixed in"),
        (lambda t, rng: t / 9.80665, "readings change by less than resolution_N"),
        (lambda t, rng: np.round(t / 1000.0, 6), "readings change by less than resolution_N"),
    ],
)
def test_absurd_tensions_are_named(sound, change, words):
    protocol, tension = sound
    assert words in warning(protocol, change(tension, np.random.default_rng(0)))


def test_one_gross_outlier_is_named_with_its_place(sound):
    protocol, tension = sound
    for share, warned in ((0.9, False), (1.3, True)):  # of the range of all others
        gross = tension.copy()
        gross[5, 2] += share * isolated_readings.GROSS * np.ptp(tension)
        assert ("in hold 6 at 60 s is" in warning(protocol, gross)) == warned
    last = tension.copy()
    last[11, 4] *= 10
    assert "in hold 12 at 120 s is" in warning(protocol, last)


@pytest.mark.parametrize(
    ("steps", "levels", "warned"),
    [
        (3, 16.0, True),  # tightened between two readings
        (3, 9.0, False),  # by less than ten noise levels
        (3, -16.0, True),  # with the hold's course, but five times as fast as it goes before and after
        (3, -10.5, True),
        (1, 16.0, False),  # after its first reading, when creep may be over
        (5, 16.0, False),  # its last reading, which may be a misprint
    ],
)
def test_a_jump_against_the_course_of_a_hold_is_named_with_its_place(steps, levels, warned):
    times = np.tile(np.arange(6.0) * 20.0, (3, 1))
    protocol = Protocol(
        1000.0,
        np.array([2.0, 4.0, 6.0]),
        times,
        np.ones((3, 6), bool),
        np.full(3, 100.0),
        np.array([1, 2, 5]),
    )
    course = -3e-4 * times + 0.002 * np.resize([1.0, -1.0, 1.0, 1.0, -1.0], times.shape)
    tension = np.array([[2.0], [5.0], [8.0]]) + course
    noise = data_checks.CheckedTest(protocol, tension, 0.0).noise
    tension[1, steps:] += levels * noise
    text = warning(protocol, tension, 0.0)
    assert (
        "and 60 s of hold 2, out of the hold's course, and stays there: if the wire was tightened" in text
    ) == warned


def test_a_jump_back_is_no_jump():
    """One reading far from its neighbours is another warning's affair."""
    times = np.arange(7.0)[None]
    protocol = Protocol(1000.0, np.array([2.0]), times, np.ones((1, 7), bool), np.full(1, 6.0), np.array([1]))
    tension = np.array([[5.0, 4.9, 4.85, 5.85, 4.82, 4.81, 4.8]])
    assert "out of the hold's course" not in warning(protocol, tension, 0.0)
    tension[0, 4:] += 1.0
    assert "jumps from 4.85 to 5.85 N between 2 and 3 s of hold 1" in warning(protocol, tension, 0.0)
    assert "if the gauge or the hook was touched" in warning(replace(protocol, control="force"), tension, 0.0)


@pytest.mark.parametrize(("strain", "warned"), [(4e-5, True), (6e-5, False), (0.4, False), (0.6, True)])
def test_displacements_beside_the_length(sound, strain, warned):
    protocol, tension = sound
    length = np.ptp(protocol.setting) / strain
    assert (
        "displacement_mm and length_mm are both in mm" in warning(replace(protocol, length_mm=length), tension)
    ) == warned


def test_threads_and_ropes_get_no_warning(sound):
    """Ten grams and fifty tonnes, in N and mm, with sensors to match."""
    protocol, tension = sound
    for scale in (0.1 / tension.max(), 5e5 / tension.max()):
        assert warning(protocol, scale * tension, scale * 0.01) == ""


@pytest.mark.parametrize("different", [data_checks.COPIED_HOLD - 1, data_checks.COPIED_HOLD])
def test_a_copied_hold_is_told_by_few_different_readings(sound, different):
    protocol, tension = sound
    copied = tension.copy()
    copied[6] = copied[6, 0]
    copied[6, :different] += 0.01 * np.arange(different)
    copied[7] = copied[6]
    said = "holds 7 and 8 have the same 5 readings at two displacements" in warning(protocol, copied)
    assert said == (different == data_checks.COPIED_HOLD)


def test_the_same_place_throughout(sound):
    protocol, tension = sound
    still = replace(protocol, setting=np.ones_like(protocol.setting))
    assert "all holds have the same displacement_mm" in warning(still, tension)


def test_clean_simulated_tests_get_no_warning():
    """199 tests: wires from the prior and from the benchmark, with unloading, slack, odd times, few readings."""
    benches = [
        Bench(),
        Bench(displacements_mm=(1, 2, 3, 4, 5, 6, 5, 4, 3, 2)),
        Bench(length_mm=2500.0, displacements_mm=(0.5, 1.5, 2.0, 4.0, 6.0), times_s=(0.0, 1.0, 5.0, 20.0, 600.0)),
        Bench(displacements_mm=(1, 2, 3), times_s=(0.0, 30.0), resolution_N=0.0),
    ]
    tests = []
    for seed in range(25):
        for bench in benches:
            sample = draw([bench], seed=seed).problem.samples[0]
            tests.append((sample.protocol, sample.readings[..., 0], bench.resolution_N))
    for index, name in enumerate(PROTOCOLS):
        rng = np.random.default_rng(index)
        for _ in range(9):
            rig = draw_rig(rng, name)
            readings = measure(rig, None, rng, "gross")
            for bench, part in zip(rig.benches, rig.bench_slices, strict=True):
                tests.append((*_padded(bench, readings[part]), bench.resolution_N or 0.0))
    assert len(tests) == 199
    found = [notice for test in tests for notice in data_checks.warnings(*test) if notice.kind != "slack"]
    assert found == []


def _padded(bench, readings):
    width = max(len(hold.times_s) for hold in bench.holds)
    times, mask = np.zeros((len(bench.holds), width)), np.zeros((len(bench.holds), width), bool)
    for j, hold in enumerate(bench.holds):
        times[j, : len(hold.times_s)], mask[j, : len(hold.times_s)] = hold.times_s, True
    tension = np.zeros(mask.shape)
    tension[mask] = readings
    moved, lasted = bench.displacements_mm, np.array([hold.duration_s for hold in bench.holds])
    return Protocol(bench.length_mm, moved, times, mask, lasted, np.array([h.number for h in bench.holds])), tension


def test_one_hold_leaves_k1_and_preload_open_unless_one_is_stated():
    options = {"length_mm": 1000.0, "name": "one", "material": "line"}
    one = from_arrays([1] * 4, [2.0] * 4, [0.0, 1.0, 5.0, 20.0], [2.0, 1.9, 1.8, 1.75], **options)
    assert [(n.kind, n.text) for n in data_checks.of_experiment(one)] == [("prior", data_checks.ONE_HOLD)]
    known = replace(one, priors={"preload": {"fixed": 0.0}})
    assert data_checks.of_experiment(known) == []


@pytest.mark.parametrize(("second", "said"), [(2.0, True), (1.981, True), (1.979, False)])
@pytest.mark.parametrize(
    ("control", "which"), [("displacement", "holds at one displacement do"), ("force", "holds of one weight do")]
)
def test_holds_of_one_setting_leave_them_open_too(control, which, second, said):
    settings, read = [2.0] * 3 + [second] * 3, [1.5, 1.55, 1.57, 1.58, 1.59, 1.595]
    columns = (settings, read) if control == "displacement" else (read, settings)
    options = {"length_mm": 1000.0, "name": "two", "material": "line", "control": control}
    two = from_arrays([1] * 3 + [2] * 3, columns[0], [0.0, 10.0, 20.0] * 2, columns[1], **options)
    texts = [notice.text for notice in data_checks.one_setting(two.protocol(), set())]
    assert [text.startswith(f"{which} not tell k1 and the preload apart") for text in texts] == [True] * said


@pytest.mark.parametrize(("weights", "said"), [((2, 4, 6, 8), True), ((2, 4, 6), False), ((8, 6, 4, 2), False)])
def test_displacements_that_fall_under_growing_weights_are_named(weights, said):
    """As those of a step test do whose columns of tension and displacement are interchanged."""
    times = np.array([0.0, 10.0, 30.0, 60.0])
    falling = [2.5 * w - 0.05 * np.log1p(times) for w in weights]
    for readings, named in ((falling, said), ([5.0 * w - row for w, row in zip(weights, falling, strict=True)], False)):
        hold, weight = (np.repeat(v, len(times)) for v in (np.arange(len(weights)), np.array(weights)))
        columns = hold, np.concatenate(readings), np.tile(times, len(weights)), weight
        test = from_arrays(*columns, length_mm=1000.0, name="w", material="m", control="force")
        assert any("under ever larger weights" in n.text for n in data_checks.of_experiment(test)) == named
