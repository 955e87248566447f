"""Forward kinematics: zero-tension lengths and joint values to the pose of equilibrium, many at once.

An equilibrium is a minimum of the potential energy of weight and wires, slack wires storing none. Newton's method on
that energy, damped where the Hessian is not positive definite or the energy would rise, finds it from any start.
"""

from dataclasses import dataclass, replace

import numpy as np

from wirebayes.numeric.batches import batch_first, batch_last
from wirebayes.numeric.rows import pair_at, put_rows
from wirebayes.numeric.typing import Bools, Floats, Indices, Ints
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import Lengths, Poses, Robot
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion import downhill, one_sided, outcome


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
    status: Ints
    iterations: Ints
    residual_N: Floats

    @property
    def poses(self) -> Poses:
        """Positions and rotations, as functions of the robot take them together."""
        return self.position_m, self.rotation

    @property
    def found(self) -> Bools:
        """(n,) True where a stable equilibrium was found."""
        return self.status == outcome.FOUND


def solve_equilibrium(
    robot: Robot,
    wires: Wires,
    zero_m: Floats,
    offset_m: Floats,
    start_m: Floats,
    start_rotation: Floats,
    max_iterations: int = 200,
    leash_m: Floats | float = np.inf,
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
    max_iterations : int
    leash_m : (n,) array or float
        How far from its start an equilibrium is looked for, rotations counted at the platform's edge; what strays
        farther is not followed to where it would end.

    Returns
    -------
    Equilibria
    """
    n = len(zero_m)
    offset_m = np.broadcast_to(offset_m, zero_m.shape)
    start_m = np.broadcast_to(start_m, (n, 3))
    start_rotation = np.broadcast_to(start_rotation, (n, 3, 3))
    finite = [np.isfinite(values).all(1) for values in (zero_m, offset_m, start_m)]
    sane = np.flatnonzero(np.logical_and.reduce(finite))
    if not len(sane):
        return put_back(None, sane, n, robot.legs)
    all_are_sane = len(sane) == n
    own_wires = wires if all_are_sane else wires.part(sane)
    lengths = pair_at((zero_m, offset_m), sane)
    start = pair_at((start_m, start_rotation), sane)
    leash = np.broadcast_to(leash_m, (n,))[sane]
    found = _solved(robot, own_wires, lengths, start, max_iterations, leash)
    return found if all_are_sane else put_back(found, sane, n)


def _solved(
    robot: Robot, wires: Wires, lengths: Lengths, start: Poses, max_iterations: int, leash_m: Floats
) -> Equilibria:
    """The equilibria of finite lengths."""
    # Counted from the middle of the exit points, so that nothing depends on where the robot's origin is.
    middle = robot.exit_m.mean(0)
    robot = replace(robot, exit_m=robot.exit_m - middle)
    position = np.array(start[0].T) - middle[:, None]
    rotation = np.array(batch_last(start[1]))
    zero = np.ascontiguousarray(lengths[0].T)
    offset = np.ascontiguousarray(lengths[1].T)
    solved = downhill.lead_downhill(robot, wires, zero, offset, position, rotation, max_iterations, leash_m)
    _look_again(robot, wires, zero, offset, solved)
    return Equilibria(
        solved.x.T + middle, batch_first(solved.R), solved.tau.T, solved.status, solved.count, solved.left
    )


def _look_again(robot: Robot, wires: Wires, zero: Floats, offset: Floats, solved: downhill.Solved) -> None:
    """Take back balances inside a pulley, where there is no wire, and take in poses that wires hold one-sidedly."""
    if robot.pulleys is not None:
        clear = statics.geometry(robot, solved.x, solved.R).clear
        inside = (solved.status == outcome.FOUND) & ~clear
        solved.status[inside] = outcome.NOT_CONVERGED
    loose = np.flatnonzero(solved.status == outcome.NOT_HELD)
    if loose.size:  # by wires that are taut; those that are just not slack may hold it yet
        pose = solved.x[:, loose].T, batch_first(solved.R[..., loose])
        lengths = zero[:, loose].T, offset[:, loose].T
        held = one_sided.held(robot, wires.part(loose), pose, lengths)
        solved.status[loose[held]] = outcome.FOUND


def put_back(found: Equilibria | None, rows: Indices, n: int, legs: int = 0) -> Equilibria:
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
        np.full(n, outcome.NOT_CONVERGED),
        np.zeros(n, np.int64),
        np.full(n, np.inf),
    )
    if found is not None:
        put_rows(whole, rows, found)
    return whole
