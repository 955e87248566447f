"""Integrals of several densities from one pool, against normals whose integrals are known."""

import numpy as np
import pytest
from scipy import stats

from wirebayes.inference import importance
from wirebayes.inference.importance import Weighted, effective, expected, from_draws, sample, tail
from wirebayes.inference.sampler.mixture import Mixture

D = 4
ORDER = np.arange(D)


def start(*centres: float) -> Mixture:
    """A unit component at each centre, the same in all coordinates."""
    k = len(centres)
    return Mixture(np.full(k, 1 / k), np.outer(centres, np.ones(D)), np.repeat(np.eye(D)[None], k, axis=0))


def normal(z: np.ndarray, centre: float, width: float, log_integral: float) -> np.ndarray:
    away = (z - centre) / width
    return log_integral - 0.5 * (away**2).sum(axis=1) - D * np.log(width * np.sqrt(2.0 * np.pi))


def three(z: np.ndarray) -> np.ndarray:
    """A standard normal, one of two hills far apart, and a wide one."""
    hills = np.logaddexp(normal(z, 0.0, 1.0, np.log(0.8)), normal(z, 7.0, 0.5, np.log(0.2)))
    return np.column_stack([normal(z, 0.0, 1.0, 0.0), hills + 5.0, normal(z, 1.0, 2.0, -40.0)])


def pool(densities: object, seed: int, *centres: float, ess: float = 500.0) -> Weighted:
    rng = np.random.default_rng(seed)
    return sample(densities, start(*centres), rng.normal(size=(1000, D)), np.empty((0, D)), ORDER, rng, ess)  # type: ignore[arg-type]


def test_integrals_are_found_within_the_error_of_the_effective_draws() -> None:
    """The log of an integral is known to 1 / sqrt(ess) at worst; 16 pools have errors that fit it."""
    pools = [pool(three, seed, 0.0, 7.0) for seed in range(16)]
    assert all(p.settled.all() for p in pools)
    errors = np.array([(p.log_integral - [0.0, 5.0, -40.0]) * np.sqrt(effective(p.log_weight)) for p in pools])
    assert (np.abs(errors.mean(axis=0)) < 4.0 / np.sqrt(16)).all() and (errors.std(axis=0) < 1.6).all()
    assert np.mean([len(p.z) for p in pools]) < 12_000


def test_draws_of_the_pool_follow_each_density() -> None:
    one = pool(three, 0, 0.0, 7.0, ess=4000.0)
    rng = np.random.default_rng(1)
    for density, beyond in enumerate([0.0, 0.2, 0.0]):
        far = one.drawn(density, 4000, rng)[:, 0] > 5.0
        # beyond 5 lies 2.3 % of the wide normal
        assert far.mean() == pytest.approx(beyond + (0.0228 if density == 2 else 0.0), abs=0.02)
    assert stats.kstest(one.drawn(0, 2000, rng)[:, 2], "norm").pvalue > 1e-3


def test_a_hill_that_only_the_start_reaches_is_learned() -> None:
    """Rough points know nothing of it, and it has a fifth of the density."""
    found = pool(lambda z: three(z)[:, 1:2], 3, 0.0, 7.0)
    without = pool(lambda z: three(z)[:, 1:2], 3, 0.0)
    assert found.log_integral[0] == pytest.approx(5.0, abs=0.15)
    assert without.log_integral[0] == pytest.approx(5.0 + np.log(0.8), abs=0.15)  # nothing led there


def far(z: np.ndarray) -> np.ndarray:
    """Two normals that overlap and a narrow one far away, which nothing leads to."""
    return np.column_stack([three(z)[:, 0], three(z)[:, 2], normal(z, 12.0, 0.02, 0.0)])


def test_a_density_that_would_take_too_many_draws_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    few = []

    def counted(z: np.ndarray) -> np.ndarray:
        few.append(len(z))
        return far(z)

    assert pool(counted, 0, 0.0).settled.tolist() == [True, True, False] and sum(few) < 16_000
    few.clear()
    monkeypatch.setattr(importance, "_AFFORDABLE", 1e9)
    assert not pool(counted, 0, 0.0).settled[2] and len(few) == importance._ROUNDS + 2


@pytest.mark.parametrize("order", [[2, 0, 1], [0, 2]])
def test_the_first_density_and_one_of_two_are_not_given_up(order: list[int]) -> None:
    few = []

    def counted(z: np.ndarray) -> np.ndarray:
        few.append(len(z))
        return far(z)[:, order]

    assert not pool(counted, 0, 0.0).settled[order.index(2)] and len(few) == importance._ROUNDS + 2


