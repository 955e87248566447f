"""Pictures that put several lines on one robot: drift against time, and where its uncertainty comes from."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from wirebayes.numeric.typing import Array
from wirebayes.report.figures import CHAIN, HOLD, INK, legend_below, panel, tell_times

_COLOURS = (CHAIN, HOLD, "#5d8c4a", "#c59a2e", "#7b5ea7", "#4a9aa8", "#b9bec4")


def drifts_in_time(drifts_mm: Mapping[str, Array], times_s: Array, limit_mm: float, title: str) -> Figure:
    """Distance from the pose against time, median and 90 % band of each line.

    Parameters
    ----------
    drifts_mm : mapping of line to (n, t) array
    times_s : (t,) array
        All above zero.
    limit_mm : float
        The paper's.
    """
    figure, axes = panel("time", "distance from the pose, mm", title)
    colours = cycle(len(drifts_mm))
    for (name, drift), colour in zip(drifts_mm.items(), colours, strict=True):
        quantiles = np.nanquantile(drift, [0.05, 0.5, 0.95], axis=0)
        low, middle, high = quantiles
        axes.plot(times_s, middle, color=colour, label=name)
        axes.fill_between(times_s, low, high, color=colour, alpha=0.18, lw=0)
    limit = f"{limit_mm:g} mm"
    axes.axhline(limit_mm, color=INK, lw=0.9, ls="--", label=limit)
    axes.set_xscale("log")
    axes.set_ylim(bottom=0)
    tell_times(axes, float(np.max(times_s)))
    legend_below(figure, axes, 3)
    return figure


def budgets(shares: Mapping[str, Mapping[str, float]], title: str) -> Figure:
    """Shares of the variance of the drift by parameter, a bar a line.

    Parameters
    ----------
    shares : mapping of line to mapping of parameter to share
    """
    height = 1.9 + 0.35 * len(shares)
    size = (4.7, height)
    figure, axes = panel("share of the variance of the drift, %", "", title, size)
    every = [name for own in shares.values() for name in own]
    parameters = list(dict.fromkeys(every))
    lines = list(shares)[::-1]
    colours = cycle(len(parameters))
    done = np.zeros(len(lines))
    for name, colour in zip(parameters, colours, strict=True):
        share = np.array([shares[line].get(name, 0.0) for line in lines])
        width = 100 * np.maximum(share, 0.0)
        axes.barh(lines, width, left=done, color=colour, label=name, height=0.6)
        done = done + width
    axes.tick_params(axis="y", length=0)
    axes.set_xlim(0, 100)
    legend_below(figure, axes, 6)
    return figure


def cycle(count: int) -> list[str]:
    return [_COLOURS[i % len(_COLOURS)] for i in range(count)]
