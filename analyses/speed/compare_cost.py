"""Processor time to judge the models of a comparison, and their elpds, now and in a checkout of another commit.

All models of the paper's wires, or some; each is judged in both trees, one after the other, in processes of their own.

    python -m analyses.speed.compare_cost --against ../before                        # hours, if the other tree is slow
    python -m analyses.speed.compare_cost --against ../before --wires 0 2 --models plain toe
"""

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np


def cost_of(wire: int, model: str) -> dict[str, Any]:
    """One model in this process: processor time, elpd, and whether all its samplings converged."""
    import arviz_stats  # noqa: F401  # a process loads it once, for all models

    from wirebayes.comparison.compare import Task, judge
    from wirebayes.io.paper import experiments

    candidate = next(c for c in known(wire) if c.name == model)
    begin = time.process_time()
    found = judge(Task(experiments()[wire], candidate), 0)
    return {
        "cpu_s": time.process_time() - begin,
        "elpd": found["leave_one_hold_out"]["elpd"],
        "per_hold": [float(x) for x in found["leave_one_hold_out"]["per_hold"]],
        "converged": bool(found["converged"]),
    }


def known(wire: int) -> list[Any]:
    """The models of a wire's comparison."""
    from wirebayes.comparison.candidates import BASE, ModelToCompare, candidates
    from wirebayes.effects import catalogue
    from wirebayes.io.paper import experiments

    return candidates(experiments()[wire], ModelToCompare(BASE, "", ""), catalogue())


def main() -> None:
    """Print a line for each model, then the ratio of each wire."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--against", type=Path, required=True, metavar="CHECKOUT")
    parser.add_argument("--wires", nargs="+", type=int, default=[0, 1, 2, 3], metavar="N", help="0 to 3; all")
    parser.add_argument("--models", nargs="+", metavar="NAME", help="some models only")
    parser.add_argument("--only", nargs=2, metavar=("WIRE", "MODEL"), help="one model, in this process")
    options = parser.parse_args()
    if options.only:
        print(json.dumps(cost_of(int(options.only[0]), options.only[1])))
        return
    for wire in options.wires:
        compared(wire, options.models, options.against)


def compared(wire: int, models: list[str] | None, against: Path) -> None:
    """Judge a wire's models in both trees; ! marks what did not converge."""
    from analyses.speed.checkouts import answered  # another checkout need not have it

    both: list[tuple[dict[str, Any], dict[str, Any]]] = []
    for model in [c.name for c in known(wire) if models is None or c.name in models]:
        given = ["--against", str(against), "--only", str(wire), model]
        new, old = (answered(__file__, given, tree) for tree in (Path(__file__).parents[2], against))
        both.append((new, old))
        apart = np.abs(np.subtract(new["per_hold"], old["per_hold"])).max()
        print(
            wire,
            f"{model:24}",
            *(f"{r['cpu_s']:6.1f} s  elpd {r['elpd']:7.2f}{' ' if r['converged'] else '!'}" for r in (new, old)),
            f"a hold differs by {apart:.2f}",
            f"ratio {old['cpu_s'] / new['cpu_s']:.1f}",
            sep="  ",
            flush=True,
        )
    new_s, old_s = np.array([[r["cpu_s"] for r in pair] for pair in both]).T
    print(
        f"{wire}: {len(both)} models in {new_s.sum():.0f} s and {old_s.sum():.0f} s: ratio "
        f"{old_s.sum() / new_s.sum():.2f}; of a model {np.median(old_s / new_s):.1f} in the median, "
        f"{(old_s / new_s).min():.1f} to {(old_s / new_s).max():.1f}"
    )


if __name__ == "__main__":
    main()
