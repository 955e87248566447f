"""A guaranteed box for the pose while all wires of one line change together, made of many small proofs."""

from dataclasses import dataclass

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion import forward
from wirebayes.robot.proof.certificate import Certificate, certify
from wirebayes.robot.proof.reach import Reach
from wirebayes.wire.laws import ElasticLaw


@dataclass(frozen=True)
class Enclosure:
    """Where the reference point is for every length between two sets.

    Attributes
    ----------
    proved : bool
    low_m, high_m : (3,) arrays
        NaN when not proved.
    proofs : int
        Pieces that were proved one by one.
    """

    proved: bool
    low_m: Floats
    high_m: Floats
    proofs: int


def enclose(
    robot: Robot,
    law: ElasticLaw,
    k1_N: float,
    zero_low_m: Floats,
    zero_high_m: Floats,
    offset_m: Floats,
    start_m: Floats,
    start_rotation: Floats,
    most: int = 2000,
) -> Enclosure:
    """Enclose the pose while the lengths run together from one set to the other (a shared draw: one unknown, not w).

    Each piece of the way is proved by `certificate.certify`; a piece that cannot be is halved. Where two pieces meet,
    the equilibrium of the one must be that of the other: a pose past a fall is no continuation.

    Parameters
    ----------
    robot : Robot
    law : {"hooke", "modified"}
    k1_N : float
    zero_low_m, zero_high_m, offset_m : (w,) arrays
    start_m, start_rotation : (3,), (3, 3) arrays
        Near the solution of the first lengths.
    most : int
        Proofs tried at most.
    """
    wires = Wires(law, "saturating", {"k1": np.full((1, 1), k1_N)}, np.full((robot.legs, 1), 1000.0))
    stiff = np.full(robot.legs, k1_N)
    pieces, low, high = [(0.0, 1.0)], np.full(3, np.inf), np.full(3, -np.inf)
    nothing = np.full(3, np.nan)
    begun = forward.solve_equilibrium(robot, wires, zero_low_m[None], offset_m, start_m, start_rotation)
    here = _upright(begun)
    tried = proved = 0
    while pieces:
        a, b = pieces.pop()
        tried += 1
        if tried > most:
            return Enclosure(False, nothing, nothing, proved)
        first, last = (zero_low_m + s * (zero_high_m - zero_low_m) for s in (a, b))
        middle = _upright(forward.solve_equilibrium(robot, wires, 0.5 * (first + last)[None], offset_m, *here))
        bounds = np.minimum(first, last), np.maximum(first, last)
        proof = certify(robot, law, (stiff, stiff), bounds, offset_m, *middle)
        if not (proof.proved and _inside(robot, proof, here)):
            # the earlier half next, so that each solution starts from its neighbour
            pieces += [(0.5 * (a + b), b), (a, 0.5 * (a + b))]
            continue
        here = _upright(forward.solve_equilibrium(robot, wires, last[None], offset_m, *middle))
        if not _inside(robot, proof, here):
            return Enclosure(False, nothing, nothing, proved)
        proved += 1
        x = middle[0]
        low, high = np.minimum(low, x - proof.radius_m[:3]), np.maximum(high, x + proof.radius_m[:3])
    return Enclosure(True, low, high, proved)


def _upright(found: forward.Equilibria) -> tuple[Floats, Floats]:
    left, _, right = np.linalg.svd(found.rotation[0])
    return found.position_m[0], left @ right


def _inside(robot: Robot, proof: Certificate, pose: tuple[Floats, Floats]) -> bool:
    """Whether a pose is in the box that holds one equilibrium only."""
    box = Reach(True, proof.centre_m, proof.rotation, proof.radius_m, proof.radius_m, np.zeros((robot.degrees, 1)))
    return box.holds(*pose, np.zeros(1), robot.size_m, 0.0)
