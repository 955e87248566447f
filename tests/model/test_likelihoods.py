"""The likelihood against dense normal distributions: chain, one hold left out, hold by hold as a limit."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from tests.model.dense import (
    columns,
    conditional,
    information,
    jacobian,
    log_density,
    normal,
    relative_spectrum,
)
from tests.wire.protocols import PLAIN, parameters, protocol, protocols
from wirebayes.effects import effect_named
from wirebayes.model import likelihoods, single_holds
from wirebayes.model.hold_filter import Measured
from wirebayes.wire import compiled
from wirebayes.wire.model import Model
from wirebayes.wire.staircase import linearise, simulate

TIMES = [0.0, 30.0, 60.0, 120.0]
ERRORS = {"sensor_sd": 0.01, "setting_sd": 0.03}
LOADING, WEIGHTS = (
    protocol([1.0, 2.0, 4.0, 6.0, 3.0, 7.0], [TIMES] * 6, unrecorded={2}, control=control)
    for control in ("displacement", "force")
)


def measured(p, theta, model=None, seed=0):
    rng = np.random.default_rng(seed)
    setting = rng.normal(0, theta["setting_sd"], (len(p.setting), 1))
    clean = simulate(p, columns(theta), model or Model(), setting)[..., 0]
    return np.where(p.mask, clean + rng.normal(0, theta["sensor_sd"], clean.shape), 0.0)


def filtered(p, theta, readings, model=None, resolution=0.0):
    # what is linear in setting errors about none; tests of `slack_holds` have the rest
    line = replace(linearise(p, columns(theta), model or Model()), edges=None)
    variance = likelihoods.reading_variance(np.array([theta["sensor_sd"]]), resolution)
    return likelihoods.chain(line, Measured(readings[..., None], p.mask, variance, np.array([theta["setting_sd"]])))


noises = st.fixed_dictionaries({"sensor_sd": st.floats(1e-3, 0.1), "setting_sd": st.floats(1e-3, 0.2)})
models = st.builds(Model, st.sampled_from(["hooke", "modified"]), st.sampled_from(["saturating", "additive"]))


@given(protocols(), parameters(), noises, models, st.sampled_from([0.0, 0.01]), st.integers(0, 99))
@settings(max_examples=100, deadline=None)
def test_the_chain_is_the_dense_normal(p, theta, errors, model, resolution, seed):
    theta = theta | errors
    # a preload on the brink of slackness: the creep's derivative by the tension has no bound there
    assume(theta["preload"] == 0 or abs(theta["preload"]) > 1e-3)
    y = measured(p, theta, model, seed)
    r, covariance, _ = normal(p, theta, model, y, resolution)
    expected = log_density(r, covariance)
    found = filtered(p, theta, y, model, resolution).log_likelihood.sum()
    scale = np.linalg.cond(covariance) * 1e-16 * (len(r) + r @ np.linalg.solve(covariance, r))
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-9 + 10 * scale)


SINGLE_STATE = [
    "strain_stiffening", "toe", "permanent_creep", "tension_dependent_rate", "ageing", "creep_threshold", "grip_slip@4",
    "unrecorded_hold@4", "reading_delay", "sensor_drift", "sensor_nonlinearity", "clamp_transient", "lost_motion",
    "guide_friction", "thermal_expansion",
]  # fmt: skip
STRONG = {
    "strain_stiffening.c": 20.0, "toe.w": 0.5, "permanent_creep.psi": 0.6, "tension_dependent_rate.m": 0.5,
    "ageing.a": 0.3, "creep_threshold.tau_c": 0.7, "grip_slip.w": 0.2, "unrecorded_hold.T": 90.0,
    "reading_delay.t_d": 4.0, "sensor_drift.a": 1e-4, "sensor_nonlinearity.a": 0.01, "clamp_transient.a": 0.03,
    "clamp_transient.T": 10.0, "lost_motion.w": 0.1, "guide_friction.mu": 0.03, "thermal_expansion.alpha": 1e-5,
    "superposition.omega": 0.7, "second_relaxation.A": 0.05, "second_relaxation.T2": 40.0, "steady_creep.a": 5e-4,
}  # fmt: skip


@pytest.mark.parametrize("p", [LOADING, WEIGHTS], ids=["steps", "weights"])
@pytest.mark.parametrize("key", SINGLE_STATE)
def test_the_chain_with_an_effect_is_the_dense_normal(key, p):
    model, theta = Model(effects=(effect_named(key),), tension_ref_N=2.0), PLAIN | ERRORS | STRONG
    y = measured(p, theta, model)
    r, covariance, _ = normal(p, theta, model, y, 0.01)
    found = filtered(p, theta, y, model, 0.01).log_likelihood.sum()
    assert found == pytest.approx(log_density(r, covariance), rel=1e-9)


@pytest.mark.parametrize("key", ["superposition", "second_relaxation", "steady_creep"])
def test_effects_that_carry_a_state_of_their_own_are_close_to_the_dense_normal(key):
    """Their state is held at its nominal value in the derivatives; how much that costs, over data sets of the model."""
    model, theta = Model(effects=(effect_named(key),), tension_ref_N=2.0), PLAIN | ERRORS | STRONG
    gaps, depth = [], []
    for seed in range(20):
        y = measured(LOADING, theta, model, seed)
        r, covariance, _ = normal(LOADING, theta, model, y)
        gaps.append(filtered(LOADING, theta, y, model).log_likelihood.sum() - log_density(r, covariance))
        depth.append(log_density(r, covariance))
    print(f"{key}: log-likelihood differs by {np.abs(gaps).max():.3f} at most, its own sd is {np.std(depth):.2f}")
    assert np.abs(gaps).max() < 0.25 * np.std(depth)


def test_residuals_give_the_log_likelihood_and_its_expected_information():
    """On average over data sets of the model: exact but for the two errors, where half as much is allowed."""
    theta, step = PLAIN | ERRORS, 1e-5
    names = list(theta)

    def at(move):
        return {name: theta[name] + by * (abs(theta[name]) or 1.0) for name, by in zip(names, move, strict=True)}

    def standardised(move, y):
        own = at(move)
        variance, setting = np.array([own["sensor_sd"] ** 2]), np.array([own["setting_sd"]])
        line = linearise(LOADING, columns(own))
        return likelihoods.standardised(line, Measured(y[..., None], LOADING.mask, variance, setting))

    found = []
    for seed in range(100):
        y = measured(LOADING, theta, seed=seed)
        assert standardised(np.zeros(len(names)), y)[0] == pytest.approx(
            filtered(LOADING, theta, y).log_likelihood.sum()
        )
        slopes = [standardised(m, y)[1] - standardised(-m, y)[1] for m in step * np.eye(len(names))]
        slopes = np.hstack(slopes) / (2.0 * step)
        found.append(slopes.T @ slopes)
    expected = information(lambda move: normal(LOADING, at(move), Model(), measured(LOADING, theta))[:2], len(names))
    found = np.mean(found, axis=0)
    print(names, np.diag(found) / np.diag(expected), relative_spectrum(found, expected))
    assert np.diag(found)[:6] == pytest.approx(np.diag(expected)[:6], rel=0.02)
    spectrum = relative_spectrum(found, expected)
    assert spectrum[0] > 0.7 and spectrum[-1] < 1.7


def test_dropping_the_carried_creep_is_noticed():
    """What the filter carries matters: without it the dense value is missed by far more than the tolerance."""
    theta = PLAIN | ERRORS | {"B": 0.6, "setting_sd": 0.1}
    y = measured(LOADING, theta)
    line = linearise(LOADING, columns(theta))
    line.by_creep[:] = 0.0
    variance, setting = np.array([theta["sensor_sd"] ** 2]), np.array([theta["setting_sd"]])
    broken = likelihoods.chain(line, Measured(y[..., None], LOADING.mask, variance, setting)).log_likelihood.sum()
    r, covariance, _ = normal(LOADING, theta, Model(), y)
    assert abs(broken - log_density(r, covariance)) > 0.1


@given(protocols(), parameters(), noises, st.integers(0, 99))
@settings(max_examples=40, deadline=None)
def test_leaving_a_hold_out_is_dense_conditioning(p, theta, errors, seed):
    theta = theta | errors
    assume(theta["preload"] == 0 or abs(theta["preload"]) > 1e-3)  # on the brink of slackness, as above
    y = measured(p, theta, seed=seed)
    r, covariance, hold = normal(p, theta, Model(), y, 0.01)
    line = replace(linearise(p, columns(theta)), edges=None)
    variance = likelihoods.reading_variance(np.array([theta["sensor_sd"]]), 0.01)
    seen = Measured(y[..., None], p.mask, variance, np.array([theta["setting_sd"]]))
    filtered = likelihoods.chain(line, seen)
    found = (filtered.log_likelihood.sum(axis=0) - likelihoods.without_each_hold(line, filtered, seen))[:, 0]
    rounding = 1e-6 + 1e-9 * abs(log_density(r, covariance))  # of the dense answer, a difference of two large numbers
    for j in range(len(found)):
        expected = conditional(r, covariance, hold == j) if p.mask[j].any() else 0.0
        assert found[j] == pytest.approx(expected, rel=1e-6, abs=rounding)


def test_held_out_holds_are_given_those_before_them_alone():
    """The last two holds given the first, and of each its first reading, against the dense normal's conditionals."""
    theta = PLAIN | ERRORS | {"setting_sd": 0.1}
    y = measured(LOADING, theta)
    r, covariance, hold = normal(LOADING, theta, Model(), y)
    line = linearise(LOADING, columns(theta))
    noise = np.array([theta["sensor_sd"] ** 2]), np.array([theta["setting_sd"]])
    out = np.isin(np.arange(6), [4, 5])
    before = likelihoods.chain(line, Measured(y[..., None], LOADING.mask & ~out[:, None], *noise))
    first = np.arange(LOADING.mask.shape[1]) == 0
    for rows in (LOADING.mask & out[:, None], LOADING.mask & out[:, None] & first):
        found = likelihoods.held_out_density(line, before, Measured(y[..., None], rows, *noise))[:, 0]
        seen = rows[LOADING.mask]
        for j, value in zip((4, 5), found, strict=True):
            both = ~np.isin(hold, [4, 5]) | (seen & (hold == j))
            expected = conditional(r[both], covariance[np.ix_(both, both)], hold[both] == j)
            assert value == pytest.approx(expected, rel=1e-8)


