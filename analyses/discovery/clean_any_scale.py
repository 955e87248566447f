"""False alarms at any scale: how often do `fit`'s check and `discover` object to a test with nothing missing?

``python -m analyses.discovery.clean_any_scale --tests 600``. Lines, tests and truths are drawn as in
`analyses.posterior.any_scale`: from thread to mooring rope, under steps and under weights, with recorded rests or none.
The check at the end of a fit is the global test of the search, with the same simulations: where it passes, `discover`
says that nothing is missing. So the search is run where the check fails, and in every twentieth test to see that it
finds the same p.
"""

from collections import Counter
from collections.abc import Sequence
from typing import Any

from scipy import stats

from analyses.hidden_effects.rates import rate, upper_bound
from analyses.posterior.any_scale import kinds_of, made_test
from analyses.resumable import study
from wirebayes.discovery.model_check import check_model
from wirebayes.discovery.search import investigate
from wirebayes.discovery.settings import ALPHA, Settings
from wirebayes.inference.fit import seed_of
from wirebayes.results.jobs import Job

SIMULATIONS = 199  # refitted data sets behind a p, as in the benchmark of hidden effects
SEARCHED = 20  # one test in so many is searched although its check passes


def one(seed: int, index: int) -> dict[str, Any]:
    """One clean test: p of its check, and what the search says of it."""
    own_seed = seed_of(seed, "clean at any scale", str(index))
    made = made_test(own_seed, index)
    check = check_model(Job("", (made.test,)), own_seed, simulations=SIMULATIONS)
    row = {"index": index, **made.about, "p": check.p, "simulations": check.simulations}
    if check.passed and index % SEARCHED:
        return row
    (found,) = investigate([made.test], Settings(simulations=SIMULATIONS), own_seed).report["experiments"].values()
    return row | {"verdict": found["verdict"], "accepted": found["accepted"], "p_of_search": found["p_global"]}


def alarms(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Share of tests that raise an alarm, with the one-sided upper bound of 95 %."""
    failed = [row["p"] <= ALPHA for row in rows]
    objected = [row.get("verdict", "nothing-missing") != "nothing-missing" for row in rows]
    return {
        "tests": len(rows),
        "check": {**(rate(failed) or {}), "upper_95": upper_bound(sum(failed), len(rows))},
        "discover": {**(rate(objected) or {}), "upper_95": upper_bound(sum(objected), len(rows))},
    }


def summary(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """False alarms, over all tests and in each kind of test."""
    searched = [row for row in rows if "verdict" in row]
    # a share of simulations, of which half a step is due to counting the readings among them
    middles = [row["p"] - 0.5 / (1.0 + row["simulations"]) for row in rows]
    return {
        "alpha": ALPHA,
        **{kind: alarms(chosen) for kind, chosen in kinds_of(rows).items()},
        "verdicts": dict(Counter(row["verdict"] for row in searched if row["p"] <= ALPHA)),
        "named": dict(Counter(name for row in searched for name in row["accepted"])),
        "uniform_p": float(stats.kstest(middles, "uniform").pvalue),
        "searched": {"tests": len(searched), "same_p": sum(row["p"] == row["p_of_search"] for row in searched)},
    }


if __name__ == "__main__":
    study(__doc__, "clean_any_scale", ("tests", 600), one, summary)
