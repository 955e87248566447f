"""Pose error of a controller that knows Hooke's law only against one that foresees creep, and how long each lasts.

    python analyses/robots/control.py FITS [--draws 400]

FITS holds a folder per line as written by `wirebayes fit data/paper/experiments.toml --output FITS`; a folder
FITS/NAME+EFFECT beside FITS/NAME is a fit of the same line with an effect, told to a third controller.
"""

import argparse
from pathlib import Path

import numpy as np

from wirebayes.commands.wire_draws import read_wires
from wirebayes.robot.mechanics import draws, schema
from wirebayes.robot.motion import control, inverse
from wirebayes.robot.motion.creep import HoldCreep, fresh

LINES = ("roc-line-1m", "roc-line-1.71m", "nylon-1.5m", "kite-1.5m")
ROBOTS = ("linear-7", "cogiro-desk", "segesta-8", "hangprinter-4")
TIMES = np.array([0.0, 60.0, 600.0, 3600.0])


def errors(fits, count):
    rng = np.random.default_rng(0)
    print("pose error, mm, median [95 % below]; wires new at 0 s; specimens 5 %; controllers are told the posterior")
    print(f"{'line':15s} {'robot':14s} {'controller':28s} " + " ".join(f"{f'{t:g} s':>16s}" for t in TIMES))
    for line_name in LINES:
        line = read_wires(fits / line_name, count)
        others = {p.name: read_wires(p, count) for p in sorted(fits.glob(f"{line_name}+*"))}
        for name in ROBOTS:
            robot = schema.read_robot_file(name)
            x, R = robot.home_m, np.eye(3)
            for truth_name, truth in {line_name: line, **others}.items():
                wires = draws.for_robot(robot, truth, 0.05, rng)
                schedules = {
                    "Hooke only": control.hooke_only(robot, draws.for_robot(robot, truth), x, R),
                    "creep, plain model": control.creep_aware(robot, draws.for_robot(robot, line), x, R),
                }
                if truth_name != line_name:
                    schedules["creep, with effects"] = control.creep_aware(robot, draws.for_robot(robot, truth), x, R)
                for label, schedule in schedules.items():
                    error = control.error(robot, wires, schedule, x, R, TIMES)
                    mid, high = 1e3 * np.quantile(error.distance_m[error.found], [0.5, 0.95], axis=0)
                    cells = " ".join(f"{a:6.2f} [{b:7.2f}]" for a, b in zip(mid, high, strict=True))
                    print(f"{truth_name:15s} {name:14s} {label:28s} {cells}")


def intervals(fits, count):
    """Longest time between calibrations, after a load history, for several tolerances."""
    rng = np.random.default_rng(1)
    times = np.concatenate([[0.0], np.geomspace(1.0, 1e5, 61)])
    tolerances = (0.1e-3, 0.3e-3, 1e-3)
    print("\nlongest time between calibrations, s, with P(pose error < tolerance) >= 0.95; posterior, specimens 5 %")
    print("calibrated away at 0 s, wires new or an hour under the same tensions before (the command restarts clocks)")
    head = " ".join(f"{f'{1e3 * t:g} mm':>9s}" for t in tolerances)
    print(f"{'line':15s} {'robot':14s} {'wires':7s} {'hold still':^{len(head)}s}   {'creep foreseen':^{len(head)}s}")
    print(f"{'':38s} {head}   {head}")
    for line_name in LINES:
        line = read_wires(fits / line_name, count)
        for name in ROBOTS:
            robot = schema.read_robot_file(name)
            x, R = robot.home_m, np.eye(3)
            wires = draws.for_robot(robot, line, 0.05, rng)
            tau = inverse.tensions(robot, x[None], R[None])
            load = np.repeat(tau.T, line.count, 1)
            for loaded_s in (0.0, 3600.0):
                state = fresh(robot.legs, line.count)
                if loaded_s:
                    state = HoldCreep(wires, state, load).advance(loaded_s, load)
                cells = []
                for schedule in control.calibrated_schedules(robot, wires, state, x, R):
                    error = control.error(robot, wires, schedule, x, R, times, state)
                    found = [control.longest_interval(error, t) for t in tolerances]
                    cells.append(" ".join(f"{v:9.3g}" if np.isfinite(v) else f"{'> 1e5':>9s}" for v in found))
                print(f"{line_name:15s} {name:14s} {'1 h' if loaded_s else 'new':7s} {cells[0]}   {cells[1]}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("fits", type=Path)
    parser.add_argument("--draws", type=int, default=400)
    options = parser.parse_args()
    errors(options.fits, options.draws)
    intervals(options.fits, options.draws)
