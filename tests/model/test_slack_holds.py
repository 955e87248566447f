"""Holds whose setting error decides whether the wire is taut, against integrals over the errors themselves."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.special import logsumexp

from tests.wire.protocols import protocol
from wirebayes.effects import effect_named
from wirebayes.model import likelihoods
from wirebayes.model.hold_filter import Measured
from wirebayes.wire import compiled, edges
from wirebayes.wire.model import Model
from wirebayes.wire.staircase import linearise, simulate, streamed

WIRE = {"k1": 2000.0, "B": 0.1, "U": 0.5, "k2": 0.02, "N": 0.8, "sensor_sd": 0.02, "setting_sd": 0.05}
TEST = protocol([0.0, 0.3], [[0.0, 20.0, 60.0]] * 2)
FAR, APART = 6.0, 0.06  # standard deviations of the setting: how far is integrated, and at most this far apart


def columns(theta, n=1):
    return {name: np.full(n, value) for name, value in theta.items()}


def read(theta, seed, p=TEST):
    rng = np.random.default_rng(seed)
    setting = rng.normal(0.0, theta["setting_sd"], (len(p.setting), 1))
    clean = simulate(p, columns(theta), Model(), setting)[..., 0]
    return np.where(p.mask, clean + rng.normal(0.0, theta["sensor_sd"], clean.shape), 0.0)


def measured(theta, readings, p=TEST):
    variance, setting_sd = np.array([theta["sensor_sd"] ** 2]), np.array([theta["setting_sd"]])
    return Measured(readings[..., None], p.mask, variance, setting_sd)


def found(theta, readings, p=TEST):
    seen = measured(theta, readings, p)
    line = streamed(p, columns(theta), Model(), seen.first_readings)
    return likelihoods.chain(line, seen).log_likelihood.sum()


def grid(theta, p):
    """Setting errors in standard deviations; from one to the next a reading changes by less than its own error."""
    error_N = theta["setting_sd"] * theta["k1"] / p.length_mm
    apart = min(APART, 0.75 * theta["sensor_sd"] / error_N)
    return np.linspace(-FAR, FAR, round(2.0 * FAR / apart) + 1)


def integral(theta, readings, p=TEST, mask=None):
    """Log density of readings, summed over a grid of the setting errors of two holds."""
    one, other = np.meshgrid(grid(theta, p), grid(theta, p), indexing="ij")
    errors = np.stack([one.ravel(), other.ravel()])
    log_weight = -0.5 * (errors**2).sum(axis=0)
    clean = simulate(p, columns(theta, errors.shape[1]), Model(), errors * theta["setting_sd"])
    sd = theta["sensor_sd"]
    each = -0.5 * ((readings[..., None] - clean) / sd) ** 2 - np.log(sd * np.sqrt(2.0 * np.pi))
    taken = p.mask if mask is None else mask
    log_density = np.where(taken[..., None], each, 0.0).sum(axis=(0, 1))
    return logsumexp(log_density + log_weight) - logsumexp(log_weight)


@cache
def read_and_integrated(theta, seed):
    """Readings and their log density, once for both ways of computing the staircase."""
    readings = read(dict(theta), seed)
    return readings, integral(dict(theta), readings)


@pytest.fixture(params=["compiled", "numpy"])
def computed(request, monkeypatch):
    if request.param == "numpy":
        monkeypatch.setattr(compiled, "kernel", None)
    elif compiled.kernel is None:
        pytest.skip("the package was installed without a C compiler")


@pytest.mark.parametrize("wire", [{}, {"k1": 20000.0, "B": 0.03, "U": 0.3}, {"k1": 100.0, "U": 1.0}], ids=str)
@pytest.mark.parametrize("preload", [-0.15, -0.05, -0.02, 0.0, 0.02, 0.05, 0.15, 0.3])
def test_the_density_is_the_integral_over_the_errors(computed, wire, preload):
    """Linear in the errors about none, the readings of a taut wire would have been impossible by thousands of nats."""
    theta = WIRE | wire | {"preload": preload}
    for seed in range(2):
        readings, expected = read_and_integrated(tuple(theta.items()), seed)
        assert found(theta, readings) == pytest.approx(expected, abs=0.05)


def test_residuals_have_the_same_density():
    theta = WIRE | {"preload": -0.02}
    for seed in range(4):
        seen = measured(theta, read(theta, seed))
        line = streamed(TEST, columns(theta), Model(), seen.first_readings)
        value, _ = likelihoods.standardised(line, seen)
        assert value[0] == pytest.approx(likelihoods.chain(line, seen).log_likelihood.sum(), rel=1e-12)


@pytest.mark.parametrize("preload", [-0.05, 0.0, 0.05])
def test_leaving_a_hold_out_is_the_ratio_of_two_integrals(preload):
    theta = WIRE | {"preload": preload}
    for seed in range(2):
        readings = read(theta, seed)
        seen = measured(theta, readings)
        by_side = likelihoods.on_sides(linearise(TEST, columns(theta), Model(), seen.first_readings), seen)
        rest = likelihoods.without_each_hold(by_side.line, by_side.filtered, seen)[:, 0]
        for j in range(2):
            without = rest[j] + by_side.beside[1 - j, 0]
            mask = TEST.mask & (np.arange(2) != j)[:, None]
            # what is said of the other hold's side is said with this one read
            assert without == pytest.approx(integral(theta, readings, mask=mask), abs=0.3)


def test_beyond_eight_standard_deviations_there_is_no_edge_and_the_density_goes_on():
    theta = WIRE | {"U": 1.0}
    least = edges.FAR * theta["setting_sd"]
    readings = read(theta | {"preload": least}, 0)
    inside, outside = theta | {"preload": least - 1e-9}, theta | {"preload": least + 1e-9}
    assert linearise(TEST, columns(inside)).edges is not None
    assert linearise(TEST, columns(outside)).edges is None
    assert found(inside, readings) == pytest.approx(found(outside, readings), abs=1e-6)


def test_a_wire_without_setting_errors_or_under_weights_has_no_edges():
    theta = WIRE | {"preload": -0.1}
    assert linearise(TEST, columns(theta | {"setting_sd": 0.0})).edges is None
    weights = replace(TEST, control="force", setting=np.array([1.0, 2.0]))
    assert linearise(weights, columns(theta)).edges is None


EFFECTS = {
    "toe": {"toe.w": 0.05},
    "grip_slip@2": {"grip_slip.w": 0.1},
    "unrecorded_hold@2": {"unrecorded_hold.T": 90.0},
    "superposition": {"superposition.omega": 0.6},
    "second_relaxation": {"second_relaxation.A": 0.01, "second_relaxation.T2": 30.0},
    "screw_error": {"screw_error.a": 0.02, "screw_error.P": 0.5, "screw_error.phi": 1.0},
}


@pytest.mark.skipif(compiled.kernel is None, reason="the package was installed without a C compiler")
@pytest.mark.parametrize("keys", [[], *([key] for key in EFFECTS), ["superposition", "unrecorded_hold@2"]], ids=str)
def test_compiled_sides_are_those_of_numpy(keys, monkeypatch):
    rng = np.random.default_rng(1)
    n = 50
    p = protocol([0.0, 0.1, 0.3, 0.2, 0.6, 0.0], [[0.0, 20.0, 60.0]] * 6, unrecorded={2})
    theta = columns(WIRE, n) | {"k1": rng.uniform(50.0, 5000.0, n), "preload": rng.normal(0.0, 0.15, n)}
    for key in keys:
        theta |= columns(EFFECTS[key], n)
    model = Model(effects=tuple(map(effect_named, keys)), tension_ref_N=1.0)
    readings = np.abs(rng.normal(0.2, 0.2, (6, 3, 1)))
    seen = Measured(readings, p.mask, theta["sensor_sd"] ** 2, theta["setting_sd"])
    line = streamed(p, theta, model, seen.first_readings)
    value, residuals = likelihoods.standardised(line, seen)
    filtered = likelihoods.chain(line, seen)
    of_stored = likelihoods.chain(linearise(p, theta, model, seen.first_readings), seen)
    monkeypatch.setattr(compiled, "kernel", None)
    expected = linearise(p, theta, model, seen.first_readings)
    assert 0.3 < expected.edges.near.mean() < 0.95
    by_numpy = likelihoods.chain(expected, seen)
    for name, wanted in vars(by_numpy).items():
        for compiled_one in (filtered, of_stored):
            np.testing.assert_allclose(getattr(compiled_one, name), wanted, rtol=1e-7, atol=1e-9)
    wanted_value, wanted_residuals = likelihoods.standardised(expected, seen)
    np.testing.assert_allclose(value, wanted_value, rtol=1e-7)
    np.testing.assert_allclose(residuals, wanted_residuals, rtol=1e-6, atol=1e-7)
