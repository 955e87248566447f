"""Section 4 of the paper, the robot: the one place where the reproduced fits and the robot meet.

The paper gives no coordinates of its robot, so its claim is evaluated for two representative ones, over their
workspace.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from wirebayes.inference.fit import seed_of
from wirebayes.io.run_folder import write_json
from wirebayes.numeric.evenly import evenly
from wirebayes.numeric.typing import Floats
from wirebayes.paper.figures import drifts
from wirebayes.paper.pictures import Gallery
from wirebayes.report.blocks import number
from wirebayes.report.pictures.robot import scene_points
from wirebayes.report.pictures.robot_lines import budgets, drifts_in_time
from wirebayes.report.pictures.robot_space import workspace_maps
from wirebayes.results.read_back import Stored
from wirebayes.robot.mechanics import draws, schema
from wirebayes.robot.mechanics.draws import WireDraws
from wirebayes.robot.mechanics.rotation import matrix
from wirebayes.robot.motion import claim, drift
from wirebayes.robot.pose import variance_shares

Row = dict[str, Any]
ROBOTS = ("linear-6", "linear-7")  # linear actuators through pulley blocks, as the paper's; the second is redundant
# spread from specimen to specimen, and for how long the wires had hung under the same load before
CASES = ((0.0, 0.0), (0.05, 0.0), (0.05, 3600.0))
_DRAWS, _GRID = 100, (3, 3, 2)
MAPPED = "linear-7"
# evenly spread on a logarithmic axis: the minute that the paper speaks of, and on to an hour
_TIMES_S = np.array([1.0, 3.0, 10.0, 30.0, 60.0, 120.0, 300.0, 600.0, 1800.0, 3600.0])
_MAP, _SIZES, _FEW = (7, 7, 3), (0.5, 1.0, 2.0), 40


def drift_rows(chains: Mapping[str, Stored], seed: int) -> list[Row]:
    """Drift and tilt of a vertical platform after a minute, over posterior and workspace, for each wire and robot.

    Parameters
    ----------
    chains : mapping of wire name to Stored
    """
    robots = {name: schema.read_robot_file(name) for name in ROBOTS}
    out = []
    for wire, stored in chains.items():
        line = as_line(stored)
        for name, robot in robots.items():
            places = claim.grid(robot, _GRID)
            for spread, loaded_s in CASES:
                own_seed = seed_of(seed, "robot", wire, name, f"{spread} {loaded_s}")
                rng = np.random.default_rng(own_seed)
                wires = draws.for_robot(robot, line, spread, rng)
                found = claim.over_workspace(robot, wires, places, loaded_s=loaded_s)
                case: Row = {"experiment": wire, "robot": name, "specimen_spread": spread, "loaded_before_s": loaded_s}
                out.append(case | _drift_row(found))
    return out


def _drift_row(found: claim.WorkspaceDrift) -> Row:
    """Quantiles of drift and tilt, and how probable it is that the claim holds."""
    row: Row = {}
    for key, values in (("drift_mm", 1e3 * found.distance_m), ("tilt_deg", np.degrees(found.tilt_rad))):
        quantiles = np.nanquantile(values, [0.05, 0.5, 0.95])
        for name, value in zip(("q05", "q50", "q95"), quantiles, strict=True):
            row[f"{name}_{key}"] = value
    return row | {"probability": float(found.holds().mean()), "solved": found.found}


def needed(chains: Mapping[str, Stored]) -> list[Row]:
    """Largest platform mass for which the claim holds on new wires, for each wire and size of the robot."""
    robot = schema.read_robot_file(MAPPED)
    rows = []
    for wire, stored in chains.items():
        line = as_line(stored, _FEW)
        for size in _SIZES:
            rows.append(
                {
                    "experiment": wire,
                    "robot": MAPPED,
                    "size_factor": size,
                    "specimen_spread": 0.05,
                    "largest_mass_kg": claim.largest_mass(robot, line, size, steps=7),
                }
            )
    return rows


def draw_maps(gallery: Gallery, chains: Mapping[str, Stored]) -> None:
    """A map of the workspace for each wire, new and alike."""
    robot = schema.read_robot_file(MAPPED)
    for wire, stored in chains.items():
        wires = draws.for_robot(robot, as_line(stored, _FEW))
        found = claim.over_workspace(robot, wires, claim.grid(robot, _MAP))
        median_mm = 1e3 * np.nanmedian(found.distance_m, 1)
        low = number(np.min(median_mm), 2)
        high = number(np.max(median_mm), 2)
        captions = {
            "drift": f"Median drift from {low} to {high} mm across the workspace.",
            "tilt": f"The tilt of {MAPPED} on {wire}, same places.",
        }
        for quantity, figure in workspace_maps(found, wire).items():
            alt = f"Median {quantity} of {MAPPED} on new {wire} within a minute, over its workspace at three heights."
            gallery.add("robot-map", f"{quantity}-{wire}", figure, alt, captions[quantity])


def draw_poses(gallery: Gallery, chains: Mapping[str, Stored], limit_mm: float) -> None:
    """The robot with its drift, the drift of every wire against time, and whose uncertainty makes it uncertain.

    Parameters
    ----------
    chains : mapping of wire to Stored
        Posteriors of all holds.
    limit_mm : float
        The paper's claim, drawn as a line.
    """
    robot = schema.read_robot_file(MAPPED)
    home_m = robot.home_m
    rotation = matrix(robot.home_rotation_rad)
    moved: dict[str, Floats] = {}
    budget: dict[str, dict[str, float]] = {}
    for wire, stored in chains.items():
        line = as_line(stored)
        wires = draws.for_robot(robot, line)
        course = drift.from_command(robot, wires, home_m, rotation, _TIMES_S)
        if not moved:
            scene = scene_points(robot, home_m, rotation, course)
            write_json(gallery.folder / "scene.json", scene)
        distance = 1e3 * np.linalg.norm(course.position_m - home_m, axis=-1)
        moved[wire] = np.where(course.found[:, None], distance, np.nan)
        material = {name: line.parameters[name] for name in draws.CORE}
        budget[wire] = variance_shares.shares(material, distance[:, -1])
    figure = drifts_in_time(moved, _TIMES_S, limit_mm, f"Robot {MAPPED}: drift")
    alt = f"Distance of the platform of {MAPPED} from its pose while new wires of one line creep, for an hour."
    caption = "New wires, the actuators still. Band: 90 % of the posterior draws; beyond 120 s extrapolated."
    gallery.add("robot", "drift", figure, alt, caption)
    figure = budgets(budget, f"Robot {MAPPED}: sources of uncertainty")
    alt = f"Shares of the parameters in the variance of the drift of {MAPPED} after an hour, for each wire."
    gallery.add("robot", "budget", figure, alt, f"Of the drift after {_TIMES_S[-1]:g} s.")


def draw_gallery(gallery: Gallery, claims: Sequence[Row], limit_mm: float) -> None:
    """One picture a robot.

    Parameters
    ----------
    claims : sequence of rows
        Those of ``robot_claim.csv``.
    limit_mm : float
        The paper's claim, drawn as a line.
    """
    for name in ROBOTS:
        mine = [row for row in claims if row["robot"] == name]
        best = max(row["probability"] for row in mine if not row["loaded_before_s"])
        alt = f"Drift of the platform of {name} within a minute, for each wire, new and after an hour under load."
        caption = f"Highest probability that the claim holds on new wires: {best:.2f}."
        gallery.add("robot", name, drifts(mine, limit_mm, f"Robot {name}"), alt, caption)


def as_line(stored: Stored, count: int = _DRAWS) -> WireDraws:
    """Posterior draws of a wire, some of them, as the robot takes them."""
    pick = evenly(len(stored.theta), count)
    model = stored.sample.model
    parameters = {name: stored.draws[name][pick] for name in draws.CORE}
    length = stored.sample.protocol.length_mm
    return WireDraws(parameters, length, model.law, model.history, tension_ref_N=model.tension_ref_N)
