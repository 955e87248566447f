"""Do a robot's bands hold the truth, from the true wire through a bench test and its fit to the drift?

Every wire has parameters and a bench protocol of its own, and is tested by the generator of `analyses.hidden_effects`,
which shares no code with the package. `fit` sees its files; the drift of three robots, their platforms as heavy as the
tested tensions allow, is predicted with 90 % bands as `pose` does it, for legs cut from the tested specimen. The true
drift comes from the solver that the tests wrote for themselves: Euler angles, and a stiff integrator on the true creep.
A line a wire is written, so that a run goes on where it ended; coverage is averaged within a wire first.

    python -m analyses.robots.bands --wires 200 --output out/robot-bands
"""

import json
import time
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from analyses.hidden_effects.files import logged_temperature, write_experiments
from analyses.hidden_effects.noise import measure
from analyses.hidden_effects.rig import Rig
from analyses.hidden_effects.truth import draw_rig
from analyses.options import study_options
from analyses.resumable import records
from tests.robot import independent
from wirebayes.commands.wire_draws import read_wires
from wirebayes.inference.fit import seed_of
from wirebayes.inference.policy import Policy
from wirebayes.io.experiment_file import read_experiments
from wirebayes.results.jobs import Job, one
from wirebayes.robot.mechanics import schema
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.draws import for_robot
from wirebayes.robot.motion import claim, drift, inverse

POLICY = Policy(walkers=64, round_draws=2048, ess=1000.0)
PROTOCOLS = ("paper", "unloading", "uneven", "dense")
ROBOTS = ("hangprinter-4", "cogiro-desk", "segesta-8")  # drums: the independent solver knows no pulley blocks
TIMES_S = (60.0, 600.0, 3600.0)
DRAWS = 400


def at_tension(robot: Robot, tension_N: float) -> Robot:
    """The robot with the platform's mass that gives its wires a mean tension at home."""
    tau = inverse.tensions(robot, robot.home_m[None], np.eye(3)[None])
    return claim.scaled_robot(robot, 1.0, robot.mass_kg * tension_N / float(np.mean(tau)))


def true_drift_mm(robot: Robot, rig: Rig) -> list[float]:
    """Distance from the commanded pose at the times, by the independent solver."""
    wire, length = rig.wires["line-a"], rig.benches[0].length_mm
    solver = independent.Rig(robot, "hooke", wire.k1)
    tau = inverse.tensions(robot, robot.home_m[None], np.eye(3)[None])
    start = solver.start(robot.home_m)
    theta = {"B": wire.B, "U": wire.U, "k2": wire.k2, "N": wire.N}
    places, fall = independent.drift(solver, theta, length, solver.zero_for(start, tau), start, TIMES_S)
    distance = 1e3 * np.linalg.norm(solver.place(places)[0] - solver.place(start)[0], axis=1)
    return [float(d) if fall > t else float("nan") for d, t in zip(distance, TIMES_S, strict=True)]


