"""A fitted plain model, linearised: residuals, what the parameters can absorb, and what each effect would add.

Everything later rests on inner products in the metric ``V0(ρ) = I + ρ K Kᵀ`` of readings divided by their standard
deviation: K is the derivative by the setting errors, ρ their unknown size relative to the sensor's error. The overall
scale of the noise is integrated out and ρ is summed over a grid, so no test relies on the noise that a possibly wrong
model has estimated.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from wirebayes.discovery import smooth_reference
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.model import likelihoods
from wirebayes.model.problem import Problem
from wirebayes.numeric.linear_algebra import cholesky
from wirebayes.numeric.log_sum import log_sum
from wirebayes.numeric.typing import Array
from wirebayes.wire.effect import Effect
from wirebayes.wire.staircase import linearise, simulate

# of setting to sensor error, squared: from one that does not matter to one beside which the sensor's does not; steps of
# half a decade, as the evidence is smooth in log ρ
RATIOS = np.logspace(-2.0, 6.0, 13)
# δ of the smooth remainder, doubling from about the least that the global test detects; a choice that hardly matters,
# because neighbouring sizes explain nearly the same
SIZES = np.array([4.0, 8.0, 16.0, 32.0])
_NOISE = ("sensor_sd", "setting_sd")


@dataclass(frozen=True)
class Probe:
    """An effect at a finite amplitude: what it would add to the readings is its signature.

    Attributes
    ----------
    effect : Effect
    own : dict
        Its amplitudes by column name, shape constants included.
    step : float
        The amplitude's distance from neutral, by which the signature is divided.
    one_sided : bool
        True where only amplitudes above neutral have a meaning.
    """

    effect: Effect
    own: dict[str, float]
    step: float
    one_sided: bool


def probes(effect: Effect) -> list[Probe]:
    """Amplitudes at which an effect is tried: one where its form is nearly linear, a ladder where it need not be."""
    column, amplitude = effect.columns()[0], effect.amplitudes[0]
    low, high = amplitude.prior.support()
    scale = float(amplitude.prior.std())
    one_sided = bool(low >= amplitude.neutral)
    steps = [0.1 * scale] if effect.nearly_linear or not one_sided else [0.03 * scale, 0.3 * scale, scale, 3.0 * scale]
    steps = [s for s in steps if amplitude.neutral + s <= high] or [0.5 * (high - amplitude.neutral)]
    return [
        Probe(effect, form | {column: amplitude.neutral + s}, s, one_sided)
        for form in effect.shapes_tried()
        for s in steps
    ]


@dataclass(frozen=True)
class Tangent:
    """A block of samples made linear at n parameter sets, rows scaled by each sample's reading error.

    Attributes
    ----------
    residual : (n, N)
    parameters : (n, N, p)
        Derivatives by the sampled coordinates that move the mean.
    left, singular : (n, N, H), (n, H)
        Left singular vectors and values of K.
    ratio : (n,)
        The fitted ρ.
    prior_gradient, prior_precision : (n, p), (n, p, p)
    floor : (n,)
        Rounding's share of the scaled variance: noise cannot be smaller.
    prior : (n,)
        Log density of the prior in the sampled coordinates.
    """

    residual: Array
    parameters: Array
    left: Array
    singular: Array
    ratio: Array
    prior_gradient: Array
    prior_precision: Array
    floor: Array
    prior: Array

    def of(self, rows: Array) -> Self:
        """That of some parameter sets."""
        every = {f.name: getattr(self, f.name) for f in fields(self) if f.name not in ("one_sided", "processes")}
        return replace(self, **{name: value[rows] for name, value in every.items()})

    @property
    def degrees(self) -> int:
        """Readings less parameters."""
        return int(self.parameters.shape[1] - self.parameters.shape[2])

    @property
    def least(self) -> Array:
        """(n,) below which a sum of squares counts as rounding error."""
        return np.asarray(self.degrees * np.maximum(self.floor, _LEAST_NOISE))

    @property
    def prior_square(self) -> Array:
        """(n,) squared distance of the point from the prior's own best, as a parabola sees it."""
        along = np.linalg.solve(self.prior_precision, self.prior_gradient[..., None])[..., 0]
        return np.asarray((self.prior_gradient * along).sum(axis=1))


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


