"""Posteriors by importance sampling: a hill that nothing led to has to be found, or the posterior refused."""

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from wirebayes.inference import importance
from wirebayes.inference import weighted_posterior as module
from wirebayes.inference.optimum import Optimum
from wirebayes.inference.weighted_posterior import overlooked_share, weighted_posterior, witnessed
from wirebayes.io.paper import experiments
from wirebayes.model.build import build

D = 4
TENTH = np.log([0.9, 0.1])  # of the mass, each in units of which it is normal
CENTRES, WIDTHS = np.array([0.0, 9.0]), np.array([1.0, 0.5])


def two_hills(z: np.ndarray) -> np.ndarray:
    """A normal with nine tenths of the mass, and a tenth far away."""
    away = (z[:, None] - CENTRES[:, None]) / WIDTHS[:, None]
    return np.logaddexp.reduce(TENTH - 0.5 * (away**2).sum(axis=2) - D * np.log(WIDTHS * np.sqrt(2.0 * np.pi)), axis=1)


def target() -> SimpleNamespace:
    class Density(SimpleNamespace):
        def __call__(self, z: np.ndarray) -> np.ndarray:
            return two_hills(z)

    return Density(coordinates=SimpleNamespace(order=np.arange(D)))


def modes(*which: int) -> Optimum:
    """Those hills of the two, the best first."""
    z = np.repeat(CENTRES[list(which), None], D, axis=1)
    curvature = np.eye(D) / WIDTHS[list(which), None, None] ** 2
    return Optimum(z, two_hills(z), curvature, np.ones(len(which), bool))


def searching(monkeypatch: pytest.MonkeyPatch, *found: tuple[int, ...]) -> Callable[[], int]:
    """Searches find these hills, one after the other, the last of them from then on; how many were made."""
    made: list[tuple[int, ...]] = []

    def searches(target: object, rng: np.random.Generator, n: int, starts: int) -> list[Optimum]:
        assert starts == 72
        first = len(made)
        made.extend(found[min(first + i, len(found) - 1)] for i in range(n))
        return [modes(*which) for which in made[first:]]

    monkeypatch.setattr(module, "searches", searches)
    return lambda: len(made)


def test_importance_sampling_alone_loses_a_hill_in_silence(monkeypatch: pytest.MonkeyPatch) -> None:
    """What the witness is for: the weights are good, and a tenth of the mass is missing."""
    monkeypatch.setattr(module, "overlooked_share", lambda *given: 0.0)
    searching(monkeypatch, (0,))
    pool = witnessed(target(), np.random.default_rng(0), 1000.0)  # type: ignore[arg-type]
    assert pool.settled[0] and pool.log_integral[0] == pytest.approx(np.log(0.9), abs=0.03)
    assert importance.tail(pool.log_weight[:, 0]) < 0.5


