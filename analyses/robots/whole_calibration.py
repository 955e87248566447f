"""Calibration of whole robots drawn at random: do 90 % intervals hold the truth, and are anchors found from lengths?

A robot stands at poses with tensions drawn anew for each; its anchors, reference lengths, wires and specimens are off
from what the estimator is told, and its encoders read the true lengths with an error that it is not told. Sessions come
from the forward statics with creep (`session.predict`), which the estimator does not use.

    python -m analyses.robots.whole_calibration coverage 200
    python -m analyses.robots.whole_calibration exact 60
    python -m analyses.robots.whole_calibration lengths 100
"""

import argparse
import json
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from tests.robot import drawn
from wirebayes.robot.mechanics import rotation
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.tensions import nearest
from wirebayes.robot.motion import inverse
from wirebayes.robot.self_calibration import equations, session, whole
from wirebayes.robot.self_calibration.identified import identified
from wirebayes.robot.self_calibration.seeds import best
from wirebayes.robot.self_calibration.summary import Moment, summarised
from wirebayes.robot.self_calibration.trust import SIGNIFICANT
from wirebayes.robot.self_calibration.unknowns import StatedErrors, Unknowns

MODES = ("poses known", "poses roughly known", "poses unknown", "some poses")
POINTS = ("point-4", "point-5")
ENCODERS = (1e-5, 1e-4)  # error of a length over the span: .05 to .5 mm of 5 m


@dataclass
class Case:
    """A drawn robot, what is told about it, its readings, and the truth."""

    told: Unknowns
    holds: equations.Holds
    exit_m: np.ndarray
    reference_m: np.ndarray
    length_m: np.ndarray
    position_m: np.ndarray


def case(kind: str, mode: str, rng: np.random.Generator, anchor: float, stops: int, tensions: bool) -> Case | None:
    """One robot whose anchors are off by a share of its span; None where nothing holds its platform often enough."""
    try:
        made = drawn.draw(kind, rng, 200, 0.03)
    except RuntimeError:
        return None
    robot, span = made.robot, made.robot.span_m
    rule = robot.rule
    if not tensions:  # what motors under torque control hold: no more than a few times what carries the platform
        robot = replace(robot, rule=replace(rule, highest_N=0.3 * rule.highest_N))
    true = replace(robot, exit_m=robot.exit_m + anchor * span * rng.normal(size=robot.exit_m.shape))
    prior = session.LengthPrior(made.line, 2e-3 * span)
    mean, cov = prior.moments(robot.legs)
    values = rng.multivariate_normal(mean, cov, 1)
    # two wires off their plane hold no pose that was chosen: commanded for the told robot, they hang where they hang
    commanded = robot if kind == "planar-2" else true
    log = _visited(commanded, prior, values, rng, stops, 0.5 if tensions else 1.0)
    if log is None:
        return None
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
    told = Unknowns(robot, prior, StatedErrors(exit_m=anchor * span, pose_m=pose_sd))
    read = log.joint_m + span * float(rng.choice(ENCODERS)) * rng.normal(size=log.joint_m.shape)
    log = replace(log, position_m=position, rotation=turn, joint_m=read, read=np.full(stops, tensions))
    return Case(told, equations.Holds(log, tension), true.exit_m, values[0, : robot.legs], real.length_m[0],
                real.position_m[0])  # fmt: skip


def _visited(
    robot: Robot, prior: session.LengthPrior, values: np.ndarray, rng: np.random.Generator, stops: int, share: float
) -> session.Session | None:
    """Poses of the true robot, each with tensions near others drawn from a share of the range that its file allows."""
    wires, error = prior.wires(robot, values)
    x = rng.uniform(robot.lower_m, robot.upper_m, (20 * stops, 3))
    R = rotation.matrix(0.1 * rng.normal(size=x.shape) * (robot.degrees == 6))
    lowest, highest = robot.rule.lowest_N, share * robot.rule.highest_N

    def varied(structure: np.ndarray, load: np.ndarray, low: float, high: float) -> np.ndarray | None:
        return nearest(rng.uniform(lowest, highest, robot.legs), structure, load, low, high)

    tau = inverse.tensions(robot, x, R, varied)
    good = np.flatnonzero(np.isfinite(tau).all(1))[:stops]
    if len(good) < stops:
        return None
    each = wires.part(np.zeros(stops, int))
    joint = inverse.commands(robot, each, x[good], R[good], tau[good], 0.0, error.T).joint_m
    held = np.full(stops, 30.0)
    return session.Session(x[good], R[good], joint, held, np.ones(stops, bool), 0.0012 * highest)


def _cases(
    size: int, rng: np.random.Generator, of: Callable[[int], tuple[str, str, float]], stops: int, tensions: bool
) -> Iterator[tuple[str, str, float, Case]]:
    made = 0
    while made < size:
        kind, mode, anchor = of(made)
        one = case(kind, mode, rng, anchor, stops, tensions)
        if one is not None:
            made += 1
            yield kind, mode, anchor, one


def _verdict(found: whole.Whole) -> bool:
    seen = identified(found)
    return found.converged and whole.trust(found) >= SIGNIFICANT and (seen.determined > 0 or seen.of == 0)


def _inside(known: Moment, truth: np.ndarray, exact: float = 0.0) -> float:
    """Share of the 90 % intervals that hold the truth."""
    return float((np.abs(known.mean - truth) <= known.half * known.sd + exact).mean())


