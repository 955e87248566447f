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
from wirebayes.robot.motion import inverse
from wirebayes.robot.self_calibration.equations import Equations, Holds, State, moved
from wirebayes.robot.self_calibration.linearisation import linearised
from wirebayes.robot.self_calibration.posterior import Whole
from wirebayes.robot.self_calibration.session import Session
from wirebayes.robot.self_calibration.strain import Grown

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


def next_poses(found: Whole, holds: Holds, count: int, rng: np.random.Generator) -> NextPoses:
    """Choose poses one after another, each with those before it taken as visited.

    Parameters
    ----------
    found : Whole
        What is known now.
    holds : Holds
        The session: what is read at a pose is what was read in most of its holds.
    count : int
    rng : numpy Generator
        Draws the candidates in the workspace.
    """
    unknowns = found.unknowns
    parts = unknowns.parts(found.state.white)
    robot = moved(unknowns.robot, parts)
    x = rng.uniform(robot.lower_m, robot.upper_m, (_CANDIDATES, 3))
    R = np.broadcast_to(turns.matrix(robot.home_rotation_rad), (_CANDIDATES, 3, 3))
    tau = inverse.tensions(robot, x, R)
    good = np.isfinite(tau).all(1)
    if count == 0 or not good.any():
        return NextPoses(np.empty((0, 3)), np.empty(0))
    x, R, tau = x[good], R[good], tau[good]
    told = _as_read(holds, x, R, tau)
    wires = unknowns.prior.wires(unknowns.robot, parts.wires[None])[0]
    commands = inverse.commands(robot, wires, x, R, tau)
    told = replace(told, session=replace(told.session, joint_m=commands.joint_m))
    equations = _at(found, told, x, R, tau)
    blind = replace(told, tension_N=np.full_like(tau, np.nan), session=told.session.without_poses(), tilt=None)
    motion = _follows(_at(found, blind, x, R, tau), robot.degrees)
    information = _information(equations)
    root = np.moveaxis(motion[:, :3], 0, 1).reshape(-1, motion.shape[2])  # what counts: the position
    picked, sd = _one_after_another(found.covariance, information, root, min(count, len(x)))
    return NextPoses(x[picked], sd)


def _one_after_another(covariance: Floats, information: Floats, root: Floats, count: int) -> tuple[list[int], Floats]:
    """Candidates that leave the smallest pose error, each beside those before it, and that error before and after."""
    known, poses = inv(covariance), len(information)
    sd, picked = [_rms(covariance, root, poses)], []
    for _ in range(count):
        left = [_rms(inv(known + one), root, poses) for one in information]
        choice = int(np.nanargmin(left))
        known = known + information[choice]
        picked.append(choice)
        sd.append(left[choice])
    return picked, np.array(sd)


def _rms(covariance: Floats, root: Floats, poses: int) -> float:
    return float(np.sqrt(np.einsum("ri,ij,rj->", root, covariance, root) / poses))


def _as_read(holds: Holds, x: Floats, R: Floats, tau: Floats) -> Holds:
    """Candidates as holds, with what most of the session's holds have."""
    session, n = holds.session, len(x)
    read = np.isfinite(holds.tension_N).all(1).mean() >= 0.5
    placed = holds.placed.mean() >= 0.5
    there = Session(
        x if placed else np.full_like(x, np.nan),
        R if placed else np.full(R.shape, np.nan),
        np.zeros_like(tau),
        np.full(n, float(np.median(session.duration_s))),
        np.full(n, read),
        session.tension_sd_N,
        session.tilt_sd_rad,
    )
    tilt = None if holds.tilt is None else np.where(np.isfinite(holds.tilt).any(), R[:, :2, 2], np.nan)
    return Holds(there, tau if read else np.full_like(tau, np.nan), tilt)


def _at(found: Whole, holds: Holds, x: Floats, R: Floats, tau: Floats) -> Equations:
    state = State(found.state.white, x, np.array(R), tau)
    return linearised(found.unknowns, holds, found.noise, state, _no_creep(found, len(x)), state)


def _no_creep(found: Whole, count: int) -> Grown:
    legs, wires = found.unknowns.robot.legs, len(found.unknowns.moments[0])
    zero = np.zeros((count, legs))
    return Grown(zero, np.zeros((count, legs, wires)), zero)


def _information(e: Equations) -> Floats:
    """(n, m, m) what each hold says of the robot's unknowns."""
    z, g = e.by_hold, e.by_robot
    zt = z.swapaxes(1, 2)
    B = zt @ g
    return np.asarray(g.swapaxes(1, 2) @ g - B.swapaxes(1, 2) @ solve(zt @ z, B), np.float64)


def _follows(e: Equations, degrees: int) -> Floats:
    """(n, d, m) how a commanded pose follows the robot's unknowns: loops closed, platform in balance."""
    part: Indices = np.r_[e.rows["loop"], e.rows["balance"]]
    z, g = e.by_hold[:, part], e.by_robot[:, part]
    return np.asarray(-solve(z, g)[:, :degrees], np.float64)
