"""Forward kinematics: zero-tension lengths and joint values to the pose of equilibrium, many at once.

An equilibrium is a minimum of the potential energy of weight and wires, slack wires storing none. Newton's method on
that energy, damped where the Hessian is not positive definite or the energy would rise, finds it from any start.
"""

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wirebayes.numeric import cholesky
from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics import rotation as turning
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import GRAVITY, Robot
from wirebayes.robot.mechanics.wires import Wires, energy, tension
from wirebayes.robot.motion import one_sided
from wirebayes.robot.motion.balance import in_metres

FOUND, NOT_CONVERGED, NO_EQUILIBRIUM, NOT_HELD, FELL = 0, 1, 2, 3, 4
_GOING_ON = -1  # of a case that is still being solved
STATUS = {
    FOUND: "stable equilibrium",
    NOT_CONVERGED: "not converged",
    NO_EQUILIBRIUM: "no equilibrium: the wires cannot carry the platform",
    NOT_HELD: "in balance, but free to move or about to fall: no isolated stable pose",
    FELL: "fell: the equilibrium that was followed lost its stability",
}
_CHUNK, _QUICK = 2048, 7
_LOOSE = 0.1  # of the robot's size with its wires: the longest step where the curvature does not bound one


@dataclass(frozen=True)
class Equilibria:
    """Solutions of ``n`` forward problems.

    Attributes
    ----------
    position_m : (n, 3) array
    rotation : (n, 3, 3) array
    tension_N : (n, w) array
        Zero for slack wires.
    status : (n,) int array
        `FOUND`, `NOT_CONVERGED`, `NO_EQUILIBRIUM` or `NOT_HELD`; poses mean something where found only. `FELL` is set
        by those who follow an equilibrium (`path`), never here.
    iterations : (n,) int array
    residual_N : (n,) array
        Largest force left over (moments divided by the platform's size).
    """

    position_m: Floats
    rotation: Floats
    tension_N: Floats
    status: NDArray[np.int64]
    iterations: NDArray[np.int64]
    residual_N: Floats

    @property
    def found(self) -> NDArray[np.bool_]:
        """(n,) True where a stable equilibrium was found."""
        return np.asarray(self.status == FOUND)


def solve_equilibrium(
    robot: Robot,
    wires: Wires,
    zero_m: Floats,
    offset_m: Floats,
    start_m: Floats,
    start_rotation: Floats,
    max_iterations: int = 200,
) -> Equilibria:
    """Find the equilibrium reached downhill from each start.

    Parameters
    ----------
    robot : Robot
    wires : Wires
    zero_m : (n, w) array
        Zero-tension length of every wire, creep included. Rows with NaN are not solved.
    offset_m : (n, w) or (w,) array
        Stretched length that is not between exit and platform point: wire beyond the exit point, and ``r q``.
    start_m : (n, 3) or (3,) array
    start_rotation : (n, 3, 3) or (3, 3) array

    Returns
    -------
    Equilibria
    """
    n = len(zero_m)
    finite = [np.isfinite(zero_m), np.isfinite(np.broadcast_to(offset_m, zero_m.shape))]
    finite.append(np.isfinite(np.broadcast_to(start_m, (n, 3))))
    sane = np.flatnonzero(np.logical_and.reduce([f.all(1) for f in finite]))
    if len(sane) < n:
        offsets = np.broadcast_to(offset_m, zero_m.shape)[sane]
        x, R = np.broadcast_to(start_m, (n, 3))[sane], np.broadcast_to(start_rotation, (n, 3, 3))[sane]
        return put_back(
            solve_equilibrium(robot, wires.part(sane), zero_m[sane], offsets, x, R, max_iterations), sane, n
        )
    if not n:
        return put_back(None, sane, 0, robot.legs)
    # Counted from the middle of the exit points, so that nothing depends on where the robot's origin is.
    middle = robot.exit_m.mean(0)
    robot = replace(robot, exit_m=robot.exit_m - middle)
    position = np.array(np.broadcast_to(start_m, (n, 3)).T) - middle[:, None]
    rotation = np.array(np.moveaxis(np.broadcast_to(start_rotation, (n, 3, 3)), 0, -1))
    zero = np.ascontiguousarray(zero_m.T)
    offset = np.ascontiguousarray(np.broadcast_to(offset_m, zero_m.shape).T)
    quick = min(_QUICK, max_iterations)
    at, turn, tau, status, count, left = _in_chunks(robot, wires, zero, offset, position, rotation, quick)
    slow = np.flatnonzero(status == NOT_CONVERGED)
    if slow.size and max_iterations > quick:
        # The few slow cases of all chunks go on together: small arrays waste the machine.
        part = wires.part(slow), zero[:, slow], offset[:, slow], at[:, slow], turn[..., slow]
        rest = _in_chunks(robot, *part, max_iterations - quick)
        at[:, slow], turn[..., slow], tau[:, slow], status[slow], left[slow] = *rest[:4], rest[5]
        count[slow] += rest[4]
    if robot.pulleys is not None:  # inside a pulley there is no wire, and no equilibrium to be found
        status[(status == FOUND) & ~statics.geometry(robot, at, turn).clear] = NOT_CONVERGED
    found = Equilibria(at.T + middle, np.moveaxis(turn, -1, 0), tau.T, status, count, left)
    loose = np.flatnonzero(status == NOT_HELD)
    if loose.size:  # by wires that are taut; those that are just not slack may hold it yet
        pose = at[:, loose].T, found.rotation[loose]
        held = one_sided.held(robot, wires.part(loose), pose, (zero[:, loose].T, offset[:, loose].T))
        status[loose[held]] = FOUND
    return found


