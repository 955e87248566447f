"""Shares in a sum: scores and back at both ends, and which effects' amplitudes are sampled by them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from wirebayes.effects import effect_named
from wirebayes.inference.coordinates import shares
from wirebayes.inference.coordinates.transform import Transformation
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.io.paper import experiments
from wirebayes.model.build import build
from wirebayes.model.problem import Problem
from wirebayes.wire.staircase import simulate


def made(*keys: str) -> Problem:
    """The 1 m line with effects."""
    return build([experiments()[0]], [effect_named(key) for key in keys])


def test_scores_are_normal_for_even_shares_and_keep_their_digits_at_both_ends() -> None:
    share = np.linspace(0.001, 0.999, 999)
    found = shares.score(np.log(share), np.log1p(-share))
    assert found == pytest.approx(stats.norm.ppf(share), rel=1e-9, abs=1e-9)
    log_ratio = np.linspace(-20.0, 20.0, 81)
    own, rest = shares.log_shares(shares.score(log_ratio + 3.0, np.full(81, 3.0)))
    assert own - rest == pytest.approx(log_ratio, rel=1e-9, abs=1e-9)
    nothing = shares.score(np.array([-np.inf]), np.zeros(1))
    assert np.isfinite(nothing).all() and shares.log_shares(nothing)[0] == pytest.approx(np.log(1e-9))


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ((), []),
        (("toe", "superposition", "grip_slip@5"), []),
        (("fixture_compliance",), ["fixture_compliance.c"]),
        (("second_relaxation", "steady_creep"), ["second_relaxation.A", "steady_creep.a"]),
        (("steady_creep@carried", "fixture_compliance"), ["fixture_compliance.c", "steady_creep.a"]),
    ],
)
def test_amounts_that_add_to_others_are_sampled_by_shares(keys: tuple[str, ...], expected: list[str]) -> None:
    problem = made(*keys)
    assert [problem.names[i] for i in Transformation(problem).shares] == expected


def test_an_amount_with_an_upper_end_keeps_its_own_coordinate() -> None:
    """Else sums and shares would lie outside the prior; so does one beside a stiffness that is known."""
    problem = made("fixture_compliance")
    prior = problem.prior
    bounded = replace(prior, distributions={**prior.distributions, "fixture_compliance.c": stats.uniform(0.0, 0.3)})
    assert not Transformation(replace(problem, prior=bounded)).shares
    others = {name: d for name, d in prior.distributions.items() if name != "k1"}
    known = replace(prior, distributions=others, fixed={**prior.fixed, "k1": 800.0})
    assert not Transformation(replace(problem, prior=known)).shares


def test_the_elongation_beside_the_creep_is_that_of_the_simulation() -> None:
    """Tensions as measured drive it; a simulation without other creep, whose tensions barely fall, gains the same."""
    problem = build([experiments()[0].train(4)], [effect_named("second_relaxation")])  # every hold recorded
    (part,) = Transformation(problem).ridges[0].beside
    (sample,) = problem.samples
    theta = problem.prior.rvs(1, np.random.default_rng(0))
    put = {"k1": 800.0, "B": 1e-12, "second_relaxation.A": 1e-4, "second_relaxation.T2": 60.0, "preload": 0.0}
    for name, value in put.items():
        theta[:, problem.names.index(name)] = value
    own = problem.parameters(theta, sample)
    at_rest = problem.parameters(np.where(np.array(problem.names) == "second_relaxation.A", 0.0, theta), sample)
    less = simulate(sample.protocol, at_rest, sample.model) - simulate(sample.protocol, own, sample.model)
    less = less[..., 0] * sample.protocol.length_mm / 800.0
    elongation = np.append(less[1:, 0], less[-1, sample.protocol.last_reading[-1]])  # at the end of every hold
    first = simulate(sample.protocol, own, sample.model)[:, 0]
    holds = tuple(replace(hold, initial_tension=tension[None]) for hold, tension in zip(part.holds, first, strict=True))
    found = np.exp(replace(part, holds=holds).log_gained(theta))[0] * 1e-4
    assert found == pytest.approx(np.sqrt(np.mean(np.diff(elongation, prepend=0.0) ** 2)), rel=0.01)


@pytest.mark.parametrize("key", ["fixture_compliance", "second_relaxation"])
def test_no_place_is_without_a_density_but_where_numbers_end(key: str) -> None:
    """However large a share is."""
    problem = made(key)
    target = LogPosterior(problem)
    coordinates = target.coordinates
    z = coordinates.to_sampled(problem.prior.rvs(1, np.random.default_rng(1)))
    z = np.repeat(z, 13, axis=0)
    z[:, coordinates.shares[0]] = np.linspace(-6.0, 6.0, 13)
    with np.errstate(all="raise"):
        found = target(z)
    assert np.isfinite(found).all()
