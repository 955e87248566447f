"""The map that straightens, what is drawn through it, and the search for modes behind it."""

import emcee
import numpy as np
import pytest
from scipy import stats

from tests.statistical.targets import two_modes
from wirebayes.inference import modes
from wirebayes.inference.policy import Policy
from wirebayes.inference.sampler import burn_in, mixture, moves, proposal, transport_map
from wirebayes.inference.sampler.points import WeightedPoints
from wirebayes.inference.sampler.settings import EXPLORING_SHARES, OUTWEIGHS, ROUGH_SHARES, SHARES
from wirebayes.inference.sampler.state import BurnIn


def crescent(n, rng):
    """x2 bends with the square of x0 and is the wider, the larger x1."""
    x = rng.normal(size=(n, 3))
    x[:, 2] = 2.0 + x[:, 0] ** 2 + np.exp(0.4 * x[:, 1]) * x[:, 2]
    return x


@pytest.fixture(scope="module")
def points():
    return crescent(6000, np.random.default_rng(1))


def test_a_crescent_becomes_a_heap_within_the_points_and_beyond(points):
    straight = transport_map.fit_map(WeightedPoints.equal(points), np.arange(3))
    u, _ = straight.forward(crescent(6000, np.random.default_rng(2)))
    assert np.abs(np.cov(u.T) - np.eye(3)).max() < 0.1
    assert abs(np.corrcoef(u[:, 2], points[:, 0] ** 2)[0, 1]) < 0.05
    far = np.array([[4.5, 0.0, 2.0 + 4.5**2]])
    assert abs(straight.forward(far)[0][0, 2]) < 2.0


@pytest.mark.parametrize("order", [[0, 1, 2], [1, 0, 2], [2, 0, 1], [1, 2, 0]])
@pytest.mark.parametrize("by_shares", [False, True])
def test_the_map_has_an_inverse_and_the_jacobian_it_says(points, share_points, by_shares, order):
    known, scores = (share_points, [0]) if by_shares else (points, [])
    straight = transport_map.fit_map(WeightedPoints.equal(known), np.array(order), scores)
    x = np.vstack([known[:20], 2.5 * known[:20]])
    u, jacobian = straight.forward(x)
    assert straight.inverse(u) == pytest.approx(x, rel=1e-9, abs=1e-9)
    h = 1e-6
    moved = [(straight.forward(x + h * e)[0] - straight.forward(x - h * e)[0]) / (2 * h) for e in np.eye(3)]
    assert np.linalg.slogdet(np.moveaxis(moved, 0, 2))[1] == pytest.approx(jacobian, abs=1e-4)


def of_a_share(n, rng):
    """The score of a share that may be nothing, and two that follow the share, one narrow."""
    share = stats.truncnorm(-0.11 / 0.06, np.inf, 0.11, 0.06).rvs(n, random_state=rng)
    wide = rng.normal(size=n)
    narrow = 1.5 * share + 0.2 * wide * share + 0.003 * rng.normal(size=n)
    return np.column_stack([stats.norm.ppf(share), wide, narrow])


@pytest.fixture(scope="module")
def share_points():
    return of_a_share(6000, np.random.default_rng(4))


def test_what_follows_a_share_is_straight_where_the_share_is_next_to_nothing(share_points):
    known = WeightedPoints.equal(share_points)
    straight = transport_map.fit_map(known, np.arange(3), [0])
    score = np.array([-3.0, -4.0, -6.0])
    share = stats.norm.cdf(score)
    at = np.column_stack([score, np.zeros(3), 1.5 * share])
    u, _ = straight.forward(at)
    assert np.abs(u[:, 2]).max() < 0.5
    without, _ = transport_map.fit_map(known, np.arange(3)).forward(at)
    assert abs(without[-1, 2]) > 5.0  # by the score the mean goes on where nothing changes any more


def test_a_cloud_without_bends_gets_none():
    straight = transport_map.fit_map(
        WeightedPoints.equal(np.random.default_rng(3).normal(size=(4000, 6))), np.arange(6)
    )
    assert not straight.quadratic.any()


def test_what_is_skewed_becomes_even():
    rng = np.random.default_rng(6)
    own = 1.0 + 2.0 * np.sinh(np.arcsinh(rng.normal(size=20000)) + 0.7)
    x = np.column_stack([own, stats.gamma(2.0).rvs(20000, random_state=rng)])
    u, _ = transport_map.fit_map(WeightedPoints.equal(x), np.arange(2)).forward(x)
    before, after = ([stats.kstest(c, "norm").statistic for c in p.T] for p in (stats.zscore(x), u))
    assert before[0] > 0.08 and after[0] < 0.015
    assert after[1] < 0.6 * before[1]  # a gamma is not of the family, and comes nearer all the same


