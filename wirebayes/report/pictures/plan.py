"""The picture of a plan: how narrow each test would make each parameter, and which effects it would show."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import numpy as np
from matplotlib.figure import Figure

from wirebayes.json_files.plan import ExpectedWidth, JudgedProtocol, PlanJson
from wirebayes.report.blocks import save_figure
from wirebayes.report.figures import logarithmic, verbatim
from wirebayes.sentences import spoken

_COLOURS = ("#4c78a8", "#f58518", "#54a24b", "#b279a2", "#9d755d", "#bab0ac")
_MOST = 6  # tests that a picture can hold


def widths_and_effects(plan: PlanJson, target: Path) -> None:
    """Draw expected widths beside the guess's, and the size δ at which each effect is seen.

    Parameters
    ----------
    plan : dict
        The content of ``plan.json``.
    target : Path
        The picture to write.
    """
    rows = plan["protocols"][:_MOST]
    names = [*_uncertain(rows), "creep_1h_mm"]
    effects = sorted({effect for row in rows for effect in row["effects"]})
    figure = Figure(figsize=(9.0, 4.0 + 0.13 * len(effects)), layout="constrained")
    left, right = figure.subplots(1, 2)
    for i, row in enumerate(rows):
        shift = (i - (len(rows) - 1) / 2) * (0.8 / len(rows))  # tests stand one below the other
        _draw_widths(left, row, names, shift, _COLOURS[i])
        _draw_effects(right, row, effects, shift, _COLOURS[i])
    left.set_xlabel("sd after the test (median) / sd of the guess", fontsize=9)
    left.set_title("parameters: farther left is better known", fontsize=9, loc="left")
    right.set_xlabel("sd of its prior / amplitude seen in 80 % of tests", fontsize=9)
    right.set_title("effects: right of the line is seen", fontsize=9, loc="left")
    for axes, what in ((left, names), (right, effects)):
        axes.set_yticks(range(len(what)), [_words(name) for name in what], fontsize=8)
        axes.axvline(1.0, color="0.6", lw=0.8)
        logarithmic(axes)
        axes.invert_yaxis()
        axes.grid(axis="y", color="0.93", lw=6, zorder=0)
        axes.set_axisbelow(True)
        axes.tick_params(axis="x", labelsize=8)
    figure.legend(loc="outside lower center", ncols=3, fontsize=8, frameon=False)
    save_figure(figure, target)


def _uncertain(rows: Sequence[JudgedProtocol]) -> list[str]:
    """The parameters of every test that the guess does not state exactly."""
    each = [row["parameters"] for row in rows]
    shared = [name for name in each[0] if all(name in widths for widths in each)]
    return [name for name in shared if not all(is_given(widths[name]) for widths in each)]


def _draw_widths(axes: Any, row: JudgedProtocol, names: Sequence[str], shift: float, colour: str) -> None:
    widths = row["parameters"] | {"creep_1h_mm": row["creep"]["creep_1h_mm"]}
    label = f"{row['rank']}. {verbatim(row['name'])}, {row['duration_min']:.3g} min"
    axes.plot(
        [_share(widths[name]) for name in names], np.arange(len(names)) + shift, "o", color=colour, ms=4, label=label
    )


def _draw_effects(axes: Any, row: JudgedProtocol, effects: Sequence[str], shift: float, colour: str) -> None:
    there = [(place, row["effects"][name]) for place, name in enumerate(effects) if name in row["effects"]]
    seen = [(place, power["delta_prior"] / power["delta_80"]) for place, power in there if power["delta_80"]]
    if seen:
        places, times = zip(*seen, strict=True)
        axes.plot(times, np.array(places) + shift, "o", color=colour, ms=4)


def _share(width: ExpectedWidth) -> float:
    return np.nan if is_given(width) else width["sd"] / width["guess_sd"]


def is_given(width: ExpectedWidth) -> bool:
    """Whether the guess states a value without uncertainty, so that there is nothing to compare with."""
    return width["guess_sd"] <= _ROUNDING * width["sd"]


_ROUNDING = 1e-9  # of a standard deviation: what is left of a zero


def _words(name: str) -> str:
    return {"creep_1h_mm": "creep after 1 h"}.get(name, spoken(name))
