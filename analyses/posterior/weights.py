"""One wire under steps and under weights: does each test hold the truth, and are both together sharper than either?

``python -m analyses.posterior.weights --pairs 16``. Lines, tests and truths are those of
`analyses.posterior.any_scale`.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from analyses.posterior.any_scale import POLICY, SHARES, Line, line, measured, under_steps, under_weights
from analyses.resumable import study
from wirebayes.inference.fit import fit_problem, seed_of
from wirebayes.model.build import build
from wirebayes.numeric.typing import Array

KINDS = ("steps", "weights", "together")


def log_creep(made: Line, B: Array, U: Array, k2: Array, N: Array) -> Array:
    """(n,) logarithm of the creep of a fresh sample after one hold at the typical tension."""
    return np.log(B * made.tension_N**U * -np.expm1(-k2 * made.hold_s**N))


def one(seed: int, index: int) -> dict[str, Any]:
    """A pair: of each fit the width of the 90 % interval of the log creep, and whether it holds the truth."""
    own_seed = seed_of(seed, "weights", str(index))
    rng = np.random.default_rng(own_seed)
    made = line(rng)
    tests = []
    for test in (under_steps, under_weights):
        bench, own = test(made, SHARES.tolist(), rng)
        tests.append(measured(bench, made.truth | own, own_seed))
    exact = log_creep(made, *(np.array(made.truth[name]) for name in ("B", "U", "k2", "N")))
    row: dict[str, Any] = {"index": index}
    for kind, chosen in zip(KINDS, ([tests[0]], [tests[1]], tests), strict=True):
        done = fit_problem(build(chosen), own_seed, policy=POLICY)
        draws = (done.flat[:, done.problem.names.index(name)] for name in ("B", "U", "k2", "N"))
        low, high = np.quantile(log_creep(made, *draws), [0.05, 0.95])
        row[kind] = {"width": float(high - low), "inside": bool(low <= exact <= high), "converged": done.converged}
    return row


def summary(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Median widths, how many intervals hold the truth, and how often both together are the sharpest."""
    out: dict[str, Any] = {"pairs": len(rows)}
    for kind in KINDS:
        out[kind] = {
            "median_width": float(np.median([row[kind]["width"] for row in rows])),
            "inside": sum(row[kind]["inside"] for row in rows),
            "not_converged": sum(not row[kind]["converged"] for row in rows),
        }
    alone = [min(row["steps"]["width"], row["weights"]["width"]) for row in rows]
    out["together_sharpest"] = sum(row["together"]["width"] < w for row, w in zip(rows, alone, strict=True))
    return out


if __name__ == "__main__":
    study(__doc__, "weights", ("pairs", 16), one, summary)
