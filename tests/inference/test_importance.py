"""Integrals of several densities from one pool, against normals whose integrals are known."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from wirebayes.inference import importance
from wirebayes.inference.importance import Weighted, effective, expected, from_draws, importance_sample, tail
from wirebayes.inference.sampler import proposal
from wirebayes.inference.sampler.mixture import Mixture
from wirebayes.inference.sampler.points import WeightedPoints
from wirebayes.inference.sampler.settings import EXPLORING_SHARES, ROUGH_SHARES, SHARES

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
    return importance_sample(densities, start(*centres), rng.normal(size=(1000, D)), ORDER, rng, ess)  # type: ignore[arg-type]


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

    assert pool(counted, 0, 0.0).settled.tolist() == [True, True, False] and sum(few) < 26_000
    few.clear()
    monkeypatch.setattr(importance, "_PATIENCE", 99)
    assert not pool(counted, 0, 0.0).settled[2] and len(few) == importance._ROUNDS + 1


def test_the_first_density_is_not_given_up() -> None:
    few = []

    def counted(z: np.ndarray) -> np.ndarray:
        few.append(len(z))
        return far(z)[:, [2, 0, 1]]

    assert not pool(counted, 0, 0.0).settled[0] and len(few) == importance._ROUNDS + 1


@pytest.mark.parametrize(("needed", "settled"), [(47_999, True), (48_001, False)])
def test_a_density_that_seems_to_need_too_many_draws_is_given_up(
    needed: float, settled: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The third density is good enough only after the rounds in which none is given up, of 16,000 draws at most."""
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
    monkeypatch.setattr(importance, "_PATIENCE", 2)
    assert pool(counted, 0, 0.0, 7.0).settled[2] == settled
    assert importance._WITHIN_REACH == 48_000 and drawn[-1] == (16_000 if settled else 4096)


@pytest.mark.parametrize(("k", "settled"), [(0.69, True), (0.71, False), (np.nan, False)])
def test_weights_with_a_heavy_tail_do_not_settle(k: float, settled: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importance, "tail", lambda log_weight: k)
    monkeypatch.setattr(importance, "_ROUNDS", 4)
    assert pool(three, 0, 0.0, 7.0).settled.tolist() == [settled] * 3


def test_tails_are_fitted_of_the_first_density_and_of_those_not_settled_before(monkeypatch: pytest.MonkeyPatch) -> None:
    fitted = []

    def light(log_weight: np.ndarray) -> float:
        fitted.append(log_weight)
        return 0.0

    monkeypatch.setattr(importance, "tail", light)
    before = np.array([True, True, False])
    fresh = importance._weighted(three, start(0.0, 7.0), 4000, 1.0, np.random.default_rng(0), before)
    assert len(fitted) == 2 and fresh.settled.tolist() == [True, False, True]


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
        fresh = importance._weighted(two_hills, current, 4000, 500.0, rng, np.zeros(1, bool))
        promised = expected(fresh, witness, two_hills(witness)[:, 0])
        own = effective(fresh.log_weight)[0]
        assert own > 1000 and fresh.settled[0]
        assert promised < 1e-6 * own if misses else promised == pytest.approx(own, rel=0.2)


