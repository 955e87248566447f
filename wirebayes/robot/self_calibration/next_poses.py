"""Which poses to visit next: those whose readings sharpen the pose most, over the workspace.

Each candidate is a hold with the session's kinds of readings. Its information about the robot, its own pose and
tensions eliminated, is added to what is known; the next pose is the one that leaves the smallest pose error over the
workspace.
"""

from dataclasses import dataclass, replace

import numpy as np

from wirebayes.numeric.linear_algebra import inv, solve
from wirebayes.numeric.typing import Floats, Indices
from wirebayes.robot.mechanics import rotation as turns
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.motion import hanging, inverse
from wirebayes.robot.self_calibration.equations import Equations, Holds, State, moved
from wirebayes.robot.self_calibration.linearisation import linearised
from wirebayes.robot.self_calibration.posterior import RobotPosterior
from wirebayes.robot.self_calibration.session import Session
from wirebayes.robot.self_calibration.strain import no_creep

_CANDIDATES = 150  # in the workspace: closer together they say the same


@dataclass(frozen=True)
class NextPoses:
    """Poses worth a visit, the most useful first.

    Attributes
    ----------
    position_m : (n, 3) array
    pose_sd_m : (n + 1,) array
        Root mean square over the workspace of the pose's standard deviation: now, and after each of the visits.
    """

    position_m: Floats
    pose_sd_m: Floats


def next_poses(found: RobotPosterior, holds: Holds, count: int, rng: np.random.Generator) -> NextPoses:
    """Choose poses one after another, each with those before it taken as visited.

    Parameters
    ----------
    found : RobotPosterior
        What is known now.
    holds : Holds
        The session: what is read at a pose is what was read in most of its holds.
    count : int
    rng : numpy Generator
        Draws the candidates in the workspace.
    """
    unknowns = found.unknowns
    robot = moved(unknowns.robot, unknowns.parts(found.state.white))
    poses = _candidates(robot, rng)
    if count == 0 or not len(poses.x):
        return NextPoses(np.empty((0, 3)), np.empty(0))
    as_read = _as_read(holds, poses)
    told = _commanded(found, robot, as_read, poses)
    unread = _at(found, _blind(told), poses)
    position = _follows(unread, robot.degrees)[:, :3]  # what counts
    root = np.moveaxis(position, 0, 1).reshape(-1, unknowns.count)
    information = _information(_at(found, told, poses))
    most = min(count, len(poses.x))
    picked, sd = _one_after_another(found.covariance, information, root, most)
    return NextPoses(poses.x[picked], sd)


def _commanded(found: RobotPosterior, robot: Robot, told: Holds, poses: "_Candidates") -> Holds:
    """Holds with the joint values that lead to candidates."""
    unknowns = found.unknowns
    parts = unknowns.parts(found.state.white)
    wires, _ = unknowns.prior.wires(unknowns.robot, parts.wires[None])
    commands = inverse.commands(robot, wires, poses.x, poses.R, poses.tau)
    return replace(told, session=replace(told.session, joint_m=commands.joint_m))


@dataclass(frozen=True)
class _Candidates:
    """Poses ``(n, 3)`` and ``(n, 3, 3)`` in the workspace with tensions ``(n, w)`` that hold them."""

    x: Floats
    R: Floats
    tau: Floats


def _candidates(robot: Robot, rng: np.random.Generator) -> _Candidates:
    x = rng.uniform(robot.lower_m, robot.upper_m, (_CANDIDATES, 3))
    R = hanging.orientations(robot, x, turns.matrix(robot.home_rotation_rad))
    tau = inverse.tensions(robot, x, R)
    good = np.isfinite(tau).all(1)
    return _Candidates(x[good], R[good], tau[good])


def _blind(holds: Holds) -> Holds:
    """The same where nothing but the joint values is read."""
    unread = np.full_like(holds.tension_N, np.nan)
    return replace(holds, tension_N=unread, session=holds.session.without_poses(), tilt=None)


def _one_after_another(covariance: Floats, information: Floats, root: Floats, count: int) -> tuple[list[int], Floats]:
    """Candidates that leave the smallest pose error, each beside those before it, and that error before and after."""
    known = inv(covariance)
    poses = len(information)
    sd = [_rms(covariance, root, poses)]
    picked = []
    for _ in range(count):
        left = [_rms(inv(known + one), root, poses) for one in information]
        choice = int(np.nanargmin(left))
        known = known + information[choice]
        picked.append(choice)
        sd.append(left[choice])
    return picked, np.array(sd)


def _rms(covariance: Floats, root: Floats, poses: int) -> float:
    return float(np.sqrt(np.einsum("ri,ij,rj->", root, covariance, root) / poses))


def _as_read(holds: Holds, poses: _Candidates) -> Holds:
    """Candidates as holds, with what most of the session's holds have."""
    session = holds.session
    n = len(poses.x)
    read = bool(np.isfinite(holds.tension_N).all(1).mean() >= 0.5)
    there = Session(
        poses.x,
        poses.R,
        np.zeros_like(poses.tau),
        np.full(n, float(np.median(session.duration_s))),
        np.full(n, read),
        session.tension_sd_N,
        session.tilt_sd_rad,
    )
    if holds.placed.mean() < 0.5:
        there = there.without_poses()
    tension_N = poses.tau if read else np.full_like(poses.tau, np.nan)
    return Holds(there, tension_N, _tilt_as_read(holds, poses))


def _tilt_as_read(holds: Holds, poses: _Candidates) -> Floats | None:
    if holds.tilt is None:
        return None
    return np.where(np.isfinite(holds.tilt).any(), poses.R[:, :2, 2], np.nan)


def _at(found: RobotPosterior, holds: Holds, poses: _Candidates) -> Equations:
    state = State(found.state.white, poses.x, np.array(poses.R), poses.tau)
    fresh = no_creep(found.unknowns, len(poses.x))
    return linearised(found.unknowns, holds, found.noise, state, fresh, state)


def _information(e: Equations) -> Floats:
    """(n, m, m) what each hold says of the robot's unknowns."""
    by_hold = e.by_hold
    by_robot = e.by_robot
    mixed = by_hold.mT @ by_robot
    follows = solve(by_hold.mT @ by_hold, mixed)
    return by_robot.mT @ by_robot - mixed.mT @ follows


def _follows(e: Equations, degrees: int) -> Floats:
    """(n, d, m) how a commanded pose follows the robot's unknowns: loops closed, platform in balance."""
    determining: Indices = np.r_[e.rows["loop"], e.rows["balance"]]
    by_hold = e.by_hold[:, determining]
    by_robot = e.by_robot[:, determining]
    follows = -solve(by_hold, by_robot)
    return follows[:, :degrees]
