"""Specimens whose parameters lie far from those of the others of their material.

A robust z: the distance of a specimen's posterior median from the median of all specimens of the material, divided by
the expected distance, which combines the spread of the specimens (from the median absolute deviation) and the width of
this specimen's posterior. Neither a few outliers nor one badly determined specimen affects it much.

What belongs to the bench, such as the error of its sensor, is compared among tests by steps, and among tests under
weights: one bench reads tensions, the other displacements. B and k2 are compared at the typical tension and after the
typical hold of the material's tests: how far specimens of other exponents lie apart in the creep at one newton depends
on what is called a newton.
"""

from collections.abc import Iterable, Sequence

import numpy as np
from scipy.special import stdtrit

from wirebayes.json_files.batch import OutlierRow, Row
from wirebayes.json_files.values import INTERVAL, Quantiles
from wirebayes.model.sample import SAMPLE
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
        comparable: dict[tuple[str, str | None], list[Row]] = {}
        for row in members:
            for name in row["parameters"]:
                bench = row.get("control") if name in SAMPLE else None
                comparable.setdefault((name, bench), []).append(row)
        for (name, _), specimens in comparable.items():
            if len(specimens) >= LEAST_SPECIMENS:
                limit = threshold(len(specimens), parameters)
                found += _far_off(material, name, specimens, limit)
    found.sort(key=lambda outlier: (-abs(outlier["z"]), outlier["experiment"]))
    return found


def _far_off(material: str, name: str, specimens: list[Row], limit: float) -> list[OutlierRow]:
    """The specimens of a material whose parameter has a z beyond a limit."""
    label, (low, value, high) = _compared(name, specimens)
    if (low > 0).all():
        z = robust_z(np.log(value), np.log(high / low) / _NINETY)
    else:
        z = robust_z(value, (high - low) / _NINETY)
    median = float(np.median(value))
    found = []
    for i in np.flatnonzero(np.abs(z) > limit):
        experiment = specimens[i]["name"]
        outlier = _row(experiment, material, name, label, float(value[i]), median, float(z[i]), len(z))
        found.append(outlier)
    return found


def _compared(name: str, specimens: list[Row]) -> tuple[str, Array]:
    """What is compared of a parameter, in words, and (3, n) ends of its interval and the median between them."""
    typical = [row.get("at_typical") for row in specimens]
    if name == "B":
        label = "B per m of length"
        intervals = _quantiles([row["parameters"][name] for row in specimens])
        known = [(one["B"], one["tension_N"]) for one in typical if one and one["B"]["q05"] > 0.0]
        if len(known) == len(specimens):
            intervals, tension_N = _at_one_scale("U", specimens, known)
            label = f"creep at {short(tension_N, 3)} N in mm per m of length"
        # an elongation: specimens may differ in length
        metres = np.array([float(row["length_mm"] or np.nan) / 1e3 for row in specimens])
        return label, intervals / metres
    known = [(one["k2"], one["time_s"]) for one in typical if one and one["k2"]["q05"] > 0.0]
    if name == "k2" and len(known) == len(specimens):
        intervals, time_s = _at_one_scale("N", specimens, known)
        return f"k2 t^N after {short(time_s, 3)} s", intervals
    return name, _quantiles([row["parameters"][name] for row in specimens])


def _quantiles(figures: Sequence[Quantiles]) -> Array:
    """(3, n) ends of intervals and the medians between them."""
    return np.array([[of[quantile] for of in figures] for quantile in INTERVAL])


def _at_one_scale(exponent: str, specimens: list[Row], known: Sequence[tuple[Quantiles, float]]) -> tuple[Array, float]:
    """What is known at each specimen's own tension or time, at the middle one of the material, and this.

    Parameters
    ----------
    exponent : str
        The parameter that says with which power of the tension or the time it grows.
    specimens : list of Row
    known : sequence of (Quantiles, float)
        With the tension or time, a specimen each.
    """
    own = np.log([scale for _, scale in known])
    middle = float(np.median(own))
    away = middle - own
    low, power, high = _quantiles([row["parameters"][exponent] for row in specimens])
    below, value, above = np.log(_quantiles([of for of, _ in known]))
    moved = value + power * away
    by_power = (high - low) / 2.0 * away  # hardly correlated with what is known at the own scale
    to_low = np.hypot(value - below, by_power)
    to_high = np.hypot(above - value, by_power)
    log_known = np.array([moved - to_low, moved, moved + to_high])
    return np.exp(log_known), float(np.exp(middle))


def _row(
    experiment: str, material: str, parameter: str, label: str, value: float, median: float, z: float, specimens: int
) -> OutlierRow:
    side = "above" if z > 0 else "below"
    sentence = (
        f"{experiment}: {label} is {short(value, 4)}, {abs(z):.1f} robust standard deviations {side} "
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
