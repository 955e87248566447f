"""Pools of draws: every place of a stretch has the target's law, and importance sampling's worth."""

import emcee
import numpy as np
import pytest
from scipy import stats

from wirebayes.inference.convergence import autocorrelation_steps
from wirebayes.inference.sampler import net
from wirebayes.inference.sampler.components import Components
from wirebayes.inference.sampler.mixture import Mixture
from wirebayes.inference.sampler.moves import EvolutionMove, PoolMove

WIDE = Mixture(np.ones(1), np.zeros((1, 1)), np.full((1, 1, 1), 2.0), 1e6)  # normal, twice the target's width


def density(x):
    return -0.5 * x[:, 0] ** 2


class Stay(emcee.moves.Move):
    def propose(self, model, state):
        return state, np.zeros(len(state.coords), bool)


def walked(walkers, steps, most, seed=1):
    """(steps, walkers) places, begun at exact draws; the move between pools does nothing."""
    sampler = emcee.EnsembleSampler(walkers, 1, density, moves=PoolMove(WIDE, Stay(), steps, most), vectorize=True)
    random = np.random.RandomState(seed)
    sampler.random_state = random.get_state()
    sampler.run_mcmc(random.normal(size=(walkers, 1)), steps, skip_initial_state_check=True)
    return sampler


@pytest.mark.parametrize("most", [2, 3, 8, 32])
def test_every_place_of_a_pool_has_the_target_s_law(most):
    places = walked(20_000, 32, most).get_chain()[..., 0]
    for at in places:
        assert stats.kstest(at, "norm").pvalue > 1e-4


def test_a_circle_that_begins_where_the_walker_stands_fails(monkeypatch):
    class Origin:
        """A generator whose origins are all one; its draws are as ever."""

        def __init__(self, random):
            self.random = random

        def __getattr__(self, name):
            return getattr(self.random, name)

        def uniform(self, size):
            return np.zeros(size)

    def biased(self, model, state, k, pooled=PoolMove._pooled):
        return pooled(self, model._replace(random=Origin(model.random)), state, k)

    monkeypatch.setattr(PoolMove, "_pooled", biased)
    places = walked(20_000, 32, 8).get_chain()[..., 0]
    assert min(stats.kstest(at, "norm").pvalue for at in places) < 1e-12


def test_effective_draws_are_reported_as_they_are_and_exceed_those_of_importance_sampling():
    """A sign does not know the weight: independent draws of the proposal would have 1 / E_p[p/q], sqrt(7) / 4 here."""
    chain = walked(20_000, 256, 64).get_chain()
    sign = np.sign(chain).reshape(256, 4, 5000, 1).swapaxes(0, 1)
    found = 1.0 / autocorrelation_steps(sign)[0]
    assert found > 3.0 * np.sqrt(7) / 4
    # the spread of means over many runs of 100 walkers, in place of the walkers' own
    runs = sign.reshape(4, 256, 50, 100).mean(axis=(1, 3)).ravel()
    assert 1.0 / (256 * 100 * runs.var(ddof=1)) == pytest.approx(found, rel=0.3)


def test_independent_draws_in_a_pool_are_worth_importance_sampling(monkeypatch):
    """As before, with nets that know nothing of the walker: less what its own place takes of its pool."""
    monkeypatch.setattr(
        net, "around", lambda given, size, random: random.uniform(size=(len(given), size, given.shape[1]))
    )
    chain = walked(20_000, 256, 64).get_chain()
    found = 1.0 / autocorrelation_steps(np.sign(chain).reshape(256, 4, 5000, 1).swapaxes(0, 1))[0]
    assert 0.8 * np.sqrt(7) / 4 < found < np.sqrt(7) / 4


def test_steps_that_moved_are_counted_and_the_steps_between_begin_the_pools():
    sampler = walked(50, 70, 32)
    chain = sampler.get_chain()[..., 0]
    still = np.flatnonzero((chain[1:] == chain[:-1]).all(axis=1)) + 1
    assert list(still) == [32, 64, 68]  # 32, 32, 4 and 2 steps
    assert np.array_equal(sampler.backend.accepted, (np.diff(chain, axis=0) != 0).sum(axis=0))
    assert np.array_equal(sampler.get_log_prob(), -0.5 * chain**2)


