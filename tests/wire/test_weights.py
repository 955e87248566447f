"""Tests under weights: against the law solved for the length, against steps to the same place, and compiled."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.special import lambertw

from tests.wire.protocols import PLAIN, columns, parameters, protocol, protocols, weights_by_hand
from tests.wire.test_compiled import FORMS, LAWS_OF_CREEP, NEEDS_KERNEL, by_numpy, drawn, models, same
from wirebayes.effects import CATALOGUE, effect_named
from wirebayes.wire import compiled
from wirebayes.wire.inverse import inverse
from wirebayes.wire.model import Model
from wirebayes.wire.staircase import linearise, simulate, simulate_alone

TIMES = [0.0, 30.0, 60.0, 120.0]
UP_AND_DOWN = protocol([1.0, 2.0, 4.0, 3.0, 6.0], [TIMES] * 5, control="force")


@given(
    protocols(control="force"),
    parameters(),
    st.sampled_from(["hooke", "modified"]),
    st.sampled_from(["saturating", "additive"]),
)
def test_weights_are_the_law_solved_for_the_length(p, theta, law, history):
    expected = weights_by_hand(p, theta, law=law, history=history)
    model = Model(law, history)
    line = linearise(p, columns(**theta), model)
    for found in (simulate(p, columns(**theta), model)[..., 0], line.reading[..., 0]):
        for row, mask, wanted in zip(found, p.mask, expected, strict=True):
            assert row[mask] == pytest.approx(wanted, rel=1e-9, abs=1e-9)


@NEEDS_KERNEL
@settings(deadline=None)
@given(
    protocols(control="force"),
    models,
    st.lists(parameters(), min_size=1, max_size=3),
    st.integers(0, 2**32 - 1),
)
def test_compiled_readings_and_derivatives_are_those_of_numpy(p, model, rows, seed):
    theta = drawn(model, rows, seed)
    assert compiled.call(p, theta, model) is not None
    line, expected = linearise(p, theta, model), by_numpy(lambda: linearise(p, theta, model))
    usual = np.isfinite(expected.reading).all(axis=(0, 1)) & (np.abs(expected.reading) < 1e6).all(axis=(0, 1))
    assert (np.isfinite(line.reading).all(axis=(0, 1)) == np.isfinite(expected.reading).all(axis=(0, 1)))[usual].all()
    # where the curve of a softening wire is all but flat, rounding decides
    usual &= (np.abs(expected.by_setting) < 1e3).all(axis=(0, 1))
    assert line.edges is expected.edges is None  # a weight leaves no wire slack
    for name in ("reading", "by_setting", "by_creep", "carry_by_setting", "carry_by_creep", "creep"):
        same(getattr(line, name)[..., usual], getattr(expected, name)[..., usual], 1e3)
    setting = np.random.default_rng(seed).normal(0.0, 0.02, (len(p.setting), len(rows)))
    same(
        simulate(p, theta, model, setting)[..., usual],
        by_numpy(lambda: simulate(p, theta, model, setting))[..., usual],
        1e3,
    )
    alone, other = (
        np.array(a) for a in (simulate_alone(p, theta, model), by_numpy(lambda: simulate_alone(p, theta, model)))
    )
    same(alone[..., usual], other[..., usual], 1e3)


ELASTIC = [
    "strain_stiffening",
    "toe",
    "toe@strain",
    "power_strain",
    "fixture_compliance",
    "thermal_expansion",
    "grip_slip@2",
    "length_dependence@k1",
]


@pytest.mark.parametrize("law", ["hooke", "modified"])
@pytest.mark.parametrize("key", ELASTIC)
@pytest.mark.parametrize("compiled_kernel", [True, False])
def test_a_weight_stretches_the_wire_to_where_a_step_reads_that_weight(key, law, compiled_kernel, monkeypatch):
    """Without creep the two kinds of test are inverse to each other, whatever bends the strain."""
    if not compiled_kernel:
        monkeypatch.setattr("wirebayes.wire.compiled.kernel", None)
    effect = effect_named(key)
    model = Model(law, effects=(effect,), length_ref_mm=800.0)
    theta = columns(**(PLAIN | {"B": 1e-300}))
    theta |= {c: np.array([a.prior.ppf(0.8)]) for c, a in zip(effect.columns(), effect.amplitudes, strict=True)}
    warming = np.linspace(0.0, 5.0, 20).reshape(5, 4)
    p = protocol(UP_AND_DOWN.setting, [TIMES] * 5, control="force", warming=warming)
    displacement = simulate(p, theta, model)[..., 0]
    for k in range(len(TIMES)):
        back = protocol(displacement[:, k], [TIMES] * 5, warming=warming)
        assert simulate(back, theta, model)[:, k, 0] == pytest.approx(p.setting, rel=1e-9)


@pytest.mark.parametrize("effect", [*FORMS, *LAWS_OF_CREEP], ids=lambda e: e.key)
@pytest.mark.parametrize("law", ["hooke", "modified"])
def test_derivatives_are_those_of_finite_differences(effect, law):
    """Of readings that effects bend, by the setting error of their own hold and by the carried creep."""
    model = Model(law, effects=(effect,), tension_ref_N=3.0)
    theta = columns(**PLAIN)
    theta |= {c: np.array([a.prior.ppf(0.8)]) for c, a in zip(effect.columns(), effect.amplitudes, strict=True)}
    if not np.isfinite(simulate(UP_AND_DOWN, theta, model)).all():
        pytest.skip("a wire that cannot carry these weights")
    line, step = linearise(UP_AND_DOWN, theta, model), 1e-5
    for j in range(5):
        error = np.zeros((5, 2))
        error[j] = step, -step
        both = {name: np.repeat(value, 2) for name, value in theta.items()}
        moved = simulate(UP_AND_DOWN, both, model, error)
        slope = (moved[j, :, 0] - moved[j, :, 1]) / (2.0 * step)
        assert slope == pytest.approx(line.by_setting[j, :, 0], rel=1e-5, abs=1e-7)


def test_the_effects_of_instruments_act_where_the_instruments_are():
    """A gauge that drifts or hangs back is off in mm; a guide bears a part of the weight."""
    plain = simulate(UP_AND_DOWN, columns(**PLAIN))[..., 0]

    def with_effect(key, **own):
        theta = columns(**PLAIN) | columns(**{f"{key}.{name}": value for name, value in own.items()})
        return simulate(UP_AND_DOWN, theta, Model(effects=(effect_named(key),)))[..., 0]

    elapsed = UP_AND_DOWN.start_s[:, None] + UP_AND_DOWN.time_s
    assert with_effect("sensor_drift", a=1e-4) == pytest.approx(plain + 1e-4 * elapsed, rel=1e-12)
    assert with_effect("sensor_nonlinearity", a=0.01) == pytest.approx(plain + 0.01 * plain**2, rel=1e-12)
    # only the fourth hold is entered by a smaller weight: there the gauge still shows more
    lag = np.array([0.0, 0.0, 0.0, 0.1, 0.0])[:, None]
    assert with_effect("lost_motion", w=0.1) == pytest.approx(plain + lag, rel=1e-12)
    direction = np.array([1.0, 1.0, 1.0, -1.0, 1.0])
    borne = protocol(UP_AND_DOWN.setting / (1.0 + 0.03 * direction), [TIMES] * 5, control="force")
    expected = simulate(borne, columns(**PLAIN))[..., 0]
    assert with_effect("guide_friction", mu=0.03) == pytest.approx(expected, rel=1e-12)


def test_recovery_under_a_small_weight_gives_creep_back():
    p = protocol([8.0, 0.5], [[0.0, 600.0], TIMES], control="force")
    kept = simulate(p, columns(**PLAIN), Model(history="additive"))[1, :, 0]
    assert (np.diff(simulate(p, columns(**PLAIN))[1, :, 0]) < 0).all() and (np.diff(kept) > 0).all()


@pytest.mark.parametrize("compiled_kernel", [True, False])
def test_a_wire_that_cannot_carry_the_weight_has_no_length(compiled_kernel, monkeypatch):
    """Law (3) ends at k1, a softening wire at the top of its curve."""
    if not compiled_kernel:
        monkeypatch.setattr("wirebayes.wire.compiled.kernel", None)
    p = protocol([899.0, 901.0], [TIMES] * 2, control="force")
    lengths = simulate(p, columns(**PLAIN), Model("modified"))
    assert np.isfinite(lengths[0]).all() and np.isnan(lengths[1]).all()
    softening = columns(**PLAIN) | {"strain_stiffening.c": np.array([-0.3])}  # the top lies at k1 / 1.2 = 750 N
    p = protocol([749.0, 751.0], [TIMES] * 2, control="force")
    lengths = simulate(p, softening, Model(effects=(CATALOGUE["strain_stiffening"](),)))
    assert np.isfinite(lengths[0]).all() and np.isnan(lengths[1]).all()


@given(st.floats(0.01, 40.0), st.floats(1e-3, 50.0))
def test_a_toe_under_a_weight_is_lambert_s_w(weight, width):
    theta = columns(**(PLAIN | {"B": 1e-300, "preload": 0.0, "toe.w": width}))
    found = simulate(protocol([weight], [TIMES], control="force"), theta, Model(effects=(effect_named("toe"),)))
    pulls = 1000.0 * weight / PLAIN["k1"]
    expected = pulls + width * (1.0 + lambertw(-np.exp(-1.0 - pulls / width)).real)
    # W loses half the digits near its branch
    assert found[..., 0] == pytest.approx(np.full((1, 4), expected), rel=1e-6)


@given(st.floats(1e-6, 1e3), st.floats(1e-5, 10.0), st.floats(-2.0, 50.0))
def test_the_inverse_of_a_bent_curve_is_where_the_curve_takes_the_value(target, width, bend):
    """A toe and a softening together: convex, then concave; nothing where the curve ends below the target."""

    def curve(x):
        straight = x - width * -np.expm1(-x / width)
        return straight * (1.0 + bend * straight)

    top = np.inf if bend >= 0 else -0.25 / bend
    assume(abs(target - top) > 1e-6 * target)
    found = inverse(curve, np.array([target]))
    if target > top:
        assert np.isnan(found).all()
    else:
        assert curve(found) == pytest.approx(target, rel=1e-8)


def test_the_inverse_has_the_derivatives_of_what_it_depends_on():
    step = 1e-30
    found = inverse(lambda x: x * (2.0 + (1.0 + 1j * step) * x), np.array([8.0 + 3j * step]))
    # x (2 + c x) = y: x = 2, dx = (dy - x² dc) / (2 + 2 c x)
    assert found.real == pytest.approx(2.0) and found.imag / step == pytest.approx((3.0 - 4.0) / 6.0)
