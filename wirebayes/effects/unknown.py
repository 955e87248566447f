"""The model of something missing that has no name: a discrepancy that is less certain the farther it extrapolates.

Two random walks over the order of holds, one for the level and one for the course within the hold, piecewise linear
between a few knots. Beyond the training holds the walks continue, so the bands widen there.
"""

from dataclasses import dataclass, replace

import numpy as np

from wirebayes.errors import InputError
from wirebayes.numeric.distributions import Normal
from wirebayes.numeric.typing import Array
from wirebayes.wire.effect import Amplitude, Effect, HoldContext

KNOTS = 3  # in the training holds, and as many behind them


@dataclass(frozen=True)
class Discrepancy(Effect):
    """Random walks added to the reading.

    Attributes
    ----------
    holds : int
        Training holds, unrecorded ones included: what the knots divide.
    size_N : float
        Standard deviation that a walk has reached after the training holds.
    hold_s : float
        Typical duration of a hold, which scales the time within it.
    """

    holds: int
    size_N: float
    hold_s: float
    name = "discrepancy"
    place = "reading"
    scope = "environment"
    sentence = "A missing effect that no name in the catalogue explains; its size is estimated from the readings."
    shows = "smooth over holds and time"
    adds = True

    @property
    def key(self) -> str:
        return f"{self.name}@{self.holds}:{self.size_N!r}:{self.hold_s!r}"

    @property
    def amplitudes(self) -> tuple[Amplitude, ...]:  # type: ignore[override]
        step = Normal(0.0, self.size_N / KNOTS**0.5)
        names = [f"{walk}{k}" for walk in ("level", "course") for k in range(2 * KNOTS)]
        return tuple(Amplitude(name, "N", 0.0, step, in_natural_units=True) for name in names)

    def in_units(self, tension: float, time: float) -> "Discrepancy":
        """The same walks, their size in another unit of tension and the hold in another one of time."""
        return replace(self, size_N=self.size_N * tension, hold_s=self.hold_s * time)

    def apply(self, value: Array, own: dict[str, Array], hold: HoldContext) -> Array:
        place = hold.index / max(self.holds - 1, 1) * KNOTS
        course = np.log1p(10.0 * hold.time_s / self.hold_s) / np.log(11.0) - 0.5
        for k in range(2 * KNOTS):
            done = min(max(place - k, 0.0), 1.0)
            value = value + done * (own[f"level{k}"] + own[f"course{k}"] * course)
        return value


def parsed(variant: str) -> Discrepancy:
    """The discrepancy of a key's part behind the ``@``."""
    try:
        holds, size, duration = variant.split(":")
        return Discrepancy(int(holds), float(size), float(duration))
    except ValueError:
        raise InputError(f"effect discrepancy@{variant}: expected discrepancy@HOLDS:SIZE_N:HOLD_S") from None
