"""Pictures of tests and posteriors, each a small panel that stays readable on a phone."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from contourpy import FillType, contour_generator
from matplotlib.collections import LineCollection, PatchCollection, PathCollection
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont, get_font
from matplotlib.patches import Rectangle
from matplotlib.path import Path
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullLocator

from wirebayes.json_files.summary import ExtrapolatedCreep
from wirebayes.numeric.typing import Array
from wirebayes.report.blocks import unit_text
from wirebayes.results.parameters import unit_of
from wirebayes.wire.protocol import Control, Protocol

CHAIN, HOLD, QUIET, INK = "#30506d", "#c8553d", "#b9bec4", "#1d2226"
COLOURS = {"chain": CHAIN, "hold": HOLD}
WORDS = {"chain": "holds as one chain", "hold": "hold by hold"}
HALF_90 = 1.645  # standard deviations on either side of a mean that hold 90 %
_SIZE = (4.7, 3.4)  # inches: two panels stand side by side on a page


def verbatim(text: str) -> str:
    """A user's words for a picture as they stand: no formulas between dollars, a mark for what the font lacks."""
    has = get_font(findfont(FontProperties())).get_char_index
    return "".join(c if has(ord(c)) else "\ufffd" for c in text).replace("$", r"\$")


def panel(xlabel: str, ylabel: str, title: str = "", size: tuple[float, float] = _SIZE) -> tuple[Figure, Any]:
    """An empty panel with labelled axes.

    Parameters
    ----------
    xlabel, ylabel, title : str
    size : (float, float)
        Width and height, inches.

    Returns
    -------
    figure : matplotlib.figure.Figure
    axes : matplotlib.axes.Axes
    """
    figure = Figure(figsize=size, layout="constrained")
    axes: Any = figure.subplots()
    axes.set_xlabel(xlabel)
    axes.set_ylabel(ylabel)
    if title:
        # at a stated height: to look for one that clears the ticks takes as long as to draw the rest
        axes.set_title(title, fontsize=10.5, loc="left", color=INK, y=1.0)
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(labelsize=9)
    return figure, axes


def legend(axes: Any, **where: Any) -> None:
    """A quiet legend."""
    axes.legend(frameon=False, fontsize=8.5, handlelength=1.6, borderaxespad=0.2, **where)


def legend_below(figure: Figure, axes: Any, columns: int = 2) -> None:
    """A legend under the panel, where it hides nothing.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Whose labelled lines the legend names.
    """
    place: Any = "outside lower center"
    figure.legend(
        *axes.get_legend_handles_labels(), loc=place, ncols=columns, frameon=False, fontsize=8.5, handlelength=1.6
    )


def apart(rows: Array) -> Array:
    """Rows (n, m) one after the other with a gap behind each: a line for all of them takes a tenth of the time of n."""
    return np.column_stack([rows, np.full(len(rows), np.nan)]).ravel()


def measured(protocol: Protocol, readings: Array, title: str) -> Figure:
    """What was read against what was set: each hold's first reading (blue) and its later ones (red).

    Parameters
    ----------
    readings : (H, R) array
    """
    weights = protocol.control == "force"
    across, upward = ("weight, N", "displacement, mm") if weights else ("displacement, mm", "tension, N")
    figure, axes = panel(across, upward, title)
    seen = protocol.mask.any(axis=1)
    for x in protocol.setting[~seen]:
        axes.axvline(x, color=QUIET, ls=":", lw=1.2, label="held, not recorded")
    read = np.where(protocol.mask, readings, np.nan)[seen]
    ends = np.stack([np.nanmin(read, axis=1), np.nanmax(read, axis=1)], axis=1)
    axes.plot(apart(protocol.setting[seen].repeat(2).reshape(-1, 2)), apart(ends), color=QUIET, lw=1.5, zorder=1)
    hold, reading = np.nonzero(protocol.mask)
    first = np.diff(hold, prepend=-1) != 0
    x, y = protocol.setting[hold], readings[hold, reading]
    axes.scatter(x[first], y[first], s=22, color=CHAIN, zorder=3, label="when the hold begins")
    if not first.all():
        axes.scatter(x[~first], y[~first], s=11, color=HOLD, zorder=2, label="later readings")
    legend(axes, loc="lower right")
    if not weights and readings[protocol.mask].min() >= 0.0:  # noise of a slack wire reaches below
        axes.set_ylim(bottom=0)
    return figure


