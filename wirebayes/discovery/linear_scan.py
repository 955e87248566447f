"""A fitted plain model, linearised: residuals, what the parameters can absorb, and what each effect would add.

Everything later rests on inner products in the metric ``V0(ρ) = I + ρ K Kᵀ`` of readings divided by their standard
deviation: K is the derivative by the setting errors, ρ their unknown size relative to the sensor's error. The overall
scale of the noise is integrated out and ρ is summed over a grid, so no test relies on the noise that a possibly wrong
model has estimated.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wirebayes.discovery import smooth_reference
from wirebayes.discovery.probes import Probe, forms
from wirebayes.discovery.scans import Pieces, Scan, joined
from wirebayes.discovery.tangent import (
    LARGEST_SLOPE,
    Tangent,
    around_points,
    block_diagonal,
    damp,
    moving_columns,
    points_of,
    tangent_of,
    whitened,
)
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.model.problem import Problem
from wirebayes.numeric.linear_algebra import cholesky
from wirebayes.numeric.log_sum import log_sum
from wirebayes.numeric.typing import Array

# of setting to sensor error, squared: from one that does not matter to one beside which the sensor's does not; steps of
# half a decade, as the evidence is smooth in log ρ
RATIOS = np.logspace(-2.0, 6.0, 13)
# δ of the smooth remainder, doubling from about the least that the global test detects; a choice that hardly matters,
# because neighbouring sizes explain nearly the same
SIZES = np.array([4.0, 8.0, 16.0, 32.0])


@dataclass(frozen=True)
class Expansion(Tangent):
    """A tangent with what each effect and the flexible reference would add.

    Attributes
    ----------
    signatures : (n, N, m)
        What each probe adds, per unit amplitude.
    one_sided : (m,) bool
    flexible : (n, N, q)
        Functions of the flexible reference, one process after the other.
    processes : tuple of int
        How many functions each process has.
    """

    signatures: Array
    one_sided: Array
    flexible: Array
    processes: tuple[int, ...]


def plain_reference(problem: Problem) -> list[list[Array]]:
    """The flexible reference of one process, unit size: functions (H, R, q) of every sample, N."""
    return [[smooth_reference.basis(sample.protocol, 1.0)] for sample in problem.samples]


def expand(
    target: LogPosterior,
    z: Array,
    trials: Sequence[Probe],
    readings: Sequence[Array] | None = None,
    columns: Callable[[Problem, int, Array, Array], Array] | None = None,
    shapes: Sequence[Array] | None = None,
    reference: Sequence[Sequence[Array]] | None = None,
) -> Expansion:
    """Linearise a block at some parameters, with the signatures of the probes.

    Parameters
    ----------
    target : LogPosterior
        Of the block.
    z : (n, d) array
        Parameters, in the coordinates that are sampled.
    trials : sequence of Probe
    readings : sequence of (H, R, n) arrays, optional
        Replicates that stand in for the measured readings, one array a sample, row by row of `z`.
    columns : callable, optional
        Adds further signatures behind the probes': given the problem, the sample's number, the tension (H, R, n) and
        its derivatives (H, R, n, p), it returns (H, R, n, more), N.
    shapes : sequence of (H, R, m) arrays, optional
        Signatures from `forms`, used for all rows: an effect's form hardly differs between refits.
    reference : sequence of lists of (H, R, q) arrays, optional
        Functions of each process of the flexible reference, N, a list a sample; `plain_reference` when left out.

    Returns
    -------
    Expansion
    """
    problem = target.problem
    around = around_points(target, z, moving_columns(problem))
    points = list(points_of(target, around, readings))
    added: list[Array] = []
    functions: list[list[Array]] = []
    reference = reference or plain_reference(problem)
    for at, (sample, point) in enumerate(zip(problem.samples, points, strict=True)):
        mask = sample.protocol.mask
        shape = (shapes or forms(target, z[:1], trials))[at][mask]
        each = [shape[None] / point.sd[:, None, None]]
        if columns is not None:
            more = columns(problem, at, point.tension, point.slopes)
            each.append(np.stack([point.rows(more[..., i], mask) for i in range(more.shape[-1])], axis=-1))
        added.append(np.concatenate(each, axis=-1))
        functions.append([f[mask][None] / point.sd[:, None, None] for f in reference[at]])
    signatures = np.concatenate(added, axis=1)
    one_sided = [i < len(trials) and trials[i].one_sided for i in range(signatures.shape[-1])]
    plain = tangent_of(target, around, points)
    processes = [block_diagonal(each) for each in zip(*functions, strict=True)]
    return Expansion(
        **vars(plain), signatures=signatures, one_sided=np.array(one_sided, bool),
        flexible=np.concatenate(processes, axis=2), processes=tuple(f.shape[2] for f in processes),
    )  # fmt: skip


def scan(x: Expansion) -> Scan:
    """Log Bayes factors of every probe and of the flexible reference; zero for a row that has no tangent."""
    n = len(x.residual)
    if n <= _PIECE:
        return _scan_few(_without_tangent(x))
    pieces = [np.arange(i, min(i + _PIECE, n)) for i in range(0, n, _PIECE)]
    return joined([_scan_few(_without_tangent(x.of(rows))) for rows in pieces])


@dataclass(frozen=True)
class _Projected:
    """Inner products at n parameter sets and k ratios of the grid, free of what the parameters absorb.

    Attributes
    ----------
    shared : (n, k)
        Log volume of setting errors and parameters; -inf where the parameters cannot be distinguished.
    rss : (n, k)
        Of the residual with itself, the prior's square included.
    along, square : (n, k, m)
        Of each signature with the residual and with itself; infinite where the parameters take all of a signature.
    smooth_along, smooth_square : (n, k, q) and (n, k, q, q) for each process
        Of its smooth functions with the residual and with each other.
    """

    shared: Array
    rss: Array
    along: Array
    square: Array
    smooth_along: list[Array]
    smooth_square: list[Array]


def _project(x: Expansion) -> _Projected:
    """Project residual, signatures and smooth functions on what the parameters leave, in the metric of each ratio."""
    p, m = x.parameters.shape[2], x.signatures.shape[2]
    columns = np.concatenate([x.parameters, x.residual[..., None], x.signatures, x.flexible], axis=2)
    levels = np.swapaxes(x.left, 1, 2) @ columns
    shrink = damp(x.singular[:, None], RATIOS[:, None])
    of_m, of_f = slice(p + 1, p + 1 + m), slice(p + 1 + m, None)
    # Inner products of the parameters with everything, at each ratio.
    shrunk = np.swapaxes(levels[..., :p], 1, 2)[:, None] * shrink[:, :, None]
    gram = (np.swapaxes(x.parameters, 1, 2) @ columns)[:, None] - shrunk @ levels[:, None]
    gram[..., :p] += x.prior_precision[:, None]
    gram[..., p] += x.prior_gradient[:, None]
    factor = cholesky(gram[..., :p])
    # There may be a ratio at which the parameters cannot be distinguished: it is left out.
    regular = np.isfinite(factor).all(axis=(2, 3))
    factor[~regular] = np.eye(p)
    # What the parameters take of each column, in coordinates in which it is a sum of squares.
    taken = np.linalg.inv(factor) @ gram[..., p:]
    taken[~regular] = 0.0
    residual, signatures, flexible = taken[..., 0], taken[..., 1 : m + 1], taken[..., m + 1 :]

    def whitened(plain: Array, one: Array, other: Array) -> Array:
        """(n, k, c) products of columns, given those (n, c) without setting errors and the columns' levels."""
        return np.asarray(plain[:, None] - shrink @ (one * other))

    r, levels_m, levels_f = levels[..., p : p + 1], levels[..., of_m], levels[..., of_f]
    square = np.einsum("nim,nim->nm", x.signatures, x.signatures)
    rr = whitened((x.residual**2).sum(axis=1)[:, None], r, r)[..., 0]
    mr = whitened((x.residual[:, None] @ x.signatures)[:, 0], levels_m, r)
    mm = whitened(square, levels_m, levels_m)
    c = mm - np.einsum("nkpm,nkpm->nkm", signatures, signatures)
    fr = whitened((x.residual[:, None] @ x.flexible)[:, 0], levels_f, r) - (residual[:, :, None] @ flexible)[:, :, 0]
    each = _slices(x.processes)
    ff = [_within(x.flexible[..., own], flexible[..., own], levels_f[..., own], shrink) for own in each]
    shared = -0.5 * np.log1p(RATIOS[:, None] * x.singular[:, None] ** 2).sum(axis=2)
    return _Projected(
        shared=np.where(regular, shared - np.log(np.einsum("nkpp->nkp", factor)).sum(axis=2), -np.inf),
        rss=rr - (residual**2).sum(axis=2) + x.prior_square[:, None],
        along=mr - (residual[:, :, None] @ signatures)[:, :, 0],
        square=np.where(c > ABSORBED * square[:, None], c, np.inf),
        smooth_along=[fr[..., own] for own in each],
        smooth_square=ff,
    )


