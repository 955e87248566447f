"""The same robot in another program: a MuJoCo model of laws (1) and (6).

A spatial tendon with stiffness k1/ℓ and a spring length from 0 to ℓ pulls as Hooke's law does and goes slack. Several
lines of one wire, and wire beyond the exit point, make one tendon of k1 m²/ℓ that rests at (ℓ - offset)/m.

A pulley is a cylinder on which the tendon wraps; the tendon starts a radius before the exit point, on the swivel axis,
so that it meets the rim at a tangent. The cylinder has no groove, a free one would be pushed aside: it stands still and
looks towards one pose. There lengths and forces are the robot's; beside it they differ by the square of the way.
"""

from xml.sax.saxutils import quoteattr

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.robot.export.robot_models import spaced
from wirebayes.robot.mechanics.description import GRAVITY, Robot
from wirebayes.robot.mechanics.rotation import matrix

_STILL = "pulleys do not swivel: they look towards the home pose; lengths and forces are the robot's there"


def mjcf(
    robot: Robot,
    k1_N: Floats,
    zero_m: Floats,
    offset_m: Floats,
    damping_N_s_m: float = 1.0,
    timestep_s: float = 1e-3,
    remark: str = "",
    towards_m: Floats | None = None,
) -> str:
    """MuJoCo model (MJCF) of a robot with given lengths, which starts at its home pose.

    The first three coordinates are the position in the world, the others the rotation from the home orientation.

    Parameters
    ----------
    robot : Robot
    k1_N, zero_m, offset_m : (w,) arrays
        Stiffness, zero-tension length (creep included), stretched length not between exit and platform point.
    damping_N_s_m : float
        Of the platform's displacements; of its rotations times the platform's size squared.
    timestep_s : float
    remark : str
        A comment at the head of the model.
    towards_m : (w, 3) array, optional
        Where the pulleys look; default: to the platform points at the home pose.
    """
    mass = float(robot.mass_kg)
    turn = matrix(robot.home_rotation_rad)
    joints = _joints(robot, turn, damping_N_s_m)
    if towards_m is None:
        towards_m = robot.home_m + robot.platform_m @ turn.T
    radius, axis = wheels(robot)
    exits = _sites("exit", robot.exit_m - radius * axis)
    points = _sites("point", robot.platform_m)
    pulleys = ""
    for i in np.flatnonzero(radius[:, 0]).tolist():
        pulleys += _rim(i, robot.exit_m[i], float(radius[i, 0]), axis[i], towards_m[i])
    tendons = _tendons(robot, k1_N, zero_m, offset_m, radius[:, 0])
    comment = _comment(remark)
    if pulleys:
        comment += _comment(_STILL)
    position = spaced(robot.home_m)
    quaternion = spaced(_quaternion(robot.home_rotation_rad))
    centre = spaced(robot.centre_of_mass_m)
    inertia = spaced(np.full(3, mass * robot.size_m**2))
    return (
        f'<mujoco model={quoteattr(robot.name)}>{comment}<option gravity="0 0 {-GRAVITY!r}" timestep="{timestep_s!r}" '
        f'integrator="implicitfast"><flag contact="disable"/></option><worldbody>{exits}'
        f'<body pos="{position}" quat="{quaternion}">{joints}'
        f'<inertial pos="{centre}" mass="{mass!r}" diaginertia="{inertia}"/>{points}'
        f"</body>{pulleys}</worldbody><tendon>{tendons}</tendon></mujoco>\n"
    )


def _comment(text: str) -> str:
    return f"<!-- {text.replace('--', '- -')} -->" if text else ""


def _sites(kind: str, points_m: Floats) -> str:
    return "".join(f'<site name="{kind}{i}" pos="{spaced(point)}"/>' for i, point in enumerate(points_m))


def _tendons(robot: Robot, k1_N: Floats, zero_m: Floats, offset_m: Floats, radius_m: Floats) -> str:
    """Wires as springs that only pull; around a pulley MuJoCo counts the way to its centre, a radius more."""
    stiffness = k1_N * robot.lines**2 / zero_m
    free = (zero_m - offset_m) / robot.lines
    to_centre = np.where(radius_m > 0, free + radius_m, free)
    rest = to_centre.clip(0.0)
    out = ""
    for i in range(robot.legs):
        k = float(stiffness[i])
        length = float(rest[i])
        wrapped = _wrapped(i) if radius_m[i] else ""
        out += (
            f'<spatial stiffness="{k!r}" springlength="0 {length!r}">'
            f'<site site="exit{i}"/>{wrapped}<site site="point{i}"/></spatial>'
        )
    return out


def _joints(robot: Robot, turn: Floats, damping_N_s_m: float) -> str:
    """Joints of all motions that the platform has; axes are written in the body's frame, of orientation `turn`."""
    damping = repr(damping_N_s_m * robot.size_m**2)
    about = f'<joint type="ball" damping="{damping}"/>'
    if robot.freedom == "orientation":  # the ball joint is where the body's frame is
        return about
    axes = np.eye(3)
    if robot.plane is not None:
        normal = robot.plane.normal
        axes = _in_plane(normal)
        about = f'<joint type="hinge" axis="{spaced(normal @ turn)}" damping="{damping}"/>'
    out = ""
    for axis in axes:
        out += (
            f'<joint type="slide" axis="{spaced(axis @ turn)}" ref="{float(axis @ robot.home_m)!r}" '
            f'damping="{damping_N_s_m!r}"/>'
        )
    return out + (about if robot.degrees == 6 else "")


def _in_plane(normal: Floats) -> Floats:
    """(2, 3) orthonormal axes of a plane."""
    if np.abs(normal).max() == 1.0:  # along an axis: the others are the plane's
        return np.eye(3)[normal == 0]
    return np.linalg.svd(np.eye(3) - np.outer(normal, normal))[2][:2]


def wheels(robot: Robot) -> tuple[Floats, Floats]:
    """Radii ``(w, 1)``, zero without a pulley, and swivel axes ``(w, 3)``."""
    if robot.pulleys is None:
        return np.zeros((robot.legs, 1)), np.zeros((robot.legs, 3))
    return robot.pulleys.radius_m[:, None], robot.pulleys.axis


def _rim(i: int, exit_m: Floats, radius: float, axis: Floats, towards_m: Floats) -> str:
    """A pulley: x of its frame away from the swivel axis, z along it; the tendon passes on the side that z shows."""
    line = towards_m - exit_m
    outward = line - (line @ axis) * axis
    outward = outward / np.linalg.norm(outward)
    frame = spaced(np.concatenate([outward, np.cross(axis, outward)]))
    return (
        f'<body name="pulley{i}" pos="{spaced(exit_m)}" xyaxes="{frame}">'
        f'<geom name="rim{i}" type="cylinder" size="{radius!r} {0.2 * radius!r}" pos="{radius!r} 0 0" '
        f'zaxis="0 1 0" contype="0" conaffinity="0"/><site name="side{i}" pos="{radius!r} 0 {2 * radius!r}"/></body>'
    )


def _quaternion(rotation_vector_rad: Floats) -> Floats:
    """As MuJoCo writes them: the real part first."""
    angle = float(np.linalg.norm(rotation_vector_rad))
    return np.concatenate([[np.cos(angle / 2)], 0.5 * np.sinc(angle / (2 * np.pi)) * rotation_vector_rad])


def _wrapped(i: int) -> str:
    return f'<geom geom="rim{i}" sidesite="side{i}"/>'