@pytest.mark.parametrize(("promised", "settled"), [(249.0, False), (251.0, True)])
def test_half_of_the_effective_draws_must_be_promised(
    promised: float, settled: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(importance, "expected", lambda *given: promised)
    assert pool(three, 0, 0.0, 7.0).settled.tolist() == [settled] * 3  # the others are known as ratios to it


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


def test_a_tail_that_is_nowhere_is_no_number_and_the_lighter_estimate_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    assert np.isnan(tail(np.full(5, -np.inf)))
    asked: list[tuple[list[float], float]] = []
    answers: dict[float, float] = {}

    def smoothed(log_ratio: np.ndarray, independent: float) -> tuple[None, float]:
        asked.append((log_ratio.tolist(), independent))
        return None, answers[independent]

    monkeypatch.setattr(importance, "pareto_smoothed", smoothed)
    for first, second, found in ((0.9, 0.4, 0.4), (0.4, 0.9, 0.4), (np.nan, 0.8, 0.8), (0.8, np.nan, 0.8)):
        answers.update({1.0: first, 9.0: second})
        assert tail(np.array([1.0, -np.inf, 3.0])) == found
    assert asked[:2] == [([1.0, 3.0], 1.0), ([1.0, 3.0], 9.0)]


def weighted(log_density: np.ndarray, log_proposal: np.ndarray) -> Weighted:
    """What a proposal gives that draws the places 0, 1, 2 and so on."""
    places = np.arange(float(len(log_proposal)))[:, None]
    current = SimpleNamespace(rvs=lambda n, rng: places, log_density=lambda z: log_proposal)
    rng, settled = np.random.default_rng(0), np.zeros(log_density.shape[1], bool)
    return importance._weighted(lambda z: log_density, current, len(places), 1e9, rng, settled)  # type: ignore[arg-type]


def test_the_integral_is_the_mean_weight() -> None:
    """Of each density, whatever the others are; a draw without density counts among the draws."""
    weight = np.array([[1.0, 5.0], [2.0, 0.0], [6.0, 1.0]])
    log_proposal = np.array([0.5, -1.0, 2.0])
    with np.errstate(divide="ignore"):
        one = weighted(np.log(weight) + log_proposal[:, None], log_proposal)
    assert np.exp(one.log_integral) == pytest.approx([3.0, 2.0])
    assert np.exp(one.log_ratio) == pytest.approx([1.0, 2.0 / 3.0])
    assert np.exp(one.log_weight[[0, 2]]) == pytest.approx(weight[[0, 2]])


def test_an_integral_is_that_of_the_round_which_settled_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Later rounds are for the other densities: of the first one, a single draw of theirs may weigh more than all."""
    rounds = [([True, False], [1.0, 9.0]), ([False, False], [7.0, 8.0]), ([True, True], [3.0, 5.0])]

    def given(densities: object, current: object, n: int, *more: object) -> Weighted:
        settled, log_integral = (np.array(of) for of in rounds[len(made)])
        made.append(n)
        true = drawn(densities, current, n, *more)
        return replace(true, settled=settled, log_integral=log_integral, log_ratio=log_integral - log_integral[0])

    made: list[int] = []
    drawn = importance._weighted
    monkeypatch.setattr(importance, "_weighted", given)
    found = pool(lambda z: three(z)[:, :2], 0, 0.0, 7.0)
    assert len(made) == 3 and found.settled.all()
    assert found.log_integral.tolist() == [1.0, 5.0] and found.log_ratio.tolist() == [0.0, 2.0]


def test_what_other_draws_promise_is_the_effective_number_of_draws_of_the_proposal() -> None:
    """All draws over the mean of the normalised weight at draws of the density; never more than all."""
    fresh = weighted(np.full((1000, 1), 2.0), np.zeros(1000))
    fresh = replace(fresh, proposal=SimpleNamespace(log_density=lambda z: z[:, 0]))  # type: ignore[arg-type]
    over = np.array([[0.0], [1.0], [-2.0]])  # of the witnesses, in nats above the integral, which is e²
    height = over[:, 0] + 2.0 + np.array([3.0, 4.0, 5.0])
    witness = np.array([[3.0], [4.0], [5.0]])
    assert expected(fresh, witness, height) == pytest.approx(1000.0 / np.exp(over).mean())
    assert expected(fresh, witness, height - 9.0) == expected(fresh, witness[:0], height[:0]) == 1000.0


def past(log_density: np.ndarray, log_proposals: np.ndarray, counts: tuple[int, ...]) -> importance._Past:
    z = np.arange(len(log_density), dtype=float)[:, None]
    return importance._Past(z, log_density, log_proposals, (start(0.0),) * len(counts), counts)


def test_all_draws_so_far_are_weighed_against_the_mixture_they_came_from() -> None:
    """Two places; the first is as often as 3 x 1 + 1 x 5 = 8, the second as 3 x 1 + 1 x 1 = 4: twice the weight."""
    places = np.repeat([0.0, 1.0], 400)
    density = np.where(places == 0.0, np.log(3.0), 0.0)[:, None]
    of = np.log(np.stack([np.ones(800), np.where(places == 0.0, 5.0, 1.0)]))
    known = importance._Past(places[:, None], density, of, (start(0.0),) * 2, (3, 1))
    hot, cold = (np.average(each.z[:, 0], weights=each.weight) for each in known.points(np.ones(1, bool), 1e9))
    assert cold == pytest.approx(1.0 / (1.0 + 3.0 * 0.5))
    assert hot == pytest.approx(1.0 / (1.0 + 3.0**0.4 * 0.5))


@pytest.mark.parametrize(
    ("ess", "wanted", "second"),
    [
        (40.0, [True, True], 1.0 / 2.0),  # both are known well enough: the same share
        (400.0, [True, True], 8.0 / 10.0),  # 200 and 50 effective draws: 2 and 8 shares
        (2000.0, [True, True], 10.0 / 20.0),  # ten shares at most
        (400.0, [False, True], 1.0),
        (400.0, [True, False], 0.0),
    ],
)
def test_a_density_that_is_known_worse_has_a_greater_share(ess: float, wanted: list[bool], second: float) -> None:
    """Two densities that have no place in common, on 200 and on 50 of the draws, and a third that is nowhere."""
    at = np.arange(250) < 200
    with np.errstate(divide="ignore"):
        density = np.log(np.column_stack([at * 7.0, ~at * 1.0, np.zeros(250)]))
    _, cold = past(density, np.zeros((1, 250)), (250,)).points(np.array([*wanted, True]), ess)
    # a place of the second density has its share over 50, bounded by the root of all rows
    assert np.average(cold.z[:, 0] >= 200, weights=cold.weight) == pytest.approx(second)


def test_the_draws_of_one_more_proposal_are_known_to_all_of_them() -> None:
    """Every point is weighed by every proposal, old points by the new one too."""
    one, other = start(0.0), start(3.0)
    rng = np.random.default_rng(0)
    first, second = (importance._weighted(three, q, n, 1e9, rng, np.zeros(1, bool)) for q, n in ((one, 4), (other, 3)))
    known = importance._Past.first(first).joined(second)
    z = np.vstack([first.z, second.z])
    assert np.array_equal(known.z, z) and known.counts == (4, 3) and known.proposals == (one, other)
    assert known.log_density == pytest.approx(three(z))
    assert known.log_proposals == pytest.approx(np.stack([one.log_density(z), other.log_density(z)]))


def test_a_proposal_is_learned_as_a_close_one_of_few_points(monkeypatch: pytest.MonkeyPatch) -> None:
    """With what the start knows while nothing else is sure, from the mixtures before where there are some."""
    asked: list[tuple[object, dict[str, object]]] = []
    new = SimpleNamespace()

    def fit(
        hot: object, cold: object, begin: object, order: object, rng: object, shares: object, **more: object
    ) -> object:
        asked.append((shares, more))
        if len(asked) == 3:
            raise np.linalg.LinAlgError("no")
        return new

    monkeypatch.setattr(proposal, "fit_proposal", fit)
    begin, z, rng = start(0.0), WeightedPoints.equal(np.zeros((4, D))), np.random.default_rng(0)
    before = proposal.Proposal(SHARES, None, begin, begin, begin, begin)  # type: ignore[arg-type]
    assert importance._learned(z, z, begin, ORDER, rng, begin) is new
    assert importance._learned(z, z, begin, ORDER, rng, before) is new
    assert importance._learned(z, z, begin, ORDER, rng, before) is before  # points that span nothing
    few = {"most": 8, "points": 2500, "along_tails": False}
    assert asked[:2] == [
        (ROUGH_SHARES, {**few, "before": None}),
        (EXPLORING_SHARES, {**few, "before": before}),
    ]


def test_climbs_begin_at_the_highest_draws_and_at_some_that_are_far_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    """In units of the widths, for coordinates have units of their own; a highest one for every density."""
    rng = np.random.default_rng(0)
    draws = np.column_stack([1e3 * rng.normal(size=5000), np.zeros(5000), np.full(5000, 4.0)])
    draws[17, 1] = 1e-3  # far from the others, for this coordinate
    begun: list[np.ndarray] = []
    heights: list[np.ndarray] = []

    def densities(z: np.ndarray) -> np.ndarray:
        return np.column_stack([-z[:, 0], z[:, 1]])

    def climb(density: object, z: np.ndarray, **known: object) -> None:
        begun.append(z)
        heights.append(density(z, np.arange(len(z))))  # type: ignore[operator]
        assert known == {"iterations": 40, "tolerance": 1e-2}
        raise InterruptedError

    monkeypatch.setattr(importance, "climb", climb)
    with pytest.raises(InterruptedError):
        from_draws(densities, draws, np.arange(3), rng, 500.0)
    (z,) = begun
    assert len(z) == 2 + 6 and z[0, 0] == draws[:, 0].min() and z[1].tolist() == draws[17].tolist()
    assert 1e-3 in z[2:, 1]
    # the second climb is on the second density, all the others on the first
    assert heights[0].tolist() == [-z[0, 0], 1e-3, *(-z[2:, 0])]


def test_modes_are_widened_and_rough_draws_handed_on(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[tuple[object, ...]] = []
    monkeypatch.setattr(importance, "importance_sample", lambda *arguments: given.append(arguments))
    draws = np.random.default_rng(0).normal(size=(200, D))
    rng = np.random.default_rng(1)
    from_draws(lambda z: normal(z, 0.0, 2.0, 0.0)[:, None], draws, ORDER, rng, 77.0)
    _, begin, known, order, _, ess = given[0]
    assert begin.centres == pytest.approx(np.zeros((1, D)), abs=0.05)  # type: ignore[attr-defined]
    scale = begin.factors[0] @ begin.factors[0].T  # type: ignore[attr-defined]
    assert scale == pytest.approx(1.7 * 4.0 * np.eye(D), rel=0.01, abs=0.01)
    assert known is draws and order is ORDER and ess == 77.0
