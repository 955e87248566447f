"""The picture of a plan: how narrow each test would make each parameter, and which effects it would show."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import numpy as np
from matplotlib.figure import Figure

from wirebayes.json_files.plan import ExpectedWidth, JudgedProtocol, PlanJson
from wirebayes.report.drawn import save_figure
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
    quantities = [*_uncertain(rows), "creep_1h_mm"]
    shown: set[str] = set()
    for row in rows:
        shown.update(row["effects"])
    effects = sorted(shown)
    height = 4.0 + 0.13 * len(effects)
    figure = Figure(figsize=(9.0, height), layout="constrained")
    left, right = figure.subplots(1, 2)
    middle = (len(rows) - 1) / 2
    apart = 0.8 / len(rows)
    for i, row in enumerate(rows):
        shift = (i - middle) * apart  # tests stand one below the other
        _draw_widths(left, row, quantities, shift, _COLOURS[i])
        _draw_effects(right, row, effects, shift, _COLOURS[i])
    left.set_xlabel("sd after the test (median) / sd of the guess", fontsize=9)
    left.set_title("parameters: farther left is better known", fontsize=9, loc="left")
    right.set_xlabel("sd of its prior / amplitude seen in 80 % of tests", fontsize=9)
    right.set_title("effects: right of the line is seen", fontsize=9, loc="left")
    _name_rows(left, quantities)
    _name_rows(right, effects)
    figure.legend(loc="outside lower center", ncols=3, fontsize=8, frameon=False)
    save_figure(figure, target)


def _name_rows(axes: Any, names: Sequence[str]) -> None:
    """Names beside the rows of a panel, from the top, and a line where nothing is gained."""
    axes.set_yticks(range(len(names)), [_words(name) for name in names], fontsize=8)
    axes.axvline(1.0, color="0.6", lw=0.8)
    logarithmic(axes)
    axes.invert_yaxis()
    axes.grid(axis="y", color="0.93", lw=6, zorder=0)
    axes.set_axisbelow(True)
    axes.tick_params(axis="x", labelsize=8)


def _uncertain(rows: Sequence[JudgedProtocol]) -> list[str]:
    """The parameters of every test that the guess does not state exactly."""
    tests = [row["parameters"] for row in rows]
    names = []
    for name in tests[0]:
        shared = all(name in widths for widths in tests)
        if shared and not all(is_given(widths[name]) for widths in tests):
            names.append(name)
    return names


def _draw_widths(axes: Any, row: JudgedProtocol, names: Sequence[str], shift: float, colour: str) -> None:
    widths = row["parameters"] | {"creep_1h_mm": row["creep"]["creep_1h_mm"]}
    shares = [_share(widths[name]) for name in names]
    places = np.arange(len(names)) + shift
    label = f"{row['rank']}. {verbatim(row['name'])}, {row['duration_min']:.3g} min"
    axes.plot(shares, places, "o", color=colour, ms=4, label=label)


def _draw_effects(axes: Any, row: JudgedProtocol, effects: Sequence[str], shift: float, colour: str) -> None:
    places = []
    times = []
    for place, name in enumerate(effects):
        power = row["effects"].get(name)
        if power is not None and power["delta_80"]:
            places.append(place + shift)
            times.append(power["delta_prior"] / power["delta_80"])
    if places:
        axes.plot(times, places, "o", color=colour, ms=4)


def _share(width: ExpectedWidth) -> float:
    return np.nan if is_given(width) else width["sd"] / width["guess_sd"]


def is_given(width: ExpectedWidth) -> bool:
    """Whether the guess states a value without uncertainty, so that there is nothing to compare with."""
    return width["guess_sd"] <= _ROUNDING * width["sd"]


_ROUNDING = 1e-9  # of a standard deviation: what is left of a zero


def _words(name: str) -> str:
    return {"creep_1h_mm": "creep after 1 h"}.get(name, spoken(name))
