"""Two effects together: the linear scan's pairs against regressions written out, and what only a pair shows."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import logsumexp

from tests.simulated import simulated_tests
from wirebayes.discovery import noise_integral, screening, two_effects
from wirebayes.discovery.ascent import start
from wirebayes.discovery.linear_scan import expand, scan
from wirebayes.discovery.noise_integral import Expansion
from wirebayes.effects import CATALOGUE, effect_named
from wirebayes.inference.laplace_fit import LaplaceFit, fitted
from wirebayes.model.spec import PLAIN_SPEC
from wirebayes.numeric.typing import Array
from wirebayes.simulation.synthetic import Bench, Truth

NAMES = ("toe", "unrecorded_hold", "steady_creep")


@pytest.fixture(scope="module")
def block() -> LaplaceFit:
    truth = Truth({"k1": 900.0, "B": 0.25, "setting_sd": 0.01, "toe.w": 0.6}, [effect_named("toe")])
    experiments = simulated_tests([Bench(displacements_mm=tuple(range(1, 8)))], truth, seed=3)
    return fitted(experiments, (), PLAIN_SPEC, np.random.default_rng(0))


@pytest.fixture(scope="module")
def expansion(block: LaplaceFit) -> Expansion:
    trials, _ = screening.candidate_probes([block], {name: CATALOGUE[name] for name in NAMES})
    return expand(block.target, block.z, trials)


def left_by(columns: Array, x: Expansion, ratio: float) -> tuple[float, Array]:
    """The residual's sum of squares beside columns, and their amplitudes, by a dense regression at one noise ratio."""
    k = x.left[0] * x.singular[0]
    whiten = np.linalg.inv(np.linalg.cholesky(np.eye(len(k)) + ratio * k @ k.T))
    root = np.linalg.cholesky(x.prior_precision[0]).T  # the prior as further rows
    design = np.vstack([whiten @ x.parameters[0], root])
    aside = np.linalg.solve(root.T, x.prior_gradient[0])
    more = np.vstack([whiten @ columns, np.zeros((len(root), columns.shape[1]))])
    target = np.concatenate([whiten @ x.residual[0], aside])
    every = np.hstack([design, more])
    solved = np.linalg.lstsq(every, target, rcond=None)[0]
    return float(((target - every @ solved) ** 2).sum()), solved[design.shape[1] :]


def test_a_pair_explains_what_a_regression_on_both_explains(
    expansion: Expansion, monkeypatch: pytest.MonkeyPatch
) -> None:
    x, ratio = expansion, 10.0
    monkeypatch.setattr(noise_integral, "RATIOS", np.array([ratio]))
    found = noise_integral.project(x)
    first = np.array([[0]])
    explained = two_effects._explained(x, found, first)[0, 0, 0]
    compared = 0
    for m in np.flatnonzero(x.kinds != x.kinds[0]):
        left, amplitudes = left_by(x.signatures[0][:, [0, m]], x, ratio)
        possible = all(a >= 0.0 or not x.one_sided[i] for a, i in zip(amplitudes, (0, m), strict=True))
        if possible and np.isfinite(explained[m]):
            none, _ = left_by(np.zeros((len(x.residual[0]), 0)), x, ratio)
            assert explained[m] == pytest.approx(none - left, rel=1e-6, abs=1e-8)
            compared += 1
        else:
            assert explained[m] == -np.inf
    assert compared > 3


def test_all_pairs_of_different_effects_count_and_forms_share_the_weight_of_theirs(expansion: Expansion) -> None:
    """The sum written out: over the best form of each effect, every form of another, and noise ratios."""
    x, found = expansion, noise_integral.project(expansion)
    sizes = np.log(np.bincount(x.kinds)) - np.log(2.0) * np.array([x.one_sided[x.kinds == k][0] for k in range(3)])
    half = 0.5 * x.degrees
    upward = np.where(x.one_sided, np.maximum(found.along[0], 0.0), found.along[0])
    alone = logsumexp(found.shared[0][:, None] - half * np.log(found.rss[0][:, None] - upward**2 / found.divisor[0]), 0)
    terms = []
    for kind in range(3):
        best = max(np.flatnonzero(x.kinds == kind), key=lambda m: alone[m])
        explained = two_effects._explained(x, found, np.array([[best]]))[0, :, 0]
        for m in np.flatnonzero(x.kinds != kind):
            each = found.shared[0] - half * np.log(found.rss[0] - explained[:, m])
            terms.append(logsumexp(each) - sizes[kind] - sizes[x.kinds[m]])
    plain = logsumexp(found.shared[0] - half * np.log(found.rss[0]))
    assert scan(x).two[0] == pytest.approx(logsumexp(terms) - plain, abs=1e-8)


def test_each_pair_by_itself_adds_up_to_all_pairs(expansion: Expansion) -> None:
    each = two_effects.log_bayes_of_each_pair(expansion)
    apart = ~np.eye(len(each), dtype=bool)
    assert logsumexp(each[apart]) == pytest.approx(scan(expansion).two[0], abs=1e-8)


def test_beside_each_pair_stands_what_an_effect_explains_alone(expansion: Expansion) -> None:
    x, alone = expansion, scan(expansion).effects[0]
    each = np.diag(two_effects.log_bayes_of_each_pair(x))
    for kind, value in enumerate(each):
        own = x.kinds == kind
        one_sign = np.where(x.one_sided[own], np.log(2.0), 0.0)
        assert value == pytest.approx(logsumexp(alone[own] + one_sign) - np.log(own.sum()), abs=1e-8)


def test_without_a_tangent_no_pair_explains_anything(expansion: Expansion) -> None:
    nowhere = replace(expansion, residual=np.full_like(expansion.residual, np.nan))
    assert (two_effects.log_bayes_of_each_pair(nowhere) == -np.inf).all()


def test_one_effect_makes_no_pair(expansion: Expansion) -> None:
    alone = expansion.kinds == 0
    one = replace(
        expansion,
        signatures=expansion.signatures[..., alone],
        one_sided=expansion.one_sided[alone],
        kinds=expansion.kinds[alone],
    )
    assert scan(one).two[0] == -np.inf


def test_the_largest_of_each_block_and_of_all_counts() -> None:
    each = [np.array([3.0, -4.0, 2.0]), np.array([-5.0, -1.0, 1.0])]
    np.testing.assert_array_equal(screening._alone_and_together(each), [3.0, -1.0, 3.0])


@pytest.mark.parametrize(("weights", "degrees"), [(4, -2), (6, 0)])
def test_no_more_readings_than_parameters_are_evidence_for_nothing(weights: int, degrees: int) -> None:
    bench = Bench(weights_N=tuple(10.0 * np.arange(1, 1 + weights)), times_s=(60.0,), resolution_mm=0.1)
    experiments = simulated_tests([bench], Truth({"k1": 900.0}), seed=3)
    block = fitted(experiments, (), PLAIN_SPEC, np.random.default_rng(0))
    trials, _ = screening.candidate_probes([block], CATALOGUE)
    x = expand(block.target, block.z, trials)
    assert x.degrees == degrees
    assert (x.least > 0.0).all()
    with np.errstate(all="raise", under="ignore"):
        begin = start(block, block.z)
        scanned = scan(x)
    assert np.isfinite(begin.log_density).all()
    assert not np.isnan(scanned.two).any()
    pairs = two_effects.log_bayes_of_each_pair(x)
    assert not np.isnan(pairs).any()
    assert pairs.max() < 50.0
