"""Several tests, one displacement each: preloads are standard normal, and errors leave the loss alone."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import fsolve

from wirebayes.effects import effect_named
from wirebayes.inference.coordinates.steps import StretchLevel
from wirebayes.inference.coordinates.transform import Transformation
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.model.build import build
from wirebayes.model.problem import with_readings
from wirebayes.simulation.synthetic import Bench, Truth, draw

WIRE = {"k1": 800.0, "B": 0.3, "U": 0.5, "k2": 0.1, "N": 0.5, "preload": 0.1}
LENGTH_MM, AT_MM, LATE_S = 1000.0, 6.0, (1.0, 10.0, 60.0, 300.0)
LATE = Bench("a", length_mm=LENGTH_MM, displacements_mm=(AT_MM,), times_s=LATE_S, resolution_N=1e-4)
LONGER = Bench("b", length_mm=1500.0, displacements_mm=(7.0, 0.0, 7.0), times_s=(0.0, 10.0, 60.0, 300.0))


def relaxations(benches=(LATE, LONGER), law="hooke", sensor_sd=0.01, effects=()):
    truth = Truth(WIRE | {"sensor_sd": sensor_sd, "setting_sd": 0.05}, effects=effects, law=law)
    return draw(benches, truth, seed=3)


@pytest.mark.parametrize(
    ("sensor_sd", "setting_sd"),
    [(0.001, 0.005), (0.001, 0.05), (0.1, 0.005), (0.1, 2.0)],
    ids=["both small", "setting", "sensor", "prior"],
)
@pytest.mark.parametrize("law", ["hooke", "modified"])
def test_beside_the_others_a_preload_is_standard_normal(law, sensor_sd, setting_sd):
    """By the density on a grid, whatever knows the preload best: the displacement, the sensor or the prior."""
    made = relaxations(law=law, sensor_sd=sensor_sd)
    problem, coordinates = made.problem, Transformation(made.problem)
    theta = np.repeat(made.theta, 1001, axis=0)
    theta[:, problem.names.index("setting_sd[a]")] = setting_sd
    column, score = problem.names.index("preload[a]"), np.linspace(-8.0, 8.0, len(theta))
    z = coordinates.to_sampled(theta)
    z[:, column] = score
    theta[:, column] = preload = coordinates.to_natural(z)[:, column]
    log_prior = problem.prior.distributions["preload[a]"].logpdf(preload)
    log_density = problem.log_likelihood(theta) + log_prior
    weight = np.exp(log_density - log_density.max()) * np.gradient(preload)
    weight /= weight.sum()
    mean = weight @ score
    assert mean == pytest.approx(0.0, abs=0.01)
    assert np.sqrt(weight @ (score - mean) ** 2) == pytest.approx(1.0, abs=0.03)


def predicted(stretch, B, k1=800.0, U=0.5, k2=0.1, N=0.5):
    """First and last tension of a hold at a stretch, by the model's equations."""
    creep = B * (k1 * stretch / LENGTH_MM) ** U * -np.expm1(-k2 * np.array([LATE_S[0], LATE_S[-1]]) ** N)
    return k1 * ((LENGTH_MM + stretch) / (LENGTH_MM + creep) - 1.0)


def test_setting_errors_leave_the_loss_as_it_was():
    """Preload and B are such that a hold is read as it was, though the wire was longer: an effect of second order."""
    problem = relaxations([LATE, replace(LATE, name="b")]).problem
    first = problem.samples[0].readings
    problem = with_readings(problem, [first, first])
    read = first[0, [0, -1], 0]

    def left(unknown, error):  # the likelihood is linear in the setting error
        stretch, B = unknown
        slope = (predicted(stretch + 1e-5, B) - predicted(stretch - 1e-5, B)) / 2e-5
        return predicted(stretch, B) + error * slope - read

    theta = np.repeat(problem.prior.rvs(1, np.random.default_rng(0)), 21, axis=0)
    column = {name: problem.names.index(name) for name in ("k1", "B", "U", "k2", "N", "preload[a]", "preload[b]")}
    theta[:, [column[name] for name in ("k1", "U", "k2", "N")]] = [WIRE[name] for name in ("k1", "U", "k2", "N")]
    for row, error in zip(theta, np.linspace(-1.5, 1.5, 21), strict=True):
        stretch, row[column["B"]] = fsolve(left, (AT_MM - error, 0.3), args=(error,))
        row[[column["preload[a]"], column["preload[b]"]]] = stretch - AT_MM
    z = Transformation(problem).to_sampled(theta)
    assert np.ptp(np.log(theta[:, column["B"]])) > 5e-3
    assert np.ptp(z[:, column["B"]]) < 2e-4


@pytest.mark.parametrize("effects", [(), ("fixture_compliance", "second_relaxation")], ids=["plain", "with effects"])
@pytest.mark.parametrize("law", ["hooke", "modified"])
def test_the_map_goes_back_and_its_jacobian_is_that_of_differences(law, effects):
    problem = relaxations(law=law, effects=tuple(map(effect_named, effects))).problem
    target = LogPosterior(problem)
    coordinates = target.coordinates
    assert any(isinstance(step, StretchLevel) for step in coordinates.steps)
    theta = problem.prior.rvs(50, np.random.default_rng(1))
    z = coordinates.to_sampled(theta)
    assert coordinates.to_natural(z) == pytest.approx(theta, rel=1e-7, abs=1e-9)
    for row, natural in zip(z[:5], theta[:5], strict=True):
        up, down = (coordinates.to_natural(row + sign * 1e-6 * np.eye(len(row))) for sign in (1, -1))
        slopes = (up - down) / 2e-6 / np.abs(natural)  # relative: the columns differ by many orders
        expected = np.linalg.slogdet(slopes)[1] + np.log(np.abs(natural)).sum()
        of_map = target.sampled_prior(natural[None], row[None]) - problem.prior.log_density()(natural[None])
        assert of_map[0] == pytest.approx(expected, abs=1e-5)


KNOWN = [replace(bench.experiment(), priors={"preload": {"fixed": 0.1}}) for bench in (LATE, LONGER)]


@pytest.mark.parametrize(
    ("problem", "has_one"),
    [
        (relaxations().problem, True),
        (relaxations([LATE]).problem, False),
        (relaxations([LATE, replace(LATE, name="b", displacements_mm=(6.0, 5.41))]).problem, True),
        (relaxations([LATE, replace(LATE, name="b", displacements_mm=(6.0, 5.39))]).problem, False),
        (relaxations([LATE, replace(LATE, name="b", material="other")]).problem, False),
        (relaxations([LATE, Bench("b", weights_N=(5.0,))]).problem, False),
        (relaxations(effects=(effect_named("creep_threshold"),)).problem, False),
        (with_readings(build(KNOWN), [s.readings for s in relaxations().problem.samples]), False),
    ],
    ids=[
        "two",
        "one",
        "alike",
        "two displacements",
        "two materials",
        "a weight",
        "threshold of creep",
        "known preload",
    ],
)
def test_only_several_tests_of_one_displacement_each_have_these_coordinates(problem, has_one):
    has_it = any(isinstance(step, StretchLevel) for step in Transformation(problem).steps)
    assert has_it == has_one