def coverage(size: int, seed: int, kept: Path | None) -> dict[str, Any]:
    """Shares of 90 % intervals that hold the truth, by kind of robot and by what is known of its poses.

    Rows of a file that runs with other seeds left are counted too.
    """
    rng = np.random.default_rng(seed)
    rows = [json.loads(line) for line in kept.read_text().splitlines()] if kept and kept.is_file() else []

    def of(made: int) -> tuple[str, str, float]:
        kinds = len(drawn.KINDS)
        return drawn.KINDS[(made + seed) % kinds], MODES[(made + seed // 2) % len(MODES)], (2e-3, 1e-2)[made % 2]

    for kind, mode, anchor, one in _cases(size, rng, of, 20, True):
        begun = time.perf_counter()
        with np.errstate(all="ignore"):
            found = best(one.told, one.holds, rng)
        s = summarised(found)
        row = {"kind": kind, "mode": mode, "anchor": anchor, "seconds": time.perf_counter() - begun}
        row |= {"converged": bool(found.converged), "usable": bool(_verdict(found))}
        if found.converged:
            exact = 1e-6 * one.told.robot.span_m
            row |= {
                "exit_points": _inside(s.exit_m, one.exit_m),
                "references": _inside(s.reference_m, one.reference_m),
                "lengths": _inside(s.length_m, one.length_m),
                "poses": _inside(s.position_m, one.position_m, exact),
            }
        else:
            print("   not converged", kind, mode, anchor, found.noise, found.cost)
        rows.append(row)
        if kept:
            with kept.open("a") as file:
                file.write(json.dumps(row) + "\n")
    shares = {name: _shares([r for r in rows if name in (r["mode"], r["kind"], "all")])
              for name in ("all", *MODES, *drawn.KINDS)}  # fmt: skip
    seconds = float(np.median([r["seconds"] for r in rows]))
    return {"robots": len(rows), "median_seconds_each": seconds, "shares": shares}


def _shares(rows: list[dict[str, Any]]) -> dict[str, float]:
    out: dict[str, float] = {"robots": len(rows)}
    if rows:
        out |= {name: float(np.mean([r[name] for r in rows])) for name in ("converged", "usable")}
        for name in ("exit_points", "references", "lengths", "poses"):
            out[name] = float(np.mean([r[name] for r in rows if r["converged"]] or [np.nan]))
    return out


def exact(size: int, seed: int) -> dict[str, Any]:
    """How often anchors held exact are usable, where they are off by 1 % of the span, and where they are not."""
    rng, out = np.random.default_rng(seed), {}
    for anchor in (1e-2, 0.0):
        usable = []

        def of(made: int, anchor: float = anchor) -> tuple[str, str, float]:
            return drawn.KINDS[made % len(drawn.KINDS)], MODES[made % 2], anchor

        for _, _, _, one in _cases(size, rng, of, 20, True):
            known = replace(one.told.errors, exit_m=0.0, joint_m=1e-4 * one.told.robot.span_m)
            with np.errstate(all="ignore"):
                usable.append(_verdict(best(replace(one.told, errors=known), one.holds, rng)))
        out[f"usable with anchors off by {anchor:g} of the span"] = float(np.mean(usable))
    return out


def lengths(size: int, seed: int) -> dict[str, Any]:
    """Anchors from lengths alone, poses unknown: how often found, how often silently wrong."""
    rng, rows = np.random.default_rng(seed), []

    def of(made: int) -> tuple[str, str, float]:
        return POINTS[made % 2], "poses unknown", 2e-2

    for kind, _, _, one in _cases(size, rng, of, 24, False):
        with np.errstate(all="ignore"):
            found = best(one.told, one.holds, rng)
        s, before = summarised(found), one.told.errors.exit_m
        ok = _verdict(found)
        worst = float((np.abs(s.exit_m.mean - one.exit_m) / s.exit_m.sd).max())
        after = {"anchors": _between(s.exit_m.mean, one.exit_m), "before": _between(one.told.robot.exit_m, one.exit_m)}
        rows.append({"kind": kind, "ok": ok, "good": worst < 4, "sharper": after["anchors"] / after["before"]})
        print(kind, "ok" if ok else "refused", f"worst {worst:.1f} sd; sd {np.median(s.exit_m.sd) / before:.2f} of "
              f"before; between anchors {after['anchors'] / before:.2f} of {after['before'] / before:.2f}; "
              f"converged {found.converged} p {whole.trust(found):.2g} {identified(found).determined}")  # fmt: skip
    accepted = np.array([r["ok"] for r in rows])
    good = np.array([r["good"] for r in rows])
    return {
        "found": float((accepted & good).mean()),
        "silently_wrong": float((accepted & ~good).mean()),
        "refused": float((~accepted).mean()),
        "distance_error_over_before": float(np.median([r["sharper"] for r in rows if r["ok"]] or [np.nan])),
    }


def _between(a: np.ndarray, b: np.ndarray) -> float:
    """Root mean square by which distances between anchors differ: free of where the whole robot stands."""

    def apart(x: np.ndarray) -> np.ndarray:
        return np.linalg.norm(x[:, None] - x, axis=-1)[np.triu_indices(len(x), 1)]

    return float(np.sqrt(np.mean((apart(a) - apart(b)) ** 2)))


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("what", choices=["coverage", "exact", "lengths"])
    parser.add_argument("size", type=int, default=200, nargs="?")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--output", type=Path)
    parser.add_argument("--rows", type=Path, help="coverage: kept here robot by robot, those of earlier runs counted")
    given = parser.parse_args()
    if given.what == "coverage":
        answer = coverage(given.size, given.seed, given.rows)
    else:
        answer = {"exact": exact, "lengths": lengths}[given.what](given.size, given.seed)
    text = json.dumps({"robots": given.size} | answer, indent=1) + "\n"
    print(text)
    if given.output:
        given.output.write_text(text)
