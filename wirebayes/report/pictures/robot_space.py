"""Maps of a robot's workspace: a minute's drift and tilt, slice by slice."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from wirebayes.numeric.typing import Floats
from wirebayes.report.figures import INK, QUIET
from wirebayes.robot.motion.claim import TIME_S, WorkspaceDrift
from wirebayes.robot.pose.maps import Map


def workspace_maps(result: WorkspaceDrift, title: str = "") -> dict[str, Figure]:
    """Median drift and tilt over the workspace, slices above each other, so that a phone shows them whole.

    Where no wires hold the platform, a cross. Slices are horizontal; those of a robot in a vertical plane lie in it.

    Parameters
    ----------
    result : WorkspaceDrift
        On a regular grid.

    Returns
    -------
    dict of str to Figure
        ``drift`` and, where anything tilts, ``tilt``.
    """
    across_axis, along_axis, slice_axis = _axes(result.position_m)
    slices = np.unique(result.position_m[:, slice_axis])
    fields = {
        "drift": (1e3 * result.median_distance_m, "drift, mm"),
        "tilt": (np.degrees(result.median_tilt_rad), "tilt, degrees"),
    }
    if not np.nanmax(fields["tilt"][0], initial=0.0):
        del fields["tilt"]  # parallel lines: nothing tilts
    across, along = (np.unique(result.position_m[:, k]) for k in (across_axis, along_axis))
    figures = {}
    for name, (value, label) in fields.items():
        figure = Figure(figsize=_size(across, along, len(slices)), layout="constrained")
        panels: Any = figure.subplots(len(slices), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
        figure.suptitle(_headed(name, title), fontsize=10.5, x=0.02, ha="left", color=INK)
        image: Any = None
        for axes, level in zip(panels, slices[::-1], strict=True):
            here = result.position_m[:, slice_axis] == level
            places = result.position_m[here][:, [across_axis, along_axis]]
            field = _field(across, along, places, value[here])
            image = _draw_slice(axes, across, along, field, _ends(value)) or image
            axes.set_title(f"{'xyz'[slice_axis]} = {level:.3g} m", fontsize=9.5)
            axes.set_ylabel(f"{'xyz'[along_axis]}, m")
        panels[-1].set_xlabel(f"{'xyz'[across_axis]}, m")
        if image is not None:
            figure.colorbar(image, ax=list(panels), label=label)
        figures[name] = figure
    return figures


def _ends(values: Floats) -> tuple[float, float]:
    """Least and largest of what is known; infinite where nothing is."""
    known = values[np.isfinite(values)]
    return float(np.min(known, initial=np.inf)), float(np.max(known, initial=-np.inf))


def _headed(name: str, title: str) -> str:
    what = f"median {name} within {TIME_S:g} s"
    return f"{title}: {what}" if title else what.capitalize()


def _size(across: Floats, along: Floats, slices: int) -> tuple[float, float]:
    """Of a figure with so many slices above each other, inches."""
    height = 2.6 * (np.ptp(along) / max(np.ptp(across), 1e-9) if len(across) > 1 else 1.0)
    return 4.0, 0.8 + slices * (min(max(height, 1.0), 3.6) + 0.35)


def _field(across: Floats, along: Floats, places: Floats, values: Floats) -> Floats:
    """Values at places (n, 2) as a grid, NaN where there is none."""
    x, y = places.T
    field = np.full((len(along), len(across)), np.nan)
    field[np.searchsorted(along, y), np.searchsorted(across, x)] = values
    return field


def _draw_slice(axes: Any, across: Floats, along: Floats, field: Floats, ends: tuple[float, float]) -> Any:
    """One slice, a cross where no wires hold the platform; the image, if there is anything to colour."""
    lost = np.nonzero(np.isnan(field))
    axes.plot(across[lost[1]], along[lost[0]], "x", color=QUIET, ms=5)
    image = None
    low, high = ends
    if np.isfinite(low):
        image = axes.pcolormesh(_edges(across), _edges(along), field, vmin=low, vmax=high, rasterized=True)
    axes.set_aspect("equal")
    axes.tick_params(labelsize=8)
    return image


def orientation(one: Map) -> str:
    """The orientation of a map in words; nothing where it is level.

    Parameters
    ----------
    one : Map
    """
    return f"({', '.join(f'{value:.3g}' for value in one.rotation_rad)}) rad" if one.rotation_rad.any() else ""


def _axes(position_m: Floats) -> tuple[int, int, int]:
    """Axes across, along and through the slices: of a flat workspace the two it extends in, else x and y."""
    flat = np.flatnonzero(np.ptp(position_m, axis=0) == 0)
    through = 2 if not flat.size or 2 in flat else int(flat[0])
    across, along = (k for k in range(3) if k != through)
    return across, along, through


def _edges(centres: Floats) -> Floats:
    """Edges of cells about their centres; a single cell gets a width of its own."""
    if len(centres) == 1:
        return centres[0] + np.array([-0.05, 0.05])
    middle = 0.5 * (centres[1:] + centres[:-1])
    return np.concatenate([[1.5 * centres[0] - 0.5 * centres[1]], middle, [1.5 * centres[-1] - 0.5 * centres[-2]]])
