"""The running estimate: time of a step for eight wires on one core, and an hour's agreement with the batch estimate.

Set OMP_NUM_THREADS=1: the point is one core. Three clocks tell a slow step from a slow machine: time of the process,
wall time of the steps that the scheduler did not interrupt (it counts involuntary switches), and wall time of all. A
core that others share is slower even so, for its caches are cold after every switch.
"""

import argparse
import gc
import resource
import time

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.robot.history.estimate import estimate_poses
from wirebayes.robot.history.history import History
from wirebayes.robot.history.live import LiveEstimator
from wirebayes.robot.history.live_pose import LivePose
from wirebayes.robot.history.unknowns import Uncertain, unknowns
from wirebayes.robot.mechanics import schema
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.draws import WireDraws
from wirebayes.robot.motion import inverse

MEANS = {"k1": 803.0, "B": 0.31, "U": 1.0, "k2": 0.03, "N": 0.64}  # a thin braided line
WAYPOINT_S = 60.0


def line(draws: int, rng: np.random.Generator) -> WireDraws:
    """A made-up posterior: five per cent in every parameter."""
    return WireDraws({k: v * np.exp(0.05 * rng.standard_normal(draws)) for k, v in MEANS.items()}, 1000.0)


def joints(robot: Robot, wires: WireDraws, position_m: Floats) -> Floats:
    """Joint values of a controller that knows the mean wire and no creep."""
    level = np.broadcast_to(np.eye(3), (len(position_m), 3, 3))
    tau = inverse.tensions(robot, position_m, level)
    plain = unknowns(robot, wires, Uncertain(), np.random.default_rng(0)).plain
    return inverse.commands(robot, plain, position_m, level, tau).joint_m


def speed(robot: Robot, wires: WireDraws, reads: bool, steps: int, rate_Hz: float) -> None:
    """Print milliseconds a step: mean, and the longest of all but one in a hundred; and what made steps longer."""
    times = np.arange(steps) / rate_Hz
    reach = 0.05 * robot.span_m
    way = robot.home_m + reach * np.stack([np.sin(times), np.cos(times) - 1.0, 0.3 * np.sin(2 * times)], 1)
    commanded = joints(robot, wires, way)
    tension = np.full(robot.legs, 5.0)
    live = LiveEstimator(robot, wires, Uncertain(1e-3), (robot.home_m, np.eye(3)), reads)
    live.step(-1.0, commanded[0])
    spent, passed, interrupted = np.empty(steps), np.empty(steps), np.empty(steps, bool)
    collecting = _Collecting()
    for k, (moment, joint) in enumerate(zip(times, commanded, strict=True)):
        switches, since, begin = _switches(), time.perf_counter(), time.process_time()
        if reads:
            live.step(moment, joint, tension, np.zeros(2))
        else:
            live.step(moment, joint)
        spent[k], passed[k] = 1e3 * (time.process_time() - begin), 1e3 * (time.perf_counter() - since)
        interrupted[k] = _switches() > switches
    collecting.end()
    kind = "with tensions and angles" if reads else "joint values only"
    rate = f"{spent.mean():.2f} ms a step ({1e3 / spent.mean():.0f} Hz)"
    late = f"99 % within {np.quantile(spent, 0.99):.2f} ms"
    print(f"{robot.legs} wires, {wires.count} draws, {kind}: {rate}, {late}")
    quiet = np.quantile(passed[~interrupted], 0.99)
    print(
        f"  by the wall clock 99 % within {quiet:.2f} ms where the scheduler did not interrupt, within "
        f"{np.quantile(passed, 0.99):.2f} ms with the {100 * interrupted.mean():.0f} % of steps where it did; garbage "
        f"collection {collecting.times} times, at most {1e3 * collecting.longest_s:.2f} ms"
    )


def _switches() -> int:
    """How often the scheduler has taken the core away so far."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_nivcsw


class _Collecting:
    """Counts and times Python's garbage collections until the end."""

    def __init__(self) -> None:
        self.times, self.longest_s, self.since_s = 0, 0.0, 0.0
        gc.callbacks.append(self._called)

    def _called(self, phase: str, info: dict[str, int]) -> None:
        if phase == "start":
            self.since_s = time.perf_counter()
        else:
            self.times += 1
            self.longest_s = max(self.longest_s, time.perf_counter() - self.since_s)

    def end(self) -> None:
        gc.callbacks.remove(self._called)


def hour(robot: Robot, wires: WireDraws, rate_Hz: float) -> None:
    """Print how far live and batch estimates are apart, by the width of the 90 % band."""
    rng = np.random.default_rng(1)
    times = np.arange(0.0, 3600.1, WAYPOINT_S)
    reach = 0.05 * robot.span_m
    way = robot.home_m + reach * rng.uniform(-1.0, 1.0, (len(times), 3)) * [1, 1, 0.5]
    stops = np.repeat(way[::2], 2, 0)[: len(times)]  # a minute's stop after each minute's move
    commanded = joints(robot, wires, stops)
    start = robot.home_m, np.eye(3)
    history = History(times, commanded, None, None, np.zeros(len(times)), np.zeros((len(times), 3)))
    batch = estimate_poses(robot, wires, history, start, Uncertain(1e-3), np.random.default_rng(0)).track.position_m
    live = LiveEstimator(robot, wires, Uncertain(1e-3), start, reads=False)
    seen: list[LivePose] = []
    for moment in np.arange(0.0, 3600.0 + 0.5 / rate_Hz, 1.0 / rate_Hz):
        joint = np.array([np.interp(moment, times, column) for column in commanded.T])
        now = live.step(float(moment), joint)
        if len(seen) < len(times) and moment >= times[len(seen)] - 1e-9:
            seen.append(now)
    low, high = np.quantile(batch, [0.05, 0.95], axis=0)
    apart = np.abs(np.array([p.position_m for p in seen]) - batch.mean(0)) / (high - low)
    edges = np.abs(np.array([[p.low_m, p.high_m] for p in seen]) - np.stack([low, high], 1)) / (high - low)[:, None]
    print(f"an hour at {rate_Hz:g} Hz: mean within {apart.max():.4f} of the band, its edges within {edges.max():.4f}")


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--robot", default="cogiro-desk")
    options.add_argument("--draws", type=int, default=64)
    options.add_argument("--steps", type=int, default=2000)
    options.add_argument("--rate", type=float, default=20.0, help="of the hour, Hz")
    given = options.parse_args()
    machine, posterior = schema.read_robot_file(given.robot), line(given.draws, np.random.default_rng(0))
    for with_readings in (False, True):
        speed(machine, posterior, with_readings, given.steps, 500.0)
    hour(machine, posterior, given.rate)
