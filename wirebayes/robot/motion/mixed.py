"""Newton's method on poses and tensions together, which converges alike for soft and for stiff wires.

Where tensions are computed from a pose, an error of the pose of second order is an error of the tensions by as much
times the stiffness: steps then shorten as wires get stiffer. Here the tensions are unknowns of their own, as in mixed
finite elements. Which wires are taut is found with each step: about a pose the energy is a piecewise quadratic of the
displacement, whose minimum Newton's method finds in as many steps as sets of taut wires are passed.
"""

from dataclasses import dataclass

import numpy as np

from wirebayes.numeric import cholesky
from wirebayes.numeric.rows import last_axis_of
from wirebayes.numeric.typing import Bools, Floats, Indices
from wirebayes.robot.mechanics import rotation as turning
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import Lengths, Poses, Robot
from wirebayes.robot.mechanics.wires import Wires, stretched_length, tension

_SETS = 40  # of taut wires tried in a step; one or two are usual
_HALVINGS = 30  # of the way along a direction, to the lowest point on it
_STEPS = 8  # of Newton's method; two or three are usual
_NEAR = 1e-6  # of the platform's size: after so short a step the next would be lost in rounding
_BARELY = 1e-9  # strain at which a slack wire's stiffness is taken


def newton_step_with_tensions(
    robot: Robot, wires: Wires, pose: Poses, tension_N: Floats, lengths: Lengths
) -> tuple[Floats, Floats]:
    """One step of poses and tensions towards equilibrium at lengths.

    Parameters
    ----------
    robot : Robot
    wires : Wires
        ``n`` draws.
    pose : (position, rotation)
        (n, 3), m, and (n, 3, 3).
    tension_N : (n, w) array
        Tensions that go with the poses; they need not be those of the lengths.
    lengths : (zero, offset)
        Zero-tension lengths (n, w) and lengths beyond the exit points, m.

    Returns
    -------
    step : (n, 6 or 3) array
        Displacement, m, then turn in metres at the platform's edge; NaN where no set of taut wires is a minimum.
    tension_N : (n, w) array
        After the step.
    """
    energy = _energy(robot, wires, pose, tension_N.T, lengths)
    return _lowest(energy, tension_N.T > 0)


def _energy(robot: Robot, wires: Wires, pose: Poses, tau: Floats, lengths: Lengths) -> "_Quadratic":
    """The energy about poses, its wires' tangents at tensions ``(w, n)``."""
    position, rotation = pose
    turn = rotation.transpose(1, 2, 0)
    scale = robot.edge_scale[:, None]
    shape = statics.geometry(robot, position.T, turn)
    _, K = statics.unbalance_and_stiffness(robot, shape, turn, tau, np.zeros_like(tau))
    K *= scale[:, None] * scale.T[..., None]
    J = statics.wire_jacobian(robot, shape) * scale[:, None]
    load = -statics.weight(robot, turn) * scale
    pull, slope = _tangent(robot, wires, shape, tau, lengths)
    return _Quadratic(K, J, load, pull, slope)


def _tangent(
    robot: Robot, wires: Wires, shape: statics.Geometry, tau: Floats, lengths: Lengths
) -> tuple[Floats, Floats]:
    """What wires would pull at poses by their tangents, and by how much that grows along a step: ``(w, n)``."""
    zero = lengths[0].T
    offset = np.broadcast_to(lengths[1], lengths[0].shape).T
    carried = stretched_length(wires, zero, tau)
    barely_taut = np.maximum(carried, zero * (1.0 + _BARELY))
    _, slope = tension(wires, barely_taut, zero)
    beyond = statics.stretched(robot, shape, offset) - carried
    return tau + slope * beyond, slope


@dataclass(frozen=True)
class _Quadratic:
    """Energy about ``n`` poses: quadratic where the same wires are taut.

    Attributes
    ----------
    K : (d, d, n) array
        Stiffness without the wires' own.
    J : (d, w, n) array
        Growth of the stretched lengths with a displacement.
    load : (d, n) array
        Of the platform.
    pull, slope : (w, n) arrays
        Tension at no displacement, below zero where a wire is slack, and its growth by the stretched length.
    """

    K: Floats
    J: Floats
    load: Floats
    pull: Floats
    slope: Floats

    def part(self, rows: Indices) -> "_Quadratic":
        return last_axis_of(self, rows)

    def tensions(self, move: Floats) -> Floats:
        """(w, n) below zero where a wire is slack."""
        return self.pull + self.slope * (self.J * move[:, None]).sum(0)

    def unbalance(self, move: Floats) -> Floats:
        """(d, n) the energy's slope."""
        pulled = (self.J * np.maximum(self.tensions(move), 0.0)).sum(1)
        return self.load + (self.K * move).sum(1) + pulled

    def least_with(self, taut: Bools) -> tuple[Floats, Bools]:
        """Where the energy would be least if just these wires were taut, and whether it would."""
        stiff = np.where(taut, self.slope, 0.0)
        at_rest = np.where(taut, self.pull, 0.0)
        hessian = self.K + np.einsum("iwn,jwn->ijn", self.J * stiff, self.J)
        gradient = self.load + (self.J * at_rest).sum(1)
        return cholesky.solve_symmetric(hessian, -gradient)


