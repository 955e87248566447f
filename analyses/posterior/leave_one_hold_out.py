"""Leave one hold out as a comparison does it against a fit without every hold, on one wire and several models.

    python analyses/posterior/leave_one_hold_out.py [--experiment roc-line-1.71m]

The ranking of the models should be the same and no elpd differ by more than one.
"""

import argparse

import numpy as np

from wirebayes.comparison.candidates import BASE, ModelToCompare, candidates, effects_of, problem_of
from wirebayes.effects import catalogue
from wirebayes.inference.fit import fit_problem, seed_of
from wirebayes.io.experiment_file import select
from wirebayes.io.paper import experiments
from wirebayes.prediction.leave_one_hold_out import LARGEST_K, smoothed_leave_one_hold_out

SEED = 0
MODELS = ("exponential", "additive", "modified_hooke", "independent_errors", "hooke_without_creep", "strain_stiffening")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--experiment", default="roc-line-1.71m")
    experiment = select(experiments(), parser.parse_args().experiment)[0]
    print(
        f"{experiment.name}: model, elpd as in a comparison (sampling where any Pareto k > {LARGEST_K}), "
        "by fits without every hold, difference, largest difference of a hold, holds sampled"
    )
    fast, exact = {}, {}
    known = catalogue()
    for candidate in candidates(experiment, ModelToCompare(BASE, "", ""), known, MODELS):
        problem = problem_of(candidate, experiment, effects_of(candidate, experiment, known, SEED))
        fitted = fit_problem(problem, seed_of(SEED, "leave one hold out", candidate.name))
        quick, slow = (
            smoothed_leave_one_hold_out(fitted, SEED),
            smoothed_leave_one_hold_out(fitted, SEED + 1, exact=True),
        )
        fast[candidate.name], exact[candidate.name] = quick.total, slow.total
        print(
            f"{candidate.name:22s} {quick.total:8.2f} {slow.total:8.2f} {quick.total - slow.total:+6.2f} "
            f"{np.abs(quick.elpd - slow.elpd).max():6.2f}   {list(map(int, quick.hold[quick.refitted]))}"
            + ("" if slow.converged and quick.converged else "  not converged"),
            flush=True,
        )
    rankings = [sorted(scores, key=lambda name: -scores[name]) for scores in (fast, exact)]
    print("same ranking" if rankings[0] == rankings[1] else f"rankings differ: {rankings[0]} and {rankings[1]}")


if __name__ == "__main__":
    main()
