"""Do the 90 % bands of `pose --joints` hold the truth, with joint values alone and with tensions and angles?

Every truth is a robot of its own: reference lengths, the line's parameters and each specimen drawn from the prior, then
followed through the same history as the estimate (three stops, a quarter of an hour in all). Sensors are of two kinds,
by turns: "fresh" errors differ from reading to reading, "kept" ones share half their variance through the history. A
band goes from rank to rank of the draws, so that its own draws make it neither too wide nor too narrow. A line a truth
is written, so that a run goes on where it ended; intervals are of independent truths.

    python -m analyses.robots.history_coverage --truths 60 --output out/history-coverage
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from analyses.options import study_options
from analyses.resumable import records
from wirebayes.inference.fit import seed_of
from wirebayes.numeric.typing import Floats
from wirebayes.robot.history.estimate import estimate_poses
from wirebayes.robot.history.follow import clock_starts, follow_log
from wirebayes.robot.history.history import History, roll_and_pitch
from wirebayes.robot.history.unknowns import Uncertain, unknowns
from wirebayes.robot.mechanics import schema
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.draws import WireDraws
from wirebayes.robot.motion import inverse

MEANS = {"k1": 800.0, "B": 0.3, "U": 0.8, "k2": 0.03, "N": 0.64}  # a thin braided line
TIMES_S = (0.0, 60.0, 70.0, 400.0, 420.0, 900.0)
HOLDS = (1, 1, 2, 2, 3, 3)
ERRORS = Uncertain(1e-3, 0.05, 0.02, 5e-4)
ROBOTS = ("hangprinter-4", "linear-7", "cogiro-desk")
SENSORS = ("fresh", "kept")


def line(draws: int, rng: np.random.Generator) -> WireDraws:
    """A made-up posterior: five per cent in every parameter."""
    return WireDraws({k: v * np.exp(0.05 * rng.standard_normal(draws)) for k, v in MEANS.items()}, 1000.0)


def history(robot: Robot) -> History:
    """Joint values of a controller that knows the mean wire and no creep."""
    away = robot.home_m + 0.05 * robot.span_m * np.array([1.0, 0.3, 0.5])
    places = np.array([robot.home_m, away])[[0, 0, 1, 1, 0, 0]]
    level = np.broadcast_to(np.eye(3), (len(places), 3, 3))
    plain = unknowns(robot, line(2000, np.random.default_rng(0)), ERRORS, np.random.default_rng(0)).plain
    joint = inverse.commands(robot, plain, places, level, inverse.tensions(robot, places, level)).joint_m
    rows = len(TIMES_S)
    return History(np.array(TIMES_S), joint, None, None, np.zeros(rows), np.zeros((rows, 3)), np.array(HOLDS))


def errors_of(kind: str, sd: float, shape: tuple[int, ...], rng: np.random.Generator) -> Floats:
    """Errors of readings ``(t, m)``, whose standard deviation is `sd` with both kinds of sensors."""
    if kind == "fresh":
        return sd * rng.standard_normal(shape)
    return sd * np.sqrt(0.5) * (rng.standard_normal(shape) + rng.standard_normal(shape[1:]))


def case(name: str, index: int, draws: int) -> dict[str, Any]:
    """One truth: where it lies among the draws from joint values alone and among those with readings."""
    robot = schema.read_robot_file(name)
    moves, start = history(robot), (robot.home_m, np.eye(3))
    seed = seed_of(11, "history coverage", name, str(index))
    rng = np.random.default_rng(seed)
    known = line(draws, rng)
    truths = unknowns(robot, line(2, rng), ERRORS, rng)
    wires, error = truths.columns(truths.draws)
    assert moves.joint_m is not None
    starts = clock_starts(moves, np.ones((len(TIMES_S), robot.legs)))
    true = follow_log(robot, wires, moves, moves.joint_m, start, starts, error)
    place, turn, tau = true.position_m[0], roll_and_pitch(true.rotation[0]), true.tension_N[0]
    out: dict[str, Any] = {"robot": name, "index": index, "draws": draws}
    out["sensors"] = kind = SENSORS[index // len(ROBOTS) % len(SENSORS)]
    for key in ("joints", "readings"):
        read = moves
        if key == "readings":
            read = replace(
                moves,
                tension_N=tau + errors_of(kind, ERRORS.tension_N, tau.shape, rng),
                tilt_rad=turn + errors_of(kind, ERRORS.tilt_rad, turn.shape, rng),
            )
        found = estimate_poses(robot, known, read, start, ERRORS, np.random.default_rng(seed))
        seen = found.track.position_m
        low, high = np.nanquantile(seen, [0.05, 0.95], axis=0, method="weibull")
        out[key] = {
            "inside": ((low <= place) & (place <= high)).tolist(),
            "rank": (seen < place).mean(0).tolist(),
            "deviation": ((place - np.nanmean(seen, 0)) / np.nanstd(seen, 0)).tolist(),
            "sd_mm": (1e3 * np.nanstd(seen, 0)).tolist(),
            "misfit": found.misfit,
            "converged": found.converged,
            "effective": found.effective,
        }
    return out


def share(records: Sequence[dict[str, Any]], key: str) -> str:
    """Share of rows and coordinates inside their bands, with a 95 % interval over truths."""
    inside = np.array([np.mean(r[key]["inside"]) for r in records])
    spread = np.array([np.mean(np.square(r[key]["deviation"])) for r in records])
    interval = 196 * inside.std(ddof=1) / len(inside) ** 0.5
    return f"{key:8} {100 * inside.mean():5.1f} % ± {interval:.1f}, rms deviation {np.sqrt(np.mean(spread)):.2f} sd"


def table(records: Sequence[dict[str, Any]]) -> str:
    """Coverage by robot and kind of sensor."""
    lines = []
    for name in (*ROBOTS, *SENSORS, "all"):
        own = [r for r in records if name in (r["robot"], r["sensors"], "all")]
        if len(own) > 1:
            lines += [f"{name:14} {len(own):3} truths, {share(own, key)}" for key in ("joints", "readings")]
    narrower = [np.mean(r["readings"]["sd_mm"]) / np.mean(r["joints"]["sd_mm"]) for r in records]
    effective = [r["readings"]["effective"] / r["draws"] for r in records]
    lines.append(f"readings narrow the bands to {np.median(narrower):.2f} of their width")
    lines.append(f"effective share of the draws: median {np.median(effective):.2f}, least {min(effective):.2f}")
    return "\n".join(lines)


def main() -> None:
    """Run what is not done yet, a line a truth, and print the table."""
    options = study_options(
        __doc__, truths=(60, "in all, the robots in turn"), draws=200, output=Path("out/history-coverage")
    ).parse_args()
    cases = [(ROBOTS[index % len(ROBOTS)], index, options.draws) for index in range(options.truths)]
    print(table(records(options.output / "truths.jsonl", case, cases, ("robot", "index", "draws"))))


if __name__ == "__main__":
    main()
