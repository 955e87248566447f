"""emcee moves that know what was learned: from a frozen proposal, and differential evolution in its straight places."""

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


class StraightEvolutionMove(RedBlueMove):  # type: ignore[misc]
    """Differential evolution in straightened coordinates u: along bends and down funnels, differences fit everywhere.

    Symmetric in u, where the density is p |dx/du|; the map is frozen like the proposal, so each half's chain given the
    other half leaves the target invariant.
    """

    def __init__(self, straight: Straight) -> None:
        self.straight = straight
        super().__init__()

    def get_proposal(self, x: Array, others: Sequence[Array], random: Any) -> tuple[Array, Array]:
        """Places (n, d) proposed for walkers at (n, d), from differences of the other half, and log factors (n,)."""
        (n, d), (u, slope) = x.shape, self.straight.forward(x)
        pool, _ = self.straight.forward(np.concatenate(others))
        one = random.randint(len(pool), size=n)
        other = (one + random.randint(1, len(pool), size=n)) % len(pool)
        # short steps for the walker whom long ones do not serve
        length = 2.38 / np.sqrt(2.0 * d) * random.choice(_LENGTHS, size=(n, 1))
        y = self.straight.inverse(u + length * (pool[one] - pool[other]))
        return y, slope - self.straight.forward(y)[1]


_LENGTHS = (1.0, 0.5)
