"""Every stable equilibrium of one set of lengths, as far as many starts find them."""

import numpy as np

from wirebayes.numeric.batches import batch_last
from wirebayes.numeric.rows import rows_of
from wirebayes.numeric.typing import Floats, Indices
from wirebayes.robot.mechanics import plane, statics
from wirebayes.robot.mechanics import rotation as turning
from wirebayes.robot.mechanics.description import Poses, Robot
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion.forward import Equilibria, solve_equilibrium

_MOST_STEPS = 400  # from a random start the way down is longer than from a pose nearby


def equilibria(
    robot: Robot,
    wires: Wires,
    zero_m: Floats,
    offset_m: Floats,
    rng: np.random.Generator,
    starts: int = 64,
    known: Poses | None = None,
) -> Equilibria:
    """Every stable equilibrium that many random starts find for one set of lengths.

    Parameters
    ----------
    robot : Robot
    wires : Wires
        Of one draw (``n`` = 1).
    zero_m, offset_m : (w,) arrays
    rng : numpy Generator
    starts : int
        Starting poses: anywhere below and among the exit points, any orientation.
    known : (3,), (3, 3) arrays, optional
        A pose to start from too: the commanded one, say, which few random starts may reach.

    Returns
    -------
    Equilibria
        Distinct ones, the lowest energy first.
    """
    position, rotation = _starts(robot, float(zero_m.max()), rng, starts, known)
    position, rotation = plane.onto(robot, position, rotation)
    same_length = np.broadcast_to(zero_m, (len(position), len(zero_m)))
    found = solve_equilibrium(robot, wires, same_length, offset_m, position, rotation, _MOST_STEPS)
    pose = found.position_m.T, batch_last(found.rotation)
    energy = statics.potential(robot, wires, *pose, zero_m[:, None], offset_m[:, None])
    good = np.flatnonzero(found.found)
    lowest_first = good[np.argsort(energy[good], kind="stable")]
    return rows_of(found, _distinct(robot, found, lowest_first))


def _starts(
    robot: Robot, longest_m: float, rng: np.random.Generator, count: int, known: Poses | None
) -> tuple[Floats, Floats]:
    """Poses anywhere below and among the exit points, the known one first."""
    low = robot.exit_m.min(0) - np.array([0.0, 0.0, 0.5 * longest_m])
    high = robot.exit_m.max(0)
    position = rng.uniform(low, high, (count, 3))
    rotation = np.broadcast_to(np.eye(3), (count, 3, 3))
    if robot.degrees == 6:
        rotation = turning.matrix(1.2 * rng.standard_normal((count, 3)))
    if known is None:
        return position, rotation
    known_position, known_rotation = known
    position = np.concatenate([known_position[None], position])
    return position, np.concatenate([known_rotation[None], rotation])


def _distinct(robot: Robot, found: Equilibria, order: Indices) -> Indices:
    """The poses, in an order, that no earlier one is near to, rotations being compared at the platform's edge."""
    near_m = 1e-6 * robot.span_m
    kept: list[int] = []
    for i in order:
        shift = np.abs(found.position_m[i] - found.position_m[kept]).max(1, initial=0.0)
        turn = robot.size_m * np.abs(found.rotation[i] - found.rotation[kept]).max((1, 2), initial=0.0)
        if (np.maximum(shift, turn) > near_m).all():
            kept.append(int(i))
    return np.array(kept, int)
