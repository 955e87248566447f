"""What do a wire's first holds say is missing, and do integrals by weighted draws say the same?

For each number of first holds: what `discover` names on them, the error on the later holds before and after, and the
log evidence of each model less that of the plain one. The evidence comes from importance sampling alone, without the
search that `discover` makes.

    python -m analyses.discovery.first_holds --wire kite-1.5m --holds 5 6 --models toe toe+late_clock
"""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np

from analyses.discovery.evidence import log_integral
from analyses.discovery.real_wires import unseen
from wirebayes.effects import effect_named
from wirebayes.inference.laplace_fit import fitted
from wirebayes.io import paper
from wirebayes.io.experiment import Experiment
from wirebayes.model.spec import PLAIN_SPEC


def main() -> None:
    """Print a line a number of holds, and one for each model's evidence."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--wire", default="kite-1.5m", help="a wire of the paper")
    options.add_argument("--holds", type=int, nargs="+", default=[5, 6], help="how many first holds")
    options.add_argument("--models", nargs="+", default=["toe", "late_clock", "toe+late_clock"], metavar="EFFECT+...")
    options.add_argument("--output", type=Path)
    chosen = options.parse_args()
    wires = {wire.name: wire for wire in paper.experiments()}
    wire = wires[chosen.wire]
    results = {}
    for holds in chosen.holds:
        named = unseen(wire, holds)
        evidence = log_evidence(wire.train(holds), chosen.models)
        results[holds] = {"named": named, "log_evidence": evidence}
        print(f"{wire.name}, first {holds} holds: {said(named)}", flush=True)
        for model, log_bayes in evidence.items():
            print(f"  {model}: {spoken(log_bayes)}", flush=True)
    if chosen.output:
        chosen.output.write_text(json.dumps(results, indent=1, default=float) + "\n", encoding="utf-8")


def log_evidence(experiment: Experiment, models: list[str]) -> dict[str, float | None]:
    """Log evidence of each model less that of the plain one, nats; None where an integral cannot be trusted."""
    plain = _integral_of(experiment, ())
    found = {}
    for model in models:
        beside = _integral_of(experiment, tuple(model.split("+")))
        found[model] = None if plain is None or beside is None else beside - plain
    return found


def _integral_of(experiment: Experiment, names: tuple[str, ...]) -> float | None:
    """Log integral of the posterior density of a model with these effects."""
    effects = tuple(effect_named(name) for name in names)
    fit = fitted([experiment], effects, PLAIN_SPEC, np.random.default_rng(0))
    return log_integral(fit.target.problem)


def said(named: dict[str, Any]) -> str:
    """A verdict, what it accepted, and the error on later holds before and after."""
    accepted = ", ".join(named["accepted"]) or "nothing"
    error = f"{named['plain_rmse_N']:.2f} -> {named['final_rmse_N']:.2f} N"
    return f"{named['verdict']}, accepted {accepted}; error on later holds {error}"


def spoken(log_bayes: float | None) -> str:
    """A log Bayes factor in words."""
    return "its integral cannot be trusted" if log_bayes is None else f"{log_bayes:+.1f} nats beside the plain model"


if __name__ == "__main__":
    main()
