"""Maps of a minute's drift over slices of the workspace: which slices, their numbers, and a row for every point."""

from dataclasses import dataclass

import numpy as np

from wirebayes.json_files.pose import SliceOfWorkspace
from wirebayes.numeric.evenly import evenly
from wirebayes.numeric.typing import Floats
from wirebayes.progress import ShareDone, shares_of, unseen
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
    """The slices that are mapped.

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


def map_slices(robot: Robot, line: WireDraws, slices: Slices, progress: ShareDone = unseen) -> tuple[Map, ...]:
    """A minute's drift over the slices, one draw for all wires of the line, an orientation after the other.

    Parameters
    ----------
    robot : Robot
    line : WireDraws
    slices : Slices
    progress : function of a share between 0 and 1

    Returns
    -------
    tuple of Map
    """
    if robot.freedom == "orientation":  # it has one position
        return ()
    few = line.part(evenly(line.count, _DRAWS))
    wires = draws.for_robot(robot, few)
    where = _points(robot, slices.heights_m)
    maps = []
    done = shares_of(progress, len(slices.rotations_rad))
    for turn in slices.rotations_rad:
        share_done = next(done)
        share_done(0.0)
        drift = claim.over_workspace(robot, wires, where, rotation=matrix(turn))
        maps.append(Map(turn, where, drift))
        share_done(1.0)
    return tuple(maps)


def _points(robot: Robot, heights_m: Floats | None) -> Floats:
    """(p, 3) positions of the slices' grid."""
    boxy = (robot.upper_m > robot.lower_m).all()
    where = claim.grid(robot, _GRID if boxy else _FLAT)
    if heights_m is not None:
        level = where[where[:, 2] == where[0, 2]]
        slices = [np.column_stack([level[:, :2], np.full(len(level), z)]) for z in heights_m]
        where = np.concatenate(slices)
    position, _ = plane.onto(robot, where, np.broadcast_to(np.eye(3), (len(where), 3, 3)))
    return position


def summaries(found: tuple[Map, ...]) -> list[SliceOfWorkspace]:
    """Every slice in numbers: where it lies, and `claim.summary` of its points."""
    out: list[SliceOfWorkspace] = []
    for one in found:
        through = one.slice_axis
        requested = one.requested_m[:, through]
        for level in np.unique(requested):
            here = one.drift.position_m[:, through] == level
            where: SliceOfWorkspace = {
                "rotation_vector_rad": one.rotation_rad,
                "axis": "xyz"[through],
                "at_m": float(level),
                "feasible": 0.0,
            }
            if here.any():
                share = float(here.sum() / (requested == level).sum())
                where = {**where, **claim.claim_summary(one.drift.part(here, share))}
            out.append(where)
    return out


def rows(found: tuple[Map, ...]) -> list[tuple[float, ...]]:
    """A row of `TABLE` for every point; NaN where no tensions hold it."""
    out: list[tuple[float, ...]] = []
    for one in found:
        drift = one.drift
        held = {tuple(x): i for i, x in enumerate(drift.position_m)}
        inside = drift.holds()
        for x in one.requested_m:
            i = held.get(tuple(x))
            values = [0.0] + [np.nan] * 9
            if i is not None:
                values = _at_point(drift, i, inside[i])
            row = [*one.rotation_rad, *x, *values]
            out.append(tuple(map(float, row)))
    return out


def _at_point(drift: WorkspaceDrift, i: int, inside: float) -> list[float]:
    """What a row says of a point that tensions hold."""
    far_mm, tilt_deg = 1e3 * drift.distance_m[i], np.degrees(drift.tilt_rad[i])
    held = np.isfinite(far_mm)
    tension = drift.tension_N[i]
    bands = _quantiles(far_mm[held]) + _quantiles(tilt_deg[held])
    return [held.mean(), *bands, inside, tension.min(), tension.max()]


def _quantiles(values: Floats) -> list[float]:
    return list(np.quantile(values, [0.05, 0.5, 0.95])) if values.size else [np.nan] * 3
