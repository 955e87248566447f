"""Coordinates of preloads and B for several tests, each at one displacement: they determine tensions, not preloads.

The first hold of a test, at displacement x, begins at a tension that its readings tell beside the creep. Beside k1 and
B, the preload is the stretch at this tension less x, but for the setting error, which readings hardly tell from it. So
each preload lies on a curve over k1, as narrow as its setting error is small: bent funnels, which walkers enter and do
not leave. An error drives the creep, too, by the power U, and the likelihood has this linear in the error.

What is left of each preload, in the standard deviations that errors and prior leave it, is standard normal, whatever
the others are. So straight is the log of the loss that the true stretches drive, from their tensions at the beginning.
"""

from dataclasses import dataclass

import numpy as np

from wirebayes.inference.coordinates.one_setting import is_one_displacement
from wirebayes.inference.coordinates.ridge import Ridge
from wirebayes.inference.coordinates.slack_edge import SlackEdge
from wirebayes.model.problem import Problem
from wirebayes.model.sample import Sample
from wirebayes.numeric.typing import Array


@dataclass(frozen=True)
class FirstStretch:
    """The first hold of a test whose holds are all at one displacement.

    Attributes
    ----------
    preload : int
        Its column.
    setting_sd, sensor_sd : int or float
        Columns, or the numbers at which they are fixed.
    prior_mean, prior_sd : float
        Of the preload, mm.
    at, length : float
        Displacement, and length of the wire, mm.
    read, times_s : (R,) arrays
        Tensions of the hold, N, and when they were read.
    rounding : float
        Standard deviation of what rounding adds to a reading, N.
    modified : bool
        Whether strain is relative to the stretched length (`wirebayes.wire.laws.Modified`).
    ridge : Ridge
        Of the material.
    log_ratio : float
        Log of the length over that to which parameters refer.
    length_exponent : int or float
        With which the creep grows with the length: a column, or the number at which it is fixed.
    """

    preload: int
    setting_sd: int | float
    sensor_sd: int | float
    prior_mean: float
    prior_sd: float
    at: float
    length: float
    read: Array
    times_s: Array
    rounding: float
    modified: bool
    ridge: Ridge
    log_ratio: float
    length_exponent: int | float

    def score(self, theta: Array) -> Array:
        """(n,) scores of natural parameters (n, d)."""
        middle, width = self._expected(theta, *self._beginning(theta))
        return (theta[:, self.preload] - middle) / width

    def value(self, score: Array, theta: Array) -> Array:
        """(n,) preloads, mm, of scores beside the other natural parameters (n, d)."""
        middle, width = self._expected(theta, *self._beginning(theta))
        return middle + width * score

    def log_slope(self, theta: Array) -> Array:
        """(n,) log of the derivative of the preload by its score."""
        return np.log(self._expected(theta, *self._beginning(theta))[1])

    def log_beyond(self, theta: Array, U: Array | float) -> Array:
        """(n,) log of what is lost in a hold over what its first reading drives in a wire that is hardly stretched.

        Parameters
        ----------
        theta : (n, d) array
            Natural parameters; B in it is not looked at.
        U : (n,) array or float
            Exponent of the tension.
        """
        stretched = np.log1p(self.read[-1] / self._k1(theta))
        return stretched + U * np.log(self._extrapolated(theta) / self.read[0])

    def log_gain(self, theta: Array, U: Array | float, score: Array) -> Array:
        """(n,) log of the creep that the likelihood has by the error over that which the true stretch drives.

        Parameters
        ----------
        theta : (n, d) array
            Natural parameters; neither B nor the preload is looked at.
        U : (n,) array or float
            Exponent of the tension.
        score : (n,) array
            Of the preload.
        """
        tension = self._extrapolated(theta)
        middle, width = self._expected(theta, tension, len(self.read) ** -0.5)
        as_set = np.maximum((self.at + middle + width * score) / self._stretch(theta, tension), _LEAST)
        by_error = np.maximum(1.0 + U * (1.0 / as_set - 1.0), _LEAST)
        return np.log(by_error) + U * np.log(as_set)

    def _expected(self, theta: Array, tension: Array, share: Array | float) -> tuple[Array, Array]:
        """(n,) mean and standard deviation of the preload by readings and prior, mm.

        Parameters
        ----------
        theta : (n, d) array
            Natural parameters.
        tension : (n,) array
            With which the hold begins, N.
        share : (n,) array or float
            Its standard deviation, in those of a reading.
        """
        of_reading = np.hypot(_of(theta, self.sensor_sd), self.rounding)
        of_tension = share * of_reading * self.length / self._k1(theta)
        precision = 1.0 / (_of(theta, self.setting_sd) ** 2 + of_tension**2)
        of_prior = self.prior_sd**-2
        total = precision + of_prior
        by_readings = self._stretch(theta, tension) - self.at
        return (precision * by_readings + of_prior * self.prior_mean) / total, 1.0 / np.sqrt(total)

    def _stretch(self, theta: Array, tension: Array) -> Array:
        """(n,) stretch of a wire without creep at a tension (n,), mm."""
        strain = tension / self._k1(theta)
        if self.modified:
            strain = strain / np.maximum(1.0 - strain, _LEAST)
        return self.length * strain

    def _beginning(self, theta: Array) -> tuple[Array, Array]:
        """(n,) tension at the beginning that suits readings best, N; its standard deviation in those of a reading."""
        k1 = self._k1(theta)
        U = self.ridge.get(theta, "U")
        strain_for_one = self._strain_for_one(theta)
        read = self.read[:, None]
        first = self.read[0]
        lowest = first / _MOST
        highest = first * _MOST
        tension = np.full(len(theta), first)
        square = np.ones(len(theta))
        for _ in range(_REPETITIONS):
            crept = strain_for_one * tension**U
            expected = self._after_creep(tension, k1, crept)
            slope = 1.0 - U * (1.0 - expected / tension)
            slope = np.clip(slope, _LEAST_SLOPE, 1.0)
            square = (slope * slope).sum(axis=0)
            along = (slope * (read - expected)).sum(axis=0)
            tension = np.clip(tension + along / square, lowest, highest)
        sd = 1.0 / np.sqrt(square)
        return tension, sd

    def _strain_for_one(self, theta: Array) -> Array:
        """(r, n) strain by creep at the readings under a constant tension of 1 N."""
        longer = np.exp(_of(theta, self.length_exponent) * self.log_ratio)
        reached = self.ridge.reached(theta, self.times_s[:, None])
        return self.ridge.get(theta, "B") * longer * reached / self.length

    def _after_creep(self, tension: Array, k1: Array, crept: Array) -> Array:
        """(r, n) readings after a beginning at a tension (n,), by the strain (r, n) that creep has taken, N."""
        if self.modified:
            return tension - (k1 - tension) * crept
        return (tension - k1 * crept) / (1.0 + crept)

    def _extrapolated(self, theta: Array) -> Array:
        """(n,) tension at the beginning by the first and the last reading and the course of the creep, N."""
        before, until = (self.ridge.reached(theta, time_s) for time_s in self.times_s[[0, -1]])
        lost = max(self.read[0] - self.read[-1], 0.0) * before / np.maximum(until - before, before / _MOST)
        return self.read[0] + lost

    def _k1(self, theta: Array) -> Array:
        """(n,) stiffness, with a fixture where its compliance is sampled, N."""
        return np.exp(self.ridge.log_stiffness(theta) + self.ridge.log_length)


