"""What a proposal overlooks: places of kept draws, or of the search before them, that it makes far too little of."""

import numpy as np

from wirebayes.inference.sampler.points import WeightedPoints
from wirebayes.inference.sampler.settings import LOOKED_AT, NEXT_TO_NOTHING, OUTWEIGHS, WIDEST
from wirebayes.inference.sampler.state import Learned
from wirebayes.numeric.evenly import evenly
from wirebayes.numeric.typing import Array, Bools


def overlooked_nats(learned: Learned, z: Array, value: Array) -> tuple[float, float]:
    """How far places that matter lie above what the frozen proposal makes of them, in nats.

    The log of posterior over proposal, less its median over the posterior, is taken at its 99.9 % quantile over kept
    draws, and at its 99 % quantile over the rough draws that the search left. A neck into which few walkers found their
    way, and stayed, shows in the first, a mode that they lost in the second. Of the search's draws, those do not count
    where even a hill as wide as the prior would hold next to nothing: where annealing lost most of its rows, copies of
    such places are what it ended with.

    Parameters
    ----------
    learned : Learned
        The proposal and, as `witness`, what the search left.
    z : (n, d) array
        Kept draws, in the coordinates that are sampled.
    value : (n,) array
        Their log posterior densities.

    Returns
    -------
    of_kept, of_search : float
    """
    some = evenly(len(z), LOOKED_AT)
    over = value[some] - learned.proposal.log_density(z[some])
    middle, high = np.quantile(over, [0.5, 0.999])
    return float(high - middle), _nats_of_search(learned, middle)


def left_by_search(learned: Learned, middle: float) -> WeightedPoints | None:
    """The places that matter of those that the search left, where the proposal overlooks some of them.

    All of them: a proposal that was told only what it overlooks now would overlook others next time.

    Parameters
    ----------
    learned : Learned
    middle : float
        The usual log of posterior over proposal.

    Returns
    -------
    WeightedPoints or None
        With their log densities as one more column.
    """
    if learned.witness is None or _nats_of_search(learned, middle) <= OUTWEIGHS:
        return None
    places = np.column_stack(learned.witness)
    return WeightedPoints.equal(places[_matters(*learned.witness, middle)])


def _nats_of_search(learned: Learned, middle: float) -> float:
    """How far what the search left lies above what the proposal makes of it."""
    if learned.witness is None:
        return 0.0
    z, value = learned.witness
    left = np.where(_matters(z, value, middle), value - learned.proposal.log_density(z), middle)
    return float(np.quantile(left, 0.99) - middle)


def _matters(z: Array, value: Array, middle: float) -> Bools:
    """Where a hill as wide as the prior would hold more than next to nothing.

    Parameters
    ----------
    z : (n, d) array
    value : (n,) array
        Log densities there.
    middle : float
        The usual log of posterior over proposal.
    """
    return value + z.shape[1] * WIDEST > middle + NEXT_TO_NOTHING
