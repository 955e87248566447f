"""Pictures of a comparison: how much better or worse each model predicts, and the held-out holds themselves."""

from pathlib import Path
from typing import Any, Literal

import numpy as np
from matplotlib.figure import Figure

from wirebayes.json_files.comparison import ComparedModel, ComparedModels, ModelJson, PredictionScores
from wirebayes.json_files.read_units import read_value, unit_read
from wirebayes.report.blocks import save_figure
from wirebayes.report.figures import CHAIN, HOLD, INK, QUIET, legend_below, logarithmic, panel
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
    save_figure(elpd_differences(name, table), folder / "differences.svg")
    best = winner(table)
    held_out = next((m["held_out"] for m in models if m["name"] == best), None)
    if held_out is not None:
        save_figure(held_out_errors(name, table), folder / "held-out-errors.svg")
        for way, words in WORDS.items():
            if scores := held_out[way]:
                title = f"{name} under {spoken(str(best))}:\n{words}"
                save_figure(bands(title, scores), folder / f"held-out-{way.replace('_', '-')}.svg")
                save_figure(pit(title, scores), folder / f"pit-{way.replace('_', '-')}.svg")


def winner(table: ComparedModels) -> str | None:
    """The best model that could be scored; the rows of a comparison stand best first."""
    return next((row["name"] for row in table["models"] if row["failed"] is None), None)


Way = Literal["free", "given_first"]
WORDS: dict[Way, str] = {"free": "held out, predicted freely", "given_first": "held out, given first reading"}


def elpd_differences(name: str, table: ComparedModels) -> Figure:
    """Elpd difference from the base with two standard errors, one line a model."""
    rows = [(r, d) for r in table["models"] if (d := r["difference"]) is not None and r["name"] != table["base"]]
    figure, axes = panel(
        f"elpd − elpd of {table['base']}, all holds left out in turn", "", name, (5.4, 1.2 + 0.22 * len(rows))
    )
    axes.axvline(0, color=QUIET, lw=1)
    axes.axvspan(-4, 4, color=QUIET, alpha=0.25, lw=0)
    values = np.array([d["elpd"] for _, d in rows], float)
    edge = -max(_SEEN, 3.0 * float(values.max(initial=0.0)), 40.0)
    for place, ((row, difference), value) in enumerate(zip(rows, values, strict=True)):
        colour = CHAIN if row["converged"] else QUIET
        if value < edge:
            axes.annotate(f"← {value:.0f}", (edge, place), fontsize=8, color=HOLD, va="center")
            continue
        axes.errorbar(value, place, xerr=2 * difference["se"], fmt="o", ms=4, lw=1, color=colour)
    _names(axes, [row for row, _ in rows])
    axes.set_xlim(edge * 1.05, None)
    return figure


def held_out_errors(name: str, table: ComparedModels) -> Figure:
    """Root mean square error on the held-out holds, freely and given the first reading."""
    rows = [(r, held) for r in table["models"] if r["failed"] is None and (held := r["held_out"])]
    unit = unit_read(rows[0][1]["given_first"] or {}) if rows else "N"
    figure, axes = panel(f"rms error on held-out holds, {unit}", "", name, (5.4, 1.2 + 0.22 * len(rows)))
    drawn: tuple[tuple[Way, str, str], ...] = (
        ("free", CHAIN, "predicted freely"),
        ("given_first", HOLD, "given the first reading"),
    )
    for way, colour, label in drawn:
        found = [(place, read_value(scores, "rmse")) for place, (_, held) in enumerate(rows) if (scores := held[way])]
        axes.scatter([v for _, v in found], [p for p, _ in found], s=16, color=colour, label=label)
    logarithmic(axes)
    _names(axes, [row for row, _ in rows])
    legend_below(figure, axes, 4)
    return figure


def _names(axes: Any, rows: list[ComparedModel]) -> None:
    axes.set_yticks(range(len(rows)), [spoken(r["name"]) for r in rows], fontsize=8)
    axes.set_ylim(len(rows) - 0.4, -0.6)


def bands(title: str, scores: PredictionScores) -> Figure:
    """Measured readings minus the predictive median, in the 50, 90 and 99 % bands."""
    r = {k: np.asarray(v, float) for k, v in scores["readings"].items()}
    figure, axes = panel(
        "hold (readings in order of time within each)", f"measured − predicted, {unit_read(r, 'observed')}", title
    )
    numbers = list(dict.fromkeys(r["hold"].astype(int).tolist()))
    longest = max(float(r["time_s"].max()), 1e-9)
    place = np.array([numbers.index(int(h)) for h in r["hold"]]) - 0.35 + 0.7 * r["time_s"] / longest
    q = read_value(r, "quantiles")
    for i, number in enumerate(numbers):
        here = r["hold"] == number
        for low, high, alpha, label in ((0, 6, 0.12, "99 %"), (1, 5, 0.16, "90 %"), (2, 4, 0.22, "50 %")):
            axes.fill_between(
                place[here],
                (q[low] - q[3])[here],
                (q[high] - q[3])[here],
                color=CHAIN,
                alpha=alpha,
                lw=0,
                label=label if i == 0 else None,
            )
    axes.axhline(0, color=CHAIN, lw=1)
    axes.scatter(place, read_value(r, "observed") - q[3], s=14, color=INK, zorder=3, label="measured − median")
    axes.set_xticks(range(len(numbers)), [str(n) for n in numbers])
    legend_below(figure, axes, 4)
    return figure


def pit(title: str, scores: PredictionScores) -> Figure:
    """Share of readings below each level of their predictive distribution, in its simultaneous 95 % band."""
    level, low, high = np.asarray(scores["pit_band"], float)
    values = np.asarray(scores["readings"]["pit"], float)
    figure, axes = panel("level of the predictive distribution", "share of readings below", title)
    axes.fill_between(level, low, high, color=CHAIN, alpha=0.2, lw=0, label="95 % band, all levels at once")
    axes.plot([0, 1], [0, 1], color=QUIET, lw=1)
    axes.step(level, [(values <= x).mean() for x in level], where="post", color=INK, lw=1.5, label="measured")
    legend_below(figure, axes, 4)
    return figure
