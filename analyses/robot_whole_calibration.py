"""Calibration of whole robots drawn at random: do 90 % intervals hold the truth, and are anchors found from lengths?

Exit points, reference lengths, wires and specimens are drawn from what the estimator is told; sessions come from the
forward statics with creep (`session.predict`), which the estimator does not use.

    python analyses/robot_whole_calibration.py coverage 200
    python analyses/robot_whole_calibration.py lengths 100
"""

import argparse
import time
from dataclasses import dataclass, replace

import numpy as np

from tests.robot import drawn
from wirebayes.robot.mechanics import draws, rotation
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.motion import inverse
from wirebayes.robot.self_calibration import equations, session, whole
from wirebayes.robot.self_calibration.seeds import best
from wirebayes.robot.self_calibration.unknowns import StatedErrors, Unknowns

MODES = ("poses known", "poses roughly known", "poses unknown", "some poses")
POINTS = ("point-4", "point-5")


@dataclass
class Case:
    """A drawn robot, what is told about it, its readings, and the truth."""

    told: Unknowns
    holds: equations.Holds
    exit_m: np.ndarray
    reference_m: np.ndarray
    length_m: np.ndarray
    position_m: np.ndarray


def case(kind: str, mode: str, rng: np.random.Generator, stops: int = 20, tensions: bool = True) -> Case | None:
    """One robot with its session; None where it does not hold its platform at enough poses."""
    try:
        made = drawn.draw(kind, rng, 200, 0.03)
    except RuntimeError:
        return None
    robot, span = made.robot, made.robot.span_m
    anchor = span * float(rng.choice([2e-3, 1e-2])) if tensions else 0.02 * span
    reference = 2e-3 * span
    true = replace(robot, exit_m=robot.exit_m + anchor * rng.normal(size=robot.exit_m.shape))
    force = robot.rule.highest_N / 5.0
    prior = session.Prior(made.line, reference)
    log = _commanded(robot, made.line, rng, stops, force)
    if log is None:
        return None
    mean, cov = prior.moments(robot.legs)
    values = rng.multivariate_normal(mean, cov, 1)
    with np.errstate(all="ignore"):
        real = session.predict(true, prior, log, values)
    if not real.solved[0] or not np.isfinite(real.readings).all():
        return None
    tension = real.readings[0].reshape(stops, robot.legs) + rng.normal(size=(stops, robot.legs))
    tension = np.maximum(tension * log.tension_sd_N, 0.0) if tensions else np.full((stops, robot.legs), np.nan)
    position, turn = real.position_m[0].copy(), real.rotation[0].copy()
    pose_sd = 1e-3 * span if mode == "poses roughly known" else 0.0
    position += pose_sd * rng.normal(size=position.shape)
    if robot.degrees == 6 and pose_sd:
        turn = turn @ rotation.matrix(pose_sd / robot.size_m * rng.normal(size=position.shape))
    unknown = {"poses unknown": np.ones(stops, bool), "some poses": np.arange(stops) >= 5}.get(mode)
    if unknown is not None:
        position[unknown], turn[unknown] = np.nan, np.nan
    told = Unknowns(robot, prior, StatedErrors(exit_m=anchor, pose_m=pose_sd))
    log = replace(log, position_m=position, rotation=turn, read=np.full(stops, tensions))
    return Case(told, equations.Holds(log, tension), true.exit_m, values[0, : robot.legs], real.length_m[0],
                real.position_m[0])  # fmt: skip


def _commanded(
    robot: Robot, line: draws.WireDraws, rng: np.random.Generator, stops: int, force: float
) -> session.Session | None:
    wires = draws.for_robot(robot, line.centre())
    x = rng.uniform(robot.lower_m, robot.upper_m, (20 * stops, 3))
    R = rotation.matrix(0.1 * rng.normal(size=x.shape) * (robot.degrees == 6))
    tau = inverse.tensions(robot, x, R)
    good = np.flatnonzero(np.isfinite(tau).all(1))[:stops]
    if len(good) < stops:
        return None
    commands = inverse.commands(robot, wires, x[good], R[good], tau[good])
    duration = np.full(stops, 30.0)
    return session.Session(x[good], R[good], commands.joint_m, duration, np.ones(stops, bool), 0.003 * force)


