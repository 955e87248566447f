"""What a robot did over time: joint values or poses, loads, and what its sensors said."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from wirebayes.numeric.typing import Floats, Indices, Ints
from wirebayes.robot.mechanics.description import Robot


@dataclass(frozen=True)
class History:
    """Rows in time; between two of them joint values and poses change evenly.

    Attributes
    ----------
    times_s : (t,) array
        Rising; at the first the wires are new.
    joint_m : (t, w) array or None
        Joint values that were measured.
    position_m, rotation : (t, 3), (t, 3, 3) arrays or None
        Poses that were commanded.
    payload_kg : (t,) array
        What the platform carries beside its own mass, from the row on.
    payload_m : (t, 3) array
        The payload's centre of mass in the platform's frame.
    hold : (t,) int array or None
        A new number restarts the wires' clocks; None: a change of load does (`follow.RESTART`).
    tension_N : (t, w) array or None
        Measured; NaN where a sensor was not read.
    tilt_rad : (t, 2) array or None
        Roll and pitch of an inclinometer on the platform; NaN where it was not read.
    rotation_is_stated : bool
        Whether the rotations were given; else they are the home orientation.
    """

    times_s: Floats
    joint_m: Floats | None
    position_m: Floats | None
    rotation: Floats | None
    payload_kg: Floats
    payload_m: Floats
    hold: Ints | None = None
    tension_N: Floats | None = None
    tilt_rad: Floats | None = None
    rotation_is_stated: bool = False

    @property
    def read(self) -> bool:
        """Whether any sensor beside the joints' was read."""
        return any(v is not None and bool(np.isfinite(v).any()) for v in (self.tension_N, self.tilt_rad))

    def robot_at(self, robot: Robot, row: int) -> Robot:
        """The robot with what it carries from a row on."""
        return with_payload(robot, float(self.payload_kg[row]), self.payload_m[row])


def divided(history: History, pieces: Indices) -> tuple[History, Indices]:
    """The history with rows between its own, without readings.

    Parameters
    ----------
    history : History
    pieces : (t - 1,) int array
        Into how many the time between two rows is divided, 1 or more.

    Returns
    -------
    History
    kept : (t,) int array
        Where its own rows are among them.
    """
    kept = np.concatenate([[0], np.cumsum(pieces)])
    index = np.arange(len(kept), dtype=float)
    at = np.interp(np.arange(kept[-1] + 1), kept, index)
    before = np.floor(at).astype(int)  # what stays until the next row

    def between(values: Floats | None) -> Floats | None:
        if values is None:
            return None
        columns = [np.interp(at, index, column) for column in values.T]
        return np.stack(columns, 1)

    turned = None
    if history.rotation is not None:
        rotations = Rotation.from_matrix(history.rotation)
        turned = Slerp(index, rotations)(at).as_matrix()
    fine = History(
        np.interp(at, index, history.times_s),
        between(history.joint_m),
        between(history.position_m),
        turned,
        history.payload_kg[before],
        history.payload_m[before],
        None if history.hold is None else history.hold[before],
    )
    return fine, kept


def at_every_stop(history: History) -> History | None:
    """The history with clocks that start at every stop and load; None where it says when they do, or has neither."""
    if history.hold is not None:
        return None
    values = history.joint_m
    if values is None:
        assert history.position_m is not None and history.rotation is not None
        turned = history.rotation.reshape(len(history.times_s), -1)
        values = np.column_stack([history.position_m, turned])
    stays = (values[1:] == values[:-1]).all(axis=1)
    arrives = ~stays[:-1] & stays[1:]
    loads = np.column_stack([history.payload_kg, history.payload_m])
    is_loaded = (loads[1:] != loads[:-1]).any(axis=1)
    begins = np.concatenate([[False], is_loaded])
    begins[1:-1] |= arrives
    return replace(history, hold=np.cumsum(begins)) if begins.any() else None


def stated_starts(history: History) -> Floats:
    """The times at which holds begin that a history states, the first row's first."""
    assert history.hold is not None
    new = np.diff(history.hold) != 0
    begins = np.concatenate([[True], new])
    return history.times_s[begins]


def with_payload(robot: Robot, mass_kg: float, centre_m: Floats) -> Robot:
    """The robot with a payload on its platform: the mass grows, its centre moves.

    Parameters
    ----------
    robot : Robot
    mass_kg : float
        Of the payload.
    centre_m : (3,) array
        Its centre of mass in the platform's frame.
    """
    if mass_kg == 0:
        return robot
    whole = robot.mass_kg + mass_kg
    centre = (robot.mass_kg * robot.centre_of_mass_m + mass_kg * np.asarray(centre_m)) / whole
    return replace(robot, mass_kg=whole, centre_of_mass_m=centre)


def roll_and_pitch(rotation: Floats) -> Floats:
    """What an inclinometer on the platform reads, ``(..., 2)`` rad, of rotations ``(..., 3, 3)``.

    Roll about the platform's x axis, then pitch about its y axis, as gravity shows them; the heading leaves no trace.
    """
    pitch = -np.arcsin(np.clip(rotation[..., 2, 0], -1.0, 1.0))
    return np.stack([np.arctan2(rotation[..., 2, 1], rotation[..., 2, 2]), pitch], -1)
