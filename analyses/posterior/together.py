"""The two Roc Line samples together: is creep a strain, and what belongs to the material, what to the length?

    python analyses/posterior/together.py

The paper's conjecture: k1 belongs to the material, the other parameters to the length of the sample.
"""

from collections.abc import Sequence

import numpy as np
from scipy import stats

from wirebayes.effects import effect_named
from wirebayes.inference.fit import Fit, fit_problem, seed_of
from wirebayes.io.paper import experiments
from wirebayes.model.build import build
from wirebayes.model.problem import Problem
from wirebayes.model.sample import LENGTH_EXPONENT, MATERIAL
from wirebayes.model.spec import ModelSpec
from wirebayes.prediction.leave_one_hold_out import LeftOutHolds, smoothed_leave_one_hold_out
from wirebayes.results.identifiability import identifiability

SEED = 0


def interval(values: np.ndarray) -> str:
    low, middle, high = np.quantile(values, [0.05, 0.5, 0.95])
    return f"{middle:9.4g} [{low:.4g}, {high:.4g}]"


def joined(parts: Sequence[LeftOutHolds]) -> LeftOutHolds:
    """Separate fits as one model of all holds."""
    return LeftOutHolds(
        sum((p.sample for p in parts), ()),
        np.concatenate([p.hold for p in parts]),
        np.concatenate([p.elpd for p in parts]),
        np.concatenate([p.pareto_k for p in parts]),
        np.concatenate([p.refitted for p in parts]),
        all(p.converged for p in parts),
    )


def fitted(problem: Problem, name: str) -> Fit:
    result = fit_problem(problem, seed_of(SEED, "together", name))
    print(
        f"{name}: {len(problem.names)} parameters, {'converged' if result.chains.converged else 'NOT CONVERGED'} "
        f"{result.chains.why}",
        flush=True,
    )
    return result


def main() -> None:
    wires = [e for e in experiments() if e.material.startswith("Roc Line")]
    free = stats.norm(1.0, 1.0)
    separate = [fitted(build([e]), e.name) for e in wires]
    together = fitted(build(wires, spec=ModelSpec(length_exponent=free)), "together, B as L0^p")
    models = {
        "separate": joined([smoothed_leave_one_hold_out(f) for f in separate]),
        "together, B as L0^p": smoothed_leave_one_hold_out(together),
        "together, creep a strain (p = 1)": smoothed_leave_one_hold_out(fitted(build(wires), "together, p = 1")),
    }
    for which in ("k1", "U", "N"):
        name = f"together, B as L0^p, {which} by length"
        result = fitted(
            build(wires, [effect_named(f"length_dependence@{which}")], spec=ModelSpec(length_exponent=free)), name
        )
        models[name] = smoothed_leave_one_hold_out(result)
        print(f"  {which} as L0^p, p {interval(result.flat[:, result.problem.names.index('length_dependence.p')])}")

    print("\nparameter, each sample by itself, both together")
    for name in MATERIAL:
        own = [f.problem.parameters(f.flat, f.problem.samples[0])[name] for f in separate]
        both = [together.problem.parameters(together.flat, s)[name] for s in together.problem.samples]
        for e, alone, shared in zip(wires, own, both, strict=True):
            print(f"{name:3s} {e.name:15s} {interval(alone):32s} {interval(shared)}")
        n = min(map(len, own))
        ratio = own[1][:n] / own[0][np.random.default_rng(SEED).permutation(n)]
        print(f"    ratio, longer over shorter, fitted apart {interval(ratio)}")
    p = together.flat[:, together.problem.names.index(LENGTH_EXPONENT)]
    print(f"\np of B as L0^p: {interval(p)} (1: creep is a strain); prior 1 ± 1")
    print("\nmodel, elpd of all holds left out in turn, difference from separate fits ± se")
    base = models["separate"].elpd
    for name, left in models.items():
        gained = left.elpd - base
        print(
            f"{name:45s} {left.total:8.1f}  {gained.sum():+7.1f} ± {np.sqrt(len(gained) * gained.var(ddof=1)):.1f}"
            + ("" if left.converged else "  a refit did not converge")
        )
    print("\nwhat the data determine, both samples together")
    for found in identifiability(together).values():
        print(f"  {found['sentence']}")


if __name__ == "__main__":
    main()
