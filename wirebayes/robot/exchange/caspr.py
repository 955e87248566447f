"""Robots of CASPR: a file of bodies beside a file of cables (D. Lau and others, github.com/darwinlau/CASPR).

Lengths are metres, forces newtons, gravity points along -z; an attachment's location counts from the joint or from the
centre of mass of its link, that of link 0 from the origin. CASPR's pulley is that of `mechanics.pulleys`: it is fixed
where the cable enters, and turns about the direction in which it does.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.robot.exchange.imported import ImportedRobot
from wirebayes.robot.mechanics.description import Freedom
from wirebayes.robot.mechanics.rotation import matrix, vector
from wirebayes.strict.xml_file import Element

_JOINTS: dict[str, tuple[tuple[int, ...], tuple[int, ...]]] = {  # axes of the coordinates: moved along, turned about
    "SPATIAL_EULER_XYZ": ((0, 1, 2), (0, 1, 2)),
    "T_XYZ": ((0, 1, 2), ()),
    "P_XZ": ((0, 2), ()),
    "PLANAR_XY": ((0, 1), (2,)),
    "PLANAR_XZ": ((0, 2), (1,)),
    "PLANAR_YZ": ((1, 2), (0,)),
    "S_EULER_XYZ": ((), (0, 1, 2)),
    "S_FIXED_XYZ": ((), (0, 1, 2)),
}
_FIXED_AXES = "S_FIXED_XYZ"  # its angles turn about axes of the base


def robot_of_caspr(bodies: Element, cables: Element, cable_set: str | None) -> ImportedRobot:
    """A robot of one rigid platform from the root elements of both files.

    Parameters
    ----------
    bodies, cables : Element
    cable_set : str or None
        Which set of cables; default: the file's own.

    Raises
    ------
    InputError
        What the files describe is no platform on wires, with file and line.
    """
    link = _platform(bodies)
    joint, physical = link.one("joint"), link.one("physical")
    moves, turns = _ways(joint)
    freedom: Freedom = "orientation"
    if moves:
        freedom = "pose" if turns else "position"
    normal = np.eye(3)[turns[0]] if len(turns) == 1 else None
    centre = physical.one("com_location").vector()
    base = link.one("parent").one("location").vector()
    home, turn = _home(joint, moves, turns, base)
    chosen = _set(cables, cable_set)
    wires = [cable for cable in chosen.children if cable.tag.startswith("cable_")]
    legs = [_leg(cable, centre) for cable in wires]
    if len(legs) < 2:
        raise chosen.fail(f"{len(legs)} cables", "at least two")
    bounds, own_bounds = _bounds(wires)
    files = f"{Path(bodies.file).name} and {Path(cables.file).name}"
    of_file = Path(bodies.file).stem.removesuffix("_bodies")
    return ImportedRobot(
        link.attributes.get("name") or of_file,
        f"Imported from CASPR's {files}, cable set {chosen.attribute('id')!r}.",
        freedom,
        physical.one("mass").number(),
        centre,
        np.array([leg.exit_m for leg in legs]),
        np.array([leg.platform_m for leg in legs]),
        np.array([leg.pulley_radius_m for leg in legs]),
        np.array([leg.swivel_axis for leg in legs]),
        bounds,
        home,
        turn,
        _notes(own_bounds, normal is not None, freedom),
        normal=normal,
    )


def _ways(joint: Element) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """The ways in which a joint moves and turns, as `_JOINTS` has them."""
    kind = joint.attribute("type")
    if kind not in _JOINTS:
        expected = f"a free platform, one in a plane or on a ball joint: {', '.join(_JOINTS)}"
        raise joint.fail(f"the type {kind!r}", expected)
    return _JOINTS[kind]


def _bounds(wires: list[Element]) -> tuple[tuple[float, float], bool]:
    """The tensions that every wire can bear, and whether wires differ in them."""
    low, high = (np.array([_force(wire, key) for wire in wires]) for key in ("force_min", "force_max"))
    return (float(low.max()), float(high.min())), bool(np.ptp(low) or np.ptp(high))


def _notes(own_bounds: bool, in_a_plane: bool, freedom: Freedom) -> tuple[str, ...]:
    """What a reader of the robot's file should know of how it was read."""
    notes = ["Lengths, mass and bounds of the tensions are that file's; its stiffnesses are left out."]
    if own_bounds:
        notes.append("Its cables have bounds of their own: the highest force_min and the lowest force_max are taken.")
    if in_a_plane:
        notes.append("Its planar joint is a rail: the plane holds the platform both ways.")
    if freedom == "orientation":
        notes.append("Its spherical joint is a ball joint: it carries the platform both ways.")
    return tuple(notes)


