"""Partial pooling: specimens cut from one line that are similar, but not identical.

Each specimen has its own value of some positive material parameters, log-normal about the line's with a spread that is
estimated. With a small spread the samples share everything, as `build` has it; with a wide one each is fitted
separately. The coordinates that are sampled: `wirebayes.inference.specimens`.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from scipy import stats

from wirebayes.model.prior import PooledPrior
from wirebayes.model.problem import Problem

SPREAD = stats.lognorm(1.0, scale=0.05)  # specimens of one line mostly agree within one to twenty-five per cent


def pooled(problem: Problem, parameters: Sequence[str] = ("k1", "B"), spread: Any = SPREAD) -> Problem:
    """Let the samples of a material differ in some parameters.

    Parameters
    ----------
    problem : Problem
        Of several samples of one material, as `build` made it.
    parameters : sequence of str
        Positive material parameters that differ from specimen to specimen.
    spread : scipy frozen distribution
        Prior of the standard deviation of each one's logarithm.

    Returns
    -------
    Problem
        With a column ``spread_k1`` and columns ``k1[sample]`` for each of the parameters; ``k1`` is the line's.
    """
    prior = problem.prior
    distributions = dict(prior.distributions)
    pools = []
    for name in parameters:
        specimens = tuple(f"{name}[{sample.name}]" for sample in problem.samples)
        distributions |= {f"spread_{name}": spread} | dict.fromkeys(specimens, prior.distributions[name])
        pools.append((name, f"spread_{name}", specimens))
    logarithmic = prior.logarithmic | {s for _, sd, specimens in pools for s in (sd, *specimens)}
    return replace(problem, prior=PooledPrior(distributions, prior.fixed, logarithmic, tuple(pools)))
