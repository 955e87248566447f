"""What every hold of a session says of a robot and of its own pose and tensions, linearised.

Of every hold: each wire's loop closes (stretched length = way from winch to platform), the platform is in balance,
tensions, pose and tilt are what was read. Latent tensions keep these equations smooth: a slack wire has a negative one,
pulls at nothing, and its gap follows Hooke's law.
"""

from dataclasses import dataclass, replace

import numpy as np

from wirebayes.numeric.typing import Bools, Floats
from wirebayes.robot.mechanics.description import GRAVITY, Robot
from wirebayes.robot.self_calibration.session import Session
from wirebayes.robot.self_calibration.unknowns import Parts

EXACT = 1e-8  # of the robot's span: what is exact is known this well, far below anything that matters
LEAST_DAMPING = 1e-13  # of a diagonal: what keeps the normal equations of a hold regular
FRICTIONLESS = 1e-5  # of the weight: balance holds this well


@dataclass(frozen=True)
class Holds:
    """What the session states and reads, p holds.

    Attributes
    ----------
    session : Session
        Poses that nobody knows are NaN.
    tension_N : (p, w) array
        NaN where it was not read.
    tilt : (p, 2) array or None
        Components of the platform's normal, NaN where they were not read.
    """

    session: Session
    tension_N: Floats
    tilt: Floats | None = None

    @property
    def placed(self) -> Bools:
        """(p,) Whether the hold's position is stated."""
        return np.asarray(np.isfinite(self.session.position_m).all(1))

    @property
    def oriented(self) -> Bools:
        """(p,) Whether the hold's orientation is stated."""
        return np.asarray(np.isfinite(self.session.rotation).all((1, 2)))


@dataclass(frozen=True)
class Noise:
    """Standard deviations that the readings may have to tell.

    Attributes
    ----------
    joint_m : float
        Of a loop.
    balance : float
        Of the balance, over the weight.
    pull_N : float
        Of a tension that was not read, about its level.
    usual_N : float
    soft_N : float
        Over which range of latent tensions a wire begins to pull: small beside all that is known of tensions, so that
        a wire thought slack can still be found taut, and the other way round.
    """

    joint_m: float
    balance: float
    pull_N: float
    usual_N: float
    soft_N: float


@dataclass(frozen=True)
class State:
    """A robot's unknowns, and what is unknown of each of its p holds at its end.

    Attributes
    ----------
    white : (m,) array
        The robot's unknowns in units of their prior.
    position_m, rotation : (p, 3), (p, 3, 3) arrays
    pull_N : (p, w) array
        Latent tensions; negative where a wire is slack.
    """

    white: Floats
    position_m: Floats
    rotation: Floats
    pull_N: Floats


@dataclass(frozen=True)
class Equations:
    """Residuals in standard deviations, k a hold, and their slopes.

    Attributes
    ----------
    residual : (p, k) array
    by_robot : (p, k, m) array
    by_hold : (p, k, d + w) array
        By a small motion (m, and rad times the robot's size) and the latent tensions, N.
    rows : dict of str to slice
        Which of the k are ``loop``, ``balance``, ``tension``, ``pose`` and ``tilt``.
    known : (p, k) bool array
        False where nothing was stated or read; of tensions, residuals there are those from what is usual.
    by_earlier : (p, p, w, w) array, optional
        Slopes of each hold's loops by the tensions of each hold before it, through creep; None where nothing creeps.
    """

    residual: Floats
    by_robot: Floats
    by_hold: Floats
    rows: dict[str, slice]
    known: Bools
    by_earlier: Floats | None = None


def own_normal(by_hold: Floats, damping: float) -> Floats:
    """Normal matrices ``(p, d + w, d + w)`` of the holds' own unknowns, their diagonals larger by a share."""
    normal = by_hold.mT @ by_hold
    diagonal = np.einsum("pii->pi", normal)
    return normal + damping * diagonal[:, None] * np.eye(normal.shape[1])


def pulled(latent_N: Floats, soft_N: float) -> tuple[Floats, Floats]:
    """What wires of latent tensions pull, N, and its slope: nothing when slack."""
    around = np.hypot(latent_N, soft_N)
    return 0.5 * (latent_N + around), 0.5 * (1 + latent_N / around)


def moved(robot: Robot, parts: Parts) -> Robot:
    """The robot with its exit and platform points where the unknowns say."""
    changed = replace(robot, exit_m=parts.exit_m, platform_m=parts.platform_m)
    # measures of length stay those of the file, so that units do not move with the unknowns
    changed.__dict__.update(span_m=robot.span_m, size_m=robot.size_m)
    return changed


def by_carried(equations: Equations, robot: Robot, noise: Noise, wrench: Floats) -> Floats:
    """How residuals ``(p, k, c)`` follow shares of further wrenches that the wires carry.

    Parameters
    ----------
    equations : Equations
    robot : Robot
    noise : Noise
    wrench : (c, d, p) array
        N and N m, about the reference point.
    """
    holds, rows = equations.residual.shape
    out = np.zeros((holds, rows, len(wrench)))
    force = noise.balance * robot.mass_kg * GRAVITY
    out[:, equations.rows["balance"]] = -wrench.T * robot.edge_scale[:, None] / force
    return out
