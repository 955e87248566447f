"""Do the bands hold what they say? Held-out readings of data simulated from the model, freely and given.

    python analyses/posterior/held_out_coverage.py [--sets 200] [--seed 1]

Each set: parameters from a prior narrowed to wires like the paper's, the paper's 12 holds of 1 mm, 8 of them fitted
(the setting errors enter exactly, the readings are rounded), the last 4 predicted. Readings of one set depend on each
other, so the interval of the coverage is over sets.
"""

import argparse
from dataclasses import replace

import numpy as np
from scipy import stats

from wirebayes.inference.fit import fit_problem, seed_of
from wirebayes.inference.policy import Policy
from wirebayes.io.paper import experiments
from wirebayes.model.build import build
from wirebayes.model.prior import Prior
from wirebayes.model.problem import Problem
from wirebayes.model.replicate import readings
from wirebayes.prediction.held_out import LEVELS, held_out
from wirebayes.processes.workers import workers

WIRES = {
    "k1": stats.lognorm(0.5, scale=900.0),
    "B": stats.lognorm(0.5, scale=0.3),
    "U": stats.lognorm(0.3, scale=0.6),
    "k2": stats.lognorm(0.5, scale=0.03),
    "N": stats.lognorm(0.25, scale=0.65),
    "preload": stats.norm(0.5, 0.3),
    "sensor_sd": stats.lognorm(0.4, scale=0.008),
    "setting_sd": stats.lognorm(0.5, scale=0.03),
}
TRAINED = 8
POLICY = Policy(walkers=64, round_draws=2048, ess=1500.0)


def with_wires(problem: Problem) -> Problem:
    """The same likelihood with the prior that the truths are drawn from."""
    return replace(problem, prior=Prior(dict(WIRES), {}, problem.prior.logarithmic))


def one(job: tuple[int, int]) -> tuple[np.ndarray, np.ndarray, bool]:
    """Coverage of one simulated set at all levels: free, given its first reading; and whether the fit converged."""
    seed, number = job
    rng = np.random.default_rng(seed_of(seed, "coverage", str(number)))
    experiment = next(e for e in experiments() if not any(not h.recorded for h in e.holds))
    truth = with_wires(build([experiment]))
    drawn = readings(truth, truth.prior.rvs(1, rng), truth.samples[0], rng)[..., 0]
    holds = tuple(replace(h, readings=drawn[j, : len(h.time_s)]) for j, h in enumerate(experiment.holds))
    simulated = replace(experiment, holds=holds)
    fitted = fit_problem(with_wires(build([simulated.train(TRAINED)])), int(rng.integers(2**32)), policy=POLICY)
    result = held_out(fitted, simulated, rng)
    assert result.free is not None
    free, given = (np.array([*scores.coverage().values()]) for scores in (result.free, result.given))
    return free, given, fitted.chains.converged


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sets", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    with workers() as parallel_map:
        results = list(parallel_map(one, [(options.seed, number) for number in range(options.sets)]))
    print(f"{options.sets} simulated sets, {sum(not r[2] for r in results)} of them not converged")
    for name, place in (("free", 0), ("given the first reading", 1)):
        shares = 100 * np.array([r[place] for r in results])
        errors = shares.std(axis=0, ddof=1) / np.sqrt(options.sets)
        for level, mean, se in zip(LEVELS, shares.mean(axis=0), errors, strict=True):
            print(f"{name}: {100 * level:g} % bands hold {mean:.1f} ± {1.96 * se:.1f} % of the readings")


if __name__ == "__main__":
    main()
