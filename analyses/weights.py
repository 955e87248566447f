"""Tests under weights: do intervals hold the truth at any scale, and does a pair of a step test and weights agree?

    python analyses/weights.py --tests 60        90 % intervals of dead-weight tests from thread to mooring rope
    python analyses/weights.py --pairs 10        one wire under steps, under weights, and both fitted together

Truths are drawn from ranges of real lines, not from the fitting prior: creep as a share of the elastic stretch, its
median time as a share of a hold, errors as shares of a step and of what is read. Each parameter is counted by itself.
"""

import argparse
from dataclasses import replace

import numpy as np

from wirebayes.inference.fit import fit
from wirebayes.io.experiment import Experiment
from wirebayes.io.readings import frozen
from wirebayes.model.problem import build
from wirebayes.simulation.synthetic import Bench, Truth, draw

SHARES = np.array([0.0, 0.02, 0.06, 0.15, 0.35, 0.7, 1.0])  # of a hold, when it is read
PLAIN = ("k1", "B", "U", "k2", "N", "preload", "sensor_sd", "setting_sd")


def wire(rng: np.random.Generator) -> tuple[dict[str, float], float, float, float]:
    """A line's parameters, its length in mm, its typical tension in N and how long it is held, s."""
    tension, length, hold_s = 10.0 ** rng.uniform((-3.0, 1.5, 1.0), (6.0, 4.5, 4.0))
    strain = 10.0 ** rng.uniform(-2.7, -1.5)  # at the typical tension: 0.2 to 3 %
    k1, U, N = tension / strain, rng.uniform(0.4, 1.2), rng.uniform(0.5, 1.1)
    creep = strain * length * 10.0 ** rng.uniform(-1.5, -0.3)
    k2 = np.log(2.0) / (hold_s * 10.0 ** rng.uniform(-1.2, 0.3)) ** N
    return {"k1": k1, "B": creep / tension**U, "U": U, "k2": k2, "N": N}, length, tension, hold_s


def under_weights(truth: dict[str, float], length: float, tension: float, hold_s: float, rng: np.random.Generator):
    """A dead-weight test of a wire, up and partly down again, and its own parameters."""
    holds = int(rng.integers(4, 9))
    weights = tension * np.linspace(0.4, 1.6, holds)
    if rng.random() < 0.5:
        weights = np.concatenate([weights, weights[-3:-1][::-1]])
    stretch = length * tension / truth["k1"]
    own = {"preload": stretch * rng.uniform(-0.2, 0.5), "sensor_sd": stretch * 10.0 ** rng.uniform(-3.3, -2.3),
           "setting_sd": tension * 1.2 / (holds - 1) * 10.0 ** rng.uniform(-2.5, -1.2)}  # fmt: skip
    bench = Bench("weights", "line", length, weights_N=weights.tolist(), resolution_mm=0.0,
                  times_s=(hold_s * SHARES).tolist())  # fmt: skip
    return bench, own


def under_steps(truth: dict[str, float], length: float, tension: float, hold_s: float, rng: np.random.Generator):
    """A step test of the same wire."""
    stretch = length * tension / truth["k1"]
    steps = stretch * np.linspace(0.3, 1.8, 8)
    own = {"preload": stretch * rng.uniform(0.0, 0.3), "sensor_sd": tension * 10.0 ** rng.uniform(-3.3, -2.3),
           "setting_sd": stretch * 0.2 * 10.0 ** rng.uniform(-2.5, -1.2)}  # fmt: skip
    bench = Bench("steps", "line", length, 0.0, displacements_mm=steps.tolist(), times_s=(hold_s * SHARES).tolist())
    return bench, own


def measured(bench: Bench, truth: dict[str, float], seed: int) -> Experiment:
    """The test with its readings."""
    (sample,) = draw([bench], Truth(truth), seed).problem.samples
    test = bench.experiment()
    rows = zip(test.holds, sample.readings[..., 0], sample.protocol.mask, strict=True)
    return replace(test, holds=tuple(replace(h, readings=frozen(y[kept].tolist())) for h, y, kept in rows))


def coverage(tests: int, seed: int) -> None:
    """Share of tests whose 90 % interval holds the truth, each parameter by itself."""
    inside: dict[str, list[bool]] = {name: [] for name in PLAIN}
    converged = 0
    for i in range(tests):
        rng = np.random.default_rng([seed, i])
        truth, length, tension, hold_s = wire(rng)
        bench, own = under_weights(truth, length, tension, hold_s, rng)
        done = fit(build([measured(bench, truth | own, i)]), i)
        converged += done.chains.converged
        low, high = np.quantile(done.flat, [0.05, 0.95], axis=0)
        for name, value in (truth | own).items():
            column = done.problem.names.index(name)
            inside[name].append(bool(low[column] <= value <= high[column]))
    print(f"{tests} tests under weights, {converged} converged; share of 90 % intervals that hold the truth")
    for name, hits in inside.items():
        print(f"  {name:<10} {np.mean(hits):.3f} ± {np.sqrt(np.mean(hits) * (1 - np.mean(hits)) / len(hits)):.3f}")


def pairs(count: int, seed: int) -> None:
    """Width of the interval of the creep after a hold at the typical tension, and how often it holds the truth."""
    widths, hits = np.zeros((count, 3)), np.zeros((count, 3), bool)
    for i in range(count):
        rng = np.random.default_rng([seed, i])
        truth, length, tension, hold_s = wire(rng)
        tests = []
        for make in (under_steps, under_weights):
            bench, own = make(truth, length, tension, hold_s, rng)
            tests.append(measured(bench, truth | own, i))

        def creep(B, U, k2, N, tension=tension, hold_s=hold_s):
            return np.log(B * tension**U * -np.expm1(-k2 * hold_s**N))

        for k, chosen in enumerate(([tests[0]], [tests[1]], tests)):
            done = fit(build(chosen), i)
            own = (done.flat[:, done.problem.names.index(name)] for name in ("B", "U", "k2", "N"))
            low, high = np.quantile(creep(*own), [0.05, 0.95])
            exact = creep(*(np.float64(truth[name]) for name in ("B", "U", "k2", "N")))
            widths[i, k], hits[i, k] = high - low, low <= exact <= high
    for k, name in enumerate(("steps", "weights", "together")):
        print(f"  {name:<9} median width of the log creep {np.median(widths[:, k]):.4f}, holds the truth in "
              f"{hits[:, k].sum()} of {count}")  # fmt: skip
    sharper = (widths[:, 2] < widths[:, :2].min(axis=1)).sum()
    print(f"  together sharper than either in {sharper} of {count}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tests", type=int, default=0)
    parser.add_argument("--pairs", type=int, default=0)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    if options.tests:
        coverage(options.tests, options.seed)
    if options.pairs:
        pairs(options.pairs, options.seed)
