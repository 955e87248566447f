"""The search for a whole robot: stated poses as they are or as requests, joint values as exact or not, sensors."""

from dataclasses import dataclass, replace
from enum import Enum
from typing import NamedTuple

import numpy as np
from scipy.special import chdtr, fdtrc

from wirebayes.numeric.typing import Bools
from wirebayes.progress import Progress
from wirebayes.result_warnings import Notice
from wirebayes.robot.self_calibration.equations import Holds
from wirebayes.robot.self_calibration.estimate import estimate, progress_of
from wirebayes.robot.self_calibration.faults import Explanation, explanations, sensors_explain
from wirebayes.robot.self_calibration.posterior import RobotPosterior
from wirebayes.robot.self_calibration.residuals import lost, misfit, trust, usual_joint
from wirebayes.robot.self_calibration.seeds import best, near_requests
from wirebayes.robot.self_calibration.sensors import Suspects, suspects
from wirebayes.robot.self_calibration.trust import SIGNIFICANT
from wirebayes.robot.self_calibration.two_causes import two_causes
from wirebayes.robot.self_calibration.unknowns import Unknowns
from wirebayes.robot.self_calibration.unlike_wires import unlike_wires

RATHER = 3.0  # times smaller errors of loops or balance, before stated poses are taken for requests
_WELL, _CHANCE = 0.1, 1e-4  # of the standard deviation before; of estimates that near to their prior's mean
_GROSS = 1e4  # mean squared residual: of readings that are a hundred standard errors off no joint value is the reason
_NO_DEGREES = 1e-9  # of freedom: what loops that always close are left with
_UNSEEN = 1e-3  # of the weight: as long as the balance fails by less, no sensor is looked at


class StatedPoses(Enum):
    """What the poses of a session are."""

    MEASURED = "where the robot was"
    REQUESTED = "where it was sent"
    EITHER = "measured, unless they contradict the readings or only repeat them"


@dataclass(frozen=True)
class Searched:
    """What was found of a whole robot, and under which assumptions.

    Attributes
    ----------
    found : RobotPosterior
    holds : Holds
        Without the stated poses where they were taken for requests.
    p : float
        Probability of readings and references that contradict model and priors as much.
    at_fault : Suspects or None
        Which sensor would explain what contradicts; None where nothing does, or nothing that a sensor could.
    explain : tuple of Explanation
        Of platform and frame, with each of which nothing would contradict; else of two causes together.
    unlike : tuple of Notice
        How unlike what is stated wires would be with which nothing would contradict.
    inexact : bool
        Joint values that were taken as exact are not.
    requested : bool
        Stated poses turned out to be requests.
    too_near : bool
        Estimates lie nearer to the robot's file than its stated errors allow, and without the stated poses there is
        no answer.
    closer : float
        Without the stated poses, which were kept, errors of joint values would be so many times smaller.
    """

    found: RobotPosterior
    holds: Holds
    p: float
    at_fault: Suspects | None
    inexact: bool
    requested: bool
    too_near: bool = False
    closer: float = 1.0
    explain: tuple[Explanation, ...] = ()
    unlike: tuple[Notice, ...] = ()


def searched(
    unknowns: Unknowns,
    holds: Holds,
    rng: np.random.Generator,
    poses: StatedPoses,
    progress: Progress,
) -> Searched:
    """Find a whole robot from a session.

    Parameters
    ----------
    unknowns : Unknowns
    holds : Holds
    rng : numpy Generator
        Draws the starts.
    poses : StatedPoses
    progress : function of name, done and total
    """
    about = None
    if poses is StatedPoses.REQUESTED:
        about = near_requests(unknowns, holds)
        holds = _without_poses(holds)
    found = best(unknowns, holds, rng, progress, about=about)
    too_good = bool(holds.placed.any()) and _too_good(found)
    doubted = poses is StatedPoses.EITHER
    found, holds, requested, closer = _rather_requests(found, holds, too_good, doubted, progress)
    p = trust(found)
    at_fault = _sensor_at_fault(found, holds, p, progress)
    tells = _contradicts(found, p) and _carries(holds)
    explain: tuple[Explanation, ...] = explanations(found, holds, progress) if tells else ()
    unlike = unlike_wires(found) if found.converged and p < SIGNIFICANT else ()
    if tells and not (explain or unlike or sensors_explain(at_fault)):
        both = two_causes(found, holds, progress_of(progress, "two causes"))
        explain = () if both is None else (both,)
    inexact = unknowns.errors.joint_m == 0 and not (found.converged and p >= SIGNIFICANT)
    if inexact and misfit(found) < _GROSS:
        # how far from exact the joint values are tells more than that there is no answer
        rough = replace(unknowns, errors=replace(unknowns.errors, joint_m=None))
        other = best(rough, holds, rng, progress, "rough start", about)
        if other.converged or not found.converged:
            found = other
    too_near = too_good and not requested
    return Searched(found, holds, p, at_fault, inexact, requested, too_near, closer, explain, unlike)


