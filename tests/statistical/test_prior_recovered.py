"""A likelihood that says nothing returns the prior, for every parameter, through the whole sampler."""

import numpy as np
import pytest
from scipy import stats

from analyses.calibration.simulation_based_calibration import parameters_at
from tests.statistical.targets import Silent
from wirebayes.effects import CATALOGUE, effect_named
from wirebayes.inference.fit import fit_problem
from wirebayes.inference.policy import Policy
from wirebayes.model.build import build
from wirebayes.model.spec import ModelSpec
from wirebayes.simulation.synthetic import Bench, Truth, draw

pytestmark = pytest.mark.statistical
POLICY = Policy(walkers=64, round_draws=2048, ess=2000.0)


def silent(effects=(), likelihood="chain"):
    made = draw([Bench()], Truth({"k1": 900.0}, effects), seed=3).problem
    rebuilt = build([Bench().experiment()], effects, spec=ModelSpec(likelihood=likelihood))
    return Silent(made.samples, rebuilt.prior, likelihood)


def assert_prior(problem, seeds):
    theta = []
    for seed in seeds:
        done = fit_problem(problem, seed, policy=POLICY)
        assert done.chains.converged
        last = done.problem.prior
        walkers_last = done.chains.z[:, -1]  # as good as independent
        z = walkers_last.reshape(-1, walkers_last.shape[-1])
        theta.append(last.known(parameters_at(problem, z)))
        for i, (name, distribution) in enumerate(last.distributions.items()):
            ess = done.chains.ess[i]
            share = distribution.cdf(last.known(done.flat)[:, i])
            assert share.mean() == pytest.approx(0.5, abs=4.5 * np.sqrt(1 / 12 / ess)), name
            assert share.std() == pytest.approx(np.sqrt(1 / 12), rel=4.5 * 0.6 / np.sqrt(ess)), name
    for (name, distribution), values in zip(last.distributions.items(), np.concatenate(theta).T, strict=True):
        # a level that all parameters together miss once in a thousand
        assert stats.kstest(values, distribution.cdf).pvalue > 1e-4, name


@pytest.mark.parametrize("likelihood", ["chain", "hold"])
def test_the_plain_model_s_prior_comes_back(likelihood):
    assert_prior(silent(likelihood=likelihood), (1, 2, 3))


@pytest.mark.slow
def test_the_prior_of_every_amplitude_comes_back():
    keys = [f"{name}@5" if name in ("grip_slip", "unrecorded_hold") else name for name in CATALOGUE]
    keys = [f"{name}@k1" if name == "length_dependence" else name for name in keys]
    for first in range(0, len(keys), 5):
        assert_prior(silent(tuple(effect_named(key) for key in keys[first : first + 5])), (2,))