def by_hold(p, theta, y, model=None):
    variance = np.array([theta["sensor_sd"] ** 2])
    return single_holds.hold_by_hold(p, columns(theta), model or Model(), y[..., None], variance)[:, 0]


@pytest.mark.parametrize("late", [0.0, 7.0])
@pytest.mark.parametrize("law", ["hooke", "modified"])
def test_hold_by_hold_is_the_limit_of_a_wide_setting_error_given_the_first_reading(late, law):
    """p(later | first) of one fresh hold whose position is unknown, linearised where the readings put it."""
    times = [late, 40.0, 90.0, 200.0]
    p, theta, model = protocol([5.0], [times]), PLAIN | {"sensor_sd": 0.01}, Model(law)
    y = measured(p, theta | {"setting_sd": 0.0}, model, seed=1)
    found = by_hold(p, theta, y, model)[0]
    # the preload that puts the first reading where it is stands for the unknown position
    low, high = -6.0, 50.0
    for _ in range(200):
        middle = 0.5 * (low + high)
        tension = simulate(p, columns(theta | {"preload": middle}), model)[0, 0, 0]
        low, high = (middle, high) if tension < y[0, 0] else (low, middle)
    at = theta | {"preload": middle}
    expected = []
    for width in (10.0, 100.0):
        r, covariance, _ = normal(p, at | {"setting_sd": width}, model, y)
        first = np.array([True, False, False, False])
        expected.append(conditional(r, covariance, ~first))
    assert expected[0] == pytest.approx(expected[1], rel=1e-4)
    assert found == pytest.approx(expected[1], rel=1e-5)


