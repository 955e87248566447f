"""Processor time to judge a model in a comparison, and its elpd, now and in a checkout of another commit.

Eight models of the paper's 1 m Roc line and nylon; each runs in both, one after the other.

    python -m analyses.compare_cost --against ../before
"""

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np

WIRES = (0, 2)
MODELS = ("plain", "exponential", "toe", "strain_stiffening")


def cost_of(wire: int, model: str) -> dict[str, Any]:
    """One model in this process: processor time, elpd, and whether all its samplings converged."""
    from wirebayes.comparison.candidates import BASE, Candidate, candidates
    from wirebayes.comparison.compare import Task, judge
    from wirebayes.effects import catalogue
    from wirebayes.io.paper import experiments

    experiment = experiments()[wire]
    known = candidates(experiment, Candidate(BASE, "", ""), catalogue())
    begin = time.process_time()
    found = judge(Task(experiment, next(c for c in known if c.name == model)), 0)
    return {"cpu_s": time.process_time() - begin, "elpd": found["leave_one_hold_out"]["elpd"],
            "converged": found["converged"]}  # fmt: skip


def main() -> None:
    """Print a line for each model, then the ratios."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--against", type=Path, required=True, metavar="CHECKOUT")
    parser.add_argument("--only", nargs=2, metavar=("WIRE", "MODEL"), help="one model, in this process")
    options = parser.parse_args()
    if options.only:
        print(json.dumps(cost_of(int(options.only[0]), options.only[1])))
        return
    from analyses.checkouts import answered  # another checkout need not have it

    ratios = []
    for wire in WIRES:
        for model in MODELS:
            given = ["--against", str(options.against), "--only", str(wire), model]
            new, old = (answered(__file__, given, tree) for tree in (Path(__file__).parents[1], options.against))
            ratios.append(old["cpu_s"] / new["cpu_s"])
            print(wire, f"{model:18}", *(f"{r['cpu_s']:6.1f} s  elpd {r['elpd']:7.2f}" for r in (new, old)),
                  f"ratio {ratios[-1]:.2f}", sep="  ", flush=True)  # fmt: skip
    print(f"{len(ratios)} models: ratio {np.median(ratios):.2f} in the median, {min(ratios):.2f} to {max(ratios):.2f}")


if __name__ == "__main__":
    main()
