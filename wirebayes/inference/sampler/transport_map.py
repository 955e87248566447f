"""A triangular map that straightens points: each coordinate minus its mean, over its scale, given those before it.

The mean is a quadratic and the logarithm of the scale a linear function of the preceding coordinates: a curved ridge
and a funnel (a setting error that widens everything it allows) become nearly round. What follows an amount that is
sampled by a score (`wirebayes.inference.coordinates.shares`) follows the amount, not the score, which goes on where the
amount is next to nothing: in means and scales its share stands for it. The residual of each coordinate is made
symmetric (`wirebayes.inference.sampler.symmetry`), for skewed marginals such as that of an exponent U whose lower end
the data hardly bound. Heavy tails are left to the mixtures: they seldom belong to one coordinate alone. The map is
triangular, so its Jacobian is the product of the slopes, and it has an inverse for any coefficients. Outside the range
of the points to which it was fitted, quadratics continue as straight lines and scales keep their value at the border.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from scipy.special import ndtr

from wirebayes.inference.sampler.points import WeightedPoints
from wirebayes.inference.sampler.settings import (
    ALTERNATIONS,
    CLEAR,
    FEW,
    MOST_PAIRS,
    POINTS_A_TERM,
    RIDGE,
    SETTLED,
)
from wirebayes.inference.sampler.symmetry import fitted_shapes, made_skewed, made_symmetric
from wirebayes.numeric.typing import Array, Bools, Ints


@dataclass(frozen=True)
class Straight:
    """Coefficients, the columns taken in an order of their own.

    Attributes
    ----------
    order : (d,) array of int
    centre, scale : (d,) arrays
        Of the points fitted, in the map's own order.
    scores : (s,) array of int
        Which coordinates are scores of shares.
    share_centre, share_scale : (s,) arrays
        Of their shares.
    low, high : (d,) arrays
        The range of the standardised points, of scores that of the shares.
    constant : (d,) array
    linear : (d, d) array, strictly lower triangular
    quadratic : (d, d, d) array
        ``quadratic[j]``, symmetric, is the second derivative of j's mean by the coordinates before it.
    log_scale : (d, d + 1) array
        A constant and what multiplies the coordinates before.
    least, most : (d,) arrays
        The range of the logarithm of the scale.
    shape : (3, d) array
        Location, scale and skewness of what is left.
    """

    order: Ints
    centre: Array
    scale: Array
    scores: Ints
    share_centre: Array
    share_scale: Array
    low: Array
    high: Array
    constant: Array
    linear: Array
    quadratic: Array
    log_scale: Array
    least: Array
    most: Array
    shape: Array

    def to_arrays(self) -> dict[str, Any]:
        """What `from_arrays` makes the same map of."""
        return {each.name: getattr(self, each.name) for each in fields(self)}

    @staticmethod
    def from_arrays(arrays: Mapping[str, Any]) -> "Straight":
        """The map that gave these arrays."""
        return Straight(**arrays)

    def forward(self, x: Array) -> tuple[Array, Array]:
        """(n, d) straightened points and the (n,) logarithm of the map's Jacobian, of points (n, d)."""
        # points last: sums over coordinates are several times as fast
        v = np.ascontiguousarray(((x[:, self.order] - self.centre) / self.scale).T)
        before = self._regressors(x, v)
        mean = self._means(before)
        log_scale = self.log_scale[:, 1:] @ before + self.log_scale[:, :1]
        log_scale = np.clip(log_scale, self.least[:, None], self.most[:, None])
        left = (v - mean) * np.exp(-log_scale)
        u, slopes = made_symmetric(left, self.shape[:, :, None])
        log_jacobian = np.log(slopes.prod(axis=0)) - log_scale.sum(axis=0) - np.log(self.scale).sum()
        return u.T, log_jacobian

    def _regressors(self, x: Array, v: Array) -> Array:
        """(d, n) what means and scales depend on: the standardised points (d, n), and the shares in place of scores."""
        if not len(self.scores):
            return v
        share = ndtr(x[:, self.order[self.scores]]).T
        regressors = v.copy()
        regressors[self.scores] = self._standardised_share(share, slice(None))
        return regressors

    def _means(self, before: Array) -> Array:
        """(d, n) mean of each coordinate, given those before it; a straight line beyond the points fitted."""
        held = np.clip(before, self.low[:, None], self.high[:, None])
        bend = before - 0.5 * held
        mean = self.linear @ before + self.constant[:, None]
        for j in range(1, len(mean)):
            slope = self.quadratic[j, :j, :j] @ held[:j]
            mean[j] += (slope * bend[:j]).sum(axis=0)
        return mean

    def inverse(self, u: Array) -> Array:
        """(n, d) points of straightened ones."""
        left = made_skewed(np.ascontiguousarray(u.T), self.shape[:, :, None])
        v = np.zeros_like(left)
        regressors = np.zeros_like(left)
        held = np.zeros_like(left)
        for j in range(len(v)):
            before = regressors[:j]
            mean = self._mean(j, before, held[:j])
            v[j] = mean + left[j] * np.exp(self._log_scale(j, before))
            regressors[j] = self._regressor(j, v[j])
            held[j] = np.clip(regressors[j], self.low[j], self.high[j])
        x = np.empty(v.T.shape)
        x[:, self.order] = v.T * self.scale + self.centre
        return x

    def _regressor(self, j: int, v: Array) -> Array:
        """(n,) what later coordinates depend on: the standardised coordinate j (n,), of a score its share."""
        is_score = self.scores == j
        if not is_score.any():
            return v
        share = ndtr(v * self.scale[j] + self.centre[j])
        return self._standardised_share(share, is_score)

    def _standardised_share(self, share: Array, which: slice | Bools) -> Array:
        """(k, n) what stands for k of the scores in means and scales, by their shares (k, n)."""
        return (share - self.share_centre[which, None]) / self.share_scale[which, None]

    def _mean(self, j: int, before: Array, inside: Array) -> Array:
        """(n,) of coordinate j by those before it (j, n), and by these kept in the range of the points fitted."""
        mean = self.constant[j] + self.linear[j, :j] @ before
        bend = self.quadratic[j, :j, :j] @ inside
        mean += (bend * (before - 0.5 * inside)).sum(axis=0)
        return mean

    def _log_scale(self, j: int, before: Array) -> Array:
        """(n,) of coordinate j by those before it (j, n)."""
        log_scale = self.log_scale[j, 0] + self.log_scale[j, 1 : j + 1] @ before
        return np.clip(log_scale, self.least[j], self.most[j])


