"""Do 90 % intervals hold the truth 90 % of the time, on tests that look nothing like the paper's?

``python -m analyses.posterior.coverage --output out/coverage``: 40 wires drawn from the prior, each with a length,
steps, directions and reading times of its own; the 90 % intervals of the material's parameters, and 90 % bands of the
last third of the holds predicted from the rest.
"""

import argparse
import json
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from analyses.resumable import records
from wirebayes.inference.fit import fit_problem, seed_of
from wirebayes.inference.policy import Policy
from wirebayes.io.run_folder import write_json
from wirebayes.model.hold_filter import Measured
from wirebayes.model.likelihoods import chain, reading_variance
from wirebayes.model.problem import Problem
from wirebayes.model.sample import MATERIAL
from wirebayes.simulation.synthetic import Bench, Simulated, Truth, draw
from wirebayes.wire.staircase import linearise

Array = Any
POLICY = Policy(walkers=64, round_draws=2048, ess=1000.0, most_steps=800)


def bench(rng: np.random.Generator) -> Bench:
    """A test of its own: 0.4 to 3 m, 8 to 14 holds of 0.3 to 2 mm per metre, one in two with a way back."""
    length = float(rng.uniform(400.0, 3000.0))
    count = int(rng.integers(8, 15))
    steps = rng.uniform(0.3, 2.0, count) * length / 1000.0
    if rng.uniform() < 0.5:
        turn = int(rng.integers(count // 2, count - 1))
        steps[turn:] *= -0.6
    times = np.concatenate([[0.0], np.cumsum(rng.uniform(5.0, 80.0, int(rng.integers(3, 9))))]).round(1)
    return Bench("wire", "line", length, 0.01, tuple(np.cumsum(steps).round(3)), tuple(times))


def wire(seed: int) -> Simulated:
    """A simulated test that stays taut and moves by more than its sensor's error."""
    rng = np.random.default_rng(seed)
    while True:
        made = draw([bench(rng)], Truth(), int(rng.integers(2**63)))
        y, mask = made.problem.samples[0].readings[..., 0], made.problem.samples[0].protocol.mask
        if y[mask].min() > 0.1 and y.max() < 100.0:
            return made


def training(made: Simulated) -> tuple[Problem, int]:
    """The problem of the first two thirds of the holds, and how many they are."""
    sample = made.problem.samples[0]
    count = (2 * len(sample.protocol.setting)) // 3
    p = sample.protocol
    cut = replace(
        p,
        setting=p.setting[:count],
        time_s=p.time_s[:count],
        mask=p.mask[:count],
        duration_s=p.duration_s[:count],
        number=p.number[:count],
    )
    return replace(made.problem, samples=(replace(sample, protocol=cut, readings=sample.readings[:count]),)), count


def held_out(made: Simulated, theta: Array, count: int, rng: np.random.Generator) -> Array:
    """(m,) bool: whether each reading of the later holds lies in its 90 % band, given the earlier readings."""
    sample = made.problem.samples[0]
    own = made.problem.parameters(theta, sample)
    variance, setting_sd = reading_variance(own["sensor_sd"], 0.0), own["setting_sd"]
    line = linearise(sample.protocol, own, sample.model)
    seen = sample.protocol.mask.copy()
    seen[count:] = False
    rounded = variance + sample.resolution**2 / 12.0
    state = chain(line, Measured(sample.readings, seen, rounded, setting_sd))
    carried = state.carried_mean[count] + np.sqrt(state.carried_var[count]) * rng.normal(size=len(theta))
    out = []
    for j in range(count, len(seen)):
        setting = setting_sd * rng.normal(size=len(theta))
        clean = line.reading[j] + line.by_creep[j] * carried + line.by_setting[j] * setting
        carried = line.carry_by_creep[j] * carried + line.carry_by_setting[j] * setting
        draws = clean + np.sqrt(rounded) * rng.normal(size=clean.shape)
        low, high = np.quantile(draws, [0.05, 0.95], axis=1)
        y = sample.readings[j, :, 0]
        out.append(((y >= low) & (y <= high))[sample.protocol.mask[j]])
    return np.concatenate(out)


def one(seed: int, index: int) -> dict[str, Any]:
    """The row of a wire: whose 90 % intervals hold the truth, and how many held-out readings lie in their bands."""
    own = seed_of(seed, "coverage", str(index))
    made = wire(own)
    whole = fit_problem(made.problem, own, policy=POLICY)
    low, high = np.quantile(whole.flat, [0.05, 0.95], axis=0)
    inside = (made.theta[0] >= low) & (made.theta[0] <= high)
    first, count = training(made)
    part = fit_problem(first, seed_of(own, "training"), policy=POLICY)
    caught = held_out(made, part.flat[:: max(1, len(part.flat) // 4000)], count, np.random.default_rng(own))
    return {
        "index": index,
        "converged": [whole.chains.converged, part.chains.converged],
        "inside": dict(zip(made.problem.names, inside.tolist(), strict=True)),
        "held_out_readings": len(caught),
        "held_out_inside": int(caught.sum()),
    }


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Coverage over all wires."""
    physical = [row["inside"][name] for row in rows for name in MATERIAL]
    shares = [row["held_out_inside"] / row["held_out_readings"] for row in rows]
    return {
        "wires": len(rows),
        "not_converged": sum(not all(row["converged"]) for row in rows),
        "intervals": len(physical),
        "interval_coverage": float(np.mean(physical)),
        "by_parameter": {n: float(np.mean([row["inside"][n] for row in rows])) for n in rows[0]["inside"]},
        "held_out_readings": sum(row["held_out_readings"] for row in rows),
        "held_out_coverage": float(np.mean(shares)),
    }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=Path("out/coverage"))
    parser.add_argument("--wires", type=int, default=40)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    path = options.output / f"rows-seed{options.seed}.jsonl"
    cases = [(index,) for index in range(options.wires)]
    rows = records(path, partial(one, options.seed), cases, workers=options.workers)
    result = summary(rows[: options.wires])
    write_json(options.output / "coverage.json", result)
    print(json.dumps(result, indent=2))
    return 0 if 0.83 <= result["interval_coverage"] <= 0.96 and 0.85 <= result["held_out_coverage"] <= 0.95 else 1


if __name__ == "__main__":
    sys.exit(main())