def _slices(processes: Sequence[int]) -> list[slice]:
    """Where the functions of each process stand."""
    ends = np.cumsum(processes)
    return [slice(last - count, last) for last, count in zip(ends, processes, strict=True)]


def _within(functions: Array, taken: Array, levels: Array, shrink: Array) -> Array:
    """(n, k, q, q) products of one process's functions (n, N, q) with each other, as `_project` has them.

    `taken` (n, k, p, q) is the parameters' part of them, `levels` (n, H, q) the setting errors'.
    """
    plain = (np.swapaxes(functions, 1, 2) @ functions)[:, None]
    whole_holds = (np.swapaxes(levels, 1, 2)[:, None] * shrink[:, :, None]) @ levels[:, None]
    return np.asarray(plain - np.swapaxes(taken, 2, 3) @ taken - whole_holds)


def _scan_few(x: Expansion) -> Scan:
    """Scan at once: noise of every ratio is integrated out, each amplitude is at its best."""
    found, degrees, least = _project(x), x.degrees, x.least[:, None]
    shared, rss, b, c = found.shared, found.rss, found.along, found.square
    positive = np.where(x.one_sided, np.maximum(b, 0.0), b)
    left = np.maximum(rss[..., None] - positive**2 / c, least[..., None])
    effects = shared[..., None] - 0.5 * degrees * np.log(left)
    plain, every = _without_and_with(x, found)
    reference = log_sum(plain, axis=1)
    seen = np.isfinite(reference)
    reference = np.where(seen, reference, 0.0)
    flexible_value = log_sum(every.reshape(len(every), -1), axis=1) - np.log(every.shape[2]) - reference
    best = np.argmax(effects, axis=1)[:, None]
    amplitude, at_best, c_best = (np.take_along_axis(v, best, axis=1)[:, 0] for v in (b / c, left, c))
    # there may be fewer readings than parameters, of which nothing is known
    norm = np.sqrt(np.maximum(np.where(np.isfinite(c_best), c_best, 0.0) * degrees / at_best, 0.0))
    return Scan(
        np.where(seen[:, None], log_sum(effects, axis=1) - reference[:, None], 0.0),
        np.where(seen, flexible_value, 0.0),
        amplitude,
        norm,
        Pieces(shared.T, rss.T, np.swapaxes(b, 0, 1), np.swapaxes(c, 0, 1), degrees, x.least, x.one_sided),
    )


