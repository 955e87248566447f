"""The evidence of an effect by its amplitude: where its top is, how wide, and its integral."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.special import ndtr

from wirebayes.inference.optimum import Optimum, together
from wirebayes.numeric.typing import Array, Bools, Ints

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
    best = profile.best
    if not 0 < best < len(profile.amplitude) - 1:
        return None
    near = _about_best(profile)
    middle = profile.amplitude[best]
    highest = profile.value[best]
    y = profile.value[near] - highest
    if not np.isfinite(y).all():
        return None
    away = (profile.amplitude[near] - middle) / per_delta
    scale = np.abs(away).max()
    parabola = _falling_parabola(away / scale, y)
    if parabola is None:
        return None
    return Top(
        float(middle + parabola.summit * scale * per_delta),
        float(per_delta * scale / np.sqrt(-2.0 * parabola.bend)),
        float(highest + parabola.rise),
    )


class _Parabola(NamedTuple):
    """Where a parabola is highest within its points, how high there, and half its second derivative."""

    summit: float
    rise: float
    bend: float


def _falling_parabola(x: Array, y: Array) -> _Parabola | None:
    """The best through some points; None where it does not fall on both sides."""
    bend, slope, height = np.polyfit(x, y, 2)
    if bend >= 0:
        return None
    vertex = -0.5 * slope / bend
    summit = float(np.clip(vertex, x.min(), x.max()))
    rise = height + slope * summit + bend * summit**2
    return _Parabola(summit, rise, bend)


def _about_best(profile: Profile) -> Bools:
    """(a,) which amplitudes are the best one, its neighbours, or nearly as good."""
    best = profile.best
    least = profile.value[best] - _NEAR_TOP
    near = (profile.value > least) & np.isfinite(profile.value)
    near[best - 1 : best + 2] = True
    return near


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
    top = float(profile.value[profile.best])
    if not np.isfinite(top):
        return -np.inf, per_delta
    grid, value = _up_to(neutral, profile)
    share = np.exp(value - top)
    whole = float(np.trapezoid(share, grid))
    if not whole > 0.0:
        return -np.inf, per_delta
    first_moment = float(np.trapezoid(share * grid, grid))
    mean = first_moment / whole
    square = share * (grid - mean) ** 2
    second_moment = float(np.trapezoid(square, grid))
    sd = float(np.sqrt(second_moment / whole))
    integral = top + float(np.log(whole))
    return integral, sd or per_delta


def _up_to(neutral: float, profile: Profile) -> tuple[Array, Array]:
    """Amplitudes up to neutral, and the values; between neutral and the least amplitude the value hardly changes."""
    grid = profile.amplitude
    value = profile.value
    if neutral < grid[0]:
        return np.insert(grid, 0, neutral), np.insert(value, 0, value[0])
    if neutral > grid[-1]:
        return np.append(grid, neutral), np.append(value, value[-1])
    return grid, value
