"""Where a platform is over time, and when and how it falls."""

from dataclasses import dataclass

import numpy as np

from wirebayes.numeric.typing import Bools, Floats, Ints
from wirebayes.robot.motion import outcome
from wirebayes.robot.motion.creep import CreepState


@dataclass(frozen=True)
class Course:
    """Poses of ``n`` draws at ``t`` times of one hold.

    Attributes
    ----------
    times_s : (t,) array
    position_m : (n, t, 3) array
    rotation : (n, t, 3, 3) array
    tension_N : (n, t, w) array
    status : (n, t) int array
        As in `forward.Equilibria`.
    end : CreepState
        What the wires carry out of the last time.
    falls : Falls or None
    """

    times_s: Floats
    position_m: Floats
    rotation: Floats
    tension_N: Floats
    status: Ints
    end: CreepState
    falls: "Falls | None" = None

    @property
    def found(self) -> Bools:
        """(n,) True where every time has a stable equilibrium."""
        return (self.status == outcome.FOUND).all(1)


@dataclass(frozen=True)
class Falls:
    """When the platform leaves the equilibrium it was sent to, and how near it came to that.

    Attributes
    ----------
    time_s : (n,) array
        Of the fall; infinite where there is none.
    wire : (n,) int array
        The wire that had lost the largest share of its tension before the fall; -1 without a fall.
    drop_m : (n,) array
        Distance to the pose that catches the platform; infinite where none does, 0 without a fall.
    slack_s : (n, w) array
        When each wire first went slack; infinite where it did not, 0 where it was slack from the start.
    tension_share : (n, w) array
        Lowest tension of each wire up to the end (or the fall), by its first; NaN where that was zero.
    stiffness_share : (n,) array
        Stiffness against the softest motion at the end (or at the fall), by that at the start.
    """

    time_s: Floats
    wire: Ints
    drop_m: Floats
    slack_s: Floats
    tension_share: Floats
    stiffness_share: Floats

    @property
    def fell(self) -> Bools:
        """(n,) True where the platform falls."""
        return np.isfinite(self.time_s)
