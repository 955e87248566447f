"""The picture of an export: how a line grows with time at each tension."""

from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wirebayes.report.figures import legend_below, logarithmic, panel
from wirebayes.report.pictures.robot_lines import cycle


def growth(rows: Sequence[Mapping[str, float]]) -> Figure:
    """Median growth and its 90 % interval against time, a line a tension.

    Parameters
    ----------
    rows : sequence of mapping
        Of ``creep-table.csv``.
    """
    figure, axes = panel("time under constant tension, s", "growth, mm per m")
    by_tension: dict[float, list[Mapping[str, float]]] = {}
    for row in rows:
        own = by_tension.setdefault(row["tension_N"], [])
        own.append(row)
    colours = cycle(len(by_tension))
    for (tension, own), colour in zip(by_tension.items(), colours, strict=True):
        _draw_course(axes, own, colour, f"{tension:g} N")
    logarithmic(axes)
    axes.set_ylim(bottom=0)
    legend_below(figure, axes, 4)
    return figure


def _draw_course(axes: Axes, rows: Sequence[Mapping[str, float]], colour: str, label: str) -> None:
    """Growth under one tension."""
    times = [row["time_s"] for row in rows]
    low = [row["q05_mm_per_m"] for row in rows]
    middle = [row["q50_mm_per_m"] for row in rows]
    high = [row["q95_mm_per_m"] for row in rows]
    axes.plot(times, middle, "o-", ms=3.5, color=colour, label=label)
    axes.fill_between(times, low, high, color=colour, alpha=0.2, lw=0)
