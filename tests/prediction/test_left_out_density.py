"""Densities of holds from ratios of integrals: which posteriors are meant, and that their integrals are right."""

from copy import copy
from dataclasses import dataclass, fields, replace
from types import SimpleNamespace
from typing import Literal

import numpy as np
import pytest

from wirebayes.effects import effect_named
from wirebayes.inference import importance
from wirebayes.inference.fit import fit_problem
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.inference.policy import Policy
from wirebayes.inference.sampler import ensemble
from wirebayes.io.paper import experiments
from wirebayes.model.build import build
from wirebayes.model.problem import Problem
from wirebayes.model.scales import NATURAL, Units
from wirebayes.model.spec import ModelSpec
from wirebayes.prediction import left_out_density as module
from wirebayes.prediction.leave_one_hold_out import log_mean, smoothed_leave_one_hold_out
from wirebayes.prediction.left_out_density import joined_densities, log_densities, without_hold


@pytest.mark.parametrize("likelihood", ["chain", "hold"])
def test_the_densities_are_those_of_problems_without_a_hold(likelihood: str) -> None:
    """Two wires jointly, one with a hold that was not recorded; every member computed by a problem of its own."""
    problem = build([experiments()[0].train(6), experiments()[2].train(4)], spec=ModelSpec(likelihood=likelihood))
    target = LogPosterior(problem)
    theta = problem.prior.rvs(200, np.random.default_rng(0))
    holds = [(0, 0), (0, 5), (1, 3)]
    likelihoods = [p.log_likelihood(theta) for p in (problem, *(without_hold(problem, s, j) for s, j in holds))]
    prior = target.sampled_prior(theta, target.coordinates.to_sampled(theta))
    found, expected = joined_densities(target, holds)(target.coordinates.to_sampled(theta)), prior + likelihoods
    good = np.isfinite(expected).all(axis=0)
    if likelihood == "chain":  # near an edge what comes after a hold is taken on one side, whatever was left out
        edges = [problem.linearised(theta, sample)[0].edges for sample in problem.samples]
        good &= ~np.any([e.near.any(axis=0) for e in edges if e is not None], axis=0)
    assert good.sum() > 80
    np.testing.assert_allclose(found[good], expected.T[good], rtol=1e-7, atol=1e-6)


def test_where_a_density_cannot_be_computed_it_is_zero() -> None:
    """Each of them for itself, however many points there are."""
    n = 2500
    whole, without = np.arange(float(n)), np.stack([np.arange(n) + 0.5, np.zeros(n)])
    whole[7], without[0, 9], without[0, 2100] = np.nan, np.inf, -np.inf
    coordinates = SimpleNamespace(to_natural=lambda z: z)

    def parts(theta: np.ndarray) -> tuple[np.ndarray, list[np.ndarray]]:
        rows = theta[:, 0].astype(int)
        return whole[rows], [without[:, rows]]

    problem = SimpleNamespace(without_each_hold=parts)
    target = SimpleNamespace(problem=problem, coordinates=coordinates, sampled_prior=lambda theta, z: 3.0 - theta[:, 0])
    found = joined_densities(target, [(0, 1), (0, 0)])(np.arange(float(n))[:, None])  # type: ignore[arg-type]
    expected = np.column_stack([np.full(n, 3.0), 3.0 - np.arange(n), np.full(n, 3.5)])
    expected[7, 0] = expected[9, 2] = expected[2100, 2] = -np.inf
    assert np.array_equal(found, expected)


class Normals:
    """A posterior on a plane whose integrals without a hold are known: a unit normal, others moved and widened."""

    names = ("x", "y")
    samples = (SimpleNamespace(protocol=SimpleNamespace(mask=np.ones((3, 5), bool))),)
    moved, widened, elpd = np.array([0.5, 2.0, 30.0]), np.array([1.0, 2.0, 1.0]), np.array([3.0, -1.0, -9.0])

    own_units = NATURAL

    def in_units(self, units: Units) -> "Normals":
        return self

    def theta_in(self, units: Units, theta: np.ndarray) -> np.ndarray:
        return theta

    def log_units(self, other: "Normals") -> list[np.ndarray]:
        return [np.zeros(3)]

    def without_each_hold(self, theta: np.ndarray) -> tuple[np.ndarray, list[np.ndarray]]:
        away = (theta[:, None, :] - self.moved[:, None]) / self.widened[:, None]
        rest = -0.5 * (away**2).sum(axis=2) - 2.0 * np.log(self.widened) - self.elpd
        return -0.5 * (theta**2).sum(axis=1), [rest.T]