@pytest.mark.parametrize(("needed", "settled"), [(15_999, True), (16_001, False)])
def test_too_many_draws_are_more_than_those_that_can_be_afforded(
    needed: float, settled: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The third density is good enough only after the rounds in which none is given up."""
    drawn: list[int] = []
    true = importance.effective

    def found(log_weight: np.ndarray) -> np.ndarray:
        poor = importance._RESERVE * len(log_weight) * 500.0 / needed
        late = len(log_weight) > 6000
        return np.append(true(log_weight)[:2], 1000.0 if late else poor)

    def counted(z: np.ndarray) -> np.ndarray:
        drawn.append(len(z))
        return three(z)[:, [0, 2, 1]]

    monkeypatch.setattr(importance, "effective", found)
    assert pool(counted, 0, 0.0, 7.0).settled[2] == settled
    assert importance._AFFORDABLE == 16_000 and (drawn[-1] > 6000) == settled


@pytest.mark.parametrize(("k", "settled"), [(0.69, True), (0.71, False), (np.nan, False)])
def test_weights_with_a_heavy_tail_do_not_settle(k: float, settled: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importance, "tail", lambda log_weight: k)
    monkeypatch.setattr(importance, "_ROUNDS", 4)
    assert pool(three, 0, 0.0, 7.0).settled.tolist() == [settled] * 3


def two_hills(z: np.ndarray) -> np.ndarray:
    return three(z)[:, 1:2] - 5.0


def exact(n: int, rng: np.random.Generator) -> np.ndarray:
    """Draws of the two hills."""
    far = rng.uniform(size=(n, 1)) < 0.2
    return np.where(far, 7.0, 0.0) + np.where(far, 0.5, 1.0) * rng.normal(size=(n, D))


def test_other_draws_tell_of_a_hill_that_a_proposal_misses() -> None:
    """Its own weights are all alike, and promise far more."""
    rng = np.random.default_rng(2)
    witness = exact(1000, rng)
    good, blind = start(0.0, 7.0), start(0.0)
    for current, misses in ((good, False), (blind, True)):
        fresh = importance._weighted(two_hills, current, 4000, 500.0, rng)
        promised = expected(fresh, current, witness, two_hills(witness)[:, 0])
        own = effective(fresh.log_weight)[0]
        assert own > 1000 and fresh.settled[0]
        assert promised < 1e-6 * own if misses else promised == pytest.approx(own, rel=0.2)


@pytest.mark.parametrize(("promised", "settled"), [(249.0, False), (251.0, True)])
def test_half_of_the_effective_draws_must_be_promised(
    promised: float, settled: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(importance, "expected", lambda *given: promised)
    assert pool(three, 0, 0.0, 7.0).settled.tolist() == [settled, True, True]


def test_from_draws_every_hill_is_climbed() -> None:
    """A thousandth of the draws lie on the second hill, which has a fifth of the density."""
    rng = np.random.default_rng(4)
    draws = exact(5000, rng)
    draws = np.concatenate([draws[draws[:, 0] < 4.0], draws[draws[:, 0] > 4.0][:4]])
    found = from_draws(two_hills, draws, ORDER, rng, 500.0)
    assert found.settled[0] and found.log_integral[0] == pytest.approx(0.0, abs=0.15)


def test_places_of_no_density_do_no_harm() -> None:
    def half(z: np.ndarray) -> np.ndarray:
        value = normal(z, 0.0, 1.0, 0.0)
        inside = np.where(z[:, 0] > 0, value, -np.inf)
        return np.column_stack([inside, inside, np.full(len(z), -np.inf)])

    one = pool(half, 0, 0.0)
    assert one.log_integral[:2] == pytest.approx([np.log(0.5)] * 2, abs=0.1)
    assert one.settled.tolist() == [True, True, False]


def test_effective_draws_and_tails() -> None:
    weight = np.log(np.array([[1.0, 3.0, 0.0], [1.0, 1.0, 0.0]]) + 1e-320)
    assert effective(weight)[:2] == pytest.approx([2.0, 1.6])
    assert effective(np.full((5, 1), -np.inf)) == 0.0
    rng = np.random.default_rng(0)
    for k in (0.3, 0.9):
        assert tail(np.log(stats.genpareto.rvs(k, size=20_000, random_state=rng))) == pytest.approx(k, abs=0.1)
