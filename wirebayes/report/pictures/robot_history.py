"""Pictures of a robot's history: drift and corrections over time, a strip of poses, and the same moving."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from wirebayes.io.run_folder import write_bytes, write_text
from wirebayes.json_files.pose_history import Corrections, DriftOverTime
from wirebayes.json_files.values import INTERVAL, Band
from wirebayes.numeric.evenly import evenly
from wirebayes.numeric.typing import Floats, Indices
from wirebayes.report.drawn import svg
from wirebayes.report.figures import CHAIN, HOLD, INK, QUIET, legend_below, panel
from wirebayes.report.pictures.robot import Distance, platform_edges, round_factor, told_if_nothing
from wirebayes.robot.history.answer import HistoryAnswer
from wirebayes.robot.history.follow import Track
from wirebayes.robot.history.history import History
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.motion.drift import ROUNDING
from wirebayes.sentences import lasting, unit_of_time

_COLOURS = (CHAIN, HOLD, "#5d8c4a", "#c59a2e", "#7b5ea7", "#4a9aa8", "#8a6d5c", "#b0708e", "#6b7780")
_PANELS, _FRAMES, _SECONDS = 5, 60, 12
_OBLIQUE = np.array([[1.0, 0.45, 0.0], [0.0, 0.3, 1.0]])  # depth runs up to the right


def save_history_pictures(folder: Path, robot: Robot, history: History, found: HistoryAnswer) -> None:
    """Write the pictures that go with ``pose.json``; none when the platform cannot be held.

    Parameters
    ----------
    history : History
        The rows that were read.
    found : HistoryAnswer
        What was computed for them.
    """
    if found.found is None or found.to is None:
        return
    content = found.content
    (drift,) = content["drift"]
    figures = {
        "drift": banded(drift, "distance_mm", "distance from the pose, mm", "Drift", history),
        "corrections": corrected(content["corrections"], history),
        "poses": strip(robot, history, found),
    }
    if robot.degrees == 6:
        figures["rotation"] = banded(drift, "rotation_deg", "rotation, degrees", "Drift of the orientation", history)
    for name, figure in figures.items():
        write_bytes(folder / f"{name}.svg", svg(figure))
    write_text(folder / "motion.svg", moving(robot, history, found))


def banded(drift: DriftOverTime, key: Distance, label: str, title: str, history: History) -> Figure:
    """One quantity over time with its 90 % band; what the platform carries below it, where that changes.

    Parameters
    ----------
    drift : dict
        ``times_s`` and the bands, as in ``pose.json``.
    key : str
        Which band is drawn.
    label : str
        Of the vertical axis.
    history : History
        For what the platform carries.
    """
    unit, size = unit_of_time(history.times_s[-1])
    figure, axes = panel(f"time, {unit}", label, title)
    _band(axes, np.divide(drift["times_s"], size), _ends_of(drift[key]), CHAIN, "median and 90 % of the draws")
    axes.set_ylim(bottom=0)
    told_if_nothing(axes, [drift[key]])
    _in_time(figure, axes, history)
    return figure


def corrected(corrections: Corrections, history: History) -> Figure:
    """The change of every joint value that brings the platform back, over time."""
    unit, size = unit_of_time(history.times_s[-1])
    figure, axes = panel(f"time, {unit}", "change of the joint value, mm", "Corrections")
    change = corrections["change_mm"]
    if change["q50"] is not None:
        bands = np.moveaxis(_ends_of(change), -1, 0)
        for i, ends in enumerate(bands):
            colour = _COLOURS[i % len(_COLOURS)]
            _band(axes, np.divide(corrections["times_s"], size), ends, colour, f"joint {i + 1}", 0.14)
    axes.axhline(0, color=QUIET, lw=0.8, zorder=0)
    _in_time(figure, axes, history, 4)
    return figure


def _ends_of(band: Band) -> Floats:
    """Lower end, median and upper end of a band, along the first axis."""
    return np.array([band[quantile] for quantile in INTERVAL])


def _band(axes: Any, times: Floats, ends: Floats, colour: str, label: str, alpha: float = 0.22) -> None:
    """The (3, t) ends of a band and the median between them."""
    low, middle, high = ends
    axes.plot(times, middle, color=colour, label=label)
    axes.fill_between(times, low, high, color=colour, alpha=alpha, lw=0)


def _in_time(figure: Figure, axes: Any, history: History, columns: int = 2) -> None:
    _, size = unit_of_time(history.times_s[-1])
    times = history.times_s / size
    axes.set_xlim(times[0], times[-1])
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    if np.ptp(history.payload_kg) > 0:
        _draw_payload(axes, times, history.payload_kg)
    legend_below(figure, axes, columns)


def _draw_payload(axes: Any, times: Floats, payload_kg: Floats) -> None:
    load = axes.twinx()
    load.step(times, payload_kg, where="post", color=INK, lw=0.8, ls="--", alpha=0.6)
    load.set_ylim(0, 2.5 * payload_kg.max())
    load.set_ylabel("payload, kg", fontsize=9)
    load.tick_params(labelsize=8)
    load.spines["top"].set_visible(False)
    axes.plot([], [], color=INK, lw=0.8, ls="--", label="payload")


def _shapes(robot: Robot, found: HistoryAnswer, rows: Indices) -> tuple[Floats, Floats, float]:
    """Platform points meant and drifted, ``(r, w, 3)``, the drift enlarged by a round factor."""
    followed = found.found
    to = found.to
    assert followed is not None and to is not None
    meant_position = to.position_m[rows]
    meant_rotation = to.rotation[rows]
    position, rotation = _mean_pose(followed.track, rows)
    shift = position - meant_position
    turn = rotation - meant_rotation
    factor = _enlarged(robot, shift)
    moved_position = meant_position + factor * shift
    moved_rotation = meant_rotation + factor * turn
    meant = _platform_points(robot, meant_position, meant_rotation)
    moved = _platform_points(robot, moved_position, moved_rotation)
    return meant, moved, factor


def _enlarged(robot: Robot, shift_m: Floats) -> float:
    """A round factor that makes the largest shift (r, 3) a small part of the robot."""
    size = float(np.ptp(robot.exit_m, axis=0).max())
    distances = np.linalg.norm(shift_m, axis=1)
    largest = float(np.nanmax(distances, initial=0.0))
    if largest < ROUNDING * size:
        return 1.0
    return round_factor(0.07 * size / largest)


def _mean_pose(track: Track, rows: Indices) -> tuple[Floats, Floats]:
    """Mean positions ``(r, 3)`` and rotations ``(r, 3, 3)`` of draws that hold the platform; NaN where none does."""
    held = track.held[:, rows]
    count = np.maximum(held.sum(0), 1)[:, None]
    positions = np.where(held[..., None], track.position_m[:, rows], 0.0)
    rotations = np.where(held[..., None, None], track.rotation[:, rows], 0.0)
    position = positions.sum(0) / count
    rotation = rotations.sum(0) / count[..., None]
    gone = ~held.any(0)
    position[gone] = np.nan
    rotation[gone] = np.nan
    return position, rotation


def _platform_points(robot: Robot, position_m: Floats, rotation: Floats) -> Floats:
    """Where the wires meet the platform, ``(r, w, 3)``."""
    return position_m[:, None] + robot.platform_m @ np.swapaxes(rotation, 1, 2)


def strip(robot: Robot, history: History, found: HistoryAnswer) -> Figure:
    """The robot at a few times side by side: where it is meant to be, and where creep has taken it, enlarged.

    Parameters
    ----------
    robot : Robot
    history : History
    found : HistoryAnswer
    """
    rows = evenly(len(history.times_s), _PANELS)
    meant, moved, factor = _shapes(robot, found, rows)
    count = len(rows)
    width = 2.1 * count
    figure = Figure(figsize=(width, 2.75), layout="constrained")
    head = f"{robot.name}: mean drift enlarged {factor:g} times"
    figure.suptitle(head, fontsize=10.5, color=INK, x=0.01, ha="left")
    panels = np.atleast_1d(figure.subplots(1, count))
    carries = history.payload_kg.max() > 0
    for i, (axes, row) in enumerate(zip(panels, rows, strict=True)):
        here = meant[i] @ _OBLIQUE.T
        there = moved[i] @ _OBLIQUE.T
        _draw_robot(axes, robot, here, there)
        title = lasting(history.times_s[row])
        if carries:
            title += f", {history.payload_kg[row]:g} kg"
        axes.set_title(title, fontsize=9, color=INK)
    return figure


def _draw_robot(axes: Any, robot: Robot, meant: Floats, moved: Floats) -> None:
    """The robot as it is meant to be, and as creep has moved it."""
    exits = robot.exit_m @ _OBLIQUE.T
    _draw_wires(axes, exits, meant, color=QUIET, lw=0.8)
    _draw_wires(axes, exits, moved, color=HOLD, lw=0.6, ls=":")
    _draw_platform(axes, robot, meant, CHAIN)
    _draw_platform(axes, robot, moved, HOLD)
    axes.scatter(*exits.T, color=INK, s=7)
    axes.set_aspect("equal")
    axes.set_axis_off()


def _draw_wires(axes: Axes, exits: Floats, points: Floats, **style: Any) -> None:
    for exit_point, point in zip(exits, points, strict=True):
        axes.plot(*np.stack([exit_point, point], 1), **style)


def _draw_platform(axes: Axes, robot: Robot, points: Floats, colour: str) -> None:
    for i, j in platform_edges(robot.platform_m):
        axes.plot(*points[[i, j]].T, color=colour, lw=1.4)
    axes.plot(*points.T, color=colour, lw=0, marker="o", ms=2.5)


def moving(robot: Robot, history: History, found: HistoryAnswer) -> str:
    """The same as one moving picture (SVG): the whole history in twelve seconds.

    Parameters
    ----------
    robot : Robot
    history : History
    found : HistoryAnswer

    Returns
    -------
    str
        An SVG document that plays by itself.
    """
    rows = _frame_rows(history.times_s)
    meant, moved, factor = _shapes(robot, found, rows)
    commanded = meant @ _OBLIQUE.T
    drifted = moved @ _OBLIQUE.T
    drifted = np.where(np.isfinite(drifted), drifted, commanded)
    exits = robot.exit_m @ _OBLIQUE.T
    everything = [exits, commanded.reshape(-1, 2), drifted.reshape(-1, 2)]
    canvas = _Canvas.around(np.concatenate(everything))
    fixed = canvas.at(exits)
    solid = f'stroke="{QUIET}" stroke-width="0.9"'
    dashed = f'stroke="{HOLD}" stroke-width="0.9" stroke-dasharray="2 3"'
    parts = canvas.head(f"drift enlarged {factor:g} times; {lasting(history.times_s[-1])} in {_SECONDS} s")
    parts += _moving_platform(robot, fixed, canvas.at(commanded), CHAIN, solid)
    parts += _moving_platform(robot, fixed, canvas.at(drifted), HOLD, dashed)
    for x, y in fixed:
        parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{INK}"/>')
    parts.append(canvas.progress())
    parts.append("</svg>")
    return "\n".join(parts) + "\n"


def _frame_rows(times_s: Floats) -> Indices:
    """The row of a history that each frame of the moving picture shows."""
    frames = np.linspace(times_s[0], times_s[-1], _FRAMES)
    return np.clip(np.searchsorted(times_s, frames), 0, len(times_s) - 1)


@dataclass(frozen=True)
class _Canvas:
    """Where points in metres lie on a moving picture."""

    low: Floats
    scale: float
    width: float
    height: float

    @classmethod
    def around(cls, points: Floats) -> "_Canvas":
        """Room for points (n, 2)."""
        low = points.min(0)
        extent = points.max(0) - low
        scale = 420.0 / max(float(extent.max()), 1e-9)
        width, height = extent * scale + 40
        return cls(low, scale, width, height)

    def at(self, points: Floats) -> Floats:
        """Points (..., 2) on the picture, whose second axis points down."""
        flat = (points - self.low) * self.scale + 20
        return np.stack([flat[..., 0], self.height - flat[..., 1]], -1)

    def head(self, title: str) -> list[str]:
        """What the picture begins with."""
        return [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {self.width:.0f} {self.height + 34:.0f}" '
            f'font-family="sans-serif" font-size="12" role="img">',
            f'<rect width="100%" height="100%" fill="white"/><text x="10" y="16" fill="{INK}">{title}</text>',
        ]

    def progress(self) -> str:
        """A bar that fills while the picture plays."""
        place = f'<rect x="10" y="{self.height + 18:.0f}" height="4"'
        whole = f"{self.width - 20:.0f}"
        return (
            f'{place} width="{whole}" fill="{QUIET}"/>'
            f'{place} width="0" fill="{CHAIN}"><animate attributeName="width" '
            f'values="0;{whole}" dur="{_SECONDS}s" repeatCount="indefinite"/></rect>'
        )


def _moving_platform(robot: Robot, exits: Floats, points: Floats, colour: str, wire: str) -> list[str]:
    """Wires from the exit points (w, 2) to the platform points of each frame (f, w, 2), and the platform's edges."""
    edge = f'stroke="{colour}" stroke-width="2"'
    parts = []
    for i in range(robot.legs):
        frames = [np.stack([exits[i], frame[i]]) for frame in points]
        parts.append(_moving_line(frames, wire))
    edges = list(platform_edges(robot.platform_m))
    for i, j in edges:
        frames = [frame[[i, j]] for frame in points]
        parts.append(_moving_line(frames, edge))
    if not edges:  # a point: a short stroke
        stroke = np.array([[-4.0, 0.0], [4.0, 0.0]])
        frames = [frame[0] + stroke for frame in points]
        thick = f'stroke="{colour}" stroke-width="8"'
        parts.append(_moving_line(frames, thick))
    return parts


def _moving_line(frames: list[Floats], style: str) -> str:
    values = [" ".join(f"{x:.1f},{y:.1f}" for x, y in points) for points in frames]
    return (
        f'<polyline points="{values[0]}" fill="none" {style}><animate attributeName="points" '
        f'values="{";".join(values)}" dur="{_SECONDS}s" repeatCount="indefinite"/></polyline>'
    )
