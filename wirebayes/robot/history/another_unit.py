"""Logs whose tensions are in another unit: refused before the readings are searched for wires that explain them."""

from dataclasses import replace

import numpy as np

from wirebayes.errors import InputError
from wirebayes.numeric.evenly import evenly
from wirebayes.numeric.typing import Indices
from wirebayes.progress import silent
from wirebayes.robot.history.estimate import plain_track
from wirebayes.robot.history.history import History
from wirebayes.robot.history.unknowns import Uncertain, unknowns
from wirebayes.robot.mechanics.description import Poses, Robot
from wirebayes.robot.mechanics.draws import WireDraws
from wirebayes.robot.self_calibration.mistaken import unit_mistake

_ROWS = 20  # of a log are looked at: they have one unit


def refuse_another_unit(robot: Robot, line: WireDraws, history: History, start: Poses, errors: Uncertain) -> None:
    """Refuse tensions that carry the platform in another unit only, at the poses of wires that do not creep.

    No wires explain them, so that nothing would come of a search but a warning, and bands without the readings.

    Parameters
    ----------
    robot : Robot
    line : WireDraws
    history : History
        With joint values, or there is nothing to look at.
    start : (3,), (3, 3) arrays
        About where the platform is at the first row.
    errors : Uncertain

    Raises
    ------
    InputError
        Naming the columns, what was found and what was expected.
    """
    if history.joint_m is None or history.tension_N is None:
        return
    whole = np.flatnonzero(np.isfinite(history.tension_N).all(1))
    if not whole.size:
        return
    some = whole[evenly(len(whole), _ROWS)]
    rows = np.union1d([0], some)
    if len(rows) < 2:
        return
    looked_at = _at_rows(history, rows)
    known = unknowns(robot, line, errors, np.random.default_rng(0))  # of which the mean alone counts
    track, _ = plain_track(known, looked_at, start, silent)
    there = np.isin(rows, some) & track.held[0]
    robots = [looked_at.robot_at(robot, int(row)) for row in np.flatnonzero(there)]
    tension_N = history.tension_N[rows[there]]
    mistake = unit_mistake(robots, track.position_m[0, there], track.rotation[0, there], tension_N)
    if mistake is not None:
        raise InputError(f"--joints, columns {mistake}")


def _at_rows(history: History, rows: Indices) -> History:
    """Some rows of a history of joint values, without readings."""
    assert history.joint_m is not None
    return replace(
        history,
        times_s=history.times_s[rows],
        joint_m=history.joint_m[rows],
        position_m=None,
        rotation=None,
        payload_kg=history.payload_kg[rows],
        payload_m=history.payload_m[rows],
        hold=None,
        tension_N=None,
        tilt_rad=None,
    )
