"""Hidden effects at any scale: how often does `discover` see and name them, under steps and under weights?

``python -m analyses.discovery.hidden_any_scale --tests 300``. Lines from thread to mooring rope, held for seconds or
days and read rarely or often, every second one under weights, each with one hidden effect: in three of five tests one
that a single test shows, in one of five one that is in no catalogue, and in one of five one that only two lengths of a
line show, which are then tested both. The tests come from an independent program
(`analyses.hidden_effects.scaled_draws`), which also says which names look alike there. The size δ of an effect is what
is left of it, in standard deviations of the noise, beside the parameters that hide it best.
"""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from analyses.hidden_effects.rates import rate
from analyses.hidden_effects.rig import Array
from analyses.hidden_effects.scaled_cases import UNKNOWN, ScaledCase, group
from analyses.hidden_effects.scaled_draws import DELTAS, draw_case_and_hidden
from analyses.hidden_effects.scaled_law import Hidden, ScaledTest
from analyses.hidden_effects.scaled_lengths import TwoLengths
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


def measured(case: ScaledCase | TwoLengths, hidden: Hidden, rng: np.random.Generator) -> list[Experiment]:
    """The test, or those of two lengths, with readings."""
    if isinstance(case, ScaledCase):
        return [with_readings(case.test, case.measured(hidden, rng), case.resolution, "line")]
    readings = case.measured(hidden, rng)
    tests = zip(case.parts, readings, ("short", "long"), strict=True)
    return [with_readings(part.test, y, part.resolution, name) for part, y, name in tests]


def with_readings(test: ScaledTest, y: Array, resolution: float, name: str) -> Experiment:
    """A test with its readings, as the package has it."""
    control: Control = "force" if test.weights else "displacement"
    ends = np.cumsum([len(times) for times in test.times_s])[:-1]
    holds = []
    for j, own in enumerate(np.split(y, ends)):
        logged = None if test.warming_K is None else frozen((FIRST_C + test.warming_K[j]).tolist())
        times, read = frozen(test.times_s[j].tolist()), frozen(own.tolist())
        duration, start = float(test.durations_s[j]), float(test.starts_s[j])
        holds.append(Hold(j + 1, float(test.settings[j]), duration, times, read, logged, start, control))
    file = Path("line.toml")
    return Experiment(name, "line", test.length_mm, resolution, tuple(holds), file, control=control)


def kind_of(index: int) -> str:
    """Where the effect of a test comes from; of each five pairs of a test by weights and one by steps."""
    return ("catalogue", "catalogue", "catalogue", "foreign", "lengths")[index // 2 % 5]


def one(seed: int, index: int) -> dict[str, Any]:
    """One test: what was hidden, and what the search says; without an effect where none can be large enough."""
    own_seed = seed_of(seed, "hidden at any scale", str(index))
    rng = np.random.default_rng(own_seed)
    kind = kind_of(index)
    case, drawn = draw_case_and_hidden(rng, index % 2 == 0, kind)
    about = case.about if isinstance(case, ScaledCase) else case.parts[0].about
    row = {"index": index, "kind": kind, **about}
    if drawn is None:
        return row | {"effect": None}
    hidden, delta = drawn
    tests = measured(case, hidden, rng)
    found = investigate(tests, Settings(simulations=SIMULATIONS), own_seed).report["experiments"]
    truth = {"effect": hidden.name, "amplitude": hidden.amplitude, "delta": delta}
    alike = group(case, hidden, case.delta(hidden))
    return row | truth | {"group": list(alike), **answered(found[tests[0].name])}


def answered(found: ExperimentFindings) -> dict[str, Any]:
    """What a record keeps of the answer."""
    return {key: found[key] for key in ("verdict", "effects", "best", "p_global")}  # type: ignore[literal-required]


def is_right(row: dict[str, Any]) -> bool:
    """Whether a name that the answer gives is the effect's or one that looks alike; of what has no name, that."""
    unnamed = {UNKNOWN} if row["verdict"] == "unknown" else set()
    return bool((set(row["effects"]) | unnamed) & set(row["group"]))


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
        "one length, an effect of the catalogue": [row for row in rows if row["kind"] == "catalogue"],
        "one length, an effect in no catalogue": [row for row in rows if row["kind"] == "foreign"],
        "two lengths": [row for row in rows if row["kind"] == "lengths"],
    }


if __name__ == "__main__":
    study(__doc__, "hidden_any_scale", ("tests", 300), one, summary)
