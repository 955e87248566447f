"""What a likelihood evaluation costs: against readings, holds, experiments and effects, and where numpy computes it;
memory; its share of a fit; and how many effective draws it gives on the paper's wires, with single effects too.

    python -m analyses.benchmarks.cost --output out/benchmarks

Times are of processor, the least of several interleaved repeats; costs are printed as ratios to the first row.
"""

import argparse
import time
import timeit
import tracemalloc
from functools import partial
from pathlib import Path
from unittest.mock import patch

import numpy as np

from analyses.benchmarks import parsed
from analyses.benchmarks.plain import ours
from wirebayes.effects import CATALOGUE, effect_named
from wirebayes.inference.fit import fit_problem
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.io.experiment import Experiment
from wirebayes.io.paper import experiments
from wirebayes.io.readings import Hold
from wirebayes.io.run_folder import write_json
from wirebayes.model.build import build
from wirebayes.model.sample import Likelihood
from wirebayes.model.spec import ModelSpec
from wirebayes.wire import compiled

BATCH, REPEATS, SEEDS = 256, 7, 20
DEAREST = ("toe", "superposition")  # effects whose evaluations cost most
BATCHES = (64, 256, 1024)  # the sampler cuts larger ones into pieces
PER_EVALUATION = tuple(
    f"{of}_per_{which}" for of in ("ess", "ess_of_means") for which in ("kept_evaluation", "evaluation")
)
LIKELIHOODS: tuple[Likelihood, ...] = ("chain", "hold")


def staircase(holds, readings, name="made"):
    """An experiment of equal steps; the readings' values do not matter for the time."""
    times = np.linspace(0.0, 120.0, readings)
    return Experiment(
        name=name, material="line", length_mm=1000.0, resolution=0.01, source=Path("made"),
        holds=tuple(Hold(number=j + 1, setting=1.0 + 10.0 * j / holds, duration_s=120.0, time_s=times,
                         readings=5.0 + 10.0 * j / holds + np.exp(-times / 30.0)) for j in range(holds)),
    )  # fmt: skip


def timed(problems, seed=0):
    """Per problem: microseconds of processor per evaluation in batches of 256, and bytes at the peak of one batch."""
    prepared = []
    for problem in problems:
        theta = problem.prior.rvs(BATCH, np.random.default_rng(seed))
        problem.log_likelihood(theta)
        tracemalloc.start()
        problem.log_likelihood(theta)
        prepared.append((problem, theta, tracemalloc.get_traced_memory()[1]))
        tracemalloc.stop()
    best = np.full(len(problems), np.inf)
    for _ in range(REPEATS):
        for i, (problem, theta, _) in enumerate(prepared):
            began, calls = time.process_time(), 0
            while time.process_time() - began < 0.02:
                problem.log_likelihood(theta)
                calls += 1
            best[i] = min(best[i], (time.process_time() - began) / calls)
    return [(1e6 * b / BATCH, peak) for b, (_, _, peak) in zip(best, prepared, strict=True)]


def growth(title, sizes, problems):
    """Print and return the cost against a size; the last column is cost over size, relative to the largest."""
    found = timed(problems)
    print(f"\n{title:>14s} {'us/evaluation':>14s} {'ratio':>8s} {'ratio/size':>11s} {'MB a batch':>11s}")
    rows = []
    for size, (cost, peak) in zip(sizes, found, strict=True):
        per = (cost / found[-1][0]) / (size / sizes[-1])
        rows.append({"size": size, "us": cost, "ratio": cost / found[0][0], "per_size": per, "peak_bytes": peak})
        print(f"{size:14d} {cost:14.2f} {cost / found[0][0]:8.2f} {per:11.2f} {peak / 1e6:11.2f}", flush=True)
    return rows


def share_in_likelihood(problem, seed):
    """Share of a fit's processor time within the likelihood, within the target around it, and elsewhere."""
    spent = {"likelihood": 0.0, "target": 0.0}
    kind, likelihood, target = type(problem), type(problem).log_likelihood, LogPosterior.__call__

    def watch(function, key):
        def watched(*given):
            began = time.process_time()
            try:
                return function(*given)
            finally:
                spent[key] += time.process_time() - began

        return watched

    kind.log_likelihood, LogPosterior.__call__ = watch(likelihood, "likelihood"), watch(target, "target")
    try:
        began = time.process_time()
        fit_problem(problem, seed)
        whole = time.process_time() - began
    finally:
        kind.log_likelihood, LogPosterior.__call__ = likelihood, target
    return {
        "fit_cpu_s": whole,
        "likelihood": spent["likelihood"] / whole,
        "coordinates_and_prior": (spent["target"] - spent["likelihood"]) / whole,
        "sampler": 1.0 - spent["target"] / whole,
    }


