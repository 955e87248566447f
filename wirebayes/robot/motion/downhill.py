"""Downhill on the energy of weight and wires: Newton's method, damped where it would not lead down, many at once."""

from dataclasses import dataclass, fields, replace

import numpy as np

from wirebayes.numeric import cholesky
from wirebayes.numeric.rows import joined_rows, last_axis_of
from wirebayes.numeric.typing import Bools, Floats, Indices, Ints
from wirebayes.robot.mechanics import rotation as turning
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import GRAVITY, Robot
from wirebayes.robot.mechanics.wires import Wires, energy, tension
from wirebayes.robot.motion.balance import in_metres
from wirebayes.robot.motion.outcome import FOUND, NO_EQUILIBRIUM, NOT_CONVERGED, NOT_HELD
from wirebayes.robot.motion.saddle import off_saddle

_GOING_ON = -1  # of a case that is still being solved
_CHUNK, _QUICK = 2048, 7
_FAR = 10.0  # times the robot's size with its wires: no equilibrium is looked for beyond
_LOOSE = 0.1  # of the robot's size with its wires: the longest step where the curvature does not bound one


@dataclass(frozen=True)
class Solved:
    """What became of n cases.

    Attributes
    ----------
    x, R, tau : (3, n), (3, 3, n) and (w, n) arrays
    status, count : (n,) int arrays
        How each ended, and after how many iterations.
    left : (n,) array
        Largest force left over, N.
    """

    x: Floats
    R: Floats
    tau: Floats
    status: Ints
    count: Ints
    left: Floats

    @classmethod
    def not_yet(cls, x: Floats, R: Floats, legs: int) -> "Solved":
        """Cases at their starts.

        Parameters
        ----------
        x, R : (3, n) and (3, 3, n) arrays
        legs : int
            Of the robot.
        """
        n = x.shape[1]
        status, count = np.full(n, NOT_CONVERGED), np.zeros(n, np.int64)
        return cls(np.array(x), np.array(R), np.zeros((legs, n)), status, count, np.full(n, np.inf))

    def store(self, cases: "_Cases") -> None:
        """Note where cases stand."""
        self.x[:, cases.number], self.R[..., cases.number] = cases.x, cases.R
        self.tau[:, cases.number], self.left[cases.number] = cases.at.tau, cases.at.size

    def without_ended(self, cases: "_Cases", ended: Ints) -> "_Cases":
        """The cases that go on; the others are noted, with how they ended."""
        finished = ended != _GOING_ON
        if not finished.any():
            return cases
        self.store(cases.part(np.flatnonzero(finished)))
        self.status[cases.number[finished]] = ended[finished]
        return cases.part(np.flatnonzero(~finished))

    def go_on(self, rows: Indices, later: "Solved") -> None:
        """Put what became of some cases, which had gone on, in their place."""
        for name in ("x", "R", "tau", "status", "left"):
            getattr(self, name)[..., rows] = getattr(later, name)
        self.count[rows] += later.count


def lead_downhill(
    robot: Robot,
    wires: Wires,
    zero: Floats,
    offset: Floats,
    x: Floats,
    R: Floats,
    max_iterations: int,
    leash_m: Floats | float,
) -> Solved:
    """Lead all cases downhill: by a few iterations, and the slow ones of all chunks together.

    Small arrays waste the machine.

    Parameters
    ----------
    robot : Robot
        Its exit points counted from their middle.
    wires : Wires
        ``n`` draws.
    zero, offset : (w, n) arrays
        Zero-tension lengths, and stretched lengths that are not between exit and platform point.
    x, R : (3, n) and (3, 3, n) arrays
        Where each begins.
    max_iterations : int
    leash_m : (n,) array or float
        How far from there, rotations counted at the platform's edge, each is led at most.

    Returns
    -------
    Solved
    """
    quick = min(_QUICK, max_iterations)
    leash = np.broadcast_to(leash_m, x.shape[1:])
    solved = _in_chunks(robot, wires, zero, offset, x, R, quick, leash)
    open_ = solved.status == NOT_CONVERGED
    slow = np.flatnonzero(open_ & (_away_m(robot, solved.x - x, solved.R - R) <= leash))
    if slow.size and max_iterations > quick:
        part = wires.part(slow), zero[:, slow], offset[:, slow]
        reached = solved.x[:, slow], solved.R[..., slow]
        later = _in_chunks(robot, *part, *reached, max_iterations - quick, leash[slow])
        solved.go_on(slow, later)
    return solved