class Round:
    """A round cloud is straight already."""

    def forward(self, x):
        return x, np.zeros(len(x))

    def inverse(self, u):
        return u


def squared_jumps(before, proposed, log_factor, target):
    """Mean squared distance a Metropolis step goes, refusals counted as zero."""
    accepted = np.minimum(0.0, target(proposed) - target(before) + log_factor)
    return np.mean(np.exp(accepted) * np.sum((proposed - before) ** 2, axis=1))


@pytest.mark.parametrize("dimensions", [3, 8, 20])
@pytest.mark.parametrize("straightened", [False, True])
def test_steps_of_differential_evolution_are_nearly_the_best_length(dimensions, straightened):
    """Against normal random walks of every length on a normal target; a tenth of the length goes a hundredth as far."""
    random, n = np.random.RandomState(2), 20_000

    def target(x):
        return -0.5 * np.sum(x**2, axis=1)

    x, others = random.normal(size=(2, n, dimensions))
    step = random.normal(size=(n, dimensions))
    walks = [squared_jumps(x, x + length * step, 0.0, target) for length in np.geomspace(0.05, 3.0, 60)]

    move = EvolutionMove(1, Round() if straightened else None)
    found = squared_jumps(x, *move.get_proposal(x, [others], random), target)
    # the rest is spent on steps from mode to mode, or on short ones
    assert found > 0.7 * max(walks)


def test_half_of_the_straightened_steps_serve_a_walker_whom_long_ones_do_not():
    """On a target half as wide as the cloud of walkers, against steps that are all as long as the cloud asks for."""
    random, n, dimensions = np.random.RandomState(2), 20_000, 8

    def target(x):
        return -0.5 * np.sum((2.0 * x) ** 2, axis=1)

    x, others = 0.5 * random.normal(size=(n, dimensions)), random.normal(size=(n, dimensions))
    long = x + 2.38 / np.sqrt(dimensions) * random.normal(size=(n, dimensions))
    found = squared_jumps(x, *EvolutionMove(1, Round()).get_proposal(x, [others], random), target)
    assert found > 1.3 * squared_jumps(x, long, 0.0, target)


def test_without_straightening_some_steps_lead_from_mode_to_mode():
    """Two modes a hundred widths apart: one step in five is a whole difference, a quarter of those leads across."""
    random = np.random.RandomState(3)
    x, others = (random.normal(size=(10_000, 2)) + 100.0 * (np.arange(10_000) % 2)[:, None] for _ in range(2))
    proposed, _ = EvolutionMove(1).get_proposal(x, [others], random)
    nearest = np.clip(np.round(proposed / 100.0), 0, 1) * 100.0
    arrived = (np.abs(proposed - nearest) < 5.0).all(axis=1) & (np.abs(proposed - x) > 50.0).all(axis=1)
    assert arrived.mean() == pytest.approx(0.05, abs=0.01)


def test_steps_too_few_for_a_pool_are_those_of_the_other_move(monkeypatch):
    """One step leaves no place for draws; so do steps when pools may have one only."""

    def unasked(self, points, random):
        raise AssertionError("drawn from")

    monkeypatch.setattr(Components, "from_cube", unasked)
    for steps, most in ((1, 64), (5, 1)):
        move = PoolMove(WIDE, Stay(), steps, most)
        sampler = emcee.EnsembleSampler(6, 1, density, moves=move, vectorize=True)
        start = np.linspace(-1.0, 1.0, 6)[:, None]
        sampler.run_mcmc(start, steps, skip_initial_state_check=True)
        assert np.array_equal(sampler.get_chain(), np.tile(start, (steps, 1, 1))) and move.steps == 0


