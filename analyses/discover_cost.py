"""Processor time of a whole search for the missing effect, and its verdict, now and in a checkout of another commit.

The paper's four wires and cases of the benchmark of hidden effects; each runs in both, one after the other.

    python -m analyses.discover_cost --against ../before
"""

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np

from analyses.gate_cost import PAPER, experiments_of


def cost_of(name: str, simulations: int) -> dict[str, Any]:
    """One case in this process: processor time, p, verdict and effects of its first experiment."""
    import arviz_stats  # noqa: F401  # a command loads it once, and for its posteriors anyway

    from wirebayes.discovery.search import investigate
    from wirebayes.discovery.settings import Settings
    from wirebayes.effects import CATALOGUE

    experiments, seed = experiments_of(name)
    if experiments is None:
        return {"cpu_s": None}
    begin = time.process_time()
    found = investigate(experiments, Settings(kinds=CATALOGUE, simulations=simulations), seed)
    cpu = time.process_time() - begin
    first = next(iter(found.report["experiments"].values()))
    return {"cpu_s": cpu, "p": first["p_global"], "verdict": first["verdict"], "effects": first["effects"]}


def main() -> None:
    """Print a line for each case, then the ratios."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--against", type=Path, required=True, metavar="CHECKOUT")
    parser.add_argument("--benchmark", type=int, default=16, help="cases of the benchmark of hidden effects")
    parser.add_argument("--simulations", type=int, default=999)
    parser.add_argument("--only", help="one case, in this process")
    options = parser.parse_args()
    if options.only:
        print(json.dumps(cost_of(options.only, options.simulations)))
        return
    from analyses.checkouts import answered  # another checkout need not have it

    ratios, same = [], 0
    for name in [*PAPER, *(f"benchmark:{i}" for i in range(options.benchmark))]:
        given = ["--against", str(options.against), "--only", name, "--simulations", str(options.simulations)]
        new, old = (answered(__file__, given, tree) for tree in (Path(__file__).parents[1], options.against))
        if new["cpu_s"] is None:
            continue
        ratios.append(old["cpu_s"] / new["cpu_s"])
        same += (new["verdict"], set(new["effects"])) == (old["verdict"], set(old["effects"]))
        print(name, *(f"{r['cpu_s']:6.1f} s  p = {r['p']:.3g} {r['verdict']} {r['effects']}" for r in (new, old)),
              f"ratio {ratios[-1]:.2f}", sep="  ", flush=True)  # fmt: skip
    print(f"{len(ratios)} cases: ratio {np.median(ratios):.2f} in the median, {min(ratios):.2f} to {max(ratios):.2f}; "
          f"verdict and effects the same in {same}")  # fmt: skip


if __name__ == "__main__":
    main()
