"""All posteriors without a hold at once: the sum against its members, estimates against known integrals."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.special import logsumexp

from wirebayes.inference.fit import fit
from wirebayes.inference.policy import Policy
from wirebayes.inference.sampler import ensemble
from wirebayes.inference.transform import LogPosterior
from wirebayes.io.paper import experiments
from wirebayes.model.problem import Problem, build
from wirebayes.prediction import left_out_mixture as module
from wirebayes.prediction.leave_one_hold_out import smoothed_leave_one_hold_out, without_hold
from wirebayes.prediction.left_out_mixture import LeftOutMixture, log_densities, log_mean


@pytest.mark.parametrize("likelihood", ["chain", "hold"])
def test_the_sum_is_that_of_problems_without_a_hold(likelihood: str) -> None:
    """Two wires jointly, one with a hold that was not recorded; every member computed by a problem of its own."""
    problem = build([experiments()[0].train(6), experiments()[2].train(4)], likelihood=likelihood)
    theta = problem.prior.rvs(200, np.random.default_rng(0))
    holds = {(0, 0): 1.5, (0, 5): -20.0, (1, 3): 4.0}
    weights = [np.full(len(s.protocol.recorded), -np.inf) for s in problem.samples]
    for (s, j), weight in holds.items():
        weights[s][j] = weight
    mixture = LeftOutMixture(problem.samples, problem.prior, likelihood, tuple(weights))
    members = [w + without_hold(problem, s, j).log_likelihood(theta) for (s, j), w in holds.items()]
    expected = logsumexp([problem.log_likelihood(theta), *members], axis=0)
    found = mixture.log_likelihood(theta)
    good = np.isfinite(expected)
    assert good.sum() > 100
    np.testing.assert_allclose(found[good], expected[good], rtol=1e-7, atol=1e-6)


class Normals:
    """A posterior on a line whose integrals without a hold are known: a unit normal, others moved and widened."""

    samples = (SimpleNamespace(protocol=SimpleNamespace(recorded=np.ones(3, bool))),)
    prior, likelihood = None, "chain"
    moved, widened, elpd = np.array([0.5, 2.0, 60.0]), np.array([1.0, 2.0, 1.0]), np.array([3.0, -1.0, -9.0])

    def without_each_hold(self, theta: np.ndarray) -> tuple[np.ndarray, list[np.ndarray]]:
        x = theta[:, 0]
        rest = -0.5 * ((x - self.moved[:, None]) / self.widened[:, None]) ** 2 - np.log(self.widened)[:, None]
        return -0.5 * x**2, [rest - self.elpd[:, None]]

    def drawn(self, log_weight: np.ndarray, n: int, rng: np.random.Generator) -> np.ndarray:
        """Exact draws of the sum."""
        centres, widths = np.append(0.0, self.moved), np.append(1.0, self.widened)
        share = np.exp(np.append(0.0, log_weight - self.elpd))
        which = rng.choice(4, n, p=share / share.sum())
        return (centres[which] + widths[which] * rng.normal(size=n))[:, None]


@pytest.fixture
def sampled(monkeypatch: pytest.MonkeyPatch) -> list[np.ndarray]:
    """Samplings answered by exact draws; the weights that each was asked with."""
    asked: list[np.ndarray] = []

    def exact(mixture: LeftOutMixture, rough: np.ndarray, seed: int, policy: Policy) -> tuple[np.ndarray, bool]:
        asked.append(mixture.log_weight[0])
        return Normals().drawn(mixture.log_weight[0], 4000, np.random.default_rng(seed)), True

    monkeypatch.setattr(module, "_sampled", exact)
    return asked


DRAWS = np.random.default_rng(5).normal(size=(4000, 1))


def found(holds: list[int], guess: list[float]) -> tuple[np.ndarray, bool]:
    return log_densities(Normals(), [(0, j) for j in holds], DRAWS, np.array(guess), 7, Policy())  # type: ignore[arg-type]


def test_integrals_are_found_from_a_good_guess_at_once(sampled: list[np.ndarray]) -> None:
    elpd, converged = found([0, 1], [3.4, -0.2])
    assert converged and len(sampled) == 1 and np.isinf(sampled[0][2])
    assert elpd == pytest.approx([3.0, -1.0], abs=0.06)


def test_a_member_without_its_share_is_sampled_again(sampled: list[np.ndarray]) -> None:
    elpd, converged = found([0, 1], [3.0, -3.5])
    assert converged and len(sampled) == 2 and sampled[1][1] == pytest.approx(-1.0, abs=0.3)
    assert elpd == pytest.approx([3.0, -1.0], abs=0.06)


@pytest.mark.parametrize(("overrated", "apart"), [(2.8, False), (3.2, True)])
def test_a_member_with_far_more_than_its_share_is_apart(
    overrated: float, apart: bool, sampled: list[np.ndarray]
) -> None:
    elpd, converged = found([0, 1], [3.0, -1.0 + overrated])
    assert converged and len(sampled) == 2
    assert np.isnan(elpd[1]) == apart and elpd[0] == pytest.approx(3.0, abs=0.06)
    assert np.isinf(sampled[1][1]) == apart


def test_nothing_is_sampled_for_holds_of_which_nothing_is_known(sampled: list[np.ndarray]) -> None:
    elpd, converged = found([0, 1], [np.nan, -np.inf])
    assert np.isnan(elpd).all() and converged and not sampled


def test_shares_that_never_come_out_even_are_not_converged(
    sampled: list[np.ndarray], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_LEAST_SHARE", 5.0)
    assert not found([0, 1], [3.0, -1.0])[1] and len(sampled) == module._MOST_SAMPLINGS


def test_a_sampling_that_did_not_converge_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    draws = Normals().drawn(np.array([3.0, -1.0, -np.inf]), 4000, np.random.default_rng(1))
    monkeypatch.setattr(module, "_sampled", lambda *a: (draws, False))
    assert not found([0, 1], [3.0, -1.0])[1]


@dataclass(frozen=True)
class Between(Problem):
    """The readings of the first hold count to a power only: 0 leaves them out, 1 is the full posterior."""

    power: float = 1.0

    def log_likelihood(self, theta: np.ndarray, readings: object = None) -> np.ndarray:
        whole, without = self.without_each_hold(theta)
        with np.errstate(all="ignore"):
            value = without[0][0] + self.power * (whole - without[0][0])
        return np.where(np.isfinite(value), value, -np.inf)


@pytest.mark.slow
@pytest.mark.statistical
def test_a_hold_that_is_apart_agrees_with_thermodynamic_integration() -> None:
    """The kite line's first hold, by posteriors at eight powers of its density, neighbours bridged."""
    policy = Policy(walkers=64, round_draws=2048, ess=4000.0)
    problem = build([experiments()[3]])
    powers = [0.0, 0.003, 0.01, 0.03, 0.1, 0.3, 0.6, 1.0]
    log_p = []
    for power in powers:
        target = LogPosterior(Between(problem.samples, problem.prior, problem.likelihood, power))
        z = ensemble.sample(target, 1, policy).z
        theta = target.coordinates.to_natural(z.reshape(-1, z.shape[-1]))
        log_p.append(problem.leave_one_hold_out(theta)[0][0])
    steps = zip(np.diff(powers), log_p[:-1], log_p[1:], strict=True)
    expected = sum(log_mean(step * low, step * high) for step, low, high in steps)
    fitted = fit(problem, 1, policy=replace(policy, ess=2000.0))
    found = [smoothed_leave_one_hold_out(fitted, seed).elpd[0] for seed in (1, 2, 3)]
    print(f"log density of the hold: {expected:.2f} by integration, {np.round(found, 2).tolist()} found")
    # draws of both ways know the density to some 0.15
    assert np.mean(found) == pytest.approx(expected, abs=0.4)
