"""Commands of winches that drive several lines: what each line carries follows from their common joint value.

Known is where the platform shall be; unknown are its pose and the joint values. Of all balances the one is meant that
comes nearest to, one after another: the position; the orientation, where there are winches enough to command it; the
bounds of the tensions; the tensions that the robot's rule chooses where every line had a winch of its own. Each step is
linear and takes these aims in this order, each in what those before it leave free.
"""

from dataclasses import dataclass

import numpy as np

from wirebayes.numeric.batches import batch_first, batch_last
from wirebayes.numeric.rows import chosen_rows, rows_of
from wirebayes.numeric.typing import Bools, Floats, Indices, Ints
from wirebayes.robot.mechanics import rotation as turning
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import GRAVITY, Robot
from wirebayes.robot.mechanics.winches import lengths, mean_of_each_winch, turned_by
from wirebayes.robot.mechanics.wires import Wires, tension

_STEPS = 60  # half a dozen are usual; every line that comes to its bound takes as many more
_LONGEST_RAD, _LONGEST = 0.3, 0.1  # turned and, in spans, moved in a step: beyond, what was linearised means little
_BALANCED = 1e-9  # of the weight and the largest tension
_SETTLED = 1e-10  # of the span: a step so small changes nothing
_REACHED = 1e-8  # of the span
_INSIDE = 1e-8  # of the largest tension, beyond its bounds
_FREE = 1e-3  # of what an aim can be moved by at most: what moves it by less leaves it as it is


@dataclass(frozen=True)
class Tied:
    """Balances of ``n`` requests.

    Attributes
    ----------
    rotation : (n, 3, 3) array
    joint_m, tension_N : (n, w) arrays
        Leg by leg.
    held : (n,) bool array
        Whether the position was reached. Tensions keep their bounds as far as the winches can bring them there.
    """

    rotation: Floats
    joint_m: Floats
    tension_N: Floats
    held: Bools

    @classmethod
    def nothing(cls, rotation: Floats, tension_N: Floats) -> "Tied":
        """No balance is known yet."""
        none = np.full(tension_N.shape, np.nan)
        return cls(np.array(rotation), none, none.copy(), np.zeros(len(none), bool))


@dataclass(frozen=True)
class _Goal:
    """Positions ``(n, 3)``, rotations ``(n, 3, 3)`` and tensions ``(n, w)`` that are aimed at."""

    x: Floats
    R: Floats
    tau: Floats


@dataclass
class _Cases:
    """Requests on their way: position ``(n, 3)``, rotation ``(n, 3, 3)``, joint values ``(n, j)``."""

    x: Floats
    R: Floats
    joint: Floats
    bound: Ints  # -1 and 1: lines held at the lowest and the highest tension

    @classmethod
    def beginning(cls, goal: _Goal, joint: Floats) -> "_Cases":
        """At the poses aimed at, with joint values of winches."""
        return cls(goal.x, goal.R, joint, np.zeros(goal.tau.shape, int))


@dataclass(frozen=True)
class _Here:
    """What balance and tensions are at a pose, and how they change: ``(n, d)``, ``(n, w)``, with ``d + j`` columns."""

    force: Floats
    by_force: Floats
    tension_N: Floats
    by_tension: Floats


def tied(
    robot: Robot,
    wires: Wires,
    position_m: Floats,
    rotation: Floats,
    tension_N: Floats,
    joint_m: Floats,
    creep: Floats | float,
    error_m: Floats | float,
) -> Tied:
    """Joint values that bring the platform to positions.

    Parameters
    ----------
    robot : Robot
        Some of whose winches drive several lines.
    wires : Wires
        Of n draws.
    position_m : (n, 3) array
    rotation : (n, 3, 3) array
        Aimed at.
    tension_N : (n, w) array
        Aimed at; NaN where no tensions hold the pose.
    joint_m : (n, w) array
        What the lines would need if each had a winch of its own.
    creep, error_m : (w, n) array
        As for `inverse.commands`.
    """
    shape = tension_N.T.shape
    creep = np.broadcast_to(creep, shape).T
    error = np.broadcast_to(error_m, shape).T
    out = Tied.nothing(rotation, tension_N)
    known = np.isfinite(joint_m).all(1) & np.isfinite(tension_N).all(1)
    live = np.flatnonzero(known)
    goal = _Goal(position_m, rotation, tension_N)
    joint = mean_of_each_winch(robot, joint_m)[live]
    cases = _Cases.beginning(rows_of(goal, live), joint)
    for _ in range(_STEPS):
        if not live.size:
            break
        own = rows_of(goal, live)
        here = _here(robot, wires.part(live), cases, creep[live], error[live])
        step = _step(robot, here, cases, own)
        done = _settled(robot, here, cases, step)
        _keep(out, robot, live, done, cases, here)
        off = np.abs(cases.x - own.x).max(1)
        out.held[live[done]] = off[done] < _REACHED * robot.span_m
        go = ~done & np.isfinite(step).all(1)
        live = live[go]
        _move(robot, cases, go, step[go])
    return out