def evidences(x: Expansion) -> tuple[Array, Array]:
    """(n, k) and (n, k, s) log evidence at each ratio, without a remainder and with one of each process and size.

    Parameters and the scale of the noise are integrated out; the prior has its top at one. It is -inf for a row that
    has no tangent.
    """
    seen = _has_tangent(x)
    x = _without_tangent(x)
    plain, beside = _without_and_with(x, _project(x))
    return np.where(seen[:, None], plain, -np.inf), np.where(seen[:, None, None], beside, -np.inf)


def _without_and_with(x: Expansion, found: _Projected) -> tuple[Array, Array]:
    shared, rss, degrees, least = found.shared, found.rss, x.degrees, x.least[:, None]
    plain = shared - 0.5 * degrees * np.log(np.maximum(rss, least))
    loose = []
    for square, along in zip(found.smooth_square, found.smooth_along, strict=True):
        log_volume, less = _taken_by(square, along)
        # The process is measured in units of the noise that is left beside it.
        left_beside = np.maximum(rss[..., None] - less, least[..., None])
        loose.append(shared[..., None] - log_volume - 0.5 * degrees * np.log(left_beside))
    return plain, np.concatenate(loose, axis=2)


def _taken_by(square: Array, along: Array) -> tuple[Array, Array]:
    """What a process of each size takes: half a log determinant, and of the sum of squares, both (..., sizes).

    `square` (..., q, q) and `along` (..., q) are the inner products of its functions with themselves and the residual.
    """
    q = along.shape[-1]
    share = SIZES**2 / np.maximum(np.einsum("...ff->...", square), 1e-300)[..., None]
    # One Cholesky factor of I + share square, bordered by the residual's products, holds both; the corner is not used.
    bordered = np.zeros((*share.shape, q + 1, q + 1))
    bordered[..., :q, :q] = share[..., None, None] * square[..., None, :, :]
    bordered.reshape(-1, (q + 1) ** 2)[:, :: q + 2] += 1.0
    bordered[..., q, :q] = np.sqrt(share)[..., None] * along[..., None, :]
    bordered[..., q, q] = LARGEST_SLOPE
    factor = cholesky(bordered)
    with np.errstate(invalid="ignore"):
        log_volume = np.log(np.einsum("...ff->...f", factor)[..., :q]).sum(axis=-1)
        less = (factor[..., q, :q] ** 2).sum(axis=-1)
    # Functions that the parameters take entirely leave rounding errors.
    seen = np.isfinite(log_volume + less)
    return np.where(seen, log_volume, 0.0), np.where(seen, less, 0.0)


