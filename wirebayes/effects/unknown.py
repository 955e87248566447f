"""The model of something missing that has no name: a discrepancy that is less certain the farther it extrapolates.

What adds up is a random walk of the level over the order of holds, one of the course within the hold, and two curves
whose slopes wander: over the order of holds, and over what is set in them. As long as a test only loads, nothing tells
these two curves apart; where it unloads they differ, and the bands are wider. All are piecewise linear between a few
knots. Beyond the training holds walks and curves go on: a bend is continued, and the bands widen.
"""

from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from wirebayes.errors import InputError
from wirebayes.numeric.distributions import Normal
from wirebayes.numeric.typing import Array
from wirebayes.wire.effect import Amplitude, Effect, HoldContext

KNOTS = 3  # in the training holds, and as many behind them
_BENDS = np.arange(1, 2 * KNOTS)  # knots at which a slope changes: before the first it is that of a straight line
_SHARE = 0.5**0.5  # of the size, for each part: two of them together are as large as what is left over
_PLACES = 301  # at which the size of a curve is computed


@dataclass(frozen=True)
class Discrepancy(Effect):
    """Random walks and bent curves added to the reading.

    Attributes
    ----------
    holds : int
        Training holds, unrecorded ones included: what the knots over the order divide.
    size : float
        Of what is left over in the training holds, N, or mm where displacements are read. Each part is nearly as large:
        a walk at their end, a curve over all of them, once a straight line is taken out.
    hold_s : float
        Typical duration of a hold, which scales the time within it.
    least, range_ : float
        Of what is set in the training holds, mm or N: what the knots over it divide.
    """

    holds: int
    size: float
    hold_s: float
    least: float
    range_: float
    name = "discrepancy"
    place = "reading"
    scope = "environment"
    sentence = "A missing effect that no name in the catalogue explains; its size is estimated from the readings."
    shows = "smooth over holds and time"
    adds = True

    @property
    def key(self) -> str:
        return f"{self.name}@{self.holds}:{self.size!r}:{self.hold_s!r}:{self.least!r}:{self.range_!r}"

    @property
    def amplitudes(self) -> tuple[Amplitude, ...]:  # type: ignore[override]
        step = _SHARE * self.size / KNOTS**0.5
        bend = _SHARE * self.size / _size_of_curves()
        steps = {f"{walk}{k}": step for walk in ("level", "course") for k in range(2 * KNOTS)}
        bends = {f"{curve}{k}": bend for curve in ("order", "setting") for k in range(len(_BENDS))}
        out = []
        for name, sd in (steps | bends).items():
            prior = Normal(0.0, sd)
            out.append(Amplitude(name, "N", 0.0, prior, in_natural_units=True))
        return tuple(out)

    def in_units(self, set_: float, read: float, time: float) -> "Discrepancy":
        least = self.least * set_
        range_ = self.range_ * set_
        return replace(self, size=self.size * read, hold_s=self.hold_s * time, least=least, range_=range_)

    def apply(self, value: Array, own: dict[str, Array], hold: HoldContext) -> Array:
        passed = hold.index / max(self.holds - 1, 1) * KNOTS
        course = np.log1p(10.0 * hold.time_s / self.hold_s) / np.log(11.0) - 0.5
        for k in range(2 * KNOTS):
            done = min(max(passed - k, 0.0), 1.0)
            value = value + done * (own[f"level{k}"] + own[f"course{k}"] * course)
        reached = 0.0
        if self.range_ > 0.0:
            reached = (hold.setting - self.least) / self.range_ * KNOTS
        for curve, place in (("order", passed), ("setting", reached)):
            for k, height in enumerate(_heights(place)):
                value = value + height * own[f"{curve}{k}"]
        return value


def _heights(place: Any) -> Array:
    """(k,) or (n, k) heights of curves that bend at one knot each, by one in their slope, at a place or (n, 1) places.

    The training holds go from 0 to `KNOTS`. At both ends the curves have no height: what is straight belongs to the
    preload and the stiffness of the wire.
    """
    bent = np.maximum(place - _BENDS, 0.0)
    at_end = np.maximum(KNOTS - _BENDS, 0.0)
    return np.asarray(bent - place * at_end / KNOTS)


@cache
def _size_of_curves() -> float:
    """Root mean square, over the training holds, of a sum of curves with standard normal amplitudes.

    The straight line that suits each best is taken out: a fit without curves leaves no more.
    """
    place = np.linspace(0.0, KNOTS, _PLACES)
    straight = np.column_stack([np.ones(_PLACES), place])
    basis, _ = np.linalg.qr(straight)
    heights = _heights(place[:, None])
    left = heights - basis @ (basis.T @ heights)
    return float(np.sqrt((left**2).sum(axis=1).mean()))


def parsed(variant: str) -> Discrepancy:
    """The discrepancy of a key's part behind the ``@``."""
    try:
        holds, *numbers = variant.split(":")
        size, hold_s, least, range_ = map(float, numbers)
        return Discrepancy(int(holds), size, hold_s, least, range_)
    except ValueError:
        expected = "discrepancy@HOLDS:SIZE:HOLD_S:LEAST:RANGE"
        raise InputError(f"effect discrepancy@{variant}: expected {expected}") from None
