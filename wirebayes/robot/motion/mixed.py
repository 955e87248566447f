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
    zero, offset = lengths[0].T, np.broadcast_to(lengths[1], lengths[0].shape).T
    tau, R = tension_N.T, pose[1].transpose(1, 2, 0)
    scale = robot.edge_scale[:, None]
    shape = statics.geometry(robot, pose[0].T, R)
    _, K = statics.unbalance_and_stiffness(robot, shape, R, tau, np.zeros_like(tau))
    K *= scale[:, None] * scale.T[..., None]
    J = statics.wire_jacobian(robot, shape) * scale[:, None]
    load = -statics.weight(robot, R) * scale
    carried = stretched_length(wires, zero, tau)
    slope = tension(wires, np.maximum(carried, zero * (1.0 + _BARELY)), zero)[1]
    # What a wire would pull at the pose by its tangent, and by how much that grows along a step.
    pull = tau + slope * (statics.stretched(robot, shape, offset) - carried)
    return _lowest(_Quadratic(K, J, load, pull, slope), tau > 0)


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
        return np.asarray(self.pull + self.slope * (self.J * move[:, None]).sum(0))

    def unbalance(self, move: Floats) -> Floats:
        """(d, n) the energy's slope."""
        pulled = (self.J * np.maximum(self.tensions(move), 0.0)).sum(1)
        return np.asarray(self.load + (self.K * move).sum(1) + pulled)

    def least_with(self, taut: Bools) -> tuple[Floats, Bools]:
        """Where the energy would be least if just these wires were taut, and whether it would."""
        stiff, at_rest = np.where(taut, self.slope, 0.0), np.where(taut, self.pull, 0.0)
        H = self.K + np.einsum("iwn,jwn->ijn", self.J * stiff, self.J)
        return cholesky.solve_symmetric(H, -(self.load + (self.J * at_rest).sum(1)))


def _lowest(energy: _Quadratic, taut: Bools) -> tuple[Floats, Floats]:
    """Displacements ``(n, d)`` of least energy, and the tensions ``(n, w)`` there.

    Parameters
    ----------
    energy : _Quadratic
    taut : (w, n) bool array
        The first guess.
    """
    d, n = energy.load.shape
    step, tau = np.full((d, n), np.nan), np.full(taut.shape, np.nan)
    rows, here = np.arange(n), np.zeros((d, n))
    for _ in range(_SETS):
        there, positive = energy.least_with(taut)
        settled = positive & ((energy.tensions(there) > 0) == taut).all(0)
        done = np.flatnonzero(settled)
        step[:, rows[done]] = there[:, done]
        tau[:, rows[done]] = np.maximum(energy.tensions(there), 0.0)[:, done]
        left = np.flatnonzero(positive & ~settled)
        if not left.size:
            break
        rows, energy, here, there = rows[left], energy.part(left), here[:, left], there[:, left]
        here = here + _share(energy, here, there - here) * (there - here)
        taut = energy.tensions(here) > 0
    return step.T, tau.T


def _share(energy: _Quadratic, here: Floats, way: Floats) -> Floats:
    """How much of a way ``(d, n)`` leads to its lowest point: ``(n,)``, 0 to 1."""
    low, high = np.zeros(here.shape[1]), np.ones(here.shape[1])
    whole = (energy.unbalance(here + way) * way).sum(0) <= 0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        down = (energy.unbalance(here + middle * way) * way).sum(0) <= 0
        low, high = np.where(down, middle, low), np.where(down, high, middle)
    return np.where(whole, 1.0, low)


def approach(
    robot: Robot, wires: Wires, pose: Poses, tension_N: Floats, lengths: Lengths
) -> tuple[tuple[Floats, Floats], Floats]:
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
    step, rows = ahead, np.arange(len(x))
    for _ in range(_STEPS):
        length = np.linalg.norm(step, axis=1)
        further = (length > _NEAR * robot.size_m) & (length < robot.span_m)
        rows, tau = rows[further], tau[further]
        if not rows.size:
            break
        part = lengths[0][rows], np.broadcast_to(lengths[1], lengths[0].shape)[rows]
        step, tau = newton_step_with_tensions(robot, wires.part(rows), (x[rows], R[rows]), tau, part)
        x[rows], R[rows] = after_step(robot, (x[rows], R[rows]), step)
    return (x, R), ahead


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
    step = np.where(np.isfinite(step), step, 0.0)
    x = pose[0] + step[:, :3]
    if robot.degrees == 3:
        return x, np.array(pose[1])
    turn = turning.compose(step[:, 3:].T / robot.size_m, pose[1].transpose(1, 2, 0))
    return x, turn.transpose(2, 0, 1)
