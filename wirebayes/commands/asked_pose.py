"""A robot with its payload on its wires, and the pose that is asked of it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from wirebayes.commands.options import Numbers, numbers, one_number, text_of
from wirebayes.errors import InputError
from wirebayes.numeric.typing import Floats
from wirebayes.robot.history.history import with_payload
from wirebayes.robot.mechanics import plane
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.draws import WireDraws
from wirebayes.robot.mechanics.rotation import matrix
from wirebayes.sentences import short

OFF_PLANE = 1e-6  # of the robot's span: so far from its plane a pose is rounded


@dataclass(frozen=True)
class AskedPose:
    """A robot on its wires, and where its platform is asked to be.

    Attributes
    ----------
    robot : Robot
        With its payload.
    line : WireDraws
    position_m : (3,) array
    rotation_rad : (3,) array or None
        Components of the rotation vector, NaN where balance decides; None where nothing is asked for.
    seed : int
    own_effects : Path or None
    payload_kg : float
        What ``--payload`` gave the robot.
    """

    robot: Robot
    line: WireDraws
    position_m: Floats
    rotation_rad: Floats | None
    seed: int
    own_effects: Path | None
    payload_kg: float = 0.0

    @property
    def start(self) -> tuple[Floats, Floats]:
        """Position and rotation matrix near which a history begins."""
        return self.position_m, about(self.robot, self.rotation_rad)


def asked_place(robot: Robot, position: Numbers | None, rotation: Numbers | None) -> tuple[Floats, Floats | None]:
    """Position and rotation vector that are asked for, as `AskedPose` holds them.

    Parameters
    ----------
    robot : Robot
    position, rotation : numbers or None

    Raises
    ------
    InputError
        They are no numbers, or the robot cannot be there.
    """
    where = robot.home_m if position is None else numbers("--position", position, 3)
    turned = asked_rotation(rotation)
    if turned is not None and np.isnan(turned).any() and robot.freedom == "orientation":
        raise InputError("--rotation: found free components for a platform on a ball joint, expected three numbers")
    if turned is not None and robot.freedom == "position" and not np.array_equal(turned, robot.home_rotation_rad):
        raise InputError("--rotation: found one for a robot whose lines keep the orientation, expected none")
    _refuse_off_plane(robot, where, about(robot, turned))
    return where, turned


def asked_rotation(rotation: Numbers | None) -> Floats | None:
    """Components of a rotation vector, NaN where ``free`` (in Python None); None where nothing is asked for."""
    if rotation is None:
        return None
    text = text_of(rotation)
    words = text.split(",")
    is_free = [word.strip() in ("free", "None") for word in words]
    if not any(is_free):
        return np.asarray(numbers("--rotation", text, 3))
    try:
        values = [np.nan if free else float(word) for word, free in zip(words, is_free, strict=True)]
    except ValueError:
        values = [np.inf]
    found = np.array(values)
    if len(found) != 3 or np.isinf(found).any():
        raise InputError(f"--rotation: found {text!r}, expected three finite numbers or free, separated by commas")
    return found if np.isfinite(found).any() else None


def about(robot: Robot, asked_rad: Floats | None) -> Floats:
    """(3, 3) how the platform is turned as asked, and as at home where nothing is asked."""
    home = robot.home_rotation_rad
    return matrix(home if asked_rad is None else np.where(np.isfinite(asked_rad), asked_rad, home))


def _refuse_off_plane(robot: Robot, position_m: Floats, rotation: Floats) -> None:
    far = float(plane.off(robot, position_m[None], rotation[None])[0])
    if robot.freedom == "orientation" and far > 0:
        home = ", ".join(f"{v:g}" for v in robot.home_m)
        raise InputError(f"--position: found a position {short(far, 3)} m off the ball joint, expected {home}")
    if robot.plane is not None and far > OFF_PLANE * robot.span_m:
        home, normal = (", ".join(f"{v:g}" for v in values) for values in (robot.home_m, robot.plane.normal))
        raise InputError(
            f"--position, --rotation: found a pose {far:.3g} m off the plane, expected one in the plane through the "
            f"home position ({home}) with the normal ({normal}), turned about it only"
        )


def loaded(robot: Robot, payload_kg: float | None, at: Numbers | None) -> Robot:
    """The robot with a payload, at its own centre of mass where no other place is given.

    Parameters
    ----------
    robot : Robot
    payload_kg : float or None
    at : numbers or None
        Centre of mass of the payload in the platform's frame, m.

    Raises
    ------
    InputError
        No payload of this mass or at this place can be, or a place without a payload is given.
    """
    if payload_kg is None:
        if at is not None:
            raise InputError(f"--payload-at: found {text_of(at)} without --payload, expected both")
        return robot
    mass_kg = one_number("--payload", payload_kg, "kilograms, 0 or more")
    if not 0 <= mass_kg < math.inf:
        raise InputError(f"--payload: found {mass_kg:g}, expected kilograms, 0 or more")
    return with_payload(robot, mass_kg, robot.centre_of_mass_m if at is None else numbers("--payload-at", at, 3))


def spelled(options: Mapping[str, Numbers | None]) -> dict[str, str | None]:
    """Options as the command line spells them; None where they were not given."""
    return {name: None if values is None else text_of(values) for name, values in options.items()}


def carried_options(payload_kg: float | None, at: Numbers | None) -> dict[str, Any]:
    """A payload as options decide a result."""
    return {"--payload": float(payload_kg or 0.0), **spelled({"--payload-at": at})}
