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
from wirebayes.report.blocks import save_figure
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
    starts = [hold.start_s for hold in experiment.holds] if recording is None else recording.start_s.tolist()
    last = max(start + hold.duration_s for start, hold in zip(starts, experiment.holds, strict=True))
    scale, unit = (60.0, "min") if last > _MINUTES else (1.0, "s")
    what_is_set = ["displacement, mm", "tension, N"]
    if experiment.control == "force":
        what_is_set.reverse()
    for axes, label in zip((upper, lower), what_is_set, strict=True):
        axes.set_ylabel(label)
        without_frame(axes)
        axes.tick_params(labelsize=9)
        axes.margins(x=0.01)
    if recording is not None:
        _draw_recording(upper, lower, recording, scale, experiment.control)
    _draw_holds(upper, lower, experiment.holds, starts, scale)
    lower.set_xlabel(f"time of the test, {unit}" + ("" if recording is not None else " (moves take none)"))
    what = f"{experiment.name}: {experiment.length_mm:g} mm of {verbatim(experiment.material)}"
    upper.set_title(f"{what}; hold numbers above", fontsize=10.5, loc="left", color=INK, pad=16)
    shown = dict(
        reversed(pair) for axes in (upper, lower) for pair in zip(*axes.get_legend_handles_labels(), strict=True)
    )
    place: Any = "outside lower center"
    figure.legend(shown.values(), shown.keys(), loc=place, ncols=len(shown), frameon=False, fontsize=8.5)
    save_figure(figure, target)


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
    every = int(np.ceil(sum(hold.recorded for hold in holds) / _MOST_NUMBERS))
    row = 0
    for hold, start in zip(holds, starts, strict=True):
        ends = np.array([start, start + hold.duration_s]) / scale
        style: dict[str, Any] = {"color": HOLD, "lw": 2.2} if hold.recorded else {"color": INK, "lw": 1.6, "ls": ":"}
        key = "held" if hold.recorded else "gap"
        upper.plot(ends, [hold.setting] * 2, zorder=3, label=labels.pop(key, None), **style)
        if not hold.recorded:
            lower.axvspan(*ends, color=QUIET, alpha=0.3, lw=0)
            continue
        if row % 2:
            for axes in (upper, lower):
                axes.axvspan(*ends, color=QUIET, alpha=0.16, lw=0, zorder=0)
        if row % every == 0:
            above = float(ends.mean()), 1.02
            upper.annotate(
                str(hold.number),
                above,
                xycoords=("data", "axes fraction"),
                ha="center",
                va="bottom",
                fontsize=7.5,
                color=INK,
            )
        time = (start + hold.time_s) / scale
        lower.plot(time, hold.readings, color=QUIET, lw=1.0, zorder=2)
        lower.plot(time, hold.readings, "o", color=CHAIN, ms=3.2, zorder=3, label=labels.pop("kept", None))
        row += 1
