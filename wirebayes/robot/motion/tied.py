"""Commands of winches that drive several lines: what each line carries follows from their common joint value.

Known is where the platform shall be; unknown are its pose and the joint values. Of all balances the one is meant that
comes nearest to, one after another: the position; the orientation, where there are winches enough to command it; the
bounds of the tensions; the tensions that the robot's rule chooses where every line had a winch of its own. Each step is
linear and takes these aims in this order, each in what those before it leave free.
"""

from dataclasses import dataclass

import numpy as np

from wirebayes.numeric.typing import Bools, Floats, Ints
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


@dataclass
class _Cases:
    """Requests on their way: position ``(n, 3)``, rotation ``(n, 3, 3)``, joint values ``(n, j)``."""

    x: Floats
    R: Floats
    joint: Floats
    bound: Ints  # -1 and 1: lines held at the lowest and the highest tension


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
    n, legs = tension_N.shape
    creep, error = (np.broadcast_to(v, (legs, n)).T for v in (creep, error_m))
    none = np.full((n, legs), np.nan)
    out = Tied(np.array(rotation), none, none.copy(), np.zeros(n, bool))
    live = np.flatnonzero(np.isfinite(joint_m).all(1) & np.isfinite(tension_N).all(1))
    cases = _Cases(
        position_m[live], rotation[live], mean_of_each_winch(robot, joint_m)[live], np.zeros((len(live), legs), int)
    )
    scale = robot.edge_scale
    for _ in range(_STEPS):
        if not live.size:
            break
        here = _here(robot, wires.part(live), cases, creep[live], error[live], scale)
        step = _step(robot, here, cases, (position_m[live], rotation[live], tension_N[live]))
        done = _settled(robot, here, cases, step)
        at = live[done]
        reached = np.abs(cases.x - position_m[live]).max(1)[done] < _REACHED * robot.span_m
        out.rotation[at], out.tension_N[at] = cases.R[done], here.tension_N[done]
        out.joint_m[at] = cases.joint[done] @ turned_by(robot).T
        out.held[at] = reached
        go = ~done & np.isfinite(step).all(1)
        live, step = live[go], step[go]
        _move(robot, cases, go, step, scale)
    return out


def _settled(robot: Robot, here: _Here, cases: _Cases, step: Floats) -> Bools:
    """(n,) Which cases are in balance and at rest; a line outside its bounds then is bound, and its case goes on."""
    size, unit = np.abs(step).max(1), robot.mass_kg * GRAVITY + np.abs(here.tension_N).max(1)
    still = (size < _SETTLED * robot.span_m) & (np.abs(here.force).max(1) < _BALANCED * unit)
    newly = _newly_bound(robot, here.tension_N, cases.bound) & still[:, None]
    cases.bound += np.where(here.tension_N < robot.rule.lowest_N, -1, 1) * newly
    return np.asarray(still & ~newly.any(1))


def _here(robot: Robot, wires: Wires, cases: _Cases, creep: Floats, error: Floats, scale: Floats) -> _Here:
    """Balance and tensions at the cases' poses and joint values, with their slopes."""
    joint, grown, linear = cases.joint @ turned_by(robot).T, 1.0 + creep, robot.is_linear
    bare, offset = lengths(robot, joint)
    zero = (bare + error) * grown
    R = np.moveaxis(cases.R, 0, -1)
    shape = statics.geometry(robot, cases.x.T, R)
    S = statics.stretched(robot, shape, offset.T)
    tau, slope = tension(wires, S, zero.T)
    gradient, H = statics.unbalance_and_stiffness(robot, shape, R, tau, slope)
    J = statics.wire_jacobian(robot, shape) * scale[:, None, None]
    # a tension depends on the strain alone: by the zero-tension length it falls as it grows by the stretched one
    by_joint = slope.T * np.where(linear, robot.ratio, -(S.T / zero) * grown)
    tension_by_pose = np.moveaxis(slope * J, -1, 0).swapaxes(1, 2)
    tension_by_joint = by_joint[:, :, None] * turned_by(robot)
    force_by_joint = np.moveaxis(J, -1, 0) @ tension_by_joint
    force_by_pose = np.moveaxis(H, -1, 0) * scale * scale[:, None]
    return _Here(
        gradient.T * scale,
        np.concatenate([force_by_pose, force_by_joint], 2),
        tau.T,
        np.concatenate([tension_by_pose, tension_by_joint], 2),
    )


