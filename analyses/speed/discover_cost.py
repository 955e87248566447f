"""Processor time of a whole search for the missing effect, and its verdict, now and in a checkout of another commit.

The paper's four wires and cases of the benchmark of hidden effects; each runs in both, one after the other. The cases
are made here, so both search the same files, however the benchmark has changed since.

    python -m analyses.speed.discover_cost --against ../before
"""

import argparse
import json
import time
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np


def cost_of(name: str, seed: int, simulations: int) -> dict[str, Any]:
    """One case in this process, a wire of the paper or a file: processor time, p, verdict and effects of its first."""
    import arviz_stats  # noqa: F401  # a command loads it once, and for its posteriors anyway

    from wirebayes.discovery.search import investigate
    from wirebayes.discovery.settings import Settings
    from wirebayes.io import paper
    from wirebayes.io.experiment_file import read_experiments

    experiments = [paper.experiments()[int(name)]] if name.isdigit() else read_experiments(Path(name))
    begin = time.process_time()
    found = investigate(experiments, Settings(simulations=simulations), seed)
    cpu = time.process_time() - begin
    first = next(iter(found.report["experiments"].values()))
    return {"cpu_s": cpu, "p": first["p_global"], "verdict": first["verdict"], "effects": first["effects"]}


def main() -> None:
    """Print a line for each case, then the ratios."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--against", type=Path, required=True, metavar="CHECKOUT")
    parser.add_argument("--benchmark", type=int, default=16, help="cases of the benchmark of hidden effects")
    parser.add_argument("--simulations", type=int, default=999)
    parser.add_argument("--first", type=int, default=0, help="case of the benchmark to begin with")
    parser.add_argument("--no-wires", action="store_true", help="without the paper's wires")
    parser.add_argument("--only", nargs=2, metavar=("CASE", "SEED"), help="one case, in this process")
    options = parser.parse_args()
    if options.only:
        print(json.dumps(cost_of(options.only[0], int(options.only[1]), options.simulations)))
        return
    from analyses.speed.checkouts import benchmark_files  # another checkout need not have it

    with TemporaryDirectory() as folder:
        wires = {} if options.no_wires else {f"paper:{i}": (str(i), 0) for i in range(4)}
        numbers = range(options.first, options.first + options.benchmark)
        compared(wires | benchmark_files(numbers, Path(folder)), options.against, options.simulations)


def compared(cases: Mapping[str, tuple[str, int]], against: Path, simulations: int) -> None:
    """Search each case in both trees and print what they take."""
    from analyses.speed.checkouts import answered

    ratios, same = [], 0
    for name, (case, seed) in cases.items():
        given = ["--against", str(against), "--only", case, str(seed), "--simulations", str(simulations)]
        new, old = (answered(__file__, given, tree) for tree in (Path(__file__).parents[2], against))
        ratios.append(old["cpu_s"] / new["cpu_s"])
        same += (new["verdict"], set(new["effects"])) == (old["verdict"], set(old["effects"]))
        print(
            name,
            *(f"{r['cpu_s']:6.1f} s  p = {r['p']:.3g} {r['verdict']} {r['effects']}" for r in (new, old)),
            f"ratio {ratios[-1]:.2f}",
            sep="  ",
            flush=True,
        )
    print(
        f"{len(ratios)} cases: ratio {np.median(ratios):.2f} in the median, {min(ratios):.2f} to {max(ratios):.2f}; "
        f"verdict and effects the same in {same}"
    )


if __name__ == "__main__":
    main()
