"""The posterior of a whole robot about its mode."""

from dataclasses import dataclass, replace

import numpy as np

from wirebayes.numeric.linear_algebra import inv
from wirebayes.numeric.typing import Floats
from wirebayes.robot.self_calibration.descent import Descent, cost_of, eliminated
from wirebayes.robot.self_calibration.equations import Equations, Noise, State
from wirebayes.robot.self_calibration.strain import Grown
from wirebayes.robot.self_calibration.unknowns import Unknowns


@dataclass(frozen=True)
class RobotPosterior:
    """Posterior of a robot and its session.

    Attributes
    ----------
    unknowns : Unknowns
    state : State
        The mode.
    covariance : (m, m) array
        Of the robot's unknowns, in units of their prior.
    by_robot : (p, d + w, m) array
        How a hold's motion and tensions follow the robot's unknowns.
    hold_covariance : (p, d + w, d + w) array
        Of a hold's small motion (metres at the platform's edge) and its tensions.
    equations : Equations
        At the mode.
    noise : Noise
    degrees : float
        Degrees of freedom that the error of the loops was estimated from; infinite where it was given.
    creep : Grown
    converged : bool
    cost : float
        Sum of squares, the prior's included.
    last_m : (w,) array
        Lengths that the last joint values stand for, without reference errors.
    """

    unknowns: Unknowns
    state: State
    covariance: Floats
    by_robot: Floats
    hold_covariance: Floats
    equations: Equations
    noise: Noise
    degrees: float
    creep: Grown
    converged: bool
    cost: float
    last_m: Floats

    @property
    def evidence(self) -> float:
        """What modes from different starts are compared by: log density, their estimated noise included."""
        e = self.equations
        noise = e.residual[:, e.rows["loop"]].size * np.log(self.noise.joint_m)
        noise += e.residual[:, e.rows["balance"]].size * np.log(self.noise.balance)
        return float(-0.5 * self.cost - noise)


def gaussian_posterior(unknowns: Unknowns, down: Descent, noise: Noise, creep: Grown, last_m: Floats) -> RobotPosterior:
    """The Gaussian about where a descent ended.

    Parameters
    ----------
    unknowns : Unknowns
    down : Descent
    noise : Noise
    creep : Grown
        What it descended with.
    last_m : (w,) array
        Lengths that the last joint values stand for, without reference errors.
    """
    normal = eliminated(down.equations, down.state.white, 0.0)
    covariance = inv(normal.matrix)
    by_robot = normal.by_robot
    hold = normal.inverse + by_robot @ covariance @ by_robot.mT
    finite = bool(np.isfinite(covariance).all() and np.isfinite(hold).all() and (np.diag(covariance) > 0).all())
    if not finite:  # a search that ended nowhere leaves what was known before
        covariance = np.eye(len(covariance))
        by_robot = np.zeros_like(by_robot)
        hold = np.zeros_like(hold)
    good = down.converged and finite and bool(np.isfinite(down.cost))
    return RobotPosterior(
        unknowns=unknowns,
        state=down.state,
        covariance=covariance,
        by_robot=by_robot,
        hold_covariance=hold,
        equations=down.equations,
        noise=noise,
        degrees=np.inf,
        creep=creep,
        converged=good,
        cost=down.cost,
        last_m=last_m,
    )


def at_joint_error(found: RobotPosterior, factor: float) -> RobotPosterior:
    """The posterior about the same mode with the error of the loops larger by a factor.

    Parameters
    ----------
    found : RobotPosterior
    factor : float
    """
    e = found.equations
    white = found.state.white
    unit = np.ones(e.residual.shape[1])
    unit[e.rows["loop"]] /= factor
    by_robot = e.by_robot * unit[:, None]
    by_hold = e.by_hold * unit[:, None]
    there = replace(e, residual=e.residual * unit, by_robot=by_robot, by_hold=by_hold)
    down = Descent(found.state, there, cost_of(there, white), found.converged)
    noise = replace(found.noise, joint_m=found.noise.joint_m * factor)
    wider = gaussian_posterior(found.unknowns, down, noise, found.creep, found.last_m)
    return replace(wider, degrees=found.degrees)
