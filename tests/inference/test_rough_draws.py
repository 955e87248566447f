"""Rough draws: from known modes, by weights that can be trusted, or else by the sampler."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from wirebayes.inference import rough_draws
from wirebayes.inference.optimum import Optimum

Array = NDArray[Any]
HILLS = np.array([[0.0, 0.0, 0.0], [7.0, -5.0, 3.0]])
COVARIANCE = np.array([[1.0, 0.8, 0.0], [0.8, 1.0, 0.0], [0.0, 0.0, 4.0]])


def two_hills(share: float) -> Any:
    """A density with its modes: a normal and, with this share, another one that is half as wide."""
    parts = [stats.multivariate_normal(HILLS[0], COVARIANCE), stats.multivariate_normal(HILLS[1], 0.25 * COVARIANCE)]

    class Target:
        coordinates = SimpleNamespace(to_natural=lambda z: z)

        def __call__(self, z: Array) -> Array:
            return np.logaddexp(np.log(1 - share) + parts[0].logpdf(z), np.log(share) + parts[1].logpdf(z))

    return Target()


def modes(target: Any, hills: list[int], narrower: float = 1.0) -> Optimum:
    curvature = np.array([np.linalg.inv(COVARIANCE * (1.0, 0.25)[k]) for k in hills]) * narrower
    return Optimum(HILLS[hills], target(HILLS[hills]), curvature, np.ones(len(hills), bool))


@pytest.mark.parametrize("narrower", [1.0, 6.0])
def test_draws_follow_the_density_also_where_the_curvature_at_its_modes_misleads(narrower: float) -> None:
    target = two_hills(0.3)
    z = rough_draws.draws(target, modes(target, [0, 1], narrower), np.random.default_rng(0), 4000)
    second = z[:, 0] - z[:, 1] > 6.0  # nine standard deviations from the first hill
    # some 600 effective draws, four standard errors
    assert second.mean() == pytest.approx(0.3, abs=4 * np.sqrt(0.21 / 600))
    for hill, own, covariance in ((0, z[~second], COVARIANCE), (1, z[second], 0.25 * COVARIANCE)):
        sd, n = np.sqrt(np.diag(covariance)), 600 * (0.7, 0.3)[hill]
        assert (np.abs(own.mean(axis=0) - HILLS[hill]) < 4 * sd / np.sqrt(n)).all()
        assert (np.abs(own.std(axis=0) / sd - 1) < 4 / np.sqrt(2 * n)).all()
        assert np.corrcoef(own.T)[0, 1] == pytest.approx(0.8, abs=4 * (1 - 0.64) / np.sqrt(n))


@pytest.mark.parametrize(
    ("n", "k", "effective", "sampled"),
    [(2000, 0.7, 600, 0), (2000, 0.71, 600, 1), (2000, 0.7, 599, 1), (100, 0.7, 100, 0), (100, 0.7, 99, 1)],
)
def test_weights_that_cannot_be_trusted_leave_it_to_the_sampler(
    n: int, k: float, effective: int, sampled: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nor those that are worth fewer draws than are wanted, but no more than 600 are asked for."""
    runs: list[Any] = []

    def sample(target: Any, seed: int, policy: Any, found: Optimum) -> Any:
        runs.append(policy)
        return SimpleNamespace(z=np.full((4, 500, 3), 9.0))

    monkeypatch.setattr(rough_draws, "sample_posterior", sample)
    monkeypatch.setattr(rough_draws, "tail", lambda log_weight: k)
    monkeypatch.setattr(rough_draws, "effective", lambda log_weight: np.array([float(effective)]))
    target = two_hills(0.3)
    z = rough_draws.draws(target, modes(target, [0, 1]), np.random.default_rng(0), n)
    assert len(runs) == sampled and z.shape == (n, 3) and bool((z == 9.0).all()) == bool(sampled)


@pytest.mark.parametrize(("there", "times", "sampled"), [(900, 1, 0), (899, 13, 0), (600, 13, 0), (599, 13, 1)])
def test_more_effective_draws_are_waited_for_but_those_of_a_decision_are_enough(
    there: int, times: int, sampled: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[int] = []
    runs: list[Any] = []

    def effective(log_weight: Array) -> Array:
        asked.append(len(log_weight))
        return np.array([float(there)])

    def sample(*arguments: Any, found: Optimum) -> Any:
        runs.append(arguments)
        return SimpleNamespace(z=np.zeros((4, 500, 3)))

    monkeypatch.setattr(rough_draws, "sample_posterior", sample)
    monkeypatch.setattr(rough_draws, "effective", effective)
    target = two_hills(0.3)
    rough_draws.draws(target, modes(target, [0, 1]), np.random.default_rng(0), 2000, 900.0)
    assert len(asked) == times and len(runs) == sampled  # in each of twelve rounds, and after the last


def test_all_rounds_count(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draws of early proposals are kept, weighted against the mixture of all of them."""
    seen: list[Array] = []
    keep = rough_draws.effective

    def effective(log_weight: Array) -> Array:
        seen.append(log_weight)
        return keep(log_weight) if len(seen) > 3 else np.zeros(1)

    monkeypatch.setattr(rough_draws, "effective", effective)
    target = two_hills(0.3)
    rough_draws.draws(target, modes(target, [0, 1]), np.random.default_rng(0), 100)
    assert [len(w) for w in seen] == [2500, 5000, 7500, 10000]
    # each proposal counts as often as it was drawn from: the mean weight is the integral, one, over their number
    assert np.exp(seen[3]).mean() == pytest.approx(0.25, abs=0.02)
