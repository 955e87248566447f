"""Processor time of the gate to every verdict, `wirebayes.discovery.global_test.examine`, and what it says.

The paper's four wires, the first cases of the benchmark of hidden effects, and cases of `analyses.model_check`. With
``--against`` a checkout of another commit, each case runs in both, one after the other, and ratios of processor times
are printed beside what differs in p and in the most surprising name.

    python -m analyses.gate_cost --against ../before --output out/gate-cost.jsonl
"""

import argparse
import json
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

PAPER = tuple(f"paper:{i}" for i in range(4))


def experiments_of(name: str) -> tuple[Any, int]:
    """The experiments of a case, and its seed."""
    from analyses.hidden_effects.cases import SIZES, seal, specs
    from wirebayes.io import paper
    from wirebayes.io.experiment import read_experiments

    kind, number = name.split(":")
    if kind == "paper":
        return [paper.experiments()[int(number)]], 0
    plan = specs(SIZES["small"], 0)
    spec = plan[int(np.random.default_rng(0).permutation(len(plan))[int(number)])]
    with TemporaryDirectory() as folder:
        if not seal(spec, Path(folder) / "cases", Path(folder) / "sealed"):
            return None, 0
        return read_experiments(Path(folder) / "cases" / spec.key / "experiment.toml"), int(spec.key, 16) % 2**31


def plain_fits(experiments: Any, seed: int) -> tuple[list[Any], np.random.Generator]:
    """The plain fit of each material, as `discover` begins, and the random numbers that it goes on with."""
    from wirebayes.inference.fit import seed_of
    from wirebayes.inference.laplace_fit import fitted

    rng = np.random.default_rng(seed_of(seed, "discover"))
    groups: dict[str, list[Any]] = {}
    for e in experiments:
        groups.setdefault(e.material, []).append(e)
    streams = rng.spawn(len(groups))
    return [fitted(g, (), "hooke", "saturating", r) for g, r in zip(groups.values(), streams, strict=True)], rng


def cost_of(name: str, simulations: int) -> dict[str, Any]:
    """One case in this process: processor time, p and the surprise of every name."""
    from analyses.model_check import case
    from wirebayes.discovery.global_test import examine
    from wirebayes.effects import CATALOGUE

    if name.startswith("check"):
        _, kind, number = name.split(":")
        begin = time.process_time()
        p = case(kind, int(number), simulations)["p"]
        return {"case": name, "cpu_s": time.process_time() - begin, "p": p, "first": ""}
    experiments, seed = experiments_of(name)
    if experiments is None:
        return {"case": name, "cpu_s": 0.0, "p": None, "first": ""}
    blocks, rng = plain_fits(experiments, seed)
    begin = time.process_time()
    gate = examine(blocks, CATALOGUE, simulations, rng)
    cpu = time.process_time() - begin
    surprises = gate.test.surprises
    further = {f"{c.name} {c.probe} {c.blocks} {c.shared}": v for c, v in gate.further.items()}
    return {"case": name, "cpu_s": cpu, "p": gate.test.p, "first": max(surprises, key=lambda n: surprises[n]),
            "simulations": len(gate.test.null), "surprises": surprises, "further": further}  # fmt: skip


def main() -> None:
    """Run the cases, a line of JSON each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--against", type=Path, help="checkout to compare with")
    parser.add_argument("--benchmark", type=int, default=15, help="cases of the benchmark of hidden effects")
    parser.add_argument("--checks", type=int, default=0, help="cases of each kind of analyses.model_check")
    parser.add_argument("--simulations", type=int, default=999)
    parser.add_argument("--output", type=Path)
    parser.add_argument("--only", help="one case, in this process")
    options = parser.parse_args()
    if options.only:
        print(json.dumps(cost_of(options.only, options.simulations)))
        return
    from analyses.checkouts import answered  # another checkout need not have it

    kinds = ("chain", "additive", "together", "effect")
    names = [*PAPER, *(f"benchmark:{i}" for i in range(options.benchmark))]
    names += [f"check:{kind}:{i}" for i in range(options.checks) for kind in kinds]
    trees = [Path(__file__).parents[1], *([options.against] if options.against else [])]
    records = []
    for name in names:
        given = ["--only", name, "--simulations", str(options.simulations)]
        found = [answered(__file__, given, tree) for tree in trees]
        if found[0]["p"] is None:
            continue
        records.append(found)
        print(name, *(f"{r['cpu_s']:8.2f} s  p = {r['p']:.4g} {r['first']}" for r in found), sep="  ", flush=True)
        if options.output:
            with options.output.open("a") as file:
                file.write(json.dumps(found) + "\n")
    if options.against:
        ratios = np.array([old["cpu_s"] / new["cpu_s"] for new, old in records])
        total = sum(old["cpu_s"] for _, old in records) / sum(new["cpu_s"] for new, _ in records)
        same = sum(new["p"] == old["p"] for new, old in records)
        print(f"{len(records)} cases: ratio of processor times {np.median(ratios):.2f} in the median, "
              f"{ratios.min():.2f} at worst, {total:.2f} in all; p the same in {same}")  # fmt: skip


if __name__ == "__main__":
    main()