def joint(
    x: Mapping[str, Array],
    y: Mapping[str, Array],
    xlabel: str,
    ylabel: str,
    title: str = "",
    mark: tuple[float, float] | None = None,
) -> Figure:
    """Draws of two positive quantities, on logarithmic axes.

    Parameters
    ----------
    x, y : mapping of likelihood to (n,) array
    mark : (x, y), optional
        The published pair.
    """
    figure, axes = panel(xlabel, ylabel, title)
    for kind, across in x.items():
        axes.scatter(across, y[kind], s=3, alpha=0.35, lw=0, color=COLOURS.get(kind, QUIET), rasterized=True)
        axes.scatter([], [], s=18, color=COLOURS.get(kind, QUIET), label=WORDS.get(kind, kind))
    if mark is not None:
        axes.scatter(*mark, marker="X", s=90, color=INK, edgecolor="white", lw=1.2, zorder=5, label="published")
    logarithmic(axes, "both")
    legend_below(figure, axes, 3)
    return figure


def axis_label(name: str, effects: tuple[Any, ...] = (), control: Control = "displacement") -> str:
    """A parameter with its unit, as an axis says it.

    Parameters
    ----------
    effects : tuple of Effect
    control : {"displacement", "force"}
    """
    unit = unit_text(unit_of(name, effects, (control,)))
    return f"{name}, {unit}" if unit else name


def logarithmic(axes: Any, which: str = "x") -> None:
    """Logarithmic axes with a few ticks that print plain numbers; linear where nothing is above zero."""
    for name in ("x", "y") if which == "both" else (which,):
        if getattr(axes.dataLim, f"{name}1") <= 0:
            continue
        getattr(axes, f"set_{name}scale")("log")
        axis = getattr(axes, f"{name}axis")
        low, high = sorted(getattr(axes, f"get_{name}lim")())
        decades = np.log10(high / low)
        subs = (1.0, 2.0, 5.0) if decades < 1.6 else (1.0, 3.0) if decades < 2.6 else (1.0,)
        axis.set_major_locator(LogLocator(subs=subs))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.10g}".replace(",", "\u2009")))
        axis.set_minor_locator(NullLocator())  # there are dozens of minor ticks, and each is placed several times


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
    scaled = {name: _straight(values) for name, values in draws.items()}
    unit = [_across(values) for values, _ in scaled.values()]
    _shade_pairs(axes, unit)
    for i, (name, (values, is_log)) in enumerate(scaled.items()):
        bottom = count - 1 - i
        _histogram(axes, unit[i], (i, bottom))
        ticks = list(zip(*_few_ticks(values, is_log), strict=True))
        lines = axis_label(name, effects, control).replace(", ", ",\n").split("\n")
        words = "\n".join(_narrow(line) for line in lines)
        _label_below(axes, i, words, ticks)
        if i:
            _label_beside(axes, bottom, words, ticks)
    frames = [Rectangle((j, count - 1 - i), _SIDE, _SIDE) for i in range(count) for j in range(i + 1)]
    axes.add_collection(PatchCollection(frames, facecolor="none", edgecolor=INK, linewidth=0.8))
    return figure


def _shade_pairs(axes: Any, unit: Sequence[Array]) -> None:
    """Below the diagonal, the regions of each pair, as shares of its cell."""
    count = len(unit)
    regions = [_regions(unit[j], unit[i], (j, count - 1 - i)) for i in range(count) for j in range(i)]
    for shaded, colour in zip(zip(*regions, strict=True), ("#b5c4d1", CHAIN), strict=True):
        paths = [path for cell in shaded for path in cell]
        axes.add_collection(PathCollection(paths, facecolor=colour, linewidth=0.0), autolim=False)


