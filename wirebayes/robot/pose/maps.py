"""Maps of a minute's drift over slices of the workspace: which slices, their numbers, and a row for every point."""

from dataclasses import dataclass

import numpy as np

from wirebayes.json_files.pose import SliceOfWorkspace
from wirebayes.numeric.evenly import evenly
from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics import draws, plane
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.draws import WireDraws
from wirebayes.robot.mechanics.rotation import matrix
from wirebayes.robot.motion import claim
from wirebayes.robot.motion.claim import WorkspaceDrift

_GRID, _FLAT, _DRAWS = (7, 7, 3), (9, 9, 9), 60  # points of the map; of a workspace in one plane
TABLE = (
    "rx_rad", "ry_rad", "rz_rad", "x_m", "y_m", "z_m", "held", "q05_drift_mm", "q50_drift_mm", "q95_drift_mm",
    "q05_tilt_deg", "q50_tilt_deg", "q95_tilt_deg", "probability", "lowest_tension_N", "highest_tension_N",
)  # fmt: skip


@dataclass(frozen=True)
class Slices:
    """Which slices are mapped.

    Attributes
    ----------
    heights_m : (h,) array or None
        Heights of the slices; None: evenly through the robot's workspace box.
    rotations_rad : (r, 3) array
        Rotation vectors, a map each.
    """

    heights_m: Floats | None
    rotations_rad: Floats


LEVEL = Slices(None, np.zeros((1, 3)))  # a level platform at the default heights, unless others are requested


@dataclass(frozen=True)
class Map:
    """The slices of one orientation.

    Attributes
    ----------
    rotation_rad : (3,) array
    requested_m : (p, 3) array
        All positions of the grid.
    drift : WorkspaceDrift
        At those that tensions hold.
    """

    rotation_rad: Floats
    requested_m: Floats
    drift: WorkspaceDrift

    @property
    def slice_axis(self) -> int:
        """The axis through the slices: of a flat workspace the one across it, else the vertical."""
        flat = np.flatnonzero(np.ptp(self.requested_m, axis=0) == 0)
        return 2 if not flat.size or 2 in flat else int(flat[0])


def map_slices(robot: Robot, line: WireDraws, slices: Slices) -> tuple[Map, ...]:
    """A minute's drift over the slices, one draw for all wires of the line, an orientation after the other.

    Parameters
    ----------
    robot : Robot
    line : WireDraws
    slices : Slices

    Returns
    -------
    tuple of Map
    """
    if robot.freedom == "orientation":  # it has one position
        return ()
    few = line.part(evenly(line.count, _DRAWS))
    wires = draws.for_robot(robot, few)
    where = claim.grid(robot, _GRID if (robot.upper_m > robot.lower_m).all() else _FLAT)
    if slices.heights_m is not None:
        level = where[where[:, 2] == where[0, 2]]
        where = np.concatenate([np.column_stack([level[:, :2], np.full(len(level), z)]) for z in slices.heights_m])
    where = plane.onto(robot, where, np.broadcast_to(np.eye(3), (len(where), 3, 3)))[0]
    return tuple(
        Map(turn, where, claim.over_workspace(robot, wires, where, rotation=matrix(turn)))
        for turn in slices.rotations_rad
    )


def summaries(found: tuple[Map, ...]) -> list[SliceOfWorkspace]:
    """Every slice in numbers: where it lies, and `claim.summary` of its points."""
    out: list[SliceOfWorkspace] = []
    for one in found:
        through = one.slice_axis
        for level in np.unique(one.requested_m[:, through]):
            here = one.drift.position_m[:, through] == level
            share = float(here.sum() / (one.requested_m[:, through] == level).sum())
            where: SliceOfWorkspace = {
                "rotation_vector_rad": one.rotation_rad,
                "axis": "xyz"[through],
                "at_m": float(level),
                "feasible": 0.0,
            }
            out.append({**where, **claim.claim_summary(one.drift.part(here, share))} if here.any() else where)
    return out


def rows(found: tuple[Map, ...]) -> list[tuple[float, ...]]:
    """A row of `TABLE` for every point; NaN where no tensions hold it."""
    out: list[tuple[float, ...]] = []
    for one in found:
        where = {tuple(x): i for i, x in enumerate(one.drift.position_m)}
        inside = one.drift.holds()
        for x in one.requested_m:
            i = where.get(tuple(x))
            values = [0.0] + [np.nan] * 9
            if i is not None:
                far, tilt = 1e3 * one.drift.distance_m[i], np.degrees(one.drift.tilt_rad[i])
                held = np.isfinite(far)
                bands = [q for v in (far, tilt) for q in _quantiles(v[held])]
                tension = one.drift.tension_N[i]
                values = [held.mean(), *bands, inside[i], tension.min(), tension.max()]
            out.append((*map(float, one.rotation_rad), *map(float, x), *map(float, values)))
    return out


def _quantiles(values: Floats) -> list[float]:
    return list(np.quantile(values, [0.05, 0.5, 0.95])) if values.size else [np.nan] * 3