@pytest.fixture
def pools(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The number of densities in each pool that was sampled, of `Normals`."""
    identity = SimpleNamespace(to_sampled=lambda x: x, to_natural=lambda x: x, order=np.arange(2))
    monkeypatch.setattr(
        module,
        "LogPosterior",
        lambda problem: SimpleNamespace(
            problem=problem, coordinates=identity, sampled_prior=lambda theta, z: np.zeros(len(theta))
        ),
    )
    sampled, true = [], importance.importance_sample

    def counted(*given: object) -> importance.Weighted:
        assert np.sqrt(2.0 / given[-1]) == pytest.approx(0.07, abs=0.001)  # type: ignore[operator]  # error of a ratio
        found = true(*given)  # type: ignore[arg-type]
        sampled.append(len(found.settled))
        return found

    monkeypatch.setattr(importance, "importance_sample", counted)
    return sampled


DRAWS = np.random.default_rng(5).normal(size=(4000, 2))
ALL = np.ones(3, bool)


def by_themselves(monkeypatch: pytest.MonkeyPatch, converged: bool = True) -> list[int]:
    """The holds whose posteriors without them are sampled by themselves, of `Normals`."""
    asked: list[int] = []

    def alone(hold: int | Normals, seed: int, ess: float) -> SimpleNamespace:
        asked.append(-1 if isinstance(hold, Normals) else hold)
        assert ess == 1000.0
        left_out = 0.0 if isinstance(hold, Normals) else Normals.elpd[hold]
        # the full one's integral is 2 pi, as it is there
        return SimpleNamespace(log_evidence=np.log(2.0 * np.pi) - left_out, converged=converged)

    monkeypatch.setattr(module, "searches", lambda target, rng, n, readings: [SimpleNamespace(modes=None)] * n)
    monkeypatch.setattr(module, "without_holds", lambda problem, holds: None)
    monkeypatch.setattr(importance, "widened", lambda modes: None)
    monkeypatch.setattr(module, "overlooked_share", lambda *given: 0.0)
    monkeypatch.setattr(module, "without_hold", lambda problem, sample, hold: hold)
    monkeypatch.setattr(module, "weighted_posterior", alone)
    return asked


def test_ratios_of_integrals_are_found_also_where_a_posterior_is_apart(
    pools: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """From one proposal, even one that is thirty standard deviations away."""
    asked = by_themselves(monkeypatch)
    elpd, settled = log_densities(Normals(), [(0, 0), (0, 1), (0, 2)], DRAWS, 7, ALL[:3])  # type: ignore[arg-type]
    assert settled.all() and elpd == pytest.approx(Normals.elpd, abs=0.15)
    assert pools == [4] and not asked


def test_no_search_bears_witness_where_nothing_is_doubtful(pools: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    asked = by_themselves(monkeypatch)
    seen: list[int] = []
    monkeypatch.setattr(
        module, "searches", lambda target, rng, n, readings: seen.append(n) or [SimpleNamespace(modes=None)] * n
    )
    for doubtful in ([False, True, True], [False] * 3):
        elpd, settled = log_densities(Normals(), [(0, 0), (0, 1), (0, 2)], DRAWS, 7, np.array(doubtful))  # type: ignore[arg-type]
        assert settled.all() and elpd == pytest.approx(Normals.elpd, abs=0.15)
    assert seen == [2] and not asked


@pytest.mark.parametrize(("share", "apart"), [(0.09, []), (0.11, [1]), (-0.09, []), (-0.11, [1])])
def test_what_a_further_search_contradicts_is_sampled_by_itself(
    share: float, apart: list[int], pools: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each density that weights settle is asked for what lies elsewhere, with the integral that was found for it."""
    asked, seen = by_themselves(monkeypatch), []

    def overlooked(left: object, pool: object, column: int, log_integral: float, others: object, rng: object) -> float:
        assert column == 1 + len(seen)
        seen.append(log_integral)
        return share if len(seen) == 2 else 0.0

    monkeypatch.setattr(module, "overlooked_share", overlooked)
    elpd, settled = log_densities(Normals(), [(0, 0), (0, 1), (0, 2)], DRAWS, 7, ALL[:3])  # type: ignore[arg-type]
    assert asked == apart and settled.all() and elpd == pytest.approx(Normals.elpd, abs=0.15)
    assert seen == pytest.approx(np.log(2.0 * np.pi) - np.array(Normals.elpd), abs=0.15)


def test_what_is_given_up_is_sampled_by_itself(pools: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    counted = importance.importance_sample

    def given_up(*given: object) -> importance.Weighted:
        return replace(counted(*given), settled=np.array([True, True, False, False]))  # type: ignore[arg-type]

    monkeypatch.setattr(importance, "importance_sample", given_up)
    for converged in (True, False):
        asked = by_themselves(monkeypatch, converged)
        elpd, settled = log_densities(Normals(), [(0, 0), (0, 1), (0, 2)], DRAWS, 7, ALL[:3])  # type: ignore[arg-type]
        assert asked == [1, 2] and settled.tolist() == [True, converged, converged]
        assert elpd == pytest.approx(Normals.elpd, abs=0.15)


@pytest.mark.parametrize("converged", [True, False])
def test_where_the_full_posterior_does_not_settle_it_is_sampled_by_itself(
    converged: bool, pools: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the doubtful holds, and no others; if it does not converge, nothing is settled."""
    monkeypatch.setattr(importance, "tail", lambda log_weight: 0.8)
    monkeypatch.setattr(importance, "_ROUNDS", 2)
    asked = by_themselves(monkeypatch, converged)
    doubtful = np.array([True, False, True])
    elpd, settled = log_densities(Normals(), [(0, 0), (0, 1), (0, 2)], DRAWS, 7, doubtful)  # type: ignore[arg-type]
    assert asked == [-1, 0, 2] and settled.tolist() == [converged, False, converged]
    assert elpd[doubtful] == pytest.approx(np.array(Normals.elpd)[doubtful])


@dataclass(frozen=True)
class Between(Problem):
    """The readings of the first hold count to a power only: 0 leaves them out, 1 is the full posterior."""

    power: float = 1.0

    def log_likelihood(self, theta: np.ndarray, readings: object = None) -> np.ndarray:
        whole, without = self.without_each_hold(theta)
        with np.errstate(all="ignore"):
            value = without[0][0] + self.power * (whole - without[0][0])
        return np.where(np.isfinite(value), value, -np.inf)

    def standardised(self, theta: np.ndarray, readings: object = None) -> tuple[np.ndarray, np.ndarray]:
        return self.log_likelihood(theta), super().standardised(theta)[1]


@pytest.mark.slow
@pytest.mark.statistical
@pytest.mark.parametrize("effects", [(), ("toe",)])
def test_a_hold_that_is_apart_agrees_with_thermodynamic_integration(effects: tuple[str, ...]) -> None:
    """The kite line's first hold, by posteriors at eight powers of its density, neighbours bridged.

    With a toe the posterior without it has a mode that draws with it never see: five nats.
    """
    policy = Policy(walkers=64, round_draws=2048, ess=4000.0)
    problem = build([experiments()[3]], [effect_named(name) for name in effects])
    powers = [0.0, 0.003, 0.01, 0.03, 0.1, 0.3, 0.6, 1.0]
    log_p = []
    for power in powers:
        same = {f.name: getattr(problem, f.name) for f in fields(Problem)}
        target = LogPosterior(Between(**same, power=power))
        z = ensemble.sample_posterior(target, 1, policy).z
        theta = target.coordinates.to_natural(z.reshape(-1, z.shape[-1]))
        log_p.append(problem.leave_one_hold_out(theta)[0][0])
    steps = zip(np.diff(powers), log_p[:-1], log_p[1:], strict=True)
    expected = sum(log_mean(step * low, step * high)[0] for step, low, high in steps)
    fitted = fit_problem(problem, 1, policy=Policy(walkers=64, round_draws=2048, ess=2000.0))
    found = [smoothed_leave_one_hold_out(fitted, seed).elpd[0] for seed in (1, 2, 3)]
    print(f"log density of the hold: {expected:.2f} by integration, {np.round(found, 2).tolist()} found")
    # draws of both ways know the density to some 0.15
    assert np.mean(found) == pytest.approx(expected, abs=0.3)


@pytest.mark.parametrize("likelihood", ["chain", "hold"])
def test_searches_see_all_holds_but_one(likelihood: Literal["chain", "hold"]) -> None:
    """The density that each climbs is that of the problem without the readings of its hold, and so are residuals."""
    problem, holds = build(experiments()[:2], spec=ModelSpec(likelihood=likelihood)), [(0, 3), (1, 0), (1, 9)]
    target = LogPosterior(problem)
    density, residuals = target.rowwise(module.without_holds(problem, holds))
    z = target.coordinates.to_sampled(problem.prior.rvs(5, np.random.default_rng(0)))
    for m, (s, j) in enumerate(holds):
        left = copy(target)
        left.problem = module.without_hold(problem, s, j)
        rows = np.full(len(z), m)
        value, every = residuals(z, rows)
        assert density(z, rows) == pytest.approx(left(z), rel=1e-12) and value == pytest.approx(left(z), rel=1e-12)
        # residuals of the hold that is not seen are there, and nothing
        other = left.standardised(z)[1]
        assert every[np.abs(every).max(axis=1) > 0] == pytest.approx(other[np.abs(other).max(axis=1) > 0], rel=1e-12)
    assert not np.allclose(density(z, np.zeros(5, int)), density(z, np.ones(5, int)))
