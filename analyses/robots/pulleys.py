"""What it costs to take pulleys for points, against what creep does: the table of the docs.

    wirebayes fit data/paper/experiments.toml --experiment roc-line-1m --output out/fit
    python analyses/robots/pulleys.py out/fit/roc-line-1m > docs/pulleys-table.inc

Shipped robots get a pulley at every exit, the wire coming from the floor (from above for exits below the platform,
level for exits right above or below it). A controller takes the exit points for the points where the wires leave, and
is zeroed at the home pose: what is left is what the arcs and tangents change on the way. Creep: new wires held still,
everything else known.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from wirebayes.commands.wire_draws import read_wires
from wirebayes.robot.mechanics import draws, rotation, schema, statics
from wirebayes.robot.mechanics.description import Pulleys
from wirebayes.robot.motion import claim, forward, inverse

ROBOTS = ("linear-7", "cogiro-desk", "segesta-8", "hangprinter-4")
RADII_M = (0.01, 0.025, 0.05)
GRID, DRAWS, TIMES_S = (5, 5, 3), 40, (60.0, 3600.0)


def with_pulleys(robot, radius_m):
    """Pulleys of one radius at all exits; the wire comes level where the platform is right above or below."""
    line = robot.exit_m - robot.home_m
    steep = np.abs(line[:, 2]) > 2 * np.linalg.norm(line[:, :2], axis=1)
    upright = np.where(line[:, 2] > 0, 1.0, -1.0)[:, None] * [0.0, 0.0, 1.0]
    axis = np.where(steep[:, None], [1.0, 0.0, 0.0], upright)
    return replace(robot, pulleys=Pulleys(np.full(robot.legs, radius_m), axis))


def ignored(robot, wires, radius_m):
    """Errors over the workspace: of lengths before and after zeroing (shares), of positions (mm), and loads."""
    real = with_pulleys(robot, radius_m)
    x = np.vstack([robot.home_m, claim.grid(robot, GRID)])
    R = np.broadcast_to(rotation.matrix(robot.home_rotation_rad), (len(x), 3, 3))
    tau = inverse.tensions(robot, x, R)
    good = np.isfinite(tau).all(1) & np.isfinite(inverse.tensions(real, x, R)).all(1)
    x, R, tau = x[good], R[good], tau[good]
    commanded = inverse.commands(robot, wires, x, R, tau).joint_m
    right = inverse.commands(real, wires, x, R, inverse.tensions(real, x, R)).joint_m
    zeroed = commanded + right[0] - commanded[0]
    length = np.stack([statics.geometry(r, x.T, np.moveaxis(R, 0, -1)).distance_m for r in (real, robot)])
    raw = np.abs(length[0] - length[1]) / length[0]
    change = length[0] - length[1] - (length[0] - length[1])[:, :1]
    there = forward.solve_equilibrium(real, wires, *inverse.lengths(real, zeroed), x, R)
    off = 1e3 * np.linalg.norm(there.position_m - x, axis=1)[1:]
    slack = (there.tension_N[1:] <= 0).any(1).mean()
    return raw[:, 1:], np.abs(change[:, 1:]), (np.abs(change) / length[0])[:, 1:], off, slack


def creep(robot, line):
    """Median and largest drift, mm, over the workspace, after each time."""
    wires = draws.for_robot(robot, line.part(np.unique(np.linspace(0, line.count - 1, DRAWS).round().astype(int))))
    maps = [claim.over_workspace(robot, wires, claim.grid(robot, GRID), time) for time in TIMES_S]
    return [1e3 * np.nanmedian(m.distance_m) for m in maps]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("fit", type=Path)
    line = read_wires(parser.parse_args().fit, 1000)
    head = [
        "robot",
        "pulley radius, mm",
        "length, before zeroing",
        "length, after zeroing",
        "position, mm",
        "poses with a slack wire",
        "creep in a minute, mm",
        "creep in an hour, mm",
    ]
    print(".. list-table::\n   :header-rows: 1\n   :widths: 16 10 16 18 16 12 10 10\n")
    rows = [head]
    for name in ROBOTS:
        robot = schema.read_robot_file(name)
        wires = draws.for_robot(robot, line.centre())
        drift = creep(robot, line)
        for radius in RADII_M:
            raw, change, share, off, slack = ignored(robot, wires, radius)
            rows.append(
                [
                    name,
                    f"{1e3 * radius:g}",
                    f"{100 * np.median(raw):.2g} to {100 * raw.max():.2g} %",
                    f"{1e3 * np.median(change):.2g} mm, to {100 * share.max():.2g} %",
                    f"{np.nanmedian(off):.2g}, to {np.nanmax(off):.2g}",
                    f"{100 * slack:.0f} %",
                    *(f"{value:.2g}" for value in drift),
                ]
            )
    for row in rows:
        print("   * - " + "\n     - ".join(row))


if __name__ == "__main__":
    main()
