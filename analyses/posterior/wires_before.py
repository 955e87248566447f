"""The paper's four wires by another checkout's priors: which intervals differ, do all fits converge, what is a draw?

``python -m analyses.posterior.wires_before --against ../before``: the sixteen fits of ``wirebayes reproduce`` (each
wire by each likelihood, all holds and the first five) in both trees, with several seeds. An interval of 90 % differs
where its median moves by more than `MOVED` standard deviations, or its width by more than a factor of `WIDER`. What a
draw costs is told by effective draws an evaluation, all counted, of the parameter that has fewest, by its mean or by a
tail.
"""

import argparse
import importlib
import json
import subprocess
from pathlib import Path
from typing import Any, Literal

import numpy as np
from scipy import stats

LIKELIHOODS: tuple[Literal["chain", "hold"], ...] = ("chain", "hold")
HOLDS = {"all holds": None, "first 5": 5}
MOVED, WIDER = 0.5, 1.5
WANTED = 20_000  # effective draws, as where docs/speed.rst counts what they cost


def fits_here(seed: int) -> dict[str, Any]:
    """All fits by this process's package."""
    from wirebayes.inference.fit import fit_problem
    from wirebayes.io.paper import experiments

    out = {}
    for experiment in experiments():
        for likelihood in LIKELIHOODS:
            for words, holds in HOLDS.items():
                trained = experiment if holds is None else experiment.train(holds)
                done = fit_problem(problem_of(trained, likelihood), seed)
                out[f"{experiment.name}, {likelihood}, {words}"] = kept(done)
    return out


def problem_of(test: Any, likelihood: Literal["chain", "hold"]) -> Any:
    """The posterior of a test, as this process's package builds it."""
    try:
        from wirebayes.model.build import build
        from wirebayes.model.spec import ModelSpec
    except ImportError:  # an older checkout
        older: Any = importlib.import_module("wirebayes.model.problem")
        return older.build([test], likelihood=likelihood)
    return build([test], spec=ModelSpec(likelihood=likelihood))


def kept(done: Any) -> dict[str, Any]:
    """What is compared of a fit."""
    draws, chains = done.flat, done.chains
    low, middle, high = np.quantile(draws, [0.05, 0.5, 0.95], axis=0)
    columns = {"sd": draws.std(axis=0), "q05": low, "q50": middle, "q95": high}
    burn_in = chains.evaluations - chains.kept_evaluations
    for_wanted = burn_in + WANTED * chains.kept_evaluations / chains.ess.min()
    return {
        "converged": bool(chains.converged),
        "draws_an_evaluation": float(WANTED / for_wanted),
        "parameters": {
            name: {key: float(values[i]) for key, values in columns.items()}
            for i, name in enumerate(done.problem.names)
        },
    }


def ends(parameter: dict[str, float]) -> str:
    """The interval of 90 %, three digits each."""
    low, high = (f"{float(f'{parameter[key]:.3g}'):g}" for key in ("q05", "q95"))
    return f"{low} to {high}"


def differs(before: dict[str, float], after: dict[str, float]) -> bool:
    """Whether an interval moved, or is narrower or wider, by more than is worth a word."""
    moved = abs(after["q50"] - before["q50"]) / before["sd"]
    wider = (after["q95"] - after["q05"]) / (before["q95"] - before["q05"])
    return bool(moved > MOVED or max(wider, 1.0 / wider) > WIDER)


def summary(runs: list[tuple[dict[str, Any], dict[str, Any]]]) -> dict[str, Any]:
    """Of pairs of before and after, one a seed: intervals of the first, cost and convergence of all.

    The mean ratio of the costs is over the fits, as logarithms, with its interval of 95 %.
    """
    first_before, first_after = runs[0]
    fits = {}
    for name, after in first_after.items():
        before = first_before[name]["parameters"]
        fits[name] = {
            parameter: {"before": ends(before[parameter]), "after": ends(p), "differs": differs(before[parameter], p)}
            for parameter, p in after["parameters"].items()
        }
    cost = {name: [[run[i][name]["draws_an_evaluation"] for run in runs] for i in (0, 1)] for name in fits}
    medians = np.array([np.median(of, axis=1) for of in cost.values()])
    log_ratios = np.log([np.array(new) / np.array(old) for old, new in cost.values()]).mean(axis=1)
    margin = stats.t.ppf(0.975, len(log_ratios) - 1) * stats.sem(log_ratios)
    ratio = np.exp(log_ratios.mean() + np.array([-margin, 0.0, margin])).tolist()
    return {
        "seeds": len(runs),
        "fits": fits,
        "not_converged": {
            when: [[name, seed] for seed, run in enumerate(runs) for name in fits if not run[i][name]["converged"]]
            for i, when in enumerate(("before", "after"))
        },
        "draws_an_evaluation": {
            name: f"{old:.2f} before, {new:.2f} after" for name, (old, new) in zip(cost, medians, strict=True)
        },
        "after_over_before": dict(zip(("low", "mean", "high"), ratio, strict=True)),
    }


def main() -> None:
    """Fit what is not done yet, a file a tree and seed, and write the summary."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--against", type=Path, required=True, metavar="CHECKOUT")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--rows", type=Path, default=Path("out/wires_before"), help="where an interrupted run goes on")
    parser.add_argument("--output", type=Path, default=Path("out/wires_before/wires_before.json"))
    parser.add_argument("--only", type=int, metavar="SEED", help="all fits of one seed, in this process")
    options = parser.parse_args()
    if options.only is not None:
        print(json.dumps(fits_here(options.only)))
        return
    from analyses.speed.checkouts import answered  # another checkout need not have them
    from wirebayes.io.run_folder import write_json

    options.rows.mkdir(parents=True, exist_ok=True)
    trees = {"before": options.against, "after": Path(__file__).parents[2]}
    runs = []
    for seed in range(options.seeds):
        pair = []
        for when, tree in trees.items():
            path = options.rows / f"{when}-seed{seed}.json"
            if not path.exists():
                given = ["--against", str(options.against), "--only", str(seed)]
                write_json(path, answered(__file__, given, tree))
            pair.append(json.loads(path.read_text(encoding="utf-8")))
        runs.append((pair[0], pair[1]))
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"], cwd=options.against, capture_output=True, text=True
    )
    result = {"against": commit.stdout.strip(), **summary(runs)}
    write_json(options.output, result)
    print(
        json.dumps(
            {key: result[key] for key in ("not_converged", "draws_an_evaluation", "after_over_before")}, indent=1
        )
    )


if __name__ == "__main__":
    main()
