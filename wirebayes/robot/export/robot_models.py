"""The robot's bodies and frames as URDF and SDF, for programs that know no wires.

Both formats describe rigid bodies and joints. The platform floats freely; every exit point and platform point is a
frame from which a program of the user's own may draw and pull its wires. What the formats cannot hold stands in a
comment.
"""

from xml.sax.saxutils import quoteattr

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.rotation import matrix
from wirebayes.sentences import short


def urdf(robot: Robot, stiffness_N: Floats, zero_m: Floats) -> str:
    """URDF of a robot: links ``world`` and ``platform``, and a link without mass for every exit and platform point.

    Parameters
    ----------
    robot : Robot
    stiffness_N, zero_m : (w,) arrays
        Stiffness and zero-tension length of each wire at the home pose, for the comment.
    """
    inertia = _inertia(robot)
    moments = " ".join(f'{key}="{value!r}"' for key, value in zip(_MOMENTS, inertia, strict=True))
    links = [f'  <link name="exit_{i}"/>' for i in _legs(robot)] + [f'  <link name="point_{i}"/>' for i in _legs(robot)]
    joints = [_fixed("world", f"exit_{i}", p) for i, p in zip(_legs(robot), robot.exit_m, strict=True)]
    joints += [_fixed("platform", f"point_{i}", p) for i, p in zip(_legs(robot), robot.platform_m, strict=True)]
    return "\n".join(
        [
            '<?xml version="1.0"?>',
            f"<robot name={quoteattr(robot.name)}>",
            *(f"  <!-- {line} -->" for line in _left_out(robot, stiffness_N, zero_m)),
            '  <link name="world"/>',
            '  <link name="platform">',
            "    <inertial>",
            f'      <origin xyz="{spaced(robot.centre_of_mass_m)}" rpy="0 0 0"/>',
            f'      <mass value="{robot.mass_kg!r}"/>',
            f"      <inertia {moments}/>",
            "    </inertial>",
            "  </link>",
            '  <joint name="floating" type="floating">',
            '    <parent link="world"/><child link="platform"/>',
            f'    <origin xyz="{spaced(robot.home_m)}" rpy="{spaced(_roll_pitch_yaw(robot))}"/>',
            "  </joint>",
            *links,
            *joints,
            "</robot>",
            "",
        ]
    )


def sdf(robot: Robot, stiffness_N: Floats, zero_m: Floats) -> str:
    """SDF 1.9 of a robot: a model with the link ``platform``, and frames for the exit and platform points.

    Parameters
    ----------
    robot : Robot
    stiffness_N, zero_m : (w,) arrays
        As in `urdf`.
    """
    moments = "".join(f"<{key}>{value!r}</{key}>" for key, value in zip(_MOMENTS, _inertia(robot), strict=True))
    frames = [_frame("__model__", f"exit_{i}", p) for i, p in zip(_legs(robot), robot.exit_m, strict=True)]
    frames += [_frame("platform", f"point_{i}", p) for i, p in zip(_legs(robot), robot.platform_m, strict=True)]
    return "\n".join(
        [
            '<?xml version="1.0"?>',
            '<sdf version="1.9">',
            *(f"  <!-- {line} -->" for line in _left_out(robot, stiffness_N, zero_m)),
            f"  <model name={quoteattr(robot.name)}>",
            '    <link name="platform">',
            f"      <pose>{spaced(robot.home_m)} {spaced(_roll_pitch_yaw(robot))}</pose>",
            "      <inertial>",
            f"        <pose>{spaced(robot.centre_of_mass_m)} 0 0 0</pose>",
            f"        <mass>{robot.mass_kg!r}</mass>",
            f"        <inertia>{moments}</inertia>",
            "      </inertial>",
            "    </link>",
            *frames,
            "  </model>",
            "</sdf>",
            "",
        ]
    )


def cut_from(robot: Robot) -> str:
    """Which legs hang on which wire of the robot's file, in words; nothing where all hang on one."""
    legs: dict[str, list[str]] = {}
    for i, name in enumerate(robot.wire, 1):
        legs.setdefault(name, []).append(str(i))
    if len(legs) < 2:
        return ""
    return "; ".join(f"wire {name} in leg{'s' * (len(own) > 1)} {', '.join(own)}" for name, own in legs.items())


_MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def _inertia(robot: Robot) -> tuple[float, ...]:
    """A ball's as large as the platform: the robot's file has none, and statics needs none."""
    moment = robot.mass_kg * robot.size_m**2
    return moment, 0.0, 0.0, moment, 0.0, moment


def _left_out(robot: Robot, stiffness_N: Floats, zero_m: Floats) -> list[str]:
    """Comments, without the double hyphens that XML forbids in them."""
    lines = ["The wires are left out: this format knows none. They pull from exit_i to point_i, and only when longer."]
    cut = cut_from(robot)
    if cut:
        lines.append(cut)
    for i in range(robot.legs):
        parts, beyond = robot.lines[i], robot.beyond_m[i]
        k, zero = stiffness_N[i], zero_m[i]
        lines.append(
            f"wire {i + 1}: {parts:g} line(s), {beyond:g} m beyond the exit; stiffness {short(k, 6)} N, zero-tension "
            f"length {short(zero, 6)} m at the home pose"
        )
    if robot.pulleys is not None:
        radii = ", ".join(f"{1e3 * radius:g}" for radius in robot.pulleys.radius_m)
        lines.append(f"Left out: swivelling pulleys at the exit points, radii {radii} mm")
    if robot.degrees == 3:
        lines.append("Left out: the parallel lines that keep the orientation; here the platform may turn")
    lines.append("The moments of inertia are assumed: mass times the square of the platform's size")
    return [line.replace("--", "- -") for line in lines]


def _fixed(parent: str, child: str, origin_m: Floats) -> str:
    return (
        f'  <joint name="{child}_fixed" type="fixed"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{spaced(origin_m)}" rpy="0 0 0"/></joint>'
    )


def _frame(attached_to: str, name: str, origin_m: Floats) -> str:
    return f'    <frame name="{name}" attached_to="{attached_to}"><pose>{spaced(origin_m)} 0 0 0</pose></frame>'


def _roll_pitch_yaw(robot: Robot) -> Floats:
    """Angles about the fixed axes x, y and z of the home orientation, as both formats want them."""
    R = matrix(robot.home_rotation_rad)
    pitch = np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0]))
    return np.array([np.arctan2(R[2, 1], R[2, 2]), pitch, np.arctan2(R[1, 0], R[0, 0])])


def _legs(robot: Robot) -> range:
    return range(1, robot.legs + 1)


def spaced(values: Floats) -> str:
    """Numbers to the last digit, as XML wants them."""
    return " ".join(repr(float(v)) for v in values)
