"""The tables of an answer about a history: poses, and the joint values that bring the platform back."""

import warnings
from typing import Any

import numpy as np

from wirebayes.numeric.means import mean_of_finite
from wirebayes.numeric.typing import Floats
from wirebayes.robot.history.corrections import Target
from wirebayes.robot.history.estimate import Estimate
from wirebayes.robot.history.history import History
from wirebayes.robot.mechanics import rotation as turning
from wirebayes.robot.mechanics import winches
from wirebayes.robot.mechanics.description import Drums, Robot
from wirebayes.robot.mechanics.drums import motor_angle

HeadedRows = tuple[list[str], list[list[Any]]]  # the header of a table, and its rows


def pose_table(robot: Robot, history: History, found: Estimate, to: Target) -> HeadedRows:
    """Mean, sd and quantiles of every coordinate, of the distance from the target, and the tensions.

    Parameters
    ----------
    robot : Robot
    history : History
    found : Estimate
    to : Target

    Returns
    -------
    header : list of str
    rows : list of lists
    """
    track = found.track
    position, tension = track.position_m, track.tension_N
    columns: dict[str, Any] = {"time_s": history.times_s, "hold": track.hold + 1}
    columns |= _with_bands_along("", "m", position)
    if robot.degrees == 6:
        turn = rotation_vectors(track.rotation)
        columns |= _with_bands_along("r", "rad", turn)
    distance = np.linalg.norm(position - to.position_m, axis=-1)
    columns |= _with_bands("distance", "mm", 1e3 * distance)
    for i in range(robot.legs):
        columns[f"tension_{i + 1}_N"] = mean_of_finite(tension[..., i])
    columns["held"] = track.held.mean(0)
    return _as_table(columns)


def _with_bands_along(mark: str, unit: str, values: Floats) -> dict[str, Floats]:
    """Columns of the three components of a vector, named after the axes."""
    columns: dict[str, Floats] = {}
    for i, axis in enumerate("xyz"):
        columns |= _with_bands(mark + axis, unit, values[..., i])
    return columns


def _with_bands(quantity: str, unit: str, values: Floats) -> dict[str, Floats]:
    """Columns of mean, sd and quantiles of a quantity."""
    return {f"{quantity}_{label}_{unit}": value for label, value in _described(values).items()}


def _as_table(columns: dict[str, Any]) -> HeadedRows:
    """Header and rows of columns."""
    return list(columns), [list(row) for row in zip(*columns.values(), strict=True)]


def correction_table(robot: Robot, history: History, joint_m: Floats, change_m: Floats) -> HeadedRows:
    """Corrected joint values (motor angles too), and what they change, with its standard deviation.

    Parameters
    ----------
    robot : Robot
    history : History
    joint_m : (t, w) or (n, t, w) array
        Joint values before they are corrected.
    change_m : (n, t, w) array

    Returns
    -------
    header : list of str
    rows : list of lists
    """
    columns: dict[str, Any] = {"time_s": history.times_s}
    if joint_m.ndim == 3:
        joint_m = mean_of_finite(joint_m)
    described = _described(change_m)
    mean = winches.of_each_winch(robot, described["mean"])
    sd = winches.of_each_winch(robot, described["sd"])
    joint = winches.of_each_winch(robot, joint_m) + mean
    for i in range(robot.joints):
        columns[f"joint_{i + 1}_m"] = joint[:, i]
    if robot.drums is not None:
        corrected = joint_m + described["mean"]
        columns |= _motor_columns(robot, robot.drums, corrected)
    for i in range(robot.joints):
        change = f"change_{i + 1}"
        columns[f"{change}_mm"] = 1e3 * mean[:, i]
        columns[f"{change}_sd_mm"] = 1e3 * sd[:, i]
    return _as_table(columns)


def _motor_columns(robot: Robot, drums: Drums, joint_m: Floats) -> dict[str, Floats]:
    """Motor angles of drums of known radius."""
    angle = winches.of_each_winch(robot, motor_angle(drums, joint_m))
    known = winches.of_each_winch(robot, drums.radius_m)
    return {f"motor_{i + 1}_rad": angle[:, i] for i in np.flatnonzero(known).tolist()}


def _described(values: Floats) -> dict[str, Floats]:
    """Mean, sd, 5, 50 and 95 % over the draws that have a value, by the labels of the tables' columns."""
    mean = mean_of_finite(values)
    sd = np.sqrt(mean_of_finite((values - mean) ** 2))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # a row where no draw hangs has no quantiles
        quantile = np.nanquantile if np.isnan(values).any() else np.quantile
        low, middle, high = quantile(values, [0.05, 0.5, 0.95], axis=0)
    return {"mean": mean, "sd": sd, "q05": low, "q50": middle, "q95": high}


def rotation_vectors(rotation: Floats) -> Floats:
    """Rotation vectors; NaN where the platform has fallen."""
    held = np.asarray(np.isfinite(rotation).all((-2, -1), keepdims=True))
    known = np.where(held, rotation, np.eye(3))
    return np.where(held[..., 0], turning.vector(known), np.nan)
