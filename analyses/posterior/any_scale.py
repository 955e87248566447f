"""Do 90 % intervals hold the truth at any scale, under steps and under weights, with rests that are recorded or none?

``python -m analyses.posterior.any_scale --tests 300``: one test after the other from thread under millinewtons to
mooring rope under meganewtons; every third is under weights, every third of steps and of weights rests before each
move. All are fitted with the default priors. Truths come from ranges of real lines, not from these priors: creep as a
share of the elastic stretch, its median time as a share of a hold, errors as shares of a step and of what is read.
Each parameter is counted by itself.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from analyses.resumable import study
from wirebayes.inference.fit import fit_problem, seed_of
from wirebayes.inference.policy import Policy
from wirebayes.io.experiment import Experiment
from wirebayes.model.build import build
from wirebayes.numeric.frozen import frozen
from wirebayes.simulation.synthetic import Bench, Truth, draw

SHARES = np.array([0.0, 0.02, 0.06, 0.15, 0.35, 0.7, 1.0])  # of a hold, when it is read
REST = 1.4  # of a hold, until the next move, where the wire rests before it
PLAIN = ("k1", "B", "U", "k2", "N", "preload", "sensor_sd", "setting_sd")
POLICY = Policy(walkers=64, round_draws=2048, ess=1000.0, most_steps=800)


@dataclass(frozen=True)
class Line:
    """A line and how it is tested.

    Attributes
    ----------
    truth : dict
        ``k1``, ``B``, ``U``, ``k2``, ``N``.
    length_mm, tension_N, hold_s : float
        Its length, the typical tension, how long it is held.
    """

    truth: dict[str, float]
    length_mm: float
    tension_N: float
    hold_s: float

    @property
    def stretch_mm(self) -> float:
        """Elastic stretch at the typical tension."""
        return self.length_mm * self.tension_N / self.truth["k1"]


def line(rng: np.random.Generator) -> Line:
    """A line between thread and mooring rope."""
    tension, length, hold_s = 10.0 ** rng.uniform((-3.0, 1.5, 1.0), (6.0, 4.5, 4.0))
    strain = 10.0 ** rng.uniform(-2.7, -1.5)  # at the typical tension: 0.2 to 3 %
    k1, U, N = tension / strain, rng.uniform(0.4, 1.2), rng.uniform(0.5, 1.1)
    creep = strain * length * 10.0 ** rng.uniform(-1.5, -0.3)
    k2 = np.log(2.0) / (hold_s * 10.0 ** rng.uniform(-1.2, 0.3)) ** N
    return Line({"k1": k1, "B": creep / tension**U, "U": U, "k2": k2, "N": N}, length, tension, hold_s)


def under_weights(made: Line, shares: Sequence[float], rng: np.random.Generator) -> tuple[Bench, dict[str, float]]:
    """A dead-weight test, one in two partly down again, and the parameters of its own."""
    holds = int(rng.integers(4, 9))
    weights = made.tension_N * np.linspace(0.4, 1.6, holds)
    if rng.random() < 0.5:
        weights = np.concatenate([weights, weights[-3:-1][::-1]])
    step = made.tension_N * 1.2 / (holds - 1)
    own = {
        "preload": made.stretch_mm * rng.uniform(-0.2, 0.5),
        "sensor_sd": made.stretch_mm * _small(rng, -3.3, -2.3),
        "setting_sd": step * _small(rng, -2.5, -1.2),
    }
    times = (made.hold_s * np.array(shares)).tolist()
    return Bench("weights", "line", made.length_mm, weights_N=weights.tolist(), resolution_mm=0.0, times_s=times), own


def under_steps(made: Line, shares: Sequence[float], rng: np.random.Generator) -> tuple[Bench, dict[str, float]]:
    """A step test, and the parameters of its own."""
    holds = int(rng.integers(6, 11))
    steps = made.stretch_mm * np.linspace(0.3, 1.8, holds)
    own = {
        "preload": made.stretch_mm * rng.uniform(0.0, 0.3),
        "sensor_sd": made.tension_N * _small(rng, -3.3, -2.3),
        "setting_sd": made.stretch_mm * 1.5 / (holds - 1) * _small(rng, -2.5, -1.2),
    }
    times = (made.hold_s * np.array(shares)).tolist()
    return Bench("steps", "line", made.length_mm, 0.0, displacements_mm=steps.tolist(), times_s=times), own


def _small(rng: np.random.Generator, low: float, high: float) -> float:
    return float(10.0 ** rng.uniform(low, high))


def measured(bench: Bench, truth: dict[str, float], seed: int, *, rests: bool = False) -> Experiment:
    """The test with its readings; where it rests, the last moment of each hold is known, and not read.

    Parameters
    ----------
    bench : Bench
    truth : dict
        All parameters.
    seed : int
    rests : bool
    """
    (sample,) = draw([bench], Truth(truth), seed).problem.samples
    test = bench.experiment()
    holds = []
    for hold, y, mask in zip(test.holds, sample.readings[..., 0], sample.protocol.mask, strict=True):
        count = int(mask.sum()) - rests
        holds.append(replace(hold, time_s=frozen(hold.time_s[:count].tolist()), readings=frozen(y[:count].tolist())))
    return replace(test, holds=tuple(holds))


@dataclass(frozen=True)
class Made:
    """A simulated test with its truth."""

    test: Experiment
    truth: dict[str, float]
    line: Line
    weights: bool
    rests: bool

    @property
    def about(self) -> dict[str, Any]:
        """What a record says of it."""
        return {"weights": self.weights, "rests": self.rests, "tension_N": self.line.tension_N}


def made_test(own_seed: int, index: int) -> Made:
    """A line and its test; the number decides whether it is under weights and whether it rests before each move."""
    rng = np.random.default_rng(own_seed)
    made = line(rng)
    weights, rests = index % 3 == 0, index // 3 % 3 == 0
    shares = [*SHARES, REST] if rests else list(SHARES)
    bench, own = (under_weights if weights else under_steps)(made, shares, rng)
    truth = made.truth | own
    return Made(measured(bench, truth, own_seed, rests=rests), truth, made, weights, rests)


def one(seed: int, index: int) -> dict[str, Any]:
    """One test: what was done, and which 90 % intervals hold the truth."""
    own_seed = seed_of(seed, "any scale", str(index))
    made = made_test(own_seed, index)
    done = fit_problem(build([made.test]), own_seed, policy=POLICY)
    low, high = np.quantile(done.flat, [0.05, 0.95], axis=0)
    columns = {name: done.problem.names.index(name) for name in PLAIN}
    inside = {name: bool(low[i] <= made.truth[name] <= high[i]) for name, i in columns.items()}
    return {"index": index, **made.about, "converged": done.converged, "inside": inside}


def kinds_of(rows: Sequence[dict[str, Any]]) -> dict[str, list[dict[str, Any]]]:
    """The records of all tests, and of those of each kind."""
    weights, rests = ([row for row in rows if row[kind]] for kind in ("weights", "rests"))
    steps = [row for row in rows if not row["weights"]]
    return {"all": list(rows), "weights": weights, "steps": steps, "rests": rests}


def summary(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Coverage of each parameter, over all tests and in each kind of test."""
    out: dict[str, Any] = {"tests": len(rows), "not_converged": sum(not row["converged"] for row in rows)}
    for kind, chosen in kinds_of(rows).items():
        hits = {name: [row["inside"][name] for row in chosen] for name in PLAIN}
        out[kind] = {"tests": len(chosen), **{name: float(np.mean(hit)) for name, hit in hits.items()}}
    return out


if __name__ == "__main__":
    study(__doc__, "any_scale", ("tests", 300), one, summary)
