"""A fitted plain model, linearised with what each effect would add, and the log Bayes factor of each."""

from collections.abc import Callable, Sequence

import numpy as np

from wirebayes.discovery import smooth_reference
from wirebayes.discovery.noise_integral import (
    Expansion,
    Projected,
    project,
    with_each_signature,
    without_and_with,
    without_tangent,
)
from wirebayes.discovery.probes import Probe, forms
from wirebayes.discovery.scans import Pieces, Scan, joined
from wirebayes.discovery.tangent import Point, around_points, block_diagonal, moving_columns, points_of, tangent_of
from wirebayes.discovery.two_effects import log_bayes_of_two
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.model.problem import Problem
from wirebayes.numeric.log_sum import log_sum
from wirebayes.numeric.typing import Array, Bools, Ints

# Further signatures behind the probes': given the sample's number, its tension (H, R, n) and the derivatives
# (H, R, n, p), they are (H, R, n, more), N.
AddedColumns = Callable[[int, Array, Array], Array]


def plain_reference(problem: Problem) -> list[list[Array]]:
    """The flexible reference of one process, unit size: functions (H, R, q) of every sample, N."""
    return [[smooth_reference.basis(sample.protocol)] for sample in problem.samples]


def expand(
    target: LogPosterior,
    z: Array,
    trials: Sequence[Probe],
    readings: Sequence[Array] | None = None,
    columns: AddedColumns | None = None,
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
    columns : AddedColumns, optional
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
    reference = reference or plain_reference(problem)
    shapes = shapes or forms(target, z[:1], trials)
    signatures = _signatures(problem, points, shapes, columns)
    one_sided, kinds = _described(trials, signatures.shape[-1])
    processes = _processes(problem, points, reference)
    return Expansion(
        **vars(tangent_of(target, around, points)),
        signatures=signatures,
        one_sided=one_sided,
        kinds=kinds,
        flexible=np.concatenate(processes, axis=2),
        processes=tuple(f.shape[2] for f in processes),
    )


def _signatures(
    problem: Problem, points: Sequence[Point], shapes: Sequence[Array], columns: AddedColumns | None
) -> Array:
    """(n, N, m) those of the probes, an array (H, R, m) a sample, and those added behind them."""
    out = []
    for at, (sample, point) in enumerate(zip(problem.samples, points, strict=True)):
        mask = sample.protocol.mask
        own = point.in_errors(shapes[at][mask])
        if columns is not None:
            more = columns(at, point.tension, point.slopes)
            own = np.concatenate([own, _rows(point, more, mask)], axis=-1)
        out.append(own)
    return np.concatenate(out, axis=1)


def _processes(problem: Problem, points: Sequence[Point], reference: Sequence[Sequence[Array]]) -> list[Array]:
    """(n, N, q) functions of each process of the flexible reference, those of every sample by themselves."""
    each_sample = []
    for sample, point, functions in zip(problem.samples, points, reference, strict=True):
        each_sample.append([point.in_errors(f[sample.protocol.mask]) for f in functions])
    return [block_diagonal(of_samples) for of_samples in zip(*each_sample, strict=True)]


def _rows(point: Point, values: Array, mask: Array) -> Array:
    """(H, R, n, m) to (n, N, m) in units of the reading error."""
    columns = [point.rows(values[..., i], mask) for i in range(values.shape[-1])]
    return np.stack(columns, axis=-1)


def _described(trials: Sequence[Probe], count: int) -> tuple[Bools, Ints]:
    """Of so many signatures, whether each is one-sided, and which effect it is of: -1 for those behind the probes'."""
    one_sided = np.zeros(count, bool)
    kinds = np.full(count, -1)
    one_sided[: len(trials)] = [trial.one_sided for trial in trials]
    names = list(dict.fromkeys(trial.effect.name for trial in trials))
    kinds[: len(trials)] = [names.index(trial.effect.name) for trial in trials]
    return one_sided, kinds


def scan(x: Expansion) -> Scan:
    """Log Bayes factors of every probe and of the flexible reference; zero for a row that has no tangent."""
    n = len(x.residual)
    if n <= _PIECE:
        return _scan_few(without_tangent(x))
    pieces = [np.arange(i, min(i + _PIECE, n)) for i in range(0, n, _PIECE)]
    return joined([_scan_few(without_tangent(x.of(rows))) for rows in pieces])


def _scan_few(x: Expansion) -> Scan:
    """Scan at once: noise of every ratio is integrated out, each amplitude is at its best."""
    found = project(x)
    left, effects = with_each_signature(x, found)
    by_effect = log_sum(effects, axis=1)
    plain, beside = without_and_with(x, found)
    nothing = log_sum(plain, axis=1)
    seen = np.isfinite(nothing)
    nothing = np.where(seen, nothing, 0.0)
    summed = log_sum(beside.reshape(len(beside), -1), axis=1)
    flexible = summed - np.log(beside.shape[2])
    two = log_bayes_of_two(x, found, by_effect, nothing)
    amplitude, norm = _most_probable(effects, found, left, x.degrees)
    pieces = Pieces(
        found.shared.T,
        found.rss.T,
        np.swapaxes(found.along, 0, 1),
        np.swapaxes(found.square, 0, 1),
        np.swapaxes(np.isfinite(found.divisor), 0, 1),
        x.degrees,
        x.least,
        x.one_sided,
    )
    return Scan(
        np.where(seen[:, None], by_effect - nothing[:, None], 0.0),
        np.where(seen, flexible - nothing, 0.0),
        np.where(seen, two, 0.0),
        amplitude,
        norm,
        pieces,
    )


def _most_probable(effects: Array, found: Projected, left: Array, degrees: int) -> tuple[Array, Array]:
    """(n, m) amplitude, and δ per amplitude, of each signature at the noise ratio that makes it most probable.

    `effects` and `left` (n, k, m) are its log evidence, and the sum of squares beside it, at each ratio.
    """
    best = np.argmax(effects, axis=1)[:, None]

    def at_best(values: Array) -> Array:
        return np.take_along_axis(values, best, axis=1)[:, 0]

    square = at_best(found.divisor)
    # there may be fewer readings than parameters, of which nothing is known
    known = np.where(np.isfinite(square), square, 0.0)
    norm = np.sqrt(np.maximum(known * degrees / at_best(left), 0.0))
    return at_best(found.along / found.divisor), norm


_PIECE = 16  # parameter sets scanned at once: what stays in the cache