def _keep(out: Tied, robot: Robot, live: Indices, done: Bools, cases: _Cases, here: _Here) -> None:
    """Write down where cases came to rest."""
    at = live[done]
    out.rotation[at] = cases.R[done]
    out.tension_N[at] = here.tension_N[done]
    out.joint_m[at] = cases.joint[done] @ turned_by(robot).T


def _settled(robot: Robot, here: _Here, cases: _Cases, step: Floats) -> Bools:
    """(n,) Which cases are in balance and at rest; a line outside its bounds then is bound, and its case goes on."""
    size, low_N = np.abs(step).max(1), robot.rule.lowest_N
    unit = robot.mass_kg * GRAVITY + np.abs(here.tension_N).max(1)
    balanced = np.abs(here.force).max(1) < _BALANCED * unit
    still = (size < _SETTLED * robot.span_m) & balanced
    newly = _newly_bound(robot, here.tension_N, cases.bound) & still[:, None]
    cases.bound += np.where(here.tension_N < low_N, -1, 1) * newly
    return np.asarray(still & ~newly.any(1))


def _here(robot: Robot, wires: Wires, cases: _Cases, creep: Floats, error: Floats) -> _Here:
    """Balance and tensions at the cases' poses and joint values, with their slopes."""
    scale = robot.edge_scale
    bare, offset = lengths(robot, cases.joint @ turned_by(robot).T)
    grown = 1.0 + creep
    zero = (bare + error) * grown
    turn = batch_last(cases.R)
    shape = statics.geometry(robot, cases.x.T, turn)
    stretched = statics.stretched(robot, shape, offset.T)
    tau, slope = tension(wires, stretched, zero.T)
    gradient, hessian = statics.unbalance_and_stiffness(robot, shape, turn, tau, slope)
    ratio = stretched.T / zero
    by_joint = _by_joint(robot, slope.T, ratio, grown)
    by_force, by_tension = _slopes(robot, shape, hessian, slope, by_joint)
    force = gradient.T * scale
    return _Here(force, by_force, tau.T, by_tension)


def _by_joint(robot: Robot, slope: Floats, ratio: Floats, grown: Floats) -> Floats:
    """(n, w, j) slopes of tensions by joint values, where wires are stretched to ratios ``(n, w)``.

    A tension depends on the strain alone: by the zero-tension length it falls as it grows by the stretched one.
    """
    by_line = slope * np.where(robot.is_linear, robot.ratio, -ratio * grown)
    return by_line[:, :, None] * turned_by(robot)


def _slopes(
    robot: Robot, shape: statics.Geometry, hessian: Floats, slope: Floats, tension_by_joint: Floats
) -> tuple[Floats, Floats]:
    """Slopes of balance and tensions by pose and joint values."""
    scale = robot.edge_scale
    J = statics.wire_jacobian(robot, shape) * scale[:, None, None]
    force_by_pose = batch_first(hessian) * scale * scale[:, None]
    force_by_joint = batch_first(J) @ tension_by_joint
    tension_by_pose = batch_first(slope * J).mT
    by_force = np.concatenate([force_by_pose, force_by_joint], 2)
    return by_force, np.concatenate([tension_by_pose, tension_by_joint], 2)


def _step(robot: Robot, here: _Here, cases: _Cases, goal: _Goal) -> Floats:
    """(n, d + j) The step that meets every aim as far as those before it leave it free."""
    n, _, columns = here.by_force.shape
    step = np.zeros((n, columns))
    free = np.broadcast_to(np.eye(columns), (n, columns, columns))
    for by_step, wanted, least in _aims(robot, here, cases, goal):
        inside = by_step @ free
        size = np.linalg.norm(by_step, axis=(1, 2))
        back = _inverse(inside, least * size)
        reached = by_step @ step[..., None]
        missing = wanted[..., None] - reached
        more = back @ missing
        step = step + more[..., 0]
        free = free - back @ inside
    return step


