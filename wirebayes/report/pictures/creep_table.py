"""The picture of an export: how a line grows with time at each tension."""

from collections.abc import Mapping, Sequence

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
    tensions = list(dict.fromkeys(row["tension_N"] for row in rows))
    for tension, colour in zip(tensions, cycle(len(tensions)), strict=True):
        own = [row for row in rows if row["tension_N"] == tension]
        times, low, middle, high = ([row[key] for row in own] for key in _COLUMNS)
        axes.plot(times, middle, "o-", ms=3.5, color=colour, label=f"{tension:g} N")
        axes.fill_between(times, low, high, color=colour, alpha=0.2, lw=0)
    logarithmic(axes)
    axes.set_ylim(bottom=0)
    legend_below(figure, axes, 4)
    return figure


_COLUMNS = ("time_s", "q05_mm_per_m", "q50_mm_per_m", "q95_mm_per_m")
