"""What sampling starts from: a mixture of the modes that a search found, widened, and draws of it."""

from typing import Any

import numpy as np

from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.inference.optimum import Optimum
from wirebayes.inference.sampler import mixture
from wirebayes.inference.sampler.mixture import Mixture
from wirebayes.inference.sampler.settings import OVERDISPERSED
from wirebayes.numeric.typing import Array


def overdispersed(modes: Optimum) -> Mixture:
    """A mixture of normals that are wider than the modes, for draws that reach beyond them."""
    return mixture.from_modes(modes.z, modes.covariance * OVERDISPERSED, modes.log_evidence)


def modes_below(target: LogPosterior, start: Mixture) -> Optimum:
    """The modes that `overdispersed` gave this mixture of."""
    inverse = np.linalg.inv(start.factors)
    curvature = OVERDISPERSED * np.swapaxes(inverse, 1, 2) @ inverse
    return Optimum(start.centres, target(start.centres), curvature, np.ones(len(start.centres), bool))


def finite_draws(target: LogPosterior, known: Mixture, n: int, random: Any) -> tuple[Array, Array]:
    """Draws of a mixture where the density is above zero, and its logarithm there.

    Parameters
    ----------
    target : LogPosterior
    known : Mixture
    n : int
        How many draws.
    random : numpy RandomState
    """
    drawn = np.empty((0, len(target.problem.names)))
    values = np.empty(0)
    while len(drawn) < n:
        z = known.rvs(n, random)
        value = target(z)
        good = np.isfinite(value)
        drawn = np.vstack([drawn, z[good]])
        values = np.concatenate([values, value[good]])
    return drawn[:n], values[:n]