def put_back(found: Equilibria | None, rows: NDArray[np.intp], n: int, legs: int = 0) -> Equilibria:
    """Solutions put back among rows that could not be tried.

    Parameters
    ----------
    found : Equilibria or None
        Solutions of the rows that were tried; None where none was.
    rows : int array
        Where they stand among all.
    n : int
        Number of all rows.
    legs : int
        Needed where `found` is None.

    Returns
    -------
    Equilibria
        Of n rows; those not tried are NaN and not converged.
    """
    if found is not None:
        legs = found.tension_N.shape[1]
    whole = Equilibria(
        np.full((n, 3), np.nan),
        np.full((n, 3, 3), np.nan),
        np.full((n, legs), np.nan),
        np.full(n, NOT_CONVERGED),
        np.zeros(n, np.int64),
        np.full(n, np.inf),
    )
    if found is not None:
        for field in fields(Equilibria):
            getattr(whole, field.name)[rows] = getattr(found, field.name)
    return whole


def _in_chunks(
    robot: Robot, wires: Wires, zero: Floats, offset: Floats, x: Floats, R: Floats, max_iterations: int
) -> list[NDArray[Any]]:
    parts = []
    for first in range(0, zero.shape[1], _CHUNK):
        cut = slice(first, first + _CHUNK)
        part = wires.part(cut), zero[:, cut], offset[:, cut], x[:, cut], R[..., cut]
        parts.append(_solve(robot, *part, max_iterations))
    return [np.concatenate(arrays, -1) for arrays in zip(*parts, strict=True)]


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

    number: NDArray[np.intp]
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

    def part(self, keep: NDArray[np.intp]) -> "_Cases":
        return _Cases(
            number=self.number[keep],
            wires=self.wires.part(keep),
            zero=self.zero[:, keep],
            offset=self.offset[:, keep],
            x=self.x[:, keep],
            R=self.R[..., keep],
            at=self.at.part(keep),
            damping=self.damping[keep],
            level=self.level[keep],
            floor=self.floor[keep],
            span=self.span[keep],
        )