def against_numpy(wire):
    """Print and return processor time where numpy computes over that of compiled code, by effect and batch."""
    print(f"\n{'numpy over compiled':28s}" + "".join(f"{n:>8d}" for n in BATCHES))
    out = {}
    models = {"none": build([wire])} | {key: build([wire], [effect_named(key)]) for key in DEAREST}
    for key, problem in models.items():
        out[key] = [_numpy_over_compiled(partial(problem.log_likelihood, _prior_draws(problem, n))) for n in BATCHES]
        print(f"  {key:26s}" + "".join(f"{ratio:8.1f}" for ratio in out[key]), flush=True)
    return out


def _numpy_over_compiled(compute):
    """Processor time of a function without the compiled kernel over that with it."""
    best = []
    for kernel in (compiled.kernel, None):
        with patch.object(compiled, "kernel", kernel):
            compute()
            best.append(min(timeit.repeat(compute, number=5, repeat=REPEATS, timer=time.process_time)))
    return best[1] / best[0]


def _prior_draws(problem, count):
    return problem.prior.rvs(count, np.random.default_rng(0))


def with_effects(keys):
    """Print and return effective draws per evaluation, all counted, of models with one effect: by wire and effect."""
    print("\neffective draws per evaluation with one effect, all counted (one seed; ! not converged)")
    out = {}
    for wire in experiments():
        each = {key: ours(build([wire], [effect_named(key)]), 0, 0.0)[0] for key in keys}
        out[wire.name] = {key: (r["ess_per_evaluation"], r["converged"]) for key, r in each.items()}
        values = [value for value, _ in out[wire.name].values()]
        told = (f"{key} {value:.3f}{'' if good else ' !'}" for key, (value, good) in out[wire.name].items())
        print(f"  {wire.name}: median {np.median(values):.3f}, least {min(values):.3f};", ", ".join(told), flush=True)
    return out


def draws(problem):
    """Effective draws per likelihood evaluation for 20,000 of them: of the kept ones and all; by means alone."""
    runs = [ours(problem, seed, 0.0)[0] for seed in range(SEEDS)]
    return {key: [r[key] for r in runs] for key in PER_EVALUATION}


def main():
    options = parsed(argparse.ArgumentParser(description=__doc__.splitlines()[0]))
    out = {}
    sizes = [5, 15, 50, 150, 500]
    out["readings"] = growth("readings a hold", sizes, [build([staircase(12, r)]) for r in sizes])
    sizes = [5, 15, 50, 200]
    out["holds"] = growth("holds", sizes, [build([staircase(h, 5)]) for h in sizes])
    sizes = [1, 5, 20, 200]
    out["experiments"] = growth(
        "experiments", sizes, [build([staircase(12, 5, f"made-{i}") for i in range(e)]) for e in sizes]
    )
    wire = experiments()[0]
    singles = [k for k in CATALOGUE if "@" not in k and _plain(k)]
    print("\neffect: cost over that of no effect")
    found = timed([build([wire])] + [build([wire], [effect_named(k)]) for k in singles])
    out["effects"] = {k: cost / found[0][0] for k, (cost, _) in zip(["none", *singles], found, strict=True)}
    for key, ratio in out["effects"].items():
        print(f"  {key:28s} {ratio:6.2f}")
    out["against_numpy"] = against_numpy(wire)
    print("\nshare of a fit")
    out["share"] = {}
    for likelihood in LIKELIHOODS:
        out["share"][likelihood] = share = share_in_likelihood(build([wire], spec=ModelSpec(likelihood=likelihood)), 0)
        print(f"  {wire.name}, {likelihood}: " + ", ".join(f"{k} {v:.2f}" for k, v in share.items()), flush=True)
    print("\neffective draws per evaluation: after burn-in, and all counted; the same of means alone")
    print("(least, median, largest of the seeds)")
    out["draws"] = {}
    for experiment in experiments():
        for likelihood in LIKELIHOODS:
            found = out["draws"][f"{experiment.name}, {likelihood}"] = draws(
                build([experiment], spec=ModelSpec(likelihood=likelihood))
            )
            cells = [" ".join(f"{v:.3f}" for v in (min(x), np.median(x), max(x))) for x in found.values()]
            print(f"  {experiment.name + ', ' + likelihood:24s}", "    ".join(cells), flush=True)
    out["with_effects"] = with_effects(singles)
    write_json(options.output / "cost.json", out)


def _plain(key):
    try:
        effect_named(key)
    except Exception:  # effects that want a hold or a parameter named
        return False
    return True


if __name__ == "__main__":
    main()
