"""What every hold of a session says of a robot and of its own pose and tensions, linearised.

Of every hold: each wire's loop closes (stretched length = way from winch to platform), the platform is in balance,
tensions, pose and tilt are what was read. Latent tensions keep these equations smooth: a slack wire has a negative one,
pulls at nothing, and its gap follows Hooke's law.
"""

from dataclasses import dataclass, replace

import numpy as np

from wirebayes.numeric.typing import Bools, Floats
from wirebayes.robot.mechanics import rotation as turns
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import GRAVITY, Robot
from wirebayes.robot.mechanics.winches import turned_by
from wirebayes.robot.motion import inverse
from wirebayes.robot.self_calibration.session import Session
from wirebayes.robot.self_calibration.strain import Grown, stretch
from wirebayes.robot.self_calibration.unknowns import Parts, Unknowns, one_after_another

EXACT = 1e-8  # of the robot's span: what is exact is known this well, far below anything that matters
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
    """A robot's unknowns in units of their prior, with the pose and the latent tensions at every hold's end."""

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
    """

    residual: Floats
    by_robot: Floats
    by_hold: Floats
    rows: dict[str, slice]
    known: Bools


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


def linearised(unknowns: Unknowns, holds: Holds, noise: Noise, state: State, creep: Grown, since: State) -> Equations:
    """The equations about a state.

    Parameters
    ----------
    unknowns : Unknowns
    holds : Holds
    noise : Noise
    state : State
    creep : Grown
        About `since`; straight from there.
    since : State
    """
    robot, session = unknowns.robot, holds.session
    parts = unknowns.parts(state.white)
    here = moved(robot, parts)
    p, w, d = len(session.duration_s), robot.legs, robot.degrees
    rows = _rows(robot, holds)
    k = max(part.stop for part in rows.values())
    by_robot, by_hold = np.zeros((p, k, unknowns.count)), np.zeros((p, k, d + w))
    out = Equations(np.zeros((p, k)), by_robot, by_hold, rows, np.ones((p, k), bool))
    R = np.moveaxis(state.rotation, 0, -1)
    shape = statics.geometry(here, state.position_m.T, R)
    J = np.moveaxis(statics.jacobian(here, shape) * robot.lines[:, None], -1, 0).swapaxes(1, 2) * robot.edge_scale
    _loops(out, unknowns, holds, noise, state, creep, since, shape, J)
    _balance(out, unknowns, noise, state, here, shape, J)
    _tensions(out, unknowns, holds, noise, state)
    _poses(out, unknowns, holds, state)
    if holds.tilt is not None:
        _tilts(out, robot, holds, state)
    return out


def _loops(
    out: Equations,
    unknowns: Unknowns,
    holds: Holds,
    noise: Noise,
    state: State,
    creep: Grown,
    since: State,
    shape: statics.Geometry,
    J: Floats,
) -> None:
    """Every wire is as long as its way: stretched from what the joint value, its reference and creep make of it."""
    robot, joint, at = unknowns.robot, holds.session.joint_m, unknowns.slices
    loop, leg, d = out.rows["loop"], np.arange(robot.legs), robot.degrees
    u = np.moveaxis(shape.direction, -1, 0).swapaxes(1, 2) * robot.lines[:, None]  # (p, w, 3)
    bare, offset, drawn = _joint_lengths(unknowns, state, joint)
    elastic = stretch(unknowns, state.white, state.pull_N)
    strain = creep.strain + _more_creep(creep, since, state, at["wires"])
    longer = (1 + strain) * elastic.ratio
    out.residual[:, loop] = statics.stretched(robot, shape, offset.T).T - bare * longer
    out.by_hold[:, loop, :d] = J
    out.by_hold[:, leg, d + leg] = -bare * (creep.by_pull * elastic.ratio + (1 + strain) * elastic.by_pull)
    by_wires = creep.by_wires * elastic.ratio[..., None] + (1 + strain)[..., None] * elastic.by_wires
    wires = out.by_robot[:, loop, at["wires"]]
    wires -= bare[..., None] * by_wires
    wires[:, leg, leg] -= longer * unknowns.prior.reference_sd_m
    if unknowns.errors.drum > 0:
        columns = at["drum"].start + (leg if robot.winch is None else robot.winch)
        out.by_robot[:, leg, columns] = _by_drum(unknowns, drawn, longer)
    _points(out.by_robot[:, loop], unknowns, -u, np.einsum("pwi,pij->pwj", u, state.rotation))
    _weigh_loops(out, robot, noise)


def _more_creep(creep: Grown, since: State, state: State, wires: slice) -> Floats:
    """(p, w) creep strain, to first order, that a state has beyond the one since which creep was not simulated."""
    change = state.white[wires] - since.white[wires]
    return np.asarray(creep.by_wires @ change + creep.by_pull * (state.pull_N - since.pull_N))


def _by_drum(unknowns: Unknowns, drawn: Floats, longer: Floats) -> Floats:
    """(p, w) slopes by the errors of drums: of what is drawn of the line, or of the line that is `longer` than bare."""
    linear = unknowns.robot.is_linear
    return np.asarray(np.where(linear, drawn, -drawn * longer) * unknowns.errors.drum)


def _weigh_loops(out: Equations, robot: Robot, noise: Noise) -> None:
    """Equations of the wires in standard deviations of their errors, which are made independent."""
    loop, alone = out.rows["loop"], _errors_apart(robot)
    for values in (out.residual, out.by_robot, out.by_hold):
        values[:, loop] /= noise.joint_m
        if alone is not None:
            values[:, loop] = np.einsum("ij,pj...->pi...", alone, values[:, loop])


def _joint_lengths(unknowns: Unknowns, state: State, joint_m: Floats) -> tuple[Floats, Floats, Floats]:
    """(p, w) bare lengths and offsets by joint values, with the errors of references and drums, and what is drawn."""
    robot, parts = unknowns.robot, unknowns.parts(state.white)
    bare, offset = inverse.lengths(robot, joint_m)
    drawn = robot.ratio * joint_m * robot.is_linear + joint_m * ~robot.is_linear
    bare = bare + parts.reference_m + parts.drum * drawn * ~robot.is_linear
    return bare, offset + parts.drum * drawn * robot.is_linear, drawn


def _errors_apart(robot: Robot) -> Floats | None:
    """(w, w) What makes the errors of all lines' lengths independent of each other; None where they are.

    Half of the variance is the winch's, whose encoder and drum its lines share; half is each line's, as it lies there.
    """
    if robot.winch is None:
        return None
    share = turned_by(robot)
    return np.asarray(np.linalg.inv(np.linalg.cholesky(0.5 * (np.eye(robot.legs) + share @ share.T))))


def _balance(
    out: Equations, unknowns: Unknowns, noise: Noise, state: State, here: Robot, shape: statics.Geometry, J: Floats
) -> None:
    """The wires carry the platform."""
    robot, d = unknowns.robot, unknowns.robot.degrees
    residual, by_robot, by_hold = out.residual, out.by_robot, out.by_hold
    R = np.moveaxis(state.rotation, 0, -1)
    balance = out.rows["balance"]
    pull, taut = pulled(state.pull_N, noise.soft_N)
    gradient, H = statics.unbalance_and_stiffness(here, shape, R, pull.T, np.zeros_like(pull.T))
    force = noise.balance * robot.mass_kg * GRAVITY
    residual[:, balance] = gradient.T * robot.edge_scale / force
    by_hold[:, balance, :d] = np.moveaxis(H, -1, 0) * robot.edge_scale * robot.edge_scale[:, None] / force
    by_hold[:, balance, d:] = J.swapaxes(1, 2) * taut[:, None] / force
    by_exit, by_platform = _swing(here, shape, state.rotation, pull)
    _points(
        by_robot[:, balance],
        unknowns,
        by_exit * robot.edge_scale[:, None, None] / force,
        by_platform * robot.edge_scale[:, None, None] / force,
    )


def _rows(robot: Robot, holds: Holds) -> dict[str, slice]:
    counts = {"loop": robot.legs, "balance": robot.degrees, "tension": robot.legs, "pose": robot.degrees}
    if holds.tilt is not None:
        counts["tilt"] = 2
    return one_after_another(counts)


def _points(out: Floats, unknowns: Unknowns, by_exit: Floats, by_platform: Floats) -> None:
    """Slopes by exit and platform points, where these are unknown.

    `by_exit` and `by_platform` are ``(p, w, 3)`` of equations that speak of one leg each, or ``(p, d, w, 3)``.
    """
    for name, slope, sd in (
        ("exit", by_exit, unknowns.errors.exit_m),
        ("platform", by_platform, unknowns.errors.platform_m),
    ):
        at = unknowns.slices[name]
        if at.stop == at.start:
            continue
        if slope.ndim == 3:
            leg = np.arange(slope.shape[1])
            for axis in range(3):
                out[:, leg, at.start + 3 * leg + axis] = slope[..., axis] * sd
        else:
            out[:, :, at] = slope.reshape(*slope.shape[:2], -1) * sd


def _swing(robot: Robot, shape: statics.Geometry, rotation: Floats, pull: Floats) -> tuple[Floats, Floats]:
    """How the wires' pull on the platform changes when a point moves: ``(p, d, w, 3)`` by exit and platform points."""
    tau = (pull * robot.lines).T  # (w, p)
    u, r = np.moveaxis(shape.direction, -1, 0), np.moveaxis(shape.arm_m, -1, 0)  # (p, 3, w)
    turn = (tau / shape.straight_m).T[..., None, None] * np.eye(3)
    turn = turn - np.einsum("wp,piw,pjw->pwij", tau / shape.straight_m, u, u)
    if shape.over is not None:
        side = np.moveaxis(shape.over.across, -1, 0)
        turn = turn + np.einsum("wp,piw,pjw->pwij", tau * shape.over.swing_1_m, side, side)
    by_line = np.moveaxis(turn, 1, 2)  # (p, 3, w, 3)
    by_arm = np.zeros_like(by_line)
    if robot.degrees == 6:
        crossed = turns.cross_matrix(np.swapaxes(r, 1, 2))  # (p, w, 3, 3)
        by_line = np.concatenate([by_line, np.moveaxis(crossed @ turn, 1, 2)], 1)
        pulls = turns.cross_matrix(np.swapaxes(u, 1, 2) * tau.T[..., None])
        by_arm = np.concatenate([by_arm, np.moveaxis(-pulls, 1, 2)], 1)
    by_platform = np.einsum("pdwi,pij->pdwj", by_line + by_arm, rotation)
    return -by_line, by_platform


