"""Do fits converge, and intervals cover, where a bench sets positions exactly? Against another checkout, too.

    python -m analyses.posterior.exact_positions --tests 120 --against ../before
    python -m analyses.posterior.exact_positions --tests 24 --seed 400 --effect toe --against ../before

Wires of any scale, made here: 4 to 10 even steps of a strain of .5 to 3 %, 8 to 60 readings a hold, creep of .3 to 30 %
of the stretch, a force sensor that is wrong by .01 to .3 % of the largest tension. Positions have no error, so that the
setting error is the narrow end of a funnel.
"""

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

PARAMETERS = ("k1", "B", "U", "k2", "N")


def made(seed: int) -> tuple[Any, dict[str, float]]:
    """A test and its truth."""
    from wirebayes.io.arrays import from_arrays

    rng = np.random.default_rng(seed)
    length_mm, k1 = 10 ** rng.uniform(2.0, 4.0), 10 ** rng.uniform(2.5, 5.0)
    holds, count = int(rng.integers(4, 11)), int(rng.choice([8, 20, 60]))
    times_s = np.geomspace(1.0, 10 ** rng.uniform(2.5, 4.0), count)
    strain = rng.uniform(0.005, 0.03)
    U, k2, N = rng.uniform(0.2, 1.0), 10 ** rng.uniform(-2.5, -0.5), rng.uniform(0.3, 0.9)
    sensor_sd = k1 * strain * 10 ** rng.uniform(-4.0, -2.5)
    B = 10 ** rng.uniform(-2.5, -0.5) * strain * length_mm / (k1 * strain) ** U
    creep, rows = 0.0, []
    for j in range(holds):
        position = (j + 1) * strain * length_mm / holds
        first = k1 * ((length_mm + position) / (length_mm + creep) - 1.0)
        course = creep + (B * first**U - creep) * -np.expm1(-k2 * times_s**N)
        read = k1 * ((length_mm + position) / (length_mm + course) - 1.0) + sensor_sd * rng.normal(size=count)
        rows += [(j + 1, position, t, max(y, 0.0)) for t, y in zip(times_s, read, strict=True)]
        creep = course[-1]
    test = from_arrays(*zip(*rows, strict=True), length_mm=length_mm, name="servo", material="servo")
    return test, {"k1": k1, "B": B, "U": U, "k2": k2, "N": N}


def fitted(seeds: range, effects: Sequence[str]) -> dict[str, Any]:
    """Of each test whether its fit converged, evaluations, and which parameters the 90 % intervals hold.

    The wires have none of the effects that a fit may have.
    """
    from wirebayes.effects import effect_named
    from wirebayes.inference.fit import fit_problem
    from wirebayes.model.build import build

    out: dict[str, Any] = {"converged": [], "evaluations": [], "inside": []}
    for seed in seeds:
        test, truth = made(seed)
        fit = fit_problem(build([test], [effect_named(name) for name in effects]), seed)
        low, high = np.quantile(fit.flat, [0.05, 0.95], axis=0)
        columns = [fit.problem.names.index(name) for name in PARAMETERS]
        inside = [bool(low[c] <= truth[n] <= high[c]) for n, c in zip(PARAMETERS, columns, strict=True)]
        out["converged"].append(bool(fit.converged))
        out["evaluations"].append(int(fit.chains.evaluations))
        out["inside"].append(inside)
    return out


def main() -> None:
    """Print how many converged, what they took, and how many intervals hold the truth."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tests", type=int, default=120)
    parser.add_argument("--seed", type=int, default=200, help="of the first test; the others follow")
    parser.add_argument("--effect", action="append", default=[], help="that the fits have; may be repeated")
    parser.add_argument("--against", type=Path, metavar="CHECKOUT", help="fit the same tests by its code, too")
    parser.add_argument("--here", action="store_true", help="in this process, and print JSON")
    options = parser.parse_args()
    if options.here:
        print(json.dumps(fitted(range(options.seed, options.seed + options.tests), options.effect)))
        return
    from analyses.speed.checkouts import answered  # another checkout need not have it

    given = ["--here", "--tests", str(options.tests), "--seed", str(options.seed)]
    given += [word for name in options.effect for word in ("--effect", name)]
    trees = {"now": Path(__file__).parents[2]} | ({"before": options.against} if options.against else {})
    total = {}
    for name, tree in trees.items():
        found = answered(__file__, given, tree)
        evaluations, inside = np.array(found["evaluations"]), np.array(found["inside"])
        shares = ", ".join(f"{n} {100 * s:.0f} %" for n, s in zip(PARAMETERS, inside.mean(axis=0), strict=True))
        print(
            f"- {name}: {sum(found['converged'])} of {len(evaluations)} converged, after {np.median(evaluations):.0f} "
            f"evaluations (median) and {evaluations.max()} at most; 90 % intervals hold {100 * inside.mean():.1f} % of "
            f"the true values ({shares})",
            flush=True,
        )
        total[name] = evaluations.sum()
    if options.against:
        print(f"- evaluations now over before: {total['now'] / total['before']:.2f} in all")


if __name__ == "__main__":
    main()
