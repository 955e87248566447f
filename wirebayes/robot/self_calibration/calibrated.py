"""What a calibration leaves known: the start of a history that goes on where the session ended."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wirebayes.json_files.calibrate import CalibratedUnknowns
from wirebayes.numeric.linear_algebra import solve
from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.draws import WireDraws
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
    """

    robot: Robot
    prior: LengthPrior
    session: Session
    mean: Floats
    covariance: Floats

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
        Biases of its sensors are averaged over. Errors of its geometry stand as those errors of the lengths that come
        to the same, for a history is followed on one robot, the calibrated one.
    session : Session
    """
    unknowns = found.unknowns
    state = found.state
    _, root = unknowns.moments
    own = replace(unknowns.prior, bias_sd_N=0.0)
    d = len(own.moments(unknowns.robot.legs)[0])
    covariance = root @ _with_geometry(found) @ root.T
    there = replace(session, position_m=state.position_m, rotation=state.rotation)
    return Calibrated(unknowns.robot, own, there, unknowns.parts(state.white).wires[:d], covariance[:d, :d])


def _with_geometry(found: RobotPosterior) -> Floats:
    """Covariance ``(d, d)`` of references and wires in units of their prior, errors of points and drums included.

    A point that is off makes its wire's way longer or shorter, as an error of the reference does, but from pose to pose
    by another amount. The readings often tell the sum of both well, and neither alone. So the sum counts, averaged over
    the poses of the session.
    """
    unknowns = found.unknowns
    wires = unknowns.slices["wires"]
    if wires.start == 0:  # points and drums are exact
        return found.covariance[wires, wires]
    loop = found.equations.by_robot[:, found.equations.rows["loop"]]
    first = unknowns.references.start - wires.start
    references = slice(first, first + unknowns.robot.legs)
    by_reference = loop[..., unknowns.references]
    one = np.zeros((len(loop), unknowns.of_wires, unknowns.count))
    one[:, :, wires] = np.eye(unknowns.of_wires)
    for name in ("exit", "platform", "drum"):
        part = unknowns.slices[name]
        one[:, references, part] = solve(by_reference, loop[..., part])
    return np.asarray((one @ found.covariance @ one.mT).mean(0))


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
    d = len(prior.moments(robot.legs)[0])
    if list(values["line"]) != prior.names or mean.shape != (d,) or covariance.shape != (d, d):
        raise ValueError("other unknowns")
    return Calibrated(robot, prior, _session(values["session"], robot), mean, covariance)


def _session(values: Any, robot: Robot) -> Session:
    joint, duration, place, turn = (
        np.array(values[name], float) for name in ("joint_m", "duration_s", "position_m", "rotation_vector_rad")
    )
    holds = len(duration)
    if joint.shape != (holds, robot.legs) or place.shape != (holds, 3):
        raise ValueError("another robot's session")
    unread = np.zeros(holds, bool)  # the readings are in the posterior
    return Session(place, matrix(turn), joint, duration, unread, np.nan)
