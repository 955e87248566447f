"""Sag to first order: what a wire's own weight does, which the statics leaves out.

A wire of weight ``w`` by length, chord ``L`` and horizontal share ``c`` of its direction hangs ``w c L² / 8 T`` below
the chord and is longer than it by ``L (w c L / T)² / 24``, while ``w L / T`` is small [1]_.

References
----------
.. [1] H. M. Irvine, *Cable Structures*, MIT Press 1981, ch. 2.
"""

import numpy as np

from wirebayes.numeric.typing import Bools, Floats
from wirebayes.result_warnings import Notice
from wirebayes.robot.mechanics.description import GRAVITY, Robot
from wirebayes.robot.mechanics.statics import geometry
from wirebayes.sentences import counted, short

# Weight by tension from which on sag is reported: a level wire is then longer than its chord by a ten-thousandth, as
# much as minutes of creep.
_REPORTED = 0.05
# Least mass by length and highest tension: of the lightest ropes, Dyneema, at a fifth of the tension that breaks them
# (2 mm: 2.3 g/m, 4.1 kN). A rope of steel has ten times as much.
_LIGHTEST_KG_M_N = 2.8e-6
_ROUNDING = 1e-9  # of the largest tension: one so small is none
_SMALL = 1.0  # weight by tension up to which the first order says how a wire hangs


def sag(robot: Robot, position_m: Floats, rotation: Floats, tension_N: Floats) -> tuple[Floats, Floats, Floats]:
    """Weight by tension ``w L / T``, depth below the chord and extra length of every wire, ``(w,)``, 1, m and m.

    A wire whose mass is not stated has that of the lightest rope for the robot's highest tension. One that is slack, to
    rounding, does not count.

    Parameters
    ----------
    robot : Robot
    position_m, rotation : (3,), (3, 3) arrays
    tension_N : (w,) array
    """
    shape = geometry(robot, position_m[:, None], rotation[..., None])
    length = shape.distance_m[:, 0]
    direction = shape.direction[:, :, 0]
    level = np.hypot(direction[0], direction[1])
    weight_N = _mass_kg_m(robot) * GRAVITY * length
    taut = tension_N > _ROUNDING * tension_N.max()
    share = np.where(taut, weight_N / np.where(taut, tension_N, 1.0), 0.0)
    depth_m = share * level * length / 8.0
    extra_m = length * (share * level) ** 2 / 24.0
    return share, depth_m, extra_m


def _stated(robot: Robot) -> Bools:
    """(w,) whether a wire's mass is in the robot's file."""
    return np.zeros(robot.legs, bool) if robot.mass_kg_m is None else robot.mass_kg_m > 0


def _mass_kg_m(robot: Robot) -> Floats:
    """(w,) mass of every wire by length, as stated or of the lightest rope."""
    lightest = np.full(robot.legs, _LIGHTEST_KG_M_N * robot.rule.highest_N)
    return lightest if robot.mass_kg_m is None else np.where(_stated(robot), robot.mass_kg_m, lightest)


def sag_warnings_of_poses(robot: Robot, position_m: Floats, rotation: Floats, tension_N: Floats) -> list[Notice]:
    """`sag_warnings` for the middle tension of every wire, at the pose where the heaviest has about that tension.

    Parameters
    ----------
    robot : Robot
    position_m : (p, 3) array
    rotation : (p, 3, 3) array
    tension_N : (p, w) array
        One that errors of a sensor took below zero, or of a wire that is slack for once, is not the middle.
    """
    placed = np.isfinite(position_m).all(1) & np.isfinite(rotation).all((1, 2)) & np.isfinite(tension_N).all(1)
    if not placed.any():
        return []
    position_m, rotation, tension_N = position_m[placed], rotation[placed], tension_N[placed]
    middle_N = np.median(tension_N, axis=0)
    taut = middle_N > 0
    heaviest = int(np.argmax(np.where(taut, _mass_kg_m(robot) / np.where(taut, middle_N, 1.0), 0.0)))
    k = int(np.argmin(np.abs(tension_N[:, heaviest] - middle_N[heaviest])))
    return sag_warnings(robot, position_m[k], rotation[k], middle_N)


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
        verb = "weighs" if heavy.size == 2 else "weigh"
        others = f"; {counted(heavy.size - 1, 'more wire')} {verb} more than {100 * _REPORTED:g} %"
    weighs = f"wire {i + 1} weighs"
    if not _stated(robot)[i]:
        lightest = short(1e3 * _mass_kg_m(robot)[i], 2)
        weighs = (
            f"no mass_kg_m above 0 is stated of wire {i + 1}, and even the lightest rope for tension.highest_N, of "
            f"{lightest} g/m, weighs"
        )
    if share[i] > _SMALL:
        hangs = "more than it is pulled with: it hangs in an arc, far from the straight line it is taken for"
    else:
        percent = short(100 * share[i], 2)
        depth_mm = short(1e3 * depth[i], 2)
        extra_mm = short(1e3 * extra[i], 2)
        hangs = (
            f"{percent} % of its tension: it sags by {depth_mm} mm and is {extra_mm} mm longer than the straight line "
            "it is taken for"
        )
    return [Notice("sag", f"{weighs} {hangs}{others}")]