def _tensions(out: Equations, unknowns: Unknowns, holds: Holds, noise: Noise, state: State) -> None:
    """Tensions that were read, and what is usual where none was."""
    robot, session = unknowns.robot, holds.session
    w, d, rows = robot.legs, robot.degrees, out.rows["tension"]
    read = np.isfinite(holds.tension_N)
    sign = np.ones_like(session.joint_m) if session.motion is None else session.motion
    parts = unknowns.parts(state.white)
    pull, taut = pulled(state.pull_N, noise.soft_N)
    off = (pull + sign * parts.bias_N - holds.tension_N) / session.tension_sd_N
    usual = (state.pull_N - parts.level_N - noise.usual_N) / noise.pull_N
    out.known[:, rows] = read
    out.residual[:, rows] = np.where(read, off, usual)
    leg = np.arange(w)
    row = rows.start + leg
    out.by_hold[:, row, d + leg] = np.where(read, taut / session.tension_sd_N, 1.0 / noise.pull_N)
    if unknowns.errors.level_N > 0:
        level = unknowns.slices["level"].start + leg
        out.by_robot[:, row, level] = np.where(read, 0.0, -unknowns.errors.level_N / noise.pull_N)
    if unknowns.prior.bias_sd_N > 0:
        bias = unknowns.slices["wires"].stop - w + leg
        by_bias = sign * unknowns.prior.bias_sd_N / session.tension_sd_N
        out.by_robot[:, row, bias] = np.where(read, by_bias, 0.0)


