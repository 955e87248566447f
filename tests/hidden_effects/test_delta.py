"""The size of effects: definition, inverse, and what cannot be seen."""

import numpy as np
import pytest

from analyses.hidden_effects.cases import Spec, build
from analyses.hidden_effects.catalogue import EFFECTS, Candidate, draw, fits, members
from analyses.hidden_effects.delta import derivatives, geometry, signature, solve_amplitude
from analyses.hidden_effects.fitting import delta_after_refit, fit, held_out_mask, last_third, oracle
from analyses.hidden_effects.generator import simulate
from analyses.hidden_effects.noise import measure, rounded, sensor_errors, setting_errors
from analyses.hidden_effects.truth import draw_rig


def whitened(rig):
    """Root of the noise's inverse covariance, and the columns of all parameters under it, by one-sided differences."""
    y0 = simulate(rig)[0]
    columns = []
    for i, value in enumerate(rig.theta):
        theta = rig.theta.copy()
        step = 1e-5 * max(abs(value), 1.0) if i >= 5 * len(rig.materials) else 1e-6 * value
        theta[i] += step
        columns.append((simulate(rig, theta)[0] - y0) / step)
    j = []
    for h in range(rig.n_holds):
        eta = np.zeros(rig.n_holds)
        eta[h] = 1e-5
        j.append((simulate(rig, eta_mm=eta)[0] - y0) / 1e-5)
    j = np.array(j).T
    setting = np.concatenate([np.full(len(b.holds), b.setting_sd**2) for b in rig.benches])
    sensor = [np.full(b.n_readings, b.sensor_sd**2 + (b.resolution_N or 0) ** 2 / 12) for b in rig.benches]
    v = np.diag(np.concatenate(sensor)) + j @ np.diag(setting) @ j.T
    values, vectors = np.linalg.eigh(v)
    root = vectors @ np.diag(values**-0.5) @ vectors.T
    a = root @ np.array(columns).T
    return root, a / np.linalg.norm(a, axis=0)


def by_definition(root, a, dy):
    """Delta by dense algebra."""
    z = root @ dy
    rest = z - a @ np.linalg.lstsq(a, z, rcond=1e-9)[0]
    return np.linalg.norm(rest)


@pytest.mark.parametrize("protocol", ["paper", "unloading", "slack", "several_wires", "two_lengths"])
def test_solved_amplitude_has_the_requested_delta(protocol):
    rng = np.random.default_rng(11)
    rig = draw_rig(rng, protocol)
    geo = geometry(rig)
    root, columns = whitened(rig)
    solved = 0
    for e in EFFECTS.values():
        if not fits(e, rig):
            continue
        candidate = draw(e, rig, rng)
        for delta in (3.0, 20.0):
            size = solve_amplitude(geo, candidate, delta)
            if np.isnan(size):
                continue
            solved += 1
            dy = simulate(rig, members=members(rig, [[(candidate, size)]]))[0] - geo.plain
            assert by_definition(root, columns, dy) == pytest.approx(delta, rel=0.01)
    assert solved >= 15


def test_a_gain_of_the_sensor_is_absorbed():
    """On loading alone, friction multiplies every reading alike: invisible, and never solved for."""
    rig = draw_rig(np.random.default_rng(1), "paper")
    geo = geometry(rig)
    gain = Candidate("guide_friction", 1, (), (0,))
    assert np.linalg.norm(geo.whiten(1e-3 * geo.plain)) > 1
    assert np.linalg.norm(signature(geo, [[(gain, 1e-3)]])) < 1e-2


def test_a_setting_error_is_carried_to_later_holds():
    rig = draw_rig(np.random.default_rng(1), "dense")
    _, _, by_eta = derivatives(rig)
    holds = rig.benches[0].hold_of_reading
    assert np.abs(by_eta[holds < 2, 2]).max() == 0
    assert np.abs(by_eta[holds == 2, 2]).min() > 0
    assert np.abs(by_eta[holds == 3, 2]).max() > 1e-3 * np.abs(by_eta[holds == 2, 2]).max()


