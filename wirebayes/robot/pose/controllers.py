"""Pose error under controllers with different models of the wires, and how long a calibration lasts."""

import numpy as np
from numpy.random import Generator

from wirebayes.json_files.pose import BetweenCalibrations, ControllerError, TimeWithin, Tolerances
from wirebayes.numeric.evenly import evenly
from wirebayes.numeric.typing import Floats
from wirebayes.progress import ShareDone, shares_of, unseen
from wirebayes.robot.mechanics import draws
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.draws import WireDraws
from wirebayes.robot.motion import control, inverse
from wirebayes.robot.motion.creep import HoldCreep, fresh
from wirebayes.robot.pose.request import PoseRequest, band_over_draws

HISTORIES_S = (0.0, 3600.0)  # under load before the calibration: new wires, and an hour
# to 28 h, eight a decade: the time within tolerance is a point of this grid, at most a quarter too short
_SINCE_S = np.concatenate([[0.0], np.geomspace(1.0, 1e5, 41)])
_DRAWS = 300  # each drifts through all of these times; a 95 % probability is then known to 1.3 %


def errors(
    robot: Robot,
    line: WireDraws,
    request: PoseRequest,
    rng: Generator,
    other: WireDraws | None = None,
    progress: ShareDone = unseen,
) -> list[ControllerError]:
    """Pose error under controllers that know the posterior, and how long each stays within tolerance.

    Parameters
    ----------
    robot : Robot
    line : WireDraws
        What the wires may really be.
    request : PoseRequest
    rng : numpy Generator
    other : WireDraws, optional
        Another fit of the same line (the plain model beside one with effects), used by a third controller.
    progress : function of a share between 0 and 1
    """
    known = draws.for_robot(robot, line)
    schedules = {
        "hooke_only": control.hooke_only(robot, known, request.position_m, request.rotation),
        "creep_aware": control.creep_aware(robot, known, request.position_m, request.rotation),
    }
    if other is not None:
        less = draws.for_robot(robot, other)
        schedules["creep_aware_other_fit"] = control.creep_aware(robot, less, request.position_m, request.rotation)
    out: list[ControllerError] = []
    at = request.position_m, request.rotation, request.times_s
    slip = control.largest_slip(request.tolerance_m, request.tolerance_rad)
    done = shares_of(progress, len(request.spreads) * len(schedules))
    for spread in request.spreads:
        wires = draws.for_robot(robot, line, spread, rng)
        for name, schedule in schedules.items():
            error = control.error(robot, wires, schedule, *at, progress=next(done), slip=slip)
            out.append(
                {
                    "specimen_spread": spread,
                    "controller": name,
                    "times_s": error.times_s,
                    "solved": float(error.found.mean()),
                    "distance_mm": band_over_draws(1e3 * error.distance_m[error.found]),
                    "rotation_deg": band_over_draws(np.degrees(error.angle_rad[error.found])),
                    **_tolerances(request),
                    **_lasts(error, request),
                }
            )
    return out


def between_calibrations(
    robot: Robot, line: WireDraws, request: PoseRequest, rng: Generator, progress: ShareDone = unseen
) -> list[BetweenCalibrations]:
    """Longest time between calibrations with P(within tolerance) of 95 %, after a load history.

    The pose is exact when the calibration ends; before it the wires carried the same tensions for a time.

    Parameters
    ----------
    robot : Robot
    line : WireDraws
    request : PoseRequest
        The pose, the tolerances and the specimen spreads.
    rng : numpy.random.Generator
        Draws the specimens.
    progress : function of a share between 0 and 1

    Returns
    -------
    list of dict
        For each spread, load history and controller: joints held still, or commands that compensate for the creep.
    """
    x, R = request.position_m, request.rotation
    limits = control.Limits(x, R, request.tolerance_m, request.tolerance_rad)
    line = line.part(evenly(line.count, _DRAWS))
    load = np.repeat(inverse.tensions(robot, x[None], R[None]).T, line.count, 1)
    done = shares_of(progress, 2 * len(HISTORIES_S) * len(request.spreads))
    out: list[BetweenCalibrations] = []
    for spread in request.spreads:
        wires = draws.for_robot(robot, line, spread, rng)
        for loaded_s in HISTORIES_S:
            state = fresh(robot.legs, line.count)
            if loaded_s:
                state = HoldCreep(wires, state, load).advance(loaded_s, load)
            schedules = control.calibrated_schedules(robot, wires, state, x, R)
            for name, schedule in zip(("held_still", "creep_aware"), schedules, strict=True):
                lasting = control.lasting_within(robot, wires, schedule, limits, _SINCE_S, state, next(done))
                out.append(
                    {
                        "specimen_spread": spread,
                        "loaded_before_s": loaded_s,
                        "controller": name,
                        "solved": lasting.held,
                        **_tolerances(request),
                        **_time_within(lasting.longest_s, _SINCE_S),
                    }
                )
    return out


def _tolerances(request: PoseRequest) -> Tolerances:
    return {"tolerance_mm": 1e3 * request.tolerance_m, "tolerance_deg": float(np.degrees(request.tolerance_rad))}


def _lasts(error: control.PoseError, request: PoseRequest) -> TimeWithin:
    within = control.longest_interval(error, request.tolerance_m, request.tolerance_rad)
    return _time_within(within, error.times_s)


def _time_within(longest_s: float, times_s: Floats) -> TimeWithin:
    at_end = not np.isfinite(longest_s)
    return {
        "longest_time_within_s": float(times_s[-1]) if at_end else longest_s,
        "still_within_at_the_end": at_end,
    }
