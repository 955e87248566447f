"""The page of ``wirebayes predict``: what the next holds will read, beside the table of the same name."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from wirebayes.io.readings import READ, SET
from wirebayes.io.run_folder import check_file, write_text
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
    files_beside,
    span,
)
from wirebayes.report.drawn import drawn
from wirebayes.result_warnings import NoticeJson, Warned
from wirebayes.sentences import counted, number_within, quantity, short
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
    name = about["experiment"]
    kinds = about.get("warning_kinds", ())
    texts = about.get("warnings", ())
    notices: list[NoticeJson] = [{"kind": kind, "text": text} for kind, text in zip(kinds, texts, strict=True)]
    warned: Warned = {"warnings": notices}
    blocks: list[Block] = [
        *before_the_answer(warned),
        *_pictures(predicted),
        *beside_the_answer(warned),
        Text(as_sentence(about["prediction"])),
        _rows(predicted),
    ]
    files = [(table.name, "every row, with mean and standard deviation")]
    sections = [Section(name, blocks), files_beside(table.parent, files)]
    lead = in_a_sentence(predicted)
    return Page("What later holds will read", lead, sections, f"Seed {about['seed']}.")


def _pictures(predicted: Prediction) -> list[Block]:
    """The medians and bands of the holds that have any."""
    middle = predicted[f"q50_{READ_UNIT[_control(predicted)]}"].values
    if np.isnan(middle).all():
        return []
    figure = Figure(figsize=(6.4, 4.2), layout="constrained")
    predicted.plot(figure.subplots())
    alt = (
        f"Predicted readings of {predicted.attrs['experiment']} against the time in each hold, medians and 90 % bands."
    )
    return [Pictures([Picture(drawn(figure), alt, _CAPTION)])]


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
    hold = f"Hold {holds[0]} of {predicted.attrs['experiment']}, at {setting},"
    others = len(np.unique(holds)) - 1
    more = f"; {counted(others, 'more hold')} below" if others else ""
    middle, _, _ = _figures(predicted, int(first[0]))
    if np.isnan(middle):
        return f"{hold} has no predicted reading: in most draws the wire cannot carry what is set{more}."
    course = _at(predicted, int(first[0]))
    if len(first) > 1:
        course += f" and {_at(predicted, int(first[-1]))}"
    return f"{hold} is expected to read {course}; 90 % intervals in brackets{more}."


def _at(predicted: Prediction, row: int) -> str:
    """Median and interval of one reading, and its time."""
    middle, low, high = _figures(predicted, row)
    unit = READ_UNIT[_control(predicted)]
    return f"{quantity(middle, low, high, unit)} after {short(predicted['time_s'].values[row])} s"


def _figures(predicted: Prediction, row: int) -> tuple[float, float, float]:
    """Median and ends of the 90 % interval of one reading."""
    unit = READ_UNIT[_control(predicted)]
    middle = float(predicted[f"q50_{unit}"].values[row])
    low = float(predicted[f"q05_{unit}"].values[row])
    high = float(predicted[f"q95_{unit}"].values[row])
    return middle, low, high


def _cells(predicted: Prediction, row: int) -> list[str]:
    """Hold, setting, time and band of one reading."""
    hold = predicted["hold"].values[row]
    setting = predicted[SET[_control(predicted)]].values[row]
    time = predicted["time_s"].values[row]
    middle, low, high = _figures(predicted, row)
    return [str(hold), f"{setting:g}", f"{time:g}", number_within(middle, low, high), span(low, high)]


def _rows(predicted: Prediction) -> Table:
    """A row for each reading, with its band."""
    control = _control(predicted)
    unit = READ_UNIT[control]
    shown = min(predicted.sizes["reading"], _MOST_ROWS)
    rows = [_cells(predicted, row) for row in range(shown)]
    read = READ[control].split("_")[0]
    was_set = SET[control].split("_")[0]
    header = ["hold", f"{was_set}, {SET_UNIT[control]}", "time in the hold, s"]
    header += [f"{read}, {unit}", f"90 % band, {unit}"]
    left = predicted.sizes["reading"] - shown
    caption = f"The file has {counted(left, 'more row')}." if left else ""
    return Table(header, rows, caption)


def _control(predicted: Prediction) -> Control:
    return "displacement" if "mean_N" in predicted else "force"


_CAPTION = "Lines are medians; bands hold 90 % of such readings: of parameters, settings, the sensor and rounding."
