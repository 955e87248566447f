"""Are posteriors as wide as a plan says? Planned widths against those of simulated tests, fitted by sampling.

``python -m analyses.plan_widths --output out/plan-widths``: for each of three protocols a guess, its plan, and tests
drawn from the guess, simulated and fitted by the sampler. For each parameter it prints the planned mean length of the
90 % interval over the mean of the fits'. The plan is asked at the same truths, with noise of its own, so the standard
error in brackets, from the scatter of the fits' lengths, is more than its own. Behind it stands the ratio of the
median standard deviations, which the one test in twenty that hardly tells creep from time does not move.
"""

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from wirebayes.inference.fit import fit, seed_of
from wirebayes.inference.policy import Policy
from wirebayes.io.run_folder import write_json
from wirebayes.model.problem import build, with_readings
from wirebayes.model.replicate import readings
from wirebayes.planning.widths import at_centre, expected_widths
from wirebayes.simulation.synthetic import Bench
from wirebayes.workers import as_finished, processes

POLICY = Policy(ensembles=2, walkers=64, ess=600, rounds=3, most_rounds=5, round_draws=2048, block=32, most_steps=200,
                r_hat=1.05)  # fmt: skip
PROTOCOLS = {
    "paper": Bench("paper", displacements_mm=tuple(range(1, 13))),
    "short": Bench("short", length_mm=600.0, displacements_mm=(0.5, 1.5, 3, 4, 5), times_s=(0.0, 15.0, 40.0)),
    "unloading": Bench(
        "unloading", displacements_mm=(1, 2, 4, 6, 8, 10, 7, 4, 2), times_s=(0.0, 10.0, 30.0, 100.0, 300.0, 600.0)
    ),
}
REPEATS = 2  # planned tests for each truth
CREEP = ("creep_longest_hold_mm", "creep_1h_mm")


def guess(n: int, length_mm: float, rng: np.random.Generator) -> dict[str, Any]:
    """What somebody knows who has tested a similar line: 10 to 50 %."""
    about = {
        "k1": stats.lognorm(0.3, scale=1500.0), "B": stats.lognorm(0.4, scale=3e-4 * length_mm),
        "U": stats.lognorm(0.2, scale=0.6), "k2": stats.lognorm(0.4, scale=0.03), "N": stats.lognorm(0.15, scale=0.7),
        "preload": stats.norm(0.5, 0.3), "sensor_sd": stats.lognorm(0.3, scale=0.008),
        "setting_sd": stats.lognorm(0.4, scale=0.015),
    }  # fmt: skip
    return {name: d.rvs(n, random_state=rng) for name, d in about.items()}


def fitted(task: tuple[str, int]) -> dict[str, float]:
    """Lengths of the 90 % intervals, and standard deviations, of one simulated test of a protocol."""
    name, number = task
    test, truth = planned(name, seed_of(0, name, "truth", str(number)), 1)
    rng = np.random.default_rng(seed_of(0, name, "noise", str(number)))
    problem = build([test])
    theta = np.column_stack([truth[column] for column in problem.names])
    problem = with_readings(problem, [readings(problem, theta, s, rng) for s in problem.samples])
    done = fit(problem, seed_of(0, name, "fit", str(number)), policy=POLICY)
    low, high = np.quantile(done.flat, [0.05, 0.95], axis=0)
    widths = dict(zip(problem.names, (high - low).tolist(), strict=True))
    sds = {f"{c} sd": float(v) for c, v in zip(problem.names, done.flat.std(axis=0), strict=True)}
    return widths | sds | {"converged": float(done.chains.converged)}


def planned(name: str, seed: int, n: int) -> tuple[Any, dict[str, Any]]:
    """The test at the centre of the guess, and draws of the guess."""
    bench = PROTOCOLS[name]
    centre = guess(4000, bench.length_mm, np.random.default_rng(0))
    test = at_centre(bench.experiment(), centre, "hooke", "saturating")
    return replace(test, source=Path("plan")), guess(n, bench.length_mm, np.random.default_rng(seed))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=Path("out/plan-widths"))
    parser.add_argument("--tests", type=int, default=120, help="simulated and sampled, of each protocol")
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    result: dict[str, Any] = {}
    with processes(options.workers) as pool:
        for name in PROTOCOLS:
            truths = [planned(name, seed_of(0, name, "truth", str(i)), 1) for i in range(options.tests)]
            draws = {c: np.tile(np.concatenate([t[c] for _, t in truths]), REPEATS) for c in truths[0][1]}
            plan = expected_widths(truths[0][0], draws, np.random.default_rng(2))
            work = [(i, (name, i)) for i in range(options.tests)]
            rows = [future.result() for _, future in as_finished(pool, fitted, work)]
            kept = [row for row in rows if row["converged"]]
            ratios = {}
            for column in (c for c in plan.widths if c not in CREEP):
                real = np.array([row[column] for row in kept])
                ratio = plan.widths[column]["width_90"] / real.mean()
                middle = plan.widths[column]["sd_median"] / np.median([row[f"{column} sd"] for row in kept])
                error = ratio * real.std(ddof=1) / np.sqrt(len(real)) / real.mean()
                ratios[column] = {"planned": plan.widths[column]["width_90"], "fits": float(real.mean()),
                                  "ratio": float(ratio), "se": float(error),
                                  "ratio_of_median_sds": float(middle)}  # fmt: skip
            result[name] = {"fits": len(kept), "not_converged": len(rows) - len(kept), "ratios": ratios}
            line = ", ".join(
                f"{c} {r['ratio']:.2f} ({r['se']:.2f}), {r['ratio_of_median_sds']:.2f}" for c, r in ratios.items()
            )
            print(f"{name}: {len(kept)} fits, {len(rows) - len(kept)} not converged: {line}", flush=True)
    write_json(options.output / "plan-widths.json", result)
    far = [r for p in result.values() for r in p["ratios"].values() if abs(r["ratio"] - 1.0) > 0.15]
    print(f"{len(far)} of {sum(len(p['ratios']) for p in result.values())} widths farther than 15 % from the fits'")
    return 0


if __name__ == "__main__":
    sys.exit(main())
