"""The sampled coordinates: back and forth, volume, and that the target is the posterior in them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from wirebayes.effects import effect_named
from wirebayes.effects.rivals import RIVALS
from wirebayes.inference.coordinates.transform import Transformation
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.model.build import build
from wirebayes.model.problem import with_readings
from wirebayes.model.spec import ModelSpec
from wirebayes.simulation.synthetic import Bench, Truth, draw
from wirebayes.wire.model import Model
from wirebayes.wire.staircase import simulate

LINE = [Bench("a", "line", 1000.0), Bench("b", "line", 1710.0, unrecorded=frozenset({4}))]
PROBLEMS = {
    "chain": draw([Bench()], Truth({"k1": 800.0}), seed=1).problem,
    "additive": draw([Bench()], Truth({"k1": 800.0}, history="additive"), seed=1).problem,
    "effects": draw(
        [Bench()], Truth(effects=(effect_named("second_relaxation"), effect_named("grip_slip@5"))), seed=2
    ).problem,
    "edges": draw(
        [Bench()], Truth(effects=(effect_named("permanent_creep"), effect_named("creep_threshold"))), seed=4
    ).problem,
    "shares": draw(
        [Bench()],
        Truth(effects=tuple(map(effect_named, ("steady_creep", "fixture_compliance", "second_relaxation")))),
        seed=6,
    ).problem,
    "shares, two lengths": draw(
        LINE, Truth(effects=(effect_named("fixture_compliance"), effect_named("steady_creep"))), seed=7
    ).problem,
    "toe": draw([Bench()], Truth(effects=(effect_named("toe"),)), seed=9).problem,
    "toes of one wire": draw([*LINE, Bench("c")], Truth(effects=(effect_named("toe"),)), seed=9).problem,
    "read late": draw([Bench(times_s=(20.0, 60.0, 120.0))], Truth({"k1": 800.0}), seed=1).problem,
    "weights": draw([Bench("a", weights_N=(2.0, 6.0, 4.0), times_s=(5.0, 60.0, 300.0))], Truth(), seed=3).problem,
    "read late, beside weights and another wire": draw(
        [
            Bench("a", "one", times_s=(20.0, 60.0)),
            Bench("b", "one", weights_N=(2.0, 6.0, 4.0)),
            Bench("c", "other", weights_N=(3.0, 5.0), times_s=(9.0, 60.0)),
        ],
        seed=5,
    ).problem,
    "weights, a toe": draw(
        [Bench("a", weights_N=(2.0, 6.0, 4.0)), Bench("b", length_mm=1710.0, weights_N=(5.0, 3.0))],
        Truth(effects=(effect_named("toe"),)),
        seed=9,
    ).problem,
    "one weight each": draw(
        [Bench("a", weights_N=(10.0,)), Bench("b", length_mm=1710.0, weights_N=(20.0, 20.0))], Truth(), seed=3
    ).problem,
    "one displacement each": draw(
        [Bench("a", displacements_mm=(3.0,)), Bench("b", length_mm=1710.0, displacements_mm=(5.0, 0.0, 5.0))],
        Truth({"k1": 800.0}),
        seed=3,
    ).problem,
    "together": draw([*LINE, Bench("c", "other")], seed=3).problem,
    "one hold": draw([Bench(displacements_mm=(1.0,))], Truth({"k1": 800.0}), seed=8).problem,
    "one displacement": draw([Bench(displacements_mm=(3.0, 0.0, 3.0))], Truth({"k1": 800.0}), seed=8).problem,
    "one hold, its preload known": with_readings(
        build([replace(Bench(displacements_mm=(1.0,)).experiment(), priors={"preload": {"fixed": 0.3}})]),
        [draw([Bench(displacements_mm=(1.0,))], Truth({"k1": 800.0}), seed=8).problem.samples[0].readings],
    ),
    "slack": build([Bench().experiment()]),  # every reading zero
    "hold": build(
        [Bench(displacements_mm=(1, 2, 3), times_s=(0.0, 10.0)).experiment()], spec=ModelSpec(likelihood="hold")
    ),
}


@pytest.mark.parametrize("name", PROBLEMS)
def test_back_and_forth_returns_the_parameters(name):
    problem = PROBLEMS[name]
    theta = problem.prior.rvs(50, np.random.default_rng(0))
    coordinates = Transformation(problem)
    assert coordinates.to_natural(coordinates.to_sampled(theta)) == pytest.approx(theta, rel=1e-9, abs=1e-12)


def log_determinants(coordinates, z):
    """(n,) log |d natural / d sampled| at points (n, d), by differences."""
    step = 1e-6
    out = []
    for row, natural in zip(z, coordinates.to_natural(z), strict=True):
        up, down = (coordinates.to_natural(row + sign * step * np.eye(len(row))) for sign in (1, -1))
        matrix = (up - down) / (2 * step) / np.abs(natural)[:, None].T  # relative: the columns differ by many orders
        out.append(np.linalg.slogdet(matrix)[1] + np.log(np.abs(natural)).sum())
    return np.array(out)


@pytest.mark.parametrize("name", PROBLEMS)
def test_the_prior_as_sampled_has_the_determinant_of_the_map(name):
    problem = PROBLEMS[name]
    target = LogPosterior(problem)
    theta = problem.prior.rvs(5, np.random.default_rng(1))
    z = target.coordinates.to_sampled(theta)
    expected = problem.prior.log_density()(theta) + log_determinants(target.coordinates, z)
    assert target.sampled_prior(theta, z) == pytest.approx(expected, abs=1e-5)


def test_stated_priors_of_any_kind_keep_their_density_as_sampled():
    """Under few of them is the logarithm of a parameter normal, or the parameter where it is sampled itself."""
    stated = {
        "k1": stats.gamma(5.0, scale=300.0),
        "B": stats.norm(0.05, 0.01),
        "U": stats.uniform(0.4, 0.3),
        "k2": stats.loguniform(1e-3, 1.0),
        "N": stats.truncnorm(-2.0, 2.0, loc=0.5, scale=0.1),
        "preload": stats.t(5.0, loc=0.1, scale=0.2),
        "sensor_sd": stats.halfnorm(0.0, 0.1),
    }
    problem = draw([Bench()], Truth(effects=(effect_named("toe"),)), seed=9).problem
    distributions = problem.prior.distributions | stated
    problem = replace(problem, prior=replace(problem.prior, distributions=distributions))
    target = LogPosterior(problem)
    theta = problem.prior.rvs(20, np.random.default_rng(5))
    z = target.coordinates.to_sampled(theta)
    expected = problem.prior.log_density()(theta) + log_determinants(target.coordinates, z)
    assert target.sampled_prior(theta, z) == pytest.approx(expected, abs=1e-5)


def test_beside_a_toe_the_preload_is_what_is_left_of_it_once_the_toe_is_straight():
    """A longer toe with as much more preload has the same coordinate."""
    problem = PROBLEMS["toe"]
    preload, toe = (problem.names.index(name) for name in ("preload", "toe.w"))
    theta = np.repeat(problem.prior.rvs(1, np.random.default_rng(4)), 2, axis=0)
    theta[:, preload], theta[:, toe] = [5.0, 5.7], [0.3, 1.0]
    z = Transformation(problem).to_sampled(theta)
    assert z[0, preload] == pytest.approx(z[1, preload], rel=1e-6)


def test_the_target_is_prior_likelihood_and_volume():
    problem = PROBLEMS["chain"]
    target = LogPosterior(problem)
    theta = problem.prior.rvs(20, np.random.default_rng(2))
    known = problem.prior.known(theta)
    prior = sum(d.logpdf(known[:, i]) for i, d in enumerate(problem.prior.distributions.values()))
    prior = prior + sum(problem.prior.log_factor(name, theta) for name in problem.prior.powers)
    z = target.coordinates.to_sampled(theta)
    expected = prior + problem.log_likelihood(theta) + log_determinants(target.coordinates, z)
    assert target(z) == pytest.approx(expected, rel=1e-9, abs=1e-5)
    assert target.evaluations == 20


def test_outside_the_prior_the_density_is_zero():
    made = draw([Bench()], Truth({"k1": 800.0}), seed=2)
    narrow = made.problem.prior.distributions | {"U": stats.uniform(0.4, 0.2)}
    target = LogPosterior(replace(made.problem, prior=replace(made.problem.prior, distributions=narrow)))
    theta = np.repeat(made.theta, 2, axis=0)
    theta[:, made.problem.names.index("U")] = 0.5, 0.7
    assert np.isfinite(target(target.coordinates.to_sampled(theta))).tolist() == [True, False]


def test_amplitudes_with_an_edge_are_standard_normal_under_their_prior():
    problem = PROBLEMS["edges"]
    columns = [problem.names.index(name) for name in ("permanent_creep.psi", "creep_threshold.tau_c")]
    coordinates = Transformation(problem)
    theta = problem.prior.rvs(2000, np.random.default_rng(5))
    z = coordinates.to_sampled(theta)
    for column in columns:
        assert stats.kstest(z[:, column], "norm").pvalue > 1e-3
    theta[:2, columns] = [[0.0, 0.0], [1.0, 40.0]]  # on the edge, and far out in the half-normal of 2 N
    z = coordinates.to_sampled(theta[:2])
    assert np.isfinite(z).all()
    assert coordinates.to_natural(z)[:, columns] == pytest.approx(theta[:2, columns], rel=1e-8, abs=1e-7)


def test_a_prior_that_allows_negative_values_is_sampled_as_it_is():
    experiment = Bench().experiment()
    experiment.priors["U"] = {"distribution": "normal", "mean": 0.5, "sd": 1.0}
    problem = build([experiment])
    assert not Transformation(problem).log_columns[problem.names.index("U")]
    theta = problem.prior.rvs(50, np.random.default_rng(0))
    coordinates = Transformation(problem)
    assert coordinates.to_natural(coordinates.to_sampled(theta)) == pytest.approx(theta, rel=1e-9)


def test_fixed_parameters_are_not_sampled():
    experiment = Bench().experiment()
    experiment.priors["N"] = {"fixed": 1.0}
    problem = build([experiment])
    assert "N" not in problem.names
    theta = problem.prior.rvs(20, np.random.default_rng(0))
    assert (problem.parameters(theta, problem.samples[0])["N"] == 1.0).all()
    coordinates = Transformation(problem)
    assert coordinates.to_natural(coordinates.to_sampled(theta)) == pytest.approx(theta, rel=1e-9)


def test_wires_that_are_as_stiff_after_their_creep_lie_at_the_same_coordinate():
    """All creep at once and in proportion to the tension: readings see 1 / (1 / k1 + B / L0) and nothing of k1."""
    bench = Bench(resolution_N=0.0)
    problem = build([bench.experiment()], [RIVALS["at_once"](), RIVALS["not_in_time"]()])
    theta = problem.prior.rvs(200, np.random.default_rng(6))
    column = {name: problem.names.index(name) for name in ("k1", "B", "U", "k2", "N")}
    theta[:, [column["U"], column["k2"], column["N"]]] = 1.0
    softness = theta[:, column["B"]] / bench.length_mm
    theta[:, column["k1"]] = 1.0 / (1.0 / 500.0 - np.minimum(softness, 0.9 / 500.0))
    theta[:, column["B"]] = np.minimum(softness, 0.9 / 500.0) * bench.length_mm
    readings = simulate(problem.samples[0].protocol, problem.parameters(theta, problem.samples[0]), Model())
    seen = replace(problem, samples=(replace(problem.samples[0], readings=readings[..., :1]),))
    z = Transformation(seen).to_sampled(theta)
    assert np.ptp(np.log(theta[:, column["k1"]])) > 1.0
    assert z[:, column["k1"]] == pytest.approx(np.log(500.0), abs=0.01)


@pytest.mark.parametrize(("effect", "amplitude"), [(None, 0.0), ("permanent_creep.psi", 0.5), ("ageing.a", 0.6)])
def test_the_ridge_is_nearly_straight_in_the_sampled_coordinates(effect, amplitude):
    """Parameters that lose the same tension in a hold lie at the same coordinate, whatever k2, U and N make of it.

    So do those of which an effect changes the amount.
    """
    truth = {"k1": 800.0, "B": 0.2, "U": 0.5, "k2": 0.03, "N": 0.8, "preload": 0.3}
    effects = () if effect is None else (effect_named(effect.split(".")[0]),)
    made = draw([Bench(resolution_N=0.0)], Truth(truth | ({effect: amplitude} if effect else {}), effects=effects), 1)
    coordinates, names = Transformation(made.problem), made.problem.names
    rng, column = np.random.default_rng(0), names.index("B")
    theta = np.repeat(made.theta, 200, axis=0)
    for name, spread in (("U", 0.2), ("k2", 0.5), ("N", 0.2)):
        theta[:, names.index(name)] *= np.exp(spread * rng.normal(size=200))
    if effect:
        theta[:, names.index(effect)] = rng.uniform(0.0, 1.0, 200)
    z = coordinates.to_sampled(theta)
    z[:, column] = coordinates.to_sampled(made.theta)[0, column]
    level = coordinates.to_natural(z)

    def lost(rows):
        own = made.problem.parameters(rows, made.problem.samples[0])
        tension = simulate(made.problem.samples[0].protocol, own, made.problem.samples[0].model)
        return np.sqrt(((tension[:, 0] - tension[:, -1]) ** 2).mean(axis=0))

    assert np.log(lost(level)).std() < 0.15 * np.log(lost(theta)).std()
    assert stats.spearmanr(np.log(lost(theta)), coordinates.to_sampled(theta)[:, column]).statistic > 0.98
