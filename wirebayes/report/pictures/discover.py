"""Pictures of a discovery: readings against the plain and the final model, and what the plain one leaves over where."""

import textwrap
from collections.abc import Callable, Sequence
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
from wirebayes.wire.protocol import Protocol
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
    for file, make in pictures_of_findings(plain, verdict).items():
        figure_of[f"{name}/{file}"] = make
    return figure_of


def before_and_after(plain: Stored, final: Stored, verdict: ExperimentFindings) -> Figure:
    """Measured minus predicted readings for the plain and the final posterior of an experiment.

    Parameters
    ----------
    plain, final : Stored
    verdict : dict
        The experiment's part of ``discovery.json``.
    """
    shown = [("plain model", plain, _WORSE)]
    if verdict["verdict"] != "nothing-missing":
        shown.append((f"with {_added(verdict)}", final, _BAND))
    panels = len(shown)
    ratios = [1.4] + [1.0] * panels
    height = 3.2 + 2.4 * panels
    figure = Figure(figsize=(9.0, height), layout="constrained")
    above, *axes = figure.subplots(1 + panels, 1, sharex=True, height_ratios=ratios)
    _draw_curves(above, plain, shown)
    sample = plain.sample
    name = sample.name
    control = sample.protocol.control
    unit = READ_UNIT[control]
    held = verdict["held_out"]["holds"]
    for axis, (title, stored, _) in zip(axes, shown, strict=True):
        axis.sharey(axes[0])
        _residuals(axis, stored, held)
        axis.set_title(f"{name}: {title}", loc="left", fontsize=10)
        axis.set_ylabel(f"measured − predicted, {unit}")
    what = READ[control]
    above.set_ylabel(f"{what}, {unit}")
    name_holds(axes[-1], plain)
    for axis in (above, *axes):
        without_frame(axis)
    handles, labels = axes[0].get_legend_handles_labels()
    columns = len(labels)
    figure.legend(handles, labels, loc="outside lower center", ncols=columns, fontsize=8, frameon=False)
    return figure


def _draw_curves(axes: Axes, plain: Stored, shown: Sequence[tuple[str, Stored, str]]) -> None:
    """The readings with the curve of each model, given with its title and colour; the plain one comes first."""
    curves = [curve(stored) for _, stored, _ in shown]
    for (title, stored, colour), found in zip(shown, curves, strict=True):
        draw_curve(axes, stored, found, colour, f"{title}, 90 % band")
    draw_readings(axes, plain, curves[0])
    axes.set_title(f"{plain.sample.name}: readings and curves", loc="left", fontsize=10)
    axes.legend(fontsize=8, frameon=False)


def _added(verdict: ExperimentFindings) -> str:
    """What the final model has beyond the plain one."""
    names = [spoken(effect) for effect in verdict["accepted"]]
    if verdict["verdict"] in ("partial", "unknown"):
        names.append("something unknown")
    return " + ".join(names) or "what may be missing"


def _join_bars(axis: Axes, heights: Sequence[float]) -> None:
    """Lines from where one bar ends to where the next begins."""
    for x, height in enumerate(heights):
        ends = [x + 0.35, x + 0.65]
        axis.plot(ends, [height, height], color="0.4", lw=0.8)


def waterfall(verdict: ExperimentFindings) -> Figure:
    """The rms error on held-out holds, from the plain model down: a bar for each named effect, and for what is left.

    Parameters
    ----------
    verdict : dict
        The experiment's part of ``discovery.json``, with at least one accepted effect and holds that were held out.
    """
    steps = verdict["steps"]
    unit = unit_read(steps[0])
    floor = read_value(verdict["held_out"], "floor")
    errors = [read_value(step, "rmse") for step in steps]
    heights = [error for error in errors if error is not None]
    bars = _bars(heights, floor)
    width = max(1.1 * len(bars), 5.4)
    figure = Figure(figsize=(width, 3.4), layout="constrained")
    axis = figure.subplots()
    labels = _sizes(heights, floor, unit)
    least = 0.002 * max(heights)
    _draw_bars(axis, bars, labels, least)
    _join_bars(axis, [*heights, floor])
    effects = [spoken(step["model"]) for step in steps[1:]]
    names = ["plain model", *effects, "left over", "noise"]
    wrapped = [textwrap.fill(name, 12) for name in names]
    axis.set_xticks(range(len(names)), wrapped, fontsize=9)
    axis.set_ylabel(f"rms error on held-out holds ({unit})")
    axis.margins(y=0.12)
    without_frame(axis)
    return figure


def _draw_bars(axis: Axes, bars: Sequence[tuple[float, float, str]], labels: Sequence[str], least: float) -> None:
    """Bars of at least some height, with their labels."""
    for x, ((low, high, colour), label) in enumerate(zip(bars, labels, strict=True)):
        height = max(high - low, least)
        axis.bar(x, height, bottom=low, color=colour, width=0.7)
        axis.text(x, high, label, ha="center", va="bottom", fontsize=8)


