"""Commanded poses and loads to where the platform really goes while its wires creep."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from wirebayes.numeric.typing import Floats, Indices, Ints
from wirebayes.progress import Progress, silent
from wirebayes.robot.history.balanced import balanced
from wirebayes.robot.history.estimate import Estimate
from wirebayes.robot.history.follow import RESTART, Track, clock_starts, errors_at, follow_log
from wirebayes.robot.history.history import History, divided
from wirebayes.robot.history.unknowns import Uncertain, unknowns
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.draws import WireDraws
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion import inverse

_STRAIGHT = 0.02  # of the robot's span: over so short a way, even joint values make an even motion


def drift_along(
    robot: Robot,
    line: WireDraws,
    history: History,
    errors: Uncertain,
    rng: np.random.Generator,
    progress: Progress = silent,
    restart: float = RESTART,
) -> tuple[Estimate, Floats]:
    """Follow commanded poses: every draw's joint values would give them exactly if its wires did not creep.

    Parameters
    ----------
    robot : Robot
    line : WireDraws
    history : History
        With poses.
    errors : Uncertain
        Of it the spread from wire to wire, or what a calibration left known: each draw's joint values then allow for
        its own lengths, and for the creep that its wires bring along.
    rng : numpy Generator
    progress : function of name, done and total
    restart : float
        As in `follow.clock_starts`.

    Returns
    -------
    Estimate
        At the rows of the history.
    joint_m : (n, t, w) array
        The commands of each draw's actuators.

    Raises
    ------
    Unheld
        No tensions within the bounds hold the platform at some row.
    """
    fine, kept = refined_poses(robot, history)
    fine = balanced(robot, fine)
    assert fine.position_m is not None and fine.rotation is not None
    exact = replace(errors, reference_m=0.0)
    known = unknowns(robot, line, exact, rng)
    wires, error = known.columns(known.draws)
    tau = _held_tensions(robot, fine)
    pull = error = np.zeros_like(error)  # of lengths that nobody measured nothing but creep is followed
    if errors.calibrated is not None:
        error, pull = known.errors_along(known.draws, _without_drift(fine, tau, np.zeros(len(tau), int)))
    carried = known.carried(known.draws)
    strain = carried.strain(wires)
    joint = _commanded_joints(robot, fine, wires, tau, strain, error)
    starts = clock_starts(fine, tau, restart)
    start = fine.position_m[0], fine.rotation[0]

    def watched(row: int) -> None:
        progress("poses", row + 1, len(tau))

    track = follow_log(robot, wires, fine, joint, start, starts, error, watched, carried).pulled_more(pull)
    plain = _without_drift(fine, tau, track.hold)
    found = Estimate(track.at_rows(kept), plain.at_rows(kept), wires, errors_at(error, kept), starts)
    commanded = np.swapaxes(joint[kept], 0, 1)
    return found, commanded


def _without_drift(history: History, tau: Floats, hold: Ints) -> Track:
    """The commanded poses as a track of wires that do not creep."""
    assert history.position_m is not None and history.rotation is not None
    strain = np.zeros((1, *tau.shape))
    return Track(history.position_m[None], history.rotation[None], tau[None], strain, hold)


def _held_tensions(robot: Robot, history: History) -> Floats:
    """`wanted_tensions` where they hold the platform at every row."""
    tau = wanted_tensions(robot, history)
    bad = np.flatnonzero(~np.isfinite(tau).all(1))
    if bad.size:
        raise Unheld(float(history.times_s[bad[0]]))
    return tau


def _commanded_joints(
    robot: Robot, history: History, wires: Wires, tau: Floats, strain: Floats, error: Floats
) -> Floats:
    """Joint values ``(t, n, w)`` of each draw's actuators."""
    assert history.position_m is not None and history.rotation is not None
    joints = []
    for k, tension in enumerate(tau):
        loaded = history.robot_at(robot, k)
        x, R = history.position_m[k], history.rotation[k]
        off = errors_at(error, k)
        commands = inverse.commands(loaded, wires, x[None], R[None], tension[None], strain, off.T)
        joints.append(commands.joint_m)
    return np.stack(joints)


class Unheld(Exception):
    """No tensions within the bounds hold the platform at a time of a history."""

    def __init__(self, time_s: float) -> None:
        super().__init__(f"no tensions within the bounds hold the platform {time_s:g} s after the start")
        self.time_s = time_s


def wanted_tensions(robot: Robot, history: History) -> Floats:
    """Tensions ``(t, w)`` that hold the platform and its payload at commanded poses; NaN where none do."""
    assert history.position_m is not None and history.rotation is not None
    out = np.empty((len(history.times_s), robot.legs))
    loads = np.column_stack([history.payload_kg, history.payload_m])
    for load in np.unique(loads, axis=0):
        rows = np.flatnonzero((loads == load).all(1))
        loaded = history.robot_at(robot, int(rows[0]))
        out[rows] = inverse.tensions(loaded, history.position_m[rows], history.rotation[rows])
    return out


def refined_poses(robot: Robot, history: History) -> tuple[History, Indices]:
    """The history with rows between distant poses, and where its own rows are among them."""
    assert history.position_m is not None and history.rotation is not None
    turned = Rotation.from_matrix(history.rotation)
    angle = (turned[:-1].inv() * turned[1:]).magnitude()
    displaced = np.linalg.norm(np.diff(history.position_m, axis=0), axis=1)
    far = np.maximum(displaced, robot.size_m * angle)
    pieces = np.ceil(far / (_STRAIGHT * robot.span_m)).astype(int)
    return divided(history, np.maximum(pieces, 1))
