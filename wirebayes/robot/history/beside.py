"""Columns of wires side by side: draws, and the line without errors that the running estimate carries with them."""

from dataclasses import replace

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion.creep import CreepState


def beside(first: Wires, other: Wires) -> Wires:
    """Columns of wires of one model side by side."""
    theta = {}
    counts = (first.count, other.count)
    for name, value in first.theta.items():
        rows = max(len(value), len(other.theta[name]))
        both = [np.broadcast_to(v, (rows, n)) for v, n in zip((value, other.theta[name]), counts, strict=True)]
        theta[name] = np.concatenate(both, 1)
    return replace(first, theta=theta)


def beside_fresh(carried: CreepState, legs: int) -> CreepState:
    """What columns of wires carry, and beside it that of a column which never crept."""

    def one_more(values: Floats | float, last: Floats | float = 0.0) -> Floats:
        whole = np.broadcast_to(values, carried.creep_mm.shape)
        column = np.broadcast_to(last, (legs, 1))
        return np.concatenate([whole, column], 1)

    past = []
    for start, amount, k2 in carried.past:
        past.append((start, one_more(amount), one_more(k2, k2[:, :1])))
    return replace(
        carried,
        creep_mm=one_more(carried.creep_mm),
        beside_mm={key: one_more(value) for key, value in carried.beside_mm.items()},
        past=tuple(past),
        elongation_mm=one_more(carried.elongation_mm),
    )