def _aims(robot: Robot, here: _Here, cases: _Cases, goal: _Goal) -> list[tuple[Floats, Floats, float]]:
    """Slopes by the step, what is wanted, and what moves an aim too little to count: of one aim after another."""
    n, columns = len(goal.x), here.by_force.shape[2]
    unit = np.broadcast_to(np.eye(columns), (n, columns, columns))
    aims = [(here.by_force, -here.force, 0.0), (unit[:, :3], goal.x - cases.x, _FREE)]
    if robot.degrees == 6 and robot.joints >= robot.freedoms:
        turned = turning.vector(goal.R @ cases.R.mT)
        aims.append((unit[:, 3:6], robot.size_m * turned, _FREE))
    held = cases.bound != 0
    aims.append((here.by_tension * held[..., None], _beyond(robot, here, cases.bound), _FREE))
    aims.append((here.by_tension, goal.tau - here.tension_N, _FREE))
    return aims


def _beyond(robot: Robot, here: _Here, bound: Ints) -> Floats:
    """(n, w) by how much tensions are to change that are held at a bound."""
    at = np.where(bound < 0, robot.rule.lowest_N, robot.rule.highest_N)
    return np.where(bound != 0, at - here.tension_N, 0.0)


def _inverse(A: Floats, least: Floats) -> Floats:
    """Pseudo-inverses ``(n, c, r)`` of ``(n, r, c)`` matrices, without singular values up to `least`, (n,)."""
    finite = np.asarray(np.isfinite(A).all((1, 2)))
    U, size, V = np.linalg.svd(chosen_rows(finite, A, 0.0), full_matrices=False)
    least = np.maximum(least[:, None], 1e-13 * size[:, :1])
    part = np.where(size > least, 1.0 / np.maximum(size, 1e-300), 0.0)
    out = np.einsum("nkc,nk,nrk->ncr", V, part, U)
    return chosen_rows(finite, out, np.nan)


def _move(robot: Robot, cases: _Cases, go: Bools, step: Floats) -> None:
    """Cases that go on, moved; long steps are cut, the direction kept."""
    moved = np.linalg.norm(step[:, :3], axis=1) / (_LONGEST * robot.span_m)
    turned = step[:, 3 : robot.degrees] * robot.edge_scale[3:]
    longest = np.maximum(moved, np.linalg.norm(turned, axis=1) / _LONGEST_RAD)
    share = 1.0 / np.maximum(longest, 1.0)[:, None]
    cases.x = cases.x[go] + share * step[:, :3]
    cases.R = cases.R[go]
    if robot.degrees == 6:
        cases.R = batch_first(turning.compose((share * turned).T, batch_last(cases.R)))
    cases.joint = cases.joint[go] + share * step[:, robot.degrees :]
    cases.bound = cases.bound[go]


def _outside(robot: Robot, tension_N: Floats) -> Bools:
    """(n, w) Whether tensions are outside their bounds, by more than rounding."""
    rule, margin = robot.rule, _INSIDE * np.abs(tension_N).max(1, keepdims=True)
    return (tension_N < rule.lowest_N - margin) | (tension_N > rule.highest_N + margin)


def _newly_bound(robot: Robot, tension_N: Floats, bound: Ints) -> Bools:
    """(n, w) The line farthest outside its bounds, where lines are left to move it by.

    As many lines can be held at bounds as there are winches beyond those that command position and orientation.
    """
    rule = robot.rule
    beyond = np.maximum(rule.lowest_N - tension_N, tension_N - rule.highest_N)
    beyond = np.where(_outside(robot, tension_N) & (bound == 0), beyond, -np.inf)
    worst = np.zeros(tension_N.shape, bool)
    worst[np.arange(len(worst)), beyond.argmax(1)] = True
    commanded = 3 if robot.joints < robot.freedoms else robot.freedoms
    spare = robot.joints - min(robot.joints, commanded)
    free = (bound != 0).sum(1) < spare
    return worst & np.isfinite(beyond) & free[:, None]