def _bars(heights: list[float], floor: float) -> list[tuple[float, float, str]]:
    """Lower and upper end and colour of each bar of the waterfall."""
    bars = [(0.0, heights[0], _MEASURED)]
    for before, after in pairwise(heights):
        colour = _BAND if after <= before else _WORSE
        bars.append((min(before, after), max(before, after), colour))
    last = heights[-1]
    bars.append((min(floor, last), last, _HELD))
    bars.append((0.0, floor, "0.7"))
    return bars


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
        if finding["p"] > _SHOWN:
            continue
        covariate = finding["covariate"]
        value_of = COVARIATES[covariate]
        values = np.broadcast_to(value_of(sample), left.shape)
        along = values[sample.protocol.mask]
        if np.ptp(along) > 0.0:
            dashed = covariate.replace(" ", "-")
            shown[f"where-{dashed}.svg"] = partial(_along, sample, left, finding, along)
    return shown


def _along(sample: Sample, left: Floats, finding: Disagreement, x: Floats) -> Figure:
    """What is left over, (H, R), along a covariate (m,) of all readings, with the mean of neighbours."""
    protocol = sample.protocol
    mask = protocol.mask
    covariate = finding["covariate"]
    unit = READ_UNIT[protocol.control]
    label = f"measured − plain model ({unit})"
    if covariate == "time in hold":  # a pattern within holds is hidden by their levels
        readings = np.maximum(mask.sum(axis=1, keepdims=True), 1)
        mean = left.sum(axis=1, keepdims=True) / readings
        left = left - mean
        label += ",\nless its hold's mean"
    each = left[mask]
    figure = Figure(figsize=_PANEL, layout="constrained")
    axis = figure.subplots()
    axis.plot(x, each, "o", color=_MEASURED, ms=3, alpha=0.6, label="a reading")
    groups = _neighbours(x)
    middles = [x[group].mean() for group in groups]
    means = [each[group].mean() for group in groups]
    axis.plot(middles, means, "-", color=_BAND, lw=2, label="mean of neighbours")
    axis.axhline(0.0, color="0.5", lw=0.6)
    axis.set_xlabel(_LABELS[covariate])
    if covariate == "direction":
        axis.set_xticks([-1, 1], ["unloading", "loading"])
        axis.set_xlim(-2, 2)
    axis.set_ylabel(label)
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
    rng = np.random.default_rng(0)
    count = len(stored.theta)
    rows = rng.choice(count, min(400, count), replace=False)
    own = {name: values[rows] for name, values in stored.draws.items()}
    return linearise(stored.sample.protocol, own, stored.sample.model), own


def _residuals(axis: Axes, stored: Stored, held: list[int]) -> None:
    """Readings less their median, in the 90 % band, hold after hold; those of `held` shaded."""
    protocol = stored.sample.protocol
    bands = _left_with_band(stored)
    shown = np.flatnonzero(protocol.recorded)
    numbers = protocol.number[shown].tolist()
    labels = {"held": "kept out to test it", "band": "90 % band", "left": "measured"}  # each once in the legend
    for place, hold in enumerate(shown.tolist()):
        keep = protocol.mask[hold]
        of_hold = [values[hold][keep] for values in bands]
        if numbers[place] in held:
            axis.axvspan(place, place + 1, color=_HELD, zorder=0, label=labels.pop("held", None))
        _draw_hold(axis, place + 0.1 + _scaled_time(protocol, hold), of_hold, labels)
    axis.axhline(0.0, color="0.5", lw=0.6)
    middles = np.arange(len(shown)) + 0.5
    axis.set_xticks(middles, list(map(str, numbers)))
    axis.set_xlim(0, len(shown))


def _scaled_time(protocol: Protocol, hold: int) -> Floats:
    """Times of a hold's readings, drawn over `_HOLD_WIDTH`."""
    time = protocol.time_s[hold][protocol.mask[hold]]
    return _HOLD_WIDTH * time / max(float(protocol.duration_s[hold]), 1e-9)


def _draw_hold(axis: Axes, x: Floats, of_hold: list[Floats], labels: dict[str, str]) -> None:
    """What is left of the readings of a hold in their band; labels are used up."""
    left, low, high = of_hold
    axis.fill_between(x, low, high, color=_BAND, alpha=0.3, lw=0, label=labels.pop("band", None))
    axis.plot(x, left, "o-", color=_MEASURED, ms=3, lw=0.8, label=labels.pop("left", None))


def _left_with_band(stored: Stored) -> tuple[Floats, Floats, Floats]:
    """Readings less what is expected, and the ends of their 90 % band, each (H, R)."""
    line, own = _walked(stored)
    by_setting = line.by_setting * own["setting_sd"]
    width = np.sqrt(stored.sample.variance(own) + by_setting**2)
    noise = np.random.default_rng(1).normal(size=line.reading.shape)
    middle = line.reading.mean(axis=2)
    low, high = np.quantile(line.reading + noise * width, [0.05, 0.95], axis=2)
    return stored.sample.readings[..., 0] - middle, low - middle, high - middle


_HOLD_WIDTH = 0.8  # of the place of a hold: a tenth stays empty on either side
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