def _lowest(energy: _Quadratic, taut: Bools) -> tuple[Floats, Floats]:
    """Displacements ``(n, d)`` of least energy, and the tensions ``(n, w)`` there.

    Parameters
    ----------
    energy : _Quadratic
    taut : (w, n) bool array
        The first guess.
    """
    step = np.full(energy.load.shape, np.nan)
    tau = np.full(taut.shape, np.nan)
    here = np.zeros(energy.load.shape)
    rows = np.arange(taut.shape[1])
    for _ in range(_SETS):
        there, positive = energy.least_with(taut)
        pull = energy.tensions(there)
        as_assumed = ((pull > 0) == taut).all(0)
        settled = positive & as_assumed
        done = rows[settled]
        step[:, done] = there[:, settled]
        tau[:, done] = np.maximum(pull[:, settled], 0.0)
        left = np.flatnonzero(positive & ~settled)
        if not left.size:
            break
        rows = rows[left]
        energy = energy.part(left)
        here = _lowest_between(energy, here[:, left], there[:, left])
        taut = energy.tensions(here) > 0
    return step.T, tau.T


def _lowest_between(energy: _Quadratic, here: Floats, there: Floats) -> Floats:
    """The lowest points of the straight ways from displacements to others."""
    way = there - here
    return here + _share(energy, here, way) * way


def _share(energy: _Quadratic, here: Floats, way: Floats) -> Floats:
    """How much of a way ``(d, n)`` leads to its lowest point: ``(n,)``, 0 to 1."""
    low, high = np.zeros(here.shape[1]), np.ones(here.shape[1])
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        down = _falls(energy, here + middle * way, way)
        low, high = np.where(down, middle, low), np.where(down, high, middle)
    whole = _falls(energy, here + way, way)
    return np.where(whole, 1.0, low)


def _falls(energy: _Quadratic, there: Floats, way: Floats) -> Bools:
    """(n,) Whether the energy still falls along a way, at displacements on it."""
    return (energy.unbalance(there) * way).sum(0) <= 0


def approach(robot: Robot, wires: Wires, pose: Poses, tension_N: Floats, lengths: Lengths) -> tuple[Poses, Floats]:
    """Poses near equilibrium at lengths, and the first step towards them.

    Parameters
    ----------
    robot, wires, pose, tension_N, lengths
        As for `newton_step_with_tensions`.

    Returns
    -------
    pose : (position, rotation)
        Where no step leads on, the last that was reached.
    ahead : (n, 6 or 3) array
        As `newton_step_with_tensions` gives it.
    """
    ahead, tau = newton_step_with_tensions(robot, wires, pose, tension_N, lengths)
    x, R = after_step(robot, pose, ahead)
    rows = np.arange(len(x))
    step = ahead
    for _ in range(_STEPS):
        further = _goes_on(robot, step)
        rows = rows[further]
        if not rows.size:
            break
        here = x[rows], R[rows]
        own_wires = wires.part(rows)
        own_lengths = _rows_of(lengths, rows)
        step, tau = newton_step_with_tensions(robot, own_wires, here, tau[further], own_lengths)
        x[rows], R[rows] = after_step(robot, here, step)
    return (x, R), ahead


def _rows_of(lengths: Lengths, rows: Indices) -> Lengths:
    zero, offset = lengths
    return zero[rows], np.broadcast_to(offset, zero.shape)[rows]


def _goes_on(robot: Robot, step: Floats) -> Bools:
    """(n,) After which steps another one is worth its while."""
    length = np.linalg.norm(step, axis=1)
    return (length > _NEAR * robot.size_m) & (length < robot.span_m)


def after_step(robot: Robot, pose: Poses, step: Floats) -> Poses:
    """Poses after small steps.

    Parameters
    ----------
    robot : Robot
    pose : (position, rotation)
        (n, 3), m, and (n, 3, 3).
    step : (n, 6 or 3) array
        Displacement, m, then turn in metres at the platform's edge; a NaN moves nothing.

    Returns
    -------
    position : (n, 3) array
    rotation : (n, 3, 3) array
    """
    position, rotation = pose
    step = np.where(np.isfinite(step), step, 0.0)
    moved = position + step[:, :3]
    if robot.degrees == 3:
        return moved, np.array(rotation)
    turn = turning.compose(step[:, 3:].T / robot.size_m, rotation.transpose(1, 2, 0))
    return moved, turn.transpose(2, 0, 1)
