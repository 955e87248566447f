"""The pictures of the paper reproduced."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from wirebayes.numeric.typing import Array
from wirebayes.paper.page_tables import column_values
from wirebayes.report.figures import (
    CHAIN,
    COLOURS,
    HOLD,
    INK,
    QUIET,
    WORDS,
    legend_below,
    logarithmic,
    panel,
    without_frame,
)
from wirebayes.wire.protocol import Protocol


def intervals(rows: Sequence[Mapping[str, Any]], title: str) -> Figure:
    """Prior and posterior intervals of one wire's parameters, as multiples of the published values.

    Parameters
    ----------
    rows : sequence of mapping
        Of `wirebayes.paper.verdicts.verdict_rows`, both likelihoods.
    """
    figure, axes = panel("multiple of the published value", "", title)
    names = column_values(rows, "parameter")
    for row in rows:
        y = len(names) - names.index(row["parameter"])
        _interval(axes, row, y)
    axes.axvline(1, color=INK, lw=1, zorder=2)
    axes.plot([], [], color=QUIET, lw=8, label="before the test (prior)")
    for likelihood in ("chain", "hold"):
        axes.plot([], [], color=COLOURS[likelihood], lw=3.2, label=WORDS[likelihood])
    axes.plot([], [], color=INK, lw=1, label="published")
    logarithmic(axes)
    _name_rows(axes, [name.replace("*", "·") for name in names])
    legend_below(figure, axes)
    return figure


def _interval(axes: Any, row: Mapping[str, Any], y: int) -> None:
    """Median and interval of one parameter under one likelihood, and once for both the prior's."""
    one = row["published"]
    if row["likelihood"] == "hold":
        before = [row["prior_q05"] / one, row["prior_q95"] / one]
        axes.plot(before, [y, y], lw=13, color="#e0e3e6", solid_capstyle="butt", zorder=1)
    shift = 0.14 if row["likelihood"] == "chain" else -0.14
    colour = COLOURS[row["likelihood"]]
    after = [row["q05"] / one, row["q95"] / one]
    axes.plot(after, [y + shift] * 2, lw=3.2, color=colour, solid_capstyle="butt", zorder=3)
    axes.plot([row["q50"] / one], [y + shift], "o", ms=5, color=colour, zorder=3)


def _name_rows(axes: Any, names: Sequence[str]) -> None:
    """Names beside the rows, from the top."""
    axes.set_yticks(range(len(names), 0, -1), names)
    axes.tick_params(axis="y", length=0)
    axes.set_ylim(0.4, len(names) + 0.6)


def last_hold(time_s: Array, drawn_N: Array, curve_N: Array, marks: tuple[Array, Array], title: str) -> Figure:
    """A figure of the paper: one unused hold, its curve, and the posterior band.

    Parameters
    ----------
    time_s : (m,) array
    drawn_N : (m, n) array
        Predicted readings, given the first one.
    curve_N : (m,) array
        The paper's.
    marks : ((r,), (r,)) arrays
        Times and measured tensions.
    """
    figure, axes = panel("time since the hold began, s", "tension, N", title)
    low, middle, high = np.quantile(drawn_N[1:], [0.05, 0.5, 0.95], axis=1)
    axes.fill_between(time_s[1:], low, high, color=HOLD, alpha=0.22, lw=0, label="90 % of forecasts")
    axes.plot(time_s[1:], middle, color=HOLD, lw=1.6, label="median forecast")
    axes.plot(time_s, curve_N, color=INK, lw=1.4, ls="--", label="the paper's curve (Table 4)")
    axes.plot(*marks, "o", ms=7, color=INK, label="measured", zorder=5)
    legend_below(figure, axes)
    return figure


