"""Processor time of a log by the stiffness of its wires, 1e3 to 1e7 N: a laboratory's robot of four wires
that is sent from one stop to another far away.

    python -m analyses.robots.stiff_logs
"""

import time
from pathlib import Path

import numpy as np

from wirebayes.robot.history import follow
from wirebayes.robot.history.history import History
from wirebayes.robot.mechanics import schema
from wirebayes.robot.mechanics.rotation import matrix
from wirebayes.robot.mechanics.wires import Wires

FIELD = Path(__file__).parents[2] / "tests" / "robot" / "field" / "stiff-log-hang"
STIFFNESS_N = 10.0 ** np.arange(3, 8)
CREEP_N = 200.0  # mm N: B times k1, so that wires of every stiffness creep by the same share of what they stretch
DRAWS, REPEATS = 4, 2


def seconds(k1_N: float) -> tuple[float, float]:
    """Processor time of following the log, s, the least of some, and the share of the rows at which it is held."""
    robot = schema.read_robot_file(FIELD / "ua.toml")
    rows = np.loadtxt(FIELD / "ua-j2.csv", delimiter=",", skiprows=1)
    still, middle = np.zeros(len(rows)), np.tile(robot.centre_of_mass_m, (len(rows), 1))
    fine, _ = follow.refined_joints(robot, History(rows[:, 0], rows[:, 1:], None, None, still, middle))
    assert fine.joint_m is not None
    given = next(iter(robot.given.values())).parameters
    theta = {name: np.full((1, DRAWS), value) for name, value in given.items()}
    theta |= {"k1": np.full((1, DRAWS), k1_N), "B": np.full((1, DRAWS), CREEP_N / k1_N)}
    wires = Wires("hooke", "saturating", theta, np.full((robot.legs, 1), 1000.0))
    start = np.array([0.367, 0.365, 1.165]), matrix(np.array([0.085, -0.09, 0.0]))
    spent = []
    for _ in range(REPEATS):
        begun = time.process_time()
        track = follow.follow_log(robot, wires, fine, fine.joint_m, start, fine.times_s[:1])
        spent.append(time.process_time() - begun)
    return min(spent), float(track.held.mean())


if __name__ == "__main__":
    found = [seconds(float(k1)) for k1 in STIFFNESS_N]
    for k1, (spent, held) in zip(STIFFNESS_N, found, strict=True):
        print(f"k1 = {k1:.0e} N: {spent:.2f} s, held at {100 * held:.0f} % of the rows")
    times = [spent for spent, _ in found]
    print(f"longest by shortest: {max(times) / min(times):.2f}")
