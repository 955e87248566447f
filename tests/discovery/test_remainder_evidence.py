"""A remainder's evidence, the parameters refitted beside it, against an integral over them by importance sampling."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats
from scipy.special import logsumexp

from analyses.hidden_effects.cases import Spec, seal
from tests.simulated import WIRE, simulated_tests
from wirebayes.discovery.linear_scan import expand, scan
from wirebayes.discovery.noise_integral import RATIOS, SIZES, evidences
from wirebayes.discovery.remainder_evidence import (
    Reference,
    _most_probable,
    _refitted,
    reference_of,
    remainder_evidence,
)
from wirebayes.discovery.tangent import moving_columns, residuals
from wirebayes.effects import effect_named
from wirebayes.inference.laplace_fit import LaplaceFit, fitted
from wirebayes.io.experiment_file import read_experiments
from wirebayes.model.spec import PLAIN_SPEC
from wirebayes.simulation.synthetic import Bench, Truth

DRAWS = 10_000
ROUNDS = 3


def integral(fit: LaplaceFit, centre: np.ndarray, reference: Reference | None) -> float:
    """Log of the integral over parameters and the noise's scale, summed over noise ratios, a mean over remainders.

    A remainder is so large that its part which the parameters leave has the length δ, for each of `SIZES`. Readings are
    measured in the errors of the fit. Where draws come from does not matter to what they say, only to how many count.
    """
    columns = moving_columns(fit.target.problem)
    middle = fit.z.copy()
    middle[:, columns] = centre[:, columns]
    x = expand(fit.target, middle, [], reference=reference)
    k, jac, shared = x.left[0] * x.singular[0], x.parameters[0], x.prior_precision[0]
    n, ends = len(jac), np.cumsum(x.processes)
    functions = [x.flexible[0][:, end - count : end] for end, count in zip(ends, x.processes, strict=True)]
    covariances = []
    for ratio in RATIOS:
        noise = np.eye(n) + ratio * k @ k.T
        inverse = np.linalg.inv(noise)
        left = inverse - inverse @ jac @ np.linalg.solve(jac.T @ inverse @ jac + shared, jac.T @ inverse)
        traces = [np.trace(f.T @ left @ f) for f in functions]
        larger = [size**2 / t * f @ f.T for f, t in zip(functions, traces, strict=True) for size in SIZES]
        covariances += [noise + remainder for remainder in larger] if reference else [noise]
    volumes = np.array([-0.5 * np.linalg.slogdet(c)[1] for c in covariances])
    inverses = [np.linalg.inv(c) for c in covariances]

    def height(steps: np.ndarray) -> np.ndarray:
        z = np.repeat(middle, len(steps), axis=0)
        z[:, columns] += steps
        r, prior = residuals(fit.target, z)
        r = np.where(np.isfinite(r), r, 1e50)
        squares = np.array([((r @ inverse) * r).sum(axis=1) for inverse in inverses])
        value = logsumexp(volumes[:, None] - 0.5 * n * np.log(squares), axis=0) + prior
        return np.where(np.isfinite(value), value, -np.inf)

    middle_residual, _ = residuals(fit.target, middle)
    squares = np.array([(middle_residual @ inverse @ middle_residual.T).item() for inverse in inverses])
    best = inverses[int(np.argmax(volumes - 0.5 * n * np.log(squares)))]
    spread = 1.5 * np.linalg.inv(jac.T @ best @ jac + shared)
    about = np.zeros(len(columns))
    for _ in range(ROUNDS):  # each draws where the weights of the one before it are
        proposal = stats.multivariate_t(about, spread, df=5, seed=np.random.default_rng(0))
        steps = proposal.rvs(DRAWS)
        logs = height(steps) - proposal.logpdf(steps)
        share = np.exp(logs - logsumexp(logs))
        about = share @ steps
        spread = 1.5 * (steps - about).T @ ((steps - about) * share[:, None])
    assert 1.0 / (share**2).sum() > 400.0
    return float(logsumexp(logs) - np.log(len(covariances) / len(RATIOS)))


def weighed(fit: LaplaceFit) -> tuple[float, float, float]:
    """Log Bayes factor of a remainder: by the fit without it, refitted, and by the integral."""
    reference = reference_of(fit)
    plain = expand(fit.target, fit.z, [], reference=reference)
    which = _most_probable(evidences(plain)[1])
    beside, _ = _refitted(fit.target, fit.z, plain, which, reference)
    exact = integral(fit, beside, reference) - integral(fit, fit.z, None)
    return float(scan(plain).flexible[0]), remainder_evidence(fit, reference), exact


@pytest.mark.slow
@pytest.mark.parametrize("hidden", [{"strain_stiffening.c": 6.0}, {"toe.w": 1.0}, {"sensor_drift.a": 5e-4}])
def test_a_remainder_has_the_evidence_of_an_integral(hidden: dict[str, float]) -> None:
    effects = [effect_named(name.split(".")[0]) for name in hidden]
    experiments = simulated_tests([Bench()], Truth(WIRE | hidden, effects), seed=3)
    _, found, exact = weighed(fitted(experiments, (), PLAIN_SPEC, np.random.default_rng(0)))
    assert found == pytest.approx(exact, abs=1.5)


def test_what_bends_the_parameters_is_weighed_beside_others(tmp_path: Path) -> None:
    """By the fit without it, a remainder in place of this drift has lost a third of its evidence."""
    spec = Spec("single", "paper", ("sensor_drift",), 10.0, 0, 777)
    assert seal(spec, tmp_path / "cases", tmp_path / "sealed")
    experiments = read_experiments(tmp_path / "cases" / spec.key / "experiment.toml")
    by_fit, found, exact = weighed(fitted(experiments, (), PLAIN_SPEC, np.random.default_rng(0)))
    assert found == pytest.approx(exact, rel=0.06)
    assert by_fit < 0.7 * exact


def test_a_mode_at_the_edge_of_a_prior_lends_a_remainder_nothing() -> None:
    """There the prior's own best is as far away as the coordinate says."""
    experiments = simulated_tests([Bench(displacements_mm=(*range(1, 8), *range(6, 0, -1)))], Truth(WIRE), seed=3)
    block = fitted(experiments, (effect_named("superposition"),), PLAIN_SPEC, np.random.default_rng(0))
    edge = block.z.copy()
    edge[0, block.target.problem.names.index("superposition.omega")] = 6.0
    assert float(expand(block.target, edge, []).prior_square[0]) == pytest.approx(6.0**2, abs=10.0)
    both = replace(block, modes=replace(block.modes, z=np.concatenate([block.z, edge])))
    reference = reference_of(block)
    assert remainder_evidence(both, reference) == pytest.approx(remainder_evidence(block, reference), abs=3.0)


def test_what_has_no_tangent_has_no_evidence() -> None:
    experiments = simulated_tests([Bench()], Truth(WIRE), seed=3)
    block = fitted(experiments, (), PLAIN_SPEC, np.random.default_rng(0))
    x = expand(block.target, block.z, [], reference=reference_of(block))
    plain, beside = evidences(replace(x, residual=np.full_like(x.residual, np.nan)))
    assert (plain == -np.inf).all() and (beside == -np.inf).all()
