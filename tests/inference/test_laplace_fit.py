"""The normal approximation of a test's posterior: what is said of it is said of its best mode."""

from dataclasses import fields, replace

import numpy as np

from wirebayes.inference.laplace_fit import fitted
from wirebayes.inference.optimum import Optimum
from wirebayes.io import paper
from wirebayes.model.spec import PLAIN_SPEC


def test_of_several_modes_the_best_is_meant():
    (nylon,) = (e for e in paper.experiments() if e.name == "nylon-1.5m")
    block = fitted([nylon], (), PLAIN_SPEC, np.random.default_rng(0))
    best = block.modes.rows(slice(1))
    worse = replace(best, z=best.z + 1.0, log_density=best.log_density - 1.0)
    pairs = {f.name: np.concatenate([getattr(best, f.name), getattr(worse, f.name)]) for f in fields(Optimum)}
    several = replace(block, modes=Optimum(**pairs))
    assert several.z.shape == best.z.shape
    assert (several.theta == block.theta).all()
    assert several.best == block.best