@dataclass(frozen=True)
class Scan:
    """Log Bayes factors against the plain model, and the geometry behind them.

    Attributes
    ----------
    effects : (n, m)
        Of each probe, its amplitude at its best.
    flexible : (n,)
        Of the flexible reference, averaged over its processes and `SIZES`.
    amplitude : (n, m)
        Best amplitude (distance from neutral).
    norm : (n, m)
        Length of the projected signature per unit amplitude, at the most probable noise: δ per amplitude.
    pieces : Pieces
    """

    effects: Array
    flexible: Array
    amplitude: Array
    norm: Array
    pieces: "Pieces"


@dataclass(frozen=True)
class Pieces:
    """What decides the log Bayes factor of a probe at each ratio ρ of the grid ``(k, ...)``.

    Of many simulations it is kept for the first `_PIECES_OF` alone.

    Attributes
    ----------
    shared, rss : (k, n)
    along, square : (k, n, m)
        Inner product of projected signature and residual, and the signature with itself.
    degrees : int
    least : (n,)
    one_sided : (m,) bool
    """

    shared: Array
    rss: Array
    along: Array
    square: Array
    degrees: int
    least: Array
    one_sided: Array

    def of(self, probe: int) -> "Pieces":
        """One probe's pieces."""
        one = slice(probe, probe + 1)
        return replace(self, along=self.along[..., one], square=self.square[..., one], one_sided=self.one_sided[one])

    def log_bayes(self, added: float) -> Array:
        """(n,) of the only probe, had its amplitude `added` been in the data besides."""
        c = np.where(np.isfinite(self.square[..., 0]), self.square[..., 0], 0.0)
        rss = self.rss + 2.0 * added * self.along[..., 0] + added**2 * c
        b = self.along[..., 0] + added * c
        b = np.where(self.one_sided[0], np.maximum(b, 0.0), b)
        left = rss - b**2 / np.where(c > 0, c, np.inf)
        half = -0.5 * self.degrees
        with_it = self.shared + half * np.log(np.maximum(left, self.least))
        without = self.shared + half * np.log(np.maximum(rss, self.least))
        return np.asarray(log_sum(with_it, axis=0) - log_sum(without, axis=0))


def joined(scans: Sequence[Scan]) -> Scan:
    """Scans of consecutive rows as one."""
    if len(scans) == 1:
        return scans[0]
    parts = [s.pieces for s in scans]
    ends = np.cumsum([len(p.least) for p in parts])
    few = parts[: 1 + int(np.searchsorted(ends, _PIECES_OF))]
    pieces = replace(
        parts[0],
        shared=np.concatenate([p.shared for p in few], axis=1)[:, :_PIECES_OF],
        rss=np.concatenate([p.rss for p in few], axis=1)[:, :_PIECES_OF],
        along=np.concatenate([p.along for p in few], axis=1)[:, :_PIECES_OF],
        square=np.concatenate([p.square for p in few], axis=1)[:, :_PIECES_OF],
        least=np.concatenate([p.least for p in few])[:_PIECES_OF],
    )
    return Scan(
        effects=np.concatenate([s.effects for s in scans]),
        flexible=np.concatenate([s.flexible for s in scans]),
        amplitude=np.concatenate([s.amplitude for s in scans]),
        norm=np.concatenate([s.norm for s in scans]),
        pieces=pieces,
    )


