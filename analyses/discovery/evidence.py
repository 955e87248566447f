"""Is the evidence that `discover` compares right? Refits of hidden effects against integrals by weighted draws.

Files of the benchmark of hidden effects, of one test and one effect each. The log Bayes factor of the effect against
the plain model is taken from its refit, as a search does it, and from two integrals by importance sampling, each
checked by a second search for modes. Only files in which both integrals can be trusted count.

    python -m analyses.discovery.evidence --seed 6100 --output out/evidence
"""

import argparse
import json
from itertools import repeat
from pathlib import Path
from typing import Any

import numpy as np

from analyses.hidden_effects.cases import SIZES, Spec, seal, specs
from analyses.hidden_effects.catalogue import EFFECTS
from wirebayes.discovery import screening
from wirebayes.discovery.linear_scan import expand, scan
from wirebayes.discovery.name_evidence import weigh_names
from wirebayes.discovery.refit import Refit
from wirebayes.effects import CATALOGUE
from wirebayes.inference.laplace_fit import LaplaceFit, fitted
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.inference.weighted_posterior import witnessed
from wirebayes.io.experiment_file import read_experiments
from wirebayes.model.problem import Problem
from wirebayes.model.spec import PLAIN_SPEC
from wirebayes.processes.workers import workers

PROTOCOLS = "paper", "unloading", "uneven", "dense", "slack"
DRAWS = 500.0  # effective ones of an integral: it is then known to some hundredths of a nat
FAR = 1.0, 3.0  # nats


def main() -> None:
    """Print a line a file, and write all of them and a summary."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--seed", type=int, default=6100)
    options.add_argument("--output", type=Path, default=Path("out/evidence"))
    chosen = options.parse_args()
    wanted = specs(SIZES["small"], chosen.seed, ("single",), PROTOCOLS, tuple(EFFECTS))
    rows = []
    with workers() as parallel_map:
        for row in parallel_map(compared, wanted, repeat(chosen.output)):
            if row is not None:
                rows.append(row)
                print(row, flush=True)
    result = summary(rows)
    print(result)
    (chosen.output / "evidence.json").write_text(json.dumps({**result, "rows": rows}, indent=1), encoding="utf-8")


def compared(spec: Spec, folder: Path) -> dict[str, Any] | None:
    """Both log Bayes factors of the effect that a file hides; None where it is out of reach or not in the catalogue."""
    (name,) = spec.names
    if name not in CATALOGUE or not seal(spec, folder / "cases", folder / "sealed"):
        return None
    experiments = read_experiments(folder / "cases" / spec.key / "experiment.toml")
    plain = fitted(experiments, (), PLAIN_SPEC, np.random.default_rng(0))
    refit = _refit(plain, name)
    if refit is None:
        return None
    without = log_integral(plain.target.problem)
    beside = log_integral(plain.problem_with(refit.effect))
    if without is None or beside is None:
        return None
    by_draws = beside - without
    return {"key": spec.key, "protocol": spec.protocol, "effect": name, "refit": refit.log_bayes, "draws": by_draws}


def _refit(plain: LaplaceFit, name: str) -> Refit | None:
    """The best form of an effect, refitted as a search does it; None where this test has no form of it."""
    probes, candidates = screening.candidate_probes([plain], {name: CATALOGUE[name]})
    if not candidates:
        return None
    scanned = scan(expand(plain.target, plain.z, probes))
    found = weigh_names([plain], probes, candidates, [scanned])
    winners = found.winners.get(name, [])
    return winners[0] if winners else None


def log_integral(problem: Problem) -> float | None:
    """Log integral of a posterior density; None where the weights cannot be trusted."""
    found = witnessed(LogPosterior(problem), np.random.default_rng(0), DRAWS)
    return float(found.log_integral[0]) if found.settled[0] else None


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Quantiles of refit less draws, and how many are farther off than so many nats."""
    off = np.array([row["refit"] - row["draws"] for row in rows])
    low, middle, high = np.quantile(off, [0.05, 0.5, 0.95])
    far = {f"{limit:g}": int((np.abs(off) > limit).sum()) for limit in FAR}
    return {"files": len(rows), "q05": float(low), "median": float(middle), "q95": float(high), "farther_than": far}


if __name__ == "__main__":
    main()
