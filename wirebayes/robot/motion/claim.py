"""The paper's section 4 over a workspace: how far a vertical platform moves and tilts within a minute."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wirebayes.json_files.pose import ClaimNumbers
from wirebayes.numeric.rows import chosen_rows
from wirebayes.numeric.typing import Bools, Floats
from wirebayes.robot.mechanics import rotation as turning
from wirebayes.robot.mechanics.description import Poses, Robot
from wirebayes.robot.mechanics.draws import WireDraws, for_robot
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion import drift, hanging, inverse
from wirebayes.robot.motion.course import Course
from wirebayes.robot.motion.creep import CreepState, HoldCreep, fresh

TIME_S, DISTANCE_M, TILT_RAD = 60.0, 0.3e-3, float(np.radians(0.055))  # section 4 of the paper
_SPREAD = 0.05  # from specimen to specimen, where it is asked for the largest mass


@dataclass(frozen=True)
class WorkspaceDrift:
    """Drift at one time, everywhere in a workspace.

    Attributes
    ----------
    position_m : (p, 3) array
        Requested positions; those that no tensions hold are left out.
    distance_m, tilt_rad : (p, n) arrays
        Displacement of the reference point; angle between the normal and the requested one.
    tension_N : (p, w) array
        When the hold begins.
    feasible : float
        Share of the grid's points that tensions within the bounds hold.
    found : float
        Share of the forward problems that were solved.
    """

    position_m: Floats
    distance_m: Floats
    tilt_rad: Floats
    tension_N: Floats
    feasible: float
    found: float

    @property
    def median_distance_m(self) -> Floats:
        """(p,) median over the draws that hold the platform; NaN where none does."""
        return _median(self.distance_m)

    @property
    def median_tilt_rad(self) -> Floats:
        """(p,) median over the draws that hold the platform; NaN where none does."""
        return _median(self.tilt_rad)

    def holds(self, distance_m: float = DISTANCE_M, tilt_rad: float = TILT_RAD) -> Floats:
        """(p,) probability, at every point, that both limits are kept."""
        return ((self.distance_m < distance_m) & (self.tilt_rad < tilt_rad)).mean(1)

    def part(self, rows: Bools, feasible: float) -> "WorkspaceDrift":
        """Some of the positions ``(p,)``, and the share of the requested ones that tensions hold."""
        found = float(np.isfinite(self.distance_m[rows]).all(1).mean()) if rows.any() else 0.0
        return WorkspaceDrift(
            self.position_m[rows], self.distance_m[rows], self.tilt_rad[rows], self.tension_N[rows], feasible, found
        )


def _median(values: Floats) -> Floats:
    held = [row[np.isfinite(row)] for row in values]
    return np.array([np.median(row) if row.size else np.nan for row in held])


def grid(robot: Robot, points: tuple[int, int, int]) -> Floats:
    """Regular grid over the robot's workspace box, (p, 3) m; one layer where the box is flat."""
    axes = []
    for low, high, count in zip(robot.lower_m, robot.upper_m, points, strict=True):
        if count > 1 and high > low:
            axes.append(np.linspace(low, high, count))
        else:
            axes.append(np.array([0.5 * (low + high)]))
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)


def over_workspace(
    robot: Robot,
    wires: Wires,
    position_m: Floats,
    time_s: float = TIME_S,
    loaded_s: float = 0.0,
    rotation: Floats | None = None,
) -> WorkspaceDrift:
    """Drift of a platform after a time, at every position and draw in one batch.

    Parameters
    ----------
    robot : Robot
    wires : Wires
        ``n`` draws.
    position_m : (p, 3) array
    time_s : float
    loaded_s : float
        How long the wires carried the same tensions before they were commanded, exactly, to the pose; 0: new wires.
    rotation : (3, 3) array, optional
        Orientation of the platform; default: level. Where balance decides it, the one in balance.

    Returns
    -------
    WorkspaceDrift
    """
    level = np.eye(3) if rotation is None else rotation
    turn = hanging.orientations(robot, position_m, level)
    tau = inverse.tensions(robot, position_m, turn)
    good = np.isfinite(tau).all(1)
    x, tau, turn = position_m[good], tau[good], turn[good]
    if not good.any():
        empty = np.empty((0, 1))
        return WorkspaceDrift(x, empty, empty, tau, 0.0, 0.0)
    distance, tilt, found = _drifts(robot, wires, (x, turn), tau, time_s, loaded_s)
    return WorkspaceDrift(x, distance, tilt, tau, float(good.mean()), found)


def _drifts(
    robot: Robot, wires: Wires, poses: Poses, tension_N: Floats, time_s: float, loaded_s: float
) -> tuple[Floats, Floats, float]:
    """Distances and tilts (p, n) after a time, and the share of positions and draws that still have a pose."""
    n = wires.count
    p = len(tension_N)
    many = _at_each(wires, n, p)
    where = np.repeat(poses[0], n, 0)
    turn = np.repeat(poses[1], n, 0)
    pull = np.repeat(tension_N, n, 0)
    state = _loaded(many, pull, loaded_s)
    commands = inverse.commands(robot, many, where, turn, pull, state.strain(many))
    held = drift.stably(robot, many, commands, where, commands.rotation)
    joint = chosen_rows(held, commands.joint_m, np.nan)
    course = drift.hold(robot, many, joint, np.array([time_s]), where, commands.rotation, state)
    distance, tilt = _moved(course, where, commands.rotation)
    return distance.reshape(p, n), tilt.reshape(p, n), float(course.found.mean())


