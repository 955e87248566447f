"""The paper's section 4 over a workspace: drift and tilt of a vertical platform after 60 s, for each line.

    python analyses/robot_claim.py FITS [--draws 200]

FITS holds a folder per line as written by `wirebayes fit data/paper/experiments.toml --output FITS`.
"""

import argparse
from pathlib import Path

import numpy as np

from wirebayes.robot.mechanics import draws, schema
from wirebayes.robot.motion import claim
from wirebayes.workflows.wires import read_wires

LINES = ("roc-line-1m", "roc-line-1.71m", "nylon-1.5m", "kite-1.5m")
ROBOTS = ("linear-6", "linear-7", "cogiro-desk", "segesta-8")
GRID = (5, 5, 3)


def band(values):
    low, mid, high = np.quantile(values, [0.05, 0.5, 0.95])
    return f"{mid:7.3f} [{low:6.3f}, {high:6.3f}]"


def table(fits, count, rng):
    print("after 60 s, over workspace and posterior: median [90 % band]; P: claim holds (< 0.3 mm and < 0.055 degrees)")
    print("new: wires never loaded before; 1 h: an hour under the same tensions, then commanded to the pose anew")
    print("everywhere: probability that it holds at every pose of the workspace with the same wires")
    head = f"{'line':15s} {'robot':12s} spread     {'drift, mm':25s} {'tilt, degrees':26s}"
    print(f"{head} P      everywhere  tension, N  solved")
    for line_name in LINES:
        line = read_wires(fits / line_name, count)
        for name in ROBOTS:
            robot = schema.read(name)
            for spread, loaded_s in ((0.0, 0.0), (0.05, 0.0), (0.05, 3600.0)):
                wires = draws.for_robot(robot, line, spread, rng)
                out = claim.over_workspace(robot, wires, claim.grid(robot, GRID), loaded_s=loaded_s)
                numbers = claim.summary(out)
                age = "1 h" if loaded_s else "new"
                print(
                    f"{line_name:15s} {name:12s} {spread:4.2f} {age} {band(1e3 * out.distance_m):25s} "
                    f"{band(np.degrees(out.tilt_rad)):26s} {numbers['probability']:.3f}  "
                    f"{numbers['probability_everywhere']:.3f}       "
                    f"{out.tension_N.min():.1f}-{out.tension_N.max():.1f}  {out.found:.4f}"
                )


def needed(fits, count):
    """Largest mass for which the claim holds with 95 % at 95 % of the poses, at several sizes."""
    print("\nlargest mass, kg, at which the claim holds with probability 0.95 at nineteen poses of twenty (spread 5 %)")
    sizes = (0.25, 0.5, 1.0, 2.0)
    print(f"{'line':15s} {'robot':12s} " + " ".join(f"size x{s:<5g}" for s in sizes))
    for line_name in LINES:
        line = read_wires(fits / line_name, count)
        for name in ("linear-6", "cogiro-desk"):
            robot = schema.read(name)
            masses = [f"{claim.largest_mass(robot, line, size):9.3f}" for size in sizes]
            print(f"{line_name:15s} {name:12s} " + " ".join(masses))


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("fits", type=Path)
    parser.add_argument("--draws", type=int, default=200)
    options = parser.parse_args()
    table(options.fits, options.draws, np.random.default_rng(0))
    needed(options.fits, 60)
