"""Where a posterior leans on a prior: intervals that would move if the prior were twice as wide."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wirebayes.model.column_units import parameter_of
from wirebayes.model.prior import Prior
from wirebayes.model.sample import NOISES, SAMPLE
from wirebayes.numeric.any_distribution import log_density_of, ours
from wirebayes.numeric.distributions import HalfCauchy, HalfNormal, LogitNormal, LogNormal, Normal
from wirebayes.numeric.typing import Array
from wirebayes.result_warnings import Notice
from wirebayes.sentences import listed

WIDER = 2.0  # times as wide: a prior that two people may well disagree about
MOVED = 1.0  # posterior standard deviations by which an end of the 90 % interval moves


def leaning(prior: Prior, theta: Array, columns: Sequence[str]) -> list[Notice]:
    """A sentence on the priors that decide an interval, or none.

    The posterior under a wider prior is that of the draws, weighted by the ratio of the two priors. The prior of a
    noise may decide what is known of that noise and of the preload: a few holds never tell how well they were set, and
    nothing that is said of the wire depends on it. Intervals are those of what the priors are of, as B at the test's
    tension: by how much B at 1 N moves depends on what is called a newton.

    Parameters
    ----------
    theta : (n, d) array
        Draws of the posterior, in the prior's columns.
    columns : sequence of str
        Which priors are looked at.
    """
    known = prior.known(theta)
    deciding: list[str] = []
    open_ones: set[int] = set()
    intervals = _Intervals.of(known)
    for name in columns:
        distribution = prior.distributions[name]
        wide = _wider(distribution)
        if wide is None:
            continue
        own = known[:, prior.names.index(name)]
        log_weight = log_density_of(wide)(own) - log_density_of(distribution)(own)
        weight = np.exp(log_weight - log_weight.max())
        moved = intervals.moved(weight)
        of_sample = all(parameter_of(prior.names[j]) in SAMPLE for j in moved)
        is_a_noise = parameter_of(name) in NOISES
        if moved and not (is_a_noise and of_sample):
            deciding.append(name)
            open_ones.update(moved)
    if not deciding:
        return []
    moved_names = [prior.names[j] for j in sorted(open_ones)]
    return [_notice(deciding, moved_names)]


@dataclass(frozen=True)
class _Intervals:
    """Intervals of columns (n, d): the sorted draws, how to sort them, (d, n), and the intervals' ends and widths."""

    ordered: Array
    order: Array
    ends: Array
    spread: Array

    @classmethod
    def of(cls, known: Array) -> "_Intervals":
        order = np.argsort(known.T, axis=1)
        ordered = np.take_along_axis(known.T, order, axis=1)
        spread = np.maximum(known.std(axis=0, ddof=1), np.finfo(float).tiny)
        return cls(ordered, order, np.quantile(known, _ENDS, axis=0), spread)

    def moved(self, weight: Array) -> list[int]:
        """The columns of which an end moves far when draws are weighted."""
        columns = zip(self.ordered, self.order, strict=True)
        after = np.stack([_weighted_ends(values, weight[order]) for values, order in columns], 1)
        shift = np.abs(after - self.ends).max(axis=0)
        return [int(column) for column in np.flatnonzero(shift > MOVED * self.spread)]


_ENDS = (0.05, 0.95)  # of the interval that is reported


def _weighted_ends(ordered: Array, weight: Array) -> Array:
    """(2,) the ends of the 90 % interval of weighted draws (n,), in rising order."""
    share = (np.cumsum(weight) - 0.5 * weight) / weight.sum()
    return np.interp(_ENDS, share, ordered)


def _wider(distribution: Any) -> Any:
    """The same distribution twice as wide; None where its ends say what is possible, as uniform ones do."""
    match ours(distribution):
        case LogNormal() as known:
            return replace(known, sd_log=WIDER * known.sd_log)
        case Normal() | HalfNormal() | LogitNormal() as known:
            return replace(known, sd=WIDER * known.sd)
        case HalfCauchy() as known:
            return replace(known, scale=WIDER * known.scale)
    return None


def _notice(deciding: Sequence[str], moved: Sequence[str]) -> Notice:
    named = listed(deciding)
    whose, decides = ("prior", "its prior does") if len(deciding) == 1 else ("priors", "their priors do")
    what = f"the interval of {moved[0]}" if len(moved) == 1 else f"the intervals of {listed(moved)}"
    tables = [f"[prior.{parameter_of(name)}]" for name in deciding]
    keys = ", ".join(dict.fromkeys(tables))
    return Notice(
        "prior",
        f"with the {whose} of {named} twice as wide, {what} would move by more than a standard deviation: the readings "
        f"do not decide {named}, {decides}; state what is known of {named} ({keys})",
    )
