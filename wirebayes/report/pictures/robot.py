"""Pictures of a robot's pose: in 3-D with its drift exaggerated, errors against time, error budget."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from matplotlib.figure import Figure
from scipy.spatial import ConvexHull, QhullError

from wirebayes.io.run_folder import write_json
from wirebayes.json_files.pose import ControllerError, Drift, VarianceShares
from wirebayes.json_files.scene import SceneJson
from wirebayes.json_files.values import Band, Numbers
from wirebayes.numeric.evenly import evenly
from wirebayes.numeric.typing import Floats
from wirebayes.report.drawn import save_figure
from wirebayes.report.figures import CHAIN, HOLD, INK, QUIET, legend_below, panel, tell_times, verbatim
from wirebayes.report.pictures.robot_space import orientation, workspace_maps
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.pulleys import traced
from wirebayes.robot.motion.course import Course
from wirebayes.robot.pose.answer import PoseAnswer
from wirebayes.robot.pose.maps import Map
from wirebayes.robot.pose.request import PoseRequest
from wirebayes.sentences import lasting

CONTROLLERS = {
    "hooke_only": "ignores creep",
    "creep_aware": "compensates for creep",
    "creep_aware_other_fit": "compensates for creep by the other fit",
    "held_still": "does not move",
}
_COLOURS = (HOLD, CHAIN, "#5d8c4a")
Distance = Literal["distance_mm", "rotation_deg"]  # bands of a drift that are drawn over time


def save_pose(folder: Path, robot: Robot, request: PoseRequest, found: PoseAnswer) -> None:
    """Write the pictures that go with ``pose.json``; none when the pose cannot be held.

    Parameters
    ----------
    request : PoseRequest
        The pose, its load and the times.
    found : Answer
        What was computed for it.
    """
    course = found.courses.get(0.0)
    if course is None or not course.found.any():
        return
    content = found.content
    drift = content["drift"]
    shares = content["variance_shares"]
    pictures = {}
    pictures["robot"] = scene(robot, request.position_m, request.rotation, course)
    pictures["drift"] = in_time(drift, "distance_mm", "distance from the pose, mm", "Drift")
    if robot.degrees == 6:
        title = "Drift of the orientation"
        pictures["rotation"] = in_time(drift, "rotation_deg", "rotation, degrees", title)
    pictures["pose-error"] = error_in_time(content["pose_error"])
    if "shared_draw" in shares:
        pictures["error-budget"] = error_budget(shares)
    pictures |= _maps(found.maps)
    for name, figure in pictures.items():
        save_figure(figure, folder / f"{name}.svg")
    points = scene_points(robot, request.position_m, request.rotation, course)
    write_json(folder / "scene.json", points)


def _maps(maps: Sequence[Map]) -> dict[str, Figure]:
    """The maps of the workspace, by the names of their files."""
    figures = {}
    with_places = [one for one in maps if len(one.drift.position_m)]
    for i, one in enumerate(with_places):
        key = f"workspace-{i + 1}" if i else "workspace"
        for name, figure in workspace_maps(one.drift, orientation(one)).items():
            figures[f"{key}-{name}"] = figure
    return figures


def scene(robot: Robot, position_m: Floats, rotation: Floats, course: Course) -> Figure:
    """The robot in 3-D, at rest and drifted; the drift enlarged by a factor that the title states.

    Parameters
    ----------
    position_m, rotation : (3,), (3, 3) arrays
    course : Course
        Its mean over the draws at the last time is drawn.
    """
    view = scene_points(robot, position_m, rotation, course)
    enlarged = view["exaggeration"]
    here = np.asarray(view["platform"])
    drifts = len(view["drifted"]) > 0
    there = here + enlarged * (view["drifted"][-1] - here) if drifts else here
    figure = Figure(figsize=(6.0, 5.2))
    axes: Any = figure.add_axes((0.0, 0.06, 0.92, 0.86), projection="3d")
    for i in range(robot.legs):
        _draw_wire(axes, robot, i, here[i], color=QUIET, lw=1.0)
        _draw_wire(axes, robot, i, there[i], color=HOLD, lw=0.7, ls=":")
    _draw_platform(axes, robot, here, CHAIN, "commanded")
    if drifts:
        _draw_platform(axes, robot, there, HOLD, "drifted")
    exits = robot.exit_m
    axes.scatter(*exits.T, color=INK, s=14, label="exit points")
    every_point = np.concatenate([exits, here, there])
    size_m = np.ptp(exits, axis=0).max()
    _label_axes(axes, every_point, position_m, size_m)
    head = f"{verbatim(robot.name)}: no drift"
    if drifts:
        head = f"{verbatim(robot.name)}: mean drift after {course.times_s[-1]:g} s, enlarged {enlarged:g} times"
    figure.text(0.02, 0.95, head, fontsize=10.5, color=INK)
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncols=3, frameon=False, fontsize=8.5)
    return figure


def _draw_wire(axes: Any, robot: Robot, i: int, end: Floats, **style: Any) -> None:
    """Draw a wire from its exit point, around its pulley, to its platform point."""
    begin = robot.exit_m[i]
    points = begin + traced(robot.pulleys, i, end - begin)
    axes.plot(*points.T, **style)


def _draw_platform(axes: Any, robot: Robot, points: Floats, colour: str, name: str) -> None:
    for i, j in platform_edges(robot.platform_m):
        axes.plot(*points[[i, j]].T, color=colour, lw=1.6)
    axes.plot(*points.T, color=colour, lw=0, marker="o", ms=3.5, label=name)


def _label_axes(axes: Any, points: Floats, position_m: Floats, size_m: float) -> None:
    """Labels and ticks in metres; along an axis in which the robot is flat one tick is all there is room for."""
    axes.set_xlabel("x, m", labelpad=6)
    axes.set_ylabel("y, m", labelpad=6)
    axes.set_zlabel("z, m", labelpad=5)
    axes.tick_params(labelsize=8)
    axes.locator_params(nbins=5)
    for axis in np.flatnonzero(np.ptp(points, axis=0) < 1e-6 * size_m):
        getattr(axes, f"set_{'xyz'[axis]}ticks")([float(position_m[axis])])
    axes.set_aspect("equal")
    axes.set_box_aspect(axes._box_aspect, zoom=0.94)


def scene_points(robot: Robot, position_m: Floats, rotation: Floats, course: Course) -> SceneJson:
    """What a view of the robot draws: exit points, platform points and edges, and the mean drift at each time.

    Parameters
    ----------
    position_m, rotation : (3,), (3, 3) arrays
    course : Course
        Its mean over the draws is taken.

    Returns
    -------
    SceneJson
        At nine times or fewer.
    """
    found = course.found
    position = course.position_m[found].mean(0)
    turned = course.rotation[found].mean(0)
    points = still_points(robot, position_m, rotation)
    if not np.any(course.position_m[found] - position_m) and not np.any(course.rotation[found] - rotation):
        points["tensions_N"] = np.median(course.tension_N[found][:, :1], axis=0)
        return points
    shown = evenly(len(position), _MOST_TIMES)
    last_drift = position[-1] - position_m
    platform = np.einsum("tij,wj->twi", turned[shown], robot.platform_m)
    tensions = course.tension_N[found][:, shown]
    points["drifted"] = position[shown, None] + platform
    points["times"] = [lasting(time) for time in course.times_s[shown]]
    points["tensions_N"] = np.median(tensions, axis=0)
    points["exaggeration"] = _exaggeration(robot, last_drift)
    return points


def _exaggeration(robot: Robot, drift_m: Floats) -> float:
    """A round factor that makes a drift a twentieth of the robot."""
    size = np.ptp(robot.exit_m, axis=0).max()
    distance = max(float(np.linalg.norm(drift_m)), 1e-12)
    return round_factor(0.05 * size / distance)


def still_points(robot: Robot, position_m: Floats, rotation: Floats) -> SceneJson:
    """What `scene_points` returns, for a robot that stays where it is.

    Parameters
    ----------
    position_m, rotation : (3,), (3, 3) arrays
    """
    here = position_m + robot.platform_m @ rotation.T
    wires = []
    for i, (begin, end) in enumerate(zip(robot.exit_m, here, strict=True)):
        wires.append(begin + traced(robot.pulleys, i, end - begin))
    return {
        "name": robot.name,
        "exits": robot.exit_m,
        "platform": here,
        "wires": wires,
        "edges": list(platform_edges(robot.platform_m)),
        "drifted": [],
        "times": [],
        "tensions_N": [],
        "exaggeration": 1.0,
    }


def platform_edges(points: Floats) -> Iterator[tuple[int, int]]:
    """Pairs of platform points that an edge joins: the hull's edges, without those inside a flat face."""
    spread = points - points.mean(0)
    extent = max(np.abs(spread).max(), 1e-12)
    _, singular, axes = np.linalg.svd(spread)
    is_flat = (singular > 1e-3 * extent).sum() < 3
    try:
        hull = ConvexHull(spread @ axes[:2].T if is_flat else points)
    except (QhullError, ValueError):  # all points in one place or on a line
        return
    if is_flat:
        yield from ((int(i), int(j)) for i, j in hull.simplices)
    else:
        yield from _sharp_edges(hull)


