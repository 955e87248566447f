"""Are posteriors as wide as a plan says? Planned widths against those of simulated tests, fitted by sampling.

``python -m analyses.posterior.plan_widths --output out/plan-widths``: for each of three protocols a guess and its
plan; the tests that the plan simulated are fitted by the sampler. For each parameter it prints the planned length of
the 90 % interval over the fits', both medians over the tests as in a plan, with a standard error by resampling the
tests; then the same for standard deviations.
"""

import argparse
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from wirebayes.inference.fit import fit_problem, seed_of
from wirebayes.inference.policy import Policy
from wirebayes.io.experiment import Experiment
from wirebayes.io.run_folder import write_json
from wirebayes.json_files.plan import ExpectedWidth
from wirebayes.model.build import build
from wirebayes.model.problem import with_readings
from wirebayes.model.replicate import readings
from wirebayes.model.spec import PLAIN_SPEC
from wirebayes.numeric.typing import Array
from wirebayes.planning.guessed_test import at_centre
from wirebayes.planning.widths import expected_widths
from wirebayes.processes.workers import as_finished, processes
from wirebayes.simulation.synthetic import Bench

POLICY = Policy(
    ensembles=2, walkers=64, ess=600, rounds=3, most_rounds=5, round_draws=2048, block=32, most_steps=200, r_hat=1.05
)
PROTOCOLS = {
    "paper": Bench("paper", displacements_mm=tuple(range(1, 13))),
    "short": Bench("short", length_mm=600.0, displacements_mm=(0.5, 1.5, 3, 4, 5), times_s=(0.0, 15.0, 40.0)),
    "unloading": Bench(
        "unloading", displacements_mm=(1, 2, 4, 6, 8, 10, 7, 4, 2), times_s=(0.0, 10.0, 30.0, 100.0, 300.0, 600.0)
    ),
}
SEED = 2  # of the plans
CREEP = ("creep_longest_hold_mm", "creep_1h_mm")


def guess(n: int, length_mm: float, rng: np.random.Generator) -> dict[str, Any]:
    """What somebody knows who has tested a similar line: 10 to 50 %."""
    about = {
        "k1": stats.lognorm(0.3, scale=1500.0),
        "B": stats.lognorm(0.4, scale=3e-4 * length_mm),
        "U": stats.lognorm(0.2, scale=0.6),
        "k2": stats.lognorm(0.4, scale=0.03),
        "N": stats.lognorm(0.15, scale=0.7),
        "preload": stats.norm(0.5, 0.3),
        "sensor_sd": stats.lognorm(0.3, scale=0.008),
        "setting_sd": stats.lognorm(0.4, scale=0.015),
    }
    return {name: d.rvs(n, random_state=rng) for name, d in about.items()}


def fitted(task: tuple[str, int, Array]) -> dict[str, float]:
    """Lengths of the 90 % intervals, and standard deviations, of the posterior of one simulated test of a protocol."""
    name, number, measured = task
    test, _ = planned(name, seed_of(0, name, "truth", str(number)), 1)
    problem = with_readings(build([test]), [measured[..., None]])
    done = fit_problem(problem, seed_of(0, name, "fit", str(number)), policy=POLICY)
    low, high = np.quantile(done.flat, [0.05, 0.95], axis=0)
    widths = dict(zip(problem.names, (high - low).tolist(), strict=True))
    sds = {f"{c} sd": float(v) for c, v in zip(problem.names, done.flat.std(axis=0), strict=True)}
    return widths | sds | {"test": float(number), "converged": float(done.chains.converged)}


def planned(name: str, seed: int, n: int) -> tuple[Any, dict[str, Any]]:
    """The test at the centre of the guess, and draws of the guess."""
    bench = PROTOCOLS[name]
    centre = guess(4000, bench.length_mm, np.random.default_rng(0))
    test = at_centre(bench.experiment(), centre, PLAIN_SPEC)
    return replace(test, source=Path("plan")), guess(n, bench.length_mm, np.random.default_rng(seed))


def simulated(test: Experiment, draws: Mapping[str, Array], seed: int) -> Array:
    """(H, R, n) readings of the tests that a plan with this seed simulates: its generator draws them first."""
    problem = build([test])
    truth = np.column_stack([draws[name] for name in problem.names])
    return readings(problem, truth, problem.samples[0], np.random.default_rng(seed))


def compared(planned: ExpectedWidth, lengths: Array, sds: Array) -> dict[str, float]:
    """Planned over found, of the figures that a plan shows; the error from 2,000 resamplings of the fits."""
    rng = np.random.default_rng(0)
    again = np.median(lengths[rng.integers(len(lengths), size=(2000, len(lengths)))], axis=1)
    ratio = planned["width_90"] / np.median(lengths)
    return {
        "planned": planned["width_90"],
        "fits": float(np.median(lengths)),
        "ratio": float(ratio),
        "se": float(ratio * again.std() / np.median(lengths)),
        "ratio_of_sds": float(planned["sd"] / np.median(sds)),
    }


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
            draws = {c: np.concatenate([t[c] for _, t in truths]) for c in truths[0][1]}
            plan = expected_widths(truths[0][0], draws, np.random.default_rng(SEED))
            measured = simulated(truths[0][0], draws, SEED)
            work = [(i, (name, i, measured[..., i])) for i in range(options.tests)]
            rows = [future.result() for _, future in as_finished(pool, fitted, work)]
            kept = [row for row in rows if row["converged"]]
            ratios = {}
            for column in (c for c in plan.widths if c not in CREEP):
                lengths, sds = (np.array([row[key] for row in kept]) for key in (column, f"{column} sd"))
                ratios[column] = compared(plan.widths[column], lengths, sds)
            result[name] = {"fits": len(kept), "not_converged": len(rows) - len(kept), "ratios": ratios}
            line = ", ".join(
                f"{c} {r['ratio']:.2f} ({r['se']:.2f}), {r['ratio_of_sds']:.2f}" for c, r in ratios.items()
            )
            print(f"{name}: {len(kept)} fits, {len(rows) - len(kept)} not converged: {line}", flush=True)
    write_json(options.output / "plan-widths.json", result)
    each = [r[key] for p in result.values() for r in p["ratios"].values() for key in ("ratio", "ratio_of_sds")]
    print(f"{sum(abs(r - 1.0) > 0.15 for r in each)} of {len(each)} figures farther than 15 % from the fits'")
    return 0


if __name__ == "__main__":
    sys.exit(main())
