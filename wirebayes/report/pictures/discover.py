"""Pictures of a discovery: readings against the plain and the final model, and what the plain one leaves over where."""

import textwrap
from collections.abc import Callable
from functools import partial
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wirebayes.discovery.residual_patterns import COVARIATES
from wirebayes.json_files.discovery import Disagreement, ExperimentFindings
from wirebayes.json_files.read_units import read_value, unit_read
from wirebayes.model.sample import Sample
from wirebayes.numeric.typing import Array, Floats, Ints
from wirebayes.report.figures import without_frame
from wirebayes.report.pictures.curve import READ, curve, draw_curve, draw_readings, name_holds
from wirebayes.results.read_back import Stored
from wirebayes.sentences import spoken
from wirebayes.wire.control import READ_UNIT
from wirebayes.wire.staircase import Linearised, linearise

_MEASURED, _BAND, _HELD, _WORSE = "#1b1b1b", "#4c78a8", "#f2e6d0", "#c44e52"


def pictures(plain: Stored, final: Stored, verdict: ExperimentFindings) -> dict[str, Callable[[], Figure]]:
    """What makes each picture of an experiment, by the name of its file below the run's folder.

    Parameters
    ----------
    plain, final : Stored
    verdict : dict
        The experiment's part of ``discovery.json``.
    """
    name = plain.sample.name
    figure_of: dict[str, Callable[[], Figure]] = {f"{name}.svg": partial(before_and_after, plain, final, verdict)}
    return figure_of | {f"{name}/{file}": make for file, make in pictures_of_findings(plain, verdict).items()}


def before_and_after(plain: Stored, final: Stored, verdict: ExperimentFindings) -> Figure:
    """Measured minus predicted readings for the plain and the final posterior of an experiment.

    Parameters
    ----------
    plain, final : Stored
    verdict : dict
        The experiment's part of ``discovery.json``.
    """
    name, control = plain.sample.name, plain.sample.protocol.control
    shown = [("plain model", plain, _WORSE)]
    if verdict["verdict"] != "nothing-missing":
        shown.append((f"with {_added(verdict)}", final, _BAND))
    figure = Figure(figsize=(9.0, 3.2 + 2.4 * len(shown)), layout="constrained")
    above, *axes = figure.subplots(1 + len(shown), 1, sharex=True, height_ratios=(1.4, *[1] * len(shown)))
    curves = [curve(stored) for _, stored, _ in shown]
    for (title, stored, colour), found in zip(shown, curves, strict=True):
        draw_curve(above, stored, found, colour, f"{title}, 90 % band")
    draw_readings(above, plain, curves[0])
    above.set_title(f"{name}: readings and curves", loc="left", fontsize=10)
    above.legend(fontsize=8, frameon=False)
    for axis, (title, stored, _) in zip(axes, shown, strict=True):
        axis.sharey(axes[0])
        _residuals(axis, stored, verdict["held_out"]["holds"])
        axis.set_title(f"{name}: {title}", loc="left", fontsize=10)
        axis.set_ylabel(f"measured − predicted, {READ_UNIT[control]}")
    above.set_ylabel(f"{READ[control]}, {READ_UNIT[control]}")
    name_holds(axes[-1], plain)
    for axis in (above, *axes):
        without_frame(axis)
    handles = axes[0].get_legend_handles_labels()
    figure.legend(*handles, loc="outside lower center", ncols=len(handles[1]), fontsize=8, frameon=False)
    return figure


def _added(verdict: ExperimentFindings) -> str:
    """What the final model has beyond the plain one."""
    unknown = ["something unknown"] if verdict["verdict"] in ("partial", "unknown") else []
    names = [spoken(effect) for effect in verdict["accepted"]] + unknown
    return " + ".join(names) or "what may be missing"


