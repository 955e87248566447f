"""An example of what `predict` reads, beside a fit: one hold more of the same test, to be edited."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from wirebayes.io.experiment import Experiment
from wirebayes.io.readings import READ, SET, STRETCH, Hold
from wirebayes.io.run_folder import write_csv

NEXT_HOLD = "next.csv"
_MOST_READINGS = 5  # of a recording's thousands: enough to see a curve, few enough to edit


def next_hold_of(name: str) -> str:
    """The name of an example for a test that is fitted with others of another kind."""
    return f"next-{name}.csv"


def write_next_holds(experiments: Sequence[Experiment], folder: Path, *, hold_by_hold: bool) -> None:
    """Write an example of the first test of a fit, and of the first one of every other kind that it has.

    Tests are of one kind where the same is set and temperatures are known of both or of neither: their examples have
    the same columns.

    Parameters
    ----------
    experiments : sequence of Experiment
    folder : Path
    hold_by_hold : bool
        As for `write_next_hold`.
    """
    seen: set[tuple[str, bool]] = set()
    for experiment in experiments:
        kind = experiment.control, experiment.recorded_holds[-1].temperature_C is not None
        if kind in seen:
            continue
        file = next_hold_of(experiment.name) if seen else NEXT_HOLD
        write_next_hold(experiment, folder, hold_by_hold=hold_by_hold, file=file)
        seen.add(kind)


def write_next_hold(experiment: Experiment, folder: Path, *, hold_by_hold: bool = False, file: str = NEXT_HOLD) -> None:
    """Write the protocol of one hold more of a test into the folder of its results.

    Parameters
    ----------
    experiment : Experiment
    folder : Path
    hold_by_hold : bool
        Whether it was fitted so: a hold is then predicted from its first reading, and the example is a tested hold
        once more, from where that began.
    file : str
        The example's name.
    """
    control = experiment.control
    last = example = experiment.recorded_holds[-1]
    setting = _one_step_further(experiment)
    if hold_by_hold:
        example = max(experiment.recorded_holds, key=lambda hold: float(hold.readings[0]))
        setting = example.setting
    number = int(last.number or 0) + 1
    header = ["hold", SET[control], "time_s"]
    rows: list[list[object]] = []
    for time in _some_of_its_times(example):
        rows.append([number, setting, time])
    if last.temperature_C is not None:
        header.append("temperature_C")
        for row in rows:
            row.append(float(last.temperature_C[-1]))
    if hold_by_hold:
        header.append(READ[control])
        first, *others = rows
        first.append(float(example.readings[0]))
        for row in others:
            row.append("")
    write_csv(folder / file, header, rows)


def _one_step_further(experiment: Experiment) -> float:
    """A setting as far beyond the largest of the test as that lies beyond the second largest."""
    settings = sorted({hold.setting for hold in experiment.holds})
    step = settings[-1] - settings[-2] if len(settings) > 1 else 0.0
    further = settings[-1] + step
    if experiment.control == "displacement":
        further = min(further, STRETCH * experiment.length_mm)  # predict reads no more
    return float(f"{further:.10g}")


def _some_of_its_times(hold: Hold) -> list[float]:
    """The first and the last reading's time of a hold, and a few between them."""
    count = hold.time_s.size
    chosen = np.linspace(0, count - 1, min(count, _MOST_READINGS)).round().astype(int)
    return [float(time) for time in hold.time_s[chosen]]