def first_stretches(problem: Problem, ridge: Ridge, slack_edges: list[SlackEdge]) -> list[FirstStretch]:
    """The coordinates for the tests of a problem.

    Parameters
    ----------
    problem : Problem
        Of samples of one material, whose k1 is open.
    ridge : Ridge
        Of the material.
    slack_edges : list of SlackEdge
        Coordinates of preloads; one that depends on k1 leaves no place for these.

    Returns
    -------
    list of FirstStretch
        One a sample; none at all unless there are several, each at one displacement and its preload open.
    """
    samples = problem.samples
    preloads = [problem.place("preload", sample) for sample in samples]
    if len(samples) == 1 or any(edge.threshold != 0.0 for edge in slack_edges):
        return []
    if not all(isinstance(place, int) for place in preloads):
        return []
    if not all(is_one_displacement(sample) for sample in samples):
        return []
    return [_first_stretch(problem, ridge, sample, int(place)) for sample, place in zip(samples, preloads, strict=True)]


def _first_stretch(problem: Problem, ridge: Ridge, sample: Sample, preload: int) -> FirstStretch:
    """The coordinates for one sample.

    Parameters
    ----------
    problem : Problem
    ridge : Ridge
    sample : Sample
    preload : int
        Column of its preload.
    """
    protocol = sample.protocol
    known = problem.prior.distributions[problem.names[preload]]
    first = protocol.mask[0]
    return FirstStretch(
        preload=preload,
        setting_sd=problem.place("setting_sd", sample),
        sensor_sd=problem.place("sensor_sd", sample),
        prior_mean=float(known.mean()),
        prior_sd=float(known.std()),
        at=float(protocol.setting[0]),
        length=protocol.length_mm,
        read=sample.readings[0, first, 0],
        times_s=protocol.time_s[0, first],
        rounding=float(sample.resolution / np.sqrt(12.0)),
        modified=sample.model.law == "modified",
        ridge=ridge,
        log_ratio=float(np.log(sample.length_ratio)),
        length_exponent=problem.length_exponent(sample),
    )


def _of(theta: Array, place: int | float) -> Array | float:
    return theta[:, place] if isinstance(place, int) else place


_LEAST = 1e-3  # of the stretch, below which the wire is slack; of the stretched length, below which the law has no wire
# of the first reading: no wire of a posterior has lost more before, and what has is only to be told apart
_MOST = 10.0
_LEAST_SLOPE, _REPETITIONS = 0.05, 4  # of readings by the tension at the beginning; Newton's steps to a millionth of it
