"""Robots of WireX (A. Pott): the XML that its WireLib writes, version 0.32, lengths in metres.

A chain's base has the point where the cable meets the pulley, a frame whose third axis is the swivel axis, and the
pulley's radius: the pulley of `mechanics.pulleys`. The file has neither bounds of the tensions nor a pose.
"""

from pathlib import Path

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.robot.exchange.imported import ImportedRobot
from wirebayes.robot.mechanics.description import Freedom
from wirebayes.strict.xml_file import Element

_PATTERNS: dict[str, Freedom] = {"3R3T": "pose", "3T": "position"}


def robot_of_wirex(models: Element, pulleys: bool) -> ImportedRobot:
    """A robot from the root element of a file.

    Parameters
    ----------
    models : Element
    pulleys : bool
        Whether its radii are meant: WireLib writes one, 0.1 m unless set, also of robots it takes to have none.

    Raises
    ------
    InputError
        What the file describes is no platform on wires, with file and line.
    """
    if models.all("wireRobot"):
        raise models.fail("<wireRobot>, the format before 0.32", "<robot>; WireX can save the robot anew")
    found = models.one("robot")
    pattern = found.attributes.get("motionpattern", "3R3T")
    if pattern not in _PATTERNS:
        raise found.fail(f"motionpattern {pattern!r}", f"one of {', '.join(_PATTERNS)}")
    chains = found.one("geometry").all("chain")
    if len(chains) < 2:
        raise found.fail(f"{len(chains)} chains", "at least two")
    bases = [chain.one("base") for chain in chains]
    radius = np.array([base.number("radius", 0.0) for base in bases]) if pulleys else np.zeros(len(bases))
    if radius.min() < 0:
        raise bases[int(radius.argmin())].fail(f"radius {radius.min():g}", "a number of at least 0")
    platform = found.one("platform")
    notes = []
    if radius.any():
        notes.append("Its pulley radii are taken as they are: WireX writes 0.1 m where none was set.")
    return ImportedRobot(
        Path(models.file).stem,
        f"Imported from WireX's {Path(models.file).name}.",
        _PATTERNS[pattern],
        platform.number("mass"),
        platform.one("centerofgravity").point(),
        np.array([base.point() for base in bases]),
        np.array([chain.one("platform").point() for chain in chains]),
        radius,
        np.array([_axis(base) for base in bases]),
        None,
        None,
        np.zeros(3),
        tuple(notes),
    )


def _axis(base: Element) -> Floats:
    """The third axis of a base's frame; upright where the file has no frame."""
    if "a33" not in base.attributes:
        return np.array([0.0, 0.0, 1.0])
    axis = np.array([base.number(name) for name in ("a13", "a23", "a33")])
    if not abs(np.linalg.norm(axis) - 1.0) < 1e-3:
        raise base.fail(f"the third axis {axis.tolist()}", "a unit vector in a13, a23, a33")
    return axis
