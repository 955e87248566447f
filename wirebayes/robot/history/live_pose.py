"""What a step of a live estimator answers."""

from dataclasses import dataclass

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.rotation import matrix
from wirebayes.robot.mechanics.winches import mean_of_each_winch, of_each_winch


@dataclass(frozen=True)
class LivePose:
    """Where the platform is, and what would bring it back.

    Attributes
    ----------
    time_s : float
    position_m, position_sd_m : (3,) arrays
        Mean and standard deviation.
    low_m, high_m : (3,) arrays
        5 and 95 % of the position.
    rotation : (3, 3) array
        Mean orientation.
    rotation_sd_rad : (3,) array
        About the world's axes.
    joint_m, joint_sd_m : (j,) arrays
        Joint values that bring the platform to where the nominal joint values would hold it if no wire crept.
    correction_m : (j,) array
        What that is beyond the nominal joint values: wire of all lines.
    straight_correction_m : (j,) array
        The same in one line, as firmware counts: `correction_m` over the number of lines.
    tension_N : (w,) array
        Mean.
    held : float
        Share of the draws that hold the platform.

    Examples
    --------
    >>> now = wb.live("linear-7", posterior, draws=16).step(0.0, held.summary()["inverse"]["joint_value_m"]["q50"])
    >>> now.held
    1.0
    """

    time_s: float
    position_m: Floats
    position_sd_m: Floats
    low_m: Floats
    high_m: Floats
    rotation: Floats
    rotation_sd_rad: Floats
    joint_m: Floats
    joint_sd_m: Floats
    correction_m: Floats
    straight_correction_m: Floats
    tension_N: Floats
    held: float

    @classmethod
    def of(
        cls, time_s: float, robot: Robot, draws: Floats, centre: Floats, nominal_m: Floats, held: float
    ) -> "LivePose":
        """The same by draws of all that is unknown.

        Parameters
        ----------
        time_s : float
        robot : Robot
            Of w legs.
        draws : (n, 6 + 2 w) array
            Position, m, rotation from `centre`, rad, joint values, m, and tensions, N.
        centre : (3, 3) array
            Orientation that the rotations of the draws start from.
        nominal_m : (w,) array
            Joint values, were there no creep.
        held : float
            Share of the draws that hold the platform.
        """
        first_tension = 6 + robot.legs
        mean = draws.mean(0)
        sd = draws.std(0)
        low, high = row_quantiles(draws[:, :3], np.array([0.05, 0.95]))
        wanted = mean[6:first_tension]
        change = of_each_winch(robot, wanted - nominal_m)
        return cls(
            time_s,
            mean[:3],
            sd[:3],
            low,
            high,
            matrix(mean[3:6]) @ centre,
            sd[3:6],
            of_each_winch(robot, wanted),
            of_each_winch(robot, sd[6:first_tension]),
            change,
            change / mean_of_each_winch(robot, robot.lines),
            mean[first_tension:],
            held,
        )


def row_quantiles(values: Floats, probability: Floats) -> Floats:
    """Quantiles ``(q, d)`` of ``(n, d)`` values, linear between neighbours."""
    ordered, last = np.sort(values, 0), len(values) - 1
    at = probability * last
    below = at.astype(int)
    above = np.minimum(below + 1, last)
    rise = ordered[above] - ordered[below]
    return ordered[below] + (at - below)[:, None] * rise