def _has_tangent(x: Expansion) -> NDArray[np.bool_]:
    """(n,) where the model neither overflows nor jumps."""
    parts = (x.parameters, x.signatures, x.flexible, x.residual[..., None])
    with np.errstate(invalid="ignore"):
        return np.all([(np.abs(part) < LARGEST_SLOPE).all(axis=(1, 2)) for part in parts], axis=0)


def _without_tangent(x: Expansion) -> Expansion:
    """Rows that have no tangent as rows in which nothing is seen."""
    seen = _has_tangent(x)
    if seen.all():
        return x
    names = ("parameters", "signatures", "flexible")
    parts: dict[str, Any] = {name: np.where(seen[:, None, None], getattr(x, name), 0.0) for name in names}
    return replace(x, **parts, residual=np.where(seen[:, None], x.residual, 0.0))


def projected(x: Expansion, ratio: float) -> Array:
    """(N, m) signatures of the first row, whitened at a noise ratio, free of what the parameters absorb."""
    basis, _ = np.linalg.qr(whitened(x, x.parameters[0], ratio))
    signatures = whitened(x, x.signatures[0], ratio)
    return np.asarray(signatures - basis @ (basis.T @ signatures))


_PIECE = 16  # parameter sets scanned at once: what stays in the cache
ABSORBED = 1e-6  # squared share of a signature below which the parameters take all of it