@pytest.mark.parametrize("key", ["superposition", "second_relaxation", "steady_creep", "toe"])
def test_with_an_effect_too_every_hold_is_a_test_of_its_own_through_its_first_reading(key):
    model = Model(effects=(effect_named(key),))
    theta = columns(PLAIN | STRONG)
    first = np.linspace(1.0, 6.0, len(LOADING.setting))[:, None]
    for j, course in enumerate(single_holds.hold_courses(LOADING, theta, model, first)):
        if course is None:
            continue
        tension, slope, _ = course
        assert tension[0] == pytest.approx(first[j], rel=1e-9)
        # the preload by which a wire that was never pulled before comes to the same first reading
        alone, low, high = protocol([0.0], [TIMES]), -600.0, 600.0
        for _ in range(200):
            middle = 0.5 * (low + high)
            here = simulate(alone, theta | {"preload": np.array([middle])}, model)[0, :, 0]
            low, high = (middle, high) if here[0] < first[j, 0] else (low, middle)
        beside = [simulate(alone, theta | {"preload": np.array([middle + h])}, model)[0, :, 0] for h in (1e-4, -1e-4)]
        assert tension[:, 0] == pytest.approx(here, rel=1e-7)
        assert slope[:, 0] == pytest.approx((beside[0] - beside[1]) / 2e-4, rel=1e-4)


