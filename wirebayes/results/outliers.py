"""Specimens whose parameters lie far from those of the others of their material.

A robust z: the distance of a specimen's posterior median from the median of all specimens of the material, divided by
the expected distance, which combines the spread of the specimens (from the median absolute deviation) and the width of
this specimen's posterior. Neither a few outliers nor one badly determined specimen affects it much.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from wirebayes.typing import Array

FALSE_ALARMS = 0.05  # of materials whose specimens are all alike, the usual one in twenty has an outlier
LEAST_SPECIMENS = 6  # with fewer, one would have to lie more than twelve spreads away to be called far
MAD_TO_SD = 1.4826  # of a normal distribution
MAD_EFFICIENCY = 0.37  # the median absolute deviation of n normal values knows their spread as 0.37 n of them would
_LEAST = 1e-9  # spread in logarithms or in the parameter's own unit: equal values are no reason to divide by zero


@dataclass(frozen=True)
class Outlier:
    """One parameter of one specimen.

    Attributes
    ----------
    experiment, material, parameter : str
    value, median : float
        Posterior median of the specimen, and the median over the material's specimens; B per m of length.
    z : float
        Robust standard deviations between them.
    specimens : int
        How many of the material were compared.
    """

    experiment: str
    material: str
    parameter: str
    value: float
    median: float
    z: float
    specimens: int

    @property
    def sentence(self) -> str:
        """The finding in words."""
        called = f"{self.parameter} per m of length" if self.parameter == "B" else self.parameter
        side = "above" if self.z > 0 else "below"
        return (
            f"{self.experiment}: {called} is {self.value:.4g}, {abs(self.z):.1f} robust standard deviations {side} "
            f"the median of {self.specimens} specimens of {self.material}, {self.median:.4g}"
        )


def outliers(rows: Sequence[Mapping[str, Any]]) -> list[Outlier]:
    """The outliers among fitted specimens, farthest first.

    Parameters
    ----------
    rows : sequence of mappings
        ``name``, ``material``, ``length_mm`` and ``parameters``: for each the ``q05``, ``q50``, ``q95`` of its
        posterior. Rows without parameters are passed over.

    Returns
    -------
    list of Outlier
    """
    materials: dict[str, list[Mapping[str, Any]]] = {}
    for row in rows:
        if row["parameters"]:
            materials.setdefault(row["material"], []).append(row)
    found = []
    for material, members in materials.items():
        for name in dict.fromkeys(p for row in members for p in row["parameters"]):
            have = [row for row in members if name in row["parameters"]]
            if len(have) < LEAST_SPECIMENS:
                continue
            low, value, high = (np.array([row["parameters"][name][q] for row in have]) for q in ("q05", "q50", "q95"))
            if name == "B":  # an elongation: specimens may differ in length
                low, value, high = (v / np.array([row["length_mm"] / 1e3 for row in have]) for v in (low, value, high))
            positive = bool((low > 0).all())
            x, sd = (np.log(value), np.log(high / low)) if positive else (value, high - low)
            z = robust_z(x, sd / _NINETY)
            far = np.flatnonzero(np.abs(z) > threshold(len(have), len(members[0]["parameters"])))
            found += [
                Outlier(have[i]["name"], material, name, float(value[i]), float(np.median(value)), float(z[i]), len(z))
                for i in far
            ]
    return sorted(found, key=lambda outlier: (-abs(outlier.z), outlier.experiment))


_NINETY = 2 * 1.645  # standard deviations between the 5 % and the 95 % quantile


def robust_z(values: Array, sd: Array) -> Array:
    """(n,) robust z of values, each known to a standard deviation of its own.

    The spread between specimens is what their scatter has beyond the typical width of a posterior.
    """
    centre = np.median(values)
    scatter = MAD_TO_SD * np.median(np.abs(values - centre))
    spread = max(float(scatter**2 - np.median(sd) ** 2), 0.0)
    return np.asarray((values - centre) / np.sqrt(np.maximum(spread + sd**2, _LEAST**2)))


def threshold(specimens: int, parameters: int) -> float:
    """The size of z that no specimen of a material exceeds in any parameter, with probability 1 - `FALSE_ALARMS`.

    Student's t with as many degrees of freedom as the median absolute deviation is worth, and one more, which the
    simulations of the tests show to keep the level for 6 to 200 specimens.
    """
    tests = 2 * specimens * parameters
    return float(stats.t.ppf(1.0 - FALSE_ALARMS / tests, 1.0 + MAD_EFFICIENCY * specimens))
