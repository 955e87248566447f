"""Which combinations of a robot's unknowns its readings determine, in words.

The readings determine a combination where they leave less than half of its prior's standard deviation.
"""

from dataclasses import dataclass

import numpy as np

from wirebayes.numeric.typing import Bools, Floats
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.rotation import matrix
from wirebayes.robot.self_calibration.posterior import RobotPosterior
from wirebayes.sentences import short

_DETERMINED = 0.5  # of the standard deviation before
_FLAT = 1e-6  # of the span
_PART = 0.2  # of a combination: smaller parts are not named
_AXES = ("x", "y", "the vertical")
_SAYS = {
    "moved along x": "the whole robot may be moved along x",
    "moved along y": "the whole robot may be moved along y",
    "moved along the vertical": "the whole robot may be moved up or down",
    "turned about x": "the whole robot may be turned about the x axis",
    "turned about y": "the whole robot may be turned about the y axis",
    "turned about the vertical": "the whole robot may be turned about the vertical",
    "scaled": "the whole robot may be larger or smaller",
}


@dataclass(frozen=True)
class Combination:
    """A motion of all exit points together, or all values of one kind.

    Attributes
    ----------
    name : str
    before_mm, after_mm : float
        Standard deviation, as root mean square over its points or wires, m times 1000.
    determined : bool
    """

    name: str
    before_mm: float
    after_mm: float
    determined: bool


@dataclass(frozen=True)
class Identified:
    """What the readings determine.

    Attributes
    ----------
    determined, of : int
        Independent combinations of geometry and references that they determine, and all.
    combinations : list of Combination
    sentences : list of str
    weakest : (w,) array
        Unit combination of the reference lengths that is known least.
    weakest_sd_m : float
        Its standard deviation.
    """

    determined: int
    of: int
    combinations: list[Combination]
    sentences: list[str]
    weakest: Floats
    weakest_sd_m: float


def identified(found: RobotPosterior) -> Identified:
    """Compare the posterior of geometry and references with their prior.

    Parameters
    ----------
    found : RobotPosterior
    """
    combinations = _of_exit_points(found) if found.unknowns.errors.exit_m > 0 else []
    sentences = []
    for one in combinations:
        if not one.determined:
            known = f"known to {short(one.before_mm, 2)} mm before, to {short(one.after_mm, 2)} mm now"
            sentences.append(f"{_SAYS[one.name]}: {known}")
    sentences += _of_references(found)
    size = _sizes(found)
    count = int((np.sqrt(np.maximum(size, 0.0)) < _DETERMINED).sum())
    return Identified(count, len(size), combinations, sentences, *_weakest(found))


def weakest_in_words(weakest: Floats, sd_m: float) -> str:
    """A combination of reference lengths and how well it is known.

    Parameters
    ----------
    weakest : (w,) array
    sd_m : float
    """
    parts = []
    for i in np.argsort(-np.abs(weakest)):
        if abs(weakest[i]) > _PART:
            parts.append(f"{weakest[i]:+.2f} of wire {i + 1}")
    return f"{', '.join(parts)}, known to {short(1e3 * sd_m, 2)} mm"


def _weakest(found: RobotPosterior) -> tuple[Floats, float]:
    """The unit combination ``(w,)`` of the reference lengths that is known least, its largest part positive; its sd."""
    at = found.unknowns.references
    values, vectors = np.linalg.eigh(found.covariance[at, at])
    direction = vectors[:, -1]
    largest = direction[np.argmax(np.abs(direction))]
    return direction * np.sign(largest), found.unknowns.prior.reference_sd_m * float(np.sqrt(max(values[-1], 0.0)))


def _of_references(found: RobotPosterior) -> list[str]:
    """A sentence on each reference length that the readings do not determine."""
    sd = np.sqrt(np.diag(found.covariance)[found.unknowns.references])
    before = 1e3 * found.unknowns.prior.reference_sd_m
    out = []
    for i in np.flatnonzero(sd >= _DETERMINED):
        known = f"known to {short(before, 2)} mm before, to {short(before * sd[i], 2)} mm now"
        out.append(f"the reference length of wire {i + 1}: {known}")
    return out


def _sizes(found: RobotPosterior) -> Floats:
    """Variances of independent combinations of geometry and references, of their prior's."""
    unknowns = found.unknowns
    geometry = np.arange(unknowns.slices["wires"].start)
    if unknowns.prior.reference_sd_m > 0:
        geometry = np.r_[geometry, unknowns.references]
    if not len(geometry):
        return np.zeros(0)
    return np.linalg.eigvalsh(found.covariance[np.ix_(geometry, geometry)])


def _of_exit_points(found: RobotPosterior) -> list[Combination]:
    """How well each motion of all exit points together is known."""
    robot = found.unknowns.robot
    at = found.unknowns.slices["exit"]
    inside = found.covariance[at, at]
    before = 1e3 * found.unknowns.errors.exit_m / np.sqrt(len(robot.exit_m))
    out = []
    for name, direction in _motions(robot).items():
        left = float(np.sqrt(direction @ inside @ direction))
        out.append(Combination(name, before, before * left, left < _DETERMINED))
    return out


def _motions(robot: Robot) -> dict[str, Floats]:
    """Unit vectors ``(3 w,)`` of the ways in which all exit points move together; a set without extent has fewer.

    Of a robot that lies in a plane across an axis those that stay in it: across it no length changes at first.
    """
    points = robot.exit_m
    about = points - points.mean(0)
    ways = _ways(_flat(robot), about)
    ways["scaled"] = about
    least = 1e-6 * max(float(np.linalg.norm(about)), 1e-12)
    out = {}
    for name, way in ways.items():
        size = float(np.linalg.norm(way))
        if size > least:
            out[name] = way.ravel() / size
    return out


def _ways(flat: Bools, about: Floats) -> dict[str, Floats]:
    """(w, 3) displacements of points by motions of the whole, those across a plane left out."""
    turning = flat if flat.any() else np.ones(3, bool)
    axes = np.eye(3)
    out = {}
    for i in np.flatnonzero(~flat):
        out[f"moved along {_AXES[i]}"] = np.tile(axes[i], (len(about), 1))
    for i in np.flatnonzero(turning):
        out[f"turned about {_AXES[i]}"] = np.cross(axes[i], about)
    return out


def _flat(robot: Robot) -> Bools:
    """(3,) axes along which neither exit points nor platform have any extent."""
    platform = robot.home_m + robot.platform_m @ matrix(robot.home_rotation_rad).T
    extent = np.ptp(np.vstack([robot.exit_m, platform]), axis=0)
    return extent < _FLAT * robot.span_m