def _inside(mean: np.ndarray, sd: np.ndarray, truth: np.ndarray, half: float) -> np.ndarray:
    return np.abs(mean - truth) <= half * sd


def coverage(size: int, seed: int) -> None:
    """Shares of 90 % intervals that hold the truth, by mode."""
    rng = np.random.default_rng(seed)
    rows, failed, took = [], 0, []
    made = 0
    while made < size:
        kind, mode = drawn.KINDS[made % len(drawn.KINDS)], MODES[(made // len(drawn.KINDS)) % len(MODES)]
        one = case(kind, mode, rng)
        if one is None:
            continue
        made += 1
        begun = time.perf_counter()
        with np.errstate(all="ignore"):
            found = best(one.told, one.holds, rng)
        took.append(time.perf_counter() - begun)
        if not found.converged:
            failed += 1
            print("   not converged", kind, mode, found.noise, found.cost)
            continue
        s = whole.summarised(found)
        half = found.quantile
        inside = [
            _inside(s.exit_m[0], s.exit_m[1], one.exit_m, half).mean(),
            _inside(s.reference_m[0], s.reference_m[1], one.reference_m, half).mean(),
            _inside(s.length_m[0], s.length_m[1], one.length_m, half).mean(),
            _inside(s.position_m[0], s.position_m[1] + 1e-6 * one.told.robot.span_m, one.position_m, half).mean(),
        ]
        rows.append((kind, mode, *inside, whole.trust(found)))
    print(f"{made} robots, {failed} not converged, {np.mean(took):.2f} s each")
    for name, at in (("all", None), *((m, 1) for m in MODES), *((k, 0) for k in drawn.KINDS)):
        some = [r for r in rows if at is None or r[at] == name]
        if some:
            shares = np.mean([r[2:6] for r in some], 0)
            print(f"{name:22} exit {shares[0]:.3f}  reference {shares[1]:.3f}  length {shares[2]:.3f}  "
                  f"pose {shares[3]:.3f}   usable {np.mean([r[6] >= 0.01 for r in some]):.3f}")  # fmt: skip


def lengths(size: int, seed: int) -> None:
    """Anchors from lengths alone, poses unknown: how often found, how often silently wrong."""
    rng = np.random.default_rng(seed)
    found_, wrong, said, made = 0, 0, 0, 0
    while made < size:
        kind = POINTS[made % 2]
        one = case(kind, "poses unknown", rng, 24, tensions=False)
        if one is None:
            continue
        made += 1
        with np.errstate(all="ignore"):
            found = best(one.told, one.holds, rng)
        s = whole.summarised(found)
        off = np.abs(s.exit_m[0] - one.exit_m) / s.exit_m[1]
        ok = found.converged and whole.trust(found) >= 0.01
        good = bool((off < 4).all())
        before = one.told.errors.exit_m
        print(kind, "ok" if ok else "refused", f"worst {off.max():.1f} sd; sd {np.median(s.exit_m[1]) / before:.2f} of "
              f"before; error {np.sqrt(np.mean((s.exit_m[0] - one.exit_m) ** 2)) / before:.2f}; between anchors "
              f"{_between(s.exit_m[0], one.exit_m) / before:.2f}", found.noise)  # fmt: skip
        found_ += ok and good
        wrong += ok and not good
        said += not ok
    print(f"{made} robots: found {found_}, silently wrong {wrong}, refused {said}")


def _between(a: np.ndarray, b: np.ndarray) -> float:
    def apart(x: np.ndarray) -> np.ndarray:
        return np.linalg.norm(x[:, None] - x, axis=-1)[np.triu_indices(len(x), 1)]

    return float(np.sqrt(np.mean((apart(a) - apart(b)) ** 2)))


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("what", choices=["coverage", "lengths"])
    parser.add_argument("size", type=int, default=200, nargs="?")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    {"coverage": coverage, "lengths": lengths}[given.what](given.size, given.seed)
