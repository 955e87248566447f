"""Statistics of draws: effective sample sizes, R-hat, Pareto-smoothed weights and power scaling, in numpy alone.

They are ArviZ's, to rounding (tests compare them): importing it takes pandas and xarray along, which would be a third
of the time of a fit, in every process that takes part.

References
----------
A. Vehtari, A. Gelman, D. Simpson, B. Carpenter and P.-C. Bürkner, Rank-normalization, folding, and localization: an
improved R-hat for assessing convergence of MCMC, Bayesian Analysis 16 (2021);
A. Vehtari, D. Simpson, A. Gelman, Y. Yao and J. Gabry, Pareto smoothed importance sampling, JMLR 25 (2024);
J. Zhang and M. A. Stephens, A new and efficient estimation method for the generalized Pareto distribution,
Technometrics 51 (2009);
N. Kallioinen, T. Paananen, P.-C. Bürkner and A. Vehtari, Detecting and diagnosing prior and likelihood sensitivity with
power-scaling, Statistics and Computing 34 (2024).
"""

import numpy as np
from scipy.special import logsumexp, ndtri

from wirebayes.numeric.typing import Array


def bulk_ess(values: Array) -> float:
    """Effective number of draws in the bulk, of (chains, draws): that of their normal scores."""
    return _ess(_normal_scores(_split(values)))


def tail_ess(values: Array) -> float:
    """Effective number of draws in the worse of the two 5 % tails, of (chains, draws)."""
    found = []
    for end in np.quantile(values, _TAILS):
        within = (values <= end).astype(float)
        found.append(_ess(_split(within)))
    return min(found)


def r_hat(values: Array) -> float:
    """Rank-normalised split R-hat of (chains, draws): the larger of those of location and of spread."""
    halves = _split(values)
    folded = np.abs(halves - np.median(halves))
    return max(_between_over_within(_normal_scores(part)) for part in (halves, folded))


def pareto_smoothed(log_ratio: Array, independent: float = 1.0) -> tuple[Array, float]:
    """Logarithms of weights that sum to one, their largest replaced by quantiles of a generalised Pareto distribution.

    Parameters
    ----------
    log_ratio : (n,) array
        Logarithms of density over what the draws are of.
    independent : float
        Share of the draws that are worth an independent one; the tail has 3 √(n / share) draws, or a fifth of few.

    Returns
    -------
    log_weight : (n,) array
    k : float
        Shape of the tail: above 0.7, no number of draws is enough. NaN, and nothing is replaced, where the tail has
        fewer than five draws or only one value.
    """
    return _smoothed(log_ratio, _tail_size(len(log_ratio), independent))


