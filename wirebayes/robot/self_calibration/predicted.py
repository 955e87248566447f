"""What any unknowns predict of a session: its readings, poses and lengths, and what the wires carry out of it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from wirebayes.numeric.typing import Bools, Floats
from wirebayes.robot.mechanics.description import GRAVITY, Poses, Robot
from wirebayes.robot.motion import forward
from wirebayes.robot.motion.creep import CreepState
from wirebayes.robot.self_calibration.holding import LONGEST, holds
from wirebayes.robot.self_calibration.session import LengthPrior, Session

_RESOLVED = 1e-3  # of the weight: tensions on the way to what wires carry, whatever was read of them


@dataclass(frozen=True)
class PredictedSession:
    """Readings and state that unknowns lead to, ``n`` rows.

    Attributes
    ----------
    readings : (n, r) array
        Tensions of all read holds, then tilts, in units of their standard errors.
    length_m, creep : (n, w) arrays
        Zero-tension lengths at the end, creep included; their creep strain.
    position_m, rotation : (n, q, 3), (n, q, 3, 3) arrays
        Pose at every reading.
    read_length_m : (n, q, w) array
        Zero-tension lengths at every reading.
    solved : (n,) bool array
    """

    readings: Floats
    length_m: Floats
    creep: Floats
    position_m: Floats
    rotation: Floats
    read_length_m: Floats
    solved: Bools


def predict_session(
    robot: Robot,
    prior: LengthPrior,
    session: Session,
    unknowns: Floats,
    longest_step: float = LONGEST,
) -> PredictedSession:
    """Run the session for every row of unknowns ``(n, d)``: every creep step under the tensions it meets.

    Parameters
    ----------
    robot : Robot
    prior : LengthPrior
    session : Session
    unknowns : (n, d) array
    longest_step : float
        Longest step in the logarithm of time between tension updates; the first is a thousandth of the hold.
    """
    wires, error = prior.wires(robot, unknowns)
    bias = prior.bias_N(robot.legs, unknowns)
    solved = []
    read = []
    tensions = []
    lengths = []
    for k, hold in enumerate(holds(robot, wires, error, session, session.tension_sd_N, longest_step)):
        strain = hold.state.strain(wires).T
        length = hold.bare_m * (1 + strain)
        solved.append(hold.here.found)
        if session.read[k]:
            tension = hold.here.tension_N + bias * session.signs[k]
            read.append(hold.here)
            tensions.append(tension)
            lengths.append(length)
    position, turn = _poses(read)
    return PredictedSession(
        _standardised(session, np.concatenate(tensions, 1), turn),
        length,
        np.broadcast_to(strain, length.shape),
        position,
        turn,
        np.stack(lengths, 1),
        np.all(solved, axis=0),
    )


def _standardised(session: Session, tension_N: Floats, turn: Floats) -> Floats:
    """Readings ``(n, r)`` in units of their standard errors."""
    readings = tension_N / session.tension_sd_N
    if session.tilt_sd_rad is None:
        return readings
    normals = turn[:, :, :2, 2].reshape(len(turn), -1)
    return np.concatenate([readings, normals / session.tilt_sd_rad], 1)


def _poses(solved: Sequence[forward.Equilibria]) -> Poses:
    """Positions (n, p, 3) and rotations (n, p, 3, 3) of solved holds."""
    return np.stack([one.position_m for one in solved], 1), np.stack([one.rotation for one in solved], 1)


def carried(
    robot: Robot, prior: LengthPrior, session: Session, unknowns: Floats, error_m: Floats | None = None
) -> CreepState:
    """What the wires of every row of unknowns ``(n, d)`` carry out of the session.

    Parameters
    ----------
    robot : Robot
    prior : LengthPrior
    session : Session
    unknowns : (n, d) array
    error_m : (p, n, w) array, optional
        Of the lengths at every hold; those of the references when left out.

    Returns
    -------
    CreepState
        NaN where a row does not hold the platform.
    """
    wires, error = prior.wires(robot, unknowns)
    if error_m is not None:
        error = error_m
    lost = np.zeros(len(unknowns), bool)
    resolved = _RESOLVED * max(robot.mass_kg * GRAVITY, robot.rule.lowest_N)
    for hold in holds(robot, wires, error, session, resolved):
        lost |= ~hold.here.found
    return replace(hold.state, elongation_mm=np.where(lost, np.nan, hold.state.elongation_mm))
