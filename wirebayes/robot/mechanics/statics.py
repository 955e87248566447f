"""Geometry, wrench and stiffness matrix of a platform on wires, in closed form.

Batch-last throughout: positions ``(3, n)``, rotations ``(3, 3, n)``, legs ``(w, n)``. A small motion is
``(displacement, rotation vector)`` of the reference point, both in the world's axes.
"""

from dataclasses import dataclass

import numpy as np

from wirebayes.numeric.batches import batch_last
from wirebayes.numeric.typing import Bools, Floats
from wirebayes.robot.mechanics.description import GRAVITY, Robot
from wirebayes.robot.mechanics.pulleys import WireRun, wire_run
from wirebayes.robot.mechanics.vectors import cross, norm
from wirebayes.robot.mechanics.wires import Wires, energy, tension

_NOWHERE = 1e-300  # m; a wire without length has no direction, and no pull
_SHORTEST = 1e-9  # m; across a taut wire the stiffness grows without end as that shortens


@dataclass(frozen=True)
class Geometry:
    """Where the wires run.

    Attributes
    ----------
    distance_m : (w, n)
        Along one line from exit point to platform point, with the arc on a pulley.
    direction : (3, w, n)
        Unit vectors along the wire to the platform point (a wire pulls the platform the other way).
    arm_m : (3, w, n)
        From the reference point to the platform points, in the world's axes.
    over : WireRun or None
        How the wires run over pulleys, where there are any.
    """

    distance_m: Floats
    direction: Floats
    arm_m: Floats
    over: WireRun | None = None

    @property
    def straight_m(self) -> Floats:
        """(w, n) Straight part of a line, which swings with its platform point."""
        return self.distance_m if self.over is None else self.over.straight_m

    @property
    def clear(self) -> Bools:
        """(n,) False where a platform point lies on an exit point, inside a pulley or on its swivel axis."""
        return np.asarray((self.distance_m > 0 if self.over is None else self.over.clear).all(0))


def turned(points_m: Floats, rotation: Floats) -> Floats:
    """Platform points ``(w, 3)`` in the world's axes, ``(3, w, n)``."""
    x, y, z = points_m.T[:, :, None]
    return rotation[:, 0, None] * x + rotation[:, 1, None] * y + rotation[:, 2, None] * z


def geometry(robot: Robot, position_m: Floats, rotation: Floats) -> Geometry:
    """Distances, directions and lever arms of the wires at poses, over pulleys where there are any.

    Parameters
    ----------
    robot : Robot
    position_m : (3, n) array
        Reference point of the platform.
    rotation : (3, 3, n) array

    Returns
    -------
    Geometry
    """
    arm = turned(robot.platform_m, rotation)
    line = position_m[:, None] + arm - robot.exit_m.T[:, :, None]
    if robot.pulleys is not None:
        over = wire_run(robot.pulleys, line)
        return Geometry(over.length_m, over.direction, arm, over)
    distance = norm(line)
    return Geometry(distance, line / np.maximum(distance, _NOWHERE), arm)


def geometry_at(robot: Robot, position_m: Floats, rotation: Floats) -> Geometry:
    """`geometry` at one pose.

    Parameters
    ----------
    robot : Robot
    position_m, rotation : (3,), (3, 3) arrays
    """
    return geometry(robot, position_m[:, None], rotation[..., None])


def jacobian(robot: Robot, shape: Geometry) -> Floats:
    """Change of the distances with a small motion, ``(6 or 3, w, n)``: rows ``u`` and ``r × u``."""
    J = _with_moments(robot, shape.direction, shape.arm_m)
    return J if robot.motions is None else np.einsum("ij,jwn->iwn", robot.motions, J)


def wire_jacobian(robot: Robot, shape: Geometry) -> Floats:
    """Change of the wires' lengths with a small motion, ``(6 or 3, w, n)``: of all the lines that each runs in."""
    return jacobian(robot, shape) * robot.lines[:, None]


