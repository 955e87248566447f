"""Posterior draws in a fraction of a second, for decisions that are made many times: a short run of the same sampler.

For numbers that are reported, sample with `wirebayes.inference.fit`, which requires convergence.
"""

import numpy as np

from wirebayes.inference.modes import Optimum
from wirebayes.inference.policy import Policy
from wirebayes.inference.sampler.ensemble import sample
from wirebayes.inference.transform import LogPosterior
from wirebayes.typing import Array

# 4096 draws, no test of tails: enough for means and widths, a fraction of a second
_SHORT = Policy(ensembles=2, walkers=64, rounds=3, most_rounds=5, tail=np.inf, block=32, most_steps=32)


def draws(target: LogPosterior, found: Optimum, rng: np.random.Generator, n: int = 1000) -> Array:
    """Posterior draws by a short run of the sampler from known modes.

    Parameters
    ----------
    target : LogPosterior
    found : Optimum
        The modes of `target`; no search is made.
    rng : numpy.random.Generator
    n : int
        Number of draws, picked from the run without replacement.

    Returns
    -------
    (n, d) array
        Natural parameters.
    """
    chains = sample(target, int(rng.integers(2**63)), _SHORT, found=found)
    z = chains.z.reshape(-1, chains.z.shape[-1])
    return target.coordinates.to_natural(z[rng.choice(len(z), n, replace=False)])
