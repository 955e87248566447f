"""What tension readings determine about zero-tension lengths: sensitivities, rank, a sentence, and better poses."""

from dataclasses import dataclass

import numpy as np

from wirebayes.numeric.batches import batch_first, batch_last
from wirebayes.numeric.linear_algebra import solve
from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.wires import Wires, tension
from wirebayes.sentences import short


def response(
    robot: Robot, wires: Wires, position_m: Floats, rotation: Floats, zero_m: Floats, offset_m: Floats
) -> tuple[Floats, Floats, Floats]:
    """How an equilibrium answers when wires pull differently, in closed form.

    Parameters
    ----------
    robot : Robot
    wires : Wires
        ``n`` draws, or one.
    position_m, rotation : (n, 3), (n, 3, 3) arrays
        Poses of equilibrium.
    zero_m, offset_m : (n, w) arrays

    Returns
    -------
    motion : (n, 6 or 3, w) array
        Small motion when a wire's law gives 1 N more at the same stretched length: m and rad.
    change : (n, w, w) array
        Change of all tensions, that newton included.
    by_zero : (n, w) array
        Change of a wire's tension with its zero-tension length at the same stretched length, N/m.
    """
    turn, zero = batch_last(rotation), zero_m.T
    shape = statics.geometry(robot, position_m.T, turn)
    stretched = statics.stretched(robot, shape, offset_m.T)
    tau, slope = tension(wires, stretched, zero)
    _, hessian = statics.unbalance_and_stiffness(robot, shape, turn, tau, slope)
    J = batch_first(statics.wire_jacobian(robot, shape))
    moves = -solve(batch_first(hessian), J)
    motion = np.asarray(moves, np.float64)
    lengthening = J.mT @ motion
    by_lengthening = slope.T[:, :, None] * lengthening
    change = by_lengthening + np.eye(robot.legs)
    # The tension depends on stretched / zero alone under either law, so its slope by zero follows from the other.
    by_zero = -slope * stretched / zero
    return motion, np.asarray(change), by_zero.T


def length_sensitivity(
    robot: Robot, wires: Wires, position_m: Floats, rotation: Floats, zero_m: Floats, offset_m: Floats
) -> tuple[Floats, Floats]:
    """Small motion and change of the tensions per metre of zero-tension length.

    Parameters
    ----------
    robot : Robot
    wires : Wires
    position_m : (n, 3) array
    rotation : (n, 3, 3) array
        Poses of equilibrium.
    zero_m : (n, w) array
        Zero-tension lengths, creep included.
    offset_m : (n, w) or (w,) array
        Length beyond the exit points.

    Returns
    -------
    motion : (n, 6 or 3, w) array
    change : (n, w, w) array
        N/m.
    """
    motion, change, by_zero = response(robot, wires, position_m, rotation, zero_m, offset_m)
    return motion * by_zero[:, None], change * by_zero[:, None]


@dataclass(frozen=True)
class Observability:
    """The combinations of lengths that the readings show.

    Attributes
    ----------
    rank : int
        Combinations whose standard error is below a tenth of the prior one.
    sd_m : (w,) array
        Standard error of each length given prior and readings.
    weakest : (w,) array
        Unit combination that the readings show least.
    weakest_sd_m : float
        Its standard error from the readings alone.
    sentence : str
    """

    rank: int
    sd_m: Floats
    weakest: Floats
    weakest_sd_m: float
    sentence: str


def observe(
    change_N: Floats, tension_sd_N: float, prior_sd_m: float, bias_sd_N: float = 0.0, sign: Floats | None = None
) -> Observability:
    """Observability of the lengths from tensions at several poses.

    Parameters
    ----------
    change_N : (p, w, w) array
        From `length_sensitivity`, a pose a row.
    tension_sd_N : float
    prior_sd_m : float
    bias_sd_N : float
        Of a bias of each sensor, which the readings show only against each other.
    sign : (p, w) array, optional
        How the bias enters each reading; default: as a constant.
    """
    legs = change_N.shape[-1]
    if sign is None:
        sign = np.ones(change_N.shape[:2])
    information = _information(change_N, tension_sd_N, bias_sd_N, sign)
    if not np.isfinite(information).all():
        sentence = "What the readings show cannot be computed at these poses: nothing holds the platform there."
        return Observability(0, np.full(legs, prior_sd_m), np.full(legs, np.nan), np.inf, sentence)
    return _observed(information, prior_sd_m)


def _observed(information: Floats, prior_sd_m: float) -> Observability:
    """Observability by what the readings say of the lengths, ``(w, w)``, 1/m²."""
    values, vectors = np.linalg.eigh(information)
    alone = 1.0 / np.sqrt(np.maximum(values, 1e-300))
    rank = int((alone < 0.1 * prior_sd_m).sum())
    # by eigenvectors: where some combinations are known absurdly well, information and prior have no inverse in floats
    total = np.maximum(values, 0.0) + prior_sd_m**-2
    sd = np.sqrt((vectors**2 / total).sum(axis=1))
    weakest = _largest_positive(vectors[:, 0])
    sentence = _sentence(rank, weakest, min(alone[0], prior_sd_m))
    return Observability(rank, sd, weakest, float(alone[0]), sentence)


def _largest_positive(direction: Floats) -> Floats:
    """The direction or its opposite, whose largest component is positive."""
    largest = direction[np.argmax(np.abs(direction))]
    return direction * np.sign(largest)


def _information(change_N: Floats, tension_sd_N: float, bias_sd_N: float, sign: Floats) -> Floats:
    """What readings of all poses say of the lengths, their constant or signed biases eliminated: ``(w, w)``, 1/m²."""
    information = (change_N.mT @ change_N).sum(0) / tension_sd_N**2
    if bias_sd_N > 0:
        mixed = (sign[:, :, None] * change_N).sum(0) / tension_sd_N**2
        own = (sign**2).sum(0) / tension_sd_N**2 + 1.0 / bias_sd_N**2
        information = information - mixed.T @ (mixed / own[:, None])
    return information


def _sentence(rank: int, weakest: Floats, known_m: float) -> str:
    parts = []
    for i in np.argsort(-np.abs(weakest)):
        if abs(weakest[i]) > 0.2:
            parts.append(f"{weakest[i]:+.2f} of wire {i + 1}")
    seen = f"The readings show {rank} of {len(weakest)} combinations of lengths to a tenth of their prior uncertainty"
    return f"{seen}; least of all {', '.join(parts)}, known to {short(1e3 * known_m, 2)} mm."


def choose_poses(change_N: Floats, count: int, tension_sd_N: float, prior_sd_m: float) -> list[int]:
    """Poses that together shrink the lengths' joint uncertainty most, chosen one after another.

    Parameters
    ----------
    change_N : (c, w, w) array
        Sensitivities at candidate poses.
    count : int

    Returns
    -------
    list of int
        Indices of candidates; a pose may be worth repeating.
    """
    information = change_N.mT @ change_N / tension_sd_N**2
    total = np.eye(change_N.shape[-1]) / prior_sd_m**2
    chosen: list[int] = []
    if not len(information):
        return chosen
    for _ in range(count):
        together = total + information
        _, gain = np.linalg.slogdet(together)
        best = int(np.argmax(gain))
        chosen.append(best)
        total = together[best]
    return chosen