def _solve(
    robot: Robot, wires: Wires, zero: Floats, offset: Floats, x: Floats, R: Floats, max_iterations: int
) -> tuple[NDArray[Any], ...]:
    """One chunk; solved cases leave the batch as they finish."""
    n = zero.shape[1]
    out_x, out_R, out_tau = np.array(x), np.array(R), np.zeros_like(zero)
    status, count, left = np.full(n, NOT_CONVERGED), np.zeros(n, np.int64), np.full(n, np.inf)

    def store(cases: _Cases) -> None:
        out_x[:, cases.number], out_R[..., cases.number] = cases.x, cases.R
        out_tau[:, cases.number], left[cases.number] = cases.at.tau, cases.at.size

    scale = np.ones((robot.degrees, 1))
    scale[3:] = 1.0 / robot.size_m  # rotations are stepped in metres at the platform's edge
    cases = _begin(robot, wires, zero, offset, x, R, scale)
    for iteration in range(1, max_iterations + 1):
        cases, ended = _iterate(robot, cases, scale)
        count[cases.number] = iteration
        finished = ended != _GOING_ON
        if finished.any():
            store(cases.part(np.flatnonzero(finished)))
            status[cases.number[finished]] = ended[finished]
            cases = cases.part(np.flatnonzero(~finished))
        if not cases.number.size:
            break
    if cases.number.size:
        store(cases)
    return out_x, out_R, out_tau, status, count, left


def _begin(robot: Robot, wires: Wires, zero: Floats, offset: Floats, x: Floats, R: Floats, scale: Floats) -> _Cases:
    """All cases at their starts, undamped."""
    n = zero.shape[1]
    k1 = np.broadcast_to(wires.theta["k1"], (robot.legs, n))
    # S/ℓ - 1 is known to one rounding error. Moments are divided by the platform's size; points far from the reference
    # point make more of the same error.
    arm = max(1.0, np.abs(robot.platform_m).max() / robot.size_m) if robot.degrees == 6 else 1.0
    floor = 32 * np.finfo(float).eps * arm * (np.max(k1, axis=0) * robot.lines.max() + robot.mass_kg * GRAVITY)
    level = np.sum(k1 * robot.lines[:, None] ** 2 / zero, axis=0)
    at = _evaluate(robot, wires, zero, offset, x, R, scale)
    return _Cases(np.arange(n), wires, zero, offset, x, R, at, np.zeros(n), level, floor, robot.span_m + zero.max(0))


def _iterate(robot: Robot, cases: _Cases, scale: Floats) -> tuple[_Cases, NDArray[np.int64]]:
    """A damped Newton step of every case, taken where it leads down, and how it ended (`_GOING_ON` if it did not)."""
    at, damping, level, size = cases.at, cases.damping, cases.level, robot.size_m
    reach = 10.0 * cases.span
    damped = at.H.copy()
    for i in range(robot.degrees):
        damped[i, i] += damping * level
    step, positive = cholesky.solve_symmetric(damped, -at.gradient)
    indefinite = np.flatnonzero(~positive)
    if indefinite.size:
        part = damped[..., indefinite], at.gradient[:, indefinite], level[indefinite], cases.floor[indefinite]
        step[:, indefinite] = _off_saddle(*part)
    np.clip(step, -1e100, 1e100, out=step)  # the square of a step along no stiffness at all would overflow
    length = np.sqrt((step * step).sum(0))
    # A step across the room is no Newton step; it is cut, the direction kept.
    longest = np.where(positive, 0.25 * reach, _LOOSE * cases.span)
    cut = np.minimum(1.0, longest / np.maximum(length, 1e-300))
    step *= cut
    length *= cut
    new_x = cases.x + step[:3] * scale[:3]
    new_R = turning.compose(step[3:] * scale[3:], cases.R) if robot.degrees == 6 else cases.R
    new = _evaluate(robot, cases.wires, cases.zero, cases.offset, new_x, new_R, scale)
    downhill = (at.gradient * step).sum(0)
    noise = 1e-14 * (np.abs(at.energy) + robot.mass_kg * GRAVITY * cases.span)
    accept = new.energy <= at.energy + 1e-4 * downhill + noise
    accept |= positive & (damping == 0) & (new.size < 0.5 * at.size) & (length < 1e-3 * size)
    # Uphill: shorter, more cautious steps; as predicted: back towards pure Newton.
    predicted = 0.5 * (damping * level * length * length - downhill)
    as_predicted = at.energy - new.energy > 0.5 * predicted - noise
    calmer = np.where(as_predicted, np.where(damping < 2e-5, 0.0, damping / 100), damping)
    x, R = np.where(accept, new_x, cases.x), np.where(accept, new_R, cases.R)
    at = at.where(accept, new)
    balanced = at.size <= cases.floor
    done = positive & (damping == 0) & (balanced | (accept & (length < 1e-9 * size)))
    loose = balanced & ~positive & (damping == 0)
    next_damping = np.where(accept, calmer, np.maximum(1e-3, damping * 10))
    next_damping = np.where(balanced, 0.0, next_damping)  # so that the next step uses the bare stiffness
    lost, stuck = np.abs(x).max(0) > reach, next_damping > 1e12
    ended = np.select([lost, done, loose, stuck], [NO_EQUILIBRIUM, FOUND, NOT_HELD, NOT_CONVERGED], _GOING_ON)
    return replace(cases, x=x, R=R, at=at, damping=next_damping), ended


