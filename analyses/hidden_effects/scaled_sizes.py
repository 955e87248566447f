"""How large an effect is in some readings: what is left of it beside the noise and what parameters can absorb.

Of its signature, in standard deviations of the noise, where the parameters move a little, or of the effect, where they
move as far as helps. Nothing of the package is used.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import least_squares

from .rig import Array
from .scaled_law import Hidden

PLAIN = ("k1", "B", "U", "k2", "N", "preload")
_FIRST, _STEPS = 0.02, 20  # share of the largest sensible amplitude that is tried first, and how many are tried
_FIT_STEPS, _NO_FIT = 40, 1e4  # of the parameters beside an effect; a residual where they have no readings


@dataclass(frozen=True)
class _Guess:
    """A share of the largest amplitude that is tried, between one too small and one too large.

    Attributes
    ----------
    share, low, high : float
    power : float
        How the size of the effect grows with the amplitude, from the last two tries.
    before : (float, float)
        The last share and its size.
    """

    share: float = _FIRST
    low: float = 0.0
    high: float = np.inf
    power: float = 1.0
    before: tuple[float, float] = (0.0, 0.0)

    def next(self, size: float, delta: float) -> _Guess:
        """What to try after a share that has this size."""
        share, power, (last, last_size) = self.share, self.power, self.before
        low, high = (share, self.high) if size < delta else (self.low, share)
        if last and share != last and 0.0 < size < np.inf and 0.0 < last_size < np.inf:
            power = float(np.clip(np.log(size / last_size) / np.log(share / last), 0.4, 4.0))
        wanted = float(np.clip(delta / max(size, 1e-12), 1e-3, 1e3))
        after = min(1.0, share * wanted ** (1.0 / power))
        if not low < after < high:
            after = float(np.sqrt(max(low, 1e-3 * high) * min(high, 1.0)))
        return _Guess(after, low, high, power, (share, size))


class Signatures:
    """What effects do to readings, and how large they are beside the noise and what parameters can absorb."""

    def noise_free(self, hidden: Hidden = Hidden()) -> Array:  # noqa: B008 - it is frozen
        """Readings without noise."""
        raise NotImplementedError

    def largest(self, name: str) -> float:
        """Largest sensible amplitude of an effect."""
        raise NotImplementedError

    def whitened(self, dy: Array) -> Array:
        """Readings in standard deviations of the noise, which are independent."""
        raise NotImplementedError

    @cached_property
    def basis(self) -> Array:
        """Orthonormal columns, whitened, of what parameters can absorb."""
        raise NotImplementedError

    @cached_property
    def plain(self) -> Array:
        """Readings without noise and without an effect."""
        return self.noise_free()

    def projected(self, dy: Array) -> Array:
        """The same less what the plain parameters can absorb."""
        z = self.whitened(dy)
        return np.asarray(z - self.basis @ (self.basis.T @ z))

    def signature(self, hidden: Hidden) -> Array:
        """What an effect does to the readings, projected."""
        return self.projected(self.noise_free(hidden) - self.plain)

    def delta(self, hidden: Hidden) -> float:
        """Size of an effect; infinite where the wire cannot carry its weights with it."""
        size = float(np.linalg.norm(self.signature(hidden)))
        return size if np.isfinite(size) else np.inf

    def moved(self, by: Array) -> Array:
        """Readings without noise and without an effect where parameters have moved by so many of `KNOWN`."""
        raise NotImplementedError

    @property
    def moves(self) -> int:
        """How many parameters there are to move."""
        return len(PLAIN)

    def left(self, hidden: Hidden) -> float:
        """Size of an effect beside the parameters that hide it best, their distance from the truth counted with it.

        A large effect bends: parameters that move far may take more of it, or less, than those that move a little.
        """
        y = self.noise_free(hidden)
        if not np.isfinite(y).all():
            return np.inf

        def missed(by: Array) -> Array:
            with np.errstate(all="ignore"):
                residual = self.whitened(y - self.moved(by))
            return np.append(np.where(np.isfinite(residual), residual, _NO_FIT), by)

        found = least_squares(missed, np.zeros(self.moves), max_nfev=_FIT_STEPS)
        return float(np.sqrt(2.0 * found.cost))

    def of_delta(
        self, hidden: Hidden, delta: float, agrees: float = 0.02, size_of: Callable[[Hidden], float] | None = None
    ) -> Hidden | None:
        """The effect with an amplitude of that size; none where no sensible one has it.

        Parameters
        ----------
        hidden : Hidden
            Of its amplitude only the sign counts.
        delta : float
        agrees : float
            Relative error of the size.
        size_of : function of an effect
            `delta` when left out, or `left`.
        """
        size_of = size_of or self.delta
        most, sign = self.largest(hidden.name), float(np.sign(hidden.amplitude))
        guess = _Guess()
        for _ in range(_STEPS):
            found = replace(hidden, amplitude=sign * guess.share * most)
            size = size_of(found)
            if abs(size / delta - 1.0) < agrees:
                return found
            if size < delta and guess.share >= 1.0:
                return None
            guess = guess.next(size, delta)
        return None

    def shown(self) -> list[str]:
        """Effects of the catalogue that these readings could show."""
        raise NotImplementedError

    def forms(self, name: str, rng: np.random.Generator | None = None) -> Iterator[Hidden]:
        """An effect with each sign and several values of its constants, or one drawn at random; without its size."""
        raise NotImplementedError


def basis_of(columns: Array) -> Array:
    """Orthonormal columns that span those of (N, p) that can be told apart."""
    left, sizes, _ = np.linalg.svd(columns / np.linalg.norm(columns, axis=0), full_matrices=False)
    return np.asarray(left[:, sizes > 1e-7 * sizes[0]], np.float64)
