"""What a calibration leaves known: the start of a history that goes on where the session ended."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wirebayes.json_files.calibrate import CalibratedUnknowns
from wirebayes.numeric.linear_algebra import solve
from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.draws import WireDraws, lines_of, nominal_length
from wirebayes.robot.mechanics.rotation import matrix, vector
from wirebayes.robot.motion.creep import CreepState
from wirebayes.robot.self_calibration import predicted
from wirebayes.robot.self_calibration.posterior import RobotPosterior
from wirebayes.robot.self_calibration.session import LengthPrior, Session


@dataclass(frozen=True)
class Calibrated:
    """The posterior of a calibrated robot's unknowns, and what its wires went through.

    Attributes
    ----------
    robot : Robot
    prior : LengthPrior
        Says what the unknowns are.
    session : Session
    mean : (d,) array
        Reference errors, parameters and specimens' deviations in the order of `LengthPrior.moments`, without biases.
    covariance : (d, d) array
    by_pose_m : (w,) array
        Standard deviation of how the lengths' errors, those of the points among them, differ from pose to pose.
    """

    robot: Robot
    prior: LengthPrior
    session: Session
    mean: Floats
    covariance: Floats
    by_pose_m: Floats

    @property
    def pulls_N(self) -> Floats:
        """(w,) what lengths that are off by `by_pose_m` make of the wires' tensions at most."""
        stiffness_N = [line.parameters["k1"].mean() for line in lines_of(self.robot, self.prior.line)]
        return np.array(stiffness_N) * self.by_pose_m / nominal_length(self.robot)

    @property
    def reference_sd_m(self) -> Floats:
        """(w,) what is still not known of the reference lengths."""
        return np.sqrt(np.diag(self.covariance)[: self.robot.legs])

    def carried(self, unknowns: Floats) -> CreepState:
        """Creep that wires of unknowns ``(n, d)`` carry out of the session; it depends on them as the readings do."""
        return predicted.carried(self.robot, self.prior, self.session, unknowns)


def calibrated(found: RobotPosterior, session: Session) -> Calibrated:
    """What a calibration leaves known of references, wires and specimens, for a history on the calibrated robot.

    Parameters
    ----------
    found : RobotPosterior
        With drums that are exact. Biases of its sensors are averaged over. Errors of its geometry stand as those errors
        of the lengths that come to the same, for a history is followed on one robot, the calibrated one.
    session : Session
    """
    unknowns = found.unknowns
    state = found.state
    _, root = unknowns.moments
    own = replace(unknowns.prior, bias_sd_N=0.0)
    d = len(own.moments(unknowns.robot.legs)[0])
    as_lengths = _as_lengths(found)
    covariance = root @ _mean_covariance(as_lengths, found) @ root.T
    there = replace(session, position_m=state.position_m, rotation=state.rotation)
    mean = unknowns.parts(state.white).wires[:d]
    from_mean = as_lengths - as_lengths.mean(0)
    scatter = np.diag(_mean_covariance(from_mean, found))
    by_pose_m = own.reference_sd_m * np.sqrt(np.maximum(scatter[: unknowns.robot.legs], 0.0))
    return Calibrated(unknowns.robot, own, there, mean, covariance[:d, :d], by_pose_m)


def _as_lengths(found: RobotPosterior) -> Floats:
    """References and wires by all unknowns at each pose, ``(p, d, m)``: errors of points as those of lengths.

    A point that is off makes its wire's way longer or shorter, as an error of the reference does, but from pose to pose
    by another amount. The readings often tell the sum of both well, and neither alone.
    """
    unknowns = found.unknowns
    wires = unknowns.slices["wires"]
    if wires.start == 0:  # points are exact
        return np.eye(unknowns.of_wires, unknowns.count)[None]
    loop = found.equations.by_robot[:, found.equations.rows["loop"]]
    by_reference = loop[..., unknowns.references]
    out = np.zeros((len(loop), unknowns.of_wires, unknowns.count))
    out[:, :, wires] = np.eye(unknowns.of_wires)
    for name in ("exit", "platform"):
        part = unknowns.slices[name]
        if part.stop > part.start:
            out[:, : unknowns.robot.legs, part] = solve(by_reference, loop[..., part])
    return out


def _mean_covariance(by_unknowns: Floats, found: RobotPosterior) -> Floats:
    """Covariance ``(d, d)``, averaged over poses, of what follows all unknowns linearly by ``(p, d, m)``."""
    return np.asarray((by_unknowns @ found.covariance @ by_unknowns.mT).mean(0))


def to_dict(found: Calibrated) -> CalibratedUnknowns:
    """Everything but the robot and the line, which a command is given anyway."""
    session = found.session
    return {
        "version": 1,
        "reference_sd_mm": 1e3 * found.prior.reference_sd_m,
        "specimen_spread": found.prior.spread,
        "line": found.prior.names,
        "mean": found.mean,
        "covariance": found.covariance,
        "by_pose_mm": 1e3 * found.by_pose_m,
        "session": {
            "position_m": session.position_m,
            "rotation_vector_rad": vector(session.rotation),
            "joint_m": session.joint_m,
            "duration_s": session.duration_s,
        },
    }


def from_dict(values: Any, robot: Robot, line: WireDraws) -> Calibrated:
    """The inverse of `to_dict`.

    Parameters
    ----------
    values : mapping
    robot : Robot
    line : WireDraws
        Of the posterior that was calibrated with.

    Raises
    ------
    ValueError
        The values are not those of such a robot and line.
    """
    prior = LengthPrior(line, 1e-3 * float(values["reference_sd_mm"]), float(values["specimen_spread"]))
    mean = np.array(values["mean"], float)
    covariance = np.array(values["covariance"], float)
    by_pose_m = 1e-3 * np.array(values["by_pose_mm"], float)
    d = len(prior.moments(robot.legs)[0])
    if list(values["line"]) != prior.names or mean.shape != (d,) or covariance.shape != (d, d):
        raise ValueError("other unknowns")
    return Calibrated(robot, prior, _session(values["session"], robot), mean, covariance, by_pose_m)


def _session(values: Any, robot: Robot) -> Session:
    joint, duration, place, turn = (
        np.array(values[name], float) for name in ("joint_m", "duration_s", "position_m", "rotation_vector_rad")
    )
    holds = len(duration)
    if joint.shape != (holds, robot.legs) or place.shape != (holds, 3):
        raise ValueError("another robot's session")
    unread = np.zeros(holds, bool)  # the readings are in the posterior
    return Session(place, matrix(turn), joint, duration, unread, np.nan)
