"""The normal approximation of a test's posterior: what is said of it is said of its best mode."""

from dataclasses import fields, replace

import numpy as np

from wirebayes.effects import CATALOGUE
from wirebayes.inference.laplace_fit import Pinned, fitted
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


def test_a_shape_at_the_end_of_its_prior_begins_inside():
    """At the end itself its coordinate has no slope, and a climb would stay there."""
    (nylon,) = (e for e in paper.experiments() if e.name == "nylon-1.5m")
    block = fitted([nylon], (), PLAIN_SPEC, np.random.default_rng(0))
    (screw,) = CATALOGUE["screw_error"].variants([nylon.protocol()])
    pinned = Pinned(block, screw)
    names = pinned.target.problem.names
    prior = pinned.target.problem.prior.distributions["screw_error.P"]
    for end in prior.support():
        start = pinned.starts({"screw_error.P": end})
        (period,) = pinned.natural(start, np.zeros(len(start)))[:, names.index("screw_error.P")]
        assert 0.005 < prior.cdf(period) < 0.995
