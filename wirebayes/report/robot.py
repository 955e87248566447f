"""Pictures of a robot: in 3-D with its drift exaggerated, drift against time, workspace map, error budget."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from wirebayes.robot.answer import Question
from wirebayes.robot.claim import DISTANCE_M, TILT_RAD, WorkspaceDrift
from wirebayes.robot.description import Robot
from wirebayes.robot.drift import Course

Floats = NDArray[np.float64]
_STILL, _MOVED, _WIRE = "#30506d", "#c8553d", "#8a8f94"


def save_pose(
    folder: Path, robot: Robot, asked: Question, content: dict[str, Any], courses: dict[float, Course]
) -> None:
    """Write the pictures that go with ``pose.json``; none when the pose cannot be held."""
    if not courses or not courses[0.0].found.any():
        return
    shared = courses[0.0]
    scene(robot, asked.position_m, asked.rotation, shared).savefig(folder / "robot.png", dpi=150)
    drift_in_time(content["drift"]).savefig(folder / "drift.png", dpi=150)
    error_in_time(content["pose_error"]).savefig(folder / "pose-error.png", dpi=150)
    if "shared_draw" in content["variance_shares"]:
        error_budget(content["variance_shares"]).savefig(folder / "error-budget.png", dpi=150)


def scene(
    robot: Robot, position_m: Floats, rotation: Floats, course: Course, exaggeration: float | None = None
) -> Figure:
    """The robot in 3-D, at rest and drifted; the drift enlarged by a factor that the title states.

    Parameters
    ----------
    robot : Robot
    position_m, rotation : (3,), (3, 3) arrays
    course : Course
        Its mean over the draws at the last time is drawn.
    exaggeration : float, optional
        Default: a round factor that makes the drift a twentieth of the robot.
    """
    shift = course.position_m[course.found, -1].mean(0) - position_m
    turn = course.rotation[course.found, -1].mean(0) - rotation
    size = np.ptp(robot.exit_m, axis=0).max()
    if exaggeration is None:
        exaggeration = _round(0.05 * size / max(np.linalg.norm(shift), 1e-12))
    figure = Figure(figsize=(6.4, 5.6), layout="constrained")
    axes: Any = figure.add_subplot(projection="3d")
    here = position_m + robot.platform_m @ rotation.T
    there = position_m + exaggeration * shift + robot.platform_m @ (rotation + exaggeration * turn).T
    for a, p, q in zip(robot.exit_m, here, there, strict=True):
        axes.plot(*np.stack([a, p], 1), color=_WIRE, lw=1.0)
        axes.plot(*np.stack([a, q], 1), color=_MOVED, lw=0.7, ls=":")
    for points, colour, name in ((here, _STILL, "commanded"), (there, _MOVED, "drifted")):
        order = _round_the_centre(points)
        axes.plot(*points[order].T, color=colour, lw=2.0, marker="o", ms=3, label=name)
    axes.scatter(*robot.exit_m.T, color="black", s=12, label="exit points")
    axes.set(xlabel="x, m", ylabel="y, m", zlabel="z, m")
    axes.set_box_aspect(None, zoom=0.85)
    axes.set_aspect("equal")
    axes.set_title(f"{robot.name}: drift after {course.times_s[-1]:g} s, enlarged {exaggeration:g} times", fontsize=10)
    axes.legend(loc="upper left", fontsize=8, frameon=False)
    return figure


def _round_the_centre(points: Floats) -> list[int]:
    angle = np.arctan2(*(points - points.mean(0))[:, 1::-1].T)
    order = np.argsort(angle, kind="stable").tolist()
    return [*order, order[0]]


def _round(value: float) -> float:
    decade = 10.0 ** np.floor(np.log10(max(value, 1.0)))
    return float(max(1.0, decade * max(f for f in (1, 2, 5) if f * decade <= max(value, 1.0))))


def drift_in_time(drifts: list[dict[str, Any]]) -> Figure:
    """Distance and rotation against time with 90 % bands, one colour a specimen spread."""
    figure = Figure(figsize=(7.2, 3.2), layout="constrained")
    panels: Any = figure.subplots(1, 2)
    keys = (("distance_mm", "distance from the pose, mm"), ("rotation_deg", "rotation, degrees"))
    for axes, (key, label) in zip(panels, keys, strict=True):
        for entry, colour in zip(drifts, (_STILL, _MOVED), strict=True):
            _banded(axes, entry, key, colour, f"specimens spread by {100 * entry['specimen_spread']:g} %")
        axes.set(xlabel="time, s", ylabel=label)
        _logarithmic(axes)
    panels[0].legend(frameon=False, fontsize=8)
    return figure


def error_in_time(errors: list[dict[str, Any]]) -> Figure:
    """Pose error of both controllers against time, wires of one line alike."""
    figure = Figure(figsize=(4.6, 3.2), layout="constrained")
    axes: Any = figure.subplots()
    alike = [e for e in errors if e["specimen_spread"] == 0]
    for entry, colour in zip(alike, (_MOVED, _STILL), strict=True):
        _banded(axes, entry, "distance_mm", colour, entry["controller"].replace("_", " "))
    axes.axhline(alike[0]["tolerance_mm"], color="black", lw=0.8, ls="--")
    axes.set(xlabel="time, s", ylabel="pose error, mm")
    _logarithmic(axes)
    axes.legend(frameon=False, fontsize=8)
    return figure


def _logarithmic(axes: Any) -> None:
    axes.set_xscale("symlog", linthresh=10)
    axes.set_xlim(left=0)
    axes.set_ylim(bottom=0)


def _banded(axes: Any, entry: dict[str, Any], key: str, colour: str, label: str) -> None:
    band = entry[key]
    if band["mean"] is None:
        return
    axes.plot(entry["times_s"], band["q50"], color=colour, label=label)
    axes.fill_between(entry["times_s"], band["q05"], band["q95"], color=colour, alpha=0.25, lw=0)


def error_budget(result: dict[str, Any]) -> Figure:
    """Shares of the drift's variance by parameter."""
    figure = Figure(figsize=(4.6, 2.6), layout="constrained")
    axes: Any = figure.subplots()
    names = list(result["shared_draw"])
    axes.barh(names[::-1], [100 * result["shared_draw"][name] for name in names[::-1]], color=_STILL)
    axes.set_xlabel(f"share of the variance of the drift after {result['time_s']:g} s, %")
    return figure