@pytest.mark.parametrize(
    ("steps", "most", "sizes"),
    [
        (10, 4, [4, 4, 2]),
        (8, 4, [4, 4]),
        (3, 64, [2, 1]),
        (9, 2, [2, 2, 2, 2, 1]),
        (96, 64, [64, 32]),
        (70, 100, [64, 4, 2]),
    ],
)
def test_steps_are_cut_into_pools_of_powers_of_two_and_none_is_larger(steps, most, sizes, monkeypatch):
    asked = []

    def pooled(self, model, state, k, true=PoolMove._pooled):
        asked.append(k + 1)
        return true(self, model, state, k)

    monkeypatch.setattr(PoolMove, "_pooled", pooled)
    walked(6, steps, most)
    assert asked == [size for size in sizes if size > 1]


def test_evolution_steps_are_differences_of_two_others_of_the_same_ensemble_times_a_known_length():
    """Ensembles of three walkers in each half, on a line; lengths 2.38 / sqrt(2) and, in a fifth of the steps, one."""
    others = np.array([0.0, 1.0, 10.0, 100.0, 300.0, 1000.0])[:, None]
    x = np.repeat([7.0, -5.0], 3)[:, None]
    random, seen = np.random.RandomState(0), [[], []]
    for _ in range(2000):
        y, log_factor = EvolutionMove(2).get_proposal(x, [others], random)
        assert np.array_equal(log_factor, np.zeros(6))
        for i in range(2):
            seen[i].append((y - x)[3 * i : 3 * i + 3, 0])
    long = 2.38 / np.sqrt(2.0)
    for i, own in enumerate((others[:3, 0], others[3:, 0])):
        gaps = np.array([a - b for a in own for b in own if a != b])
        found = np.concatenate(seen[i])
        shares = [np.isclose(found, length * gap).mean() for length in (long, 1.0) for gap in gaps]
        assert shares == pytest.approx([0.8 / 6] * 6 + [0.2 / 6] * 6, abs=0.02)


def test_straightened_steps_pay_for_the_volume_that_the_map_changes():
    """Coordinates that are exponentials of straight ones: half of the steps short, none of them a whole difference."""

    class Exponential:
        def forward(self, x):
            return np.log(x), -np.log(x).sum(axis=1)

        def inverse(self, u):
            return np.exp(u)

    others, random = np.exp([[0.0], [1.0]]), np.random.RandomState(1)
    x = np.full((4000, 1), 3.0)
    y, log_factor = EvolutionMove(1, Exponential()).get_proposal(x, [others], random)
    assert log_factor == pytest.approx(np.log(y / x)[:, 0])
    moves, long = np.abs(np.log(y / x)), 2.38 / np.sqrt(2.0)
    shares = [np.isclose(moves, length).mean() for length in (long, 0.5 * long)]
    assert shares == pytest.approx([0.5, 0.5], abs=0.04) and sum(shares) == 1.0


def test_a_draw_beyond_all_numbers_has_no_weight(monkeypatch):
    """Every eighth one, such as a map makes where it overflows: the others go on as if it had not been drawn."""

    def overflowing(self, points, random, true=Components.from_cube):
        y = true(self, points, random)
        y[::8] = np.inf
        return y

    monkeypatch.setattr(Components, "from_cube", overflowing)
    places = walked(20_000, 32, 32).get_chain()[..., 0]
    assert np.isfinite(places).all()
    for at in places[::5]:
        assert stats.kstest(at, "norm").pvalue > 1e-4


def test_a_step_beyond_all_numbers_is_not_taken():
    class Overflowing(Round):
        def inverse(self, u):
            return np.where(np.arange(len(u))[:, None] % 2, np.inf, u)

    random = np.random.RandomState(1)
    x, others = random.normal(size=(2, 10, 3))
    y, log_factor = EvolutionMove(1, Overflowing()).get_proposal(x, [others], random)
    assert np.array_equal(y[1::2], x[1::2]) and (y[::2] != x[::2]).any(axis=1).all()
    assert np.array_equal(log_factor, np.zeros(10))
