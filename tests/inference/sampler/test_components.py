"""Draws from points of a cube and back: the proposal's own distribution, both ways."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from wirebayes.inference.sampler import proposal
from wirebayes.inference.sampler.mixture import Mixture
from wirebayes.inference.sampler.points import WeightedPoints
from wirebayes.inference.sampler.proposal import Proposal, components

D = 3


def bent(n: int, rng: np.random.Generator) -> np.ndarray:
    """A banana and a far hill."""
    z = rng.normal(size=(n, D))
    z[:, 1] += z[:, 0] ** 2
    z[: n // 4] += 6.0
    return z


@pytest.fixture(scope="module")
def learned() -> Proposal:
    """Of five parts, three of them of straightened coordinates, all with shares that matter."""
    rng = np.random.default_rng(0)
    start = Mixture(np.array([0.3, 0.7]), np.array([[0.0] * D, [6.0] * D]), np.repeat(np.eye(D)[None], 2, axis=0))
    points = WeightedPoints.equal(bent(4000, rng))
    known = proposal.fit_proposal(points, points, start, np.arange(D), rng, (0.3, 0.2, 0.2, 0.1, 0.2), most=3)
    return replace(known, excess=Mixture(np.ones(1), np.full((1, D), 3.0), 0.5 * np.eye(D)[None]))


def test_draws_of_uniform_points_have_the_proposal_s_density(learned: Proposal) -> None:
    """The mean of another density over the proposal's is its integral, one; a band about each draw, by counting."""
    rng = np.random.default_rng(1)
    x = learned.rvs(400_000, rng)
    other = Mixture(np.ones(1), np.array([[0.5, 1.0, 0.0]]), np.diag([0.6, 0.9, 0.7])[None], 30.0)
    ratio = np.exp(other.log_density(x) - learned.log_density(x))
    assert ratio.mean() == pytest.approx(1.0, abs=4 * ratio.std() / np.sqrt(len(x)))
    below = learned.log_density(x)[:, None] < np.quantile(learned.log_density(x), [0.1, 0.5, 0.9])
    assert below.mean(axis=0) == pytest.approx([0.1, 0.5, 0.9], abs=1e-3)


def test_points_of_draws_are_uniform_and_independent_of_one_another(learned: Proposal) -> None:
    """Draws by a way of their own: the five parts one by one, each by its own generator of draws."""
    rng = np.random.default_rng(2)
    n = 20_000
    counts = rng.multinomial(n, learned.shares)
    assert learned.excess is not None
    bent_parts = (learned.close, learned.wide, learned.excess)
    straight = [part.rvs(k, rng) for part, k in zip(bent_parts, counts[[0, 1, 4]], strict=True)]
    plain = [part.rvs(k, rng) for part, k in zip((learned.plain, learned.start), counts[2:4], strict=True)]
    x = np.concatenate([learned.straight.inverse(np.concatenate(straight)), *plain])
    points = components(learned).to_cube(x, rng)
    assert points.shape == (n, D + 1)
    for j in range(D + 1):
        assert stats.kstest(points[:, j], "uniform").pvalue > 1e-4
    correlation = np.corrcoef(points.T) - np.eye(D + 1)
    assert np.abs(correlation).max() < 4.0 / np.sqrt(n)
    first, second = (points[:, :2] * 5).astype(int).T
    assert stats.chisquare(np.bincount(5 * first + second, minlength=25)).pvalue > 1e-4


def test_a_point_leads_back_to_where_the_draw_was(learned: Proposal) -> None:
    """But for how far out it lies in its component, which is left to chance: with very light tails nothing is."""
    rng = np.random.default_rng(3)
    parts = ("close", "wide", "plain", "start", "excess")
    light = replace(learned, **{part: replace(getattr(learned, part), degrees=1e12) for part in parts})
    x = light.rvs(500, rng)
    assert components(light).from_cube(components(light).to_cube(x, rng), rng) == pytest.approx(x, abs=1e-4)


def test_a_mixture_alone_is_a_list_of_components_too() -> None:
    rng = np.random.default_rng(4)
    known = Mixture(np.array([0.25, 0.75]), np.array([[0.0], [50.0]]), np.ones((2, 1, 1)), 5.0)
    u = np.column_stack([np.linspace(0.001, 0.999, 2000), np.full(2000, 0.5)])
    x = components(known).from_cube(u, rng)
    assert (x[:, 0] < 25.0).mean() == pytest.approx(0.25, abs=1e-3)
    assert x == pytest.approx(np.where(u[:, :1] < 0.25, 0.0, 50.0))  # the middle of the component


def test_the_borders_of_the_cube_have_draws() -> None:
    known = Mixture(np.ones(1), np.zeros((1, 2)), np.eye(2)[None], 5.0)
    x = components(known).from_cube(np.array([[0.0, 0.0, 1.0], [1.0, 1.0, 0.0]]), np.random.default_rng(5))
    assert np.isfinite(x).all() and (np.abs(x) > 1.0).all()
