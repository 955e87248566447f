"""Amplitudes integrated out: against the normal density written out, and against the density that keeps them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

import wirebayes as wb
from tests.model import dense
from wirebayes.discovery.settings import PLAIN_SPEC
from wirebayes.effects import effect_named
from wirebayes.inference.fit import fit_problem
from wirebayes.inference.laplace_fit import fitted
from wirebayes.inference.policy import Policy
from wirebayes.io import paper
from wirebayes.model.build import build
from wirebayes.model.linear_amplitudes import MarginalisedProblem, completed, integrated

WIRES = {e.name: e for e in paper.experiments()}
UNNAMED = "discrepancy@13:0.08:120.0:1.0:12.0"


def problem_of(name: str, *effects: str):
    return build([WIRES[name]], [effect_named(key) for key in (*effects, UNNAMED)])


def likely(problem, n: int):
    """Parameters not far from the paper's wires, prior draws of the others."""
    theta = problem.prior.rvs(n, np.random.default_rng(3))
    for name, value in {"k1": 900.0, "B": 0.4, "U": 0.6, "k2": 0.03, "N": 0.6, "preload": 0.3}.items():
        theta[:, problem.names.index(name)] = value * np.exp(0.2 * np.random.default_rng(len(name)).normal(size=n))
    return theta


@pytest.mark.parametrize("name", ["roc-line-1m", "kite-1.5m"])
def test_the_density_is_the_normal_one_with_the_amplitudes_covariance(name):
    inner = integrated(problem_of(name))
    theta = likely(inner, 5)
    found = inner.log_likelihood(theta)
    [sample], [shapes] = inner.samples, inner.shapes
    own = inner.parameters(theta, sample)
    added = shapes[sample.protocol.mask] * inner.sd
    for i in range(len(theta)):
        row = {key: value[i] for key, value in own.items()}
        r, covariance, _ = dense.normal(sample.protocol, row, sample.model, sample.readings[..., 0], sample.resolution)
        expected = dense.log_density(r, covariance + added @ added.T)
        assert found[i] == pytest.approx(expected, rel=1e-9, abs=1e-6)


def test_residuals_give_the_log_likelihood_and_its_expected_information_without_the_amplitudes():
    inner = integrated(problem_of("roc-line-1m"))
    theta, step = likely(inner, 1)[0], 1e-5
    [sample], [shapes] = inner.samples, inner.shapes
    added = shapes[sample.protocol.mask] * inner.sd

    def normal_at(move):
        own = {k: v[0] for k, v in inner.parameters((theta * (1.0 + move))[None], sample).items()}
        r, covariance, _ = dense.normal(sample.protocol, own, sample.model, sample.readings[..., 0], sample.resolution)
        return r, covariance + added @ added.T

    model, covariance = normal_at(np.zeros(len(theta)))
    noise = np.linalg.cholesky(covariance) @ np.random.default_rng(0).normal(size=(len(model), 200))
    readings = np.repeat(sample.readings, 200, axis=-1)
    readings[sample.protocol.mask] += noise - model[:, None]  # data sets of the model
    moves = step * np.concatenate([np.eye(len(theta)), -np.eye(len(theta))])
    residuals = [inner.standardised(np.tile(theta * (1.0 + m), (200, 1)), [readings])[1] for m in moves]
    slopes = (np.array(residuals[: len(theta)]) - np.array(residuals[len(theta) :])) / (2.0 * step)
    spectrum = dense.relative_spectrum(
        np.einsum("imn,jmn->ij", slopes, slopes) / 200, dense.information(normal_at, len(theta))
    )
    print(spectrum)
    assert spectrum[0] > 0.7 and spectrum[-1] < 1.7
    value = inner.standardised(theta[None])[0]
    assert value == pytest.approx(inner.log_likelihood(theta[None]), rel=1e-12)


