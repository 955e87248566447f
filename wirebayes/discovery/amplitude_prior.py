"""The prior of an effect's amplitude, one rule in every set of effects.

It is uniform in δ, the change that the amplitude alone makes to the readings beside the plain parameters, in units of
the noise. So it is for a single effect, in the linear scan, and so is the size of a smooth remainder. A refit beside
other effects does not know of the rule: its amplitude is uniform in what it does beside those too, and theirs are as
the catalogue has them. `corrections` adds the difference.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from scipy import stats

from wirebayes.discovery.linear_scan import moving_columns, tangent, whitened
from wirebayes.discovery.refit import Refit
from wirebayes.inference.laplace_fit import LaplaceFit, column_of
from wirebayes.inference.transform import LogPosterior
from wirebayes.typing import Array
from wirebayes.wire.effect import Effect

_STEP = 1e-4  # of a sampled coordinate, by which its natural parameter is differentiated


def corrections(parent: Sequence[LaplaceFit]) -> Callable[[Refit], float]:
    """What turns the log Bayes factor of a refit beside other effects into one with the prior of this module.

    With G the information on the amplitudes, all other parameters free, the evidence of a set holds the root of
    (product of the diagonal of G) / det G for its amplitudes. In a chain of refits the earlier ones have their
    catalogue's density instead of the root of the diagonal, and the last one is uniform beside them.

    Parameters
    ----------
    parent : sequence of LaplaceFit
        The blocks that effects are refitted in, with the effects before them.

    Returns
    -------
    function of Refit to float
    """

    @cache
    def before(b: int) -> _Before:
        return _Before.of(parent[b])

    def correction(found: Refit) -> float:
        out, own, left = 0.0, 0.0, 0.0
        for b, theta in zip(found.blocks, found.theta, strict=True):
            old, after = before(b), _with(parent[b], found)
            new = information(after, theta, [*old.effects, found.effect])
            for i, effect in enumerate(old.effects):
                out += 0.5 * _log_ratio(new[i, i], old.information[i, i])
                out += old.log_catalogue[i] - _catalogue(after, theta, effect)
            own += new[-1, -1]
            left += new[-1, -1] - float(new[-1, :-1] @ np.linalg.pinv(new[:-1, :-1]) @ new[:-1, -1])
        return out + 0.5 * _log_ratio(own, left)

    return correction


@dataclass(frozen=True)
class _Before:
    """A block's effects, the information on their amplitudes, and the log density that the catalogue gives each."""

    effects: list[Effect]
    information: Array
    log_catalogue: list[float]

    @staticmethod
    def of(block: LaplaceFit) -> "_Before":
        # what other materials know of a shared amplitude is no prior of this kind
        effects = [e for e in block.effects if not any(e.columns()[0] in x.priors for x in block.experiments)]
        theta = block.target.coordinates.to_natural(block.modes.z[:1])[0]
        catalogue = [_catalogue(block.target, theta, effect) for effect in effects]
        return _Before(effects, information(block.target, theta, effects), catalogue)


def information(target: LogPosterior, theta: Array, effects: Sequence[Effect]) -> Array:
    """(k, k) information on the amplitudes of effects, all parameters but amplitudes free, linearised.

    Parameters
    ----------
    target : LogPosterior
    theta : (d,) array
        All parameters.
    effects : sequence of Effect
    """
    columns = [column_of(target.problem, effect) for effect in effects]
    z, moving = target.coordinates.to_sampled(theta[None]), moving_columns(target.problem)
    x = tangent(target, z, None, moving)
    rows = whitened(x, x.parameters[0], float(x.ratio[0]))
    every = rows.T @ rows
    of = [moving.index(c) for c in columns]
    rest = [i for i in range(len(moving)) if i not in of]
    inner = every[np.ix_(rest, rest)] + x.prior_precision[0][np.ix_(rest, rest)]
    across = every[np.ix_(of, rest)]
    seen = every[np.ix_(of, of)] - across @ np.linalg.solve(inner, across.T)
    natural = np.array([_derivative(target, z, c) for c in columns])
    found = np.asarray(seen / np.outer(natural, natural))
    return found if np.isfinite(found).all() else np.zeros_like(found)  # no tangent: nothing to compare


def _with(block: LaplaceFit, found: Refit) -> LogPosterior:
    """A block with one more effect, whose amplitude has no edge: its best value may lie on one."""
    problem = block.problem_with(found.effect)
    name = problem.names[column_of(problem, found.effect)]
    free = problem.prior.distributions | {name: stats.norm(found.amplitude, found.sd)}
    return LogPosterior(replace(problem, prior=replace(problem.prior, distributions=free)), for_draws=False)


def _derivative(target: LogPosterior, z: Array, column: int) -> float:
    """Of a natural parameter by its sampled coordinate."""
    step = _STEP * np.eye(z.shape[1])[column]
    high, low = target.coordinates.to_natural(np.concatenate([z + step, z - step]))[:, column]
    return float(high - low) / (2.0 * _STEP)


def _catalogue(target: LogPosterior, theta: Array, effect: Effect) -> float:
    """Log density of the catalogue's prior of an amplitude; zero outside it."""
    column = column_of(target.problem, effect)
    value = float(target.problem.prior.distributions[target.problem.names[column]].logpdf(theta[column]))
    return value if np.isfinite(value) else 0.0


def _log_ratio(one: float, other: float) -> float:
    """Zero where there is nothing to compare: an amplitude that the readings do not show."""
    return float(np.log(one / other)) if one > 0.0 and other > 0.0 else 0.0