def workspace_map(result: WorkspaceDrift, quantity: str = "distance") -> Figure:
    """Median drift over the workspace, one panel a height.

    Parameters
    ----------
    result : WorkspaceDrift
    quantity : {"distance", "tilt", "probability"}
        Millimetres, degrees, or the probability that the paper's claim holds.
    """
    value, label = {
        "distance": (1e3 * np.median(result.distance_m, 1), "drift, mm"),
        "tilt": (np.degrees(np.median(result.tilt_rad, 1)), "tilt, degrees"),
        "probability": (result.holds(), "probability that the claim holds"),
    }[quantity]
    heights = np.unique(result.position_m[:, 2])
    figure = Figure(figsize=(3.0 * len(heights) + 0.8, 2.9), layout="constrained")
    panels: Any = np.atleast_1d(figure.subplots(1, len(heights), sharex=True, sharey=True))
    dots: Any = None
    for axes, height in zip(panels, heights, strict=True):
        level = result.position_m[:, 2] == height
        x, y = result.position_m[level, :2].T
        dots = axes.scatter(x, y, c=value[level], vmin=value.min(), vmax=value.max(), s=110, marker="s", cmap="viridis")
        axes.set(title=f"z = {height:.3g} m", xlabel="x, m")
        axes.set_aspect("equal")
    panels[0].set_ylabel("y, m")
    figure.colorbar(dots, ax=panels, label=label)
    return figure


def claim_bands(rows: list[dict[str, Any]]) -> Figure:
    """Drift and tilt with 90 % bands for every line and robot, beside the paper's limits.

    Parameters
    ----------
    rows : list of dict
        From `wirebayes.reproduce.section_4.table`.
    """
    robots = list(dict.fromkeys(row["robot"] for row in rows))
    lines = list(dict.fromkeys(row["line"] for row in rows))
    figure = Figure(figsize=(8.4, 0.9 + 0.34 * len(lines) * len(robots)), layout="constrained")
    panels: Any = figure.subplots(1, 2, sharey=True)
    places = {(line, robot): -i for i, (line, robot) in enumerate((a, b) for a in lines for b in robots)}
    quantities = (("drift", "mm", 1e3 * DISTANCE_M), ("tilt", "deg", float(np.degrees(TILT_RAD))))
    for axes, (name, unit, limit) in zip(panels, quantities, strict=True):
        for row in rows:
            old = row["loaded_before_s"] > 0
            y = places[row["line"], row["robot"]] - (0.15 if old else -0.15)
            low, mid, high = (row[f"{name}_q{q}_{unit}"] for q in ("05", "50", "95"))
            colour = _STILL if old else _MOVED
            axes.plot([low, high], [y, y], color=colour, lw=2)
            label = ("an hour under load" if old else "new wires") if row is rows[0] or row is rows[1] else None
            axes.plot(mid, y, "o", color=colour, ms=4, label=label)
        axes.axvline(limit, color="black", lw=0.8, ls="--")
        axes.set_xscale("log")
        axes.set_xlabel(f"{name} after 60 s, {'degrees' if unit == 'deg' else unit}")
    panels[0].set_yticks(list(places.values()), [f"{line}, {robot}" for line, robot in places], fontsize=8)
    panels[0].legend(frameon=False, fontsize=8)
    return figure
