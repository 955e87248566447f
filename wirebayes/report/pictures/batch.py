"""Pictures of a batch: each parameter of all specimens, side by side by material."""

from collections import Counter

import matplotlib

matplotlib.use("Agg")
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wirebayes.json_files.batch import OutlierRow, Row
from wirebayes.json_files.values import INTERVAL
from wirebayes.report.figures import CHAIN, HOLD, logarithmic, verbatim, without_frame

_SHOWN = {"k1": "k1, N", "B": "B, mm N⁻ᵁ per m of length", "U": "U", "k2": "k2, s⁻ᴺ", "N": "N"}
_MOST_BARS = 200  # specimens of which intervals are drawn: more are a smear
_MOST_MATERIALS = 12  # columns whose labels can be read
_MOST_UPRIGHT, _LONGEST_UPRIGHT = 3, 14  # materials, and letters of each, that stand side by side below a panel


def specimens_of_materials(rows: list[Row], far: list[OutlierRow]) -> Figure:
    """Posterior medians with 90 % intervals, a panel a parameter, a column a material.

    Parameters
    ----------
    rows : list of dict
        Fitted rows of ``batch.json``.
    far : list of dict
        Its outliers.
    """
    materials = _most_frequent(rows)
    marked = {(outlier["experiment"], outlier["parameter"]) for outlier in far}
    longest = max(map(len, materials), default=0)
    upright = len(materials) <= _MOST_UPRIGHT and longest <= _LONGEST_UPRIGHT
    height, rotation = (5.0, 0) if upright else (6.4, 90)
    figure = Figure(figsize=(8.6, height), layout="constrained")
    axes = figure.subplots(2, 3).ravel()
    axes[-1].set_axis_off()
    for axis, (name, label) in zip(axes, _SHOWN.items(), strict=False):
        for place, material in enumerate(materials):
            members = [row for row in rows if row["material"] == material and name in row["parameters"]]
            _column(axis, place, name, members, marked)
        axis.set_title(label, fontsize=9, loc="left")
        axis.set_xticks(range(len(materials)), list(map(verbatim, materials)))
        axis.tick_params(axis="x", labelsize=7.5, rotation=rotation)
        without_frame(axis)
        axis.set_xlim(-0.6, len(materials) - 0.4)
        axis.tick_params(axis="y", which="both", labelsize=7)
        if name in ("k1", "B", "k2"):
            logarithmic(axis, "y")
    return figure


def _most_frequent(rows: list[Row]) -> list[str]:
    """The materials of most specimens."""
    count = Counter(row["material"] for row in rows if row["material"])
    materials = sorted(count, key=lambda material: -count[material])
    return materials[:_MOST_MATERIALS]


def _column(axis: Axes, place: int, name: str, members: list[Row], marked: set[tuple[str, str]]) -> None:
    """The specimens of one material."""
    places = place + np.linspace(-0.35, 0.35, len(members) + 2)[1:-1]
    for x, row in zip(places, members, strict=True):
        scale = 1e3 / row["length_mm"] if name == "B" and row["length_mm"] else 1.0
        low, middle, high = (scale * row["parameters"][name][quantile] for quantile in INTERVAL)
        apart = (row["name"], name) in marked
        colour = HOLD if apart else CHAIN
        if len(members) <= _MOST_BARS or apart:
            axis.plot([x, x], [low, high], "-", color=colour, lw=0.8, alpha=0.6)
        axis.plot([x], [middle], "o", color=colour, ms=5 if apart else 3)
        if apart:
            axis.annotate(row["name"], (x, middle), (4, 4), textcoords="offset points", fontsize=7, color=colour)
