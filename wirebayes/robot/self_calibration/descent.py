"""Levenberg-Marquardt over robot and holds together, the holds eliminated one by one."""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from wirebayes.numeric.linear_algebra import inv, solve
from wirebayes.numeric.rows import chosen_rows
from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics import rotation as turns
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.self_calibration.equations import Equations, Holds, Noise, State, linearised
from wirebayes.robot.self_calibration.strain import Grown
from wirebayes.robot.self_calibration.unknowns import Unknowns

_FAR, _TURN = 0.02, 0.3  # of the span, rad: a larger step leaves what slopes describe, for another equilibrium
_CORRECTIONS, _AS_FORESEEN = 3, 0.5  # of poses and tensions, where a step gains less than half of what slopes foresee
_GAIN = 1e-3  # of the sum of squares: less changes no estimate by a hundredth of its standard deviation
_STEPS = 12  # of a descent: noise and creep change before more are worth it


@dataclass(frozen=True)
class NormalEquations:
    """Normal equations with the holds eliminated."""

    by_robot: Floats
    alone: Floats
    inverse: Floats
    matrix: Floats
    slope: Floats


def eliminated(e: Equations, white: Floats, damping: float) -> NormalEquations:
    """Normal equations of the robot's unknowns alone.

    Parameters
    ----------
    e : Equations
    white : (m,) array
        The robot's unknowns in units of their prior.
    damping : float
        Levenberg-Marquardt's; 0 at the mode.
    """
    z, g, r = e.by_hold, e.by_robot, e.residual[..., None]
    zt = z.swapaxes(1, 2)
    A = zt @ z
    diagonal = np.einsum("pii->pi", A)
    A = A + (damping + 1e-13) * diagonal[:, None] * np.eye(A.shape[1])
    inverse_ = inv(A)
    B = zt @ g
    by_robot = -inverse_ @ B
    alone = -inverse_ @ (zt @ r)
    gt = g.swapaxes(1, 2)
    left = (gt @ g + B.swapaxes(1, 2) @ by_robot).sum(0)
    right = (gt @ r + B.swapaxes(1, 2) @ alone).sum(0)[:, 0]
    m = len(white)
    matrix = left + (1.0 + damping) * np.eye(m) + damping * np.diag(np.einsum("pki,pki->i", g, g))
    return NormalEquations(by_robot, alone[..., 0], inverse_, matrix, right + white)


@dataclass(frozen=True)
class Descent:
    """Where Levenberg-Marquardt ended, the equations and the sum of squares there, and whether it had come down."""

    state: State
    equations: Equations
    cost: float
    converged: bool


def descend(
    unknowns: Unknowns, holds: Holds, noise: Noise, state: State, creep: Grown, since: State, steps: int = _STEPS
) -> Descent:
    """Levenberg-Marquardt for one noise and one creep.

    Parameters
    ----------
    unknowns : Unknowns
    holds : Holds
    noise : Noise
    state : State
        Where to start.
    creep : Grown
        About the state `since`.
    since : State
    steps : int
        At most.
    """
    damping = 1e-6
    equations = linearised(unknowns, holds, noise, state, creep, since)
    cost = cost_of(equations, state.white)
    for _ in range(steps):
        change, hold = _step(unknowns.robot, equations, state.white, damping)
        new = np.inf  # where the equations are singular with so little damping
        if np.isfinite(change).all() and np.isfinite(hold).all():
            there, ahead, new = _ahead(unknowns, holds, noise, state, equations, change, hold, creep, since)
        if new < cost:
            gain = cost - new
            state, equations, cost = there, ahead, new
            damping = max(damping / 10, 1e-12)
            if gain < _GAIN:
                return Descent(state, equations, cost, True)
        else:
            damping = max(damping * 10, 1e-9)
            if damping > 1e6:
                return Descent(state, equations, cost, True)
    return Descent(state, equations, cost, False)


