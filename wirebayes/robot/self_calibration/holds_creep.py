"""Creep of a session's holds under the tensions of a state."""

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.motion import inverse
from wirebayes.robot.self_calibration import observability
from wirebayes.robot.self_calibration.equations import Holds, State, moved
from wirebayes.robot.self_calibration.strain import Grown, grown
from wirebayes.robot.self_calibration.unknowns import Unknowns


def creep_of(unknowns: Unknowns, holds: Holds, state: State) -> Grown:
    """Creep under the tensions of a state.

    Parameters
    ----------
    unknowns : Unknowns
    holds : Holds
    state : State
    """
    response = _response(unknowns, holds, state)
    return grown(unknowns, state.white, state.pull_N, response, holds.session.duration_s)


def _response(unknowns: Unknowns, holds: Holds, state: State) -> Floats:
    """(p, w, w) change of the tensions with a strain of the wires."""
    parts = unknowns.parts(state.white)
    robot = moved(unknowns.robot, parts)
    wires = unknowns.prior.wires(unknowns.robot, parts.wires[None])[0]
    bare, offset = inverse.lengths(robot, holds.session.joint_m)
    stretched = _way(robot, state, offset)
    zero = stretched / (1 + np.maximum(state.pull_N, 0.0) / wires.theta["k1"].T)
    change = observability.length_sensitivity(robot, wires, state.position_m, state.rotation, zero, offset)[1]
    answer = change * zero[:, None]
    # beyond these, a state is no equilibrium yet
    usual = np.abs(answer).max((1, 2)) <= 2 * np.max(wires.theta["k1"])
    return np.where(usual[:, None, None] & np.isfinite(answer).all((1, 2), keepdims=True), answer, 0.0)


def _way(robot: Robot, state: State, offset: Floats) -> Floats:
    shape = statics.geometry(robot, state.position_m.T, np.moveaxis(state.rotation, 0, -1))
    return statics.stretched(robot, shape, offset.T).T