def power_scaled(log_component: Array, power: float) -> Array:
    """(n,) logarithms of the weights of draws for a posterior one component of which is raised to a power.

    Parameters
    ----------
    log_component : (n,) array
        Log density of the component, such as the prior, at the draws.
    """
    independent = tail_ess(log_component[None]) / log_component.size
    n = log_component.size
    size = max(min(_tail_size(n, independent), n // 2), _LEAST_TAIL)
    return _smoothed((power - 1.0) * log_component, size)[0]


def power_sensitivity(values: Array, below: Array, above: Array, powers: tuple[float, float]) -> float:
    """How far a distribution moves for each doubling of a component's power, from one power below 1 and one above.

    Parameters
    ----------
    values, below, above : (n,) arrays
        Draws, and their weights at either power.
    powers : (float, float)
    """
    moved = [
        max(cumulative_distance(values, weight), cumulative_distance(-values, weight)) for weight in (below, above)
    ]
    slopes = moved / np.abs(np.log2(powers))
    return float(slopes.mean())


def cumulative_distance(values: Array, weight: Array) -> float:
    """Cumulative Jensen-Shannon distance between (n,) draws and the same draws with weights, from 0 to 1."""
    order = np.argsort(values)
    widths = np.diff(values[order])
    n = len(values)
    share = weight[order] / weight.sum()
    plain = np.linspace(1.0 / n, 1.0 - 1.0 / n, n - 1)
    weighted = np.cumsum(share)[:-1]
    middle = 0.5 * (plain + weighted)
    plain_area = float(plain @ widths)
    weighted_area = float(weighted @ widths)
    shift = weighted_area - plain_area
    diverged = _diverged(plain, middle, widths, shift)
    diverged += _diverged(weighted, middle, widths, -shift)
    squared = diverged / (plain_area + weighted_area)
    return float(np.sqrt(squared))


def _diverged(share: Array, middle: Array, widths: Array, excess: float) -> float:
    """Cumulative divergence of one distribution from the middle of two; the other's area exceeds its own by so much."""
    log_ratio = _log2(share) - _log2(middle)
    integral = widths @ (share * log_ratio)
    return max(0.0, float(integral + 0.5 / np.log(2.0) * excess))


def _log2(share: Array) -> Array:
    """Logarithms of shares, 0 where there is none."""
    return np.log2(share, out=np.zeros_like(share), where=share != 0.0)


def _split(values: Array) -> Array:
    """The two halves of (chains, draws) as chains of their own; without the middle draw of an odd number."""
    half = values.shape[1] // 2
    return np.vstack([values[:, :half], values[:, -half:]])


def _normal_scores(values: Array) -> Array:
    """Normal quantiles of the ranks of all values; equal ones share the mean of their ranks."""
    _, place, count = np.unique(values, return_inverse=True, return_counts=True)
    rank = np.cumsum(count) - 0.5 * (count - 1.0)
    scores: Array = ndtri((rank - 0.375) / (values.size + 0.25))  # Blom's
    return scores[place.reshape(values.shape)]


def _between_over_within(chains: Array) -> float:
    """R-hat of (chains, draws) as they are."""
    n = chains.shape[1]
    between = n * chains.mean(axis=1).var(ddof=1)
    within = chains.var(axis=1, ddof=1).mean()
    return float(np.sqrt((between / within + n - 1.0) / n))


def _ess(chains: Array) -> float:
    """Effective number of draws of the mean of (chains, draws), by Geyer's initial monotone sequence."""
    size = chains.size
    if np.ptp(chains) < _SAME:
        return float(size)
    correlation = _autocorrelation(chains)
    steps = chains.shape[1]
    most = max((steps - 1) // 2, 1)
    in_twos = correlation[: 2 * most].reshape(-1, 2)
    pairs = in_twos.sum(axis=1)
    ends = np.flatnonzero(pairs <= 0.0)
    last = len(pairs) - 1
    if len(ends):
        last = int(ends[0])
    rest = float(correlation[2 * last])  # of this pair only the first correlation counts, and once
    if not pairs[last] >= 0.0:
        rest = max(rest, 0.0)
    falling = np.minimum.accumulate(pairs[:last])
    time = -1.0 + 2.0 * float(falling.sum()) + rest
    shortest = 1.0 / np.log10(size)
    return float(size / max(time, shortest))


def _autocorrelation(chains: Array) -> Array:
    """(lags,) autocorrelation of all (chains, draws) together, chains that are apart included."""
    m, n = chains.shape
    covariance = _autocovariance(chains).mean(axis=0)
    between = chains.mean(axis=1).var(ddof=1) if m > 1 else 0.0
    within = covariance[0] * n / (n - 1.0)
    correlation = 1.0 - (within - covariance) / (covariance[0] + between)
    correlation[0] = 1.0
    return correlation


def _autocovariance(chains: Array) -> Array:
    """(chains, lags) autocovariance of (chains, draws), each about the mean of its chain."""
    n = chains.shape[1]
    away = chains - chains.mean(axis=1, keepdims=True)
    padded = 1 << (2 * n - 1).bit_length()  # so that the ends do not meet
    spectrum = np.fft.rfft(away, padded, axis=1)
    product = np.fft.irfft(spectrum * spectrum.conj(), padded, axis=1)
    return product[:, :n] / n


def _tail_size(n: int, independent: float) -> int:
    """How many of n draws make up the tail, each worth a share of an independent one."""
    if n * independent > _FEW:
        return int(3.0 * np.sqrt(n / independent))
    return n // 5


def _smoothed(log_ratio: Array, size: int) -> tuple[Array, float]:
    """Weights whose `size` largest are those of a generalised Pareto distribution, and its shape."""
    log_weight = log_ratio - log_ratio.max()
    order = np.argsort(log_weight)
    largest = order[-size:]
    below = order[-size - 1]
    threshold = float(np.exp(log_weight[below]))
    excess = np.exp(log_weight[largest]) - threshold
    shape = scale = np.nan
    if size >= _LEAST_TAIL and np.ptp(excess) > 0.0:
        shape, scale = pareto_fit(excess)
    if np.isfinite(shape):
        quantiles = _pareto_quantiles(shape, size)
        smooth = np.log(threshold + scale * quantiles)
        log_weight[largest] = np.minimum(smooth, 0.0)
    normalised = log_weight - logsumexp(log_weight)
    return normalised, shape


def _pareto_quantiles(shape: float, size: int) -> Array:
    """(size,) evenly spaced quantiles of a generalised Pareto distribution of unit scale."""
    level = (np.arange(size) + 0.5) / size
    hazard = -np.log1p(-level)
    if shape == 0.0:
        return hazard
    return np.expm1(shape * hazard) / shape


def pareto_fit(excess: Array) -> tuple[float, float]:
    """Shape and scale of a generalised Pareto distribution, by Zhang and Stephens' posterior mean on a grid.

    The shape is drawn towards a half, as ten more values would draw it.

    Parameters
    ----------
    excess : (n,) array
        Values above the threshold, in ascending order.

    Returns
    -------
    float, float
        NaN where a quarter of the values stand on the threshold: then there is no such tail.
    """
    n = len(excess)
    quarter = int(n / 4 + 0.5)
    quartile = excess[quarter - 1]
    if not quartile > 0.0:
        return np.nan, np.nan
    rates = _rates_to_try(excess, quartile)
    rate = _mean_rate(excess, rates)
    logarithms = np.log1p(-rate * excess)
    shape = float(logarithms.mean())
    scale = -shape / rate
    towards_a_half = (n * shape + 5.0) / (n + 10.0)
    return towards_a_half, scale


def _mean_rate(excess: Array, rates: Array) -> float:
    """The rate's posterior mean over those on a grid."""
    products = -rates[:, None] * excess
    shapes = np.log1p(products).mean(axis=1)
    log_likelihood = len(excess) * (np.log(-rates / shapes) - shapes - 1.0)
    log_weight = log_likelihood - logsumexp(log_likelihood)
    weight = np.exp(log_weight)
    weight = np.where(weight < _NEGLIGIBLE, 0.0, weight)
    return float(rates @ weight / weight.sum())


def _rates_to_try(excess: Array, quartile: float) -> Array:
    """Zhang and Stephens' grid of the rate, which is minus shape over scale; `quartile` is that of the values."""
    steps = 30 + int(np.sqrt(len(excess)))
    below_one = 1.0 - np.sqrt(steps / (np.arange(steps) + 0.5))
    return below_one / (3.0 * quartile) + 1.0 / excess[-1]


_TAILS = (0.05, 0.95)  # the ends of a 90 % interval
_FEW = 225  # independent draws, up to which the tail is a fifth of all
_LEAST_TAIL = 5  # draws that a tail is fitted to
_SAME = 1e-15  # range of values that do not vary
_NEGLIGIBLE = 10.0 * float(np.finfo(float).eps)  # weight of a point of the grid
