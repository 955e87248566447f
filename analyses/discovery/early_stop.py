"""Does a global test that stops after half of its simulations decide as the one with all of them?

Files with nothing missing, and files with one small hidden effect, from the benchmark of hidden effects. Each is tested
with all simulations; on the way it is noted where the test would have stopped and with which p.

    python -m analyses.discovery.early_stop --clean 600 --output out/early-stop.jsonl
"""

from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from unittest.mock import patch

from analyses.hidden_effects.cases import SIZES, Plan, Spec, seal, specs
from analyses.hidden_effects.rates import rate
from analyses.options import study_options
from analyses.resumable import records
from analyses.speed.gate_cost import plain_fits
from wirebayes.discovery import global_test
from wirebayes.discovery.screening import GlobalTest
from wirebayes.discovery.settings import ALPHA, SIMULATIONS
from wirebayes.effects import CATALOGUE
from wirebayes.io.experiment import Experiment
from wirebayes.io.experiment_file import read_experiments

DELTAS = (3.0, 5.0)  # so small that many lie near the level


def looked(experiments: list[Experiment], seed: int, simulations: int) -> tuple[list[tuple[float, bool]], float, int]:
    """The p at each look with whether the test would go on, the last p, and its number of simulations."""
    blocks, rng = plain_fits(experiments, seed)
    looks: dict[int, tuple[float, bool]] = {}
    is_open = global_test.is_open

    def noted(test: GlobalTest, alpha: float, by_larger: float, made: int, asked: int) -> bool:
        goes_on = is_open(test, alpha, by_larger, made, asked)
        looks[made] = test.p, goes_on
        return goes_on or made < simulations

    with patch.object(global_test, "is_open", noted):
        test = global_test.examine(blocks, CATALOGUE, simulations, rng).test
    return [looks[count] for count in sorted(looks)], test.p, len(test.null)


def case(index: int, clean: int, seed: int, simulations: int) -> dict[str, Any]:
    """One file: p where the test stops, and with all simulations."""
    spec = plan(clean, seed)[index]
    with TemporaryDirectory() as folder:
        if not seal(spec, Path(folder) / "cases", Path(folder) / "sealed"):
            return {"index": index, "kind": spec.kind, "p": None}
        experiments = read_experiments(Path(folder) / "cases" / spec.key / "experiment.toml")
    looks, p, count = looked(experiments, int(spec.key, 16) % 2**31, simulations)
    (first, close), *_ = looks
    return {
        "index": index,
        "kind": spec.kind,
        "early": not close,
        "p": p if close else first,
        "p_of_all": p,
        "trials": count,
    }


def plan(clean: int, seed: int) -> list[Spec]:
    """The files: clean ones, and each effect at each size on several protocols."""
    fields = SIZES["small"].__dict__ | {"clean": clean, "single_deltas": DELTAS, "single_protocols": 6}
    return specs(Plan(**fields), seed, ("clean", "single"))


def main() -> None:
    """Run the cases and print how often the decisions differ."""
    parser = study_options(__doc__, clean=600)
    parser.add_argument("--simulations", type=int, default=SIMULATIONS)
    parser.add_argument("--seed", type=int, default=135)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--output", type=Path, required=True, help="a line of JSON for each file; resumes")
    options = parser.parse_args()
    run = partial(case, clean=options.clean, seed=options.seed, simulations=options.simulations)
    cases = [(i,) for i in range(len(plan(options.clean, options.seed)))]
    found = records(options.output, run, cases, workers=options.workers)
    for kind in ("clean", "single"):
        part = [r for r in found if r["kind"] == kind and r["p"] is not None]
        early = [r for r in part if r["early"]]
        differ = [r for r in early if (r["p"] <= ALPHA) != (r["p_of_all"] <= ALPHA)]
        near = sum(0.01 < r["p_of_all"] < 0.1 for r in part)
        print(
            f"{kind}: {len(part)} files, {len(early)} stop early, {len(differ)} of them decide otherwise; "
            f"{near} with .01 < p < .1"
        )
        alarms = rate(r["p"] <= ALPHA for r in part)
        if alarms:
            low, value, high = (100 * alarms[key] for key in ("low", "value", "high"))
            print(f"   p <= {ALPHA} in {alarms['k']}: {value:.1f} % [{low:.1f}, {high:.1f}]")
        for r in differ:
            print("   ", r)


if __name__ == "__main__":
    main()