def _poses(out: Equations, unknowns: Unknowns, holds: Holds, state: State) -> None:
    """Poses that were stated."""
    robot, session, rows = unknowns.robot, holds.session, out.rows["pose"]
    known, residual = out.known[:, rows], out.residual[:, rows]
    sd = max(unknowns.errors.pose_m, EXACT * robot.span_m)
    placed = holds.placed[:, None]
    known[:, :3] = placed
    residual[:, :3] = np.where(placed, state.position_m - session.position_m, 0.0) / sd
    if robot.degrees == 6:
        there = np.where(holds.oriented[:, None, None], session.rotation, state.rotation)
        turned = turns.vector(state.rotation @ np.swapaxes(there, 1, 2))
        known[:, 3:] = holds.oriented[:, None]
        residual[:, 3:] = turned * robot.size_m / sd
    out.by_hold[:, rows, : robot.degrees] = known[..., None] * np.eye(robot.degrees) / sd


def _tilts(out: Equations, robot: Robot, holds: Holds, state: State) -> None:
    """Components of the platform's normal that an inclinometer read."""
    sd = holds.session.tilt_sd_rad
    if holds.tilt is None or sd is None:
        return
    rows, read = out.rows["tilt"], np.isfinite(holds.tilt)
    normal = state.rotation[:, :, 2]
    out.known[:, rows] = read
    out.residual[:, rows] = np.where(read, normal[:, :2] - holds.tilt, 0.0) / sd
    if robot.degrees == 6:
        slope = -turns.cross_matrix(normal)[:, :2] / robot.size_m
        out.by_hold[:, rows, 3:6] = read[..., None] * slope / sd
