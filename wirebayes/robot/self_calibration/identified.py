"""Which combinations of a robot's unknowns its readings determine, in words.

The readings determine a combination where they leave less than half of its prior's standard deviation.
"""

from dataclasses import dataclass

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.robot.self_calibration.posterior import Whole

_DETERMINED = 0.5  # of the standard deviation before
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
    """

    determined: int
    of: int
    combinations: list[Combination]
    sentences: list[str]


def identified(found: Whole) -> Identified:
    """Compare the posterior of geometry and references with their prior.

    Parameters
    ----------
    found : Whole
    """
    unknowns = found.unknowns
    prior, errors, at = unknowns.prior, unknowns.errors, unknowns.slices
    geometry = np.r_[0 : at["wires"].start, unknowns.references]
    if prior.reference_sd_m <= 0:
        geometry = geometry[: at["wires"].start]
    size = np.linalg.eigvalsh(found.covariance[np.ix_(geometry, geometry)]) if len(geometry) else np.zeros(0)
    combinations = []
    if errors.exit_m > 0:
        inside = found.covariance[at["exit"], at["exit"]]
        for name, direction in _motions(unknowns.robot.exit_m).items():
            left = float(np.sqrt(direction @ inside @ direction))
            before = 1e3 * errors.exit_m / np.sqrt(len(unknowns.robot.exit_m))
            combinations.append(Combination(name, before, before * left, left < _DETERMINED))
    sentences = [
        _SAYS[one.name] + f": known to {one.before_mm:.2g} mm before, to {one.after_mm:.2g} mm now"
        for one in combinations
        if not one.determined
    ]
    known = np.sqrt(np.diag(found.covariance)[unknowns.references])
    before = 1e3 * prior.reference_sd_m
    for i in np.flatnonzero(known >= _DETERMINED):
        sentences.append(
            f"the reference length of wire {i + 1}: known to {before:.2g} mm before, to {before * known[i]:.2g} mm now"
        )
    count = int((np.sqrt(np.maximum(size, 0.0)) < _DETERMINED).sum())
    return Identified(count, len(size), combinations, sentences)


def _motions(points: Floats) -> dict[str, Floats]:
    """Unit vectors ``(3 w,)`` of the ways in which all points move together; a point set without extent has fewer."""
    about = points - points.mean(0)
    ways = {f"moved along {axis}": np.tile(np.eye(3)[i], (len(points), 1)) for i, axis in enumerate(_AXES)}
    ways |= {f"turned about {axis}": np.cross(np.eye(3)[i], about) for i, axis in enumerate(_AXES)}
    ways["scaled"] = about
    least = 1e-6 * max(float(np.linalg.norm(about)), 1e-12)
    sizes = {name: float(np.linalg.norm(way)) for name, way in ways.items()}
    return {name: way.ravel() / sizes[name] for name, way in ways.items() if sizes[name] > least}
