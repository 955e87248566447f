"""Effective draws a second against other samplers, on the same posterior, in one run.

    python -m analyses.benchmarks --output out/benchmarks [--minutes 10] [--wires NAME ...] [--likelihoods chain hold]

Every peer gets the same data, prior and likelihood; before anything is timed its model is compared with the package's.
A wire that a setting error may leave slack is left out of the chain: the peers' likelihood is linear in such errors.
A peer that did not finish, diverged or has R-hat above 1.01 is printed as not converged and gets no ratio. wirebayes is
run anew beside each peer, so that a busy machine slows both. Each case has a process of its own: what XLA has compiled
for one stays in memory until its process ends.
"""

import argparse
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from multiprocessing import get_context

import numpy as np

from analyses.benchmarks import measure, parsed
from analyses.benchmarks.peers import PEERS, beside_each_peer
from wirebayes.io.paper import experiments
from wirebayes.io.run_folder import write_json


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--minutes", type=float, default=10.0, help="of processor time to sample for each peer, at most"
    )
    parser.add_argument("--wires", nargs="*")
    parser.add_argument("--likelihoods", nargs="*", default=["chain", "hold"])
    parser.add_argument("--peers", nargs="*", help="words that the names of wanted peers begin with")
    parser.add_argument("--seed", type=int, default=0)
    options = parsed(parser)
    wires = [experiment.name for experiment in experiments() if not options.wires or experiment.name in options.wires]
    cases = []
    with ProcessPoolExecutor(1, get_context("spawn"), max_tasks_per_child=1) as alone:
        for wire, likelihood in product(wires, options.likelihoods):
            case = alone.submit(beside_each_peer, wire, likelihood, options).result()
            if case is not None:
                cases.append(case)
            write_json(
                options.output / "samplers.json",
                {"wanted_ess": measure.WANTED, "minutes": options.minutes, "cases": cases},
            )
    print("\nratio of effective draws per second of processor time, all costs counted: median over cases, worst case")
    for name in PEERS:
        ratios = [
            c["peers"][name]["ratio_all_costs_cpu"]
            for c in cases
            if name in c["peers"] and "ratio_all_costs_cpu" in c["peers"][name]
        ]
        tried = sum(name in c["peers"] for c in cases)
        if tried:
            cells = f"{np.median(ratios):8.1f} {min(ratios):8.1f}" if ratios else "not converged"
            print(f"  {name:36s} {cells}   ({len(ratios)} of {tried} converged)")


if __name__ == "__main__":
    main()
