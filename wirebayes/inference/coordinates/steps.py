"""The steps that straighten a posterior, each a map of a few columns beside all others.

A step puts its coordinates ``z`` in place of what stands there, given all natural parameters ``theta``; back, it puts
natural parameters in place, given all coordinates. Arrays are ``(n, d)`` and changed where they are.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from wirebayes.inference.coordinates import shares
from wirebayes.inference.coordinates.common_error import CommonError
from wirebayes.inference.coordinates.displacement_level import DisplacementLevel
from wirebayes.inference.coordinates.first_stretch import FirstStretch
from wirebayes.inference.coordinates.last_readings import LastReadings
from wirebayes.inference.coordinates.ridge import Ridge
from wirebayes.inference.coordinates.slack_edge import SlackEdge
from wirebayes.inference.coordinates.tension_level import TensionLevel
from wirebayes.numeric.typing import Array


class Step:
    """A step of unit Jacobian."""

    def to_sampled(self, z: Array, theta: Array) -> None:
        """Put coordinates in place, after the steps before this one."""
        raise NotImplementedError

    def to_natural(self, theta: Array, z: Array) -> None:
        """Put natural parameters in place, after the steps behind this one."""
        raise NotImplementedError

    def log_jacobian(self, theta: Array, z: Array) -> Array | float:
        """(n,) what it adds to log |d natural / d sampled|."""
        return 0.0


@dataclass(frozen=True)
class Hazard(Step):
    """Log k2 becomes the log hazard at half a typical hold."""

    ridge: Ridge

    def to_sampled(self, z: Array, theta: Array) -> None:
        z[:, self.ridge.where["k2"]] += self.ridge.log_hazard(theta)

    def to_natural(self, theta: Array, z: Array) -> None:
        column = self.ridge.where["k2"]
        theta[:, column] = np.exp(z[:, column] - self.ridge.log_hazard(theta))


@dataclass(frozen=True)
class Power(Step):
    """Log U becomes its distance from the power of tension that suits the measured losses best at this hazard."""

    ridge: Ridge

    def to_sampled(self, z: Array, theta: Array) -> None:
        z[:, self.ridge.where["U"]] -= self.ridge.log_power(z)

    def to_natural(self, theta: Array, z: Array) -> None:
        column = self.ridge.where["U"]
        theta[:, column] = np.exp(z[:, column] + self.ridge.log_power(z))


@dataclass(frozen=True)
class Loss(Step):
    """Log B becomes the log of what is lost in a hold, and what creeps beside the creep its share of that."""

    ridge: Ridge
    level: TensionLevel | DisplacementLevel | FirstStretch | None

    def _beyond(self, theta: Array) -> Any:
        """(n,) log of what a test of one setting shows over what the ridge says."""
        return 0.0 if self.level is None else self.level.log_beyond(theta, self.ridge.get(theta, "U"))

    def to_sampled(self, z: Array, theta: Array) -> None:
        column = self.ridge.where["B"]
        stiffness = self.ridge.log_stiffness(theta)
        lost = z[:, column] + (self.ridge.log_creep(theta) + stiffness) + self._beyond(theta)
        for part in self.ridge.beside:
            own = np.log(theta[:, part.column]) + part.log_gained(theta) + stiffness
            z[:, part.column] = shares.score(own, lost)
            lost = np.logaddexp(lost, own)
        z[:, column] = lost

    def to_natural(self, theta: Array, z: Array) -> None:
        column = self.ridge.where["B"]
        stiffness = self.ridge.log_stiffness(theta)
        lost = z[:, column]
        for part in reversed(self.ridge.beside):
            share, rest = shares.log_shares(z[:, part.column])
            gained = part.log_gained(theta) + stiffness
            theta[:, part.column] = np.exp(lost + share - gained)
            lost = lost + rest
        gained = self.ridge.log_creep(theta) + stiffness
        theta[:, column] = np.exp(lost - gained - self._beyond(theta))

    def log_jacobian(self, theta: Array, z: Array) -> Array | float:
        return sum(shares.log_slope(theta[:, part.column], z[:, part.column]) for part in self.ridge.beside)


@dataclass(frozen=True)
class SoftenedStiffness(Step):
    """Log k1 becomes the log stiffness of the wire, with its fixture, after its creep; a fixture its share of it.

    Attributes
    ----------
    ridge : Ridge
    last : LastReadings, optional
        By which the creep softens the wire; as much as in one hold where they are left out.
    """

    ridge: Ridge
    last: LastReadings | None = None

    def to_sampled(self, z: Array, theta: Array) -> None:
        ridge = self.ridge
        column = self.ridge.where["k1"]
        if ridge.fixture is not None:
            own = np.log(theta[:, ridge.fixture]) + np.log(ridge.get(theta, "k1")) - ridge.log_length
            z[:, ridge.fixture] = shares.score(own, np.zeros_like(own))
            z[:, column] -= np.logaddexp(0.0, own)
        z[:, column] -= self._softened(theta, z)

    def to_natural(self, theta: Array, z: Array) -> None:
        ridge = self.ridge
        column = self.ridge.where["k1"]
        log_k1 = z[:, column] + self._softened(theta, z)
        if ridge.fixture is not None:
            share, rest = shares.log_shares(z[:, ridge.fixture])
            theta[:, ridge.fixture] = np.exp(share - log_k1 + ridge.log_length)
            log_k1 = log_k1 - rest
        theta[:, column] = np.exp(log_k1)

    def log_jacobian(self, theta: Array, z: Array) -> Array | float:
        column = self.ridge.fixture
        return 0.0 if column is None else shares.log_slope(theta[:, column], z[:, column])

    def _softened(self, theta: Array, z: Array) -> Array:
        if self.last is None:
            return self.ridge.softened(theta, z)
        return np.logaddexp(0.0, self.last.log_slope(theta) + self.ridge.log_amount(theta, z))


@dataclass(frozen=True)
class AddedCompliance(Step):
    """Under weights, log k1 becomes the log stiffness that last readings show: the creep until then adds compliance.

    Coordinates by which creep gives more than the whole compliance are of no wire.
    """

    ridge: Ridge
    last: LastReadings

    def to_sampled(self, z: Array, theta: Array) -> None:
        column = self.ridge.where["k1"]
        z[:, column] -= np.log1p(theta[:, column] * self._of_creep(theta, z))

    def to_natural(self, theta: Array, z: Array) -> None:
        column = self.ridge.where["k1"]
        share = np.exp(z[:, column]) * self._of_creep(theta, z)
        theta[:, column] = np.exp(z[:, column] - np.log1p(-share))

    def log_jacobian(self, theta: Array, z: Array) -> Array | float:
        column = self.ridge.where["k1"]
        return np.log(theta[:, column]) - z[:, column]

    def _of_creep(self, theta: Array, z: Array) -> Array:
        """(n,) strain by creep per tension, 1/N."""
        return np.exp(self.last.log_slope(theta) + self.ridge.log_amount(theta, z) - self.ridge.log_length)


@dataclass(frozen=True)
class MeanElongation(Step):
    """The preload becomes what it is beside the mean elongation at last readings.

    Attributes
    ----------
    last : LastReadings
    preload : int
        Its column.
    scale : float
        Of its coordinate, mm.
    """

    last: LastReadings
    preload: int
    scale: float

    def to_sampled(self, z: Array, theta: Array) -> None:
        z[:, self.preload] -= self.last.mean_elongation(theta) / self.scale

    def to_natural(self, theta: Array, z: Array) -> None:
        theta[:, self.preload] = z[:, self.preload] * self.scale + self.last.mean_elongation(theta)


@dataclass(frozen=True)
class Level(Step):
    """At one displacement, log k1 becomes that beside preload and loss, and the loss is that of the true stretch."""

    ridge: Ridge
    level: TensionLevel

    def to_sampled(self, z: Array, theta: Array) -> None:
        k1 = self.level.k1
        B = self.ridge.where["B"]
        z[:, k1] = self.level.log_tension(theta, z[:, k1]) - self._log_expected(theta, z[:, B])
        z[:, B] -= self.ridge.get(theta, "U") * z[:, k1]

    def to_natural(self, theta: Array, z: Array) -> None:
        k1 = self.level.k1
        B = self.ridge.where["B"]
        z[:, B] += self.ridge.get(theta, "U") * z[:, k1]
        tension = z[:, k1] + self._log_expected(theta, z[:, B])
        z[:, k1] = tension - self.level.log_tension(theta, np.zeros(len(theta)))  # for the steps before this one

    def _log_expected(self, theta: Array, log_lost: Array) -> Any:
        in_first_hold = log_lost + self.ridge.log_total(theta, holds=1)
        return self.level.log_expected(in_first_hold, self.ridge.get(theta, "k2"), self.ridge.get(theta, "N"))


@dataclass(frozen=True)
class WeightLevel(Step):
    """Where each test is of one weight, preloads become errors of weights, and log B is that under the true ones."""

    ridge: Ridge
    levels: tuple[DisplacementLevel, ...]
    common: CommonError | None
    scale: Array

    @property
    def preloads(self) -> list[int]:
        """Their columns."""
        return [level.preload for level in self.levels]

    def to_sampled(self, z: Array, theta: Array) -> None:
        B = self.ridge.where["B"]
        U = self.ridge.get(theta, "U")
        log_B = self._log_B(theta, z[:, B])
        errors = np.array([level.score(theta, U, level.log_total(theta, log_B)) for level in self.levels])
        z[:, B] += self._log_gain(theta, errors)
        z[:, self.preloads] = (self.common.coordinates(errors, theta) if self.common else errors).T

    def to_natural(self, theta: Array, z: Array) -> None:
        B = self.ridge.where["B"]
        U = self.ridge.get(theta, "U")
        errors = self._errors(theta, z)
        z[:, B] -= self._log_gain(theta, errors)  # for the steps before this one
        log_B = self._log_B(theta, z[:, B])
        for level, error in zip(self.levels, errors, strict=True):
            theta[:, level.preload] = level.value(error, theta, U, level.log_total(theta, log_B))

    def log_jacobian(self, theta: Array, z: Array) -> Array | float:
        B = self.ridge.where["B"]
        U = self.ridge.get(theta, "U")
        log_B = self._log_B(theta, z[:, B] - self._log_gain(theta, self._errors(theta, z)))
        slopes = [level.slope(theta, U, level.log_total(theta, log_B)) for level in self.levels]
        of_preloads = np.log(slopes).sum(axis=0) - np.log(self.scale[self.preloads]).sum()
        return of_preloads + (self.common.log_slope(theta) if self.common else 0.0)

    def _errors(self, theta: Array, z: Array) -> Array:
        """(m, n) errors of the weights, as shares of them."""
        coordinates = z[:, self.preloads].T
        return self.common.errors(coordinates, theta) if self.common else coordinates

    def _log_gain(self, theta: Array, errors: Array) -> Array:
        """(n,) log of the creep under the true weights over that under the stated ones: the mean of the tests."""
        U = self.ridge.get(theta, "U")
        gains = [level.log_gain(theta, U, error) for level, error in zip(self.levels, errors, strict=True)]
        return np.asarray(np.mean(gains, axis=0))

    def _log_B(self, theta: Array, log_lost: Array) -> Array:
        """(n,) log B, by the log of what is gained in a hold, as if what creeps beside the creep were creep."""
        beyond = self.levels[0].log_beyond(theta, self.ridge.get(theta, "U"))
        return log_lost - self.ridge.log_creep(theta) - beyond


@dataclass(frozen=True)
class Preload(Step):
    """The preload becomes what is wide where the first hold hardly creeps."""

    edge: SlackEdge
    scale: float

    def to_sampled(self, z: Array, theta: Array) -> None:
        z[:, self.edge.preload] = self.edge.score(theta) / self.scale

    def to_natural(self, theta: Array, z: Array) -> None:
        column = self.edge.preload
        theta[:, column] = self.edge.value(theta[:, column], theta)

    def log_jacobian(self, theta: Array, z: Array) -> Array | float:
        return self.edge.log_slope(theta)


@dataclass(frozen=True)
class Stretched(Step):
    """In one of several tests at one displacement each, the preload becomes its error in standard deviations."""

    stretch: FirstStretch
    scale: float

    def to_sampled(self, z: Array, theta: Array) -> None:
        z[:, self.stretch.preload] = self.stretch.score(theta)

    def to_natural(self, theta: Array, z: Array) -> None:
        column = self.stretch.preload
        theta[:, column] = self.stretch.value(z[:, column], theta)

    def log_jacobian(self, theta: Array, z: Array) -> Array | float:
        return self.stretch.log_slope(theta) - np.log(self.scale)


@dataclass(frozen=True)
class StretchLevel(Step):
    """Where preloads are `Stretched`, the log of the loss becomes that of the true stretches: the mean of the tests."""

    ridge: Ridge
    levels: tuple[FirstStretch, ...]
    scale: Array

    @property
    def preloads(self) -> list[int]:
        """Their columns."""
        return [level.preload for level in self.levels]

    def to_sampled(self, z: Array, theta: Array) -> None:
        z[:, self.ridge.where["B"]] += self._log_gain(theta, z)

    def to_natural(self, theta: Array, z: Array) -> None:
        z[:, self.ridge.where["B"]] -= self._log_gain(theta, z)  # for the steps before this one

    def _log_gain(self, theta: Array, z: Array) -> Array:
        U = self.ridge.get(theta, "U")
        gains = [each.log_gain(theta, U, z[:, each.preload]) for each in self.levels]
        return np.asarray(np.mean(gains, axis=0))


@dataclass(frozen=True)
class Straightened(Step):
    """The preload becomes what is left of it once a toe is straight, which is all that a stretch far beyond it shows.

    Attributes
    ----------
    preload, toe : int
        Columns.
    scale : float
        Of the preload's coordinate, mm.
    """

    preload: int
    toe: int
    scale: float

    def to_sampled(self, z: Array, theta: Array) -> None:
        z[:, self.preload] -= theta[:, self.toe] / self.scale

    def to_natural(self, theta: Array, z: Array) -> None:
        z[:, self.preload] += theta[:, self.toe] / self.scale  # for the steps before this one
        theta[:, self.preload] = self.scale * z[:, self.preload]
