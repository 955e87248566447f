"""Forward kinematics against other programs and its own inverse, over random (robot, pose, wire) cases.

    python analyses/robots/agreement.py [CASES_PER_ROBOT] [--output FILE.json]

Lengths as commanded, and lengths wrong by a percent so that wires go slack. Laws (1)/(6) against MuJoCo's settled
platform, law (3), and law (1) where MuJoCo's has not come to rest, against a general minimiser of an energy written
anew; round trips for both.
"""

import json
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from analyses.options import study_options
from tests.robot import cases
from wirebayes.robot.mechanics import rotation, schema
from wirebayes.robot.motion import forward, outcome


def distance(robot, x, R, y, Q):
    """Metres; rotations at the platform's edge."""
    return np.maximum(np.abs(x - y).max(-1), robot.size_m * np.abs(R - Q).max((-2, -1)))


def nearby(robot, found, rng):
    x = found.position_m + 2e-3 * robot.size_m * rng.normal(size=found.position_m.shape)
    turn = 2e-3 * rng.normal(size=x.shape) * (robot.degrees == 6)
    return x, rotation.matrix(turn) @ found.rotation


def compare(robot, make, law, count, rng):
    c = make(robot, law, count, rng)
    start, turn = c.position_m + 0.02 * rng.normal(size=c.position_m.shape), np.eye(3)
    blind = forward.solve_equilibrium(robot, c.wires, c.zero_m, c.offset_m, start, turn)
    found = cases.solved(robot, c)
    begin, begin_R = nearby(robot, found, rng)
    soft = cases.softest(robot, c, found)
    errors, rested = [], []
    for i in np.flatnonzero(found.found):
        k1 = c.wires.theta["k1"][0, i]
        lengths = c.zero_m[i], c.offset_m[i], begin[i], begin_R[i]
        if law == "hooke":
            x, R, calm = cases.rest_in_mujoco(robot, np.full(robot.legs, k1), *lengths, softest_N_m=max(soft[i], 1e-2))
        if law == "modified" or not calm:  # a platform that still swings is no judge
            x, R, _ = cases.energy_minimum(robot, law, k1, *lengths)
            calm = law == "modified"
        rested.append(calm)
        errors.append(distance(robot, x, R, found.position_m[i], found.rotation[i]))
    there = np.nan
    if make is cases.commanded:
        there = distance(robot, found.position_m, found.rotation, c.position_m, c.rotation).max()
        back = distance(robot, blind.position_m, blind.rotation, c.position_m, c.rotation)[blind.found]
        there = max(there, back.max())
    slack = (found.tension_N == 0).any(1).sum()
    answered = found.found | (found.status == outcome.NOT_HELD)  # a plate on two points in line is free, and said to be
    free = int((found.status == outcome.NOT_HELD).sum())
    return len(found.status), answered.mean(), blind.found.mean(), slack, np.mean(rested), np.array(errors), there, free


def main():
    parser = study_options(__doc__)
    parser.add_argument("count", type=int, nargs="?", default=40)
    parser.add_argument("--output", type=Path)
    options = parser.parse_args()
    count = options.count
    rng = np.random.default_rng(2024)
    print("distances in m; 'blind' starts 2 cm off with no rotation known")
    print(f"{'robot':14s} {'law':8s} {'lengths':10s} cases solved  blind slack rested  median    largest   round trip")
    total, solved, slack, worst, trips = 0, 0.0, 0, 0.0, 0.0
    over, unheld = 0, 0
    for name in schema.shipped():
        if schema.read_robot_file(name).plane is not None:  # the other program, or the proof, knows no plane
            continue
        robot = schema.read_robot_file(name)
        for law in ("hooke", "modified"):
            for make in (cases.commanded, cases.disturbed):
                n, ok, blind, loose, calm, errors, there, free = compare(robot, make, law, count, rng)
                total, solved, slack = total + n, solved + ok * n, slack + loose
                worst, trips = max(worst, errors.max()), np.nanmax([trips, there])
                over += int((errors > 1e-6).sum())
                unheld += free
                print(
                    f"{name:14s} {law:8s} {make.__name__:10s} {n:5d} {ok:6.3f} {blind:6.3f} {loose:5d} {calm:6.3f}  "
                    f"{np.median(errors):.1e}  {errors.max():.1e}  {there:.1e}"
                )
    print(
        f"{total} cases, {solved / total:.4f} solved or known not to be held ({unheld}), {slack} with slack wires, "
        f"largest disagreement {worst:.1e} m "
        f"({over} above 1e-6), largest round-trip error {trips:.1e} m"
    )
    if options.output:
        found = {
            "cases": total,
            "with_slack_wires": int(slack),
            "largest_m": float(worst),
            "round_trip_m": float(trips),
        }
        options.output.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
