"""Proofs on every shipped robot: share of poses certified, time each, and enclosures beside sampled bands.

python analyses/robots/certificate.py [--poses 24] [--wires FOLDER]
"""

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from analyses.robots.enclosure import enclose
from tests.robot import cases
from wirebayes.robot.mechanics import draws, schema
from wirebayes.robot.motion import drift, inverse
from wirebayes.robot.proof import proofs
from wirebayes.robot.proof.certificate import certify


def shares(poses, rng):
    print(f"{'robot':14s} {'law':8s} lengths    poses proved  ms each  enclosure, m  alone within, mm (median)")
    for name in schema.shipped():
        if schema.read_robot_file(name).plane is not None:  # the other program, or the proof, knows no plane
            continue
        robot = schema.read_robot_file(name)
        for law in ("hooke", "modified"):
            for make in (cases.commanded, cases.disturbed):
                c = make(robot, law, poses, rng)
                found = cases.solved(robot, c)
                began, tried = time.perf_counter(), []
                for i in range(len(found.status)):
                    k1 = np.full(robot.legs, c.wires.theta["k1"][0, i])
                    lengths = c.zero_m[i], c.zero_m[i]
                    at = c.offset_m[i], found.position_m[i], found.rotation[i]
                    tried.append(certify(robot, law, (k1, k1), lengths, *at))
                spent = 1e3 * (time.perf_counter() - began) / len(tried)
                proved = [p for p in tried if p.proved]
                print(
                    f"{name:14s} {law:8s} {make.__name__:10s} {len(tried):5d} {len(proved) / len(tried):6.3f} "
                    f"{spent:8.1f}  {max(p.radius_m.max() for p in proved):.1e}       "
                    f"{1e3 * np.median([p.unique_m for p in proved]):.2f}"
                )


def enclosures(folder):
    """Pose after 60 s for a creep between its 5 % and 95 % quantiles, against the sampled 90 % band."""
    from wirebayes.commands.wire_draws import read_wires

    line = read_wires(folder, 1000)
    k1 = float(line.parameters["k1"].mean())
    line = replace(line, parameters=dict(line.parameters) | {"k1": np.full(line.count, k1)})
    print(f"\nheight after 60 s with {folder.name}, stiffness known, mm from the command:")
    print("sampled 90 % band of a shared draw; guaranteed for all lengths between those of the two quantiles,")
    print("all wires together; and each wire on its own (share: how much of the band about its middle was proved)")
    for name in ("cogiro-desk", "linear-6", "linear-7", "segesta-8", "hangprinter-4"):
        robot = schema.read_robot_file(name)
        wires = draws.for_robot(robot, line)
        x, R = robot.home_m, np.eye(3)
        course = drift.from_command(robot, wires, x, R, np.array([60.0]))
        tau = inverse.tensions(robot, x[None], R[None])
        commands = inverse.commands(robot, wires.part(slice(0, 1)), x[None], R[None], tau)
        bare, offset = inverse.lengths(robot, commands.joint_m[0])
        strain = np.broadcast_to(course.end.strain(wires), (robot.legs, line.count))
        low, high = (bare * (1 + s) for s in np.quantile(strain, [0.05, 0.95], axis=1))
        began = time.perf_counter()
        box = enclose(robot, line.law, k1, low, high, offset, x, R)
        spent = time.perf_counter() - began
        sampled = 1e3 * (np.quantile(course.position_m[:, 0, 2], [0.05, 0.95]) - x[2])
        guaranteed = 1e3 * (np.array([box.low_m[2], box.high_m[2]]) - x[2])
        print(
            f"  {name:14s} sampled {sampled.round(3)}  guaranteed {guaranteed.round(3)}  "
            f"proved {box.proved}, {box.proofs} proofs, {spent:.1f} s"
        )
        own = proofs.enclosed(robot, wires, course, x, R)["band"]
        if own["low_mm"] is not None and own["high_mm"] is not None:
            print(
                f"  {'':14s} each on its own: {np.array([own['low_mm'][2], own['high_mm'][2]]).round(3)}, "
                f"share {own['share']:g}"
            )


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--poses", type=int, default=30)
    parser.add_argument("--wires", type=Path)
    options = parser.parse_args()
    shares(options.poses, np.random.default_rng(5))
    if options.wires:
        enclosures(options.wires)
