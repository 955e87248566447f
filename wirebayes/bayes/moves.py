"""An emcee move that proposes from a frozen mixture, whatever the walkers' present positions."""

from typing import Any

from emcee.moves import MHMove

from wirebayes.bayes.mixture import Mixture
from wirebayes.bayes.proposal import Proposal


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
