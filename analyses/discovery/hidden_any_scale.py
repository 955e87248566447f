"""Hidden effects at any scale: how often does `discover` see and name them, under steps and under weights?

``python -m analyses.discovery.hidden_any_scale --tests 300``. Lines from thread to mooring rope, held for seconds or
days and read rarely or often, every second one under weights, each with one hidden effect of the catalogue. The tests
come from an independent program (`analyses.hidden_effects.scaled_draws`), which also says which names look alike there.
"""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from analyses.hidden_effects.rates import rate
from analyses.hidden_effects.scaled_cases import ScaledCase, group
from analyses.hidden_effects.scaled_draws import DELTAS, draw_case, draw_hidden
from analyses.hidden_effects.scaled_law import Hidden
from analyses.resumable import study
from wirebayes.discovery.search import investigate
from wirebayes.discovery.settings import Settings
from wirebayes.inference.fit import seed_of
from wirebayes.io.experiment import Experiment
from wirebayes.io.readings import Hold
from wirebayes.json_files.discovery import ExperimentFindings
from wirebayes.numeric.frozen import frozen
from wirebayes.wire.protocol import Control

SIMULATIONS = 199  # refitted data sets behind a p, as in the benchmark of hidden effects
FIRST_C = 20.0  # where a temperature is logged


def measured(case: ScaledCase, hidden: Hidden, rng: np.random.Generator) -> Experiment:
    """The test with its readings."""
    test = case.test
    control: Control = "force" if test.weights else "displacement"
    ends = np.cumsum([len(times) for times in test.times_s])[:-1]
    each = np.split(case.measured(hidden, rng), ends)
    holds = []
    for j, y in enumerate(each):
        logged = None if test.warming_K is None else frozen((FIRST_C + test.warming_K[j]).tolist())
        times, read = frozen(test.times_s[j].tolist()), frozen(y.tolist())
        duration, start = float(test.durations_s[j]), float(test.starts_s[j])
        holds.append(Hold(j + 1, float(test.settings[j]), duration, times, read, logged, start, control))
    file = Path("line.toml")
    return Experiment("line", "line", test.length_mm, case.resolution, tuple(holds), file, control=control)


def one(seed: int, index: int) -> dict[str, Any]:
    """One test: what was hidden, and what the search says; without an effect where none can be large enough."""
    own_seed = seed_of(seed, "hidden at any scale", str(index))
    rng = np.random.default_rng(own_seed)
    case = draw_case(rng, weights=index % 2 == 0)
    drawn = draw_hidden(case, rng)
    row = {"index": index, **case.about}
    if drawn is None:
        return row | {"effect": None}
    hidden, delta = drawn
    test = measured(case, hidden, rng)
    (found,) = investigate([test], Settings(simulations=SIMULATIONS), own_seed).report["experiments"].values()
    truth = {"effect": hidden.name, "amplitude": hidden.amplitude, "delta": delta}
    return row | truth | {"group": list(group(case, hidden, delta)), **answered(found)}


def answered(found: ExperimentFindings) -> dict[str, Any]:
    """What a record keeps of the answer."""
    return {key: found[key] for key in ("verdict", "effects", "best", "p_global")}  # type: ignore[literal-required]


def is_right(row: dict[str, Any]) -> bool:
    """Whether a name that the answer gives is the effect's or one that looks alike."""
    return bool(set(row["effects"]) & set(row["group"]))


def is_wrong(row: dict[str, Any]) -> bool:
    """Whether the answer names something else: beside what is right, or, where it is undecided, in its place."""
    others = set(row["effects"]) - set(row["group"])
    return bool(others) and not (row["verdict"] == "ambiguous" and is_right(row))


def rates(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """How often effects are detected and named, with 90 % intervals.

    A name is right where it is the effect's or one that looks alike in this test. The most probable answer and the
    names given are asked of what is detected, wrong names of all tests.
    """
    seen = [row for row in rows if row["verdict"] != "nothing-missing"]
    return {
        "tests": len(rows),
        "detected": rate(row["verdict"] != "nothing-missing" for row in rows),
        "best": rate(row["best"] in row["group"] for row in seen),
        "named": rate(is_right(row) for row in seen),
        "wrong": rate(is_wrong(row) for row in rows),
    }


def summary(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """The rates over all tests and in each kind of test, and which effects are missed or misnamed."""
    hidden = [row for row in rows if row["effect"] is not None]
    missed = [row["effect"] for row in hidden if row["verdict"] == "nothing-missing"]
    misnamed = [[row["effect"], sorted(set(row["effects"]) - set(row["group"]))] for row in hidden if is_wrong(row)]
    return {
        "without_effect": len(rows) - len(hidden),
        "kinds": {kind: rates(chosen) for kind, chosen in kinds_of(hidden).items()},
        "by_delta": {f"{delta:g}": rates([row for row in hidden if row["delta"] == delta]) for delta in DELTAS},
        "hidden": dict(Counter(row["effect"] for row in hidden).most_common()),
        "missed": dict(Counter(missed).most_common()),
        "misnamed": misnamed,
    }


def kinds_of(rows: Sequence[dict[str, Any]]) -> dict[str, list[dict[str, Any]]]:
    """The records of all tests, and of those of each kind."""
    return {
        "all": list(rows),
        "steps": [row for row in rows if not row["weights"]],
        "weights": [row for row in rows if row["weights"]],
        "rests": [row for row in rows if row["rests"]],
        "few readings": [row for row in rows if row["readings"] == "few"],
        "many readings": [row for row in rows if row["readings"] == "many"],
    }


if __name__ == "__main__":
    study(__doc__, "hidden_any_scale", ("tests", 300), one, summary)
