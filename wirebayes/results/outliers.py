"""Specimens whose parameters lie far from those of the others of their material.

A robust z: the distance of a specimen's posterior median from the median of all specimens of the material, divided by
the expected distance, which combines the spread of the specimens (from the median absolute deviation) and the width of
this specimen's posterior. Neither a few outliers nor one badly determined specimen affects it much.
"""

from collections.abc import Iterable

import numpy as np
from scipy.special import stdtrit

from wirebayes.json_files.batch import OutlierRow, Row
from wirebayes.json_files.values import INTERVAL
from wirebayes.numeric.typing import Array
from wirebayes.sentences import short

FALSE_ALARMS = 0.05  # of materials whose specimens are all alike, the usual one in twenty has an outlier
LEAST_SPECIMENS = 6  # with fewer, one would have to lie more than twelve spreads away to be called far
MAD_TO_SD = 1.4826  # of a normal distribution
MAD_EFFICIENCY = 0.37  # the median absolute deviation of n normal values knows their spread as 0.37 n of them would
_LEAST = 1e-9  # spread in logarithms or in the parameter's own unit: equal values are no reason to divide by zero


def outliers(rows: Iterable[Row]) -> list[OutlierRow]:
    """The outliers among fitted specimens, farthest first.

    Parameters
    ----------
    rows : iterable of Row
        Of ``batch.json``; rows without parameters are passed over.

    Returns
    -------
    list of OutlierRow
    """
    materials: dict[str, list[Row]] = {}
    for row in rows:
        if row["parameters"] and row["material"] is not None:
            materials.setdefault(row["material"], []).append(row)
    found: list[OutlierRow] = []
    for material, members in materials.items():
        parameters = len(members[0]["parameters"])
        with_parameter: dict[str, list[Row]] = {}
        for row in members:
            for name in row["parameters"]:
                with_parameter.setdefault(name, []).append(row)
        for name, specimens in with_parameter.items():
            if len(specimens) >= LEAST_SPECIMENS:
                limit = threshold(len(specimens), parameters)
                found += _far_off(material, name, specimens, limit)
    found.sort(key=lambda outlier: (-abs(outlier["z"]), outlier["experiment"]))
    return found


def _far_off(material: str, name: str, specimens: list[Row], limit: float) -> list[OutlierRow]:
    """The specimens of a material whose parameter has a z beyond a limit."""
    low, value, high = _intervals(name, specimens)
    if (low > 0).all():
        z = robust_z(np.log(value), np.log(high / low) / _NINETY)
    else:
        z = robust_z(value, (high - low) / _NINETY)
    median = float(np.median(value))
    found = []
    for i in np.flatnonzero(np.abs(z) > limit):
        found.append(_row(specimens[i]["name"], material, name, float(value[i]), median, float(z[i]), len(z)))
    return found


def _intervals(name: str, specimens: list[Row]) -> tuple[Array, Array, Array]:
    """Ends of the interval of a parameter and the median between them, of each specimen."""
    intervals = []
    for row in specimens:
        # an elongation: specimens may differ in length
        metres = float(row["length_mm"] or np.nan) / 1e3 if name == "B" else 1.0
        figures = row["parameters"][name]
        intervals.append([figures[quantile] / metres for quantile in INTERVAL])
    low, value, high = np.array(intervals).T
    return low, value, high


def _row(
    experiment: str, material: str, parameter: str, value: float, median: float, z: float, specimens: int
) -> OutlierRow:
    called = f"{parameter} per m of length" if parameter == "B" else parameter
    side = "above" if z > 0 else "below"
    sentence = (
        f"{experiment}: {called} is {short(value, 4)}, {abs(z):.1f} robust standard deviations {side} "
        f"the median of {specimens} specimens of {material}, {short(median, 4)}"
    )
    return {
        "experiment": experiment,
        "material": material,
        "parameter": parameter,
        "value": value,
        "median": median,
        "z": z,
        "specimens": specimens,
        "sentence": sentence,
    }


_NINETY = 2 * 1.645  # standard deviations between the 5 % and the 95 % quantile


def robust_z(values: Array, sd: Array) -> Array:
    """(n,) robust z of values, each known to a standard deviation of its own.

    The spread between specimens is what their scatter has beyond the typical width of a posterior.
    """
    centre = np.median(values)
    away = values - centre
    scatter = MAD_TO_SD * np.median(np.abs(away))
    spread = max(float(scatter**2 - np.median(sd) ** 2), 0.0)
    expected = np.sqrt(np.maximum(spread + sd**2, _LEAST**2))
    return np.asarray(away / expected)


def threshold(specimens: int, parameters: int) -> float:
    """The size of z that no specimen of a material exceeds in any parameter, with probability 1 - `FALSE_ALARMS`.

    Student's t with as many degrees of freedom as the median absolute deviation is worth, and one more, which the
    simulations of the tests show to keep the level for 6 to 200 specimens.
    """
    tests = 2 * specimens * parameters
    return float(stdtrit(1.0 + MAD_EFFICIENCY * specimens, 1.0 - FALSE_ALARMS / tests))
