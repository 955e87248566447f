"""What a linear scan has found, and what it is made of."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from wirebayes.numeric.log_sum import log_sum
from wirebayes.numeric.typing import Array, Bools

_PIECES_OF = 300  # simulations whose pieces are kept, for they are large: enough for what 80 % of them show


@dataclass(frozen=True)
class Scan:
    """Log Bayes factors against the plain model, and the geometry behind them.

    Attributes
    ----------
    effects : (n, m)
        Of each probe, its amplitude at its best.
    flexible : (n,)
        Of the flexible reference, averaged over its processes and `SIZES`.
    two : (n,)
        Of two effects together (`wirebayes.discovery.two_effects`).
    amplitude : (n, m)
        Best amplitude (distance from neutral).
    norm : (n, m)
        Length of the projected signature per unit amplitude, at the most probable noise: δ per amplitude.
    pieces : Pieces
    """

    effects: Array
    flexible: Array
    two: Array
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
    is_left : (k, n, m) bool
        False where the parameters take all but nothing of a signature: then none of it is found, but what is left of a
        large effect is still in the readings.
    degrees : int
    least : (n,)
    one_sided : (m,) bool
    """

    shared: Array
    rss: Array
    along: Array
    square: Array
    is_left: Bools
    degrees: int
    least: Array
    one_sided: Array

    def of(self, probe: int) -> "Pieces":
        """One probe's pieces."""
        one = slice(probe, probe + 1)
        along, square, is_left = (values[..., one] for values in (self.along, self.square, self.is_left))
        return replace(self, along=along, square=square, is_left=is_left, one_sided=self.one_sided[one])

    def log_bayes(self, added: float) -> Array:
        """(n,) of the only probe, had its amplitude `added` been in the data besides."""
        along = self.along[..., 0]
        square = self.square[..., 0]
        is_left = self.is_left[..., 0]
        rss = self.rss + 2.0 * added * along + added**2 * square
        along = along + added * square
        if self.one_sided[0]:
            along = np.maximum(along, 0.0)
        explained = np.where(is_left, along**2, 0.0) / np.where(is_left, square, 1.0)
        with_it = self._log_evidence(rss - explained)
        without = self._log_evidence(rss)
        return log_sum(with_it, axis=0) - log_sum(without, axis=0)

    def _log_evidence(self, rss: Array) -> Array:
        """(k, n) of what leaves a sum of squares (k, n)."""
        left = np.maximum(rss, self.least)
        return self.shared - 0.5 * self.degrees * np.log(left)


def joined(scans: Sequence[Scan]) -> Scan:
    """Scans of consecutive rows as one."""
    if len(scans) == 1:
        return scans[0]
    return Scan(
        effects=np.concatenate([s.effects for s in scans]),
        flexible=np.concatenate([s.flexible for s in scans]),
        two=np.concatenate([s.two for s in scans]),
        amplitude=np.concatenate([s.amplitude for s in scans]),
        norm=np.concatenate([s.norm for s in scans]),
        pieces=_first_pieces([s.pieces for s in scans]),
    )


def _first_pieces(parts: Sequence[Pieces]) -> Pieces:
    """The pieces of the first rows, as many as are kept."""
    ends = np.cumsum([len(p.least) for p in parts])
    last = int(np.searchsorted(ends, _PIECES_OF))
    few = parts[: 1 + last]

    def first(values: Sequence[Array]) -> Array:
        return np.concatenate(values, axis=1)[:, :_PIECES_OF]

    return replace(
        parts[0],
        shared=first([p.shared for p in few]),
        rss=first([p.rss for p in few]),
        along=first([p.along for p in few]),
        square=first([p.square for p in few]),
        is_left=first([p.is_left for p in few]),
        least=np.concatenate([p.least for p in few])[:_PIECES_OF],
    )
