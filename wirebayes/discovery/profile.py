"""The evidence of an effect by its amplitude: where its top is, how wide, and its integral."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import ndtr

from wirebayes.inference.optimum import Optimum, together
from wirebayes.numeric.typing import Array, Ints

_NEAR_TOP = 1.0  # nats below it that a parabola is fitted to; neighbours alone may differ in their last digits only
_LEAST_INSIDE = 1e-3  # of a parabola; one farther outside the prior's ends is not the profile's
_CLOSE = 1.2  # nats from the best amplitude to its neighbours: near enough for a parabola


@dataclass(frozen=True)
class Profile:
    """The evidence by amplitude, everything else refitted, amplitudes rising.

    Attributes
    ----------
    amplitude : (a,) array
    value : (a,) array
        Log evidence against the blocks without the effect, with the amplitude's prior; -inf where no climb converged.
    ends : sequence of Optimum
        Where the climbs of each block ended, a row an amplitude.
    """

    amplitude: Array
    value: Array
    ends: Sequence[Optimum]

    @property
    def best(self) -> int:
        return int(np.argmax(self.value))

    def joined(self, other: "Profile") -> "Profile":
        """Both as one; where an amplitude is in both, this one's."""
        amplitude, order = np.unique(np.concatenate([self.amplitude, other.amplitude]), return_index=True)
        ends = [together(pair).rows(order) for pair in zip(self.ends, other.ends, strict=True)]
        return Profile(amplitude, np.concatenate([self.value, other.value])[order], ends)

    def with_rows(self, rows: Ints, other: "Profile") -> "Profile":
        """With some rows replaced by those of another profile."""
        number = np.arange(len(self.value))
        number[rows] = len(number) + np.arange(len(rows))
        ends = [together(pair).rows(number) for pair in zip(self.ends, other.ends, strict=True)]
        return Profile(self.amplitude, np.concatenate([self.value, other.value])[number], ends)

    def rows(self, which: Any) -> "Profile":
        """Some rows, by number or mask."""
        return Profile(self.amplitude[which], self.value[which], [ends.rows(which) for ends in self.ends])

    def known(self) -> "Profile":
        """Without the amplitudes at which no climb converged, where there are others."""
        converged = np.isfinite(self.value)
        return self.rows(converged) if converged.any() else self


def has_near_neighbours(profile: Profile) -> bool:
    """Whether the best amplitude's neighbours are so near it that nothing between them would be news."""
    best = profile.best
    beside = profile.value[max(best - 1, 0) : best + 2]
    return bool(beside.min() > profile.value[best] - _CLOSE)


@dataclass(frozen=True)
class Top:
    """The top of a profile as a parabola: where it is, its standard deviation, and the value there."""

    amplitude: float
    sd: float
    value: float

    def log_integral(self, low: float, high: float) -> float:
        """Log of the integral between two ends."""
        inside = ndtr((high - self.amplitude) / self.sd) - ndtr((low - self.amplitude) / self.sd)
        return float(self.value + 0.5 * np.log(2.0 * np.pi) + np.log(self.sd) + np.log(max(inside, _LEAST_INSIDE)))


def top_of(profile: Profile, per_delta: float) -> Top | None:
    """The parabola through the neighbours of the best amplitude and whatever is near it.

    None where there is no such parabola: the best lies at an end, as of an amplitude that cannot go further.

    Parameters
    ----------
    profile : Profile
    per_delta : float
        What amounts to δ = 1.
    """
    grid, value, best = profile.amplitude, profile.value, profile.best
    if not 0 < best < len(grid) - 1:
        return None
    near = (value > value[best] - _NEAR_TOP) & np.isfinite(value)
    near[best - 1 : best + 2] = True
    y = value[near] - value[best]
    if not np.isfinite(y).all():
        return None
    away = (grid[near] - grid[best]) / per_delta
    scale = np.abs(away).max()
    x = away / scale
    bend, slope, height = np.polyfit(x, y, 2)
    if bend >= 0:
        return None
    summit = float(np.clip(-0.5 * slope / bend, x.min(), x.max()))
    rise = height + slope * summit + bend * summit**2
    sd = per_delta * scale / np.sqrt(-2.0 * bend)
    return Top(float(grid[best] + summit * scale * per_delta), float(sd), float(value[best] + rise))


def integral_of(profile: Profile, neutral: float, per_delta: float) -> tuple[float, float]:
    """Log of the profile's integral over the amplitudes tried and up to neutral, and their standard deviation.

    Parameters
    ----------
    profile : Profile
    neutral : float
        The amplitude that changes nothing.
    per_delta : float
        What amounts to δ = 1: the standard deviation where nothing is known.
    """
    grid, value = profile.amplitude, profile.value
    top = float(value[profile.best])
    if not np.isfinite(top):
        return -np.inf, per_delta
    if not grid[0] <= neutral <= grid[-1]:  # between neutral and the least amplitude it hardly changes
        first = 0 if neutral < grid[0] else len(grid)
        nearest = value[0] if first == 0 else value[-1]
        grid, value = np.insert(grid, first, neutral), np.insert(value, first, nearest)
    share = np.exp(value - top)
    whole = float(np.trapezoid(share, grid))
    if not whole > 0.0:
        return -np.inf, per_delta
    mean = float(np.trapezoid(share * grid, grid)) / whole
    variance = float(np.trapezoid(share * (grid - mean) ** 2, grid)) / whole
    return top + float(np.log(whole)), float(np.sqrt(variance)) or per_delta