def test_refit_reaches_no_more_than_linear_projection_for_a_small_effect():
    rng = np.random.default_rng(8)
    rig = draw_rig(rng, "paper")
    geo = geometry(rig)
    candidate = Candidate("grip_slip", 1, (("hold", 5.0),), (0,))
    size = solve_amplitude(geo, candidate, 5.0)
    y = simulate(rig, members=members(rig, [[(candidate, size)]]))[0]
    assert delta_after_refit(rig, geo.chol, y) == pytest.approx(5.0, rel=0.1)


def test_fit_recovers_truth_and_amplitude_without_noise():
    rig = draw_rig(np.random.default_rng(8), "unloading")
    candidate = Candidate("lost_motion", 1, (), (0,))
    y = simulate(rig, members=members(rig, [[(candidate, 0.15)]]))[0]
    found = fit(rig, y, np.ones(len(y), dtype=bool), (candidate,), np.array([0.05]), rounds=30)
    assert found.sizes[0] == pytest.approx(0.15, rel=0.02)
    assert found.model == pytest.approx(y, abs=2e-3)


def test_noise_has_the_covariance_that_delta_uses():
    """Gaussian or heavy: variance over 3000 draws against V, and the correlation within a hold against V's."""
    rig = draw_rig(np.random.default_rng(6), "paper")
    geo = geometry(rig)
    v = geo.chol @ geo.chol.T
    rng = np.random.default_rng(0)
    eta = np.array([setting_errors(rig, rng) for _ in range(3000)])
    for law in ("gaussian", "heavy"):
        y = simulate(rig, eta_mm=eta) + np.array([sensor_errors(rig, rng, law) for _ in range(3000)])
        y = np.array([rounded(rig, line) for line in y])
        found = np.cov(y.T)
        assert np.diag(found) == pytest.approx(np.diag(v), rel=0.15)
        assert np.mean(np.diag(found) / np.diag(v)) == pytest.approx(1, abs=0.03)
        assert found[0, 1] == pytest.approx(v[0, 1], rel=0.15)
        assert y.mean(axis=0) == pytest.approx(geo.plain, abs=5 * np.sqrt(v.diagonal().max() / 3000))


def test_heavy_noise_has_heavier_tails_and_gross_noise_an_outlier():
    rig = draw_rig(np.random.default_rng(6), "dense")
    rng = np.random.default_rng(0)
    sd = rig.benches[0].sensor_sd
    kurtosis = {}
    for law in ("gaussian", "heavy"):
        z = np.concatenate([sensor_errors(rig, rng, law) for _ in range(400)]) / sd
        assert z.std() == pytest.approx(1, abs=0.02)
        kurtosis[law] = np.mean(z**4)
    assert kurtosis["gaussian"] == pytest.approx(3, abs=0.15)
    assert kurtosis["heavy"] > 3.8
    assert np.abs(sensor_errors(rig, rng, "gross")).max() > 7 * sd


def test_readings_are_rounded_to_the_resolution():
    rng = np.random.default_rng(0)
    seen = 0
    for seed in range(6):
        rig = draw_rig(np.random.default_rng(seed), "paper")
        step = rig.benches[0].resolution_N
        if step:
            seen += 1
            units = measure(rig, None, rng) / step
            assert units == pytest.approx(np.round(units), abs=1e-6)
    assert seen


def test_oracle_beats_plain_on_held_out_holds():
    """Pooled over a few stiffening wires: the true form predicts the rest nearly to the noise floor."""
    plain, best = 0.0, 0.0
    for repeat in range(4):
        case = build(Spec("single", "dense", ("strain_stiffening",), 20.0, repeat))
        name = case.rig.benches[0].name
        found = oracle(case.rig, case.readings, case.hidden, held_out_mask(case.rig, last_third(case.rig)), name)
        plain += (found["plain"] / found["floor"]) ** 2
        best += (found["oracle"] / found["floor"]) ** 2
    assert best < 0.3 * plain