def _histogram(axes: Any, unit: Array, corner: tuple[int, int]) -> None:
    """On the diagonal, the draws of one parameter alone."""
    left, bottom = corner
    heights, edges = np.histogram(unit, np.linspace(0.0, 1.0, 31))
    stairs = bottom + 0.92 * _SIDE * heights / heights.max()
    axes.stairs(stairs, left + _SIDE * edges, baseline=bottom, fill=True, color=CHAIN, alpha=0.75)


def _grid(count: int) -> tuple[Figure, Any]:
    """One pair of axes, on which every cell is a unit square: a pair for each cell takes seconds to draw."""
    left, below = 0.9, 0.8  # room for three lines
    width, height = 1.1 * count + left + 0.05, 1.05 * count + below + 0.05
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
    first, last = low + 0.05 * (high - low), high - 0.05 * (high - low)  # labels of neighbouring cells do not touch
    if is_log:
        decades = np.arange(np.floor(low), np.ceil(high) + 1)
        for within in ((1.0, 2.0, 5.0), (1.0, 3.0), (1.0,)):
            ticks = np.sort(np.log10(within) + decades[:, None], axis=None)
            ticks = ticks[(first <= ticks) & (ticks <= last)]
            if len(ticks) <= _MOST_TICKS:
                break
        ticks = ticks[:: -(-len(ticks) // _MOST_TICKS)] if len(ticks) else ticks
        labels = [f"{10**t:.6g}" for t in ticks]
    else:
        ticks = np.array(MaxNLocator(_MOST_TICKS, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high))
        ticks = ticks[(first <= ticks) & (ticks <= last)]
        ticks = np.where(np.abs(ticks) < 1e-9 * (high - low), 0.0, ticks)
        labels = [f"{t:.10g}".replace("-", "\N{MINUS SIGN}") for t in ticks]
    return (ticks - low) / (high - low), labels


def _ticks(axes: Any, places: Sequence[tuple[float, float]], step: tuple[float, float]) -> None:
    """Short lines from the places outwards."""
    lines = [(place, (place[0] + step[0], place[1] + step[1])) for place in places]
    axes.add_collection(LineCollection(lines, colors=INK, linewidths=0.8, clip_on=False))


def _regions(x: Array, y: Array, corner: tuple[float, float]) -> tuple[list[Path], list[Path]]:
    """Outlines in a cell of the densest places, smoothed over neighbours: of 50 to 90 % of the draws, and of 50 %."""
    counts, xs, ys = np.histogram2d(x, y, bins=_CELLS, range=[(0.0, 1.0), (0.0, 1.0)])
    density = _SMOOTHING @ counts @ _SMOOTHING.T
    ranked = np.sort(density.ravel())[::-1]
    held = np.cumsum(ranked) / ranked.sum()
    half, most = (float(ranked[np.searchsorted(held, share)]) for share in (0.5, 0.9))
    if not 0 < most < half < ranked[0]:
        return [], []
    places = [at + _SIDE * (edges[1:] + edges[:-1]) / 2 for at, edges in zip(corner, (xs, ys), strict=True)]
    across, upward = places
    contours = contour_generator(across, upward, density.T, fill_type=FillType.OuterCode)
    return _outlines(contours, most, half), _outlines(contours, half, np.inf)


def _outlines(contours: Any, low: float, high: float) -> list[Path]:
    """Outlines of where a density lies between two values."""
    points, codes = contours.filled(low, high)
    return [Path(*outline) for outline in zip(points, codes, strict=True)]


_MOST_TICKS = 4  # so that labels do not touch
_SIDE, _GAP, _TICK = 0.92, 0.08, 0.035  # of a cell, between cells and of a tick, in units of both together
_LONGEST = 17  # letters of a name that fit into a cell
_CELLS = 22  # of a region's grid along each axis: fine enough to look smooth


def _smoothing(cells: int) -> Array:
    """(cells, cells) weights of the neighbours of each cell along one axis: normal, and reflected at the ends."""
    reach = np.arange(-_REACH, _REACH + 1)
    weights = np.exp(-0.5 * (reach / _BLUR) ** 2)
    neighbour = np.arange(cells)[:, None] + reach
    inside = np.where(neighbour < 0, -1 - neighbour, np.minimum(neighbour, 2 * cells - 1 - neighbour))
    matrix = np.zeros((cells, cells))
    np.add.at(matrix, (np.arange(cells)[:, None], inside), weights / weights.sum())
    return matrix


_BLUR, _REACH = 1.0, 4  # cells: standard deviation, and where its tail is cut off
_SMOOTHING = _smoothing(_CELLS)


def residual_figure(
    hold: Array,
    time_s: Array,
    measured_N: Array,
    band_N: Array,
    title: str,
    colour: str = CHAIN,
    paper_N: Array | None = None,
) -> Figure:
    """Measured minus predicted, hold after hold, inside the 90 % band.

    Parameters
    ----------
    hold, time_s, measured_N : (m,) arrays
    band_N : (3, m) array
        5 %, 50 % and 95 % of the prediction.
    paper_N : (m,) array, optional
        The paper's prediction.
    """
    figure, axes = panel("hold (readings in order of time within each)", "measured − predicted, N", title)
    numbers = list(dict.fromkeys(hold.tolist()))
    longest = max(float(time_s.max()), 1e-9)
    place = np.array([numbers.index(h) for h in hold]) - 0.35 + 0.7 * time_s / longest
    last = np.flatnonzero(np.diff(hold) != 0) + 1
    low, middle, high = np.insert(band_N, last, np.nan, axis=1)  # a gap between holds
    axes.fill_between(
        np.insert(place, last, np.nan), low - middle, high - middle, color=colour, alpha=0.22, lw=0, label="90 % band"
    )
    axes.axhline(0, color=colour, lw=1)
    axes.scatter(place, measured_N - band_N[1], s=14, color=colour, zorder=3, label="measured − posterior median")
    if paper_N is not None:
        left = measured_N - paper_N
        axes.scatter(place, left, s=18, marker="x", lw=1, color=INK, zorder=2, label="measured − paper's curve")
    axes.set_xticks(range(len(numbers)), [str(n) for n in numbers])
    legend_below(figure, axes, 3 if paper_N is None else 2)
    return figure


def creep_ahead(ahead: ExtrapolatedCreep, title: str) -> Figure:
    """Creep under a constant tension against time: 90 % bands with the prior, with it counted half, and without data.

    Parameters
    ----------
    ahead : mapping
        ``extrapolation`` of a ``summary.json``.
    """
    figure, axes = panel("time under constant tension, s", "creep, mm", f"{title}, {ahead['tension_N']:g} N")
    prior, weaker, posterior = ahead["prior_mm"], ahead["weaker_prior_mm"], ahead["posterior_mm"]
    axes.fill_between(ahead["time_s"], prior["q05"], prior["q95"], color=QUIET, alpha=0.45, lw=0, label="prior alone")
    axes.fill_between(
        ahead["time_s"], posterior["q05"], posterior["q95"], color=CHAIN, alpha=0.45, lw=0, label="posterior, 90 %"
    )
    axes.plot(ahead["time_s"], posterior["q50"], color=CHAIN, lw=1.2)
    for end, label in ((weaker["q05"], "prior at half weight"), (weaker["q95"], None)):
        axes.plot(ahead["time_s"], end, color=HOLD, lw=1, ls="--", label=label)
    for t, word in ((3600.0, "1 h"), (86400.0, "1 day")):
        axes.axvline(t, color=INK, lw=0.5, alpha=0.4)
        axes.annotate(
            word,
            (t, 1.0),
            xycoords=("data", "axes fraction"),
            ha="right",
            va="top",
            fontsize=8,
            color=INK,
            xytext=(-2, -2),
            textcoords="offset points",
        )
    logarithmic(axes, "both")
    legend_below(figure, axes, 3)
    return figure