def _with_moments(robot: Robot, u: Floats, r: Floats) -> Floats:
    """Vectors ``(3, w, n)`` at platform points with their moments about the reference point, as far as they count."""
    if robot.degrees == 3:
        return u
    out = np.empty((6, *u.shape[1:]), u.dtype)
    out[:3] = u
    out[3:] = cross(r, u)
    return out


def weight(robot: Robot, rotation: Floats) -> Floats:
    """Wrench of gravity about the reference point, ``(6 or 3, n)``: N and N m, as far as no plane takes it."""
    return at_centre_of_mass(robot, rotation, np.array([0.0, 0.0, -robot.mass_kg * GRAVITY]))


def at_centre_of_mass(robot: Robot, rotation: Floats, force_N: Floats) -> Floats:
    """Wrench about the reference point of a force at the centre of mass, ``(6 or 3, n)``, as far as no plane takes it.

    Parameters
    ----------
    robot : Robot
    rotation : (3, 3, n) array
    force_N : (3,) array
    """
    out = np.zeros((robot.degrees, rotation.shape[-1]))
    out[:3] = force_N[:, None]
    if robot.degrees == 6:
        arm = turned(robot.centre_of_mass_m[None], rotation)[:, 0]
        out[3:] = cross(arm, out[:3])
    return out if robot.motions is None else robot.motions @ out


def stretched_at(robot: Robot, position_m: Floats, rotation: Floats, offset_m: Floats) -> Floats:
    """`stretched` at poses, with the batch first.

    Parameters
    ----------
    robot : Robot
    position_m, rotation : (n, 3), (n, 3, 3) arrays
    offset_m : (n, w) array
        Length beyond the exit point.

    Returns
    -------
    (n, w) array
        m.
    """
    shape = geometry(robot, position_m.T, batch_last(rotation))
    return stretched(robot, shape, offset_m.T).T


def stretched(robot: Robot, shape: Geometry, offset_m: Floats) -> Floats:
    """Stretched length of every wire: its lines, and what lies beyond the exit point.

    Parameters
    ----------
    robot : Robot
    shape : Geometry
        What `geometry` returned for the poses.
    offset_m : (w, n) or (w, 1) array
        Length beyond the exit point; a linear actuator changes it.

    Returns
    -------
    (w, n) array
        m.
    """
    return robot.lines[:, None] * shape.distance_m + offset_m


def unbalance_and_stiffness(
    robot: Robot, shape: Geometry, rotation: Floats, tension_N: Floats, slope_N_m: Floats
) -> tuple[Floats, Floats]:
    """Gradient and Hessian of the potential energy by a small motion.

    Parameters
    ----------
    robot : Robot
    shape : Geometry
    rotation : (3, 3, n) array
    tension_N, slope_N_m : (w, n) arrays
        Tension and its slope by the stretched length.

    Returns
    -------
    gradient : (6 or 3, n) array
        Minus the net wrench.
    hessian : (6, 6, n) or (3, 3, n) array
        Stiffness matrix, its rotational block symmetrised (which it is by itself at an equilibrium).
    """
    J = jacobian(robot, shape)
    lines = robot.lines[:, None]
    pull = tension_N * lines
    beta = pull / np.maximum(shape.straight_m, _SHORTEST)
    alpha = slope_N_m * (lines * lines) - beta
    degrees = robot.degrees
    force = robot.mass_kg * GRAVITY
    gradient = (J * pull).sum(1)
    gradient[2] += force
    H = np.empty((degrees, degrees, pull.shape[-1]))
    for i in range(degrees):
        H[i, i:] = _upper_row(J, alpha, i)
    if shape.over is not None:
        side = _with_moments(robot, shape.over.across, shape.arm_m)
        swivel = pull * shape.over.swing_1_m
        for i in range(degrees):
            H[i, i:] += _upper_row(side, swivel, i)
    total = beta.sum(0)
    for i in range(3):
        H[i, i] += total
    if degrees == 6:
        arm = turned(robot.centre_of_mass_m[None], rotation)[:, 0]
        moment = force * arm
        gradient[3] += moment[1]
        gradient[4] -= moment[0]
        _add_rotation(shape, moment, pull, beta, H)
    for i in range(degrees):
        H[i + 1 :, i] = H[i, i + 1 :]
    if robot.motions is None:
        return gradient, H
    return _carried(robot, gradient, H)


