"""What is requested of a robot and a line, and how draws become a band."""

from dataclasses import dataclass

import numpy as np

from wirebayes.json_files.values import Band
from wirebayes.numeric.typing import Floats
from wirebayes.robot.motion.claim import DISTANCE_M, TILT_RAD
from wirebayes.robot.pose.maps import LEVEL, Slices
from wirebayes.robot.pose.orientation import Orientation

QUANTILES = {"q05": 0.05, "q50": 0.5, "q95": 0.95}  # the median and the 90 % interval, as everywhere


@dataclass(frozen=True)
class PoseRequest:
    """A request.

    Attributes
    ----------
    position_m : (3,) array
    rotation : (3, 3) array
    times_s : (t,) array
        Rising, the first zero.
    tolerance_m, tolerance_rad : float
        Of the pose, for the longest time between calibrations.
    specimen_spread : float
        Relative, of stiffness, creep amount and rate from wire to wire; answers are given for it and for wires alike.
    seed : int
    slices : Slices
        Of the workspace, to be mapped.
    orientation : Orientation or None
        How `rotation` was found, where it was not simply commanded.
    """

    position_m: Floats
    rotation: Floats
    times_s: Floats
    tolerance_m: float = DISTANCE_M
    tolerance_rad: float = TILT_RAD
    specimen_spread: float = 0.05
    seed: int = 0
    slices: Slices = LEVEL
    orientation: Orientation | None = None

    @property
    def spreads(self) -> tuple[float, float]:
        """Wires alike, and wires that differ."""
        return 0.0, self.specimen_spread


def band_over_draws(values: Floats) -> Band:
    """Mean, sd and quantiles over the first axis (the draws); NaN draws are left out."""
    good = values[np.isfinite(values).all(axis=tuple(range(1, values.ndim)))]
    if not len(good):
        return {"mean": None, "sd": None, "q05": None, "q50": None, "q95": None}
    low, middle, high = np.quantile(good, list(QUANTILES.values()), axis=0)
    return {"mean": good.mean(0), "sd": good.std(0), "q05": low, "q50": middle, "q95": high}
