"""What a run of a sampler came to: its costs apart, and the draws by which it is judged."""

import time
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from wirebayes.inference.convergence import ENOUGH, autocorrelation_steps, nested_r_hat, slowest_autocorrelation_steps

WANTED = 20_000
R_HAT = 1.01


@dataclass
class Costs:
    """Seconds of processor time and of the clock, by part: start, compile, burn, sample."""

    cpu: dict = field(default_factory=dict)
    wall: dict = field(default_factory=dict)

    @contextmanager
    def part(self, name):
        cpu, wall = time.process_time(), time.perf_counter()
        try:
            yield
        finally:
            self.cpu[name] = self.cpu.get(name, 0.0) + time.process_time() - cpu
            self.wall[name] = self.wall.get(name, 0.0) + time.perf_counter() - wall

    def move(self, wall_s, source, to):
        """Count a part of `source` (compilation within a burn-in, say) as `to`; processor time goes in proportion."""
        share = min(wall_s / self.wall[source], 1.0)
        for book in (self.cpu, self.wall):
            book[to] = book.get(to, 0.0) + share * book[source]
            book[source] *= 1.0 - share


def judged(costs, values, *, evaluations=None, kept_evaluations=None, divergences=0, weights_ess=None):
    """Effective draws, convergence and the rate with all costs counted, from (groups, steps, walkers, d) draws.

    The slowest parameter counts, by its mean or by a 5 % tail, whichever is known worse. Of many walkers their means
    tell the effective draws, of a few chains ArviZ's bulk and tail estimates, which know negative autocorrelation.
    `weights_ess` is for weighted independent draws (nested sampling). In what is returned, ``ess_of_means``
    counts means alone.
    """
    out = {"cpu_s": costs.cpu, "wall_s": costs.wall, "divergences": divergences}
    if weights_ess is None:
        if values.shape[2] > 1:
            draws = values.shape[0] * values.shape[1] * values.shape[2]
            of_means, ess = draws / autocorrelation_steps(values), draws / slowest_autocorrelation_steps(values)
        else:
            import arviz_stats

            chains = np.moveaxis(values[:, :, 0], 2, 0)
            of_means = np.array([arviz_stats.ess(each, method="bulk") for each in chains])
            ess = np.minimum(of_means, [arviz_stats.ess(each, method="tail", prob=(0.05, 0.95)) for each in chains])
        r_hat = float(_r_hat(values).max())
        steps_enough = values.shape[1] >= ENOUGH * values.shape[0] * values.shape[1] * values.shape[2] / ess.min()
        converged = r_hat <= R_HAT and divergences == 0 and bool(steps_enough or values.shape[2] == 1)
        out |= {"ess": float(ess.min()), "ess_of_means": float(of_means.min()), "r_hat": r_hat, "converged": converged}
    else:
        out |= {"ess": float(weights_ess), "ess_of_means": float(weights_ess), "r_hat": None, "converged": True}
    before = {
        k: sum(v for part, v in book.items() if part != "sample")
        for k, book in (("cpu", costs.cpu), ("wall", costs.wall))
    }
    for k, book in (("cpu", costs.cpu), ("wall", costs.wall)):
        sampling = out["ess"] / book["sample"]
        out[f"sampling_per_{k}_s"] = sampling
        out[f"all_costs_per_{k}_s"] = WANTED / (before[k] + WANTED / sampling)
    if evaluations is not None:
        burn, out["evaluations"] = evaluations - kept_evaluations, evaluations
        for of in ("ess", "ess_of_means"):
            per_kept = out[of] / kept_evaluations
            out |= {f"{of}_per_kept_evaluation": per_kept, f"{of}_per_evaluation": WANTED / (burn + WANTED / per_kept)}
    return out


def _r_hat(values):
    """Of walkers that know of one another: nested, by group. Of chains on their own: split, rank-normalised."""
    if values.shape[2] > 1:
        return nested_r_hat(values)
    import arviz_stats

    return np.array([arviz_stats.rhat(values[:, :, 0, k]) for k in range(values.shape[-1])])


def agreement(values, reference):
    """Largest difference of a parameter's mean, in reference standard deviations, and of its log standard deviation."""
    a, b = values.reshape(-1, values.shape[-1]), reference.reshape(-1, reference.shape[-1])
    return {
        "mean_in_sd": float(np.abs((a.mean(0) - b.mean(0)) / b.std(0)).max()),
        "log_sd": float(np.abs(np.log(a.std(0) / b.std(0))).max()),
    }


def looked_at(problem, theta):
    """The quantities judged: logarithms of positive parameters, the others as they are."""
    positive = np.array([n in problem.prior.logarithmic for n in problem.names])
    return np.where(positive, np.log(np.abs(theta) + 1e-300), theta)