@pytest.mark.parametrize("effects", [(), ("toe",)])
def test_bayes_rule_holds_at_every_completed_draw(effects):
    whole = problem_of("roc-line-1m", *effects)
    wide = stats.norm(0.01, 0.05)  # one prior that is not centred
    priors = whole.prior.distributions | {"discrepancy.course1": wide}
    whole = replace(whole, prior=replace(whole.prior, distributions=priors))
    inner = integrated(whole)
    assert isinstance(inner, MarginalisedProblem)
    theta = likely(inner, 50)
    problem, draws, log_density = completed(inner, theta, np.random.default_rng(1))
    assert problem is whole
    np.testing.assert_array_equal(draws[:, [whole.names.index(n) for n in inner.names]], theta)
    gone = [i for i, n in enumerate(whole.names) if n not in inner.names]
    prior = sum(whole.prior.distributions[whole.names[i]].logpdf(draws[:, i]) for i in gone)
    by_draws, by_integral = whole.log_likelihood(draws) + prior - log_density, inner.log_likelihood(theta)
    line, _ = whole.linearised(draws, whole.samples[0])
    near = np.zeros(len(draws), bool) if line.edges is None else line.edges.near.any(axis=0)
    np.testing.assert_allclose(by_draws[~near], by_integral[~near], rtol=1e-9, atol=1e-6)
    # which side of an edge a hold is on may depend on the amplitudes, which are integrated out on one side
    assert near.sum() < 5 and np.abs(by_draws - by_integral)[near] == pytest.approx(0.0, abs=0.2)


def test_absurd_parameters_have_no_density_and_stop_nobody():
    inner = integrated(problem_of("kite-1.5m"))
    rng = np.random.default_rng(0)
    theta = likely(inner, 2000)
    theta[1:] *= 10.0 ** rng.uniform(-40, 40, size=theta[1:].shape)
    value = inner.log_likelihood(theta)
    assert value[0] == pytest.approx(inner.log_likelihood(theta[:1])[0])
    assert not np.isnan(value).any() and (value == -np.inf).any()


def test_only_what_is_linear_to_the_end_is_integrated_out():
    assert integrated(build([WIRES["roc-line-1m"]], [effect_named("sensor_drift")])).names[-1] == "setting_sd"
    plain = build([WIRES["roc-line-1m"]], [effect_named("toe")])
    assert integrated(plain) is plain
    before = problem_of("roc-line-1m", "sensor_nonlinearity")
    assert isinstance(integrated(before), MarginalisedProblem)
    after = build([WIRES["roc-line-1m"]], [effect_named(UNNAMED), effect_named("sensor_nonlinearity")])
    assert integrated(after) is after
    wide = before.prior.distributions | {"discrepancy.level0": stats.uniform(-1.0, 2.0)}
    uniform = replace(before, prior=replace(before.prior, distributions=wide))
    assert integrated(uniform) is uniform


def test_a_fit_has_all_parameters_and_what_no_reading_shows_keeps_its_prior():
    whole = problem_of("roc-line-1m")
    fitted = fit_problem(whole, 1, policy=Policy(walkers=64, ess=1000.0))
    assert fitted.theta.shape[-1] == len(whole.names)
    beyond = fitted.flat[:, whole.names.index("discrepancy.level5")]
    sd = whole.prior.distributions["discrepancy.level5"].std()
    assert stats.kstest(beyond, stats.norm(0.0, sd).cdf).pvalue > 1e-3
    within = fitted.flat[:, whole.names.index("discrepancy.course2")]
    assert within.std() < 0.5 * sd


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_test_that_begins_slack_has_no_modes_but_those_of_the_density_itself(seed):
    """Setting errors of half a step once had 40 nats more by the integral, and 200 less by the density itself."""
    truth = {"k1": 5800.0, "B": 0.3, "U": 0.7, "k2": 0.1, "N": 0.8, "preload": -1.65, "sensor_sd": 0.015}
    made = wb.simulate_tests(
        lengths=2000, displacements=range(1, 8), parameters=truth | {"setting_sd": 0.025}, resolution=1e-5, seed=seed
    )
    unnamed = effect_named("discrepancy@7:0.1:120.0:1.0:6.0")
    found = fitted(made.experiments, [unnamed], PLAIN_SPEC, np.random.default_rng(1))
    inner = found.target.problem
    theta = found.theta[:1].repeat(100, axis=0)
    whole, draws, log_density = completed(inner, theta, np.random.default_rng(2))
    gone = [i for i, n in enumerate(whole.names) if n not in inner.names]
    prior = sum(whole.prior.distributions[whole.names[i]].logpdf(draws[:, i]) for i in gone)
    by_draws = whole.log_likelihood(draws) + prior - log_density
    assert by_draws == pytest.approx(inner.log_likelihood(theta), abs=1.0)
    assert by_draws == pytest.approx(inner.standardised(theta)[0], abs=1.0)
    assert theta[0, inner.names.index("setting_sd")] < 0.1
