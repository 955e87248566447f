"""emcee moves: from a frozen proposal, and differential evolution in the coordinates that it straightens."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from emcee.moves import MHMove, RedBlueMove
from numpy.typing import NDArray

from wirebayes.bayes.mixture import Mixture
from wirebayes.bayes.proposal import Proposal
from wirebayes.bayes.straighten import Straight

Array = NDArray[Any]


class IndependenceMove(MHMove):  # type: ignore[misc]
    """Metropolis-Hastings with an independent proposal q: accepts with min(1, p(y) q(x) / (p(x) q(y))).

    The proposal neither depends on the walker nor changes while draws are kept, so each walker's chain leaves the
    target invariant; q's tails (Student-t) are heavier than the target's, which keeps the chain uniformly ergodic
    wherever p/q is bounded. Adapting q during kept draws would void the argument: fit it to the burn-in, then freeze.
    """

    def __init__(self, proposal: Mixture | Proposal) -> None:
        self.proposal = proposal
        super().__init__(self._propose)

    def _propose(self, x: Any, random: Any) -> tuple[Any, Any]:
        y = self.proposal.rvs(len(x), random)
        return y, self.proposal.log_density(x) - self.proposal.log_density(y)


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
        Coordinates as they are when left out; then a fifth of the steps is as long as differences are, from mode to
        mode.
    """

    def __init__(self, ensembles: int, straight: Straight | None = None) -> None:
        self.ensembles = ensembles
        self.straight = straight
        super().__init__(randomize_split=False)  # neighbours fall into different halves: half of every ensemble each

    def get_proposal(self, x: Array, others: Sequence[Array], random: Any) -> tuple[Array, Array]:
        """Places (n, d) proposed for walkers at (n, d), from differences of the other half, and log factors (n,)."""
        (n, d), each = x.shape, len(others[0]) // self.ensembles
        (u, slope), (pool, _) = self._forward(x), self._forward(others[0])
        one = random.randint(each, size=n)
        other = (one + random.randint(1, each, size=n)) % each
        own = np.repeat(np.arange(self.ensembles) * each, n // self.ensembles)
        scale = 2.38 / np.sqrt(2.0 * d)
        # short steps for the walker whom long ones do not serve
        lengths = (scale, 0.5 * scale) if self.straight else (scale, scale, scale, scale, 1.0)
        u = u + random.choice(lengths, size=(n, 1)) * (pool[own + one] - pool[own + other])
        y = self.straight.inverse(u) if self.straight else u
        return y, slope - self._forward(y)[1]

    def _forward(self, x: Array) -> tuple[Array, Array]:
        return self.straight.forward(x) if self.straight else (x, np.zeros(len(x)))
