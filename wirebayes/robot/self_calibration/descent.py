"""Levenberg-Marquardt over robot and holds together, the holds eliminated one by one."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from wirebayes.numeric.batches import batch_first, batch_last
from wirebayes.numeric.linear_algebra import inv, solve
from wirebayes.numeric.rows import Record, chosen_rows
from wirebayes.numeric.typing import Bools, Floats
from wirebayes.robot.mechanics import rotation as turns
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.self_calibration.earlier_tensions import followed
from wirebayes.robot.self_calibration.equations import LEAST_DAMPING, Equations, Holds, Noise, State, own_normal
from wirebayes.robot.self_calibration.linearisation import linearised
from wirebayes.robot.self_calibration.strain import Grown
from wirebayes.robot.self_calibration.unknowns import Unknowns

_FAR, _TURN = 0.02, 0.3  # of the span, rad: a larger step leaves what slopes describe, for another equilibrium
_CORRECTIONS, _AS_FORESEEN = 3, 0.5  # of poses and tensions, where a step gains less than half of what slopes foresee
_GAIN = 1e-3  # of the sum of squares: less changes no estimate by a hundredth of its standard deviation
# Of the squares of all slopes, in a descent's first step, without effect on exact loops, after a step that failed, and
# where steps lead nowhere. Estimates that only loops and readings together tell are held fast by any but the least.
_AT_FIRST, _LEAST, _ONCE_MORE, _MOST = 1e-6, 1e-12, 1e-9, 1e6
_STEPS = 12  # of a descent: noise and creep change before more are worth it


@dataclass(frozen=True)
class NormalEquations:
    """Normal equations with the holds eliminated.

    Attributes
    ----------
    by_robot : (p, h, m) array
        How the unknowns of each hold follow those of the robot.
    alone : (p, h) array
        Step of each hold's unknowns while those of the robot stay.
    inverse : (p, h, h) array
        Of each hold's own equations.
    matrix, slope : (m, m), (m,) arrays
        For the robot's unknowns.
    """

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
    by_hold = e.by_hold
    by_robot = e.by_robot
    residual = e.residual[..., None]
    inverse = inv(own_normal(by_hold, damping + LEAST_DAMPING))
    mixed = by_hold.mT @ by_robot
    follows = -inverse @ mixed
    alone = -inverse @ (by_hold.mT @ residual)
    matrix_of_each = by_robot.mT @ by_robot + mixed.mT @ follows
    slope_of_each = by_robot.mT @ residual + mixed.mT @ alone
    prior = (1.0 + damping) * np.eye(len(white))
    squares = np.einsum("pki,pki->i", by_robot, by_robot)
    matrix = matrix_of_each.sum(0) + prior + damping * np.diag(squares)
    slope = slope_of_each.sum(0)[:, 0] + white
    return NormalEquations(follows, alone[..., 0], inverse, matrix, slope)


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
    target = _Target(unknowns, holds, noise, creep, since)
    here = target.at(state).followed()
    damping = _AT_FIRST
    undamped = False
    for _ in range(steps):
        there = target.ahead(here, damping)
        undamped |= damping == _LEAST
        gain = here.cost - there.cost
        level = abs(gain) < _GAIN
        if gain > 0:
            here = there.followed()
        if level and undamped:  # a damped step gains little wherever it is
            return here.ended(True)
        if level:
            damping = _LEAST
        elif gain > 0:
            damping = max(damping / 10, _LEAST)
        else:
            damping = max(damping * 10, _ONCE_MORE)
        if damping > _MOST:
            return here.ended(True)
    return here.ended(False)


@dataclass(frozen=True)
class _Place:
    """A state on the way down, the equations and the sum of squares there."""

    state: State
    equations: Equations
    cost: float

    def followed(self) -> "_Place":
        """The same, with slopes that a step can be taken by."""
        return replace(self, equations=followed(self.equations))

    def ended(self, converged: bool) -> Descent:
        return Descent(self.state, self.equations, self.cost, converged)


@dataclass(frozen=True)
class _Target:
    """What a descent minimises."""

    unknowns: Unknowns
    holds: Holds
    noise: Noise
    creep: Grown
    since: State

    def equations(self, state: State) -> Equations:
        return linearised(self.unknowns, self.holds, self.noise, state, self.creep, self.since)

    def at(self, state: State) -> _Place:
        equations = self.equations(state)
        return _Place(state, equations, cost_of(equations, state.white))

    def ahead(self, here: _Place, damping: float) -> _Place:
        """Where a step leads; led back where it gains less than foreseen. Infinitely high where there is no step."""
        robot = self.unknowns.robot
        change, hold = _step(robot, here, damping)
        known = np.isfinite(change).all() and np.isfinite(hold).all()
        if not known:  # singular with so little damping
            return replace(here, cost=np.inf)
        there = self.at(_stepped(robot, here.state, change, hold))
        white = there.state.white
        goal = _foreseen(here.equations, change, hold)
        least_gain = _AS_FORESEEN * (here.cost - float((goal**2).sum() + white @ white))
        for _ in range(_CORRECTIONS):
            if here.cost - there.cost > least_gain:
                break
            there = self.corrected(there, goal)
        return there

    def corrected(self, here: _Place, goal: Floats) -> _Place:
        """Poses and tensions a Newton step nearer to the residuals that a step was to lead to, where that is better.

        Loops and balance leave a narrow, curved valley; a step along its slope leaves it, and this leads back across
        it. Not to where the hold is best: that lies farther along the valley, round its next bend.
        """
        e, state = here.equations, here.state
        slope = e.by_hold.mT @ (e.residual - goal)[..., None]
        hold = -solve(own_normal(e.by_hold, 1e-12), slope)[..., 0]
        there = _stepped(self.unknowns.robot, state, np.zeros_like(state.white), np.nan_to_num(hold))
        ahead = self.equations(there)
        better = (ahead.residual**2).sum(1) < (e.residual**2).sum(1)
        nearer = _chosen(better, there, state, ("position_m", "rotation", "pull_N"))
        equations = _chosen(better, ahead, e, ("residual", "by_robot", "by_hold"))
        return _Place(nearer, equations, cost_of(equations, state.white))


def _chosen(first: Bools, one: Record, other: Record, names: Iterable[str]) -> Record:
    """The other record, with rows of some of its arrays from the first one."""
    rows = {name: chosen_rows(first, getattr(one, name), getattr(other, name)) for name in names}
    return replace(other, **rows)


def _step(robot: Robot, here: _Place, damping: float) -> tuple[Floats, Floats]:
    """A damped step of the robot's unknowns (m,) and of each hold (p, d and its tensions), as far as slopes reach."""
    normal = eliminated(here.equations, here.state.white, damping)
    change = -solve(normal.matrix, normal.slope[:, None])[:, 0]
    hold = normal.alone + normal.by_robot @ change
    d = robot.degrees
    reach = np.where(np.arange(d) < 3, _FAR * robot.span_m, _TURN * robot.size_m)
    farthest = float((np.abs(hold[:, :d]) / reach).max())
    share = min(1.0, 1.0 / max(farthest, 1e-300))
    return share * change, share * hold


def cost_of(e: Equations, white: Floats) -> float:
    value = float((e.residual**2).sum() + white @ white)
    return value if np.isfinite(value) else np.inf


def _stepped(robot: Robot, state: State, change: Floats, hold: Floats) -> State:
    d = robot.degrees
    motion = hold[:, :d] * robot.edge_scale
    turn = state.rotation
    if d == 6:
        turn = batch_first(turns.compose(motion[:, 3:].T, batch_last(turn)))
    return State(state.white + change, state.position_m + motion[:, :3], turn, state.pull_N + hold[:, d:])


def _foreseen(e: Equations, change: Floats, hold: Floats) -> Floats:
    """(p, k) residuals after a step, were they straight."""
    moved_by = e.by_robot @ change + (e.by_hold @ hold[..., None])[..., 0]
    return e.residual + moved_by