def _upper_row(J: Floats, weight: Floats, i: int) -> Floats:
    """A row of the sum of weighted outer products of columns of `J`, from its diagonal on."""
    return (J[i] * weight * J[i:]).sum(1)


def _carried(robot: Robot, gradient: Floats, H: Floats) -> tuple[Floats, Floats]:
    """What a plane or a ball joint leaves of forces and stiffness; itself it is as stiff as the wires are at most."""
    P = robot.motions
    assert P is not None
    gradient = P @ gradient
    H = np.einsum("ij,jkn,kl->iln", P, H, P)
    size = np.ones(robot.degrees)
    size[3:] = robot.size_m**2
    stiffness = np.abs(np.einsum("iin->in", H)) / size[:, None]
    stiffest = stiffness[3:].max(0) if robot.freedom == "orientation" else stiffness[:3].max(0)
    return gradient, H + ((np.eye(robot.degrees) - P) * size)[..., None] * stiffest


def _add_rotation(shape: Geometry, moment: Floats, pull: Floats, beta: Floats, H: Floats) -> None:
    """Second-order terms of a rotation in the upper triangle: swinging wires, turning lever arms, turning weight.

    `moment` is the weight times the centre of mass's arm, ``(3, n)``.
    """
    r, u = shape.arm_m, shape.direction
    swung = beta * r
    _couple(swung.sum(1), H)
    q = pull * u - swung  # Σ τ u rᵀ - β r rᵀ in one outer product
    rows = []
    for component in q:
        rows.append((component * r).sum(1))
    outer = np.stack(rows)
    outer[2] += moment  # the weight, an arm of its own
    trace = outer[0, 0] + outer[1, 1] + outer[2, 2]
    twice = outer + outer.swapaxes(0, 1)
    turned_twice = 0.5 * twice
    for i in range(3):  # nothing is in the lower triangle yet, not even a number
        row = H[3 + i]
        row[3 + i :] += turned_twice[i, i:]
        row[3 + i] -= trace


def _couple(swung: Floats, H: Floats) -> None:
    """-Σβ[r]×, the coupling of displacement and rotation."""
    x, y, z = swung
    H[0, 4] += z
    H[0, 5] -= y
    H[1, 3] -= z
    H[1, 5] += x
    H[2, 3] += y
    H[2, 4] -= x


def stiffness(
    robot: Robot, wires: Wires, position_m: Floats, rotation: Floats, zero_m: Floats, offset_m: Floats
) -> Floats:
    """Stiffness matrices at poses, about the reference point.

    Parameters
    ----------
    robot : Robot
    wires : Wires
    position_m : (3, n) array
    rotation : (3, 3, n) array
    zero_m : (w, n) array
        Zero-tension lengths, creep included.
    offset_m : (w, n) or (w, 1) array
        Length beyond the exit points.

    Returns
    -------
    (n, 6, 6) or (n, 3, 3) array
        N/m, N and N m.
    """
    shape = geometry(robot, position_m, rotation)
    tau, slope = tension(wires, stretched(robot, shape, offset_m), zero_m)
    _, H = unbalance_and_stiffness(robot, shape, rotation, tau, slope)
    return np.moveaxis(H, -1, 0)


def potential(
    robot: Robot, wires: Wires, position_m: Floats, rotation: Floats, zero_m: Floats, offset_m: Floats
) -> Floats:
    """Potential energy of wires and weight; its minima are the stable equilibria.

    Parameters
    ----------
    robot, wires, position_m, rotation, zero_m, offset_m
        As for `stiffness`.

    Returns
    -------
    (n,) array
        J.
    """
    shape = geometry(robot, position_m, rotation)
    elastic = energy(wires, stretched(robot, shape, offset_m), zero_m).sum(0)
    height = position_m[2]
    if robot.degrees == 6:
        height = height + np.einsum("jn,j->n", rotation[2], robot.centre_of_mass_m)
    return elastic + robot.mass_kg * GRAVITY * height