def _away_m(robot: Robot, displaced: Floats, turned: Floats) -> Floats:
    """(n,) Larger of displacements (3, n) and of changes of rotations (3, 3, n) at the platform's edge."""
    square = (displaced * displaced).sum(0)
    turn_square = (turned * turned).sum((0, 1))
    return np.sqrt(np.maximum(square, robot.size_m**2 * turn_square))


def _in_chunks(
    robot: Robot,
    wires: Wires,
    zero: Floats,
    offset: Floats,
    x: Floats,
    R: Floats,
    max_iterations: int,
    leash_m: Floats,
) -> Solved:
    parts = []
    for first in range(0, zero.shape[1], _CHUNK):
        cut = slice(first, first + _CHUNK)
        part = wires.part(cut), zero[:, cut], offset[:, cut], x[:, cut], R[..., cut]
        parts.append(_in_one_chunk(robot, *part, max_iterations, leash_m[cut]))
    return joined_rows(parts, axis=-1)


@dataclass(frozen=True)
class _Cases:
    """Cases that are still being solved, n of them.

    Attributes
    ----------
    number : (n,) int array
        Which they are among all.
    wires : Wires
    zero, offset : (w, n) arrays
    x, R : (3, n) and (3, 3, n) arrays
    at : _Point
        Energy and its derivatives there.
    damping : (n,) array
        Added to the Hessian, in units of `level`.
    level : (n,) array
        The stiffness if every wire were taut: a measure of damping that exists also when all are slack.
    floor : (n,) array
        Force below which no computed one can be trusted, N.
    span : (n,) array
        Size of the robot with its wires, m.
    """

    number: Indices
    wires: Wires
    zero: Floats
    offset: Floats
    x: Floats
    R: Floats
    at: "_Point"
    damping: Floats
    level: Floats
    floor: Floats
    span: Floats

    def part(self, keep: Indices) -> "_Cases":
        return last_axis_of(self, keep)

    def moved(self, accept: Bools, x: Floats, R: Floats, new: "_Point") -> "_Cases":
        """The cases at new places where these are accepted."""
        x, R = np.where(accept, x, self.x), np.where(accept, R, self.R)
        return replace(self, x=x, R=R, at=self.at.where(accept, new))

    def newton(self, step: "_Step") -> Bools:
        """(n,) Which steps are Newton's own."""
        return step.positive & (self.damping == 0)


def _in_one_chunk(
    robot: Robot,
    wires: Wires,
    zero: Floats,
    offset: Floats,
    x: Floats,
    R: Floats,
    max_iterations: int,
    leash_m: Floats,
) -> Solved:
    """One chunk; solved cases leave the batch as they finish."""
    solved = Solved.not_yet(x, R, robot.legs)
    cases = _begin(robot, wires, zero, offset, x, R)
    leashed = np.isfinite(leash_m).any()
    for iteration in range(1, max_iterations + 1):
        cases, ended = _iterate(robot, cases)
        solved.count[cases.number] = iteration
        if leashed:
            away_m = _away_m(robot, cases.x - x[:, cases.number], cases.R - R[..., cases.number])
            strayed = away_m > leash_m[cases.number]
            ended = np.where((ended == _GOING_ON) & strayed, NOT_CONVERGED, ended)
        cases = solved.without_ended(cases, ended)
        if not cases.number.size:
            return solved
    solved.store(cases)
    return solved


