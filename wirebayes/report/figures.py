"""Pictures of tests and posteriors, each a small panel that stays readable on a phone."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont, get_font
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from wirebayes.json_files.summary import CreepBand, ExtrapolatedCreep
from wirebayes.numeric.typing import Array
from wirebayes.report.cells import with_unit
from wirebayes.results.parameters import unit_of
from wirebayes.sentences import lasting
from wirebayes.wire.protocol import Control, Protocol

CHAIN, HOLD, QUIET, INK = "#30506d", "#c8553d", "#b9bec4", "#1d2226"
COLOURS = {"chain": CHAIN, "hold": HOLD}
WORDS = {"chain": "holds as one chain", "hold": "hold by hold"}
HALF_90 = 1.645  # standard deviations on either side of a mean that hold 90 %
_SIZE = (4.7, 3.4)  # inches: two panels stand side by side on a page


def verbatim(text: str) -> str:
    """A user's words for a picture as they stand: no formulas between dollars, a mark for what the font lacks."""
    has = get_font(findfont(FontProperties())).get_char_index
    letters = [letter if has(ord(letter)) else "\ufffd" for letter in text]
    return "".join(letters).replace("$", r"\$")


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
    without_frame(axes)
    axes.tick_params(labelsize=9)
    power = axes.yaxis.get_offset_text()  # of ten, away from the title
    power.set(x=1.0, horizontalalignment="right")
    return figure, axes


def tell_times(axes: Any, last_s: float) -> None:
    """Ticks of a logarithmic axis of seconds at times as people say them: 10 s, 1 min, 1 h.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    last_s : float
        The last time that is drawn.
    """
    if last_s < _TOLD_S[2]:
        axes.set_xlabel("time, s")
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        return
    told = [time for time in _TOLD_S if time <= last_s]
    axes.set_xlabel("time")
    axes.set_xticks(told, [lasting(time) if time else "0" for time in told])
    axes.xaxis.set_minor_locator(NullLocator())


_TOLD_S = (0.0, 10.0, 60.0, 600.0, 3600.0, 36e3, 360e3, 3600e3)  # about a decade apart, whole in some unit


def without_frame(axes: Any) -> None:
    """Only the two axes as lines."""
    axes.spines[["top", "right"]].set_visible(False)


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
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc=place, ncols=columns, frameon=False, fontsize=8.5, handlelength=1.6)


def apart(rows: Array) -> Array:
    """Rows (n, m) one after the other with a gap behind each: a line for all of them takes a tenth of the time of n."""
    gaps = np.full(len(rows), np.nan)
    return np.column_stack([rows, gaps]).ravel()


def places_in_holds(hold: Array, time_s: Array) -> tuple[list[int], Array]:
    """Numbers of holds in their order, and where each reading stands: holds at 0, 1, 2, time within each.

    Parameters
    ----------
    hold, time_s : (m,) arrays
    """
    numbers = [int(number) for number in dict.fromkeys(hold.tolist())]
    position = np.array([numbers.index(int(number)) for number in hold])
    longest = max(float(time_s.max()), 1e-9)
    return numbers, position - 0.35 + 0.7 * time_s / longest


def measured(protocol: Protocol, readings: Array, title: str) -> Figure:
    """What was read against what was set: each hold's first reading (blue) and its later ones (red).

    Parameters
    ----------
    readings : (H, R) array
    """
    weights = protocol.control == "force"
    across, upward = "displacement, mm", "tension, N"
    if weights:
        across, upward = "weight, N", "displacement, mm"
    figure, axes = panel(across, upward, title)
    _join_readings(axes, protocol, readings)
    hold, reading = np.nonzero(protocol.mask)
    first = np.diff(hold, prepend=-1) != 0
    later = ~first
    x = protocol.setting[hold]
    y = readings[hold, reading]
    axes.scatter(x[first], y[first], s=22, color=CHAIN, zorder=3, label="when the hold begins")
    if later.any():
        axes.scatter(x[later], y[later], s=11, color=HOLD, zorder=2, label="later readings")
    legend(axes, loc="lower right")
    is_slack_noise = y.min() < 0.0  # noise of a slack wire reaches below
    if not weights and not is_slack_noise:
        axes.set_ylim(bottom=0)
    return figure


def _join_readings(axes: Any, protocol: Protocol, readings: Array) -> None:
    """A line through the readings of each hold, a dotted one where a hold was not recorded."""
    seen = protocol.mask.any(axis=1)
    for x in protocol.setting[~seen]:
        axes.axvline(x, color=QUIET, ls=":", lw=1.2, label="held, not recorded")
    read = np.where(protocol.mask, readings, np.nan)[seen]
    ends = np.stack([np.nanmin(read, axis=1), np.nanmax(read, axis=1)], axis=1)
    settings = protocol.setting[seen].repeat(2).reshape(-1, 2)
    axes.plot(apart(settings), apart(ends), color=QUIET, lw=1.5, zorder=1)


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
        colour = COLOURS.get(kind, QUIET)
        axes.scatter(across, y[kind], s=3, alpha=0.35, lw=0, color=colour, rasterized=True)
        axes.scatter([], [], s=18, color=colour, label=WORDS.get(kind, kind))
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
    return with_unit(name, unit_of(name, effects, (control,)))