def _sharp_edges(hull: ConvexHull) -> Iterator[tuple[int, int]]:
    """The edges of a body at which its faces meet at an angle."""
    normals: dict[tuple[int, int], list[Floats]] = {}
    for simplex, equation in zip(hull.simplices, hull.equations, strict=True):
        for k in range(3):
            i, j = sorted((int(simplex[k]), int(simplex[k - 1])))
            normals.setdefault((i, j), []).append(equation[:3])
    for edge, (one, other) in normals.items():
        if one @ other < 0.99:
            yield edge


_MOST_TIMES = 9  # of a view: stops of its slider


def round_factor(value: float) -> float:
    """A round number, 1, 2 or 5 times a power of ten, not above the value (and not below 1)."""
    value = max(value, 1.0)
    decade = 10.0 ** np.floor(np.log10(value))
    factor = max(digit for digit in (1, 2, 5) if digit * decade <= value)
    return float(max(1.0, decade * factor))


def in_time(drifts: Sequence[Drift], key: Distance, label: str, title: str) -> Figure:
    """One quantity against time with 90 % bands, one colour a specimen spread.

    Parameters
    ----------
    drifts : sequence of dict
        One a specimen spread, at most two: ``times_s`` and the bands.
    key : str
        Which band is drawn.
    label : str
        Of the vertical axis.
    """
    figure, axes = panel("time", label, title)
    for entry, colour in zip(drifts, (CHAIN, HOLD), strict=True):
        spread = entry["specimen_spread"]
        name = f"specimens differ by {100 * spread:g} %" if spread else "identical specimens"
        _banded(axes, entry["times_s"], entry[key], colour, name)
    _since(axes, drifts[0]["times_s"])
    told_if_nothing(axes, [entry[key] for entry in drifts])
    legend_below(figure, axes)
    return figure