def _begin(robot: Robot, wires: Wires, zero: Floats, offset: Floats, x: Floats, R: Floats) -> _Cases:
    """All cases at their starts, undamped."""
    n = zero.shape[1]
    k1 = np.broadcast_to(wires.theta["k1"], (robot.legs, n))
    level = np.sum(k1 * robot.lines[:, None] ** 2 / zero, axis=0)
    at = _evaluate(robot, wires, zero, offset, x, R)
    span = robot.span_m + zero.max(0)
    return _Cases(np.arange(n), wires, zero, offset, x, R, at, np.zeros(n), level, _floor(robot, k1), span)


def _floor(robot: Robot, k1: Floats) -> Floats:
    """(n,) force below which no computed one can be trusted, N.

    The strain is known to one rounding error. Moments are divided by the platform's size; points far from the reference
    point make more of the same error.
    """
    arm = 1.0
    if robot.degrees == 6:
        arm = max(1.0, np.abs(robot.platform_m).max() / robot.size_m)
    forces = np.max(k1, axis=0) * robot.lines.max() + robot.mass_kg * GRAVITY
    return 32 * np.finfo(float).eps * arm * forces


def _iterate(robot: Robot, cases: _Cases) -> tuple[_Cases, Ints]:
    """A damped Newton step of every case, taken where it leads down, and how it ended (`_GOING_ON` if it did not)."""
    step = _newton_step(robot, cases)
    x, R = _stepped(robot, cases, step)
    new = _evaluate(robot, cases.wires, cases.zero, cases.offset, x, R)
    lifted = robot.mass_kg * GRAVITY * cases.span
    noise = 1e-14 * (np.abs(cases.at.energy) + lifted)
    accept = _leads_down(robot, cases, step, new, noise)
    moved = cases.moved(accept, x, R, new)
    less = _calmer(cases, step, new, noise)
    more = np.maximum(1e-3, cases.damping * 10)
    damping = np.where(accept, less, more)
    balanced = moved.at.size <= cases.floor
    damping = np.where(balanced, 0.0, damping)  # the next step uses the bare stiffness
    moved = replace(moved, damping=damping)
    still = step.length < 1e-9 * robot.size_m
    return moved, _ended(cases, moved, step, accept & still)


def _stepped(robot: Robot, cases: _Cases, step: "_Step") -> tuple[Floats, Floats]:
    """Poses after steps."""
    move = step.move * robot.edge_scale[:, None]
    x = cases.x + move[:3]
    if robot.degrees == 3:
        return x, cases.R
    return x, turning.compose(move[3:], cases.R)


def _leads_down(robot: Robot, cases: _Cases, step: "_Step", new: "_Point", noise: Floats) -> Bools:
    """(n,) Which steps lower the energy as they should, or the imbalance where the energy no longer tells."""
    before = cases.at
    lower = new.energy <= before.energy + 1e-4 * step.downhill + noise
    short = step.length < 1e-3 * robot.size_m
    nearer = (new.size < 0.5 * before.size) & short
    return lower | (cases.newton(step) & nearer)


def _ended(cases: _Cases, moved: _Cases, step: "_Step", hardly_moves: Bools) -> Ints:
    """(n,) How cases ended that moved on by a step; `_GOING_ON` where they did not."""
    balanced = moved.at.size <= cases.floor
    undamped = cases.damping == 0
    ends = {
        NO_EQUILIBRIUM: np.abs(moved.x).max(axis=0) > _FAR * cases.span,
        FOUND: cases.newton(step) & (balanced | hardly_moves),
        NOT_HELD: balanced & ~step.positive & undamped,
        NOT_CONVERGED: moved.damping > 1e12,
    }
    return np.select(list(ends.values()), list(ends), _GOING_ON)