def test_hold_by_hold_is_flat_along_k1_b_for_large_k1():
    theta = PLAIN | {"sensor_sd": 0.01, "U": 0.4}
    y = measured(LOADING, theta | {"setting_sd": 0.0})
    values = [by_hold(LOADING, theta | {"k1": theta["k1"] * f, "B": theta["B"] / f}, y).sum() for f in (30.0, 1e3, 1e5)]
    assert values[1] == pytest.approx(values[2], abs=0.05)
    assert abs(values[0] - values[1]) < 1.0
    chain = [
        filtered(LOADING, theta | ERRORS | {"k1": theta["k1"] * f, "B": theta["B"] / f}, y).log_likelihood.sum()
        for f in (30.0, 1e3)
    ]
    assert abs(chain[0] - chain[1]) > 100.0  # the chain knows k1


def test_a_slack_first_reading_says_nothing_and_unrecorded_holds_neither():
    theta = PLAIN | {"sensor_sd": 0.01}
    y = measured(LOADING, theta | {"setting_sd": 0.0})
    y[0, 0] = 0.0
    found = by_hold(LOADING, theta, y)
    assert found[0] == 0.0
    assert found[2] == 0.0
    assert (found[[1, 3, 4, 5]] != 0.0).all()


def test_what_is_carried_is_the_posterior_of_the_creep():
    """The filter's mean and variance after all holds against conditioning the dense joint normal."""
    theta = PLAIN | ERRORS
    y = measured(LOADING, theta)
    line = linearise(LOADING, columns(theta))
    r, covariance, _ = normal(LOADING, theta, Model(), y)
    carried = np.zeros(6)  # derivative of the final creep by every setting error
    for j in range(6):
        carried *= line.carry_by_creep[j, 0]
        carried[j] = line.carry_by_setting[j, 0]
    cross = (jacobian(LOADING, theta, Model())[1][LOADING.mask] @ carried) * theta["setting_sd"] ** 2
    mean = cross @ np.linalg.solve(covariance, r)
    variance = theta["setting_sd"] ** 2 * carried @ carried - cross @ np.linalg.solve(covariance, cross)
    found = filtered(LOADING, theta, y)
    assert found.carried_mean[-1, 0] == pytest.approx(mean, rel=1e-8)
    assert found.carried_var[-1, 0] == pytest.approx(variance, rel=1e-6)


def test_absurd_parameters_are_not_likely():
    """A stiffness and a setting error beyond all reason make products that cancel; what is left must not be praise."""
    y = measured(LOADING, PLAIN | ERRORS)
    sensible = filtered(LOADING, PLAIN | ERRORS, y).log_likelihood.sum()
    rng = np.random.default_rng(0)
    for _ in range(200):
        theta = {name: value * np.exp(20.0 * rng.normal()) for name, value in (PLAIN | ERRORS).items()}
        with np.errstate(all="ignore"):
            found = filtered(LOADING, theta, y).log_likelihood.sum()
        assert not found > sensible