@pytest.mark.parametrize("seed", range(4))
def test_a_hill_that_another_search_finds_is_learned(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    made = searching(monkeypatch, (0,), (0, 1))
    pool = witnessed(target(), np.random.default_rng(seed), 1000.0)  # type: ignore[arg-type]
    assert made() == 3 and pool.settled[0]
    assert pool.log_integral[0] == pytest.approx(0.0, abs=0.1)
    share = (pool.drawn(0, 4000, np.random.default_rng(1))[:, 0] > 5.0).mean()
    assert share == pytest.approx(0.1, abs=0.03)


def test_what_searches_contradict_again_and_again_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """The proposal never learns of the hill, whatever it starts from."""
    made = searching(monkeypatch, (0,), (0, 1))
    monkeypatch.setattr(importance, "widened", lambda found, widened=importance.widened: widened(modes(0)))
    looked = [1.0, -0.051, 0.051]
    monkeypatch.setattr(module, "overlooked_share", lambda *given: looked.pop(0))
    assert not witnessed(target(), np.random.default_rng(0), 1000.0).settled[0]  # type: ignore[arg-type]
    assert made() == 4 and not looked


def test_what_weights_do_not_settle_is_refused_whatever_the_witness_says(monkeypatch: pytest.MonkeyPatch) -> None:
    made = searching(monkeypatch, (0,))
    monkeypatch.setattr(importance, "tail", lambda log_weight: 0.8)
    assert not witnessed(target(), np.random.default_rng(0), 1000.0).settled[0]  # type: ignore[arg-type]
    assert made() == 4


@pytest.mark.parametrize(("heavy", "settled", "searches"), [(1, True, 3), (2, True, 4), (3, False, 4)])
def test_what_weights_do_not_settle_is_learned_twice_more(
    heavy: int, settled: bool, searches: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = searching(monkeypatch, (0, 1))
    learned = importance.importance_sample
    tries: list[int] = []

    def sample(*given: object) -> importance.Weighted:
        tries.append(len(given[2]))  # type: ignore[arg-type]
        pool = learned(*given)  # type: ignore[arg-type]
        return replace(pool, settled=np.array([len(tries) > heavy]))

    monkeypatch.setattr(importance, "importance_sample", sample)
    assert witnessed(target(), np.random.default_rng(0), 1000.0).settled[0] == settled  # type: ignore[arg-type]
    assert made() == searches and tries == [0, 4000, 4000][: len(tries)]


def test_the_share_overlooked_is_the_mass_of_places_that_are_hardly_drawn() -> None:
    """A tenth over nine tenths; nothing where both hills are drawn, or the one that is not is not known."""
    rng = np.random.default_rng(3)

    def share(drawn: tuple[int, ...], others: tuple[int, ...]) -> float:
        pool = importance._weighted(
            lambda z: two_hills(z)[:, None], importance.widened(modes(*drawn)), 20_000, 1000.0, rng, np.zeros(1, bool)
        )
        known = importance.widened(modes(*others))
        return overlooked_share(target(), pool, 0, float(pool.log_integral[0]), known, rng)  # type: ignore[arg-type]

    assert share((0,), (0, 1)) == pytest.approx(1.0 / 9.0, rel=0.3)
    assert share((0, 1), (0, 1)) < 0.01 and share((0,), (0,)) < 0.01


def test_what_few_draws_of_great_weight_made_of_a_hill_is_not_overlooked() -> None:
    """A tenth of the mass in one of 600 draws: the integral has it, if roughly; draws of both proposals know better."""
    rng = np.random.default_rng(4)
    seldom = replace(importance.widened(modes(0, 1)), weights=np.array([599.0, 1.0]) / 600.0)
    of_hill, missing = [], []
    for _ in range(12):
        pool = importance._weighted(lambda z: two_hills(z)[:, None], seldom, 20_000, 1.0, rng, np.zeros(1, bool))
        share = np.exp(pool.log_weight[:, 0])[pool.z[:, 0] > 5.0].sum() / 20_000
        of_hill.append(share)
        integral = float(pool.log_integral[0])
        missing.append(overlooked_share(target(), pool, 0, integral, importance.widened(modes(1)), rng))  # type: ignore[arg-type]
    assert np.std(of_hill) > 0.01
    assert np.array(of_hill) + missing * (0.9 + np.array(of_hill)) == pytest.approx(np.full(12, 0.1), abs=0.01)


def test_a_mode_that_half_the_searches_miss_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """Eight holds of the kite line have two modes, and the first search is made to miss the one with more mass.

    Without a witness some machines find it, too: what learned proposals reach depends on the last digits.
    """
    problem = build([experiments()[3].train(8)])
    true, made = module.searches, []

    def searches(target: object, rng: np.random.Generator, n: int, starts: int) -> list[Optimum]:
        first, *others = true(target, rng, n, starts=starts)  # type: ignore[arg-type]
        made.extend(len(found.z) for found in (first, *others))
        return [first if len(made) > n else first.rows([1]), *others]

    whole = weighted_posterior(problem, 0, 1000.0)
    monkeypatch.setattr(module, "searches", searches)
    found = weighted_posterior(problem, 0, 1000.0)
    assert whole.converged and found.converged and made[0] == 2
    assert found.log_evidence == pytest.approx(whole.log_evidence, abs=0.05)


def test_draws_are_of_the_whole_problem_and_follow_the_weights(monkeypatch: pytest.MonkeyPatch) -> None:
    searching(monkeypatch, (0, 1))
    names = tuple("abcd")
    identity = SimpleNamespace(to_natural=lambda z: z + 100.0, order=np.arange(D))

    class Density(SimpleNamespace):
        def __call__(self, z: np.ndarray) -> np.ndarray:
            return two_hills(z)

    monkeypatch.setattr(module, "integrated", lambda problem: problem)
    monkeypatch.setattr(module, "LogPosterior", lambda problem: Density(problem=problem, coordinates=identity))
    problem = SimpleNamespace(names=names, own_units=None, units=None, theta_in=lambda units, theta: theta)
    problem.log_units = lambda other: [np.array([2.0, 1.0])]  # densities are larger by so much in its own units
    problem.in_units = lambda units: problem
    one = weighted_posterior(problem, 1, 1000.0)  # type: ignore[arg-type]
    assert one.problem is problem and one.flat.shape == (4000, D) and one.converged
    near = one.flat[one.flat[:, 1] < 105.0][:, 1]
    assert len(near) == pytest.approx(3600, abs=120) and stats.kstest(near[:400] - 100.0, "norm").pvalue > 1e-3
    assert one.log_evidence == pytest.approx(-3.0, abs=0.1)
    assert one.why.startswith("importance sampling: ") and " effective draws of " in one.why
    assert np.array_equal(weighted_posterior(problem, 1, 1000.0).flat, one.flat)  # type: ignore[arg-type]
