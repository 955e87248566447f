"""Burn-in by its parts: places by weight, and what the proposal overlooks."""

from dataclasses import replace
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest

from tests.statistical.targets import banana, gaussian, two_modes
from wirebayes.inference.optimum import Optimum
from wirebayes.inference.policy import Policy
from wirebayes.inference.sampler import burn_in, proposal
from wirebayes.inference.sampler.mixture import Mixture
from wirebayes.inference.sampler.overlooked import left_by_search, overlooked_nats
from wirebayes.inference.sampler.points import WeightedPoints
from wirebayes.inference.sampler.settings import EXPLORING_SHARES, LOOKED_AT, OUTWEIGHS, ROUGH_SHARES, SHARES
from wirebayes.inference.sampler.start import finite_draws, overdispersed
from wirebayes.inference.sampler.state import BurnIn, Kept, Learned, Sampling, Walkers
from wirebayes.numeric.resampling import effective_number

D = 3
NORMAL = Mixture(np.ones(1), np.zeros((1, D)), np.eye(D)[None], 1e6)


def mean(points: WeightedPoints) -> float:
    return float(np.average(points.z[:, 0], weights=points.weight))


def test_ensembles_begin_at_places_of_their_own_by_weight() -> None:
    """Weights of one and two in turn, the same in every ensemble: twice as many walkers begin at the heavier places."""
    policy = Policy(ensembles=3, walkers=600)
    places = 60
    weight = np.where(np.arange(places) // 3 % 2, 2.0, 1.0)
    rows = burn_in._placed(policy, np.log(weight), np.random.default_rng(1)).reshape(3, 600)
    for i, own in enumerate(rows):
        assert set(own) == set(range(i, places, 3))
        assert np.mean(weight[own] == 2.0) == pytest.approx(2 / 3, abs=0.02)


def test_warm_and_cold_draws_follow_their_densities() -> None:
    """Two places as often as each other, one three times as dense: the warm density is the power 0.4 of that."""
    z = np.repeat([[0.0], [1.0]], 500, axis=0)
    value = np.log(3.0) * z[:, 0]
    hot, cold = burn_in._weighted_twice(z, value, np.zeros(1000))
    assert mean(cold) == pytest.approx(0.75)
    assert mean(hot) == pytest.approx(3.0**0.4 / (1.0 + 3.0**0.4))
    cold = burn_in._weighted_twice(z, value, value)[1]  # places that came by weight
    assert mean(cold) == pytest.approx(0.5)


@pytest.mark.parametrize(("share", "power"), [(0.12, 1.0), (0.08, None)])
def test_where_few_places_have_all_the_weight_they_stand_for_a_density_on_the_way(
    share: float, power: float | None
) -> None:
    """A tenth of the places is effective at least; of more the weights are taken as they are."""
    z = np.arange(4000.0)[:, None]
    value = np.where(z[:, 0] < share * 4000, 6.0, 0.0)
    _, cold = burn_in._weighted_twice(z, value, np.zeros(4000))
    exact = WeightedPoints.weighted(z, value)
    assert np.array_equal(cold.weight, exact.weight) is (power is not None)
    assert effective_number(exact.weight) == pytest.approx(4000 * share, rel=0.2)
    if power is None:
        assert effective_number(cold.weight) == pytest.approx(400, rel=1e-6)
        assert np.log(np.unique(cold.weight)[-1] / cold.weight[-1]) < 6.0


def test_the_start_has_no_walker_where_the_density_is_zero() -> None:
    def half(z: np.ndarray) -> np.ndarray:
        return np.where(z[:, 0] > 0, -0.5 * (z**2).sum(axis=1), -np.inf)

    target = type("Half", (), {"__call__": lambda self, z: half(z), "problem": gaussian(D).problem})()
    z, value = finite_draws(target, NORMAL, 501, np.random.RandomState(0))
    assert z.shape == (501, D) and (z[:, 0] > 0).all()
    assert np.array_equal(value, half(z))
    # where all draws will do, none is thrown away
    whole = gaussian(D)
    z, value = finite_draws(whole, NORMAL, 501, np.random.RandomState(0))  # type: ignore[arg-type]
    assert np.array_equal(z, NORMAL.rvs(501, np.random.RandomState(0))) and whole.evaluations == len(value) == 501


@pytest.mark.parametrize(("shift", "witness"), [(0.0, None), (0.0, 0.0), (9.0, 9.0)])
def test_what_the_proposal_overlooks_is_measured_in_nats(shift: float, witness: float | None) -> None:
    """Evenly spread log ratios of posterior to proposal, from -5 to 5: the 99.9 % quantile is 4.99 above the median.

    The search left places of the same ratios, or of some that lie 9 nats higher: of these the 99 % quantile is told.
    """
    z = np.zeros((1001, D))
    base = NORMAL.log_density(z) + 70.0  # no density is normalised
    ratios = np.linspace(-5.0, 5.0, 1001)
    left = None if witness is None else (z, base + ratios + witness)
    learned = Learned(NORMAL, NORMAL, 1, left)
    found = overlooked_nats(learned, z, base + ratios + 100.0 if left is None else base + ratios)
    assert found == pytest.approx((4.99, 0.0 if witness is None else 4.9 + shift), abs=0.011)


def test_of_many_kept_draws_some_evenly_spread_are_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    """From the first to the last: a neck that the last tenth of the steps found shows as it does among all."""
    n = 6 * LOOKED_AT
    z = np.zeros((n, D))
    ratios = np.where(np.arange(n) < 0.9 * n, 0.0, 9.0)
    counts: list[int] = []

    def density(self: object, places: np.ndarray) -> np.ndarray:
        counts.append(len(places))
        return np.zeros(len(places))

    monkeypatch.setattr(type(NORMAL), "log_density", density)
    assert overlooked_nats(Learned(NORMAL, NORMAL, 1), z, ratios) == (9.0, 0.0)
    assert counts == [LOOKED_AT]


@pytest.mark.parametrize(("share", "counts"), [(1e-2, True), (1e-4, False)])
def test_a_place_whose_hill_can_hold_next_to_nothing_is_not_overlooked(share: float, counts: bool) -> None:
    """A hill as wide as the widest prior: from a typical place of it, half a nat a coordinate up to the top."""
    z, far = np.zeros((1001, D)), np.full((1001, D), 50.0)
    top = np.log(share) + 70.0 - 0.5 * D * np.log(2.0 * np.pi / 0.3)
    learned = Learned(NORMAL, NORMAL, 1, (far, np.full(1001, top - 0.5 * D)))
    found = overlooked_nats(learned, z, NORMAL.log_density(z) + 70.0)
    assert found[1] == pytest.approx(top - 0.5 * D - NORMAL.log_density(far)[0] - 70.0 if counts else 0.0)


def test_burn_in_walks_with_few_walkers() -> None:
    """A quarter of them, but two more than twice as many as there are parameters: differences must span the space."""
    target = gaussian(8)
    assert burn_in._walking(target, Policy(ensembles=4, walkers=128)) == 4 * 32  # type: ignore[arg-type]
    assert burn_in._walking(target, Policy(ensembles=4, walkers=40)) == 4 * 18  # type: ignore[arg-type]
    assert burn_in._walking(target, Policy(ensembles=4, walkers=16)) == 4 * 16  # type: ignore[arg-type]


def burning(overlooked: float = 0.0, **state: object) -> BurnIn:
    learned = Learned(NORMAL, NORMAL, 1, acceptance=1.0, overlooked=overlooked)
    walkers = Walkers(np.zeros((8, D)), np.zeros(8), np.random.RandomState(0).get_state())
    return BurnIn(walkers, learned, np.random.default_rng(0), 5, **state)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("round_", "modes", "overlooked", "draws"),
    [
        (1, 1, 0.0, 1024),
        (2, 1, 0.0, 1024),
        (3, 1, 0.0, 2048),
        (4, 1, 0.0, 4096),
        (7, 1, 0.0, 4096),
        (4, 1, 6.0, 4 * 4096),
        (1, 1, 6.0, 2048),
        (4, 1, -6.0, 4096),  # once only
        (1, 3, 0.0, 3072),  # many hills are not learned from few draws
        (3, 16, 0.0, 4096),
    ],
)
def test_the_first_rounds_take_fewer_draws(round_: int, modes: int, overlooked: float, draws: int) -> None:
    target = gaussian(D)
    policy = Policy(round_draws=4096)
    again = 2 if overlooked > 0.0 else 1
    begun = burning(abs(overlooked), round=round_).knowing(modes=modes, again=again)
    state, (z, value, base) = burn_in._drawn(target, begun, policy)  # type: ignore[arg-type]
    assert len(z) == draws and state.evaluations == 5 + draws
    assert value == pytest.approx(target(z)) and base == pytest.approx(NORMAL.log_density(z))