def logarithmic(axes: Any, which: str = "x") -> None:
    """Logarithmic axes with a few ticks that print plain numbers; linear where nothing is above zero."""
    for name in ("x", "y") if which == "both" else (which,):
        if getattr(axes.dataLim, f"{name}1") <= 0:
            continue
        getattr(axes, f"set_{name}scale")("log")
        axis = getattr(axes, f"{name}axis")
        low, high = sorted(getattr(axes, f"get_{name}lim")())
        axis.set_major_locator(LogLocator(subs=_ticks_within_a_decade(np.log10(high / low))))
        axis.set_major_formatter(FuncFormatter(_with_thin_spaces))
        axis.set_minor_locator(NullLocator())  # there are dozens of minor ticks, and each is placed several times


def _ticks_within_a_decade(decades: float) -> tuple[float, ...]:
    if decades < 1.6:
        return (1.0, 2.0, 5.0)
    return (1.0, 3.0) if decades < 2.6 else (1.0,)


def _with_thin_spaces(value: float, _: int | None) -> str:
    return f"{value:,.10g}".replace(",", "\u2009")


def residual_figure(
    hold: Array,
    time_s: Array,
    measured: Array,
    band: Array,
    title: str,
    colour: str,
    paper_N: Array | None = None,
    unit: str = "N",
) -> Figure:
    """Measured minus predicted, hold after hold, inside the 90 % band.

    Parameters
    ----------
    hold, time_s, measured : (m,) arrays
    band : (3, m) array
        5 %, 50 % and 95 % of the prediction.
    paper_N : (m,) array, optional
        The paper's prediction.
    unit : str
        Of what was measured: mm under weights.
    """
    across = "hold (readings in order of time within each)"
    upward = f"measured − predicted, {unit}"
    figure, axes = panel(across, upward, title)
    numbers, place = places_in_holds(hold, time_s)
    _draw_band(axes, hold, place, band, colour)
    axes.axhline(0, color=colour, lw=1)
    median = band[1]
    axes.scatter(place, measured - median, s=14, color=colour, zorder=3, label="measured − posterior median")
    columns = 3
    if paper_N is not None:
        columns = 2
        theirs = measured - paper_N
        axes.scatter(place, theirs, s=18, marker="x", lw=1, color=INK, zorder=2, label="measured − paper's curve")
    names = [str(number) for number in numbers]
    axes.set_xticks(range(len(names)), names)
    legend_below(figure, axes, columns)
    return figure


def _draw_band(axes: Any, hold: Array, place: Array, band: Array, colour: str) -> None:
    """The 90 % band about its middle, with a gap between holds."""
    is_last = np.diff(hold) != 0
    ends = np.flatnonzero(is_last) + 1
    low, middle, high = np.insert(band, ends, np.nan, axis=1)
    band_place = np.insert(place, ends, np.nan)
    axes.fill_between(band_place, low - middle, high - middle, color=colour, alpha=0.22, lw=0, label="90 % band")


def creep_ahead(ahead: ExtrapolatedCreep, title: str) -> Figure:
    """Creep under a constant tension against time: 90 % bands with the prior, with it counted half, and without data.

    Parameters
    ----------
    ahead : mapping
        ``extrapolation`` of a ``summary.json``.
    """
    title = f"{title}, {ahead['tension_N']:g} N"
    figure, axes = panel("time under constant tension, s", "creep, mm", title)
    times = ahead["time_s"]
    posterior = ahead["posterior_mm"]
    weaker = ahead["weaker_prior_mm"]
    _fill(axes, times, ahead["prior_mm"], QUIET, "prior alone")
    _fill(axes, times, posterior, CHAIN, "posterior, 90 %")
    axes.plot(times, posterior["q50"], color=CHAIN, lw=1.2)
    axes.plot(times, weaker["q05"], color=HOLD, lw=1, ls="--", label="prior at half weight")
    axes.plot(times, weaker["q95"], color=HOLD, lw=1, ls="--")
    _mark_time(axes, 3600.0, "1 h")
    _mark_time(axes, 86400.0, "1 day")
    logarithmic(axes, "both")
    legend_below(figure, axes, 3)
    return figure


def _fill(axes: Any, times: Any, band: CreepBand, colour: str, label: str) -> None:
    axes.fill_between(times, band["q05"], band["q95"], color=colour, alpha=0.45, lw=0, label=label)


def _mark_time(axes: Any, time: float, word: str) -> None:
    """A thin upright line with a word at its top."""
    axes.axvline(time, color=INK, lw=0.5, alpha=0.4)
    axes.annotate(
        word,
        (time, 1.0),
        xycoords=("data", "axes fraction"),
        ha="right",
        va="top",
        fontsize=8,
        color=INK,
        xytext=(-2, -2),
        textcoords="offset points",
    )
