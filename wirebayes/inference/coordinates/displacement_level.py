"""Coordinates of preloads and B for tests of one weight each, which determine displacements, not the preloads nor k1.

Under a weight w the wire is stretched by ``L0 w / k1``, and by its creep; what is read is the stretch less the preload.
So the preload lies on a curve over k1, as narrow as the error of the weight is small: a bent funnel, which walkers
enter and do not leave. That error drives the creep, too, by the power U.

Beside k1, what the last reading leaves of the stretch under w is straight where it is said as an error of the weight, a
share of w; and the log of the creep that was read, which the likelihood has linear in this error.
"""

from dataclasses import dataclass

import numpy as np

from wirebayes.inference.coordinates.find_ridges import for_sample
from wirebayes.inference.coordinates.one_setting import is_one_setting
from wirebayes.inference.coordinates.ridge import Ridge
from wirebayes.model.problem import Problem
from wirebayes.model.sample import Sample
from wirebayes.numeric.typing import Array


@dataclass(frozen=True)
class DisplacementLevel:
    """A test under weights whose readings are all of one weight.

    Attributes
    ----------
    k1, preload : int
        Columns.
    weight, length, last : float
        The weight under which the last displacement was read, N; length of the wire, and that displacement, mm.
    holds : int
        Of the test until that reading; those that were not read, as rests between, may be of another weight.
    modified : bool
        Whether strain is relative to the stretched length (`wirebayes.wire.laws.Modified`).
    ridge : Ridge
        Of the material, as this test has it.
    log_ratio : float
        Log of the length over that to which parameters refer.
    length_exponent : int or float
        With which the creep grows with the length: a column, or the number at which it is fixed.
    """

    k1: int
    preload: int
    weight: float
    length: float
    last: float
    holds: int
    modified: bool
    ridge: Ridge
    log_ratio: float
    length_exponent: int | float

    def log_total(self, theta: Array, log_B: Array) -> Array:
        """(n,) log of what the weight as stated has gained by creep until the last reading, which is stretched, mm.

        Parameters
        ----------
        theta : (n, d) array
            Natural parameters; B in it is not looked at.
        log_B : (n,) array
        """
        longer = self.length_exponent
        exponent = theta[:, longer] if isinstance(longer, int) else longer
        log_gained = self.ridge.log_creep(theta) + self.ridge.log_total(theta, self.holds)
        return log_B + exponent * self.log_ratio + log_gained + np.log1p(self._strain(theta))

    def log_beyond(self, theta: Array, U: Array | float) -> Array:
        """(n,) log of what the readings show of a creep over the creep, which is stretched itself."""
        return np.log1p(self._strain(theta))

    def score(self, theta: Array, U: Array | float, log_total: Array) -> Array:
        """(n,) error of the weight, as a share of it, by which the last reading is what it is.

        Parameters
        ----------
        theta : (n, d) array
            Natural parameters.
        U : (n,) array or float
            Exponent of the tension.
        log_total : (n,) array
            Log of what the weight as stated has gained by creep until then, mm.
        """
        left = theta[:, self.preload] + self.last - self._stretch(theta) - np.exp(log_total)
        return left / self.slope(theta, U, log_total)

    def value(self, score: Array, theta: Array, U: Array | float, log_total: Array) -> Array:
        """(n,) preloads, mm.

        Parameters
        ----------
        score : (n,) array
            Errors of the weight, as shares of it.
        theta, U, log_total
            See `score`; the preload in `theta` is not looked at.
        """
        known = self._stretch(theta) + np.exp(log_total) - self.last
        return known + self.slope(theta, U, log_total) * score

    def log_gain(self, theta: Array, U: Array | float, score: Array) -> Array:
        """(n,) log of the creep that is read under the true weight over that under the stated one.

        Parameters
        ----------
        theta, U, score
            See `value`.
        """
        return np.log(np.maximum(1.0 + self._power(theta, U) * score, _LEAST_GAIN))

    def slope(self, theta: Array, U: Array | float, log_total: Array) -> Array:
        """(n,) derivative of the preload by its score, mm.

        Parameters
        ----------
        theta, U, log_total
            See `score`; the preload in `theta` is not looked at.
        """
        elastic = self._stretch(theta) * self._steepness(theta)
        return elastic + self._power(theta, U) * np.exp(log_total)

    def _stretch(self, theta: Array) -> Array:
        return self.length * self._strain(theta)

    def _steepness(self, theta: Array) -> Array | float:
        """Derivative of the log strain by the log weight."""
        return 1.0 + self._strain(theta) if self.modified else 1.0

    def _power(self, theta: Array, U: Array | float) -> Array:
        """(n,) derivative of the log of the creep that is read by the log weight, which stretches it, too."""
        strain = self._strain(theta)
        return U + strain / (1.0 + strain) * self._steepness(theta)

    def _strain(self, theta: Array) -> Array:
        """(n,) elongation under the weight over the length, before any creep."""
        share = self.weight / theta[:, self.k1]
        return share / np.maximum(1.0 - share, _LEAST) if self.modified else share


def displacement_levels(problem: Problem, ridge: Ridge) -> list[DisplacementLevel]:
    """The coordinates for the tests of a problem.

    Parameters
    ----------
    problem : Problem
        Of samples of one material, whose k1 is open.
    ridge : Ridge
        Of the material.

    Returns
    -------
    list of DisplacementLevel
        One a sample; none at all unless all that was read of each is of one weight, and its preload open.
    """
    found = [_level(problem, ridge, sample) for sample in problem.samples]
    levels = [level for level in found if level is not None]
    return levels if len(levels) == len(found) else []


def _level(problem: Problem, ridge: Ridge, sample: Sample) -> DisplacementLevel | None:
    """The coordinates for one sample."""
    protocol = sample.protocol
    weights = protocol.setting[protocol.recorded]
    if protocol.control != "force" or not is_one_setting(weights):
        return None
    names = problem.names
    k1, preload = (problem.column(name, sample) for name in ("k1", "preload"))
    if preload not in names:
        return None
    readings = sample.readings[..., 0][protocol.mask]
    last_recorded = int(np.flatnonzero(protocol.recorded)[-1])
    return DisplacementLevel(
        k1=names.index(k1),
        preload=names.index(preload),
        weight=float(weights[-1]),
        length=protocol.length_mm,
        last=float(readings[-1]),
        holds=1 + last_recorded,
        modified=sample.model.law == "modified",
        ridge=for_sample(ridge, problem, sample),
        log_ratio=float(np.log(sample.length_ratio)),
        length_exponent=problem.length_exponent(sample),
    )


_LEAST = 1e-3  # of the stretched length that is left without strain: below, the law has no wire
# of the creep under the stated weight: a setting error is at most half of the weight, and U seldom 2
_LEAST_GAIN = 0.02