def told_if_nothing(axes: Any, bands: Sequence[Band]) -> None:
    """Draw bands that are zero throughout as such, on an axis to 1, and say it.

    Parameters
    ----------
    axes : Axes
        On which they are drawn, from zero on.
    bands : sequence of dict
    """
    drawn = [band["q95"] for band in bands if band["q95"] is not None]
    if drawn and not np.any(np.nan_to_num(np.array(drawn, float))):
        axes.set_ylim(-0.02, 1)  # the line shows above the axis
        axes.text(0.5, 0.5, "zero at all times", ha="center", transform=axes.transAxes, color=INK)


def error_in_time(errors: Sequence[ControllerError]) -> Figure:
    """Pose error of the controllers against time, specimens alike; the tolerance dashed."""
    figure, axes = panel("time", "pose error, mm", "Pose error by controller")
    alike = [error for error in errors if error["specimen_spread"] == 0]
    for entry, colour in zip(alike, _COLOURS, strict=False):
        label = CONTROLLERS[entry["controller"]]
        _banded(axes, entry["times_s"], entry["distance_mm"], colour, label)
    axes.axhline(alike[0]["tolerance_mm"], color=INK, lw=0.9, ls="--", label="tolerance")
    _since(axes, alike[0]["times_s"])
    legend_below(figure, axes)
    return figure


def _since(axes: Any, times_s: Numbers) -> None:
    axes.set_xscale("symlog", linthresh=10)
    axes.set_xlim(left=0)
    axes.set_ylim(bottom=0)
    tell_times(axes, float(np.max(times_s)))


def _banded(axes: Any, times_s: Numbers, band: Band, colour: str, label: str) -> None:
    if band["mean"] is None:
        return
    axes.plot(times_s, band["q50"], color=colour, label=label)
    axes.fill_between(times_s, band["q05"], band["q95"], color=colour, alpha=0.22, lw=0)


def error_budget(result: VarianceShares) -> Figure:
    """Shares of the drift's variance by parameter."""
    shares = result["shared_draw"]
    label = f"share of the variance of the drift\nafter {lasting(result['time_s'])}, %"
    size = (4.7, 2.0 + 0.2 * len(shares))
    figure, axes = panel(label, "", "Sources of uncertainty", size)
    names = list(shares)[::-1]
    bars = axes.barh(names, [100 * shares[name] for name in names], color=CHAIN)
    axes.bar_label(bars, fmt="%.0f", padding=3, fontsize=8.5)
    axes.margins(x=0.12)
    axes.tick_params(axis="y", length=0)
    return figure
