"""Calibration of whole robots drawn at random: do 90 % intervals hold the truth, and are anchors found from lengths?

A robot stands at poses with tensions drawn anew for each; its anchors, reference lengths, wires and specimens are off
from what the estimator is told, and its encoders read the true lengths with an error that it is not told. Sessions come
from the forward statics with creep (`predicted.predict_session`), which the estimator does not use.

    python -m analyses.robots.whole_calibration coverage 200
    python -m analyses.robots.whole_calibration exact 120
    python -m analyses.robots.whole_calibration lengths 100
    python -m analyses.robots.whole_calibration marks 60
    python -m analyses.robots.whole_calibration sensors 60

With ``--rows FILE`` every robot's row is kept as soon as it is there, rows of earlier runs are counted too, and a run
that was stopped goes on with another seed.
"""

import argparse
import json
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import beta, chi2, ncx2

from tests.robot import drawn
from wirebayes.robot.mechanics import rotation
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.tensions import nearest
from wirebayes.robot.motion import inverse
from wirebayes.robot.self_calibration import (
    answer,
    descent,
    equations,
    holds_creep,
    posterior,
    predicted,
    residuals,
    session,
)
from wirebayes.robot.self_calibration.identified import identified
from wirebayes.robot.self_calibration.linearisation import linearised
from wirebayes.robot.self_calibration.search import StatedPoses
from wirebayes.robot.self_calibration.seeds import best
from wirebayes.robot.self_calibration.summary import Moment, summarised
from wirebayes.robot.self_calibration.trust import SIGNIFICANT
from wirebayes.robot.self_calibration.unknowns import StatedErrors, Unknowns

MODES = ("poses known", "poses roughly known", "poses unknown", "some poses")
POINTS = ("point-4", "point-5")
MARKS = "six marks"
MARK = 1e-4  # of the span: half a millimetre of 5 m, as a nozzle meets a mark
SENSED = ("point-4", "point-5", "body-7", "body-8")
BIAS = 10  # standard errors of a tension reading
ENCODERS = (1e-5, 1e-4)  # error of a length over the span: .05 to .5 mm of 5 m
OFF = (1e-4, 1e-2)  # of the span, .5 to 50 mm of 5 m: how far anchors are off that are held exact
FEW = 8  # stops where poses are requests and all else is exact
SEEN = 0.99  # power from which wrong anchors are to be seen


@dataclass
class Case:
    """A drawn robot, what is told about it, its readings, and the truth."""

    told: Unknowns
    holds: equations.Holds
    exit_m: np.ndarray
    reference_m: np.ndarray
    length_m: np.ndarray
    position_m: np.ndarray
    rotation: np.ndarray
    pull_N: np.ndarray


def case(
    kind: str, mode: str, rng: np.random.Generator, anchor: float, stops: int, tensions: bool, encoder: float
) -> Case | None:
    """One robot whose anchors and encoders are off by shares of its span.

    None where nothing holds its platform often enough.
    """
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
    log = visited(commanded, prior, values, rng, stops, 0.5 if tensions else 1.0)
    if log is None:
        return None
    with np.errstate(all="ignore"):
        real = predicted.predict_session(true, prior, log, values)
    if not real.solved[0] or not np.isfinite(real.readings).all():
        return None
    pull_N = real.readings[0].reshape(stops, robot.legs) * log.tension_sd_N
    tension = np.maximum(pull_N + rng.normal(size=pull_N.shape) * log.tension_sd_N, 0.0)
    tension = tension if tensions else np.full_like(pull_N, np.nan)
    position, turn = real.position_m[0].copy(), real.rotation[0].copy()
    pose_sd = span * {"poses roughly known": 1e-3, MARKS: MARK}.get(mode, 0.0)
    position += pose_sd * rng.normal(size=position.shape)
    if robot.degrees == 6 and pose_sd:
        turn = turn @ rotation.matrix(pose_sd / robot.size_m * rng.normal(size=position.shape))
    stop = np.arange(stops)
    unknown = {"poses unknown": stop >= 0, "some poses": stop >= 5, MARKS: stop >= 6}.get(mode)
    if unknown is not None:
        position[unknown], turn[unknown] = np.nan, np.nan
    told = Unknowns(robot, prior, StatedErrors(exit_m=anchor * span, pose_m=pose_sd))
    read = log.joint_m + span * encoder * rng.normal(size=log.joint_m.shape)
    log = replace(log, position_m=position, rotation=turn, joint_m=read, read=np.full(stops, tensions))
    return Case(
        told,
        equations.Holds(log, tension),
        true.exit_m,
        values[0, : robot.legs],
        real.length_m[0],
        real.position_m[0],
        real.rotation[0],
        pull_N,
    )