def forms(target: LogPosterior, z: Array, trials: Sequence[Probe]) -> list[Array]:
    """Signatures of the probes: what each adds to the readings, per unit amplitude.

    Parameters
    ----------
    target : LogPosterior
        Of a block.
    z : (1, d) array
        Where it is evaluated, in the coordinates that are sampled.
    trials : sequence of Probe

    Returns
    -------
    list of (H, R, m) arrays
        One a sample, N; zero where the effect cannot be computed or belongs to another sample.
    """
    problem, theta = target.problem, target.coordinates.to_natural(z)
    alike: dict[str, list[int]] = {}
    for k, probe in enumerate(trials):
        alike.setdefault(probe.effect.key, []).append(k)
    out = []
    for sample in problem.samples:
        own = problem.parameters(theta, sample)
        shapes = np.zeros((*sample.protocol.time_s.shape, len(trials)))
        plain: Array | None = None
        for numbers in alike.values():
            effect = trials[numbers[0]].effect
            if getattr(effect, "test", "") not in ("", sample.name):
                continue
            each = {name: np.repeat(value, len(numbers)) for name, value in own.items()}
            each |= {name: np.array([trials[k].own[name] for k in numbers]) for name in trials[numbers[0]].own}
            with np.errstate(all="ignore"):
                plain = simulate(sample.protocol, own, sample.model) if plain is None else plain
                effects = (*sample.model.effects, effect)
                added = simulate(sample.protocol, each, replace(sample.model, effects=effects)) - plain
            shapes[..., numbers] = np.where(np.isfinite(added), added, 0.0) / [trials[k].step for k in numbers]
        out.append(shapes)
    return out


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
    around = _around(target, z, moving_columns(problem))
    points = list(_points(target, around, readings))
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
    plain = _tangent(target, around, points)
    processes = [_block_diagonal(each) for each in zip(*functions, strict=True)]
    return Expansion(
        **vars(plain), signatures=signatures, one_sided=np.array(one_sided, bool),
        flexible=np.concatenate(processes, axis=2), processes=tuple(f.shape[2] for f in processes),
    )  # fmt: skip


def moving_columns(problem: Problem) -> list[int]:
    """The columns of parameters that move the mean of the readings."""
    return [i for i, name in enumerate(problem.names) if name.split("[")[0] not in _NOISE]


def tangent(target: LogPosterior, z: Array, readings: Sequence[Array] | None, moving: list[int]) -> Tangent:
    """Linearise a block by some of its columns, without signatures.

    Parameters
    ----------
    target : LogPosterior
    z : (n, d) array
        Parameters, in the coordinates that are sampled.
    readings : sequence of (H, R, n) arrays or None
        As in `expand`.
    moving : list of int
        Columns of `z` by which the tensions are differentiated.

    Returns
    -------
    Tangent
    """
    around = _around(target, z, moving)
    return _tangent(target, around, list(_points(target, around, readings)))


@dataclass(frozen=True)
class _Around:
    """Points and steps from each along p coordinates: sampled and natural parameters ((1 + 3 p) n, d).

    The points come first, then the steps by which tensions are differentiated, then those for the prior, both ways.
    """

    z: Array
    theta: Array
    columns: int

    @property
    def points(self) -> int:
        return len(self.z) // (1 + 3 * self.columns)


def _around(target: LogPosterior, z: Array, moving: list[int]) -> _Around:
    """Points (n, d) with their steps along the coordinates `moving`."""
    p = len(moving)
    every = np.repeat(z[None], 1 + 3 * p, axis=0)
    steps = np.repeat([_STEP, _PRIOR_STEP, -_PRIOR_STEP], p)
    every[np.arange(1, 1 + 3 * p), :, moving * 3] += steps[:, None]
    flat = every.reshape(-1, z.shape[1])
    return _Around(flat, target.coordinates.to_natural(flat), p)


@dataclass(frozen=True)
class _Point:
    """One sample at n parameter sets: tension (H, R, n), derivatives (H, R, n, p), reading error (n,), and rows."""

    tension: Array
    slopes: Array
    sd: Array
    residual: Array
    parameters: Array
    by_setting: Array
    floor: Array

    def rows(self, values: Array, mask: Array) -> Array:
        """(H, R, n) to (n, N) in units of the reading error."""
        return np.asarray((values[mask] / self.sd).T)