def test_evolution_in_straight_coordinates_keeps_the_density():
    """On a bend whose map is fitted to other points than its own, so that slopes differ from place to place."""
    rng = np.random.default_rng(7)

    def draws(n):
        x = rng.normal(size=(n, 2))
        return np.column_stack([x[:, 0], x[:, 0] ** 2 + np.exp(0.5 * x[:, 0]) * x[:, 1]])

    def log_density(z):
        return -0.5 * (z[:, 0] ** 2 + ((z[:, 1] - z[:, 0] ** 2) * np.exp(-0.5 * z[:, 0])) ** 2) - 0.5 * z[:, 0]

    move = moves.EvolutionMove(4, transport_map.fit_map(WeightedPoints.equal(draws(4000) * [1.2, 0.8]), np.arange(2)))
    found = []
    for seed in range(12):
        walkers = emcee.EnsembleSampler(400, 2, log_density, moves=[move], vectorize=True)
        walkers.random_state = np.random.RandomState(seed).get_state()
        walkers.run_mcmc(draws(400), 200)
        z = walkers.get_chain(discard=20)
        found.append([z[..., 0].mean(), z[..., 0].var() - 1.0, z[..., 1].mean() - 1.0])
    # the spread of independent runs: walkers of an ensemble know of one another
    t = np.mean(found, axis=0) / (np.std(found, axis=0, ddof=1) / np.sqrt(12.0))
    assert np.abs(t).max() < 4.5


@pytest.mark.parametrize("mapped", [False, True])
def test_evolution_takes_its_differences_within_an_ensemble(mapped):
    """The second ensemble stands still wherever its own walkers do, whatever the first one does."""
    rng = np.random.default_rng(3)
    straight = transport_map.fit_map(WeightedPoints.equal(rng.normal(size=(500, 2))), np.arange(2)) if mapped else None
    spread, still = rng.normal(size=(20, 2)), np.tile([1.0, 2.0], (20, 1))
    start = np.concatenate([spread, still])
    walkers = emcee.EnsembleSampler(
        40, 2, lambda z: np.zeros(len(z)), moves=[moves.EvolutionMove(2, straight)], vectorize=True
    )
    end = walkers.run_mcmc(start, 5, skip_initial_state_check=True).coords
    assert np.abs(end[20:] - still).max() < 1e-9
    assert (np.abs(end[:20] - spread).max(axis=1) > 1e-3).all()


def test_points_that_do_not_span_their_space_are_refused():
    with pytest.raises(np.linalg.LinAlgError):
        transport_map.fit_map(WeightedPoints.equal(np.ones((100, 2))), np.arange(2))


@pytest.mark.parametrize(
    ("wider", "along_tails", "before", "followed"),
    [
        (4.9, True, True, "hot"),
        (5.1, True, True, "cold"),
        (2.0, False, True, "cold"),
        (2.0, True, False, "cold"),
    ],
)
def test_the_map_follows_tails_that_belong_to_the_posterior(wider, along_tails, before, followed):
    """Not points spread over five times as much in one coordinate, nor rough ones, nor where tails do not matter."""
    rng = np.random.default_rng(0)
    cold = rng.normal(size=(4000, 3))
    cold = (cold - cold.mean(axis=0)) / cold.std(axis=0)
    hot = cold * [1.6, wider, 1.6]
    start = mixture.from_modes(np.zeros((1, 3)), np.eye(3)[None], np.zeros(1))
    one, other = WeightedPoints.equal(hot), WeightedPoints.equal(cold)
    known = proposal.fit_proposal(other, other, start, np.arange(3), rng, SHARES, most=2) if before else None
    found = proposal.fit_proposal(
        one, other, start, np.arange(3), rng, SHARES, most=2, before=known, along_tails=along_tails
    )
    points = {"hot": hot, "cold": cold}[followed]
    assert found.straight.scale == pytest.approx(points.std(axis=0), rel=1e-12)


def test_weights_count_as_often_as_points_repeat():
    """A map and a mixture of weighted points are those of the same points, each repeated."""
    rng = np.random.default_rng(5)
    x, often = crescent(3000, rng), rng.integers(1, 4, 3000)
    repeated, order = np.repeat(x, often, axis=0), np.arange(3)
    points = WeightedPoints(x, often.astype(float))
    assert WeightedPoints.equal(repeated).weight.sum() == points.weight.sum() == often.sum()
    one, other = (transport_map.fit_map(p, order) for p in (points, WeightedPoints.equal(repeated)))
    assert one.forward(x[:50])[0] == pytest.approx(other.forward(x[:50])[0], abs=1e-9)
    plain = transport_map.fit_map(
        WeightedPoints(repeated + 1e-12 * rng.normal(size=repeated.shape), np.ones(len(repeated))), order
    )
    assert one.forward(x[:50])[0] == pytest.approx(plain.forward(x[:50])[0], abs=0.02)  # but for quantiles
    start = mixture.Mixture(np.array([0.5, 0.5]), x[:2], np.repeat(np.eye(3)[None], 2, axis=0), 40.0)
    one, other = (
        mixture.fit_mixture(p, np.random.default_rng(1), most=2, degrees=40.0, before=start)
        for p in (points, WeightedPoints(repeated, np.ones(len(repeated))))
    )
    assert one.log_density(x) == pytest.approx(other.log_density(x), abs=2e-3)  # in single precision