def waterfall(verdict: ExperimentFindings) -> Figure:
    """The rms error on held-out holds, from the plain model down: a bar for each named effect, and for what is left.

    Parameters
    ----------
    verdict : dict
        The experiment's part of ``discovery.json``, with at least one accepted effect and holds that were held out.
    """
    steps, floor = verdict["steps"], read_value(verdict["held_out"], "floor")
    heights = [rmse for s in steps if (rmse := read_value(s, "rmse")) is not None]
    unit = unit_read(steps[0])
    names = ["plain model", *(spoken(s["model"]) for s in steps[1:]), "left over", "noise"]
    bars = _bars(heights, floor)
    figure = Figure(figsize=(max(1.1 * len(bars), 5.4), 3.4), layout="constrained")
    axis = figure.subplots()
    for x, ((low, high, colour), label) in enumerate(zip(bars, _sizes(heights, floor, unit), strict=True)):
        axis.bar(x, max(high - low, 0.002 * max(heights)), bottom=low, color=colour, width=0.7)
        axis.text(x, high, label, ha="center", va="bottom", fontsize=8)
    for x, height in enumerate([*heights, floor]):
        axis.plot([x + 0.35, x + 0.65], [height, height], color="0.4", lw=0.8)
    axis.set_xticks(range(len(names)), [textwrap.fill(n, 12) for n in names], fontsize=9)
    axis.set_ylabel(f"rms error on held-out holds ({unit})")
    axis.margins(y=0.12)
    without_frame(axis)
    return figure


def _bars(heights: list[float], floor: float) -> list[tuple[float, float, str]]:
    """Lower and upper end and colour of each bar of the waterfall."""
    measured, last = heights[0], heights[-1]
    changes = [(min(a, b), max(a, b), _BAND if b <= a else _WORSE) for a, b in pairwise(heights)]
    left = min(floor, last), last, _HELD
    return [(0.0, measured, _MEASURED), *changes, left, (0.0, floor, "0.7")]


def _sizes(heights: list[float], floor: float, unit: str) -> list[str]:
    """What stands on each bar of the waterfall: where it begins, by how much each effect changes it, what is left."""
    changes = [f"{b - a:+.2g} {unit}".replace("-", "−") for a, b in pairwise(heights)]
    left = max(heights[-1] - floor, 0.0)
    return [f"{heights[0]:.3g} {unit}", *changes, f"{left:.2g} {unit}", f"{floor:.2g} {unit}"]


def pictures_of_findings(stored: Stored, verdict: ExperimentFindings) -> dict[str, Callable[[], Figure]]:
    """What makes a picture of each pattern found, by its file's name: what the plain posterior leaves over along it.

    None for a pattern over what does not vary within the experiment.

    Parameters
    ----------
    stored : Stored
        The plain posterior.
    verdict : dict
        The experiment's entry in ``discovery.json``.
    """
    sample = stored.sample
    left = left_over(stored)
    shown: dict[str, Callable[[], Figure]] = {}
    for finding in verdict["where"]:
        along = np.broadcast_to(COVARIATES[finding["covariate"]](sample), left.shape)[sample.protocol.mask]
        if finding["p"] <= _SHOWN and np.ptp(along) > 0.0:
            file = f"where-{finding['covariate'].replace(' ', '-')}.svg"
            shown[file] = partial(_along, sample, left, finding, along)
    return shown


def _along(sample: Sample, left: Floats, finding: Disagreement, x: Floats) -> Figure:
    """What is left over, (H, R), along a covariate (m,) of all readings, with the mean of neighbours."""
    mask = sample.protocol.mask
    within = finding["covariate"] == "time in hold"
    if within:  # a pattern within holds is hidden by their levels
        left = left - left.sum(axis=1, keepdims=True) / np.maximum(mask.sum(axis=1, keepdims=True), 1)
    each = left[mask]
    figure = Figure(figsize=_PANEL, layout="constrained")
    axis = figure.subplots()
    axis.plot(x, each, "o", color=_MEASURED, ms=3, alpha=0.6, label="a reading")
    middles = [(x[group].mean(), each[group].mean()) for group in _neighbours(x)]
    axis.plot(*zip(*middles, strict=True), "-", color=_BAND, lw=2, label="mean of neighbours")
    axis.axhline(0.0, color="0.5", lw=0.6)
    axis.set_xlabel(_LABELS[finding["covariate"]])
    if finding["covariate"] == "direction":
        axis.set_xticks([-1, 1], ["unloading", "loading"])
        axis.set_xlim(-2, 2)
    unit = READ_UNIT[sample.protocol.control]
    axis.set_ylabel(f"measured − plain model ({unit})" + (",\nless its hold's mean" if within else ""))
    axis.set_title(sample.name, loc="left", fontsize=9)
    axis.legend(fontsize=8, frameon=False)
    return figure


