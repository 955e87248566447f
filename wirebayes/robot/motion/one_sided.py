"""Stiffness of a platform on wires of which some are just not slack: they resist one way only.

A wire at its zero-tension length adds to the energy where a displacement stretches it, and nothing where it slackens:
to second order the energy is a quadratic form in each cone of displacements that stretch the same wires. An equilibrium
is stable where every displacement raises it. The form is continuously differentiable across the cones, so that its
minimum on the unit sphere is an eigenvector of the form that adds all wires of one set: trying every set finds it.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np

from wirebayes.numeric.batches import batch_first, batch_last
from wirebayes.numeric.typing import Bools, Floats
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import Lengths, Poses, Robot
from wirebayes.robot.mechanics.wires import Wires, tension

TOUCHING = 1e-9  # strain from zero within which a wire is neither taut nor slack: a nanometre a metre
# Of the stiffness: added so that no two of its eigenvalues are alike. Symmetric robots have whole planes of
# eigenvectors, of which the one that matters would have to be looked for.
_APART = 1e-9


def lowest_stiffness(robot: Robot, wires: Wires, pose: Poses, lengths: Lengths) -> Floats:
    """Least stiffness against any displacement, rotations in metres at the platform's edge.

    Parameters
    ----------
    robot : Robot
    wires : Wires
        ``n`` draws.
    pose : (position, rotation)
        (n, 3), m, and (n, 3, 3).
    lengths : (zero, offset)
        Zero-tension lengths (n, w) and lengths beyond the exit points, m.

    Returns
    -------
    (n,) array
        N/m; an equilibrium is stable where it is above zero. NaN where there is no pose.
    """
    return _bounds(robot, wires, pose, lengths)[1]


def held(robot: Robot, wires: Wires, pose: Poses, lengths: Lengths) -> Bools:
    """Whether wires that are just not slack make balances stable that the taut ones alone leave loose, ``(n,)``.

    Parameters
    ----------
    robot, wires, pose, lengths
        As for `lowest_stiffness`.
    """
    touching, least, largest = _bounds(robot, wires, pose, lengths)
    return touching & (least > _APART * largest)


def _bounds(robot: Robot, wires: Wires, pose: Poses, lengths: Lengths) -> tuple[Bools, Floats, Floats]:
    """Where any wire is just not slack, and least and largest stiffness, ``(n,)`` each; NaN where there is no pose."""
    balance = _Balance.at(robot, wires, pose, lengths)
    both = balance.two_way()
    one_way = balance.one_way()
    values = np.asarray(np.linalg.eigvalsh(both), np.float64)
    least = values[:, 0].copy()
    largest = values[:, -1]
    position, _ = pose
    known = np.isfinite(position).all(axis=1)
    decided = known & np.isfinite(one_way).all(axis=(0, 1))
    touched = np.asarray(balance.touching.any(axis=0))
    small = least <= _APART * largest
    for k in np.flatnonzero(decided & touched & small):
        touching = one_way[:, balance.touching[:, k], k]
        least[k] = _least_of(both[k], touching)
    return touched, np.where(known, least, np.nan), largest


@dataclass(frozen=True)
class _Balance:
    """Wires at equilibria, batch-last.

    Attributes
    ----------
    touching : (w, n) bool array
        Which wires are just not slack.
    """

    robot: Robot
    wires: Wires
    shape: statics.Geometry
    turn: Floats
    zero: Floats
    stretched: Floats
    touching: Bools

    @classmethod
    def at(cls, robot: Robot, wires: Wires, pose: Poses, lengths: Lengths) -> "_Balance":
        position, rotation = pose
        zero, offset = lengths
        turn = batch_last(rotation)
        shape = statics.geometry(robot, position.T, turn)
        beyond = np.broadcast_to(offset, zero.shape).T
        stretched = statics.stretched(robot, shape, beyond)
        strain = stretched / zero.T - 1.0
        return cls(robot, wires, shape, turn, zero.T, stretched, np.abs(strain) < TOUCHING)

    def two_way(self) -> Floats:
        """(n, d, d) form of the taut wires, which resist both ways."""
        tau, slope = tension(self.wires, self.stretched, self.zero)
        taut_N = np.where(self.touching, 0.0, tau)
        taut_slope = np.where(self.touching, 0.0, slope)
        _, stiffness = statics.unbalance_and_stiffness(self.robot, self.shape, self.turn, taut_N, taut_slope)
        return _at_edge(self.robot, stiffness)

    def one_way(self) -> Floats:
        """(d, w, n) what each wire would add as soon as it is taut, as numbers whose squares are added."""
        just_taut = np.maximum(self.stretched, self.zero * (1.0 + TOUCHING))
        _, slope = tension(self.wires, just_taut, self.zero)
        J = statics.wire_jacobian(self.robot, self.shape)
        return J * self.robot.edge_scale[:, None, None] * np.sqrt(slope)


def _at_edge(robot: Robot, stiffness: Floats) -> Floats:
    """(n, d, d) stiffnesses (d, d, n) with rotations in metres at the platform's edge; zero where there is none."""
    scale = robot.edge_scale[:, None]
    first = batch_first(stiffness)
    finite = np.where(np.isfinite(first), first, 0.0)
    return finite * (scale * scale.T)


def _least_of(both: Floats, one_way: Floats) -> Floats:
    """Least value on the unit sphere of a quadratic form with squares that count where they are of positive numbers.

    Parameters
    ----------
    both : (d, d) array
        Of the form.
    one_way : (d, m) array
        Of the numbers.
    """
    tried = _directions(both, one_way)
    stretch = np.maximum(tried @ one_way, 0.0)
    squares = (stretch**2).sum(axis=1)
    form = np.einsum("vi,ij,vj->v", tried, both, tried)
    return np.asarray((form + squares).min())


def _directions(both: Floats, one_way: Floats) -> Floats:
    """(v, d) either way along the axes of the form with every set of the squares, moved apart where they are alike."""
    d = len(both)
    size = np.abs(both).max() + (one_way**2).sum()
    noise = np.random.default_rng(0).standard_normal((d, d))
    apart = both + _APART * size * (noise + noise.T)
    _, vectors = np.linalg.eigh(apart + _of_every_set(one_way))
    return np.concatenate([vectors, -vectors], axis=-1).mT.reshape(-1, d)


def _of_every_set(one_way: Floats) -> Floats:
    """(2^m, d, d) forms that the numbers of every set of the m add."""
    sets = np.array(list(product((0.0, 1.0), repeat=one_way.shape[1])))
    return np.einsum("im,sm,jm->sij", one_way, sets, one_way)