def test_a_mixture_learns_in_single_precision_what_double_precision_says():
    rng = np.random.default_rng(3)
    x = np.concatenate([rng.normal(size=(3000, 4)), 3.0 + 0.3 * rng.normal(size=(1500, 4))])
    found = mixture.fit_mixture(WeightedPoints.equal(x), rng, most=2, degrees=40.0)
    order = np.argsort(-found.weights)
    assert found.weights.sum() == pytest.approx(1.0, abs=1e-12)
    assert found.weights[order] == pytest.approx([2 / 3, 1 / 3], abs=0.01)
    assert found.centres[order] == pytest.approx(np.repeat([[0.0], [3.0]], 4, axis=1), abs=0.08)


def test_the_density_of_a_proposal_is_that_of_its_draws(points):
    """The mean of 1/q over draws of q inside a box is the box's volume."""
    rng = np.random.default_rng(4)
    start = mixture.from_modes(np.zeros((1, 3)), np.eye(3)[None], np.zeros(1))
    q = proposal.fit_proposal(
        WeightedPoints.equal(points), WeightedPoints.equal(points), start, np.arange(3), rng, SHARES, most=3
    )
    x = q.rvs(200000, rng)
    inside = (np.abs(x - [0.0, 0.0, 2.5]) < [1.0, 1.0, 1.0]).all(axis=1)
    weight = inside * np.exp(-q.log_density(x))
    assert weight.mean() == pytest.approx(8.0, abs=5 * weight.std() / np.sqrt(len(x)))


@pytest.mark.parametrize("seed", range(12))
def test_a_mode_that_died_out_on_the_way_is_still_found(seed):
    found = modes.search(two_modes(), np.random.default_rng(seed)).modes
    assert sorted(found.z[:, 0].round(3)) == [0.0, 10.0]


def test_a_proposal_learns_with_wider_parts_than_it_is_frozen_with():
    policy = Policy(ensembles=2, walkers=64, rounds=3, round_draws=1024, most_rounds=3)
    target = two_modes()
    state, shares = burn_in.init(target, 1, policy, None, None, None), []
    while isinstance(state, BurnIn):
        shares.append(state.learned.proposal.shares)
        state = burn_in.burn_in_round(target, state, policy)
    assert shares == [ROUGH_SHARES, EXPLORING_SHARES, EXPLORING_SHARES]
    assert state.learned.proposal.shares == SHARES


def test_degrees_of_freedom_reach_the_density():
    x = np.array([[3.0], [0.5]])
    light = mixture.Mixture(np.ones(1), np.zeros((1, 1)), np.ones((1, 1, 1)), 40.0)
    assert light.log_density(x) == pytest.approx(stats.t(40.0).logpdf(x[:, 0]))


def test_points_that_a_map_has_sent_beyond_all_numbers_are_refused():
    z = np.random.default_rng(0).normal(size=(100, 3))
    z[:, 2] = np.nan
    with np.errstate(all="ignore"), pytest.raises(np.linalg.LinAlgError):
        mixture.fit_mixture(WeightedPoints.weighted(z, np.zeros(100)), np.random.default_rng(0))


