"""What `pose` says about a platform that a plane carries: the plane's force, and how far friction can hold it."""

import numpy as np

from wirebayes.json_files.pose import OnPlane
from wirebayes.numeric.typing import Floats
from wirebayes.result_warnings import Notice
from wirebayes.robot.mechanics import plane, statics
from wirebayes.robot.mechanics.description import GRAVITY, Plane, Robot
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion import inverse
from wirebayes.robot.pose.request import band_over_draws
from wirebayes.sentences import short

_ROUNDING = 1e-9  # of the weight: a force so small is none
_BENT = 0.2  # of the largest friction: forces that far from what the stiffness foresees make the half widths rough


def lifted(robot: Robot, position_m: Floats, rotation: Floats, tension_N: Floats) -> str:
    """Why the plane cannot carry the platform at a pose; empty where it can, or where there is none.

    Parameters
    ----------
    robot : Robot
    position_m : (3,) array
    rotation : (3, 3) array
    tension_N : (w,) array
    """
    if robot.plane is None or robot.plane.contact == "rail":
        return ""
    force = plane.normal_force(robot, position_m, rotation, tension_N)
    if force >= -_ROUNDING * robot.mass_kg * GRAVITY:
        return ""
    return f"The wires lift the platform off its plane: the plane would have to pull with {short(-force, 3)} N."


def on_plane(
    robot: Robot, wires: Wires, commands: inverse.Commands, position_m: Floats, rotation: Floats, tension_N: Floats
) -> OnPlane:
    """The plane's force and the poses at which friction can hold the platform, over the draws.

    Parameters
    ----------
    robot : Robot
        On a plane.
    wires : Wires
    commands : Commands
        Of the pose.
    position_m : (3,) array
    rotation : (3, 3) array
    tension_N : (w,) array
    """
    known = robot.plane
    assert known is not None
    force = plane.normal_force(robot, position_m, rotation, tension_N)
    good = np.flatnonzero(commands.feasible)
    x = np.repeat(position_m[:, None], good.size, 1)
    R = np.repeat(rotation[..., None], good.size, 2)
    zero, offset = commands.zero_m[good], commands.offset_m[good]
    K = statics.stiffness(robot, wires.part(good), x, R, zero.T, offset.T)
    width, turn = plane.friction_half_width(robot, K, force)
    here = x.T, np.moveaxis(R, -1, 0)
    departure = plane.friction_departure(robot, wires.part(good), here, (zero, offset), force)
    return {
        "normal": known.normal,
        "contact": known.contact,
        "normal_force_N": force,
        "friction_coefficient": known.friction,
        "contact_radius_m": known.contact_radius_m,
        "friction_half_width_mm": band_over_draws(1e3 * width),
        "friction_half_width_rad": band_over_draws(turn),
        "friction_departure": departure,
        "sentence": _sentence(robot, known, force, width, turn),
    }


def _sentence(robot: Robot, known: Plane, force: float, width: Floats, turn: Floats) -> str:
    """With how much the plane carries the platform, and how far friction can hold it."""
    said = f"The plane carries the platform with {short(force, 4)} N"
    if abs(force) < _ROUNDING * robot.mass_kg * GRAVITY:
        nothing = "The plane carries nothing of the platform"
        return f"{nothing}, so that no friction holds it." if known.friction else f"{nothing}."
    if not known.friction:
        return f"{said}."
    middle = 1e3 * np.median(width, axis=0)
    along = ", ".join(f"±{short(v, 2)} mm along {axis}" for v, axis in zip(middle, "xyz", strict=True) if v > 1e-9)
    about = f" and turned by ±{short(np.degrees(np.median(turn)), 2)}°" if turn.any() else ""
    most = short(known.friction * abs(force), 3)
    return f"{said}; its friction, {most} N at most, can hold the platform {along}{about}."


def friction_notices(said: OnPlane | None) -> list[Notice]:
    """A warning where friction can hold the platform farther than the stiffness at its pose reaches.

    Parameters
    ----------
    said : dict or None
        What `on_plane` returned.
    """
    if said is None or said["friction_departure"] <= _BENT:
        return []
    off = short(100 * said["friction_departure"], 2)
    text = (
        "how far friction can hold the platform is extrapolated from the stiffness at the pose: that far from it the "
        f"wires pull otherwise, by {off} % of the friction"
    )
    return [Notice("extrapolation", text)]
