"""The picture of a posterior: every pair of its parameters, and each alone."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from contourpy import FillType, contour_generator
from matplotlib.collections import LineCollection, PatchCollection, PathCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.path import Path
from matplotlib.ticker import MaxNLocator

from wirebayes.numeric.typing import Array, Ints
from wirebayes.report.figures import CHAIN, INK, axis_label
from wirebayes.wire.protocol import Control


def corner(draws: Mapping[str, Array], effects: tuple[Any, ...] = (), control: Control = "displacement") -> Figure:
    """Every pair of parameters: the regions that hold 50 and 90 % of the draws; on the diagonal, each alone.

    Parameters
    ----------
    draws : mapping of name to (n,) array
        Of two parameters or more; none is the same in all draws.
    effects : tuple of Effect
    """
    count = len(draws)
    figure, axes = _grid(count)
    scaled = [_straight(values) for values in draws.values()]
    unit = [_across(values) for values, _ in scaled]
    _shade_pairs(axes, unit)
    _histograms(axes, unit)
    for i, name in enumerate(draws):
        places, labels = _few_ticks(*scaled[i])
        ticks = list(zip(places, labels, strict=True))
        label = axis_label(name, effects, control)
        words = _in_lines(label)
        _label_below(axes, i, words, ticks)
        bottom = count - 1 - i
        if i:
            _label_beside(axes, bottom, words, ticks)
    _outline_cells(axes, count)
    return figure


def _outline_cells(axes: Any, count: int) -> None:
    frames = []
    for i in range(count):
        bottom = count - 1 - i
        frames += [Rectangle((j, bottom), _SIDE, _SIDE) for j in range(i + 1)]
    outlines = PatchCollection(frames, facecolor="none", edgecolor=INK, linewidth=0.8)
    axes.add_collection(outlines)


def _in_lines(label: str) -> str:
    """Name and unit of a parameter, each in lines that stay within a cell."""
    lines = label.replace(", ", ",\n").split("\n")
    return "\n".join(_narrow(line) for line in lines)


def _shade_pairs(axes: Any, unit: Sequence[Array]) -> None:
    """Below the diagonal, the regions of each pair, as shares of its cell."""
    count = len(unit)
    places = [_bins(values) for values in unit]
    most: list[Path] = []
    half: list[Path] = []
    for i in range(count):
        for j in range(i):
            cell = j, count - 1 - i
            in_most, in_half = _regions(places[j], places[i], cell)
            most += in_most
            half += in_half
    for paths, colour in ((most, "#b5c4d1"), (half, CHAIN)):
        regions = PathCollection(paths, facecolor=colour, linewidth=0.0)
        axes.add_collection(regions, autolim=False)


def _histograms(axes: Any, unit: Sequence[Array]) -> None:
    """On the diagonal, the draws of each parameter alone."""
    edges = np.linspace(0.0, 1.0, 31)
    outlines = []
    for i, values in enumerate(unit):
        bottom = len(unit) - 1 - i
        heights = np.histogram(values, edges)[0]
        stairs = bottom + 0.92 * _SIDE * heights / heights.max()
        upper = np.concatenate([[bottom], stairs.repeat(2), [bottom]])
        outlines.append(np.column_stack([i + _SIDE * edges.repeat(2), upper]))
    axes.add_collection(PolyCollection(outlines, facecolor=CHAIN, alpha=0.75, linewidth=0.0), autolim=False)


def _grid(count: int) -> tuple[Figure, Any]:
    """One pair of axes, on which every cell is a unit square: a pair for each cell takes seconds to draw."""
    left, below = 0.9, 0.8  # room for three lines
    width = 1.1 * count + left + 0.05
    height = 1.05 * count + below + 0.05
    figure = Figure(figsize=(width, height))
    axes: Any = figure.add_axes((left / width, below / height, 1.1 * count / width, 1.05 * count / height))
    axes.set_axis_off()
    axes.set_xlim(-_GAP / 2, count - 1 + _SIDE + _GAP / 2)
    axes.set_ylim(-_GAP / 2, count - 1 + _SIDE + _GAP / 2)
    return figure, axes


def _label_below(axes: Any, left: int, words: str, ticks: Sequence[tuple[float, str]]) -> None:
    """Name and ticks of a column."""
    axes.text(left + _SIDE / 2, -0.42, words, fontsize=8, ha="center", va="top")
    _ticks(axes, [(left + _SIDE * t, 0.0) for t, _ in ticks], (0.0, -_TICK))
    for t, label in ticks:
        axes.text(left + _SIDE * t, -2 * _TICK, label, fontsize=7, rotation=45, ha="center", va="top")


def _label_beside(axes: Any, bottom: int, words: str, ticks: Sequence[tuple[float, str]]) -> None:
    """Name and ticks of a row."""
    upright: dict[str, Any] = {"rotation": 90, "ha": "right", "va": "center", "multialignment": "center"}
    axes.text(-0.42, bottom + _SIDE / 2, words, fontsize=8, **upright)
    _ticks(axes, [(0.0, bottom + _SIDE * t) for t, _ in ticks], (-_TICK, 0.0))
    for t, label in ticks:
        axes.text(-2 * _TICK, bottom + _SIDE * t, label, fontsize=7, ha="right", va="center")


def _narrow(line: str) -> str:
    """A name in as many lines as it takes to stay within its cell, broken after underscores."""
    lines = [""]
    for part in line.replace("_", "_\n").split("\n"):
        if lines[-1] and len(lines[-1] + part) > _LONGEST:
            lines.append("")
        lines[-1] += part
    return "\n".join(lines)


def _straight(values: Array) -> tuple[Array, bool]:
    """The values, or their decimal logarithms where they are positive and spread widely."""
    wide = values.min() > 0 and np.quantile(values, 0.95) > 4 * np.quantile(values, 0.05)
    return (np.log10(values), True) if wide else (values, False)


def _ends(values: Array) -> tuple[float, float]:
    """Where a cell begins and ends: all draws but a few at either end, and a margin."""
    low, high = np.quantile(values, [0.002, 0.998])
    margin = 0.05 * (high - low)
    return float(low - margin), float(high + margin)


def _across(values: Array) -> Array:
    """The values as shares of their cell."""
    low, high = _ends(values)
    return (values - low) / (high - low)


def _few_ticks(values: Array, is_log: bool) -> tuple[Array, list[str]]:
    """Places of a few ticks as shares of the cell, and their labels."""
    low, high = _ends(values)
    width = high - low
    margin = 0.05 * width  # labels of neighbouring cells do not touch
    first = low + margin
    last = high - margin
    if is_log:
        ticks = _logarithmic_ticks(first, last)
        labels = [f"{10**tick:.6g}" for tick in ticks]
    else:
        locator = MaxNLocator(_MOST_TICKS, steps=[1, 2, 2.5, 5, 10])
        ticks = np.array(locator.tick_values(low, high))
        ticks = _between(ticks, first, last)
        is_zero = np.abs(ticks) < 1e-9 * width
        ticks = np.where(is_zero, 0.0, ticks)
        labels = [f"{tick:.10g}".replace("-", "\N{MINUS SIGN}") for tick in ticks]
    places = (ticks - low) / width
    return places, labels


def _logarithmic_ticks(first: float, last: float) -> Array:
    """Decimal logarithms of a few round numbers between two ends."""
    decades = np.arange(np.floor(first) - 1, np.ceil(last) + 2)
    for within in ((1.0, 2.0, 5.0), (1.0, 3.0), (1.0,)):
        ticks = np.sort(np.log10(within) + decades[:, None], axis=None)
        ticks = _between(ticks, first, last)
        if len(ticks) <= _MOST_TICKS:
            return ticks
    step = -(-len(ticks) // _MOST_TICKS)
    return ticks[::step]


def _between(ticks: Array, first: float, last: float) -> Array:
    inside = (first <= ticks) & (ticks <= last)
    return ticks[inside]


def _ticks(axes: Any, places: Sequence[tuple[float, float]], step: tuple[float, float]) -> None:
    """Short lines from the places outwards."""
    across, upward = step
    lines = [((x, y), (x + across, y + upward)) for x, y in places]
    axes.add_collection(LineCollection(lines, colors=INK, linewidths=0.8, clip_on=False))


def _bins(unit: Array) -> Ints:
    """(n,) the bin of each draw along an axis of its cell; `_BINS` outside."""
    inside = (unit >= 0.0) & (unit <= 1.0)
    return np.where(inside, np.minimum(unit * _BINS, _BINS - 1), _BINS).astype(np.int64)


def _regions(x: Ints, y: Ints, corner: tuple[float, float]) -> tuple[list[Path], list[Path]]:
    """Outlines in a cell of the densest places, smoothed over neighbours: of 50 to 90 % of the draws, and of 50 %."""
    density = _density(x, y)
    ranked = np.sort(density.ravel())[::-1]
    held = np.cumsum(ranked) / ranked.sum()
    at_half, at_most = np.searchsorted(held, [0.5, 0.9])
    half = float(ranked[at_half])
    most = float(ranked[at_most])
    if not 0 < most < half < ranked[0]:
        return [], []
    left, bottom = corner
    middles = (np.arange(_BINS) + 0.5) / _BINS
    across = left + _SIDE * middles
    upward = bottom + _SIDE * middles
    contours = contour_generator(across, upward, density.T, fill_type=FillType.OuterCode)
    outer = _outlines(contours, most, half)
    inner = _outlines(contours, half, np.inf)
    return outer, inner


def _density(x: Ints, y: Ints) -> Array:
    """Draws in each cell of a grid, given their bins, smoothed over neighbours; those outside are left out."""
    cells = _BINS + 1
    counts = np.bincount(x * cells + y, minlength=cells**2)
    inside = counts.reshape(cells, cells)[:-1, :-1]
    return _SMOOTHING @ inside @ _SMOOTHING.T


def _outlines(contours: Any, low: float, high: float) -> list[Path]:
    """Outlines of where a density lies between two values."""
    points, codes = contours.filled(low, high)
    return [Path(*outline) for outline in zip(points, codes, strict=True)]


_MOST_TICKS = 4  # so that labels do not touch
_SIDE, _GAP, _TICK = 0.92, 0.08, 0.035  # of a cell, between cells and of a tick, in units of both together
_LONGEST = 17  # letters of a name that fit into a cell
_BINS = 22  # of a cell along each axis: fine enough to look smooth


def _smoothing() -> Array:
    """(cells, cells) weights of the neighbours of each cell along one axis: normal, and reflected at the ends."""
    reach = np.arange(-_REACH, _REACH + 1)
    weights = np.exp(-0.5 * (reach / _BLUR) ** 2)
    own = np.arange(_BINS)[:, None]
    neighbour = own + reach
    from_end = np.minimum(neighbour, 2 * _BINS - 1 - neighbour)
    inside = np.where(neighbour < 0, -1 - neighbour, from_end)
    matrix = np.zeros((_BINS, _BINS))
    np.add.at(matrix, (own, inside), weights / weights.sum())
    return matrix


_BLUR, _REACH = 1.0, 4  # cells: standard deviation, and where its tail is cut off
_SMOOTHING = _smoothing()