def fit_map(points: WeightedPoints, order: Ints, scores: Sequence[int] = ()) -> Straight:
    """The map that straightens points: weighted regressions, coordinate by coordinate.

    Parameters
    ----------
    points : WeightedPoints
        Of n places (n, d).
    order : (d,) array of int
        In which coordinates are straightened.
    scores : sequence of int
        Coordinates that are scores of shares.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the points do not span their space.
    """
    x = points.z[:, order]
    weight = points.weight
    d = x.shape[1]
    worth = weight.sum()
    v, centre, scale = _standardised(x, weight)
    scored = np.flatnonzero(np.isin(order, scores))
    shares, share_centre, share_scale = _standardised(ndtr(x[:, scored]), weight)
    if not ((scale > 0).all() and (share_scale > 0).all()):
        raise np.linalg.LinAlgError("the points do not span their space")
    before = v.copy()
    before[:, scored] = shares
    clear = CLEAR * np.sqrt(worth / points.distinct)  # draws that repeat know no more
    every = d**3 / 6.0 < worth / POINTS_A_TERM
    found = [_straighten(v[:, j], before[:, :j], d, weight, clear, every) for j in range(d)]
    spread = np.column_stack([one.spread for one in found])
    left = np.column_stack([one.left for one in found])
    if not np.isfinite(left).all():
        raise np.linalg.LinAlgError("the points do not settle the scales")
    return Straight(
        order=order,
        centre=centre,
        scale=scale,
        scores=scored,
        share_centre=share_centre,
        share_scale=share_scale,
        low=before.min(axis=0),
        high=before.max(axis=0),
        least=spread.min(axis=0),
        most=spread.max(axis=0),
        shape=fitted_shapes(left, weight),
        **_coefficients(found),
    )


def _standardised(x: Array, weight: Array) -> tuple[Array, Array, Array]:
    """Weighted points (n, k) in standard deviations from their mean, and mean and standard deviations (k,)."""
    worth = weight.sum()
    centre = weight @ x / worth
    scale = np.sqrt(weight @ (x - centre) ** 2 / worth)
    return (x - centre) / np.maximum(scale, 1e-300), centre, scale


def _coefficients(found: Sequence["_Straightened"]) -> dict[str, Array]:
    """The coefficients of all coordinates, each kind in one array, under their names in `Straight`."""
    d = len(found)
    constant = np.zeros(d)
    linear = np.zeros((d, d))
    quadratic = np.zeros((d, d, d))
    log_scale = np.zeros((d, d + 1))
    for j, own in enumerate(found):
        constant[j] = own.of_mean[0]
        linear[j, :j] = own.of_mean[1 : j + 1]
        of_pairs = own.of_mean[j + 1 :]
        one, other = own.pairs
        np.add.at(quadratic[j], (one, other), of_pairs)
        np.add.at(quadratic[j], (other, one), of_pairs)
        log_scale[j, : j + 1] = own.of_scale
    return {"constant": constant, "linear": linear, "quadratic": quadratic, "log_scale": log_scale}


@dataclass(frozen=True)
class _Straightened:
    """One coordinate by those before it: coefficients of its mean and of its log scale, and what they leave.

    Attributes
    ----------
    pairs : (2, k) array of int
        The coordinates whose products the mean has, after a constant and the coordinates themselves.
    of_mean : (1 + j + k,) array
    of_scale : (1 + j,) array
    spread, left : (n,) arrays
        Log scales, and deviations from the mean in units of the scale.
    """

    pairs: Ints
    of_mean: Array
    of_scale: Array
    spread: Array
    left: Array