@pytest.mark.parametrize("key", [None, "toe"])
def test_the_jacobian_is_the_derivative_of_every_reading_by_every_setting_error(key):
    """Against a complex step through all that follows."""
    model = Model(effects=(effect_named(key),) if key else (), tension_ref_N=2.0)
    theta = PLAIN | ERRORS | STRONG
    found = likelihoods.setting_jacobian(linearise(LOADING, columns(theta), model))
    expected = jacobian(LOADING, theta, model)[1]
    assert found.shape == (6, 4, 6, 1)
    assert found[LOADING.mask][..., 0] == pytest.approx(expected[LOADING.mask], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("times", [1.0, 0.99, 1.01])
def test_residuals_that_are_absurd_say_nothing_of_the_holds_before(times):
    """From a sum of squares of 1e13 variances on, which rounds to more than a few hundredths of a nat."""
    theta = PLAIN | {"sensor_sd": 1.0, "setting_sd": 1e-9}
    p = protocol([1.0, 2.0, 4.0], [TIMES] * 3)
    line = linearise(p, columns(theta))
    y = line.reading.copy()
    y[1, 2] += 1e6 * times
    y[2, 1] += 3e6 * times
    noise = np.ones(1), np.array([1e-9])
    filtered = likelihoods.chain(line, Measured(y, p.mask, *noise))
    found = likelihoods.without_each_hold(line, filtered, Measured(y, p.mask, *noise))[:, 0]
    assert np.isfinite(found).tolist() == [times < 1.0, True, True]


def test_a_hold_of_one_reading_says_nothing_of_itself_beside_others():
    """Its first reading is given; so it is for a hold whose first reading alone was taken."""
    theta = PLAIN | {"sensor_sd": 0.01}
    p = protocol([5.0, 3.0], [TIMES, [20.0]])
    y = measured(p, theta | {"setting_sd": 0.0})
    found = by_hold(p, theta, y)
    assert found[0] != 0.0 and found[1] == 0.0


@pytest.mark.parametrize("kernel", [compiled.kernel, None], ids=["compiled", "numpy"])
@pytest.mark.parametrize("hold", [0, 3, 5])
def test_a_hold_whose_readings_are_nan_is_one_without_readings(kernel, hold, monkeypatch):
    """In the rows where they are; other rows of the same batch see it."""
    monkeypatch.setattr(compiled, "kernel", kernel)
    theta = PLAIN | ERRORS
    y = measured(LOADING, theta)
    line = linearise(LOADING, {name: np.repeat(value, 2) for name, value in columns(theta).items()})
    noise = np.full(2, theta["sensor_sd"] ** 2), np.full(2, theta["setting_sd"])
    readings = np.repeat(y[..., None], 2, axis=2)
    readings[hold, :, 1] = np.nan
    masks = LOADING.mask, LOADING.mask & (np.arange(6) != hold)[:, None]
    found = likelihoods.chain(line, Measured(readings, LOADING.mask, *noise))
    value, residuals = likelihoods.standardised(line, Measured(readings, LOADING.mask, *noise))
    for row, mask in enumerate(masks):
        expected = likelihoods.chain(line, Measured(y[..., None], mask, *noise))
        for name in ("log_likelihood", "carried_mean", "carried_var"):
            assert getattr(found, name)[:, row] == pytest.approx(getattr(expected, name)[:, row], rel=1e-12)
        log_likelihood, rest = likelihoods.standardised(line, Measured(y[..., None], mask, *noise))
        assert value[row] == pytest.approx(log_likelihood[row], rel=1e-12)
        assert (residuals[:, row] ** 2).sum() == pytest.approx((rest[:, row] ** 2).sum(), rel=1e-12)


@pytest.mark.parametrize("kernel", [compiled.kernel, None], ids=["compiled", "numpy"])
@pytest.mark.parametrize("p", [LOADING, WEIGHTS], ids=["steps", "weights"])
def test_hold_by_hold_too_a_hold_whose_readings_are_nan_says_nothing(p, kernel, monkeypatch):
    """Whatever was set: searches that leave a hold out see it so."""
    monkeypatch.setattr(compiled, "kernel", kernel)
    theta = PLAIN | ERRORS
    y = measured(p, theta)
    two = {name: np.repeat(value, 2) for name, value in columns(theta).items()}
    readings = np.repeat(y[..., None], 2, axis=2)
    readings[3, :, 1] = np.nan
    variance = np.full(2, theta["sensor_sd"] ** 2)
    value, left_out = single_holds.hold_by_hold(p, two, Model(), readings, variance).T
    assert value[3] != 0.0 and left_out[3] == 0.0
    assert np.delete(left_out, 3) == pytest.approx(np.delete(value, 3), rel=1e-12)
    total, residuals = single_holds.standardised_hold_by_hold(p, two, Model(), readings, variance)
    assert total == pytest.approx([value.sum(), left_out.sum()], rel=1e-12)
    assert np.isfinite(residuals).all()