def _sensor_at_fault(found: RobotPosterior, holds: Holds, p: float, progress: Progress) -> Suspects | None:
    """Which sensor would explain what contradicts; None where nothing does, or loops are too far open to tell."""
    return suspects(found, holds, progress_of(progress, "sensors")) if _contradicts(found, p) else None


def _carries(holds: Holds) -> bool:
    """Whether tensions were read that tell what the wires carry: of every wire, at a hold or more."""
    return bool(np.isfinite(holds.tension_N).all(1).any())


def _contradicts(found: RobotPosterior, p: float) -> bool:
    """Whether something contradicts, and loops are not too far open to tell what."""
    return (p < SIGNIFICANT or found.noise.balance > _UNSEEN) and not lost(found)


class _Chosen(NamedTuple):
    """What was found with the stated poses or without them, as `Searched` has it."""

    found: RobotPosterior
    holds: Holds
    requested: bool = False
    closer: float = 1.0


def _rather_requests(found: RobotPosterior, holds: Holds, too_good: bool, doubted: bool, progress: Progress) -> _Chosen:
    """What is found without the poses, where they are commands or contradict the joint values: they were requests.

    An answer is not given up for a search that found none.
    """
    kept = _Chosen(found, holds)
    if not holds.placed.any():
        return kept
    if not too_good and not (doubted and found.unknowns.errors.pose_m == 0):
        return kept
    blind = _without_poses(holds)
    state = replace(found.state, white=np.zeros_like(found.state.white))
    other = estimate(found.unknowns, blind, state, progress_of(progress, "poses as requests"))
    if found.converged and not other.converged:
        return kept
    better = _steadier(found, other) or _closer(found, other, holds)
    if too_good or (other.converged and better and trust(other) >= SIGNIFICANT):
        return _Chosen(other, blind, requested=True)
    return kept._replace(closer=found.noise.joint_m / other.noise.joint_m)


def _without_poses(holds: Holds) -> Holds:
    return replace(holds, session=holds.session.without_poses())


def _steadier(found: RobotPosterior, other: RobotPosterior) -> bool:
    """Whether tensions balance without the stated poses, and not with them."""
    return found.noise.balance > max(_UNSEEN, RATHER * other.noise.balance)


def _closer(found: RobotPosterior, other: RobotPosterior, holds: Holds) -> bool:
    """Whether loops close so much better without the stated poses that chance is no reason.

    Poses that are unknown close every loop of a robot that has no wires to spare: such loops say nothing.
    """
    times = found.noise.joint_m / other.noise.joint_m
    if not times > RATHER:
        return False
    _, worth = usual_joint(found.unknowns.robot, holds)
    with_poses, without = (max(one.degrees - worth, _NO_DEGREES) for one in (found, other))
    return bool(fdtrc(with_poses, without, times**2) < SIGNIFICANT)


def _too_good(found: RobotPosterior) -> bool:
    """Whether estimates that the readings determine well lie nearer to the robot's file than its stated errors allow.

    Then the joint values were computed from the poses and the file: they are commands, and say nothing of where the
    robot went.
    """
    part = np.flatnonzero(_may_err(found.unknowns))
    values, vectors = np.linalg.eigh(found.covariance[np.ix_(part, part)])
    determined = np.sqrt(np.maximum(values, 0.0)) < _WELL
    deviations = vectors[:, determined].T @ found.state.white[part]
    if not determined.any():
        return False
    so_near = chdtr(int(determined.sum()), float(deviations @ deviations))
    return bool(so_near < _CHANCE)


def _may_err(unknowns: Unknowns) -> Bools:
    """(m,) Which unknowns are points, drums and references that a file may state wrongly.

    Points of a flat robot lie in its plane by design, whatever error is stated: that they are found there is no sign.
    """
    out = np.zeros(unknowns.count, bool)
    out[unknowns.geometry] = True
    robot = unknowns.robot
    flat = (np.ptp(robot.exit_m, axis=0) == 0) & (robot.lower_m == robot.upper_m)
    for name in ("exit", "platform"):
        part = unknowns.slices[name]
        out[part] &= np.resize(~flat, part.stop - part.start)
    return out
