"""The picture of a calibration: by how much each wire's reference length is wrong."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from wirebayes.json_files.calibrate import EstimatedLengths
from wirebayes.numeric.typing import Array
from wirebayes.report.figures import CHAIN, HALF_90, HOLD, QUIET, legend_below, panel

_APART = 0.16  # of a wire's place, by which the two models stand beside each other


def reference_errors(creep: EstimatedLengths, hooke: EstimatedLengths, prior_sd_mm: float) -> Figure:
    """The error of every wire's reference length with its 90 % interval, by the creep model and by Hooke's law alone.

    Parameters
    ----------
    creep, hooke : dict
        Parts of ``calibration.json``.
    prior_sd_mm : float
        Standard deviation of these errors before the session, mm.
    """
    figure, axes = panel("wire", "error of the reference length, mm", size=(7.0, 3.4))
    half = HALF_90 * prior_sd_mm
    axes.axhspan(-half, half, color=QUIET, alpha=0.25, lw=0, label="before, 90 %")
    axes.axhline(0.0, color=QUIET, lw=0.8)
    wires = np.arange(1, len(creep["reference_error_mm"]["mean"]) + 1)
    _errors(axes, wires - _APART, creep, CHAIN, "with the creep model, 90 %")
    _errors(axes, wires + _APART, hooke, HOLD, "with Hooke's law alone, 90 %")
    axes.set_xticks(wires, [str(wire) for wire in wires])
    legend_below(figure, axes, 3)
    return figure


def _errors(axes: Any, places: Array, lengths: EstimatedLengths, colour: str, label: str) -> None:
    """The errors of all wires, by one model."""
    error = lengths["reference_error_mm"]
    mean = np.array(error["mean"], float)
    sd = np.array(error["sd"], float)
    axes.errorbar(places, mean, HALF_90 * sd, fmt="o", ms=4, color=colour, label=label)
