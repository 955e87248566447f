"""Are simulations at the fit as surprising as simulations at the truth, in clean tests under weights?

``python -m analyses.discovery.null_under_weights --tests 200``. Tests under weights that
`analyses.discovery.clean_any_scale` does not have, from the same source. The p of each is computed from simulations at
its fit, as the check does, and from as many at its truth, which no user has: with these p is uniform whatever is
unknown of the noise. Where the two agree, and the readings are as surprising as the simulations, the level is kept.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from analyses.hidden_effects.rates import rate
from analyses.posterior.any_scale import made_test
from analyses.resumable import study
from wirebayes.discovery import residual_patterns, screening
from wirebayes.discovery.linear_scan import expand, scan
from wirebayes.discovery.settings import ALPHA
from wirebayes.effects import CATALOGUE
from wirebayes.inference.fit import seed_of
from wirebayes.inference.laplace_fit import LaplaceFit, fitted
from wirebayes.inference.optimum import Optimum
from wirebayes.model.scales import NATURAL
from wirebayes.model.spec import PLAIN_SPEC

SIMULATIONS = 199  # as in the study of false alarms
FIRST = 200  # tests under weights that it has, of 600
LEVELS = (ALPHA, 0.1, 0.2, 0.5)


def at_truth(block: LaplaceFit, truth: dict[str, float]) -> LaplaceFit:
    """The fit whose best parameters are the true ones."""
    problem = block.target.problem
    theta = np.array([[truth[name] for name in problem.names]])
    own = problem.in_units(NATURAL).theta_in(problem.units, theta)
    z = block.target.coordinates.to_sampled(own)
    best = Optimum(z, block.target(z), np.eye(z.shape[1])[None], np.array([True]))
    return replace(block, modes=best)


def one(seed: int, index: int) -> dict[str, Any]:
    """One clean test under weights, and its p by either kind of simulations."""
    number = 3 * (FIRST + index)  # every third test is under weights
    own_seed = seed_of(seed, "clean at any scale", str(number))
    made = made_test(own_seed, number)
    first = np.random.default_rng(seed_of(own_seed, "discover")).spawn(1)[0]
    block = fitted([made.test], (), PLAIN_SPEC, first)
    trials, candidates = screening.candidate_probes([block], CATALOGUE)
    columns = residual_patterns.patterns(block.target.problem)[1]
    data = scan(expand(block.target, block.z, trials, columns=columns))
    row = {"index": index, **made.about}
    for name, centre in (("fit", block), ("truth", at_truth(block, made.truth))):
        rng = np.random.default_rng(number)
        simulated = screening.replicated(centre, trials, SIMULATIONS, rng, columns)
        row[name] = screening.global_test(candidates, [data], [simulated.scan]).p
    return row


def summary(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """How many tests have a p up to each level, by simulations at the fit and at the truth."""
    shares = {name: {f"{a:g}": rate(row[name] <= a for row in rows) for a in LEVELS} for name in ("fit", "truth")}
    return {"alpha": ALPHA, "tests": len(rows), **shares}


if __name__ == "__main__":
    study(__doc__, "null_under_weights", ("tests", 200), one, summary)