def _points(target: LogPosterior, around: _Around, readings: Sequence[Array] | None) -> Iterator[_Point]:
    problem, n = target.problem, around.points
    both = around.theta[: n * (1 + around.columns)]
    theta = both[:n]
    for at, sample in enumerate(problem.samples):
        mask = sample.protocol.mask
        own = problem.parameters(theta, sample)
        sd = np.sqrt(likelihoods.reading_variance(own["sensor_sd"], sample.resolution))
        line = linearise(sample.protocol, own, sample.model)
        y = sample.readings if readings is None else readings[at]
        moved = simulate(sample.protocol, problem.parameters(both, sample), sample.model)
        moved = moved.reshape(*moved.shape[:2], 1 + around.columns, n)
        slopes = np.moveaxis((moved[:, :, 1:] - moved[:, :, :1]) / _STEP, 2, -1)
        scaled = (slopes[mask] / sd[:, None]).transpose(1, 0, 2)
        jac = np.moveaxis(likelihoods.jacobian(line)[mask] * (own["setting_sd"] / sd), -1, 0)
        floor = np.broadcast_to(sample.resolution**2 / 12.0, sd.shape) / sd**2
        yield _Point(line.reading, slopes, sd, ((y - line.reading)[mask] / sd).T, scaled, jac, floor)


def _tangent(target: LogPosterior, around: _Around, points: Sequence[_Point]) -> Tangent:
    k = _block_diagonal([p.by_setting for p in points])
    beyond = ~(np.abs(k) < _LARGEST).all(axis=(1, 2))  # what the model cannot compute has no tangent
    k[beyond] = 1.0
    # K's size is what ρ measures: give it a typical column of length one. It has none where the wire is slack
    # throughout: then no setting error moves any reading.
    ratio = (k**2).sum(axis=(1, 2)) / k.shape[2]
    left, singular = _directions(k / np.sqrt(np.where(ratio > 0, ratio, 1.0))[:, None, None])
    prior, gradient, precision = _prior(target, around)
    residual = np.concatenate([p.residual for p in points], axis=1)
    residual[beyond] = np.nan
    parameters = np.concatenate([p.parameters for p in points], axis=1)
    floor = np.min([p.floor for p in points], axis=0)
    return Tangent(residual, parameters, left, singular, ratio, gradient, precision, floor, prior)


def _directions(k: Array) -> tuple[Array, Array]:
    """Left singular vectors and values of matrices (n, N, H) with few columns, from their squares: half the work.

    What is lost are digits of directions in which a setting error moves nothing to speak of: they become zero.
    """
    square, right = np.linalg.eigh(np.swapaxes(k, 1, 2) @ k)
    seen = square > _LEAST_SQUARE * square[:, -1:]
    singular = np.sqrt(np.where(seen, square, 0.0))
    return k @ (right / np.where(seen, singular, np.inf)[:, None]), singular


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
    bordered[..., q, q] = _LARGEST
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
        return np.all([(np.abs(part) < _LARGEST).all(axis=(1, 2)) for part in parts], axis=0)


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


def whitened(x: Tangent, columns: Array, ratio: float) -> Array:
    """(N, m) columns in the metric of the noise, as the first row has it.

    Parameters
    ----------
    x : Tangent
    columns : (N, m) array
    ratio : float
        Size of the setting errors against the sensor's, ρ.
    """
    shrink = 1.0 - 1.0 / np.sqrt(1.0 + ratio * x.singular[0] ** 2)
    return np.asarray(columns - x.left[0] @ (shrink[:, None] * (x.left[0].T @ columns)))


def damp(singular: Array, ratio: Array | float) -> Array:
    """How much of what moves whole holds the noise takes, at a ratio ρ, along each singular vector of K."""
    with np.errstate(over="ignore"):
        return np.asarray(ratio * singular**2 / (1.0 + ratio * singular**2))


