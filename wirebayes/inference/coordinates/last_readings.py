"""What the last readings of a test's holds say of stiffness and preload beside the creep until then.

A hold at displacement x is last read at a tension t, and ``x + preload = t L0 / k1 + c``, with c the elongation by
creep until then, in this hold and in those before. Under weights it is the displacement that is read, of the same
equation. Over the holds, c is nearly a straight line in t. Its slope adds to the compliance ``L0 / k1``: readings show
the sum alone. Its mean adds to the mean elongation, which shows the preload. Where creep is fast and first readings are
late, both may be many times what readings leave open of the sums.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wirebayes.inference.coordinates.find_ridges import for_sample
from wirebayes.inference.coordinates.one_setting import is_one_setting
from wirebayes.inference.coordinates.ridge import Ridge
from wirebayes.model.problem import Problem
from wirebayes.model.sample import Sample
from wirebayes.numeric.typing import Array, Bools


@dataclass(frozen=True)
class LastReadings:
    """The last readings of the holds of a test.

    Attributes
    ----------
    sample : Sample
        The test.
    ridge : Ridge
        Of the material, as this test has it.
    tension, time_s : (H,) arrays
        Tensions as read last, or as set, N; when each hold was last read.
    read : (H,) array of bool
        Whether it was, and taut.
    """

    sample: Sample
    ridge: Ridge
    tension: Array
    time_s: Array
    read: Bools

    @cached_property
    def without_begin(self) -> bool:
        """Whether tensions at the beginning of holds are not known: elongations are read, or tensions later.

        First readings of steps at their beginning are stretch without creep but for that of earlier holds: k1 and the
        preload are what they say. Fits need as few evaluations with these, and half as many climbs come to a narrow
        mode at the edge of slack with the preload beside the mean elongation.
        """
        protocol = self.sample.protocol
        return protocol.control == "force" or bool((protocol.time_s[protocol.recorded, 0] > 0.0).any())

    @cached_property
    def mean_tension(self) -> float:
        """The mean tension of the holds that were read, N."""
        return float(self.tension[self.read].mean())

    @cached_property
    def spread(self) -> float:
        """Sum of the squares of these tensions beside their mean; 0 where they are too much alike to tell a slope."""
        tension = self.tension[self.read]
        return 0.0 if is_one_setting(tension) else float(((tension - self.mean_tension) ** 2).sum())

    def log_slope(self, theta: Array) -> Array:
        """(n,) log of the creep until a last reading that is added with its tension, mm/N, for B = 1.

        Creep that falls with tension counts as none: taken from the compliance of the wire, it might leave none.
        """
        weights = (self.tension - self.mean_tension)[self.read] / self.spread
        with np.errstate(divide="ignore"):
            return np.log(np.maximum(weights @ self._crept(theta), 0.0))

    def mean_elongation(self, theta: Array) -> Array:
        """(n,) mean of the elongations at last readings, mm: elastic, and by creep, which is stretched itself."""
        strain = self.tension[self.read, None] / self.ridge.get(theta, "k1")
        crept = self.ridge.get(theta, "B") * self._crept(theta)
        return (np.exp(self.ridge.log_length) * strain + crept * (1.0 + strain)).mean(axis=0)

    def _crept(self, theta: Array) -> Array:
        """(h, n) elongation by creep until the last reading of each hold that was read, for B = 1."""
        ridge = self.ridge
        drive = np.exp(ridge.get(theta, "U") * ridge.log_tension[:, None])
        at_last, at_end = (ridge.reached(theta, time_s[:, None]) for time_s in (self.time_s, ridge.end_s))
        carried = 0.0 * drive[0]
        out = []
        for aim, last, end in zip(drive, at_last, at_end, strict=True):
            amount = aim - ridge.kept * carried
            out.append(carried + amount * last)
            carried = carried + amount * end
        return np.array(out)[self.read]


def last_readings(ridge: Ridge, problem: Problem, sample: Sample) -> LastReadings:
    """What the last readings of a sample say.

    Parameters
    ----------
    ridge : Ridge
        Of its material.
    problem : Problem
    sample : Sample
    """
    protocol = sample.protocol
    holds = np.arange(len(sample.readings))
    last = protocol.last_reading
    tension = protocol.setting if protocol.control == "force" else sample.readings[holds, last, 0]
    read = protocol.recorded & (tension > 0.0)
    return LastReadings(sample, for_sample(ridge, problem, sample), tension, protocol.time_s[holds, last], read)
