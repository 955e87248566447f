"""The page of ``wirebayes predict``: what the next holds will read, beside the table of the same name."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from wirebayes.io.readings import READ, SET
from wirebayes.io.run_folder import check_file, write_text
from wirebayes.notice import Warned
from wirebayes.prediction.table import Prediction
from wirebayes.report.blocks import (
    Block,
    Page,
    Picture,
    Pictures,
    Section,
    Table,
    Text,
    as_sentence,
    before_the_answer,
    beside_the_answer,
    drawn,
    files_beside,
    span,
)
from wirebayes.sentences import counted, number_within, quantity
from wirebayes.wire.control import READ_UNIT, SET_UNIT
from wirebayes.wire.protocol import Control

_MOST_ROWS = 200  # of the table on a page; the file has all


def write_beside(predicted: Prediction, table: Path) -> Path:
    """Write the page of a prediction beside its table, under the table's name, and return its path.

    Parameters
    ----------
    table : Path
        What the rows were written to.
    """
    from wirebayes.report.page import render  # which loads all that pages are rendered with

    stem = table.name if table.suffix == ".html" else table.stem
    path = table.with_name(f"{stem}.html")
    check_file(path)
    write_text(path, render(predict_page(predicted, table)))
    return path


def predict_page(predicted: Prediction, table: Path) -> Page:
    """The answer for the first hold, the bands of all, and every row.

    Parameters
    ----------
    table : Path
        What the rows were written to.
    """
    about = predicted.attrs
    warned = zip(about.get("warning_kinds", ()), about.get("warnings", ()), strict=True)
    warnings: Warned = {"warnings": [{"kind": kind, "text": text} for kind, text in warned]}
    figure = Figure(figsize=(6.4, 4.2), layout="constrained")
    predicted.plot(figure.subplots())
    alt = f"Predicted readings of {about['experiment']} against the time in each hold, medians and 90 % bands."
    blocks: list[Block] = [
        *before_the_answer(warnings),
        Pictures([Picture(drawn(figure), alt, _CAPTION)]),
        *beside_the_answer(warnings),
        Text(as_sentence(about["prediction"])),
        _rows(predicted),
    ]
    beside = files_beside(table.parent, [(table.name, "every row, with mean and standard deviation")])
    sections = [Section(about["experiment"], blocks), beside]
    return Page("What later holds will read", in_a_sentence(predicted), sections, f"Seed {about['seed']}.")


def in_a_sentence(predicted: Prediction) -> str:
    """What the first hold of a prediction reads at its first time and at its last, with 90 % bands.

    Parameters
    ----------
    predicted : Prediction
    """
    control = _control(predicted)
    holds = predicted["hold"].values
    first = np.flatnonzero(holds == holds[0])
    setting = f"{predicted[SET[control]].values[0]:g} {SET_UNIT[control]}"
    begin, end = (_at(predicted, int(row)) for row in (first[0], first[-1]))
    course = begin if len(first) == 1 else f"{begin} and {end}"
    others = len(np.unique(holds)) - 1
    more = f"; {counted(others, 'more hold')} below" if others else ""
    return (
        f"Hold {holds[0]} of {predicted.attrs['experiment']}, at {setting}, is expected to read {course}; "
        f"90 % intervals in brackets{more}."
    )


def _at(predicted: Prediction, row: int) -> str:
    unit = READ_UNIT[_control(predicted)]
    middle, low, high = (float(predicted[f"{name}_{unit}"].values[row]) for name in ("q50", "q05", "q95"))
    return f"{quantity(middle, low, high, unit)} after {predicted['time_s'].values[row]:g} s"


def _rows(predicted: Prediction) -> Table:
    """A row for each reading, with its band."""
    control = _control(predicted)
    unit = READ_UNIT[control]
    names = ("hold", SET[control], "time_s", f"q50_{unit}", f"q05_{unit}", f"q95_{unit}")
    columns = [predicted[name].values[:_MOST_ROWS].tolist() for name in names]
    rows = [
        [str(hold), f"{setting:g}", f"{time:g}", number_within(middle, low, high), span(low, high)]
        for hold, setting, time, middle, low, high in zip(*columns, strict=True)
    ]
    read = READ[control].split("_")[0]
    header = ["hold", f"{SET[control].split('_')[0]}, {SET_UNIT[control]}", "time in the hold, s"]
    header += [f"{read}, {unit}", f"90 % band, {unit}"]
    left = predicted.sizes["reading"] - len(rows)
    return Table(header, rows, f"The file has {counted(left, 'more row')}." if left else "")


def _control(predicted: Prediction) -> Control:
    return "displacement" if "mean_N" in predicted else "force"


_CAPTION = "Lines are medians; bands hold 90 % of such readings: of parameters, settings, the sensor and rounding."
