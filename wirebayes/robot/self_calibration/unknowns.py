"""The unknowns of a whole robot: exit points, platform points, reference lengths, wires and sensors, in one vector.

All are kept in units of what was known before: the prior of the vector is standard normal.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wirebayes.numeric.typing import Floats, Indices
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.winches import of_each_leg
from wirebayes.robot.self_calibration.session import LengthPrior


def one_after_another(counts: dict[str, int]) -> dict[str, slice]:
    """The place of each in a vector that holds so many numbers of them, in this order."""
    ends = np.cumsum(list(counts.values()))
    return {name: slice(int(end) - count, int(end)) for (name, count), end in zip(counts.items(), ends, strict=True)}


@dataclass(frozen=True)
class StatedErrors:
    """Standard deviations of what a robot's file and a session state; 0 is exact.

    Attributes
    ----------
    exit_m, platform_m : float
        Of every coordinate of an exit point, of a platform point.
    pose_m : float
        Of every coordinate of a stated pose; its rotation is as uncertain at the platform's edge.
    joint_m : float or None
        Of a joint value, as a length; None: estimated from the readings.
    drum : float
        Relative, of the radius of every drum.
    level_N : float
        Of what a wire's tension is on average in the holds where nobody read it, about what is usual.
    """

    exit_m: float = 0.0
    platform_m: float = 0.0
    pose_m: float = 0.0
    joint_m: float | None = None
    drum: float = 0.0
    level_N: float = 0.0


@dataclass(frozen=True)
class Parts:
    """Physical values of one vector of unknowns.

    Attributes
    ----------
    exit_m, platform_m : (w, 3) arrays
    reference_m : (w,) array
        What the zero-tension lengths before creep are beyond what the joint values say.
    bias_N : (w,) array
    drum : (w,) array
        Relative error of every drum's radius.
    wires : (d,) array
        A row of unknowns as `LengthPrior.wires` takes it.
    level_N : (w,) array
        What tensions that nobody read are on average beyond what is usual.
    """

    exit_m: Floats
    platform_m: Floats
    reference_m: Floats
    bias_N: Floats
    drum: Floats
    wires: Floats
    level_N: Floats


@dataclass(frozen=True)
class Unknowns:
    """Where each unknown stands in the vector, and its scale.

    Attributes
    ----------
    robot : Robot
        As its file says: the mean of the geometry's prior.
    prior : LengthPrior
        Of reference lengths, wires and sensors.
    errors : StatedErrors
    """

    robot: Robot
    prior: LengthPrior
    errors: StatedErrors

    @cached_property
    def moments(self) -> tuple[Floats, Floats]:
        """Mean ``(d,)`` of references, wires and sensors, and a factor ``(d, d)`` of their covariance."""
        mean, covariance = self.prior.moments(self.robot.legs)
        return mean, np.asarray(np.linalg.cholesky(covariance), np.float64)

    @property
    def of_wires(self) -> int:
        """How many unknowns are references, wires and sensors."""
        return len(self.moments[0])

    @cached_property
    def slices(self) -> dict[str, slice]:
        """Where exit points, platform points, drums, references with wires and sensors (``wires``) and levels stand.

        Slices of what is exact are empty.
        """
        legs = self.robot.legs
        counts = {
            "exit": 3 * legs if self.errors.exit_m > 0 else 0,
            "platform": 3 * legs if self.errors.platform_m > 0 else 0,
            "drum": self.robot.joints if self.errors.drum > 0 else 0,
            "wires": self.of_wires,
            "level": legs if self.errors.level_N > 0 else 0,
        }
        return one_after_another(counts)

    @property
    def count(self) -> int:
        """Length of the vector."""
        return self.slices["level"].stop

    @property
    def references(self) -> slice:
        """Where the reference errors stand."""
        first = self.slices["wires"].start
        return slice(first, first + self.robot.legs)

    @property
    def geometry(self) -> slice:
        """Where points, drums and reference errors stand."""
        return slice(0, self.references.stop)

    @property
    def of_lines(self) -> slice:
        """Where the lines' parameters and what each specimen differs by stand."""
        first = self.references.stop
        biases = self.robot.legs if self.prior.bias_sd_N > 0 else 0
        return slice(first, self.slices["wires"].stop - biases)

    @property
    def drum_columns(self) -> Indices:
        """(w,) Where the error of each leg's drum stands."""
        robot = self.robot
        drum = np.arange(robot.legs) if robot.winch is None else robot.winch
        return np.asarray(self.slices["drum"].start + drum)

    def parts(self, white: Floats) -> Parts:
        """Physical values of a vector ``(m,)``."""
        legs = self.robot.legs
        errors = self.errors
        mean, root = self.moments
        wires = mean + root @ white[self.slices["wires"]]
        bias = self.prior.bias_N(legs, wires[None])[0]
        drum = level = np.zeros(legs)
        if errors.drum > 0:
            drum = of_each_leg(self.robot, errors.drum * white[self.slices["drum"]])
        if errors.level_N > 0:
            level = errors.level_N * white[self.slices["level"]]
        return Parts(
            exit_m=self._moved("exit", white, self.robot.exit_m, errors.exit_m),
            platform_m=self._moved("platform", white, self.robot.platform_m, errors.platform_m),
            reference_m=wires[:legs],
            bias_N=bias,
            drum=drum,
            wires=wires,
            level_N=level,
        )

    def _moved(self, name: str, white: Floats, points_m: Floats, sd_m: float) -> Floats:
        """Points where a vector of unknowns has them."""
        own = white[self.slices[name]]
        if not len(own):
            return points_m
        return points_m + sd_m * own.reshape(-1, 3)
