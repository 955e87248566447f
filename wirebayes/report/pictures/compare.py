"""Pictures of a comparison: how much better or worse each model predicts, and the held-out holds themselves."""

from pathlib import Path
from typing import Any, Literal

import numpy as np
from matplotlib.figure import Figure

from wirebayes.json_files.comparison import ComparedModel, ComparedModels, ModelJson, PredictionScores
from wirebayes.json_files.read_units import read_value, unit_read
from wirebayes.numeric.typing import Floats
from wirebayes.report.drawn import save_figure
from wirebayes.report.figures import CHAIN, HOLD, INK, QUIET, legend_below, logarithmic, panel, places_in_holds
from wirebayes.sentences import spoken

_SEEN = 12.0  # worse by more than this many times the best-known spread is drawn at the edge


def save_pictures(folder: Path, name: str, table: ComparedModels, models: list[ModelJson]) -> None:
    """Write the pictures of one experiment into its folder.

    Parameters
    ----------
    name : str
        Of the experiment.
    table : dict
        Its entry in ``comparison.json``.
    models : list of dict
        What `wirebayes.comparison.compare.judge` returned for each model.
    """
    differences = elpd_differences(name, table)
    save_figure(differences, folder / "differences.svg")
    best = winner(table)
    held_out = next((model["held_out"] for model in models if model["name"] == best), None)
    if held_out is None:
        return
    errors = held_out_errors(name, table)
    save_figure(errors, folder / "held-out-errors.svg")
    model = spoken(str(best))
    for way, words in WORDS.items():
        scores = held_out[way]
        if not scores:
            continue
        title = f"{name} under {model}:\n{words}"
        file = way.replace("_", "-")
        save_figure(bands(title, scores), folder / f"held-out-{file}.svg")
        save_figure(pit(title, scores), folder / f"pit-{file}.svg")


def winner(table: ComparedModels) -> str | None:
    """The best model that could be scored; the rows of a comparison stand best first."""
    return next((row["name"] for row in table["models"] if row["failed"] is None), None)


Way = Literal["free", "given_first"]
WORDS: dict[Way, str] = {"free": "held out, predicted freely", "given_first": "held out, given first reading"}


def elpd_differences(name: str, table: ComparedModels) -> Figure:
    """Elpd difference from the base with two standard errors, one line a model."""
    base = table["base"]
    rows = []
    differences = []
    for row in table["models"]:
        difference = row["difference"]
        if row["name"] != base and difference is not None:
            rows.append(row)
            differences.append(difference)
    values = np.array([difference["elpd"] for difference in differences], float)
    label = f"elpd − elpd of {base}, all holds left out in turn"
    figure, axes = panel(label, "", name, _size(rows))
    axes.axvline(0, color=QUIET, lw=1)
    axes.axvspan(-4, 4, color=QUIET, alpha=0.25, lw=0)
    edge = -max(_SEEN, 3.0 * float(values.max(initial=0.0)), 40.0)
    for place, value in enumerate(values):
        if value < edge:
            axes.annotate(f"← {value:.0f}", (edge, place), fontsize=8, color=HOLD, va="center")
            continue
        colour = CHAIN if rows[place]["converged"] else QUIET
        error = 2 * differences[place]["se"]
        axes.errorbar(value, place, xerr=error, fmt="o", ms=4, lw=1, color=colour)
    _names(axes, rows)
    axes.set_xlim(edge * 1.05, None)
    return figure


def _size(rows: list[ComparedModel]) -> tuple[float, float]:
    """The size of a panel with a line for each model, inches."""
    return 5.4, 1.2 + 0.22 * len(rows)


def held_out_errors(name: str, table: ComparedModels) -> Figure:
    """Root mean square error on the held-out holds, freely and given the first reading."""
    rows = [row for row in table["models"] if row["failed"] is None and row["held_out"]]
    first = rows[0]["held_out"] if rows else None
    unit = unit_read(first["given_first"] or {}) if first else "N"
    figure, axes = panel(f"rms error on held-out holds, {unit}", "", name, _size(rows))
    _scatter_errors(axes, rows, "free", CHAIN, "predicted freely")
    _scatter_errors(axes, rows, "given_first", HOLD, "given the first reading")
    logarithmic(axes)
    _names(axes, rows)
    legend_below(figure, axes, 4)
    return figure


def _scatter_errors(axes: Any, rows: list[ComparedModel], way: Way, colour: str, label: str) -> None:
    """The error of each model that was scored in one way."""
    errors = []
    places = []
    for place, row in enumerate(rows):
        held = row["held_out"]
        scores = held[way] if held else None
        if scores:
            errors.append(read_value(scores, "rmse"))
            places.append(place)
    axes.scatter(errors, places, s=16, color=colour, label=label)


def _names(axes: Any, rows: list[ComparedModel]) -> None:
    axes.set_yticks(range(len(rows)), [spoken(row["name"]) for row in rows], fontsize=8)
    axes.set_ylim(len(rows) - 0.4, -0.6)


def bands(title: str, scores: PredictionScores) -> Figure:
    """Measured readings minus the predictive median, in the 50, 90 and 99 % bands."""
    readings = {name: np.asarray(values, float) for name, values in scores["readings"].items()}
    unit = unit_read(readings, "observed")
    across = "hold (readings in order of time within each)"
    figure, axes = panel(across, f"measured − predicted, {unit}", title)
    hold = readings["hold"]
    numbers, place = places_in_holds(hold, readings["time_s"])
    quantiles = read_value(readings, "quantiles")
    median = quantiles[3]
    deviations = quantiles - median
    for i, number in enumerate(numbers):
        here = hold == number
        _draw_bands(axes, place[here], deviations[:, here], named=i == 0)
    axes.axhline(0, color=CHAIN, lw=1)
    observed = read_value(readings, "observed")
    left = observed - median
    axes.scatter(place, left, s=14, color=INK, zorder=3, label="measured − median")
    names = [str(number) for number in numbers]
    axes.set_xticks(range(len(names)), names)
    legend_below(figure, axes, 4)
    return figure


def _draw_bands(axes: Any, place: Floats, quantiles: Floats, named: bool) -> None:
    """The 99, 90 and 50 % bands of one hold, from its (7, m) quantiles."""
    for low, high, alpha, label in ((0, 6, 0.12, "99 %"), (1, 5, 0.16, "90 %"), (2, 4, 0.22, "50 %")):
        shown = label if named else None
        axes.fill_between(place, quantiles[low], quantiles[high], color=CHAIN, alpha=alpha, lw=0, label=shown)


def pit(title: str, scores: PredictionScores) -> Figure:
    """Share of readings below each level of their predictive distribution, in its simultaneous 95 % band."""
    level, low, high = np.asarray(scores["pit_band"], float)
    values = np.asarray(scores["readings"]["pit"], float)
    shares = [(values <= x).mean() for x in level]
    figure, axes = panel("level of the predictive distribution", "share of readings below", title)
    axes.fill_between(level, low, high, color=CHAIN, alpha=0.2, lw=0, label="95 % band, all levels at once")
    axes.plot([0, 1], [0, 1], color=QUIET, lw=1)
    axes.step(level, shares, where="post", color=INK, lw=1.5, label="measured")
    legend_below(figure, axes, 4)
    return figure
