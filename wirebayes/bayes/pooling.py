"""Partial pooling: specimens cut from one line that are alike, but not the same.

Each specimen has its own value of some positive material parameters, log-normal about the line's with a spread that is
learned. With a small spread the samples share everything, as `build` has it; with a wide one each is fitted by itself.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from wirebayes.bayes.prior import Prior
from wirebayes.bayes.problem import Problem

Array = NDArray[Any]
SPREAD = stats.lognorm(1.0, scale=0.05)  # specimens of one line mostly agree within one to twenty-five per cent


@dataclass(frozen=True)
class PooledPrior(Prior):
    """Independent distributions, except that specimens' values spread about their line's.

    Attributes
    ----------
    pools : tuple of (line, spread, specimens)
        Column names: the line's parameter, the standard deviation of the logarithm, the specimens' own parameters.
        What `distributions` says of the last is the line's own prior, for want of a closed form.
    """

    pools: tuple[tuple[str, str, tuple[str, ...]], ...] = ()

    def rvs(self, n: int, rng: np.random.Generator) -> Array:
        """(n, d) draws."""
        return self.ppf(rng.uniform(size=(n, len(self.names))))

    def ppf(self, cube: Array) -> Array:
        """(n, d) parameters of points ``(n, d)`` in the unit cube."""
        theta = super().ppf(cube)
        where = {name: i for i, name in enumerate(self.names)}
        for line, spread, specimens in self.pools:
            for name in specimens:
                deviation = theta[:, where[spread]] * stats.norm.ppf(cube[:, where[name]])
                theta[:, where[name]] = theta[:, where[line]] * np.exp(deviation)
        return theta

    def log_density(self) -> Callable[[Array], Array]:
        """A function of (n, d) parameters that returns the (n,) log density."""
        names = self.names
        own = {name for _, _, specimens in self.pools for name in specimens}
        shared = [i for i, name in enumerate(names) if name not in own]
        rest = Prior({names[i]: self.distributions[names[i]] for i in shared}, {}, frozenset()).log_density()
        pools = [(names.index(line), names.index(spread), [names.index(s) for s in specimens])
                 for line, spread, specimens in self.pools]  # fmt: skip

        def evaluate(theta: Array) -> Array:
            total = rest(theta[:, shared])
            for line, spread, specimens in pools:
                value, sd = theta[:, specimens], theta[:, [spread]]
                with np.errstate(all="ignore"):
                    deviation = (np.log(value) - np.log(theta[:, [line]])) / sd
                    each = -0.5 * deviation**2 - np.log(sd * value) - 0.5 * np.log(2.0 * np.pi)
                total = total + np.where((value > 0) & (sd > 0), each, -np.inf).sum(axis=1)
            return total

        return evaluate


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
