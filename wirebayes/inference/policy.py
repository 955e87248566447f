"""What a chain has to satisfy before its draws are used."""

from dataclasses import asdict, dataclass, replace
from math import ceil
from typing import Any

# of the draws that are wanted of a posterior by itself: of a 5 % tail a thousand effective ones leave 4 to 6 %
_LEAST_SHARE = 0.25
# of the steps: one that mixes poorly would else take most of the time for little of the answer
_LEAST_STEPS = 0.1


@dataclass(frozen=True)
class Policy:
    """What a chain has to satisfy before its draws are used.

    Attributes
    ----------
    ensembles, walkers : int
        Independent ensembles, and walkers in each: an even number, for an ensemble moves in halves.
    ess : float
        Effective draws wanted of every parameter's mean and of both its 5 % tails, all ensembles together.
    r_hat : float
        Largest nested R-hat allowed.
    rounds, most_rounds : int
        Burn-in: at least so many fits of the proposal; more, up to the second number, while too few of its draws would
        be accepted or it leaves out a tail.
    round_draws : int
        Draws of the proposal that a round takes; the first three take fewer where there are few modes.
    tail : float
        A proposal leaves out a tail when the log of posterior over proposal, at its 99.9 % quantile over the posterior,
        lies this far above its median: walkers that reach such places stay there for very long.
    components : int
        The most components of the proposal.
    acceptance : float
        Below this share after burn-in, the learned move gives way to differential evolution alone.
    block, most_steps : int
        Kept steps come in blocks of this size, so that pools of draws are large; the most steps.

    Examples
    --------
    >>> wb.Policy(ess=1000).walkers
    128
    """

    ensembles: int = 4
    walkers: int = 128
    ess: float = 4000.0
    r_hat: float = 1.01
    rounds: int = 3
    round_draws: int = 4096
    most_rounds: int = 9
    tail: float = 1.5
    acceptance: float = 0.05
    components: int = 6
    block: int = 32
    most_steps: int = 4000

    def __post_init__(self) -> None:
        if self.walkers % 2:
            raise ValueError(f"walkers: {self.walkers} given, an even number is needed")

    def of_share(self, share: float) -> "Policy":
        """The same for a posterior that gives a share of the draws of an answer.

        No more than this share of the draws is wanted, down to a quarter, nor of the steps taken, down to a tenth.

        Parameters
        ----------
        share : float
            From 0 to 1.
        """
        wanted = max(share, _LEAST_SHARE)
        most_steps = ceil(max(share, _LEAST_STEPS) * self.most_steps)
        return replace(self, ess=wanted * self.ess, block=ceil(wanted * self.block), most_steps=most_steps)


DEFAULT = Policy()


def describe(policy: Policy) -> dict[str, Any]:
    """The policy as plain values, for provenance."""
    return asdict(policy)