def visited(
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


@dataclass(frozen=True)
class Asked:
    """What kind of robot to draw, and how far what is told of it is off, over its span."""

    kind: str
    mode: str
    anchor: float
    encoder: float
    stops: int = 20


def _cases(
    size: int, rng: np.random.Generator, of: Callable[[int], Asked], tensions: bool
) -> Iterator[tuple[Asked, Case]]:
    made = 0
    while made < size:
        asked = of(made)
        one = case(asked.kind, asked.mode, rng, asked.anchor, asked.stops, tensions, asked.encoder)
        if one is not None:
            made += 1
            yield asked, one


def _verdict(found: posterior.RobotPosterior) -> bool:
    seen = identified(found)
    return found.converged and residuals.trust(found) >= SIGNIFICANT and (seen.determined > 0 or seen.of == 0)


def _inside(known: Moment, truth: np.ndarray, exact: float = 0.0) -> float:
    """Share of the 90 % intervals that hold the truth."""
    return float((np.abs(known.mean - truth) <= known.half * known.sd + exact).mean())


def _share(good: list[bool]) -> dict[str, Any]:
    """A share with its 95 % interval (Clopper-Pearson)."""
    k, n = sum(good), len(good)
    low = float(beta.ppf(0.025, k, n - k + 1)) if k else 0.0
    high = float(beta.ppf(0.975, k + 1, n - k)) if k < n else 1.0
    return {"of": n, "share": k / n if n else float("nan"), "low": low, "high": high}


def coverage(size: int, seed: int) -> Iterator[dict[str, Any]]:
    """Whether 90 % intervals hold the truth, by kind of robot and by what is known of its poses."""
    rng = np.random.default_rng(seed)

    def of(made: int) -> Asked:
        kind, mode = drawn.KINDS[(made + seed) % len(drawn.KINDS)], MODES[(made + seed // 2) % len(MODES)]
        return Asked(kind, mode, (2e-3, 1e-2)[made % 2], float(rng.choice(ENCODERS)))

    for asked, one in _cases(size, rng, of, True):
        begun = time.process_time()
        with np.errstate(all="ignore"):
            found = best(one.told, one.holds, rng.spawn(1)[0])
        row = {"kind": asked.kind, "mode": asked.mode, "anchor": asked.anchor, "seconds": time.process_time() - begun}
        yield row | {"converged": bool(found.converged), "usable": bool(_verdict(found))} | _held(found, one)


def coverage_of(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Shares of 90 % intervals that hold the truth."""
    shares = {
        name: _shares([r for r in rows if name in (r["mode"], r["kind"], "all")])
        for name in ("all", *MODES, *drawn.KINDS)
    }
    return {"median_seconds_each": float(np.median([r["seconds"] for r in rows])), "shares": shares}


def _shares(rows: list[dict[str, Any]]) -> dict[str, float]:
    out: dict[str, float] = {"robots": len(rows)}
    if not rows:
        return out
    for name in ("converged", "usable"):
        share = _share([r[name] for r in rows])
        out |= {name: share["share"], f"{name}_low": share["low"], f"{name}_high": share["high"]}
    for name in ("exit_points", "references", "lengths", "poses"):
        held = np.array([r[name] for r in rows if r["converged"]] or [np.nan])
        out |= {name: float(held.mean()), f"{name}_se": float(held.std() / np.sqrt(len(held)))}
    return out


def exact(size: int, seed: int) -> Iterator[dict[str, Any]]:
    """Whether anchors that are held exact are usable, each robot with right ones or with wrong ones.

    Joint values are exact, or their error is stated as it is; the answer is that of ``calibrate``.
    """
    rng = np.random.default_rng(seed)

    def of(made: int) -> Asked:
        off = float(np.exp(rng.uniform(*np.log(OFF)))) if made % 2 else 0.0
        kind, mode = drawn.KINDS[(made // 2 + seed) % len(drawn.KINDS)], MODES[made // 6 % len(MODES)]
        encoder = (0.0, *ENCODERS)[made // 2 % 3]
        return Asked(kind, mode, off, encoder, FEW if mode == MODES[0] and encoder == 0 else 20)

    for asked, one in _cases(size, rng, of, True):
        begun = time.process_time()
        robot, log = one.told.robot, one.holds.session
        errors = replace(one.told.errors, exit_m=0.0, joint_m=asked.encoder * robot.span_m)
        readings = (one.holds.tension_N / log.tension_sd_N).ravel()
        with np.errstate(all="ignore"):
            poses = StatedPoses.REQUESTED if asked.stops == FEW else StatedPoses.MEASURED
            found = answer.calibration_report(robot, one.told.prior, errors, log, readings, seed, poses, 0).content
            power = _power(one, errors, log.without_poses() if asked.stops == FEW else log) if asked.anchor else 0.0
        yield {
            "kind": asked.kind,
            "mode": asked.mode,
            "anchor": asked.anchor,
            "encoder": asked.encoder,
            "power": power,
            "usable": bool(found["usable"]),
            "converged": bool(found["with_creep_model"]["converged"]),
            "p": float(found["with_creep_model"]["p_joint"]),
            "seconds": time.process_time() - begun,
        }


def _power(one: Case, errors: StatedErrors, log: session.Session) -> float:
    """Power of a chi-squared test of all readings that knows every error, at the level of the verdict.

    Its non-centrality is what the anchors' shift adds to the least sum of squares, by the slopes at the truth.
    """
    unit = 1e-3 * one.told.robot.span_m
    shift = ((one.exit_m - one.told.robot.exit_m) / unit).ravel()
    free = Unknowns(one.told.robot, one.told.prior, replace(errors, exit_m=unit))
    white = np.zeros(free.count)
    white[free.slices["exit"]] = shift
    state = equations.State(white, one.position_m, one.rotation, one.pull_N)
    holds = replace(one.holds, session=log)
    creep = holds_creep.creep_of(free, holds, state)
    noise = equations.Noise(
        max(errors.joint_m or 0.0, equations.EXACT * one.told.robot.span_m),
        equations.FRICTIONLESS,
        1.0,
        0.0,
        1e-3 * one.told.robot.rule.lowest_N,
    )
    e = linearised(free, holds, noise, state, creep, state)
    covariance = np.linalg.inv(descent.eliminated(e, white, 0.0).matrix)
    at = free.slices["exit"]
    information = np.linalg.inv(covariance[at, at]) - np.eye(len(shift))
    count = float(e.known.sum()) - e.by_hold.shape[0] * e.by_hold.shape[2]
    return float(ncx2.sf(chi2.isf(SIGNIFICANT, count), count, max(float(shift @ information @ shift), 0.0)))


def exact_of(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """How often right anchors are usable, and wrong ones are not, by the power of a test that knew the noise."""
    wrong = [r for r in rows if r["anchor"] > 0]
    seen = [r for r in wrong if r["power"] >= SEEN]
    return {
        "usable_where_all_is_right": _share([r["usable"] for r in rows if r["anchor"] == 0]),
        "not_usable_where_power_is_99_percent": _share([not r["usable"] for r in seen]),
        "not_usable_where_it_is_less": _share([not r["usable"] for r in wrong if r["power"] < SEEN]),
        "mean_power_there": float(np.mean([r["power"] for r in wrong if r["power"] < SEEN] or [np.nan])),
        "median_seconds_each": float(np.median([r["seconds"] for r in rows])),
    }


def lengths(size: int, seed: int) -> Iterator[dict[str, Any]]:
    """Anchors from lengths alone, poses unknown."""
    rng = np.random.default_rng(seed)

    def of(made: int) -> Asked:
        return Asked(POINTS[made % 2], "poses unknown", 2e-2, float(rng.choice(ENCODERS)), stops=24)

    for asked, one in _cases(size, rng, of, False):
        begun = time.process_time()
        with np.errstate(all="ignore"):
            found = best(one.told, one.holds, rng.spawn(1)[0])
        s = summarised(found)
        after, before = _between(s.exit_m.mean, one.exit_m), _between(one.told.robot.exit_m, one.exit_m)
        yield {
            "kind": asked.kind,
            "usable": bool(_verdict(found)),
            "seconds": time.process_time() - begun,
            "worst_sd": float((np.abs(s.exit_m.mean - one.exit_m) / s.exit_m.sd).max()),
            "sharper": after / before,
            "sd_over_before": float(np.median(s.exit_m.sd) / one.told.errors.exit_m),
        }


def lengths_of(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """How often anchors were found from lengths alone, and how often silently wrong."""
    usable = [r for r in rows if r["usable"]]
    return {
        "found": _share([r["usable"] and r["worst_sd"] < 4 for r in rows]),
        "silently_wrong": _share([r["usable"] and not r["worst_sd"] < 4 for r in rows]),
        "refused": _share([not r["usable"] for r in rows]),
        "distance_error_over_before": float(np.median([r["sharper"] for r in usable] or [np.nan])),
        "sd_over_before": float(np.median([r["sd_over_before"] for r in usable] or [np.nan])),
        "median_seconds_each": float(np.median([r["seconds"] for r in rows])),
    }


def marks(size: int, seed: int) -> Iterator[dict[str, Any]]:
    """Anchors from six marks at known places and stops at unknown ones, lengths alone."""
    rng = np.random.default_rng(seed)

    def of(made: int) -> Asked:
        return Asked(POINTS[made % 2], MARKS, 2e-3, float(rng.choice(ENCODERS)), stops=30)

    for asked, one in _cases(size, rng, of, False):
        begun = time.process_time()
        with np.errstate(all="ignore"):
            found = best(one.told, one.holds, rng.spawn(1)[0])
        yield {
            "kind": asked.kind,
            "mode": asked.mode,
            "seconds": time.process_time() - begun,
            "converged": bool(found.converged),
            "usable": bool(_verdict(found)),
            **_held(found, one),
        }


def sensors(size: int, seed: int) -> Iterator[dict[str, Any]]:
    """Which tension sensor is named, where one is off by many standard errors of a reading, and where none is."""
    rng = np.random.default_rng(seed)

    def of(made: int) -> Asked:
        return Asked(SENSED[made // 2 % len(SENSED)], MODES[1], 2e-3, float(rng.choice(ENCODERS)))

    for made, (asked, one) in enumerate(_cases(size, rng, of, True)):
        robot, log = one.told.robot, one.holds.session
        off = np.zeros(robot.legs)
        if made % 2:
            off[rng.integers(robot.legs)] = BIAS * log.tension_sd_N
        readings = ((one.holds.tension_N + off) / log.tension_sd_N).ravel()
        begun = time.process_time()
        with np.errstate(all="ignore"):
            told = one.told
            found = answer.calibration_report(robot, told.prior, told.errors, log, readings, seed, visits=0).content
        said = found["sensors_at_fault"]
        yield {
            "kind": asked.kind,
            "bad": (np.flatnonzero(off) + 1).tolist(),
            "usable": bool(found["usable"]),
            "named": said["wires"] if said else [],
            "seconds": time.process_time() - begun,
        }


def sensors_of(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """How often the bad sensor is named alone or among others, and how often one is named that is not bad."""
    bad = [r for r in rows if r["bad"]]
    return {
        "named_alone": _share([r["named"] == r["bad"] for r in bad]),
        "named_among_others": _share([set(r["bad"]) <= set(r["named"]) for r in bad]),
        "usable_all_the_same": _share([r["usable"] for r in bad]),
        "named_where_none_is_bad": _share([bool(r["named"]) for r in rows if not r["bad"]]),
        "median_seconds_each": float(np.median([r["seconds"] for r in rows])),
    }


def _held(found: posterior.RobotPosterior, one: Case) -> dict[str, float]:
    """Shares of the 90 % intervals that hold the truth; none where nothing was found."""
    if not found.converged:
        return {}
    s, exact = summarised(found), 1e-6 * one.told.robot.span_m
    return {
        "exit_points": _inside(s.exit_m, one.exit_m),
        "references": _inside(s.reference_m, one.reference_m),
        "lengths": _inside(s.length_m, one.length_m),
        "poses": _inside(s.position_m, one.position_m, exact),
    }


def marks_of(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Shares of 90 % intervals that hold the truth, of all sessions that converged and of those called usable."""
    return {
        "median_seconds_each": float(np.median([r["seconds"] for r in rows])),
        "all": _shares(rows),
        "usable": _shares([r for r in rows if r["usable"]]),
    }


def _between(a: np.ndarray, b: np.ndarray) -> float:
    """Root mean square by which distances between anchors differ: free of where the whole robot stands."""

    def apart(x: np.ndarray) -> np.ndarray:
        return np.linalg.norm(x[:, None] - x, axis=-1)[np.triu_indices(len(x), 1)]

    return float(np.sqrt(np.mean((apart(a) - apart(b)) ** 2)))


STUDIES = {
    "coverage": (coverage, coverage_of),
    "exact": (exact, exact_of),
    "lengths": (lengths, lengths_of),
    "marks": (marks, marks_of),
    "sensors": (sensors, sensors_of),
}

if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("what", choices=STUDIES)
    parser.add_argument("size", type=int, default=200, nargs="?")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--output", type=Path)
    parser.add_argument("--rows", type=Path, help="kept here robot by robot, those of earlier runs counted")
    given = parser.parse_args()
    kept = given.rows
    rows = [json.loads(line) for line in kept.read_text().splitlines()] if kept and kept.is_file() else []
    drawn_robots, summed = STUDIES[given.what]
    for row in drawn_robots(given.size, given.seed):
        rows.append(row)
        if kept:
            with kept.open("a") as file:
                file.write(json.dumps(row) + "\n")
    text = json.dumps({"robots": len(rows)} | summed(rows), indent=1) + "\n"
    print(text)
    if given.output:
        given.output.write_text(text)
