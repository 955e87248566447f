"""Creep of a session's holds under the tensions of a state, as fine as the session can tell."""

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics import statics
from wirebayes.robot.motion import forward, inverse
from wirebayes.robot.self_calibration import observability
from wirebayes.robot.self_calibration.equations import Holds, State, moved
from wirebayes.robot.self_calibration.residuals import joint_error
from wirebayes.robot.self_calibration.strain import Grown, grown, stretch
from wirebayes.robot.self_calibration.unknowns import Unknowns
from wirebayes.robot.self_calibration.within_holds import Loaded

ROUGHLY = 10.0  # times the usual error: what a state may have that will move on
_FINE, _ROUGH = 32, 8  # times in a hold at most: of a state that has come to rest, and of one that will move on
_BALANCED = 0.1  # of the largest tension: a state whose equilibrium pulls otherwise is still rough


def creep_of(unknowns: Unknowns, holds: Holds, state: State, known: Grown | None = None, roughly: float = 1.0) -> Grown:
    """Creep under the tensions of a state.

    Parameters
    ----------
    unknowns : Unknowns
    holds : Holds
    state : State
    known : Grown, optional
        Creep of a state near by: the search for tensions within the holds begins from its own.
    roughly : float
        Times the error that is usual: a state that will move on needs no better.
    """
    here = _Here(unknowns, holds, state)
    resolved = roughly * _resolution(unknowns, holds, here)
    finest = _FINE if roughly < ROUGHLY else _ROUGH

    def loaded(end_N: Floats) -> Loaded:
        return Loaded(end_N, here.response, holds.session.duration_s, resolved, finest, here.beyond)

    return grown(unknowns, state.white, state.pull_N, loaded, None if known is None else known.course)


def _resolution(unknowns: Unknowns, holds: Holds, here: "_Here") -> float:
    """What the session resolves of a tension, N: a reading's error, or what a joint value's makes of it."""
    read = bool(np.isfinite(holds.tension_N).any())
    if read and unknowns.errors.joint_m is None:
        return holds.session.tension_sd_N
    joint_m = joint_error(unknowns, holds)
    by_joint = float(np.median(here.wires.theta["k1"]) * joint_m / np.median(here.zero))
    return max(by_joint, holds.session.tension_sd_N) if read else by_joint


class _Here:
    """The equilibria of a state, and those of wires that are a little longer.

    Parameters
    ----------
    unknowns, holds, state
        As in `creep_of`.

    Attributes
    ----------
    response : (p, w, w) array
        Change of the tensions with a strain of the wires, N; none where a state is no equilibrium yet.
    """

    def __init__(self, unknowns: Unknowns, holds: Holds, state: State) -> None:
        parts = unknowns.parts(state.white)
        self.state, self.robot = state, moved(unknowns.robot, parts)
        self.wires = unknowns.prior.wires(unknowns.robot, parts.wires[None])[0]
        self.offset = inverse.lengths(self.robot, holds.session.joint_m)[1]
        shape = statics.geometry(self.robot, state.position_m.T, np.moveaxis(state.rotation, 0, -1))
        way = statics.stretched(self.robot, shape, self.offset.T).T
        self.zero = way / stretch(unknowns, state.white, state.pull_N).ratio
        pose = state.position_m, state.rotation
        change = observability.length_sensitivity(self.robot, self.wires, *pose, self.zero, self.offset)[1]
        answer = change * self.zero[:, None]
        usual = np.abs(answer).max((1, 2)) <= 2 * np.max(self.wires.theta["k1"])
        self.response = np.where(usual[:, None, None] & np.isfinite(answer).all((1, 2), keepdims=True), answer, 0.0)

    def beyond(self, ahead: Floats) -> Floats:
        """Tensions ``(p, t, w)`` of wires longer by strains, the last of which is none, beyond the response."""
        p, t, w = ahead.shape
        state, each = self.state, np.repeat(np.arange(p), t)
        zero = (self.zero[:, None] * (1 + ahead)).reshape(-1, w)
        pose = state.position_m[each], state.rotation[each]
        found = forward.solve_equilibrium(
            self.robot, self.wires.part(np.zeros(p * t, int)), zero, self.offset[each], *pose
        )
        tension = np.where(found.found[:, None], found.tension_N, np.nan).reshape(p, t, w)
        bend = tension - tension[:, -1:] - ahead @ self.response.swapaxes(1, 2)
        pull = np.maximum(state.pull_N, 0.0)
        balanced = np.abs(tension[:, -1] - pull).max(1) < _BALANCED * pull.max(1)
        return np.where(balanced[:, None, None] & np.isfinite(bend), bend, 0.0)
