"""One test as checks of its readings see it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wirebayes.numeric.typing import Floats, Ints
from wirebayes.wire.control import READ_UNIT
from wirebayes.wire.protocol import Protocol


def reading_noise(each: Sequence[Floats], resolution: float) -> float:
    """Standard deviation of a reading beside the course of its hold; rounding at least."""
    bends = [np.diff(row, 2) / np.sqrt(6.0) for row in each if len(row) > 2]
    spread = float(np.median(np.abs(np.concatenate(bends)))) / 0.6745 if bends else 0.0
    return max(spread, resolution / np.sqrt(12.0))


@dataclass(frozen=True)
class CheckedTest:
    """One test as the checks see it.

    Attributes
    ----------
    protocol : Protocol
    values : (H, R) array
        What was read, N, or mm where the tension was set; padded as the protocol is.
    resolution : float
        0 where it is not stated.
    """

    protocol: Protocol
    values: Floats
    resolution: float

    @property
    def each(self) -> list[Floats]:
        """The readings of each recorded hold."""
        return [row[mask] for row, mask in zip(self.values, self.protocol.mask, strict=True) if mask.any()]

    @property
    def times_s(self) -> list[Floats]:
        """When the readings of each recorded hold were taken."""
        p = self.protocol
        return [times[mask] for times, mask in zip(p.time_s, p.mask, strict=True) if mask.any()]

    @property
    def setting(self) -> Floats:
        """What was set in each recorded hold."""
        return self.protocol.setting[self.protocol.recorded]

    @property
    def number(self) -> Ints:
        """The number of each recorded hold."""
        return self.protocol.number[self.protocol.recorded]

    @property
    def unit(self) -> str:
        """The unit of what was read."""
        return READ_UNIT[self.protocol.control]

    @property
    def means(self) -> Floats:
        """The mean reading of each recorded hold."""
        return np.array([row.mean() for row in self.each])

    @property
    def noise(self) -> float:
        """Standard deviation of a reading beside the course of its hold; rounding at least."""
        return reading_noise(self.each, self.resolution)