def _loaded(wires: Wires, tension_N: Floats, time_s: float) -> CreepState:
    """What wires carry that bore tensions ``(n, w)`` for a time; 0: they are new."""
    state = fresh(tension_N.shape[1], len(tension_N))
    if time_s > 0:
        return HoldCreep(wires, state, tension_N.T).advance(time_s, tension_N.T)
    return state


def _moved(course: Course, position_m: Floats, rotation: Floats) -> tuple[Floats, Floats]:
    """Distances, m, and tilts, rad, of the first poses of a course from others, (n,) each."""
    distance = np.linalg.norm(course.position_m[:, 0] - position_m, axis=1)
    return distance, turning.tilt(course.rotation[:, 0], rotation)


def _at_each(wires: Wires, draws: int, positions: int) -> Wires:
    """A row for every position and draw, of which draws vary fastest."""
    theta = {}
    for name, value in wires.theta.items():
        each = np.broadcast_to(value, (len(value), draws))
        theta[name] = np.tile(each, positions)
    return replace(wires, theta=theta)


def scaled_robot(robot: Robot, factor: float, mass_kg: float) -> Robot:
    """The same robot at another size and mass; tension bounds follow the mass.

    Parameters
    ----------
    robot : Robot
    factor : float
        By which every length is multiplied.
    mass_kg : float
        The new mass, not a factor.

    Returns
    -------
    Robot
    """
    lengths = ("exit_m", "platform_m", "centre_of_mass_m", "beyond_m", "wire_m", "home_m", "lower_m", "upper_m")
    sizes = ("radius_m", "pitch_m", "layer_m", "wire_m")
    rule, pulleys, drums = robot.rule, robot.pulleys, robot.drums
    lowest_N = rule.lowest_N * mass_kg / robot.mass_kg
    highest_N = rule.highest_N * mass_kg / robot.mass_kg
    rule = replace(rule, lowest_N=lowest_N, highest_N=highest_N)
    if pulleys is not None:
        pulleys = replace(pulleys, **_multiplied(pulleys, ("radius_m",), factor))
    if drums is not None:
        drums = replace(drums, **_multiplied(drums, sizes, factor))
    grown = _multiplied(robot, lengths, factor)
    return replace(robot, mass_kg=mass_kg, rule=rule, pulleys=pulleys, drums=drums, **grown)


def _multiplied(of: object, names: Sequence[str], factor: float) -> dict[str, Any]:
    """Some attributes, each times a factor."""
    return {name: getattr(of, name) * factor for name in names}


def claim_summary(out: WorkspaceDrift) -> ClaimNumbers:
    """The claim in numbers: quantiles over workspace and draws, and how probable it is, somewhere and everywhere."""
    inside = (out.distance_m < DISTANCE_M) & (out.tilt_rad < TILT_RAD)
    distance, tilt = _quantiles(1e3 * out.distance_m), _quantiles(np.degrees(out.tilt_rad))
    return {
        "q05_drift_mm": distance[0],
        "q50_drift_mm": distance[1],
        "q95_drift_mm": distance[2],
        "q05_tilt_deg": tilt[0],
        "q50_tilt_deg": tilt[1],
        "q95_tilt_deg": tilt[2],
        "probability": float(inside.mean()),
        "probability_everywhere": float(inside.all(0).mean()),
        "lowest_tension_N": float(out.tension_N.min()),
        "highest_tension_N": float(out.tension_N.max()),
        "feasible": out.feasible,
        "solved": out.found,
    }


def _quantiles(values: Floats) -> list[float]:
    held = values[np.isfinite(values)]
    return [float(q) for q in np.quantile(held, [0.05, 0.5, 0.95])] if held.size else [np.nan] * 3


def largest_mass(robot: Robot, line: WireDraws, size: float, steps: int) -> float:
    """Largest platform mass, kg, for which the claim holds with 95 % at nineteen poses of twenty, by bisection.

    Parameters
    ----------
    robot : Robot
    line : WireDraws
    size : float
        Factor on every length of the robot.
    steps : int
        Halvings of the range from 1 g to 20 kg on a logarithmic scale.
    """
    low, high = 1e-3, 20.0
    for _ in range(steps):
        mass = float(np.sqrt(low * high))
        other = scaled_robot(robot, size, mass)
        wires = for_robot(other, line, _SPREAD, np.random.default_rng(1))
        out = over_workspace(other, wires, grid(other, (3, 3, 2)))
        good = np.mean(out.holds() >= 0.95) >= 0.95
        low, high = (mass, high) if good else (low, mass)
    return low
