"""What a calibration leaves known: the start of a history that goes on where the session ended."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wirebayes.json_files.calibrate import CalibratedUnknowns
from wirebayes.numeric.batches import batch_first, batch_last
from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import Poses, Robot
from wirebayes.robot.mechanics.draws import WireDraws, lines_of
from wirebayes.robot.mechanics.rotation import matrix, vector
from wirebayes.robot.motion.creep import CreepState
from wirebayes.robot.self_calibration import predicted
from wirebayes.robot.self_calibration.by_points import swing
from wirebayes.robot.self_calibration.equations import moved
from wirebayes.robot.self_calibration.posterior import RobotPosterior
from wirebayes.robot.self_calibration.session import LengthPrior, Session


@dataclass(frozen=True)
class Calibrated:
    """The posterior of a calibrated robot's unknowns, and what its wires went through.

    Attributes
    ----------
    robot : Robot
        With its points where they were found.
    prior : LengthPrior
        Says what the first unknowns are.
    session : Session
    mean : (d,) array
        Reference errors, parameters and specimens' deviations in the order of `LengthPrior.moments`, without biases;
        then, of the points that were estimated, how far they are from where they were found, m.
    covariance : (d, d) array
    pull_N : (p, w) array
        Tensions at the ends of the session's holds.
    points : tuple of str
        Which points were estimated: ``exit`` (in the world's axes), ``platform`` (in the platform's).
    """

    robot: Robot
    prior: LengthPrior
    session: Session
    mean: Floats
    covariance: Floats
    pull_N: Floats
    points: tuple[str, ...] = ()

    @property
    def reference_sd_m(self) -> Floats:
        """(w,) what is still not known of the reference lengths."""
        return np.sqrt(np.diag(self.covariance)[: self.robot.legs])

    def carried(self, unknowns: Floats) -> CreepState:
        """Creep that wires of unknowns ``(n, d)`` carry out of the session; it depends on them as the readings do."""
        error_m = self.error_m(unknowns, (self.session.position_m, self.session.rotation), self.pull_N)
        return predicted.carried(self.robot, self.prior, self.session, unknowns, error_m)

    def error_m(self, unknowns: Floats, poses: Poses, tension_N: Floats) -> Floats:
        """What lengths before creep are beyond what joint values say, ``(p, n, w)``, as `errors_at` has them.

        Parameters
        ----------
        unknowns : (n, d) array
        poses : (p, 3), (p, 3, 3) arrays
        tension_N : (p, w) array
            There, about.
        """
        return self.errors_at(unknowns, poses, tension_N)[0]

    def errors_at(self, unknowns: Floats, poses: Poses, tension_N: Floats) -> tuple[Floats, Floats]:
        """What lengths before creep are beyond what joint values say, m, and tensions beyond those there, N.

        A point that is off makes its wire's way longer or shorter, as an error of the reference does, but at every
        pose by another amount; and it turns the wire, which holds the platform there only with other tensions. Both
        are taken to first order as the errors of lengths that lead to the same pose. Wires of such lengths that run
        to the points as found pull otherwise than those that run to where the points are: by these tensions.

        Parameters
        ----------
        unknowns : (n, d) array
        poses : (p, 3), (p, 3, 3) arrays
        tension_N : (p, w) array
            There, about.

        Returns
        -------
        length_m, tension_N : (p, n, w) arrays
        """
        legs = self.robot.legs
        by_points = self._by_points(poses, tension_N)
        shape = len(poses[0]), len(unknowns), legs
        length = np.broadcast_to(unknowns[:, :legs], shape)
        pull = np.zeros(shape)
        first = unknowns.shape[1] - 3 * legs * len(self.points)
        for name in self.points:
            end = first + 3 * legs
            own = unknowns[:, first:end]
            by_length, by_pull = by_points[name]
            length = length + np.einsum("pwm,nm->pnw", by_length, own)
            pull = pull + np.einsum("pwm,nm->pnw", by_pull, own)
            first = end
        return length, pull

    def _by_points(self, poses: Poses, tension_N: Floats) -> dict[str, tuple[Floats, Floats]]:
        """Errors of lengths and of tensions by the coordinates of points, ``(p, w, 3 w)`` each."""
        robot = self.robot
        position, rotation = poses
        shape = statics.geometry(robot, position.T, batch_last(rotation))
        along = batch_first(shape.direction).mT * robot.lines[:, None]
        tension = np.maximum(tension_N, 0.0)
        softness, longer = self._softness(shape, tension)
        tension_by_force = np.linalg.pinv(batch_first(statics.wire_jacobian(robot, shape)) * (tension > 0)[:, None])
        turns = dict(zip(("exit", "platform"), swing(robot, shape, rotation, tension), strict=True))
        ways = {"exit": -along, "platform": np.einsum("pwi,pij->pwj", along, rotation)}
        out = {}
        for name, way in ways.items():
            own = np.einsum("pwi,wv->pwvi", way / longer[..., None], np.eye(robot.legs))
            turned = np.einsum("pwd,pdvi->pwvi", tension_by_force, turns[name])
            length = -(own + softness[..., None, None] * turned)
            flat = *own.shape[:2], -1
            out[name] = length.reshape(flat), -turned.reshape(flat)
        return out

    def _softness(self, shape: statics.Geometry, tension_N: Floats) -> tuple[Floats, Floats]:
        """How lengths (p, w) of wires that bear follow tensions, m/N, and how often as long all are as without them."""
        robot = self.robot
        k1 = np.array([line.parameters["k1"].mean() for line in lines_of(robot, self.prior.line)])
        longer = 1.0 + tension_N / k1
        whole = np.where(robot.is_linear, robot.wire_m, robot.lines * shape.distance_m.T + robot.beyond_m)
        return np.where(tension_N > 0, whole / (k1 * longer), 0.0), longer


def calibrated(found: RobotPosterior, session: Session) -> Calibrated:
    """What a calibration leaves known of references, wires, specimens and points, for a history that goes on.

    Parameters
    ----------
    found : RobotPosterior
        With drums that are exact. Biases of its sensors are averaged over.
    session : Session
    """
    unknowns = found.unknowns
    state = found.state
    _, root = unknowns.moments
    own = replace(unknowns.prior, bias_sd_N=0.0)
    d = len(own.moments(unknowns.robot.legs)[0])
    first = unknowns.slices["wires"].start
    parts = unknowns.parts(state.white)
    points = tuple(name for name in ("exit", "platform") if unknowns.slices[name].stop > unknowns.slices[name].start)
    rows = [np.hstack([np.zeros((d, first)), root[:d], np.zeros((d, unknowns.count - first - len(root)))])]
    for name in points:
        sd = unknowns.errors.exit_m if name == "exit" else unknowns.errors.platform_m
        rows.append(sd * np.eye(unknowns.count)[unknowns.slices[name]])
    by_white = np.concatenate(rows)
    mean = np.concatenate([parts.wires[:d], np.zeros(len(by_white) - d)])
    there = replace(session, position_m=state.position_m, rotation=state.rotation)
    robot = moved(unknowns.robot, parts) if points else unknowns.robot
    return Calibrated(robot, own, there, mean, by_white @ found.covariance @ by_white.T, state.pull_N, points)


def to_dict(found: Calibrated) -> CalibratedUnknowns:
    """Everything but the robot and the line, which a command is given anyway."""
    session = found.session
    return {
        "version": 2,
        "reference_sd_mm": 1e3 * found.prior.reference_sd_m,
        "specimen_spread": found.prior.spread,
        "line": found.prior.names,
        "mean": found.mean,
        "covariance": found.covariance,
        "points": list(found.points),
        "pull_N": found.pull_N,
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
    points = tuple(str(name) for name in values["points"])
    pull_N = np.array(values["pull_N"], float)
    d = len(prior.moments(robot.legs)[0]) + 3 * robot.legs * len(points)
    if list(values["line"]) != prior.names or mean.shape != (d,) or covariance.shape != (d, d):
        raise ValueError("other unknowns")
    return Calibrated(robot, prior, _session(values["session"], robot), mean, covariance, pull_N, points)


def _session(values: Any, robot: Robot) -> Session:
    joint, duration, place, turn = (
        np.array(values[name], float) for name in ("joint_m", "duration_s", "position_m", "rotation_vector_rad")
    )
    holds = len(duration)
    if joint.shape != (holds, robot.legs) or place.shape != (holds, 3):
        raise ValueError("another robot's session")
    unread = np.zeros(holds, bool)  # the readings are in the posterior
    return Session(place, matrix(turn), joint, duration, unread, np.nan)
