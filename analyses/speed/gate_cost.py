"""Processor time of the gate to every verdict, `wirebayes.discovery.global_test.examine`, and what it says.

The paper's four wires, the first cases of the benchmark of hidden effects, and cases of
`analyses.posterior.model_check`. With ``--against`` a checkout of another commit, each case runs in both, one after
the other, and ratios of processor times are printed beside what differs in p and in the most surprising name. The
benchmark's cases are made here, so both look at the same files.

    python -m analyses.speed.gate_cost --against ../before --output out/gate-cost.jsonl
"""

import argparse
import json
import time
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from wirebayes.model.spec import PLAIN_SPEC

PAPER = tuple(f"paper:{i}" for i in range(4))


def experiments_of(case: str) -> Any:
    """The experiments of a case: a wire of the paper, or a file."""
    from wirebayes.io import paper
    from wirebayes.io.experiment_file import read_experiments

    return [paper.experiments()[int(case[-1])]] if case in PAPER else read_experiments(Path(case))


def plain_fits(experiments: Any, seed: int) -> tuple[list[Any], np.random.Generator]:
    """The plain fit of each material, as `discover` begins, and the random numbers that it goes on with."""
    from wirebayes.inference.fit import seed_of
    from wirebayes.inference.laplace_fit import fitted

    rng = np.random.default_rng(seed_of(seed, "discover"))
    groups: dict[str, list[Any]] = {}
    for e in experiments:
        groups.setdefault(e.material, []).append(e)
    streams = rng.spawn(len(groups))
    return [fitted(g, (), PLAIN_SPEC, r) for g, r in zip(groups.values(), streams, strict=True)], rng


def cost_of(case: str, seed: int, simulations: int) -> dict[str, Any]:
    """One case in this process: processor time, p and the surprise of every name."""
    from analyses.posterior import model_check
    from wirebayes.discovery.global_test import examine
    from wirebayes.effects import CATALOGUE

    if case.startswith("check:"):
        _, kind, number = case.split(":")
        begin = time.process_time()
        p = model_check.case(kind, int(number), simulations)["p"]
        return {"cpu_s": time.process_time() - begin, "p": p, "first": ""}
    blocks, rng = plain_fits(experiments_of(case), seed)
    begin = time.process_time()
    gate = examine(blocks, CATALOGUE, simulations, rng)
    cpu = time.process_time() - begin
    surprises = gate.test.surprises
    return {
        "cpu_s": cpu,
        "p": gate.test.p,
        "first": max(surprises, key=lambda n: surprises[n]),
        "simulations": len(gate.test.null),
        "surprises": surprises,
    }


def main() -> None:
    """Run the cases, a line of JSON each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--against", type=Path, help="checkout to compare with")
    parser.add_argument("--benchmark", type=int, default=15, help="cases of the benchmark of hidden effects")
    parser.add_argument("--checks", type=int, default=0, help="cases of each kind of analyses.posterior.model_check")
    parser.add_argument("--simulations", type=int, default=999)
    parser.add_argument("--output", type=Path)
    parser.add_argument("--only", nargs=2, metavar=("CASE", "SEED"), help="one case, in this process")
    options = parser.parse_args()
    if options.only:
        print(json.dumps(cost_of(options.only[0], int(options.only[1]), options.simulations)))
        return
    from analyses.speed.checkouts import benchmark_files  # another checkout need not have it

    kinds = ("chain", "additive", "together", "effect")
    with TemporaryDirectory() as folder:
        cases = {name: (name, 0) for name in PAPER} | benchmark_files(range(options.benchmark), Path(folder))
        checks = [f"check:{kind}:{i}" for i in range(options.checks) for kind in kinds]
        cases |= {name: (name, 0) for name in checks}
        compared(cases, options)


def compared(cases: Mapping[str, tuple[str, int]], options: argparse.Namespace) -> None:
    """Run each case in one or both trees, the same file in both, and print what it takes."""
    from analyses.speed.checkouts import answered

    trees = [Path(__file__).parents[2], *([options.against] if options.against else [])]
    records = []
    for name, (case, seed) in cases.items():
        given = ["--only", case, str(seed), "--simulations", str(options.simulations)]
        found = [{"case": name, **answered(__file__, given, tree)} for tree in trees]
        records.append(found)
        print(name, *(f"{r['cpu_s']:8.2f} s  p = {r['p']:.4g} {r['first']}" for r in found), sep="  ", flush=True)
        if options.output:
            with options.output.open("a") as file:
                file.write(json.dumps(found) + "\n")
    if options.against:
        ratios = np.array([old["cpu_s"] / new["cpu_s"] for new, old in records])
        total = sum(old["cpu_s"] for _, old in records) / sum(new["cpu_s"] for new, _ in records)
        same = sum(new["p"] == old["p"] for new, old in records)
        print(
            f"{len(records)} cases: ratio of processor times {np.median(ratios):.2f} in the median, "
            f"{ratios.min():.2f} at worst, {total:.2f} in all; p the same in {same}"
        )


if __name__ == "__main__":
    main()