def residuals(target: LogPosterior, z: Array, readings: Sequence[Array] | None = None) -> tuple[Array, Array]:
    """Readings less tensions, in units of the reading error, and the log density of the prior.

    Parameters
    ----------
    target : LogPosterior
    z : (n, d) array
        Parameters, in the coordinates that are sampled.
    readings : sequence of (H, R, n) arrays, optional
        Replicates that stand in for the measured readings.

    Returns
    -------
    (n, N) and (n,) arrays
        All samples' readings one after the other; the density in the sampled coordinates.
    """
    theta = target.coordinates.to_natural(z)
    parts = []
    with np.errstate(all="ignore"):
        for at, sample in enumerate(target.problem.samples):
            own = target.problem.parameters(theta, sample)
            sd = np.sqrt(likelihoods.reading_variance(own["sensor_sd"], sample.resolution))
            y = sample.readings if readings is None else readings[at]
            left = y - simulate(sample.protocol, own, sample.model)
            parts.append((left[sample.protocol.mask] / sd).T)
    return np.concatenate(parts, axis=1), _prior_density(target, theta, z)


def _prior_density(target: LogPosterior, theta: Array, z: Array) -> Array:
    """(n,) log density of the prior in the sampled coordinates, at points whose natural parameters are known."""
    with np.errstate(all="ignore"):  # a parameter that underflows to zero has no density
        return np.asarray(target.log_prior(theta) + target.coordinates.log_jacobian(theta, z))


def _prior(target: LogPosterior, around: _Around) -> tuple[Array, Array, Array]:
    """Log density of the prior; its gradient and (diagonal, positive) precision by the coordinates stepped along."""
    n, p, h = around.points, around.columns, _PRIOR_STEP
    rows = np.r_[:n, n * (1 + p) : len(around.z)]
    values = _prior_density(target, around.theta[rows], around.z[rows])
    centre, plus, minus = values[:n, None], *values[n:].reshape(2, p, n).swapaxes(1, 2)
    # A boundary of the prior has no slope that means anything: there the column keeps a weak precision alone.
    inside = np.isfinite(plus) & np.isfinite(minus) & np.isfinite(centre)
    with np.errstate(invalid="ignore"):
        gradient = np.where(inside, (plus - minus) / (2 * h), 0.0)
        bend = -(plus + minus - 2 * centre) / h**2
        # Along an edge the density falls without a bend, as an exponential: its width is that of its slope.
        bend = np.where(bend > _FLAT, bend, np.maximum(gradient**2, _FLAT))
        diagonal = np.where(inside, bend, 1.0)
    precision = np.zeros((n, p, p))
    precision[:, np.arange(p), np.arange(p)] = diagonal
    return values[:n], gradient, precision


def _block_diagonal(blocks: Sequence[Array]) -> Array:
    """Batched (n, rows, columns) blocks along a diagonal."""
    n = max(b.shape[0] for b in blocks)
    out = np.zeros((n, sum(b.shape[1] for b in blocks), sum(b.shape[2] for b in blocks)))
    row = column = 0
    for b in blocks:
        out[:, row : row + b.shape[1], column : column + b.shape[2]] = b
        row, column = row + b.shape[1], column + b.shape[2]
    return out


_STEP = 1e-5  # of sampled coordinates, which are of order one: truncation and rounding both stay below 1e-5 of a slope
_PRIOR_STEP = 1e-3  # of the same, for second differences of the prior, which rounding spoils before
_FLAT = 1e-3  # of a bend: less is rounding, and would put the prior's own best anywhere
_LARGEST = 1e100  # of any derivative: the square of a larger one overflows
_PIECE = 16  # parameter sets scanned at once: what stays in the cache
_PIECES_OF = 300  # simulations whose pieces are kept, for they are large: enough for what 80 % of them show
_LEAST_SQUARE = 1e-14  # share of the largest squared singular value: less is rounding
_LEAST_NOISE = 1e-6  # of the fitted variance: rounding errors of the arithmetic must not pass for a perfect fit
ABSORBED = 1e-6  # squared share of a signature below which the parameters take all of it