@dataclass(frozen=True)
class _Step:
    """Damped Newton steps of n cases.

    Attributes
    ----------
    move : (d, n) array
        Rotations in metres at the platform's edge.
    length : (n,) array
    positive : (n,) bool array
        Whether the damped stiffness is positive definite.
    downhill : (n,) array
        Change of energy along it, to first order.
    """

    move: Floats
    length: Floats
    positive: Bools
    downhill: Floats


def _newton_step(robot: Robot, cases: _Cases) -> _Step:
    """Steps of all cases; one across the room is no Newton step: it is cut, the direction kept."""
    gradient = cases.at.gradient
    step, positive = _downhill_or_off_saddle(robot, cases)
    np.clip(step, -1e100, 1e100, out=step)  # the square of a step along no stiffness at all would overflow
    length = np.sqrt((step * step).sum(0))
    longest = np.where(positive, 0.25 * _FAR * cases.span, _LOOSE * cases.span)
    cut = np.minimum(1.0, longest / np.maximum(length, 1e-300))
    step *= cut
    return _Step(step, length * cut, positive, (gradient * step).sum(0))


def _downhill_or_off_saddle(robot: Robot, cases: _Cases) -> tuple[Floats, Bools]:
    """Whole damped steps ``(d, n)``, and where the damped stiffness is positive definite; else off the saddle."""
    gradient = cases.at.gradient
    damped = cases.at.H.copy()
    for i in range(robot.degrees):
        damped[i, i] += cases.damping * cases.level
    step, positive = cholesky.solve_symmetric(damped, -gradient)
    saddle = np.flatnonzero(~positive)
    if saddle.size:
        level, floor = cases.level[saddle], cases.floor[saddle]
        step[:, saddle] = off_saddle(damped[..., saddle], gradient[:, saddle], level, floor)
    return step, positive


def _calmer(cases: _Cases, step: _Step, new: "_Point", noise: Floats) -> Floats:
    """(n,) damping after steps that led down: back towards pure Newton where the energy fell as predicted."""
    predicted = 0.5 * (cases.damping * cases.level * step.length * step.length - step.downhill)
    as_predicted = cases.at.energy - new.energy > 0.5 * predicted - noise
    less = np.where(cases.damping < 2e-5, 0.0, cases.damping / 100)
    return np.where(as_predicted, less, cases.damping)


@dataclass(frozen=True)
class _Point:
    """Energy, gradient and Hessian at a batch of poses, rotations scaled to metres."""

    energy: Floats
    gradient: Floats
    H: Floats
    tau: Floats
    size: Floats

    def where(self, accept: Bools, other: "_Point") -> "_Point":
        if accept.all():
            return other
        chosen = {}
        for field in fields(_Point):
            chosen[field.name] = np.where(accept, getattr(other, field.name), getattr(self, field.name))
        return _Point(**chosen)

    def part(self, keep: Indices) -> "_Point":
        return last_axis_of(self, keep)


def _evaluate(robot: Robot, wires: Wires, zero: Floats, offset: Floats, x: Floats, R: Floats) -> _Point:
    shape = statics.geometry(robot, x, R)
    stretched = statics.stretched(robot, shape, offset)
    tau, slope = tension(wires, stretched, zero)
    derivatives = statics.unbalance_and_stiffness(robot, shape, R, tau, slope)
    gradient, H = in_metres(*derivatives, robot.edge_scale[:, None])
    elastic = energy(wires, stretched, zero).sum(0)
    potential = robot.mass_kg * GRAVITY * _height_of_mass(robot, x, R)
    size = np.abs(gradient).max(0)
    return _Point(elastic + potential, gradient, H, tau, size)


def _height_of_mass(robot: Robot, x: Floats, R: Floats) -> Floats:
    """(n,) Height of the centre of mass."""
    height = x[2]
    if robot.degrees == 6:
        a, b, c = robot.centre_of_mass_m
        above = R[2, 0] * a + R[2, 1] * b + R[2, 2] * c
        height = height + above
    return height
