"""The likelihood of whole experiments against dense normals: rounding, and samples of one material at two lengths."""

import numpy as np
import pytest
from scipy import stats

from tests.model.dense import columns, log_density, normal
from tests.simulated import simulated_tests
from wirebayes.effects import named
from wirebayes.model import likelihoods
from wirebayes.model.problem import build
from wirebayes.simulation.synthetic import Bench, Truth
from wirebayes.wire.staircase import Model

WIRE = {"k1": 900.0, "B": 0.25, "U": 0.6, "k2": 0.05, "N": 0.7, "preload": 0.4, "sensor_sd": 0.004, "setting_sd": 0.02}


def at(problem, values):
    """One row of parameters; a column of one sample takes the value of its name without the sample."""
    return np.array([[values.get(name, values.get(name.split("[")[0])) for name in problem.names]])


def test_rounding_is_part_of_the_error_of_every_reading():
    """A display that shows tenths of a newton hides more than the sensor: Var = sensor² + resolution²/12."""
    bench = Bench(resolution_N=0.1)
    experiment = simulated_tests([bench], Truth(WIRE), seed=1)[0]
    problem = build([experiment], likelihood="hold")
    sample = problem.samples[0]
    courses = likelihoods.hold_courses(sample.protocol, columns(WIRE), Model(), sample.readings[:, 0])
    expected = 0.0
    for course, readings in zip(courses, experiment.tension(), strict=True):
        tension, slope, _ = course
        later = slope[1:, 0] / slope[0, 0]
        covariance = (0.004**2 + 0.1**2 / 12) * (np.eye(len(later)) + np.outer(later, later))
        expected += stats.multivariate_normal(tension[1:, 0], covariance).logpdf(readings[1:])
    assert problem.log_likelihood(at(problem, WIRE))[0] == pytest.approx(expected, rel=1e-9)

    problem = build([experiment])
    r, covariance, _ = normal(sample.protocol, WIRE, Model(), experiment.tension(), 0.1)
    assert problem.log_likelihood(at(problem, WIRE))[0] == pytest.approx(log_density(r, covariance), rel=1e-9)


@pytest.mark.parametrize("exponent", [0.4, 1.0, 1.7])
def test_creep_grows_with_length_to_the_fitted_power(exponent):
    """Two lengths fitted together are two wires of their own, the creep amount scaled by hand."""
    effects = (named("grip_slip@4"), named("lost_motion"))
    values = WIRE | {"grip_slip.w": 0.1, "lost_motion.w": 0.05}
    benches = [Bench("short", "line", 500.0), Bench("long", "line", 2000.0)]
    experiments = simulated_tests(benches, Truth(values, effects), seed=3)
    for length_exponent in (exponent, stats.norm(1.0, 0.5)):  # known, and learned
        problem = build(experiments, effects, length_exponent=length_exponent)
        assert ("creep_length_exponent" in problem.names) == (length_exponent is not exponent)
        expected = 0.0
        for e, own in zip(experiments, problem.samples, strict=True):
            alone = values | {"B": WIRE["B"] * (e.length_mm / 1000.0) ** exponent}  # 1000 is the geometric mean
            model = Model(effects=own.model.effects, tension_ref_N=own.model.tension_ref_N)
            r, covariance, _ = normal(e.protocol(), alone, model, e.tension(), e.resolution_N)
            expected += log_density(r, covariance)
        found = problem.log_likelihood(at(problem, values | {"creep_length_exponent": exponent}))[0]
        assert found == pytest.approx(expected, rel=1e-9)