def _platform(bodies: Element) -> Element:
    links = bodies if bodies.tag == "links" else bodies.one("links")
    bodily = [child for child in links.children if child.tag.startswith("link")]
    if len(bodily) != 1 or bodily[0].tag != "link_rigid":
        raise links.fail(f"{len(bodily)} links", "one <link_rigid>: a single platform")
    parent = bodily[0].one("parent").one("num")
    if parent.number() != 0:
        raise parent.fail(f"{parent.text.strip()!r}", "0, the base")
    return bodily[0]


def _home(joint: Element, moves: tuple[int, ...], turns: tuple[int, ...], base: Floats) -> tuple[Floats | None, Floats]:
    """Position and rotation vector of ``q_initial``.

    Each angle turns about an axis of the platform as turned so far, or of the base.

    Parameters
    ----------
    joint : Element
    moves, turns : tuples of int
        Axes that the first coordinates move along, and that the others turn about.
    base : (3,) array
        Position where all coordinates are zero.
    """
    if "q_initial" not in joint.attributes:
        return (None if moves else base), np.zeros(3)
    words = Element(joint.file, joint.tag, joint.line, {}, text=joint.attributes["q_initial"])
    q = words.vector(len(moves) + len(turns))
    moved, angles = q[: len(moves)], q[len(moves) :]
    position = np.array(base)
    position[list(moves)] += moved
    return position, vector(_turned(joint, turns, angles))


def _turned(joint: Element, turns: tuple[int, ...], angles: Floats) -> Floats:
    """The rotation by angles about some axes, fixed or turning along."""
    axes = np.eye(3)
    turned = np.eye(3)
    for axis, angle in zip(turns, angles, strict=True):
        own = matrix(angle * axes[axis])
        is_fixed = joint.attribute("type") == _FIXED_AXES
        turned = own @ turned if is_fixed else turned @ own
    return turned


def _set(cables: Element, name: str | None) -> Element:
    sets = cables.all("cable_set")
    wanted = name or cables.attributes.get("default_cable_set")
    known = [s.attributes.get("id", "") for s in sets]
    if wanted is None and len(sets) == 1:
        return sets[0]
    if wanted not in known:
        raise cables.fail(f"no cable set {wanted!r}" if wanted else "several cable sets", f"one of {', '.join(known)}")
    return sets[known.index(wanted)]


@dataclass(frozen=True)
class _Leg:
    """The ends of a cable, and the pulley at its exit point; radius 0 where there is none."""

    exit_m: Floats
    platform_m: Floats
    pulley_radius_m: float
    swivel_axis: Floats


def _leg(cable: Element, centre: Floats) -> _Leg:
    reference = cable.attribute("attachment_reference")
    if reference not in ("joint", "com"):
        raise cable.fail(f"attachment_reference {reference!r}", "joint or com")
    ends = cable.one("attachments").children
    if len(ends) != 2:
        raise cable.fail(f"{len(ends)} attachments", "two: a wire runs straight from the base to the platform")
    first, last = ends
    if first.tag == "base_rotating_pulley":
        exit_m, radius, axis = _over_pulley(first)
    else:
        if _link(first) == 1 and _link(last) == 0:
            first, last = last, first
        exit_m, radius, axis = _from_base(first)
    on_link = _link(last)
    if on_link != 1:
        raise last.fail(f"link {on_link}", "link 1, the platform")
    point = last.one("location").vector()
    origin = centre if reference == "com" else 0.0
    return _Leg(exit_m, point + origin, radius, axis)


def _over_pulley(end: Element) -> tuple[Floats, float, Floats]:
    """Exit point, radius and swivel axis of a pulley at the base."""
    exit_m, radius = end.one("fixed_location").vector(), end.one("pulley_radius").number()
    axis = end.one("cable_entry_vector").vector()
    if not radius > 0 or not axis.any():
        raise end.fail("a pulley without radius or direction", "both above 0")
    return exit_m, radius, axis


def _from_base(end: Element) -> tuple[Floats, float, Floats]:
    """Exit point at the base, without a pulley."""
    if _link(end) != 0:
        raise end.fail(f"link {_link(end)}", "link 0, the base")
    return end.one("location").vector(), 0.0, np.array([0.0, 0.0, 1.0])


def _link(attachment: Element) -> int:
    if attachment.tag != "attachment":
        raise attachment.fail("this kind of attachment", "<attachment>, or <base_rotating_pulley> at the base")
    return int(attachment.one("link").number())


def _force(cable: Element, key: str) -> float:
    return cable.one("properties").one(key).number()
