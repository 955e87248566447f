"""Maps of a robot's workspace: a minute's drift and how probable the paper's claim is, height by height."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from wirebayes.report.figures import INK, QUIET
from wirebayes.robot.claim import DISTANCE_M, TILT_RAD, TIME_S, WorkspaceDrift


def workspace_map(result: WorkspaceDrift, title: str = "") -> Figure:
    """Median drift and tilt over the workspace, a row each, a column a height; where no wires hold it, a cross.

    Parameters
    ----------
    result : WorkspaceDrift
        On a regular grid.
    title : str
    """
    heights = np.unique(result.position_m[:, 2])
    rows = (
        (1e3 * np.nanmedian(result.distance_m, 1), f"drift, mm\n(claim: {1e3 * DISTANCE_M:g})"),
        (np.degrees(np.nanmedian(result.tilt_rad, 1)), f"tilt, degrees\n(claim: {np.degrees(TILT_RAD):.3g})"),
    )
    figure = Figure(figsize=(2.1 * len(heights) + 1.6, 4.7), layout="constrained")
    panels: Any = figure.subplots(2, len(heights), sharex=True, sharey=True, squeeze=False)
    figure.suptitle(title or f"Median drift within {TIME_S:g} s", fontsize=10.5, x=0.02, ha="left", color=INK)
    across, along = (np.unique(result.position_m[:, k]) for k in (0, 1))
    for line, (value, label) in zip(panels, rows, strict=True):
        image: Any = None
        for axes, height in zip(line, heights, strict=True):
            level = result.position_m[:, 2] == height
            field = np.full((len(along), len(across)), np.nan)
            x, y = result.position_m[level, :2].T
            field[np.searchsorted(along, y), np.searchsorted(across, x)] = value[level]
            lost = np.nonzero(np.isnan(field))
            axes.plot(across[lost[1]], along[lost[0]], "x", color=QUIET, ms=5)
            image = axes.pcolormesh(
                across, along, field, vmin=value.min(), vmax=value.max(), shading="nearest", rasterized=True
            )
            axes.set_aspect("equal")
            axes.tick_params(labelsize=8)
        line[0].set_ylabel("y, m")
        figure.colorbar(image, ax=line, label=label)
    for axes, height in zip(panels[0], heights, strict=True):
        axes.set_title(f"z = {height:.3g} m", fontsize=9.5)
    for axes in panels[1]:
        axes.set_xlabel("x, m")
    return figure
