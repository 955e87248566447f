"""emcee moves: pools of draws of a frozen proposal, and differential evolution in its straightened coordinates."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from wirebayes.inference.sampler import net
from wirebayes.inference.sampler.emcee_core import EmceeState, Move, RedBlueMove
from wirebayes.inference.sampler.mixture import Mixture
from wirebayes.inference.sampler.proposal import Proposal, components
from wirebayes.inference.sampler.transport_map import Straight
from wirebayes.numeric.typing import Array, Bools


class PoolMove(Move):  # type: ignore[misc]
    """Steps through pools of draws of a frozen proposal q, a step of another move before each.

    A walker at x has a pool of its own: x and K draws of q, each weighted by p/q. Its next K places are
    taken from the pool by weight, systematically: K equal steps around a circle from a random origin, on which
    every member of the pool has an arc as long as its share of the weights. Given the pool, x is any of its members
    with these very shares, and so is each place, independent of which x is, because the origin is: with x from p,
    every place is from p, and the last one starts the next pool. q's tails (Student-t) are heavier than the target's,
    so that p/q is bounded and the chain uniformly ergodic. To adapt q during kept draws would void the argument: fit
    it to the burn-in, then freeze it.

    The draws are not independent: with x they are a scrambled net (`wirebayes.inference.sampler.net`), which represents
    q far better than as many independent draws. All that the argument needs of them is that each is from q, and that
    their distribution given one of them is the same whichever it is.

    Metropolis-Hastings compares a walker with one draw at a time and forgets the draw it refuses. Here all draws
    compete at once. What is lost is x's share of its own pool, a memory as weak as the pool is large and as long.

    Parameters
    ----------
    proposal : Mixture or Proposal
    between : emcee Move
    steps : int
        As many as will be needed. They are cut into pools of powers of two, as a net needs it, large ones first.
    most : int
        The most steps of a pool, the one of the other move included.

    References
    ----------
    H. Tjelmeland, Using all Metropolis-Hastings proposals to estimate mean values, NTNU preprint 4/2004.
    C. Andrieu, A. Lee and M. Vihola, Uniform ergodicity of the iterated conditional SMC and geometric ergodicity of
    particle Gibbs samplers, Bernoulli 24(2), 2018 (iterated sampling importance resampling).
    """

    def __init__(self, proposal: Mixture | Proposal, between: Move, steps: int, most: int) -> None:
        self.proposal = proposal
        self.between = between
        self.steps = steps
        self.most = most
        self.components = components(proposal)
        self.coming: list[tuple[Array, Array, Bools]] = []

    def propose(self, model: Any, state: EmceeState) -> tuple[EmceeState, Bools]:
        """The next place of every walker, and which ones are new."""
        if self.coming:
            x, value, new = self.coming.pop()
            return EmceeState(x, log_prob=value, random_state=state.random_state), new
        size = 1 << (min(self.steps, self.most).bit_length() - 1)
        self.steps -= size
        state, accepted = self.between.propose(model, state)
        if size > 1:
            self.coming = self._pooled(model, state, size - 1)[::-1]
        return state, accepted

    def _pooled(self, model: Any, state: EmceeState, k: int) -> list[tuple[Array, Array, Bools]]:
        """The next k places of all walkers: (n, d), their log densities (n,), and whether they changed (n,)."""
        pool, value = self._pools(model, state, k)
        log_weight = value - self._log_proposal(pool)
        taken = _taken(log_weight, k, model.random)
        changed = np.diff(taken, axis=1, prepend=0) != 0
        walker = np.arange(len(pool))
        return [(pool[walker, i], value[walker, i], new) for i, new in zip(taken.T, changed.T, strict=True)]

    def _pools(self, model: Any, state: EmceeState, k: int) -> tuple[Array, Array]:
        """(n, 1 + k, d) each walker's place and k draws, and their log densities (n, 1 + k)."""
        x = state.coords
        n, d = x.shape
        cube = self._draws_in_cube(x, k, model.random)
        drawn = self.components.from_cube(cube.reshape(n * k, -1), model.random)
        drawn, beyond = _within(drawn, np.repeat(x, k, axis=0))
        value, *_ = model.compute_log_prob_fn(drawn)
        value = np.where(beyond, -np.inf, value)
        pool = np.concatenate([x[:, None], drawn.reshape(n, k, d)], axis=1)
        return pool, np.column_stack([state.log_prob, value.reshape(n, k)])

    def _draws_in_cube(self, x: Array, k: int, random: Any) -> Array:
        """(n, k, dimensions of the cube) points of a net around each walker (n, d), in random order."""
        around_each = net.around(self.components.to_cube(x, random), k + 1, random)
        # not in the net's own order: that goes to and fro between halves of the cube, as equal steps do not expect
        return around_each[:, 1 + random.permutation(k)]

    def _log_proposal(self, pool: Array) -> Array:
        n, size, d = pool.shape
        value = self.proposal.log_density(pool.reshape(-1, d))
        return value.reshape(n, size)