def _neighbours(x: Floats) -> list[Ints]:
    """Rows whose mean is shown: those of each value where there are few, else of equally many neighbours."""
    values = np.unique(x)
    if len(values) <= _GROUPS:
        return [np.flatnonzero(x == value) for value in values]
    return np.array_split(np.argsort(x, kind="stable"), _GROUPS)


def left_over(stored: Stored) -> Floats:
    """What was read less what is expected of holds without setting errors, (H, R), 0 where nothing was read.

    Parameters
    ----------
    stored : Stored
    """
    line, _ = _walked(stored)
    left = stored.sample.readings[..., 0] - line.reading.mean(axis=2)
    return np.where(stored.sample.protocol.mask, left, 0.0)


def _walked(stored: Stored) -> tuple[Linearised, dict[str, Array]]:
    """The staircase under some of the stored draws, and these."""
    rows = np.random.default_rng(0).choice(len(stored.theta), min(400, len(stored.theta)), replace=False)
    own = {name: values[rows] for name, values in stored.draws.items()}
    return linearise(stored.sample.protocol, own, stored.sample.model), own


def _residuals(axis: Axes, stored: Stored, held: list[int]) -> None:
    sample = stored.sample
    line, own = _walked(stored)
    variance = sample.variance(own)
    width = np.sqrt(variance + (line.by_setting * own["setting_sd"]) ** 2)
    drawn = line.reading + np.random.default_rng(1).normal(size=line.reading.shape) * width
    middle = line.reading.mean(axis=2)
    low, high = np.quantile(drawn, [0.05, 0.95], axis=2)
    shown = np.flatnonzero(sample.protocol.recorded)
    for k, j in enumerate(shown):
        keep = sample.protocol.mask[j]
        time = sample.protocol.time_s[j][keep]
        x = k + 0.1 + 0.8 * time / max(float(sample.protocol.duration_s[j]), 1e-9)
        number = int(sample.protocol.number[j])
        if number in held:
            axis.axvspan(k, k + 1, color=_HELD, zorder=0, label="kept out to test it" if number == held[0] else None)
        first = k == 0
        axis.fill_between(
            x,
            (low[j] - middle[j])[keep],
            (high[j] - middle[j])[keep],
            color=_BAND,
            alpha=0.3,
            lw=0,
            label="90 % band" if first else None,
        )
        axis.plot(
            x,
            (sample.readings[j, :, 0] - middle[j])[keep],
            "o-",
            color=_MEASURED,
            ms=3,
            lw=0.8,
            label="measured" if first else None,
        )
    axis.axhline(0.0, color="0.5", lw=0.6)
    axis.set_xticks(np.arange(len(shown)) + 0.5, [str(int(sample.protocol.number[j])) for j in shown])
    axis.set_xlim(0, len(shown))


_SHOWN = 0.05  # p of a pattern that is worth a picture
_GROUPS = 12  # points of the line of means: each is the mean of some five readings of a test like the paper's
_PANEL = (5.4, 3.4)  # inches: letters can be read where a phone shows it
_LABELS = {
    "hold": "hold number",
    "displacement": "displacement (mm)",
    "time in hold": "time in hold (s)",
    "elapsed time": "elapsed time (s)",
    "tension": "tension (N)",
    "direction": "direction of the last move",
    "temperature": "warming (K)",
    "length": "length (mm)",
}
