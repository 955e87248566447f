"""Autocorrelation, effective sample size, and whether independent ensembles agree."""

import numpy as np

from wirebayes.numeric.typing import Array

ENOUGH = 5.0  # autocorrelation times that steps must span, lest the time itself be cut short by them


def autocorrelation_steps(values: Array) -> Array:
    """(d,) integrated autocorrelation time in steps, of (ensembles, steps, walkers, d) draws.

    The variance of walkers' means about the mean of all, in units of what independent steps would give. No lag is cut
    off, so a weak memory that lasts is counted in full, walkers stuck apart lengthen the time, and the error is
    sqrt(2 / walkers), however long they walked. Walkers must be many, and know little of one another.
    """
    steps = values.shape[1]
    d = values.shape[-1]
    means = values.mean(axis=1).reshape(-1, d)
    variance = values.reshape(-1, d).var(axis=0)
    moving = variance > 0
    between = means.var(axis=0, ddof=1) / np.where(moving, variance, 1.0)
    return np.where(moving, steps * between, np.inf)


def slowest_autocorrelation_steps(values: Array) -> Array:
    """(d,) the longest of three autocorrelation times in steps: of the values, and of falling into either 5 % tail.

    Intervals need the tails, which a sampler may know worse than the mean.

    Parameters
    ----------
    values : (ensembles, steps, walkers, d) array
    """
    return np.maximum.reduce([autocorrelation_steps(each) for each in _with_tails(values)])


def farthest_apart(first: Array, second: Array) -> float:
    """Largest distance between means of two sets of draws, or between shares in a 5 % tail, in standard errors.

    Errors are known from the spread of the walkers' means, as in `autocorrelation_steps`.

    Parameters
    ----------
    first, second : (ensembles, steps, walkers, d) arrays
        Of any numbers of steps.
    """
    steps = first.shape[1]
    worst = 0.0
    for each in _with_tails(np.concatenate([first, second], axis=1)):
        of_first = _walker_means(each[:, :steps])
        of_second = _walker_means(each[:, steps:])
        variance = sum(means.var(axis=0, ddof=1) / len(means) for means in (of_first, of_second))
        error = np.sqrt(variance)
        apart = np.abs(of_second.mean(axis=0) - of_first.mean(axis=0))
        in_errors = apart / np.where(error > 0, error, 1.0)
        worst = max(worst, float(in_errors.max()))
    return worst


def _walker_means(draws: Array) -> Array:
    """(ensembles walkers, d) means over the steps of draws (ensembles, steps, walkers, d)."""
    return draws.mean(axis=1).reshape(-1, draws.shape[-1])


def _with_tails(values: Array) -> tuple[Array, Array, Array]:
    """(ensembles, steps, walkers, d) draws, and which of them are in the lower and in the upper 5 % tail."""
    low, high = np.quantile(values.reshape(-1, values.shape[-1]), _TAILS, axis=0)
    return values, values < low, values > high


def nested_r_hat(values: Array) -> Array:
    """(d,) nested R-hat of (ensembles, steps, walkers, d) draws, each ensemble a super-chain of its walkers."""
    walker_means = values.mean(axis=1)
    between_walkers = walker_means.var(axis=1, ddof=1)
    within_walkers = values.var(axis=1, ddof=1).mean(axis=1)
    between = walker_means.mean(axis=1).var(axis=0, ddof=1)
    return np.sqrt(1.0 + between / (between_walkers + within_walkers).mean(axis=0))


_TAILS = (0.05, 0.95)  # the ends of a 90 % interval, as ArviZ's tail ESS has them