def test_a_round_has_a_thousand_draws_at_least_or_all_that_are_wanted() -> None:
    for wanted, draws in ((3000, 1024), (512, 512)):
        found = burn_in._drawn(gaussian(D), burning(round=1), Policy(round_draws=wanted))  # type: ignore[arg-type]
        assert len(found[1][0]) == draws


class Sixth:
    """A log density that differs from the proposal's by one of six values, evenly; what is accepted is known."""

    def __init__(self, gap: float) -> None:
        self.gap, self.evaluations = gap, 0
        self.problem = gaussian(D).problem
        self.coordinates = gaussian(D).coordinates

    def __call__(self, z: np.ndarray) -> np.ndarray:
        self.evaluations += len(z)
        return NORMAL.log_density(z) + np.where(z[:, 0] > 0, self.gap, 0.0)


@pytest.mark.parametrize("gap", [0.0, 1.0])
def test_acceptance_is_that_of_independent_draws(gap: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Half of the draws have weight 1, half e^gap: a walker stands at the heavy ones with odds e^gap."""
    monkeypatch.setattr(burn_in, "_fitted", lambda target, state, *given, **known: state)
    state = burn_in.burn_in_round(Sixth(gap), burning(), Policy(rounds=9, round_draws=40_000))  # type: ignore[arg-type]
    heavy = np.exp(gap) / (1.0 + np.exp(gap))
    assert state.learned.acceptance == pytest.approx(1.0 - 0.5 * heavy * (1.0 - np.exp(-gap)), abs=0.02)


@pytest.mark.parametrize(
    ("gap", "tail", "rounds", "most", "taken"),
    [
        (0.0, 1.5, 3, 9, 3),  # at least so many
        (1.4, 1.5, 3, 9, 3),
        (1.6, 1.5, 3, 5, 5),  # the heavy tenth of the places lies 1.6 nats above the median: not settled, all rounds
    ],
)
def test_burn_in_ends_when_the_proposal_leaves_out_no_tail(
    gap: float, tail: float, rounds: int, most: int, taken: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(burn_in, "_fitted", lambda target, state, *given, **known: state)
    target = Sixth(gap)
    inner = type(target).__call__

    def tenth(self: Sixth, z: np.ndarray) -> np.ndarray:
        return inner(self, z) - np.where((z[:, 0] > 0) & (z[:, 0] < 1.28), self.gap, 0.0)

    monkeypatch.setattr(Sixth, "__call__", tenth)
    state: BurnIn | Sampling = burning()
    count = 0
    while isinstance(state, BurnIn) and count < 12:
        count += 1
        policy = Policy(ensembles=2, walkers=4, rounds=rounds, most_rounds=most, tail=tail, round_draws=4096)
        state = burn_in.burn_in_round(target, state, policy)  # type: ignore[arg-type]
    assert count == taken


@pytest.mark.parametrize(("acceptance", "trusted"), [(0.06, True), (0.04, False)])
def test_a_proposal_that_hardly_helps_is_given_up(acceptance: float, trusted: bool) -> None:
    """Then walkers begin where the walk came by, and move by differential evolution."""
    target = gaussian(D)
    far = np.full((100, D), 30.0)
    near = np.zeros((100, D))
    drawn, walk = (near, target(near), target(near)), (far, target(far), target(far))
    state = replace(burning(walk=walk).knowing(acceptance=acceptance), evaluations=7)
    policy = Policy(ensembles=2, walkers=10)
    found = burn_in._frozen(target, state, policy, drawn, 1)  # type: ignore[arg-type]
    assert found.learned.trusted is trusted
    assert bool(np.abs(found.walkers.positions).mean() < 10.0) is trusted
    assert found.evaluations > 7 and found.walkers.values == pytest.approx(target(found.walkers.positions))


@pytest.mark.parametrize(("overlooked", "rounds_left"), [(0.0, 1), (6.0, 4)])
def test_kept_draws_are_learned_from_as_burn_in(
    overlooked: float, rounds_left: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One more round; four where places were overlooked, which are rare."""
    seen: dict[str, WeightedPoints] = {}

    def fitted(target: object, state: BurnIn, policy: Policy, hot: WeightedPoints, cold: WeightedPoints) -> BurnIn:
        seen.update(hot=hot, cold=cold)
        return state

    monkeypatch.setattr(burn_in, "_fitted", fitted)
    z = np.repeat([0.0, 1.0, 1.0, 1.0], 10)[:, None, None] * np.ones((1, 25, D))  # as often as they are dense
    kept = Kept((z[:4], z[4:]), tuple(np.log(3.0) * part[..., 0] for part in (z[:4], z[4:])))
    learned = Learned(NORMAL, NORMAL, 1, again=2, overlooked=overlooked)
    walkers = SimpleNamespace(positions=z[-1])
    state = Sampling(walkers, learned, np.random.default_rng(3), 11, kept)  # type: ignore[arg-type]
    policy = Policy(rounds=3, most_rounds=9)
    found = burn_in.again(None, state, policy)  # type: ignore[arg-type]
    assert (found.learned.again, found.evaluations) == (3, 11)
    assert (policy.most_rounds if overlooked else policy.rounds) - found.round == rounds_left
    assert seen["cold"].weight.sum() == pytest.approx(1000) and mean(seen["cold"]) == pytest.approx(0.75)
    assert mean(seen["hot"]) == pytest.approx(3.0**0.4 / (1.0 + 3.0**0.4))


@pytest.mark.parametrize("stay", [True, False])
def test_kept_draws_teach_the_next_proposal_and_may_count_on(stay: bool) -> None:
    """No walker moves; the proposal has twice as many components, and frozen shares."""
    target, rng, policy = banana(), np.random.default_rng(0), Policy(ensembles=2, walkers=8, components=3)
    d = len(target.mean)
    start = Mixture(np.ones(1), np.zeros((1, d)), np.eye(d)[None])
    z = rng.normal(size=(250, 16, d))
    z[..., 1] = 0.5 * z[..., 1] + z[..., 0] ** 2 - 1.0
    before, kept = (
        Kept((part,), (target(part.reshape(-1, d)).reshape(-1, 16),), len(part), 3, 5) for part in (z[:150], z[150:])
    )
    walkers = Walkers(kept.z[0][-1], kept.log_density[0][-1], np.random.RandomState(0).get_state())
    state = Sampling(walkers, Learned(start, start, 1), rng, 700, kept, earlier=before)
    spent = target.evaluations
    found = burn_in.refined(target, state, policy, draws_stay=stay)  # type: ignore[arg-type]
    assert isinstance(found, Sampling)
    assert found.walkers is walkers and found.evaluations - 700 == target.evaluations - spent  # what climbs took
    assert found.kept == Kept() and found.diagnostics is None and found.learned.again == 1
    assert found.earlier.steps == found.earlier.evaluations == (250 if stay else 0)
    if stay:
        assert np.array_equal(np.concatenate(found.earlier.z), z)
    assert found.learned.previous is (start if stay else None)
    learned = found.learned.proposal
    assert isinstance(learned, proposal.Proposal)
    assert learned.shares == SHARES and len(learned.close.weights) == 6
    places = z.reshape(-1, d)
    spread = [np.std(target(places) - by.log_density(places)) for by in (learned, start)]
    assert spread[0] < 0.5 * spread[1]  # in nats, half of what the start left


@pytest.mark.parametrize(("known", "modes"), [(1, 2), (2, 2)])
def test_a_mode_found_by_a_few_walkers_begins_the_run_anew(known: int, modes: int) -> None:
    """One walker stands about the second of two modes; where the search knew of both, draws stay."""
    target, rng, policy = two_modes(), np.random.default_rng(0), Policy(ensembles=2, walkers=8, rounds=3)
    d, n = len(target.mean), 300
    centres = np.zeros((2, d))
    centres[1, 0] = 10.0
    start = overdispersed(
        Optimum(centres, target(centres), np.repeat(np.eye(d)[None], 2, axis=0), np.ones(2, bool)).rows(slice(known))
    )
    z = rng.normal(size=(n, 16, d))
    z[:, 3, 0] += 10.0
    kept = Kept((z,), (target(z.reshape(-1, d)).reshape(n, 16),), n)
    walkers = Walkers(z[-1], kept.log_density[0][-1], np.random.RandomState(0).get_state())
    state = Sampling(walkers, Learned(start, start, known), rng, 700, kept)
    found = burn_in.refined(target, state, policy, draws_stay=True)  # type: ignore[arg-type]
    assert isinstance(found, BurnIn if modes > known else Sampling)
    assert found.learned.modes == modes == len(found.learned.start.weights) and found.learned.again == 1
    assert np.sort(found.learned.start.centres[:, 0]) == pytest.approx([0.0, 10.0], abs=0.1)
    if isinstance(found, BurnIn):
        assert found.round == policy.rounds - 1 and found.learned.previous is None


def with_a_far_hill(count: int, steps: int = 32) -> tuple[Sampling, SimpleNamespace]:
    """Draws of a normal density; of 400 places that the search left, `count` are of a hill that holds a hundredth."""
    rng = np.random.default_rng(0)
    centre, far = np.full(D, 12.0), Mixture(np.ones(1), np.full((1, D), 12.0), 2.0 * np.eye(D)[None], 1e6)

    def density(z: np.ndarray) -> np.ndarray:
        return np.logaddexp(NORMAL.log_density(z), np.log(0.01) + far.log_density(z))

    z = rng.normal(size=(steps, 128, D))
    kept = Kept((z,), (density(z.reshape(-1, D)).reshape(steps, 128),), z[..., 0].size)
    left = rng.normal(size=(400, D))
    left[:count] = centre + 2.0 * left[:count]
    learned = Learned(NORMAL, NORMAL, 1, (left, density(left)))
    walkers = Walkers(z[-1], density(z[-1]), np.random.RandomState(0).get_state())
    coordinates = SimpleNamespace(order=np.arange(D), shares=[])
    return Sampling(walkers, learned, rng, 0, kept), SimpleNamespace(coordinates=coordinates)


@pytest.mark.parametrize(("remembered", "steps"), [(True, 32), (True, 512), (False, 32)])
def test_what_the_search_left_gets_into_a_proposal_that_overlooks_it(
    remembered: bool, steps: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Then the proposal is no longer too low there, however many draws are kept, and the fit is not given up for it."""
    state, target = with_a_far_hill(40, steps)
    z, value = state.kept.flat
    assert overlooked_nats(state.learned, z, value)[1] > OUTWEIGHS
    if not remembered:
        monkeypatch.setattr(burn_in, "left_by_search", lambda learned, middle: None)
    found = burn_in.again(target, state, Policy())  # type: ignore[arg-type]
    now = overlooked_nats(found.learned, z, value)[1]
    assert (now < OUTWEIGHS) is remembered


@pytest.mark.parametrize("last", [True, False])
def test_the_last_round_of_burn_in_asks_what_the_search_left(last: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """At the usual ratio of posterior to proposal among its draws, which is e here."""
    asked: list[float] = []
    Watched(monkeypatch, np.full(5000, 1.0))
    monkeypatch.setattr(burn_in, "left_by_search", lambda learned, middle: asked.append(middle))
    burn_in.burn_in_round(None, burning(round=7 if last else 0), Policy(rounds=3, most_rounds=9))  # type: ignore[arg-type]
    assert asked == ([pytest.approx(1.0)] if last else [])


@pytest.mark.parametrize(("nats", "matters"), [(0.01, True), (-0.01, False)])
def test_of_what_the_search_left_only_places_that_may_hold_something_get_into_it(nats: float, matters: bool) -> None:
    """Five of a hundred places, as high as where a hill as wide as the prior would hold next to nothing."""
    z = np.random.default_rng(1).normal(size=(100, D))
    middle = 70.0
    next_to_nothing = middle + np.log(1e-3) - 0.5 * D * (1.0 + np.log(2.0 * np.pi / 0.3))
    overlooked = NORMAL.log_density(z) + middle + OUTWEIGHS + 1.0
    left = z, np.where(np.arange(100) < 5, next_to_nothing + nats, overlooked)
    found = left_by_search(Learned(NORMAL, NORMAL, 1, left), middle)
    assert found is not None
    assert set(found.z[:, 0]) == set(z[0 if matters else 5 :, 0])


@pytest.mark.parametrize(("nats", "some"), [(0.01, True), (-0.01, False)])
def test_the_search_is_asked_where_a_place_of_its_own_outweighs_a_pool(nats: float, some: bool) -> None:
    z = np.random.default_rng(1).normal(size=(100, D))
    left = z, NORMAL.log_density(z) + 70.0 + OUTWEIGHS + nats
    assert (left_by_search(Learned(NORMAL, NORMAL, 1, left), 70.0) is not None) is some
    assert left_by_search(Learned(NORMAL, NORMAL, 1), 70.0) is None


def test_the_frozen_proposal_draws_less_from_its_wide_parts() -> None:
    """Shares sum to one; while it learns more than twice as much comes from what reaches the tails."""
    for shares in (SHARES, EXPLORING_SHARES, ROUGH_SHARES):
        assert sum(shares) == pytest.approx(1.0)
    assert SHARES[0] > EXPLORING_SHARES[0] > ROUGH_SHARES[0]


def test_a_walk_looks_further_every_time() -> None:
    """With powers nearer to one and twice as many steps; half of the way is forgotten, densities are the target's."""
    target, policy = gaussian(D), Policy(ensembles=2, walkers=16, round_draws=256)
    walkers = burn_in._walking(target, policy)  # type: ignore[arg-type]
    z = target.mean + 0.1 * np.random.default_rng(0).normal(size=(walkers, D))
    begin = Walkers(z, target(z), np.random.RandomState(1).get_state())
    state = replace(burning(), walkers=begin)
    for walks, (power, more) in enumerate([(0.5, 1), (0.6, 2), (0.7, 4), (0.8, 8), (0.8, 8)]):
        steps = 256 // walkers * more
        before, spent = state.evaluations, target.evaluations
        state, (places, value, walked) = burn_in._walked(target, state, policy)  # type: ignore[arg-type]
        assert state.learned.walks == walks + 1 and state.walk is not None
        assert all(kept is given for kept, given in zip(state.walk, (places, value, walked), strict=True))
        assert len(places) == len(value) == (steps - steps // 2) * walkers
        assert state.evaluations - before == target.evaluations - spent > 0
        assert np.array_equal(state.walkers.positions, places[-walkers:])
        assert value == pytest.approx(target(places)) and walked == pytest.approx(power * target(places))


def test_a_walk_in_burn_in_has_small_pools_of_one_ensemble(monkeypatch: pytest.MonkeyPatch) -> None:
    move_of = Mock(wraps=burn_in.move_of)
    monkeypatch.setattr(burn_in, "move_of", move_of)
    target, policy = gaussian(D), Policy(ensembles=2, walkers=16, round_draws=256)
    z = target.mean + 0.1 * np.random.default_rng(0).normal(size=(32, D))
    state = replace(burning(), walkers=Walkers(z, target(z), np.random.RandomState(1).get_state()))
    burn_in._walked(target, state, policy)  # type: ignore[arg-type]
    burn_in._frozen(target, state.knowing(acceptance=1.0), policy, (z, target(z), target(z)), 5)  # type: ignore[arg-type]
    asked = [(*call.args[1:], call.kwargs["frozen"]) for call in move_of.call_args_list]
    assert asked == [(1, 256 // burn_in._walking(target, policy), False), (2, 5, True)]  # type: ignore[arg-type]


class Watched:
    """What `burn_in.burn_in_round` does with a round whose log weights are given, instead of doing it."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, weight: np.ndarray) -> None:
        self.did: list[object] = []
        z = np.arange(len(weight), dtype=float)[:, None]
        walk = np.full((4, 1), -1.0), np.zeros(4), np.zeros(4)

        def fitted(
            target: object, state: BurnIn, policy: Policy, hot: WeightedPoints, cold: WeightedPoints, **more: int
        ) -> BurnIn:
            self.did.append(("learned from the walk" if (cold.z < 0).all() else "learned", more))
            return state

        def frozen(target: object, state: BurnIn, policy: Policy, drawn: object, steps: int) -> int:
            return steps

        def walked(target: object, state: BurnIn, policy: Policy) -> tuple[BurnIn, object]:
            self.did.append("walked")
            return state, walk

        monkeypatch.setattr(burn_in, "_drawn", lambda target, state, policy: (state, (z, weight, np.zeros(len(z)))))
        monkeypatch.setattr(burn_in, "_walked", walked)
        monkeypatch.setattr(burn_in, "_fitted", fitted)
        monkeypatch.setattr(burn_in, "_frozen", frozen)


def tenth(gap: float) -> np.ndarray:
    """Log weights of which a tenth lies higher."""
    return np.where(np.arange(5000) < 500, gap, 0.0)


@pytest.mark.parametrize(("acceptance", "walks"), [(0.04, True), (0.06, False)])
def test_a_walk_teaches_while_hardly_a_draw_would_be_accepted(
    acceptance: float, walks: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    watched = Watched(monkeypatch, tenth(1.0))
    state = burn_in.burn_in_round(None, burning().knowing(acceptance=acceptance), Policy(rounds=5))  # type: ignore[arg-type]
    assert isinstance(state, BurnIn) and state.round == 1 and state.learned.acceptance > 0.5
    first = ["walked", ("learned from the walk", {})] if walks else []
    assert watched.did == [*first, ("learned", {"points": 4000})]


@pytest.mark.parametrize(
    ("gap", "round_", "steps"),
    [
        (np.log(1.01), 2, 1),  # the last of three rounds, and the proposal fits
        (np.log(4.3), 2, 4),  # a tail of e^1.46, and so many steps to find its share
        (np.log(4.6), 2, None),  # a tail of e^1.53
        (np.log(1.01), 1, None),  # two rounds are not enough
        (np.log(4.6), 8, 4),  # the last of all rounds, whatever is left out
        (np.log(8.2), 8, 8),
        (np.log(8000.0), 8, 1),  # nearly all of the posterior is there: its median too
    ],
)
def test_after_the_last_round_walkers_have_the_steps_that_great_weights_take(
    gap: float, round_: int, steps: int | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    watched = Watched(monkeypatch, tenth(gap))
    state = replace(burning(), round=round_)
    found = burn_in.burn_in_round(None, state, Policy(rounds=3, most_rounds=9, tail=1.5))  # type: ignore[arg-type]
    assert watched.did == [("learned", {"points": 4000 if steps is None else 12000})]
    assert isinstance(found, BurnIn) if steps is None else found == steps


@pytest.mark.parametrize(("share", "ends"), [(0.20, False), (0.30, True)])
def test_a_quarter_must_be_accepted(share: float, ends: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of draws of which so many are worth anything, and those the same, so many are accepted."""
    weight = np.where(np.arange(5000) < share * 5000, 0.0, -200.0)
    Watched(monkeypatch, weight)
    found = burn_in.burn_in_round(None, burning(round=7), Policy(rounds=3, most_rounds=9))  # type: ignore[arg-type]
    assert isinstance(found, BurnIn) is not ends


def test_a_proposal_that_is_hardly_ever_accepted_does_not_teach(monkeypatch: pytest.MonkeyPatch) -> None:
    for share, learned in ((0.04, False), (0.06, True)):
        watched = Watched(monkeypatch, np.where(np.arange(5000) < share * 5000, 0.0, -200.0))
        burn_in.burn_in_round(None, burning(), Policy())  # type: ignore[arg-type]
        assert bool(watched.did) is learned


def test_the_proposal_is_fitted_to_this_round_and_the_one_before(monkeypatch: pytest.MonkeyPatch) -> None:
    """With as many components as there are modes, but no more than 24 and no fewer than the policy's."""
    asked: list[dict[str, object]] = []
    new = object()

    def fit(hot: WeightedPoints, cold: WeightedPoints, *given: object, **more: object) -> object:
        asked.append({"hot": hot.z.tolist(), "cold": cold.z.tolist(), "given": given, **more})
        if len(asked) == 4:
            raise np.linalg.LinAlgError("points do not span their space")
        return new

    monkeypatch.setattr(burn_in.proposal, "fit_proposal", fit)
    target, rows = gaussian(1), [WeightedPoints.equal(np.full((1, 1), float(i))) for i in range(6)]
    state = burning()
    for modes, (hot, cold) in zip((7, 2, 99), zip(rows[::2], rows[1::2], strict=True), strict=True):
        state = burn_in._fitted(target, state.knowing(modes=modes), Policy(components=6), hot, cold)  # type: ignore[arg-type]
        assert state.learned.proposal is new and state.seen == (hot, cold)
    assert [a["hot"] for a in asked] == [[[0.0]], [[0.0], [2.0]], [[2.0], [4.0]]]
    assert [a["cold"] for a in asked] == [[[1.0]], [[1.0], [3.0]], [[3.0], [5.0]]]
    assert [(a["most"], a["points"], a["before"]) for a in asked] == [
        (7, 12000, None),
        (6, 12000, None),
        (24, 12000, None),
    ]
    assert all(a["given"][-1] == EXPLORING_SHARES for a in asked)  # type: ignore[index]
    failed = burn_in._fitted(target, state.knowing(proposal=NORMAL), Policy(), *rows[:2])  # type: ignore[arg-type]
    assert failed.learned.proposal is NORMAL and failed.seen == (rows[0], rows[1])


def test_known_modes_are_widened_and_rough_draws_teach_the_first_proposal(monkeypatch: pytest.MonkeyPatch) -> None:
    target = gaussian(D)
    taught: list[tuple[object, ...]] = []

    def fit(hot: WeightedPoints, cold: WeightedPoints, start: Mixture, *given: object, **more: object) -> object:
        taught.append((hot.z.tolist(), cold.z.tolist(), given[2]))
        return "proposal"

    monkeypatch.setattr(burn_in.proposal, "fit_proposal", fit)
    evidence = np.array([0.0, np.log(3.0)])
    curvature = np.stack([np.eye(D), 0.5 * np.eye(D)])
    height = evidence + 0.5 * np.linalg.slogdet(curvature)[1]
    known = Optimum(np.stack([target.mean, target.mean + 1.0]), height, curvature, np.ones(2, bool))
    rough = target.mean + np.arange(5.0)[:, None]
    policy = Policy(ensembles=2, walkers=40)
    plain, learned = (burn_in.init(target, 1, policy, known, None, points) for points in (None, rough))  # type: ignore[arg-type]
    start = plain.learned.start
    assert start.weights == pytest.approx([0.25, 0.75]) and np.array_equal(start.centres, known.z)
    scale = start.factors @ np.swapaxes(start.factors, 1, 2)
    assert scale[1] == pytest.approx(2.0 * scale[0]) and scale[0] == pytest.approx(1.7 * np.eye(D))
    assert plain.learned.proposal is start and plain.learned.acceptance == 0.0 and plain.learned.modes == 2
    assert plain.learned.witness is None and plain.evaluations == learned.evaluations == target.evaluations / 2 > 0
    assert len(plain.walkers.positions) == 2 * 10 and plain.round == 0  # a quarter of the walkers
    assert learned.learned.proposal == "proposal" and learned.learned.acceptance == 1.0 and learned.seen is None
    assert taught == [(rough.tolist(), rough.tolist(), ROUGH_SHARES)]