def _straighten(y: Array, before: Array, d: int, weight: Array, clear: float, every: bool) -> _Straightened:
    """Regress one of d coordinates on those before it and on products of two: all, or in many dimensions a few."""
    j = before.shape[1]
    lines = np.column_stack([np.ones(len(y)), before])
    many = d > FEW
    pairs = np.array(np.triu_indices(j if every or many else 0))
    products = before[:, pairs[0]] * before[:, pairs[1]]
    if many and not every:
        clearest = _seen_at_once(products, lines, y, weight, clear)
        pairs = pairs[:, clearest]
        products = products[:, clearest]
    terms = np.column_stack([lines, products])
    of_mean, of_scale, t = _regress(terms, lines, y, weight)
    # Far out a bend that is only noise throws everything aside: none without evidence.
    kept = np.abs(t[j + 1 :]) > clear
    if not kept.all():
        pairs = pairs[:, kept]
        terms = terms[:, np.append(np.ones(j + 1, bool), kept)]
        of_mean, of_scale, _ = _regress(terms, lines, y, weight, of_scale)
    spread = lines @ of_scale
    off_mean = y - terms @ of_mean
    return _Straightened(pairs, of_mean, of_scale, spread, left=off_mean * np.exp(-spread))


def _seen_at_once(products: Array, lines: Array, y: Array, weight: Array, clear: float) -> Ints:
    """The products that, alone, clearly explain what straight lines leave of y; the clearest few.

    In many dimensions there are too many pairs to fit all together.

    Parameters
    ----------
    products : (n, k) array
        Of pairs of coordinates.
    lines : (n, 1 + j) array
        A constant, and the coordinates before y.
    y, weight : (n,) arrays
    clear : float
        The t value from which on something is clear.
    """
    if not products.shape[1]:
        return np.arange(0)
    root = np.sqrt(weight)[:, None]
    both = root * np.column_stack([products, y])
    basis, _ = np.linalg.qr(root * lines)
    left = both - basis @ (basis.T @ both)
    size = np.sqrt((left**2).sum(axis=0))
    size = np.maximum(size, 1e-300)
    along = np.abs(left[:, :-1].T @ left[:, -1])
    correlation = along / (size[:-1] * size[-1])
    t = correlation * np.sqrt(weight.sum())
    clearest = np.argsort(-t, kind="stable")[:MOST_PAIRS]
    best = clearest[t[clearest] > clear]
    best.sort()
    return best


def _regress(
    terms: Array, lines: Array, y: Array, weight: Array, of_scale: Array | None = None
) -> tuple[Array, Array, Array]:
    """Coefficients of the mean and of the log scale of y, each fitted in turn given the other; the mean's t values.

    `weight` (n,) is that of the rows, `of_scale` is what the log scale is sought from.
    """
    worth = weight.sum()
    if of_scale is None:
        of_scale = np.zeros(lines.shape[1])
    prior = _weak_prior(terms, worth)
    information = 2.0 * (lines.T * weight) @ lines
    information = information + _weak_prior(lines, worth)
    for _ in range(ALTERNATIONS):
        precision = _precision(lines, of_scale)
        weighted = terms.T * _of_worth(weight * precision, worth)
        of_mean = np.linalg.solve(weighted @ terms + prior, weighted @ y)
        # a point far out says where the scale grows, but no single one decides
        square = np.minimum((y - terms @ of_mean) ** 2 * precision, 9.0)
        slope = lines.T @ (weight * (square - 1.0))
        step = np.linalg.solve(information, slope)
        of_scale = of_scale + step
        moved = lines @ step
        if weight @ moved**2 < SETTLED**2 * worth:
            break
    by_scale = _of_worth(weight * _precision(lines, of_scale), worth)
    errors = _standard_errors(terms, y - terms @ of_mean, by_scale, worth)
    return of_mean, of_scale, of_mean / errors


def _weak_prior(terms: Array, worth: Any) -> Array:
    """Information (k, k) that keeps coefficients of terms (n, k) finite, where the points' weights sum to so much."""
    return RIDGE * worth * np.eye(terms.shape[1])


def _standard_errors(terms: Array, left: Array, weight: Array, worth: Any) -> Array:
    """(k,) of the coefficients of terms (n, k), by what these leave (n,) of weighted points."""
    information = (terms.T * weight) @ terms + _weak_prior(terms, worth)
    variance = weight @ left**2 / worth
    return np.sqrt(variance * np.diag(np.linalg.inv(information)))


def _precision(lines: Array, of_scale: Array) -> Array:
    """(n,) 1 / variance of y by the coefficients of its log scale, within limits."""
    log_scale = np.clip(lines @ of_scale, -6.0, 3.0)
    return np.exp(-2.0 * log_scale)


def _of_worth(weight: Array, worth: Any) -> Array:
    """Weights that sum to so much."""
    return weight * (worth / weight.sum())
