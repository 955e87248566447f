"""Pictures of what was understood: what was set and what was read over the time of a test, hold by hold."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wirebayes.io.bench.convert import Recording
from wirebayes.io.experiment import Experiment
from wirebayes.io.readings import Hold
from wirebayes.report.drawn import save_figure
from wirebayes.report.figures import CHAIN, HOLD, INK, QUIET, verbatim, without_frame
from wirebayes.wire.protocol import Control

_MOST_NUMBERS = 40  # holds that can all be numbered in a picture
_MINUTES = 600.0  # s from which on an axis in minutes reads better


def understood(experiment: Experiment, target: Path, recording: Recording | None = None) -> None:
    """Draw one test.

    Parameters
    ----------
    target : Path
        The picture to write.
    recording : Recording, optional
        Everything that was recorded, of which the experiment keeps a part.
    """
    figure = Figure(figsize=(9.0, 5.4), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(1.0, 2.0))
    _name_axes(upper, lower, experiment.control)
    holds = experiment.holds
    starts = [hold.start_s for hold in holds]
    if recording is not None:
        starts = recording.start_s.tolist()
    ends = [start + hold.duration_s for start, hold in zip(starts, holds, strict=True)]
    scale, unit = 1.0, "s"
    if max(ends) > _MINUTES:
        scale, unit = 60.0, "min"
    time = f"time of the test, {unit}"
    if recording is None:
        time += " (moves take none)"
    else:
        _draw_recording(upper, lower, recording, scale, experiment.control)
    _draw_holds(upper, lower, holds, starts, scale)
    lower.set_xlabel(time)
    material = verbatim(experiment.material)
    title = f"{experiment.name}: {experiment.length_mm:g} mm of {material}; hold numbers above"
    upper.set_title(title, fontsize=10.5, loc="left", color=INK, pad=16)
    _name_lines(figure, upper, lower)
    save_figure(figure, target)


def _name_axes(upper: Axes, lower: Axes, control: Control) -> None:
    """What is set above, what is read below."""
    labels = ["displacement, mm", "tension, N"]
    if control == "force":
        labels.reverse()
    for axes, label in zip((upper, lower), labels, strict=True):
        axes.set_ylabel(label)
        without_frame(axes)
        axes.tick_params(labelsize=9)
        axes.margins(x=0.01)


def _name_lines(figure: Figure, upper: Axes, lower: Axes) -> None:
    """A legend of both panels below them, each label once."""
    shown = {}
    for axes in (upper, lower):
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            shown[label] = handle
    place: Any = "outside lower center"
    figure.legend(shown.values(), shown.keys(), loc=place, ncols=len(shown), frameon=False, fontsize=8.5)


def _draw_recording(upper: Axes, lower: Axes, recording: Recording, scale: float, control: Control) -> None:
    """Everything that was recorded, what is set above."""
    values = [recording.displacement_mm, recording.tension_N]
    if control == "force":
        values.reverse()
    for axes, recorded in zip((upper, lower), values, strict=True):
        axes.plot(recording.time_s / scale, recorded, color=QUIET, lw=1.0, zorder=1, label="recorded")


def _draw_holds(upper: Axes, lower: Axes, holds: Sequence[Hold], starts: Sequence[float], scale: float) -> None:
    """Settings above and readings below; every second recorded hold stands on grey."""
    labels = {"held": "held", "gap": "held, not recorded", "kept": "reading"}  # each once in the legend
    recorded = sum(hold.recorded for hold in holds)
    every = int(np.ceil(recorded / _MOST_NUMBERS))
    row = 0
    for hold, start in zip(holds, starts, strict=True):
        end = start + hold.duration_s
        ends = np.array([start, end]) / scale
        setting = [hold.setting] * 2
        if not hold.recorded:
            upper.plot(ends, setting, zorder=3, label=labels.pop("gap", None), color=INK, lw=1.6, ls=":")
            lower.axvspan(*ends, color=QUIET, alpha=0.3, lw=0)
            continue
        upper.plot(ends, setting, zorder=3, label=labels.pop("held", None), color=HOLD, lw=2.2)
        if row % 2:
            for axes in (upper, lower):
                axes.axvspan(*ends, color=QUIET, alpha=0.16, lw=0, zorder=0)
        if row % every == 0:
            middle = float(ends.mean())
            _number(upper, hold, middle)
        time = (start + hold.time_s) / scale
        lower.plot(time, hold.readings, color=QUIET, lw=1.0, zorder=2)
        lower.plot(time, hold.readings, "o", color=CHAIN, ms=3.2, zorder=3, label=labels.pop("kept", None))
        row += 1


def _number(axes: Axes, hold: Hold, middle: float) -> None:
    """A hold's number above the panel."""
    place = middle, 1.02
    axes.annotate(
        str(hold.number),
        place,
        xycoords=("data", "axes fraction"),
        ha="center",
        va="bottom",
        fontsize=7.5,
        color=INK,
    )
