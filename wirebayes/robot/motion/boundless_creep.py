"""Wires that would creep by more than their own length: refused before anything follows them there, which takes long.

Creep is a strain of a few per cent. One beyond the whole wire comes from a slip of units, or from a fit that is used at
tensions far above those that were tested; nothing is learnt from the way to where such wires end.
"""

import numpy as np

from wirebayes.errors import InputError
from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics import draws
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.draws import WireDraws
from wirebayes.robot.motion import inverse
from wirebayes.robot.motion.creep import HoldCreep, fresh
from wirebayes.sentences import lasting, number, short

_WHOLE = 1.0  # creep by a wire's own length, as a strain


def refuse_boundless_creep(robot: Robot, line: WireDraws, position_m: Floats, rotation: Floats, time_s: float) -> None:
    """Refuse wires that would creep by more than their own length while the platform is held at a pose.

    Parameters
    ----------
    robot : Robot
    line : WireDraws
        For every leg whose wire is not given in the robot's file.
    position_m, rotation : (3,), (3, 3) arrays
        A pose that no tensions hold is passed over: whoever solves for it says why.
    time_s : float
        How long the platform is held.

    Raises
    ------
    InputError
        Naming the wire, its creep, and the keys to check.
    """
    tension_N = inverse.tensions(robot, position_m[None], rotation[None])[0]
    if not np.isfinite(tension_N).all():
        return
    with np.errstate(over="ignore", invalid="ignore"):
        strain = _creep_strain(robot, line, tension_N, time_s)
    beyond = np.flatnonzero(strain > _WHOLE)
    if not beyond.size:
        return
    leg = int(beyond[0])
    where, advice = _whose(robot, line, leg)
    crept = f"wire {leg + 1} creeps by {number(100 * strain[leg])} % within {lasting(time_s)} at "
    raise InputError(f"{where}: {crept}{short(tension_N[leg], 3)} N, expected less than 100 %; {advice}")


def _creep_strain(robot: Robot, line: WireDraws, tension_N: Floats, time_s: float) -> Floats:
    """(w,) creep of mean wires as a strain after a time under tensions that stay."""
    wires = draws.for_robot(robot, line.centre())
    under = tension_N[:, None]
    crept = HoldCreep(wires, fresh(robot.legs, 1), under).advance(time_s, under)
    return crept.strain(wires)[:, 0]


def _whose(robot: Robot, line: WireDraws, leg: int) -> tuple[str, str]:
    """Where the parameters of a leg's wire stand, and what to look at."""
    name = robot.wire[leg]
    wire = draws.lines_of(robot, line)[leg].centre()
    values = f"B = {short(wire.parameters['B'][0], 4)} mm at a length of {short(wire.length_mm, 4)} mm"
    if name in robot.given:
        return f"{robot.name}, [wires.{name}], {values}", "are the units those of the keys?"
    return f"{robot.name}, the fitted wire, {values}", "were such tensions tested, and in newtons?"