def _off_saddle(H: Floats, gradient: Floats, level: Floats, floor: Floats) -> Floats:
    """Newton's step with every curvature taken as positive: away from a saddle, twice as far each time.

    Shifting the whole Hessian until it is positive instead takes ever smaller steps the nearer the saddle is.

    Parameters
    ----------
    H : (d, d, n) array
        Only the upper triangle is read.
    gradient : (d, n) array
    level : (n,) array
        The stiffness if every wire were taut; less than its rounding is none.
    floor : (n,) array
        Force below which none can be trusted: it leads nowhere.

    Returns
    -------
    (d, n) array
        NaN where the stiffness has overflowed: no step from there is better.
    """
    finite = np.isfinite(H).all((0, 1))
    curvature, along = np.linalg.eigh(np.moveaxis(np.where(finite, H, 0.0), -1, 0), UPLO="U")
    slope = np.einsum("nij,in->nj", along, gradient)
    slope = np.where(np.abs(slope) > floor[:, None], slope, 0.0)
    stiffness = np.maximum(np.abs(curvature), np.finfo(float).eps * level[:, None])
    step = -np.einsum("nij,nj->in", along, slope / stiffness)
    return np.where(finite, step, np.nan)


@dataclass(frozen=True)
class _Point:
    """Energy, gradient and Hessian at a batch of poses, rotations scaled to metres."""

    energy: Floats
    gradient: Floats
    H: Floats
    tau: Floats
    size: Floats

    def where(self, accept: NDArray[np.bool_], other: "_Point") -> "_Point":
        if accept.all():
            return other
        return _Point(*(np.where(accept, getattr(other, f.name), getattr(self, f.name)) for f in fields(_Point)))

    def part(self, keep: NDArray[np.intp]) -> "_Point":
        return _Point(*(getattr(self, f.name)[..., keep] for f in fields(_Point)))


def _evaluate(robot: Robot, wires: Wires, zero: Floats, offset: Floats, x: Floats, R: Floats, scale: Floats) -> _Point:
    shape = statics.geometry(robot, x, R)
    S = statics.stretched(robot, shape, offset)
    tau, slope = tension(wires, S, zero)
    gradient, H = in_metres(*statics.unbalance_and_stiffness(robot, shape, R, tau, slope), scale)
    height = x[2]
    if robot.degrees == 6:
        c = robot.centre_of_mass_m
        height = height + (R[2, 0] * c[0] + R[2, 1] * c[1] + R[2, 2] * c[2])
    total = energy(wires, S, zero).sum(0) + robot.mass_kg * GRAVITY * height
    return _Point(total, gradient, H, tau, np.abs(gradient).max(0))
