"""Creep of a session's holds under the tensions of a state, as fine as the session can tell."""

import numpy as np

from wirebayes.numeric.rows import chosen_rows
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


def creep_of(
    unknowns: Unknowns,
    holds: Holds,
    state: State,
    known: Grown | None = None,
    roughly: float = 1.0,
    each: bool = False,
) -> Grown:
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
    each : bool
        As for `strain.grown`.
    """
    here = _Here(unknowns, holds, state)
    resolved = roughly * _resolution(unknowns, holds, here)
    finest = _FINE if roughly < ROUGHLY else _ROUGH
    course = None if known is None else known.course

    def loaded(end_N: Floats) -> Loaded:
        return Loaded(end_N, here.response, holds.session.duration_s, resolved, finest, here.beyond)

    return grown(unknowns, state.white, state.pull_N, loaded, course, each)


def _resolution(unknowns: Unknowns, holds: Holds, here: "_Here") -> float:
    """What the session resolves of a tension, N: a reading's error, or what a joint value's makes of it."""
    sd_N = holds.session.tension_sd_N
    read = np.isfinite(holds.tension_N).any()
    if read and unknowns.errors.joint_m is None:
        return sd_N
    strain = joint_error(unknowns, holds) / np.median(here.zero)
    by_joint = float(np.median(here.wires.theta["k1"]) * strain)
    return max(by_joint, sd_N) if read else by_joint


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
        self.state = state
        self.robot = moved(unknowns.robot, parts)
        self.wires, _ = unknowns.prior.wires(unknowns.robot, parts.wires[None])
        _, self.offset = inverse.lengths(self.robot, holds.session.joint_m)
        stretched = statics.stretched_at(self.robot, state.position_m, state.rotation, self.offset)
        self.zero = stretched / stretch(unknowns, state.white, state.pull_N).ratio
        self.response = self._response()

    def _response(self) -> Floats:
        position = self.state.position_m
        rotation = self.state.rotation
        _, change = observability.length_sensitivity(self.robot, self.wires, position, rotation, self.zero, self.offset)
        by_strain = change * self.zero[:, None]
        stiffest = 2 * np.max(self.wires.theta["k1"])
        usual = np.abs(by_strain).max((1, 2)) <= stiffest
        finite = np.isfinite(by_strain).all((1, 2))
        return chosen_rows(usual & finite, by_strain, 0.0)

    def beyond(self, ahead: Floats) -> Floats:
        """Tensions ``(p, t, w)`` of wires longer by strains, the last of which is none, beyond the response."""
        p, t, _ = ahead.shape
        tension = self._tensions(ahead)
        at_end = tension[:, -1]
        bend = tension - at_end[:, None] - ahead @ self.response.mT
        pull = np.maximum(self.state.pull_N, 0.0)
        imbalance = np.abs(at_end - pull).max(1)
        balanced = imbalance < _BALANCED * pull.max(1)
        counts = balanced[:, None, None] & np.isfinite(bend)
        return np.where(counts, bend, 0.0)

    def _tensions(self, ahead: Floats) -> Floats:
        """Tensions at the equilibria of wires longer by strains ``(p, t, w)``; NaN where there is none."""
        p, t, w = ahead.shape
        hold = np.repeat(np.arange(p), t)
        zero = self.zero[:, None] * (1 + ahead)
        wires = self.wires.part(np.zeros(p * t, int))
        position = self.state.position_m[hold]
        rotation = self.state.rotation[hold]
        found = forward.solve_equilibrium(self.robot, wires, zero.reshape(-1, w), self.offset[hold], position, rotation)
        tension = np.where(found.found[:, None], found.tension_N, np.nan)
        return tension.reshape(p, t, w)