def _step(robot: Robot, e: Equations, white: Floats, damping: float) -> tuple[Floats, Floats]:
    """A damped step of the robot's unknowns (m,) and of each hold (p, d and its tensions), as far as slopes reach."""
    normal = eliminated(e, white, damping)
    change = -solve(normal.matrix, normal.slope[:, None])[:, 0]
    hold = normal.alone + normal.by_robot @ change
    d = robot.degrees
    reach = np.where(np.arange(d) < 3, _FAR * robot.span_m, _TURN * robot.size_m)
    farthest = float((np.abs(hold[:, :d]) / reach).max())
    share = min(1.0, 1.0 / max(farthest, 1e-300))
    return share * change, share * hold


def _ahead(
    unknowns: Unknowns,
    holds: Holds,
    noise: Noise,
    state: State,
    e: Equations,
    change: Floats,
    hold: Floats,
    creep: Grown,
    since: State,
) -> tuple[State, Equations, float]:
    """Where a step leads, the equations and the sum of squares there; led back where it gains less than foreseen."""
    cost = cost_of(e, state.white)
    there = _stepped(unknowns.robot, state, change, hold)
    ahead = linearised(unknowns, holds, noise, there, creep, since)
    new = cost_of(ahead, there.white)
    foreseen = _foreseen(e, change, hold) + float(there.white @ there.white)
    for _ in range(_CORRECTIONS):
        if cost - new > _AS_FORESEEN * (cost - foreseen):
            break
        there, ahead = _corrected(unknowns, holds, noise, there, ahead, creep, since)
        new = cost_of(ahead, there.white)
    return there, ahead, new


def cost_of(e: Equations, white: Floats) -> float:
    value = float((e.residual**2).sum() + white @ white)
    return value if np.isfinite(value) else np.inf


def _stepped(robot: Robot, state: State, change: Floats, hold: Floats) -> State:
    d = robot.degrees
    motion = hold[:, :d] * robot.edge_scale
    turn = state.rotation
    if d == 6:
        turn = np.moveaxis(turns.compose(motion[:, 3:].T, np.moveaxis(turn, 0, -1)), -1, 0)
    return State(state.white + change, state.position_m + motion[:, :3], turn, state.pull_N + hold[:, d:])


def _foreseen(e: Equations, change: Floats, hold: Floats) -> float:
    """Sum of squares of the residuals after a step, were they straight."""
    moved_by = e.by_robot @ change + (e.by_hold @ hold[..., None])[..., 0]
    return float(((e.residual + moved_by) ** 2).sum())


def _corrected(
    unknowns: Unknowns, holds: Holds, noise: Noise, state: State, e: Equations, creep: Grown, since: State
) -> tuple[State, Equations]:
    """Poses and tensions a Newton step nearer to where each hold has them for the same robot, where that is better.

    Loops and balance leave a narrow, curved valley; a step along its slope leaves it, and this leads back.
    """
    z = e.by_hold
    zt = z.swapaxes(1, 2)
    A = zt @ z
    A = A + 1e-12 * np.einsum("pii->pi", A)[:, None] * np.eye(A.shape[1])
    hold = -solve(A, zt @ e.residual[..., None])[..., 0]
    there = _stepped(unknowns.robot, state, np.zeros_like(state.white), np.nan_to_num(hold))
    ahead = linearised(unknowns, holds, noise, there, creep, since)
    chosen = partial(chosen_rows, (ahead.residual**2).sum(1) < (e.residual**2).sum(1))
    state = State(
        state.white,
        chosen(there.position_m, state.position_m),
        chosen(there.rotation, state.rotation),
        chosen(there.pull_N, state.pull_N),
    )
    e = replace(
        e,
        residual=chosen(ahead.residual, e.residual),
        by_robot=chosen(ahead.by_robot, e.by_robot),
        by_hold=chosen(ahead.by_hold, e.by_hold),
    )
    return state, e
