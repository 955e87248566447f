"""The paper's claim step by step: from its own parameters, read as printed, to what the chain says of a workspace."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from wirebayes.robot.mechanics import draws, schema
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.draws import WireDraws
from wirebayes.robot.mechanics.rotation import matrix
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion import claim, drift

STEPS = ("table_4_elongation", "table_4_strain", "chain_strain", "chain_workspace")
_GRID = (3, 3, 2)  # poses along each axis, as in `section_4`, so that the figures compare


def claim_step_rows(
    robot_name: str,
    table_4: Mapping[str, Mapping[str, float]],
    lengths_mm: Mapping[str, float],
    chains: Mapping[str, WireDraws],
) -> list[dict[str, Any]]:
    """Drift within a minute for each wire and step, one thing changed a step.

    Table 4's parameters with eq. (5) as printed, which gives every wire of the robot the elongation of the tested
    sample whatever its length; the same with creep as a strain of the whole wire; the chain's posterior instead of
    Table 4; the workspace instead of the home pose.

    Parameters
    ----------
    robot_name : str
        Of a shipped robot.
    table_4 : mapping of wire to parameters
    lengths_mm : mapping of wire to tested length
    chains : mapping of wire to WireDraws

    Returns
    -------
    list of rows
        Median drift, mm, its 5 and 95 % quantiles over draws (and poses), and whether the median is within the claim.
    """
    robot = schema.read_robot_file(robot_name)
    length_mm = 1e3 * draws.nominal_length(robot)[:, None]
    out = []
    for wire, line in chains.items():
        published = {name: np.array([table_4[wire][name]]) for name in draws.CORE}
        strain = draws.for_robot(robot, WireDraws(published, lengths_mm[wire]))
        literal = replace(strain, length_mm=length_mm)
        known = draws.for_robot(robot, line)
        space = claim.over_workspace(robot, known, claim.grid(robot, _GRID))
        drifts_mm = (
            _at_home(robot, literal),
            _at_home(robot, strain),
            _at_home(robot, known),
            1e3 * space.distance_m.ravel(),
        )
        for step, drift_mm in zip(STEPS, drifts_mm, strict=True):
            row = {"experiment": wire, "robot": robot_name, "step": step}
            out.append(row | _quantiles(drift_mm))
    return out


def _quantiles(drift_mm: np.ndarray[Any, np.dtype[np.float64]]) -> dict[str, Any]:
    """Median and ends of the 90 % interval, and whether the claim allows the median."""
    low, middle, high = np.nanquantile(drift_mm, [0.05, 0.5, 0.95])
    return {
        "q05_drift_mm": float(low),
        "q50_drift_mm": float(middle),
        "q95_drift_mm": float(high),
        "within_claim": bool(middle < 1e3 * claim.DISTANCE_M),
    }


def _at_home(robot: Robot, wires: Wires) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Drift of new wires at the home pose, mm, a value a draw."""
    home_m = robot.home_m
    rotation = matrix(robot.home_rotation_rad)
    course = drift.from_command(robot, wires, home_m, rotation, np.array([claim.TIME_S]))
    away_m = course.position_m[:, 0] - home_m
    return np.asarray(1e3 * np.linalg.norm(away_m, axis=-1))