def drifts(rows: Sequence[Mapping[str, Any]], limit_mm: float, title: str) -> Figure:
    """How far a platform moves within a minute, on each wire, new and loaded before.

    Parameters
    ----------
    rows : sequence of mapping
        Of `wirebayes.paper.section_4.drift_rows`, one robot's.
    limit_mm : float
        What the paper claims.
    """
    figure, axes = panel("drift within a minute, mm", "", title)
    names = column_values(rows, "experiment")
    hours = set()
    for row in rows:
        if row["specimen_spread"] <= 0:
            continue
        shift = 0.14
        colour = HOLD
        loaded_s = row["loaded_before_s"]
        if loaded_s > 0:
            shift = -0.14
            colour = CHAIN
            hours.add(loaded_s / 3600.0)
        y = len(names) - names.index(row["experiment"]) + shift
        ends = [row["q05_drift_mm"], row["q95_drift_mm"]]
        axes.plot(ends, [y, y], lw=3.2, color=colour, solid_capstyle="butt")
        axes.plot([row["q50_drift_mm"]], [y], "o", ms=5, color=colour)
    axes.plot([], [], color=HOLD, lw=3.2, label="new wires")
    for time_h in sorted(hours):
        axes.plot([], [], color=CHAIN, lw=3.2, label=f"after {time_h:g} h under load")
    axes.axvline(limit_mm, color=INK, lw=1, ls="--", label=f"the paper: less than {limit_mm:g} mm")
    logarithmic(axes)
    _name_rows(axes, names)
    legend_below(figure, axes)
    return figure


def prior_predictive(protocol: Protocol, drawn_N: Array, tension_N: Array, title: str) -> Figure:
    """What a person expects before the test: tension when each hold begins, and how the first hold goes on.

    Parameters
    ----------
    drawn_N : (H, R, n) array
    tension_N : (H, R) array
    """
    figure = Figure(figsize=(4.7, 4.4), layout="constrained")
    above, below = figure.subplots(2, 1)
    figure.suptitle(title, fontsize=10.5, x=0.02, ha="left", color=INK)
    _first_tensions(above, protocol, drawn_N, tension_N)
    first = int(np.flatnonzero(protocol.recorded)[0])
    _tension_left(below, protocol, first, drawn_N[first], tension_N[first])
    for axes in (above, below):
        without_frame(axes)
        axes.tick_params(labelsize=9)
    legend_below(figure, above, 4)
    return figure


def _first_tensions(axes: Any, protocol: Protocol, drawn_N: Array, tension_N: Array) -> None:
    """Tension when each hold begins."""
    seen = protocol.recorded
    settings = protocol.setting[seen]
    _fan(axes, settings, np.maximum(drawn_N[seen, 0], 0.0))
    axes.plot(settings, tension_N[seen, 0], "o", ms=4.5, color=CHAIN, label="measured")
    axes.set_yscale("symlog", linthresh=1.0)
    axes.set_ylim(bottom=0)
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.set(xlabel="displacement, mm", ylabel="first tension, N")


def _tension_left(axes: Any, protocol: Protocol, hold: int, drawn_N: Array, tension_N: Array) -> None:
    """How a hold goes on: draws (R, n) and readings (R,) as shares of the first."""
    read = protocol.mask[hold]
    times = protocol.time_s[hold][read]
    taut = drawn_N[0] > _PULLS_N
    _fan(axes, times, 100 * drawn_N[read][:, taut] / drawn_N[0, taut])
    axes.plot(times, 100 * tension_N[read] / tension_N[0], "o", ms=4.5, color=CHAIN)
    axes.set(xlabel="time in the first hold, s", ylabel="tension left, %")


def _fan(axes: Any, x: Array, values: Array) -> None:
    """Quantile bands of (m, n) draws."""
    low, q25, middle, q75, high = np.quantile(values, [0.05, 0.25, 0.5, 0.75, 0.95], axis=1)
    axes.fill_between(x, low, high, color=QUIET, alpha=0.45, lw=0, label="90 % of the prior")
    axes.fill_between(x, q25, q75, color=QUIET, alpha=0.8, lw=0, label="50 %")
    axes.plot(x, middle, color="#7b838b", lw=1.2)


_PULLS_N = 0.05  # a share of the first tension means nothing below
