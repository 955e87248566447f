"""Creep of a session's holds under the tensions of a state, along the equilibria that each hold passes."""

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.motion import forward, inverse
from wirebayes.robot.self_calibration import observability
from wirebayes.robot.self_calibration.equations import Holds, State, moved
from wirebayes.robot.self_calibration.strain import Course, Grown, grown, on_the_way, straight, stretch
from wirebayes.robot.self_calibration.unknowns import Unknowns

_BENDS = 2  # corrections of the tensions on the way: what is off in one hold is carried on into the next


def creep_of(unknowns: Unknowns, holds: Holds, state: State) -> Grown:
    """Creep under the tensions of a state.

    Parameters
    ----------
    unknowns : Unknowns
    holds : Holds
    state : State
    """
    duration = holds.session.duration_s
    course = straight(_response(unknowns, holds, state))
    if not unknowns.prior.creeps or unknowns.errors.joint_m is None:  # an error of the loops hides what is left
        return grown(unknowns, state.white, state.pull_N, course, duration)
    for _ in range(_BENDS):
        course = _bent(unknowns, holds, state, course)
    return grown(unknowns, state.white, state.pull_N, course, duration)


def _bent(unknowns: Unknowns, holds: Holds, state: State, course: Course) -> Course:
    """The course by the equilibria that every hold passes, which no straight line leads through where wires slacken."""
    parts = unknowns.parts(state.white)
    robot = moved(unknowns.robot, parts)
    end, ahead = on_the_way(unknowns, state.white, state.pull_N, course, holds.session.duration_s)
    p, shares, legs = ahead.shape
    wires = unknowns.prior.wires(unknowns.robot, parts.wires[None])[0]
    offset = inverse.lengths(robot, holds.session.joint_m)[1]
    zero = _way(robot, state, offset) / stretch(unknowns, state.white, state.pull_N).ratio

    def each(values: Floats) -> Floats:
        return np.repeat(values, shares, 0)

    begun = (zero[:, None] * (1 + ahead / (1 + end)[:, None])).reshape(-1, legs)
    row = np.zeros(p * shares, int)
    there = forward.solve(
        robot, wires.part(row), begun, each(np.broadcast_to(offset, zero.shape)), each(state.position_m),
        each(state.rotation),
    )  # fmt: skip
    tension = there.tension_N.reshape(p, shares, legs)
    line = np.maximum(state.pull_N, 0.0)[:, None] + np.einsum("pij,psj->psi", course.response_N, ahead)
    found = there.found.reshape(p, shares, 1) & np.isfinite(tension)
    return Course(course.response_N, np.where(found, tension - line, course.beyond_N))


def _response(unknowns: Unknowns, holds: Holds, state: State) -> Floats:
    """(p, w, w) change of the tensions with a strain of the wires."""
    parts = unknowns.parts(state.white)
    robot = moved(unknowns.robot, parts)
    wires = unknowns.prior.wires(unknowns.robot, parts.wires[None])[0]
    bare, offset = inverse.lengths(robot, holds.session.joint_m)
    stretched = _way(robot, state, offset)
    zero = stretched / (1 + np.maximum(state.pull_N, 0.0) / wires.theta["k1"].T)
    change = observability.sensitivity(robot, wires, state.position_m, state.rotation, zero, offset)[1]
    answer = change * zero[:, None]
    # beyond these, a state is no equilibrium yet
    usual = np.abs(answer).max((1, 2)) <= 2 * np.max(wires.theta["k1"])
    return np.where(usual[:, None, None] & np.isfinite(answer).all((1, 2), keepdims=True), answer, 0.0)


def _way(robot: Robot, state: State, offset: Floats) -> Floats:
    shape = statics.geometry(robot, state.position_m.T, np.moveaxis(state.rotation, 0, -1))
    return statics.stretched(robot, shape, offset.T).T
