"""What interval arithmetic proves of a robot at a pose: one equilibrium, and a box that holds it for all wires."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from wirebayes.robot import control, inverse
from wirebayes.robot.certificate import certify
from wirebayes.robot.description import Robot
from wirebayes.robot.drift import Course
from wirebayes.robot.reach import apart, reach
from wirebayes.robot.wires import Wires

Floats = NDArray[np.float64]
SHARES = (1.0, 0.5, 0.25, 0.125, 0.0625)  # of the bands, the largest that can be proved


def alone(robot: Robot, wires: Wires, position_m: Floats, rotation: Floats) -> dict[str, Any]:
    """Proof that the mean wire has exactly one equilibrium here, when interval arithmetic is installed."""
    if wires.at("strain"):
        return {"proved": None, "sentence": "Proofs know laws (1), (3) and (6) without further effects."}
    mean = control.known(wires)
    k1 = np.broadcast_to(mean.theta["k1"][:, 0], robot.legs)
    tau = inverse.tensions(robot, position_m[None], rotation[None])
    here = inverse.commands(robot, mean, position_m[None], rotation[None], tau)
    lengths = here.zero_m[0], here.zero_m[0]
    try:
        proof = certify(robot, wires.law, (k1, k1), lengths, here.offset_m[0], position_m, rotation)
    except ImportError:
        return {"proved": None, "sentence": "python-flint is not installed (extra: certificate)."}
    return {"proved": proof.proved, "enclosure_m": proof.radius_m, "alone_within_m": proof.unique_m}


def enclosed(robot: Robot, wires: Wires, course: Course, position_m: Floats, rotation: Floats) -> dict[str, Any]:
    """Where the platform surely is at the last time while every wire's stiffness and creep lie in their 90 % bands.

    Each wire may lie anywhere in the bands on its own: a box that holds more than the joint posterior does. Commanded
    are the mean wire's joint values. Where the whole band cannot be proved, a share of it about its middle is.
    """
    if wires.at("strain") or not course.found.any():
        return {}
    from wirebayes.robot import forward

    mean = control.known(wires)
    tau = inverse.tensions(robot, position_m[None], rotation[None])
    told = inverse.commands(robot, mean, position_m[None], rotation[None], tau)
    bare, offset = inverse.lengths(robot, told.joint_m[0])
    strain = np.broadcast_to(course.end.strain(wires), (robot.legs, len(course.found)))[:, course.found]
    k1 = np.broadcast_to(wires.theta["k1"], (robot.legs, len(course.found)))[:, course.found]
    low, high = (np.quantile(k1, q, axis=1) for q in (0.05, 0.95))
    short, long = (bare * (1 + np.quantile(strain, q, axis=1)) for q in (0.05, 0.95))
    stiff, zero = 0.5 * (low + high), 0.5 * (short + long)
    middle = Wires(wires.law, wires.history, {"k1": stiff[:, None]}, wires.length_mm)
    found = forward.solve(robot, middle, zero[None], offset, position_m, rotation)
    if not found.found[0]:
        return {}
    left, _, right = np.linalg.svd(found.rotation[0])
    x, R = found.position_m[0], left @ right
    for share in SHARES:
        widths = apart(0.5 * share * (high - low), 0.5 * share * (long - short))
        try:
            proof = reach(robot, wires.law, stiff, zero, widths, offset, x, R)
        except ImportError:
            return {}
        if proof.proved:
            span = 1e3 * (x - position_m + np.array([-1.0, 1.0])[:, None] * proof.radius_m[:3])
            return {"band": {"time_s": course.times_s[-1], "share": share, "low_mm": span[0], "high_mm": span[1]}}
    return {"band": {"time_s": course.times_s[-1], "share": 0.0, "low_mm": None, "high_mm": None}}
