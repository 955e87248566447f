"""The staircase against plain Python, its limits, and what a cut, a slack wire or a missing reading may change."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from tests.wire.protocols import PLAIN, by_hand, columns, parameters, protocol, protocols
from wirebayes.effects import effect_named
from wirebayes.wire import laws
from wirebayes.wire.model import Model
from wirebayes.wire.staircase import linearise, simulate

TIMES = [0.0, 30.0, 60.0, 90.0, 120.0]
CUT = {1.0: 0.0273, 0.7: 0.0849, 0.4: 0.2161}  # by time exponent N; the documentation's figures


def readings(p, theta, model=None, setting=None):
    return simulate(p, columns(**theta), model or Model(), setting)[..., 0]


@given(protocols(), parameters(), st.sampled_from(["hooke", "modified"]), st.sampled_from(["saturating", "additive"]))
def test_any_staircase_is_the_paper_s_equations_hold_after_hold(p, theta, law, history):
    expected = by_hand(p, theta, law=law, history=history)
    model = Model(law, history)
    line = linearise(p, columns(**theta), model)
    # where a hold begins just slack, rounding decides, of which a small power of the tension makes much
    assume((np.abs(theta["preload"] + p.setting - line.creep[:-1, 0]) > 1e-3).all())
    for found in (readings(p, theta, model), line.reading[..., 0]):
        for row, mask, wanted in zip(found, p.mask, expected, strict=True):
            assert row[mask] == pytest.approx(wanted, rel=1e-9, abs=1e-9 * theta["k1"])


@given(protocols(), st.lists(parameters(), min_size=2, max_size=4))
def test_a_batch_is_its_rows(p, rows):
    batch = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    together = simulate(p, batch)
    for i, row in enumerate(rows):
        assert together[..., i] == pytest.approx(readings(p, row), rel=1e-12, abs=1e-9)


@given(parameters())
def test_tension_only_falls_within_a_hold_of_a_loading_test(theta):
    p = protocol([2.0, 4.0, 6.0], [TIMES] * 3)
    tension = readings(p, theta | {"preload": abs(theta["preload"])})
    # a hold may recover only if the one before crept past what this one asks for
    assume(all(tension[j + 1, 0] >= tension[j, 0] for j in range(2)))
    assert (np.diff(tension, axis=1) <= 1e-9).all()


def test_unloading_gives_creep_back():
    p = protocol([8.0, 2.0], [[0.0, 600.0], TIMES])
    tension = readings(p, PLAIN)
    assert (np.diff(tension[1]) > 0).all()
    assert (np.diff(readings(p, PLAIN, Model(history="additive"))[1]) < 0).all()


@given(parameters())
def test_at_time_zero_a_fresh_wire_is_hooke_s(theta):
    theta = theta | {"preload": 0.5}
    p = protocol([3.0], [[0.0, 1e-12]])
    tension = readings(p, theta)[0]
    assert tension[0] == pytest.approx(theta["k1"] * 3.5 / 1000.0, rel=1e-12)


@given(parameters())
def test_after_a_very_long_time_the_creep_is_eq_4(theta):
    theta = theta | {"preload": 0.5}
    p = protocol([3.0], [[0.0, 1e30]])
    first, last = readings(p, theta)[0]
    zero = 1000.0 + theta["B"] * first ** theta["U"]
    assert last == pytest.approx(max(theta["k1"] * (1003.5 / zero - 1.0), 0.0), rel=1e-9, abs=1e-9)


def test_with_n_equal_one_the_elongation_is_an_exponential():
    p = protocol([3.0], [[0.0, 10.0, 70.0]])
    theta = PLAIN | {"N": 1.0}
    tension = readings(p, theta)[0]
    elongation = 1000.0 * 1.0034 / (tension / theta["k1"] + 1.0) - 1000.0
    goal = theta["B"] * tension[0] ** theta["U"]
    assert elongation == pytest.approx(goal * (1.0 - np.exp(-theta["k2"] * np.array([0.0, 10.0, 70.0]))), abs=1e-9)


@given(parameters(), st.sampled_from(["hooke", "modified"]))
def test_without_creep_every_reading_of_a_hold_is_the_same(theta, law):
    p = protocol([1.0, 5.0, 2.0], [TIMES] * 3)
    tension = readings(p, theta | {"B": 1e-300}, Model(law))
    assert np.ptp(tension, axis=1) == pytest.approx(0.0, abs=1e-9)


@given(st.floats(1e-6, 1e-3))
def test_laws_1_and_3_agree_at_small_strain(strain):
    """1 - 1/(1+s) = s - s² + ..., so they differ by one strain, and by less than that."""
    lengths = np.array(1.0 + strain), np.array(1.0)
    hooke, modified = (law.strain(*lengths) for law in laws.LAWS.values())
    assert 0.99 * strain <= (hooke - modified) / hooke <= strain
    by_s, by_l = laws.LAWS["modified"].by_stretched(*lengths), laws.LAWS["modified"].by_zero(*lengths)
    assert by_s == pytest.approx(-by_l, rel=2 * strain)


@pytest.mark.parametrize("law", laws.LAWS.values(), ids=laws.LAWS)
def test_slopes_inverses_and_energy_belong_to_the_strain(law):
    stretched, zero, step = 1.3, 1.1, 1e-6
    strain = law.strain(stretched, zero)
    by_stretched = (law.strain(stretched + step, zero) - law.strain(stretched - step, zero)) / (2 * step)
    by_zero = (law.strain(stretched, zero + step) - law.strain(stretched, zero - step)) / (2 * step)
    work = (law.energy(stretched + step, zero) - law.energy(stretched - step, zero)) / (2 * step)
    assert law.by_stretched(stretched, zero) == pytest.approx(by_stretched, rel=1e-8)
    assert law.by_zero(stretched, zero) == pytest.approx(by_zero, rel=1e-8)
    assert work == pytest.approx(strain, rel=1e-8) and law.energy(zero, zero) == 0.0
    assert law.stretched(np.array(strain), zero) == pytest.approx(stretched)
    assert law.zero_length(stretched, strain) == pytest.approx(zero)


def cut(p, at):
    """Hold 1 cut in two at one of its reading times: the later part starts a clock of its own."""
    before, after = p.time_s[1][: at + 1], p.time_s[1][at:] - p.time_s[1][at]
    times = [p.time_s[0], before, after, *p.time_s[2:]]
    return protocol(np.insert(p.setting, 1, p.setting[1]), times)


@given(parameters(), st.integers(1, 3))
def test_a_hold_cut_in_two_changes_nothing_when_n_is_one(theta, at):
    """Exactly so for the clock. The goal follows the tension at which a hold begins, which a cut moves too: with U = 0
    it stays put (how far it moves otherwise is measured below)."""
    theta = theta | {"N": 1.0, "U": 1e-12, "preload": 0.5, "B": min(theta["B"], 0.3)}
    whole = protocol([2.0, 4.0, 6.0], [TIMES] * 3)
    parts = cut(whole, at)
    a, b = readings(whole, theta), readings(parts, theta)
    assert b[1, : at + 1] == pytest.approx(a[1, : at + 1], rel=1e-9)
    assert b[2][parts.mask[2]] == pytest.approx(a[1, at:], rel=1e-9)
    assert b[3][: len(TIMES)] == pytest.approx(a[2], rel=1e-9)


def test_how_far_a_cut_moves_the_answer_when_n_is_below_one():
    """Largest change of any later reading when two minutes are cut after one, as a share of what the hold relaxes."""
    whole = protocol([2.0, 4.0, 6.0], [TIMES] * 3)
    moved = {}
    for exponent in (1.0, 0.7, 0.4):
        theta = PLAIN | {"N": exponent, "k2": 0.7 / 60.0**exponent}
        a, b = readings(whole, theta), readings(cut(whole, 2), theta)
        moved[exponent] = max(np.abs(b[2][:3] - a[1, 2:]).max(), np.abs(b[3][:5] - a[2]).max()) / np.ptp(a[1])
    print("cut in two, change / relaxation of the hold:", {k: round(float(v), 4) for k, v in moved.items()})
    assert 0.0 < moved[1.0] < moved[0.7] < moved[0.4] < 1.0
    assert moved == pytest.approx(CUT, abs=5e-4)


def test_a_slack_wire_reads_zero_does_not_creep_and_pulls_again():
    p = protocol([-3.0, 2.0, -3.0, 2.0], [TIMES] * 4)
    tension = readings(p, PLAIN | {"preload": 0.0})
    fresh = readings(protocol([2.0], [TIMES]), PLAIN | {"preload": 0.0})
    assert (tension[[0, 2]] == 0.0).all()
    assert tension[1] == pytest.approx(fresh[0], rel=1e-12)
    crept = 1000.0 * (1.002 / (1.0 + tension[1, -1] / PLAIN["k1"]) - 1.0)
    kept = crept * np.exp(-PLAIN["k2"] * 120.0 ** PLAIN["N"])  # slack, the wire shortens again by its own clock
    assert tension[3, 0] == pytest.approx(PLAIN["k1"] * (1002.0 / (1000.0 + kept) - 1.0), rel=1e-9)
    line = linearise(p, columns(**(PLAIN | {"preload": 0.0})))
    assert (line.by_setting[[0, 2]] == 0.0).all()


@given(protocols(), parameters(), st.sampled_from(["hooke", "modified"]), st.sampled_from(["saturating", "additive"]))
@settings(max_examples=60)
def test_closed_form_derivatives_are_those_of_a_complex_step(p, theta, law, history):
    model = Model(law, history)
    line = linearise(p, columns(**theta), model)
    holds, step = len(p.setting), 1e-30
    carried = np.zeros(holds)
    for j in range(holds):
        setting = np.zeros((holds, 1), complex)
        setting[j] = 1j * step
        tension = simulate(p, columns(**theta), model, setting)[..., 0]
        mask = p.mask[j]
        scale = theta["k1"] / p.length_mm
        found = line.by_setting[j, :, 0][mask]
        assert found == pytest.approx(tension[j].imag[mask] / step, rel=1e-8, abs=1e-8 * scale)
        carried[:] = 0.0
        carried[j] = line.carry_by_setting[j, 0]
        for later in range(j + 1, holds):
            found = (line.by_creep[later, :, 0] * carried[j])[p.mask[later]]
            assert found == pytest.approx(tension[later].imag[p.mask[later]] / step, rel=1e-7, abs=1e-7 * scale)
            carried[j] *= line.carry_by_creep[later, 0]


def test_an_unrecorded_hold_creeps_and_takes_time():
    with_gap = protocol([2.0, 5.0, 6.0], [TIMES] * 3, unrecorded={1})
    recorded = protocol([2.0, 5.0, 6.0], [TIMES] * 3)
    skipped = protocol([2.0, 6.0], [TIMES] * 2)
    a, b, c = (readings(p, PLAIN) for p in (with_gap, recorded, skipped))
    assert a[2] == pytest.approx(b[2], rel=1e-12)
    assert (a[2] < c[1] - 1e-3).all()
    assert with_gap.start_s.tolist() == [0.0, 120.0, 240.0]


def test_setting_errors_move_their_hold_and_the_creep_after_it():
    p = protocol([2.0, 4.0, 6.0], [TIMES] * 3)
    setting = np.array([[0.0], [0.3], [0.0]])
    assert readings(p, PLAIN, setting=setting) == pytest.approx(
        np.array(by_hand(p, PLAIN, setting=[0.0, 0.3, 0.0])), rel=1e-12
    )


@pytest.mark.parametrize("effect", ["", "superposition", "steady_creep", "second_relaxation"])
@pytest.mark.parametrize("compiled_kernel", [True, False])
def test_a_hold_goes_on_creeping_after_its_last_reading(monkeypatch, effect, compiled_kernel):
    """As if a reading had been taken at its end."""
    if not compiled_kernel:
        monkeypatch.setattr("wirebayes.wire.compiled.kernel", None)
    effects = (effect_named(effect),) if effect else ()
    theta = columns(**PLAIN) | {c: np.array([0.05]) for e in effects for c in e.columns()}
    times = ([0.0, 30.0, 60.0], [0.0, 60.0], [0.0, 30.0])
    read = protocol([1, 2, 3], ([0.0, 30.0, 60.0, 100.0], [0.0, 60.0, 90.0], [0.0, 30.0]))
    unread = replace(protocol([1, 2, 3], times), duration_s=np.array([100.0, 90.0, 30.0]))
    model = Model(effects=effects)
    expected, found = linearise(read, theta, model), linearise(unread, theta, model)
    for j, t in enumerate(times):
        np.testing.assert_array_equal(found.reading[j, : len(t)], expected.reading[j, : len(t)])
    np.testing.assert_array_equal(found.creep, expected.creep)
    np.testing.assert_array_equal(found.carry_by_setting, expected.carry_by_setting)
    earlier = linearise(protocol([1, 2, 3], times), theta, model)
    if not effect:
        assert (earlier.creep[1:] < expected.creep[1:]).all()
