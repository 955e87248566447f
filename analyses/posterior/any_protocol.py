"""Do fits converge, and 90 % intervals hold the truth, whatever the protocol: few holds or many, few readings or many?

``python -m analyses.posterior.any_protocol --output out/any_protocol`` draws 600 tests: 2 to 24 holds of 10 s to a day
with 2 to 24 readings at random times, at displacements (with a way back, with rests) or under weights, each wire from
the prior of its test, slack ones among them.
"""

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from analyses.resumable import records
from wirebayes.inference.fit import fit_problem
from wirebayes.inference.policy import Policy
from wirebayes.io.run_folder import write_json
from wirebayes.simulation.synthetic import Bench, Truth, draw

POLICY = Policy(walkers=64, round_draws=2048, ess=1000.0, most_steps=800)
KINDS = ("steps", "steps and back", "rests", "weights")
SLACK = 0.02  # of the largest reading without noise: with less in a hold, the wire is all but slack there


def bench(rng: np.random.Generator) -> tuple[str, Bench]:
    """The kind of a test, and the test."""
    kind = str(rng.choice(KINDS))
    holds, readings = np.exp(rng.uniform(np.log(2.0), np.log(25.0), 2)).astype(int)
    length = float(10.0 ** rng.uniform(2.0, 4.0))
    duration = 10.0 ** rng.uniform(1.0, 4.9)
    first = float(rng.choice([0.0, 0.01, 0.1])) * duration
    times = np.unique(np.append(first, rng.uniform(first, duration, readings - 1)).round(3))
    if kind == "weights":
        weights = np.linspace(0.1, 1.0, holds) * 10.0 ** rng.uniform(-2.0, 4.0)
        return kind, Bench(weights_N=tuple(weights), times_s=tuple(times), length_mm=length, resolution_mm=0.0)
    strain = 10.0 ** rng.uniform(-3.0, -2.0)
    places = np.cumsum(strain * length / holds * rng.uniform(0.5, 1.5, holds))
    if kind != "steps":
        places = np.append(places, places[-2:0:-2])
    rests = frozenset(rng.choice(np.arange(2, len(places) + 1), len(places) // 4, replace=False).tolist())
    return kind, Bench(
        displacements_mm=tuple(places),
        times_s=tuple(times),
        length_mm=length,
        resolution_N=0.0,
        unrecorded=rests if kind == "rests" else frozenset(),
    )


def case(index: int) -> dict[str, Any]:
    """Whether the fit of a test converges, at which cost, and where each truth stands among the draws."""
    kind, made = bench(np.random.default_rng(index))
    simulated = draw([made], Truth(), index)
    fit = fit_problem(simulated.problem, index, policy=POLICY)
    below = (fit.flat < simulated.theta).mean(axis=0)
    mask = simulated.problem.samples[0].protocol.mask
    clean = simulated.noise_free[0][mask]
    return {
        "index": index,
        "kind": kind,
        "slack": bool(kind != "weights" and clean.min() < SLACK * clean.max()),
        "converged": fit.converged,
        "evaluations": fit.chains.evaluations,
        "below": dict(zip(simulated.problem.names, below.tolist(), strict=True)),
    }


def shares(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """How many there are, and the share of 90 % intervals that hold the truth, by parameter and in all."""
    inside = {name: float(np.mean([0.05 <= row["below"][name] <= 0.95 for row in rows])) for name in rows[0]["below"]}
    return {"tests": len(rows), **inside, "all": float(np.mean(list(inside.values())))}


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """What the study found."""
    converged = [row for row in rows if row["converged"]]
    evaluations = [row["evaluations"] for row in rows]
    taut = [row for row in converged if not row["slack"]]
    groups = {
        "taut throughout": taut,
        **{kind: [row for row in taut if row["kind"] == kind] for kind in KINDS},
        "slack in a hold": [row for row in converged if row["slack"]],
    }
    return {
        "tests": len(rows),
        "not_converged": len(rows) - len(converged),
        "median_evaluations": float(np.median(evaluations)),
        "most_evaluations": max(evaluations),
        "shares": {name: shares(group) for name, group in groups.items() if group},
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tests", type=int, default=600)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--output", type=Path, default=Path("out/any_protocol"))
    options = parser.parse_args()
    cases = [(index,) for index in range(options.tests)]
    rows = records(options.output / "tests.jsonl", case, cases, workers=options.workers)
    found = summary(rows)
    write_json(options.output / "any_protocol.json", found)
    print(found)


if __name__ == "__main__":
    main()
