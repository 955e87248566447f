"""Do the bands of the smooth discrepancy, which stands for something unknown, hold the readings of later holds?

``python -m analyses.discovery.unknown_bands --files 120``. Files of the hidden-effect benchmark, each with one effect
that the catalogue has or not. The plain model, alone and with the smooth discrepancy of the answer *unknown*, is fitted
to the first two thirds of the holds, and asked for the others.
"""

from collections.abc import Sequence
from dataclasses import asdict
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from analyses.hidden_effects.cases import SIZES, Case, Spec, build, specs
from analyses.hidden_effects.files import write_experiments
from analyses.resumable import study
from wirebayes.discovery import held_out, shrinking
from wirebayes.inference.laplace_fit import fitted
from wirebayes.io.experiment import Experiment
from wirebayes.io.experiment_file import read_experiments
from wirebayes.model.spec import PLAIN_SPEC

PROTOCOLS = ("paper", "uneven", "dense", "unloading")  # of one test each
DELTAS = (10.0, 20.0)  # smaller effects are often not detected, and larger ones often named
MISSED = 0.5  # share of later readings in the plain model's bands, below which these miss
DRAWS = 2000  # of a bootstrap


@cache
def candidates(seed: int) -> list[Spec]:
    """The benchmark's files of a seed, in a random order that the seed determines."""
    every = specs(SIZES["full"], seed, ("single", "foreign"), PROTOCOLS)
    wanted = [spec for spec in every if spec.delta in DELTAS]
    order = np.random.default_rng(seed).permutation(len(wanted))
    return [wanted[i] for i in order]


def measured(case: Case) -> Experiment:
    """The test of a file, as a user would read it."""
    with TemporaryDirectory() as folder:
        file = write_experiments(Path(folder), case.rig, case.readings, list(case.temperatures))
        [test] = read_experiments(file)
    return test


def one(seed: int, index: int) -> dict[str, Any]:
    """How both models predict the later holds of one file; nothing where no protocol shows the effect at that size."""
    spec = candidates(seed)[index]
    row = {"index": index, **asdict(spec)}
    case = build(spec)
    if case is None:
        return row
    test = measured(case)
    train = held_out.last_third(test)
    first = test.train(train)
    rng = np.random.default_rng(index)
    block = fitted([first], (), PLAIN_SPEC, rng)
    unknown = shrinking.discrepancy(first, shrinking.residual_rms(block, test.name))
    for name, effects in (("plain", ()), ("smooth", (unknown,))):
        [found] = held_out.predicted([test], [train], effects, block, rng)
        row[name] = {"inside": found.inside, "rmse_N": found.rmse_N, "elpd": float(found.elpd.sum())}
    return row


def summary(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Coverage by both models and the ratio of their errors: of all files, by protocol, and where plain bands miss."""
    within = [row for row in rows if "plain" in row]
    groups = {"all": within}
    for protocol in PROTOCOLS:
        groups[protocol] = [row for row in within if row["protocol"] == protocol]
    groups["missed"] = [row for row in within if row["plain"]["inside"] < MISSED]
    found = {name: _of_group(members) for name, members in groups.items()}
    return {"missed_below": MISSED, "out_of_reach": len(rows) - len(within), "groups": found}


def _of_group(rows: Sequence[dict[str, Any]]) -> dict[str, Any] | None:
    if not rows:
        return None
    inside = {name: _mean([row[name]["inside"] for row in rows]) for name in ("plain", "smooth")}
    ratios = [row["smooth"]["rmse_N"] / row["plain"]["rmse_N"] for row in rows]
    low, middle, high = np.quantile(ratios, [0.1, 0.5, 0.9]).tolist()
    return {"files": len(rows), "inside": inside, "error_ratio": {"median": middle, "q10": low, "q90": high}}


def _mean(values: Sequence[float]) -> dict[str, float]:
    """A mean over files, with a 90 % bootstrap interval."""
    rng = np.random.default_rng(0)
    each = np.asarray(values)
    again = each[rng.integers(len(each), size=(DRAWS, len(each)))].mean(axis=1)
    low, high = np.quantile(again, [0.05, 0.95])
    return {"value": float(each.mean()), "low": float(low), "high": float(high)}


if __name__ == "__main__":
    study(__doc__, "unknown_bands", ("files", 120), one, summary)