def _step(robot: Robot, here: _Here, cases: _Cases, goal: tuple[Floats, Floats, Floats]) -> Floats:
    """(n, d + j) The step that meets every aim as far as those before it leave it free."""
    x, R, tau = goal
    n, d, columns = len(x), robot.degrees, here.by_force.shape[2]
    place = np.broadcast_to(np.eye(columns)[:3], (n, 3, columns))
    aims = [(here.by_force, -here.force, 0.0), (place, x - cases.x, _FREE)]
    if d == 6 and robot.joints >= robot.freedoms:
        turn = np.broadcast_to(np.eye(columns)[3:6], (n, 3, columns))
        aims.append((turn, robot.size_m * turning.vector(R @ cases.R.swapaxes(1, 2)), _FREE))
    at = np.where(cases.bound < 0, robot.rule.lowest_N, robot.rule.highest_N)
    held = cases.bound != 0
    aims.append((here.by_tension * held[..., None], np.where(held, at - here.tension_N, 0.0), _FREE))
    aims.append((here.by_tension, tau - here.tension_N, _FREE))
    step, free = np.zeros((n, columns)), np.broadcast_to(np.eye(columns), (n, columns, columns))
    for by_step, wanted, least in aims:
        inside = by_step @ free
        back = _inverse(inside, least * np.linalg.norm(by_step, axis=(1, 2)))
        step = step + (back @ (wanted[..., None] - by_step @ step[..., None]))[..., 0]
        free = free - back @ inside
    return step


def _inverse(A: Floats, least: Floats) -> Floats:
    """Pseudo-inverses ``(n, c, r)`` of ``(n, r, c)`` matrices, without singular values up to `least`, (n,)."""
    finite = np.asarray(np.isfinite(A).all((1, 2)))
    U, size, V = np.linalg.svd(np.where(finite[:, None, None], A, 0.0), full_matrices=False)
    least = np.maximum(least[:, None], 1e-13 * size[:, :1])
    part = np.where(size > least, 1.0 / np.maximum(size, 1e-300), 0.0)
    out = np.einsum("nkc,nk,nrk->ncr", V, part, U)
    return np.where(finite[:, None, None], out, np.nan)


def _move(robot: Robot, cases: _Cases, go: Bools, step: Floats, scale: Floats) -> None:
    """Cases that go on, moved; long steps are cut, the direction kept."""
    moved = np.linalg.norm(step[:, :3], axis=1) / (_LONGEST * robot.span_m)
    turned = step[:, 3 : robot.degrees] * scale[3:]
    longest = np.maximum(moved, np.linalg.norm(turned, axis=1) / _LONGEST_RAD)
    share = 1.0 / np.maximum(longest, 1.0)[:, None]
    cases.x = cases.x[go] + share * step[:, :3]
    cases.R = cases.R[go]
    if robot.degrees == 6:
        cases.R = np.moveaxis(turning.compose((share * turned).T, np.moveaxis(cases.R, 0, -1)), -1, 0)
    cases.joint, cases.bound = cases.joint[go] + share * step[:, robot.degrees :], cases.bound[go]


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
    spare = robot.joints - min(robot.joints, 3 if robot.joints < robot.freedoms else robot.freedoms)
    worst = np.zeros(tension_N.shape, bool)
    worst[np.arange(len(worst)), beyond.argmax(1)] = True
    return worst & np.isfinite(beyond) & ((bound != 0).sum(1) < spare)[:, None]
