"""Is the p-value of the check at the end of every fit uniform when nothing is missing?

Tests are simulated on random wires and protocols (steps, times, unloading, slack, temperature logs), fitted with the
model that made them, and checked: the plain chain, the additive history, two samples of one line together, and the
chain with an effect inside. Prints how often p lies below some levels, with 95 % intervals, and a Kolmogorov-Smirnov
test of uniformity.

    python -m analyses.posterior.model_check --cases 600 --simulations 199 --output out/model-check
"""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from scipy import stats

from analyses.hidden_effects.rig import Rig
from analyses.hidden_effects.truth import draw_rig
from analyses.options import study_options
from analyses.resumable import records
from wirebayes.discovery.model_check import check_model
from wirebayes.effects import CATALOGUE
from wirebayes.inference.fit import seed_of
from wirebayes.io.experiment import Experiment
from wirebayes.io.experiment_file import read_experiments
from wirebayes.model.spec import ModelSpec
from wirebayes.results.jobs import Job
from wirebayes.simulation.synthetic import Bench, Truth, write_tests
from wirebayes.wire.effect import Effect, EventEffect
from wirebayes.wire.laws import History

KINDS = ("chain", "additive", "together", "effect")
ALONE = ("paper", "unloading", "uneven", "dense", "temperature", "slack")
LEVELS = (0.01, 0.04, 0.1, 0.25, 0.5, 0.75, 0.9)


def benches(rig: Rig, rng: np.random.Generator) -> list[Bench]:
    """The benches of a random rig, as our simulator takes them."""
    out = []
    for bench in rig.benches:
        times = [h.times_s or tuple(np.linspace(0.0, h.duration_s, 5)) for h in bench.holds]
        absent = frozenset(i + 1 for i, h in enumerate(bench.holds) if not h.times_s)
        log = tuple(rng.normal(20.0, 2.0, 8)) if bench.warming else ()
        moves = bench.displacements_mm.tolist()
        out.append(Bench(bench.name, "line", bench.length_mm, bench.resolution_N or 0.001, moves, times, absent, log))
    return out


def parameters(rig: Rig) -> dict[str, float]:
    """The rig's true parameters by our names; B belongs to the mean length of the samples."""
    (wire,) = set(rig.wires.values())
    lengths = [b.length_mm for b in rig.benches]
    longer = float(np.exp(np.mean(np.log(lengths)))) / lengths[0]
    out = {"k1": wire.k1, "B": wire.B * longer, "U": wire.U, "k2": wire.k2, "N": wire.N}
    several = len(lengths) > 1
    for b in rig.benches:
        mark = f"[{b.name}]" if several else ""
        out |= {f"preload{mark}": b.preload_mm, f"sensor_sd{mark}": b.sensor_sd, f"setting_sd{mark}": b.setting_sd}
    return out


def hidden(made: Sequence[Bench], rng: np.random.Generator) -> Effect:
    """An effect of the catalogue that the test could show."""
    protocols = [b.experiment().protocol() for b in made]
    kinds = [k for k in CATALOGUE.values() if not issubclass(k, EventEffect)]
    forms = [v for kind in kinds for v in kind.variants(protocols)]
    return forms[rng.integers(len(forms))]


def stays_taut(experiments: Sequence[Experiment]) -> bool:
    """No hold that pulled at first fell slack, and something was measured: nobody would go on with another test."""
    holds = [h for e in experiments for h in e.recorded_holds]
    kept = [h.tension_N[-1] >= 0.05 * h.tension_N[0] for h in holds if h.tension_N[0] > 1.0]
    return all(kept) and max(h.tension_N.max() for h in holds) > 0.5


def case(kind: str, index: int, simulations: int) -> dict[str, Any]:
    """Simulate, fit and check one test; the same whatever else is run."""
    rng = np.random.default_rng(seed_of(1, "model check", kind, str(index)))
    while True:
        protocol = "two_lengths" if kind == "together" else ALONE[index % len(ALONE)]
        rig = draw_rig(rng, protocol)
        made = benches(rig, rng)
        effects = (hidden(made, rng),) if kind == "effect" else ()
        history: History = "additive" if kind == "additive" else "saturating"
        with TemporaryDirectory() as folder:
            write_tests(Path(folder), made, Truth(parameters(rig), effects, history=history), int(rng.integers(2**31)))
            experiments = tuple(read_experiments(Path(folder) / "experiments.toml"))
        if stays_taut(experiments):
            break
    exponent = stats.norm(1.0, 1.0) if kind == "together" else 1.0
    keys = tuple(e.key for e in effects)
    job = Job("", experiments, keys, spec=ModelSpec(history=history, length_exponent=exponent))
    check = check_model(job, index, simulations=simulations)
    about = {"kind": kind, "index": index, "protocol": protocol, "effects": keys, "reason": check.reason}
    return about | {"p": check.p, "simulations": check.simulations, "gross_errors": len(check.gross_errors)}


def table(records: Sequence[dict[str, Any]]) -> str:
    """Share of p at or below each level, with 95 % Clopper-Pearson intervals."""
    lines = []
    for kind in (*KINDS, "all"):
        own = [r for r in records if kind in (r["kind"], "all") and r["p"] is not None]
        p = np.array([r["p"] for r in own])
        if not len(p):
            continue
        # a share of simulations, of which half the step is due to counting the readings among them
        test = stats.kstest(p - 0.5 / (1.0 + np.array([r["simulations"] for r in own])), "uniform").pvalue
        struck = sum(r["gross_errors"] > 0 for r in own)
        lines.append(f"{kind}: {len(p)} checks, Kolmogorov-Smirnov p = {test:.3f}, {struck} with a gross error")
        for level in LEVELS:
            low, high = stats.binomtest(int((p <= level).sum()), len(p)).proportion_ci()
            lines.append(f"  p <= {level:<4}  {np.mean(p <= level):.3f}  [{low:.3f}, {high:.3f}]")
    return "\n".join(lines)


def main() -> None:
    """Run what is not done yet, a line a case, and print the table."""
    parser = study_options(__doc__, cases=600, simulations=199)
    parser.add_argument("--kinds", nargs="+", default=list(KINDS), choices=KINDS)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--output", type=Path, default=Path("out/model-check"))
    options = parser.parse_args()
    path = options.output / f"checks-{options.simulations}.jsonl"
    cases = [(kind, index) for index in range(options.cases) for kind in options.kinds]
    one = partial(case, simulations=options.simulations)
    print(table(records(path, one, cases, ("kind", "index"), options.workers)))


if __name__ == "__main__":
    main()