def neck(n, rng):
    """A hill, a five-hundredth of its mass in a neck 9 standard deviations away."""
    z = rng.normal(size=(n, 3))
    z[: n // 500] = 0.1 * z[: n // 500] + [9.0, 0.0, 0.0]
    return z


def without_excess(points, rng):
    """A proposal that knows the hill alone."""
    hill = WeightedPoints.equal(points[len(points) // 500 :])
    start = mixture.from_modes(np.zeros((1, 3)), np.eye(3)[None], np.zeros(1))
    return proposal.fit_proposal(hill, hill, start, np.arange(3), rng, SHARES, most=2)


def log_neck(z):
    hill, far = stats.norm.logpdf(z).sum(axis=1), stats.norm.logpdf(z, [9.0, 0.0, 0.0], 0.1).sum(axis=1)
    return np.logaddexp(np.log(0.998) + hill, np.log(0.002) + far)


def test_what_the_proposal_makes_too_little_of_becomes_a_part_of_it():
    rng = np.random.default_rng(0)
    points = neck(20_000, rng)
    value, before = log_neck(points), without_excess(points, rng)
    found = proposal.with_excess(before, WeightedPoints(points, np.ones(len(points))), value, rng)
    assert found.excess is not None and len(found.excess.weights) <= 4

    def over(q):
        ratio = value - q.log_density(points)
        return (ratio - np.median(ratio))[: len(points) // 500]

    assert np.median(over(before)) > 10.0 and over(found).max() < OUTWEIGHS
    drawn = found.rvs(20_000, rng)
    assert (drawn[:, 0] > 8.0).mean() == pytest.approx(SHARES[-1], abs=0.01)
    weight = np.exp(log_neck(drawn) - found.log_density(drawn))
    assert weight.mean() == pytest.approx(1.0, abs=4 * weight.std() / np.sqrt(len(weight)))


def test_weights_say_how_much_mass_a_place_of_excess_has():
    """A neck of great weight among points, though few of them, has the largest component."""
    rng = np.random.default_rng(1)
    points = neck(20_000, rng)
    other = 0.1 * rng.normal(size=(40, 3)) - [9.0, 0.0, 0.0]
    every = np.concatenate([points, other])
    weight = np.append(np.ones(len(points)), np.full(len(other), 20.0))
    value = np.append(log_neck(points), np.full(len(other), 0.0))
    found = proposal.with_excess(without_excess(points, rng), WeightedPoints(every, weight), value, rng)
    largest = np.argmax(found.excess.weights)
    assert found.straight.inverse(found.excess.centres)[largest, 0] == pytest.approx(-9.0, abs=1.0)


@pytest.mark.parametrize(
    ("above", "places", "part"), [(0.9, 40, False), (1.1, 40, True), (9.0, 4, False), (9.0, 5, True)]
)
def test_there_is_excess_from_one_nat_and_five_places_on(above, places, part):
    rng = np.random.default_rng(2)
    points = rng.normal(size=(4000, 3))
    q = without_excess(points, rng)
    value = q.log_density(points)
    value[:places] += above
    found = proposal.with_excess(q, WeightedPoints(points, np.ones(len(points))), value, rng)
    assert (found.excess is not None) is part


@pytest.mark.parametrize(("away", "part"), [(1e4, True), (1e9, False)])
def test_excess_far_away_has_a_part_as_long_as_there_are_digits(away, part):
    """In single precision a part ten thousand standard deviations away has no width."""
    rng = np.random.default_rng(3)
    hill, far = rng.normal(size=(4000, 3)), away + rng.normal(size=(40, 3))
    q, points = without_excess(hill, rng), np.concatenate([hill, far])
    value = np.append(q.log_density(hill), np.zeros(len(far)))
    found = proposal.with_excess(q, WeightedPoints(points, np.ones(len(points))), value, rng)
    assert (found.excess is not None) is part
    if found.excess is not None:
        assert found.excess.moments[0] == pytest.approx(q.straight.forward(far)[0].mean(axis=0), rel=1e-3)


def test_without_excess_the_other_parts_share_all():
    rng = np.random.default_rng(3)
    q = without_excess(neck(4000, rng), rng)
    assert q.components.mixture.weights.sum() == pytest.approx(1.0, abs=1e-12)
    assert q.components.mixture.weights[: len(q.close.weights)].sum() == pytest.approx(0.684 / 0.95, abs=1e-12)
    again = proposal.Proposal.from_arrays(q.to_arrays())
    assert again.excess is None and np.array_equal(again.log_density(np.eye(3)), q.log_density(np.eye(3)))


def test_a_mixture_of_few_points_leans_on_what_they_lie_around():
    """One point: the other covariance, so many times wider, around it; many points: their own."""
    rng = np.random.default_rng(4)
    around = mixture.Mixture(
        np.array([0.5, 0.5]), np.array([[-1.0, 0.0], [1.0, 0.0]]), np.repeat(np.eye(2)[None], 2, 0)
    )
    mean, covariance = around.moments
    drawn = around.rvs(400_000, rng)
    assert mean == pytest.approx(drawn.mean(axis=0), abs=0.02)
    assert covariance == pytest.approx(np.cov(drawn.T), abs=0.05)
    one = mixture.fit_around(WeightedPoints(np.array([[7.0, 7.0]]), np.ones(1)), around, rng, most=4, wider=1.5)
    assert one.centres == pytest.approx(np.array([[7.0, 7.0]]))
    expected = 1.5 * covariance * 2.0 / 3.0  # two points' worth of it, and one point without a width
    assert one.factors[0] @ one.factors[0].T == pytest.approx(expected, rel=0.05)
    many = mixture.fit_around(
        WeightedPoints.equal(rng.normal(size=(4000, 2)) * [0.1, 3.0]), around, rng, most=1, wider=1.5
    )
    # a Student-t fitted to normal points has a third more variance
    assert many.moments[1] == pytest.approx(np.diag([0.013, 12.0]), rel=0.1, abs=0.02)
