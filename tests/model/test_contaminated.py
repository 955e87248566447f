"""Gross errors: the sum over patterns against dense enumeration, and a fit that one wrong reading does not move."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import logsumexp

from tests.model.dense import columns, jacobian, log_density
from tests.wire.protocols import PLAIN, parameters, protocol
from wirebayes.errors import InputError
from wirebayes.inference.fit import fit
from wirebayes.inference.policy import Policy
from wirebayes.model import contaminated, likelihoods
from wirebayes.model.contaminated import with_gross_errors
from wirebayes.model.problem import build, with_readings
from wirebayes.simulation.synthetic import Bench, Truth, draw
from wirebayes.wire.staircase import Model, linearise, simulate

THETA = PLAIN | {"sensor_sd": 0.01, "setting_sd": 0.05}
SHARE, WIDE = 0.08, 1.5**2


def filtered(p, theta, y, share=SHARE, wide=WIDE):
    line, one = linearise(p, columns(theta)), np.ones(1)
    variance = one * theta["sensor_sd"] ** 2
    return contaminated.chain(line, y[..., None], p.mask, variance, one * theta["setting_sd"], one * share, one * wide)


def enumerated(p, theta, y):
    """Every pattern of at most two contaminated readings a hold, each a dense normal of all readings."""
    clean, jac = jacobian(p, theta, Model())
    r, k = (y - clean)[p.mask], jac[p.mask] * theta["setting_sd"]
    sizes = p.mask.sum(axis=1)
    holds = [[w for w in itertools.product([0, 1], repeat=int(size)) if sum(w) <= 2] for size in sizes]
    priors = [np.log([SHARE ** sum(w) * (1 - SHARE) ** (len(w) - sum(w)) for w in patterns]) for patterns in holds]
    priors = [prior - logsumexp(prior) for prior in priors]
    terms = []
    for chosen in itertools.product(*[range(len(h)) for h in holds]):
        bad = np.concatenate([holds[j][c] for j, c in enumerate(chosen)])
        covariance = np.diag(theta["sensor_sd"] ** 2 + WIDE * bad) + k @ k.T
        terms.append(sum(priors[j][c] for j, c in enumerate(chosen)) + log_density(r, covariance))
    return logsumexp(terms)


def measured(p, theta, wrong, seed=0):
    rng = np.random.default_rng(seed)
    setting = rng.normal(0, theta["setting_sd"], (len(p.displacement_mm), 1))
    y = simulate(p, columns(theta), setting_mm=setting)[..., 0] + rng.normal(0, theta["sensor_sd"], p.mask.shape)
    for place, error in wrong.items():
        y[place] += error
    return y


@given(parameters(), st.integers(0, 4), st.integers(0, 99))
@settings(max_examples=40, deadline=None)
def test_one_hold_is_the_sum_over_dense_normals(theta, wrong, seed):
    theta = theta | {"sensor_sd": 0.01, "setting_sd": 0.05}
    p = protocol([3.0], [[0.0, 30.0, 60.0, 90.0, 120.0]])
    y = measured(p, theta, {(0, wrong): 1.0}, seed)
    assert filtered(p, theta, y).log_likelihood.sum() == pytest.approx(enumerated(p, theta, y), rel=1e-8, abs=1e-8)


@pytest.mark.parametrize("wrong", [{}, {(0, 1): -1.4}, {(1, 2): 0.8, (2, 0): -2.0}])
def test_several_holds_are_close_to_it(wrong):
    """Between holds the sum is passed on as one normal; what that leaves out is far below what matters."""
    p = protocol([2.0, 4.0, 6.0], [[0.0, 40.0, 120.0]] * 3)
    y = measured(p, THETA, wrong)
    assert filtered(p, THETA, y).log_likelihood.sum() == pytest.approx(enumerated(p, THETA, y), abs=0.02)


def test_without_gross_errors_it_is_the_plain_chain():
    p = protocol([2.0, 4.0, 6.0], [[0.0, 40.0, 120.0]] * 3, unrecorded={1})
    y = measured(protocol([2.0, 4.0, 6.0], [[0.0, 40.0, 120.0]] * 3), THETA, {})
    line, one = linearise(p, columns(THETA)), np.ones(1)
    plain = likelihoods.chain(line, y[..., None], p.mask, one * 1e-4, one * 0.05).log_likelihood
    assert filtered(p, THETA, y, share=0.0).log_likelihood == pytest.approx(plain, rel=1e-12)


def test_hold_by_hold_is_refused():
    with pytest.raises(InputError, match="chain"):
        with_gross_errors(build([Bench().experiment()], likelihood="hold"))


TRUE = {"k1": 800.0, "B": 0.2, "U": 0.5, "k2": 0.02, "N": 0.9, "preload": 0.4, "sensor_sd": 0.008, "setting_sd": 0.02}


@pytest.mark.statistical
def test_one_wrong_reading_does_not_move_the_answer_and_is_named():
    """A comma slipped: 1.45 N missing from one reading, as in the paper's first table."""
    made = draw([Bench(displacements_mm=tuple(range(1, 9)))], Truth(TRUE), seed=4)
    sample = made.problem.samples[0]
    y = sample.readings.copy()
    y[3, 4] -= 1.45
    spoiled = with_readings(made.problem, [y])
    policy = Policy(ensembles=2, walkers=96, most_rounds=3, ess=300.0, most_steps=80)
    robust = fit(with_gross_errors(spoiled), 1, policy=policy)
    clean, plain = fit(made.problem, 1, policy=policy), fit(spoiled, 1, policy=policy)
    names = made.problem.names
    moved, broken = [], []
    for i, name in enumerate(names):
        sd = clean.flat[:, i].std()
        moved.append(abs(robust.flat[:, i].mean() - clean.flat[:, i].mean()) / sd)
        broken.append(abs(plain.flat[:, i].mean() - clean.flat[:, i].mean()) / sd)
        low, high = np.quantile(robust.flat[:, i], [0.005, 0.995])
        assert low < TRUE[name] < high
    assert max(moved) < 0.5
    assert max(broken) > 5.0
    (probability,) = contaminated.suspects(robust.problem, robust.flat[::50])
    assert probability[3, 4] > 0.99
    probability[3, 4] = 0.0
    assert probability.max() < 0.2
