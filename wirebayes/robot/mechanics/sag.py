"""Sag to first order: what a wire's own weight does, which the statics leaves out.

A wire of weight ``w`` by length, chord ``L`` and horizontal share ``c`` of its direction hangs ``w c L² / 8 T`` below
the chord and is longer than it by ``L (w c L / T)² / 24``, while ``w L / T`` is small [1]_.

References
----------
.. [1] H. M. Irvine, *Cable Structures*, MIT Press 1981, ch. 2.
"""

import numpy as np

from wirebayes.notice import Notice
from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics.description import GRAVITY, Robot
from wirebayes.robot.mechanics.statics import geometry
from wirebayes.sentences import counted, short

# Weight by tension from which on sag is reported: a level wire is then longer than its chord by a ten-thousandth, as
# much as minutes of creep.
_REPORTED = 0.05


def sag(robot: Robot, position_m: Floats, rotation: Floats, tension_N: Floats) -> tuple[Floats, Floats, Floats]:
    """Weight by tension ``w L / T``, depth below the chord and extra length of every wire, ``(w,)``, 1, m and m.

    Parameters
    ----------
    robot : Robot
    position_m, rotation : (3,), (3, 3) arrays
    tension_N : (w,) array
    """
    mass = np.zeros(robot.legs) if robot.mass_kg_m is None else robot.mass_kg_m
    shape = geometry(robot, position_m[:, None], rotation[..., None])
    length, direction = shape.distance_m[:, 0], shape.direction[:, :, 0]
    level = np.hypot(direction[0], direction[1])
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(mass > 0, mass * GRAVITY * length / tension_N, 0.0)
    return share, share * level * length / 8.0, length * (share * level) ** 2 / 24.0


def sag_warnings(robot: Robot, position_m: Floats, rotation: Floats, tension_N: Floats) -> list[Notice]:
    """A sentence on the wire whose own weight matters most, where any does.

    Parameters
    ----------
    robot : Robot
    position_m : (3,) array
    rotation : (3, 3) array
        The pose.
    tension_N : (w,) array
        Of every wire there.

    Returns
    -------
    list of Notice
        Empty where no wire's weight matters.
    """
    share, depth, extra = sag(robot, position_m, rotation, tension_N)
    heavy = np.flatnonzero(share > _REPORTED)
    if not heavy.size:
        return []
    i = int(heavy[np.argmax(extra[heavy])])
    others = ""
    if heavy.size > 1:
        others = (
            f"; {counted(heavy.size - 1, 'more wire')} weigh{'s' * (heavy.size == 2)} more than {100 * _REPORTED:g} %"
        )
    text = (
        f"wire {i + 1} weighs {short(100 * share[i], 2)} % of its tension: it sags by {short(1e3 * depth[i], 2)} mm "
        f"and is {short(1e3 * extra[i], 2)} mm longer than the straight line it is taken for{others}"
    )
    return [Notice("sag", text)]