def case(index: int) -> dict[str, Any]:
    """One wire through everything."""
    begun = time.process_time()
    rng = np.random.default_rng(seed_of(17, "robot bands", str(index)))
    rig = draw_rig(rng, PROTOCOLS[index % len(PROTOCOLS)])
    readings = measure(rig, None, rng)
    with TemporaryDirectory() as place:
        path = write_experiments(Path(place), rig, readings, [logged_temperature(b, rng) for b in rig.benches])
        one(Job("fit", tuple(read_experiments(path))), Path(place), index, POLICY)
        summary = json.loads((Path(place) / "fit" / "summary.json").read_text())
        line = read_wires(Path(place) / "fit", DRAWS)
    fitted_s = time.process_time() - begun
    low, high = line.tension_range_N or (1.0, 1.0)
    figures = []
    for name in ROBOTS:
        robot = at_tension(schema.read_robot_file(name), float(np.sqrt(max(low, 0.1) * high)))
        times = np.concatenate([[0.0], TIMES_S])
        course = drift.from_command(robot, for_robot(robot, line), robot.home_m, np.eye(3), times)
        distance = 1e3 * np.linalg.norm(course.position_m[:, 1:] - robot.home_m, axis=-1)
        for i, true in enumerate(true_drift_mm(robot, rig)):
            band = np.nanquantile(distance[:, i], [0.05, 0.5, 0.95]).tolist()
            rank = float(np.mean(distance[np.isfinite(distance[:, i]), i] < true))
            figures.append(
                {
                    "robot": name,
                    "time_s": TIMES_S[i],
                    "truth_mm": true,
                    "band_mm": band,
                    "rank": rank,
                    "held": float(np.isfinite(distance[:, i]).mean()),
                }
            )
    parameters = summary["parameters"]
    return {
        "index": index,
        "protocol": rig.protocol,
        "longest_hold_s": max(hold.duration_s for hold in rig.benches[0].holds),
        "wire": vars(rig.wires["line-a"]),
        "converged": summary["converged"],
        "r_hat": max(p["r_hat"] for p in parameters.values()),
        "ess": min(p["ess_bulk"] for p in parameters.values()),
        "figures": figures,
        "fit_s": fitted_s,
        "all_s": time.process_time() - begun,
    }


def mean_share(inside: Sequence[Sequence[bool]], of: str) -> str:
    """Share that is inside, in the mean of what is named, with a 95 % interval over these."""
    share = np.array([np.mean(each) for each in inside])
    if len(share) < 2:
        return "–"
    return f"{100 * share.mean():5.1f} % ± {196 * share.std(ddof=1) / len(share) ** 0.5:.1f} ({len(share)} {of})"


def coverage(wires: Sequence[Sequence[dict[str, Any]]]) -> str:
    """Share of bands that hold the truth, with a 95 % interval over wires."""
    held = [[f for f in figures if np.isfinite(f["truth_mm"])] for figures in wires]
    inside = [[f["band_mm"][0] <= f["truth_mm"] <= f["band_mm"][2] for f in fs] for fs in held if fs]
    return mean_share(inside, "wires")


def table(records: Sequence[dict[str, Any]]) -> str:
    """Coverage in all, by robot, time, protocol, and within or beyond the longest tested hold."""
    whole = [r["figures"] for r in records]
    lines = [f"{'all':24} {coverage(whole)}"]
    for name in ROBOTS:
        lines.append(f"{name:24} {coverage([[f for f in fs if f['robot'] == name] for fs in whole])}")
    for time_s in TIMES_S:
        lines.append(f"{f'{time_s:g} s':24} {coverage([[f for f in fs if f['time_s'] == time_s] for fs in whole])}")
    for protocol in PROTOCOLS:
        lines.append(f"{protocol:24} {coverage([r['figures'] for r in records if r['protocol'] == protocol])}")
    for label, tested in (("within the longest hold", True), ("beyond it", False)):
        own = [[f for f in r["figures"] if (f["time_s"] <= r["longest_hold_s"]) == tested] for r in records]
        lines.append(f"{label:24} {coverage(own)}")
    widths = [(f["band_mm"][2] - f["band_mm"][0]) / f["band_mm"][1] for fs in whole for f in fs]
    lines.append(
        f"width of a band by its median: {np.median(widths):.3g} (5 to 95 %: "
        f"{np.quantile(widths, 0.05):.3g} to {np.quantile(widths, 0.95):.3g})"
    )
    away, r_hat = sum(not r["converged"] for r in records), max(r["r_hat"] for r in records)
    fewest, spent = min(r["ess"] for r in records), np.median([r["all_s"] for r in records])
    lines.append(
        f"fits not converged: {away}, largest R-hat {r_hat:.4f}, fewest effective draws {fewest:.0f}, "
        f"{spent:.0f} s a wire"
    )
    return "\n".join(lines)


def main() -> None:
    """Run what is not done yet, a line a wire, and print the table."""
    options = study_options(__doc__, wires=200, output=Path("out/robot-bands")).parse_args()
    print(table(records(options.output / "wires.jsonl", case, [(index,) for index in range(options.wires)])))


if __name__ == "__main__":
    main()
