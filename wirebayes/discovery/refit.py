"""Which effect: every candidate refitted without linearisation, its evidence compared with the flexible reference.

The amplitude of every effect has the same prior in units of its influence on these readings (δ, uniform up to
`LARGEST`), so none is preferred for the units of its amplitude. Its evidence is then its best refitted posterior
density plus a constant.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wirebayes.inference.laplace_fit import LaplaceFit, Pinned
from wirebayes.typing import Array
from wirebayes.wire.effect import Effect

# δ; end of the amplitudes' uniform prior. Hardly matters: twice as much takes ln 2 from every name alike
LARGEST = 40.0
_OUTWARD = 6  # times that the grid may grow outwards, by up to 2.3 each: 150-fold in all
# δ of the first amplitudes tried, doubling up to `LARGEST`; around the best the grid is refined twice
_DELTAS = np.array([2.0, 5.0, 10.0, 20.0, 40.0])


@dataclass(frozen=True)
class Refit:
    """A candidate refitted on some blocks.

    Attributes
    ----------
    effect : Effect
    blocks : tuple of int
        On which it acts with one shared amplitude.
    log_bayes : float
        Against the same blocks without it.
    amplitude, sd : float
        Best amplitude and its standard deviation.
    theta : tuple of (d,) arrays
        All parameters there, a block.
    """

    effect: Effect
    blocks: tuple[int, ...]
    log_bayes: float
    amplitude: float
    sd: float
    theta: tuple[Array, ...]


def occam(one_sided: bool) -> float:
    """What the prior of an amplitude, uniform in δ up to `LARGEST`, adds to the log of its best likelihood ratio."""
    return float(0.5 * np.log(2 * np.pi) - np.log(LARGEST if one_sided else 2.0 * LARGEST))


def refit(blocks: Sequence[LaplaceFit], which: Sequence[int], effect: Effect, per_delta: float, guess: float) -> Refit:
    """Refit one effect with one amplitude shared by the blocks `which`.

    Parameters
    ----------
    blocks : sequence of LaplaceFit
    which : sequence of int
    effect : Effect
    per_delta : float
        Amplitude that amounts to δ = 1, from the linear scan.
    guess : float
        The linear scan's best distance from neutral.
    """
    main = effect.amplitudes[0]
    low, high = (float(v) for v in main.prior.support())
    one_sided = low >= main.neutral
    pinned = [Pinned(blocks[b], effect) for b in which]
    reference = sum(blocks[b].log_evidence for b in which)
    starts = [p.starts() for p in pinned]

    def curve(amplitudes: Array, start: list[Array] | None) -> tuple[Array, list[Array]]:
        total, ends = np.zeros(len(amplitudes)), []
        for i, p in enumerate(pinned):
            begin = np.tile(starts[i], (len(amplitudes), 1)) if start is None else start[i]
            k = len(begin) // len(amplitudes)
            found = p.climb(begin, np.repeat(amplitudes, k))
            value = np.where(found.converged, found.log_evidence, -np.inf).reshape(-1, k)
            pick = np.argmax(value, axis=1)
            total = total + value[np.arange(len(amplitudes)), pick]
            ends.append(found.z.reshape(len(amplitudes), k, -1)[np.arange(len(amplitudes)), pick])
        return total - reference, ends

    steps = np.concatenate([_DELTAS, [max(abs(guess) / per_delta, 0.3)]]) * per_delta
    grid = main.neutral + (steps if one_sided else np.concatenate([steps, -steps]))
    grid = np.unique(np.clip(grid, low, high))
    value, ends = curve(grid, None)
    outward = refined = 0
    while refined < 2:
        best = int(np.argmax(value))
        edge = best in (0, len(grid) - 1) and low < grid[best] < high and grid[best] != main.neutral
        if edge and outward < _OUTWARD:
            # The scan's unit was too small: go on outwards before looking closer.
            finer = np.clip(main.neutral + (grid[best] - main.neutral) * np.array([1.3, 1.7, 2.3]), low, high)
            outward += 1
        else:
            left = grid[best - 1] if best else (main.neutral if one_sided else 2 * grid[0] - grid[1])
            right = grid[best + 1] if best + 1 < len(grid) else grid[best]
            finer = np.linspace(left, right, 8)[1:-1]
            refined += 1
        more, more_ends = curve(finer, [_between(grid, e, best, finer) for e in ends])
        grid, value = np.concatenate([grid, finer]), np.concatenate([value, more])
        ends = [np.concatenate([e, m]) for e, m in zip(ends, more_ends, strict=True)]
        grid, order = np.unique(grid, return_index=True)
        value, ends = value[order], [e[order] for e in ends]
    best = int(np.argmax(value))
    sd = _width(grid, value, best, per_delta)
    log_bayes = float(value[best] + occam(one_sided))
    theta = tuple(p.natural(e[best][None], grid[best : best + 1])[0] for p, e in zip(pinned, ends, strict=True))
    return Refit(effect, tuple(which), log_bayes, float(grid[best]), sd, theta)


def _between(grid: Array, ends: Array, best: int, finer: Array) -> Array:
    """(m, d) where climbs with `finer` amplitudes begin: on the line from the best place to its neighbour's."""
    aside = np.where(finer < grid[best], max(best - 1, 0), min(best + 1, len(grid) - 1))
    apart = grid[aside] - grid[best]
    share = np.divide(finer - grid[best], apart, out=np.zeros(len(finer)), where=apart != 0)
    near = np.isfinite(ends[aside]).all(axis=1) & (share <= 1.0)
    return np.asarray(ends[best] + np.where(near, share, 0.0)[:, None] * (ends[aside] - ends[best]))


def _width(grid: Array, value: Array, best: int, fallback: float) -> float:
    """Standard deviation of the amplitude, from the curvature of the evidence at its top."""
    if 0 < best < len(grid) - 1:
        x, y = (grid[best - 1 : best + 2] - grid[best]) / fallback, value[best - 1 : best + 2]
        if np.isfinite(y).all():
            bend = 2.0 * ((y[2] - y[1]) / x[2] + (y[1] - y[0]) / x[0]) / (x[2] - x[0])
            if bend < 0:
                return float(fallback / np.sqrt(-bend))
    return fallback