def _taken(log_weight: Array, k: int, random: Any) -> Array:
    """(n, k) members of n pools by weight: k equal steps around a circle on which each has an arc of its weight."""
    weight = np.exp(log_weight - log_weight.max(axis=1, keepdims=True))
    arc_ends = np.cumsum(weight, axis=1)
    turns = (random.uniform(size=(len(weight), 1)) + np.arange(k) / k) % 1.0
    places = turns * arc_ends[:, -1:]
    return np.array([np.searchsorted(ends, at) for ends, at in zip(arc_ends, places, strict=True)])


class EvolutionMove(RedBlueMove):  # type: ignore[misc]
    """Differential evolution within each of several ensembles side by side, in straightened coordinates u.

    There differences fit everywhere, along bends and down funnels. Symmetric in u, where the density is p |dx/du|; the
    map is frozen like the proposal, so each half's chain given the other half leaves the target invariant. A walker
    sees differences of its own ensemble alone: ensembles stay independent of each other.

    Parameters
    ----------
    ensembles : int
        Of the same even number of walkers, one after the other.
    straight : Straight, optional
        Coordinates stay as they are when left out; then a fifth of the steps is as long as differences are, from mode
        to mode.
    """

    def __init__(self, ensembles: int, straight: Straight | None = None) -> None:
        self.ensembles = ensembles
        self.straight = straight
        super().__init__(randomize_split=False)  # neighbours fall into different halves: half of every ensemble each

    def get_proposal(self, x: Array, others: Sequence[Array], random: Any) -> tuple[Array, Array]:
        """Places proposed for half of the walkers, from differences of the other half; called by emcee.

        Parameters
        ----------
        x : (n, d) array
            Walkers to move, of all ensembles one after the other.
        others : sequence of one (m, d) array
            The other half of the walkers. Each ensemble uses its own part.
        random : numpy.random.RandomState

        Returns
        -------
        y : (n, d) array
        log_factor : (n,) array
            Added to the log acceptance ratio; not zero where the map that straightens the coordinates changes volume.
        """
        u, slope = self._forward(x)
        pool, _ = self._forward(others[0])
        difference = self._differences(pool, len(x), random)
        length = random.choice(self._lengths(x.shape[1]), size=(len(x), 1))
        u = u + length * difference
        moved = self.straight.inverse(u) if self.straight else u
        y, _ = _within(moved, x)
        _, slope_there = self._forward(y)
        return y, slope - slope_there

    def _differences(self, pool: Array, n: int, random: Any) -> Array:
        """(n, d) differences, for each of n walkers between two of its own ensemble's part of the pool (m, d)."""
        each = len(pool) // self.ensembles
        first = np.repeat(np.arange(self.ensembles) * each, n // self.ensembles)
        one = random.randint(each, size=n)
        other = (one + random.randint(1, each, size=n)) % each
        return pool[first + one] - pool[first + other]

    def _lengths(self, d: int) -> tuple[float, ...]:
        """Equally likely lengths of a step in so many dimensions, in those of a difference."""
        usual = 2.38 / np.sqrt(2.0 * d)
        if self.straight is None:
            return usual, usual, usual, usual, 1.0
        return usual, 0.5 * usual  # short steps for the walker whom long ones do not serve

    def _forward(self, x: Array) -> tuple[Array, Array]:
        return self.straight.forward(x) if self.straight else (x, np.zeros(len(x)))


def _within(y: Array, x: Array) -> tuple[Array, Bools]:
    """Places (n, d), those of x where one lies beyond all numbers, as where the map overflows; which (n,) these are."""
    beyond: Bools = np.any(~np.isfinite(y), axis=1)
    return np.where(beyond[:, None], x, y), beyond
