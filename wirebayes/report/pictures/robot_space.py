"""Maps of a robot's workspace: a minute's drift and tilt, slice by slice."""

from typing import Any, NamedTuple

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
    position_m = result.position_m
    plane = _Plane(*_axes(position_m))
    values = {"drift": 1e3 * result.median_distance_m, "tilt": np.degrees(result.median_tilt_rad)}
    units = {"drift": "mm", "tilt": "degrees"}
    if not np.nanmax(values["tilt"], initial=0.0):
        del values["tilt"]  # parallel lines: nothing tilts
    figures = {}
    for name, value in values.items():
        headline = _headed(name, title)
        figure, image = _slices(position_m, value, plane, headline)
        if image is not None:
            label = f"{name}, {units[name]}"
            figure.colorbar(image, ax=figure.axes, label=label)
        figures[name] = figure
    return figures


class _Plane(NamedTuple):
    """Axes across, along and through the slices, 0 to 2."""

    across: int
    along: int
    through: int


def _slices(position_m: Floats, value: Floats, plane: _Plane, headline: str) -> tuple[Figure, Any]:
    """A figure with a panel for each slice, and the last image in it, if there is anything to colour."""
    across = np.unique(position_m[:, plane.across])
    along = np.unique(position_m[:, plane.along])
    height = position_m[:, plane.through]
    levels = np.unique(height)
    size = _size(across, along, len(levels))
    figure = Figure(figsize=size, layout="constrained")
    grid: Any = figure.subplots(len(levels), 1, sharex=True, sharey=True, squeeze=False)
    panels = grid[:, 0]
    figure.suptitle(headline, fontsize=10.5, x=0.02, ha="left", color=INK)
    x, y, z = ("xyz"[axis] for axis in plane)
    ends = _ends(value)
    image: Any = None
    in_plane = position_m[:, [plane.across, plane.along]]
    for axes, level in zip(panels, levels[::-1], strict=True):
        here = height == level
        field = _field(across, along, in_plane[here], value[here])
        image = _draw_slice(axes, across, along, field, ends) or image
        axes.set_title(f"{z} = {level:.3g} m", fontsize=9.5)
        axes.set_ylabel(f"{y}, m")
    panels[-1].set_xlabel(f"{x}, m")
    return figure, image


def _ends(values: Floats) -> tuple[float, float]:
    """Least and largest of what is known; infinite where nothing is."""
    known = values[np.isfinite(values)]
    least = float(np.min(known, initial=np.inf))
    largest = float(np.max(known, initial=-np.inf))
    if least == largest == 0.0:
        largest = 1.0  # of wires that do not creep: colours of nothing, on a scale that does not magnify it
    return least, largest


def _headed(name: str, title: str) -> str:
    what = f"median {name} within {TIME_S:g} s"
    return f"{title}: {what}" if title else what.capitalize()


def _size(across: Floats, along: Floats, slices: int) -> tuple[float, float]:
    """The size of a figure with so many slices above each other, inches."""
    ratio = np.ptp(along) / max(np.ptp(across), 1e-9) if len(across) > 1 else 1.0
    height = min(max(2.6 * ratio, 1.0), 3.6)
    return 4.0, 0.8 + slices * (height + 0.35)


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
    if not one.rotation_rad.any():
        return ""
    components = ", ".join(f"{value:.3g}" for value in one.rotation_rad)
    return f"({components}) rad"


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
    first = 1.5 * centres[0] - 0.5 * centres[1]
    last = 1.5 * centres[-1] - 0.5 * centres[-2]
    return np.concatenate([[first], middle, [last]])
