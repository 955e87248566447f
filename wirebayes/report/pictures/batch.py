"""Pictures of a batch: each parameter of all specimens, side by side by material."""

from collections import Counter
from collections.abc import Sequence

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
        fitted = [row for row in rows if name in row["parameters"]]
        for place, material in enumerate(materials):
            members = [row for row in fitted if row["material"] == material]
            _column(axis, place, name, members, marked)
        axis.set_title(label, fontsize=9, loc="left")
        _name_materials(axis, materials, rotation)
        axis.tick_params(axis="y", which="both", labelsize=7)
        if name in ("k1", "B", "k2"):
            logarithmic(axis, "y")
    return figure


def _name_materials(axis: Axes, materials: Sequence[str], rotation: int) -> None:
    """Below the columns."""
    names = [verbatim(material) for material in materials]
    axis.set_xticks(range(len(names)), names)
    axis.tick_params(axis="x", labelsize=7.5, rotation=rotation)
    without_frame(axis)
    axis.set_xlim(-0.6, len(names) - 0.4)


def _most_frequent(rows: list[Row]) -> list[str]:
    """The materials of most specimens."""
    count = Counter(row["material"] for row in rows if row["material"])
    materials = sorted(count, key=lambda material: -count[material])
    return materials[:_MOST_MATERIALS]


def _interval(row: Row, name: str) -> list[float]:
    """Ends and median of a parameter; creep per metre of length."""
    quantiles = row["parameters"][name]
    length_mm = row["length_mm"]
    scale = 1.0
    if name == "B" and length_mm:
        scale = 1e3 / length_mm
    return [scale * quantiles[quantile] for quantile in INTERVAL]


def _column(axis: Axes, place: int, name: str, members: list[Row], marked: set[tuple[str, str]]) -> None:
    """The specimens of one material."""
    shifts = np.linspace(-0.35, 0.35, len(members) + 2)[1:-1]
    for x, row in zip(place + shifts, members, strict=True):
        apart = (row["name"], name) in marked
        low, middle, high = _interval(row, name)
        colour, size = (HOLD, 5) if apart else (CHAIN, 3)
        if apart or len(members) <= _MOST_BARS:
            axis.plot([x, x], [low, high], "-", color=colour, lw=0.8, alpha=0.6)
        axis.plot([x], [middle], "o", color=colour, ms=size)
        if apart:
            axis.annotate(row["name"], (x, middle), (4, 4), textcoords="offset points", fontsize=7, color=colour)
