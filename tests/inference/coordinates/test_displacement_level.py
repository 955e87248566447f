"""One weight: an error of the weight moves one coordinate alone, whatever the stiffness and the law."""

import numpy as np
import pytest

from wirebayes.inference.coordinates.steps import WeightLevel
from wirebayes.inference.coordinates.transform import Transformation
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.model.sample import LENGTH_EXPONENT
from wirebayes.simulation.synthetic import Bench, Truth, draw

LENGTH_MM, WEIGHT_N, HOLD_S = 1000.0, 20.0, 120.0
WIRE = {"k1": 800.0, "B": 0.2, "U": 0.5, "k2": 0.03, "N": 0.8, "preload": 0.0}
NAMES = ("k1", "B", "U", "k2", "N", "preload")


def one_weight(law="hooke", weights=(WEIGHT_N,), count=1, unrecorded=()):
    benches = [Bench(f"w{i}", weights_N=weights, unrecorded=frozenset(unrecorded)) for i in range(count)]
    return draw(benches, Truth(WIRE, law=law), seed=3).problem


@pytest.mark.parametrize("law", ["hooke", "modified"])
def test_an_error_of_the_weight_moves_one_coordinate_alone(law):
    """Preload and B are what they have to be for one end of the hold and one gain, though the weight was not exact."""
    problem, rng = one_weight(law), np.random.default_rng(0)
    read = problem.samples[0].readings[0, :, 0]
    theta = problem.prior.rvs(200, rng)
    column = {name: problem.names.index(name) for name in NAMES}
    theta[:, column["k1"]] = np.exp(rng.uniform(np.log(300.0), np.log(30_000.0), 200))
    k1, U, k2, N = (theta[:, column[name]] for name in ("k1", "U", "k2", "N"))
    error = rng.uniform(-0.02, 0.02, 200)
    weights = WEIGHT_N * (1.0 + 1e-6 * np.array([-1.0, 0.0, 1.0]))[:, None]

    def slope(value):  # the likelihood is linear in the error of the weight
        return (value[2] - value[0]) / 2e-6

    longer = 1.0 + weights / k1 if law == "hooke" else 1.0 / (1.0 - weights / k1)
    shape = weights**U * -np.expm1(-k2 * HOLD_S**N) * longer
    theta[:, column["B"]] = (read[-1] - read[0]) / (shape[1] + error * slope(shape))
    end = LENGTH_MM * (longer - 1.0) + theta[:, column["B"]] * shape
    theta[:, column["preload"]] = end[1] + error * slope(end) - read[-1]
    z = Transformation(problem).to_sampled(theta)
    assert z[:, column["preload"]] == pytest.approx(error, abs=1e-8)
    assert np.ptp(z[:, column["B"]]) < 1e-7
    assert np.ptp(np.log(theta[:, column["B"]])) > 1.0


def test_the_last_of_several_holds_is_read_after_the_creep_of_all():
    """Preloads with which the wire ends where it was read lie at a zero error, whatever the other parameters are."""
    weights = (WEIGHT_N, 0.1 * WEIGHT_N, WEIGHT_N)
    problem = one_weight(weights=weights, unrecorded=(2,))
    theta = problem.prior.rvs(200, np.random.default_rng(0))
    column = {name: problem.names.index(name) for name in NAMES}
    k1, B, U, k2, N = (theta[:, column[name]] for name in NAMES[:5])
    reached = -np.expm1(-k2 * HOLD_S**N)
    creep = np.zeros(200)
    for weight in weights:
        creep += (B * weight**U - creep) * reached
    stretch = LENGTH_MM * WEIGHT_N / k1
    theta[:, column["preload"]] = stretch + creep * (1.0 + WEIGHT_N / k1) - problem.samples[0].readings[2, -1, 0]
    z = Transformation(problem).to_sampled(theta)
    assert z[:, column["preload"]] == pytest.approx(np.zeros(200), abs=1e-9)


def test_tests_of_several_wires_end_where_each_was_read():
    """The same for two tests, whose weights, lengths and numbers of holds differ."""
    benches = [Bench("a", length_mm=LENGTH_MM, weights_N=(10.0, 10.0)), Bench("b", length_mm=1500.0, weights_N=(20.0,))]
    problem = draw(benches, Truth(WIRE), seed=3).problem
    theta = problem.prior.rvs(200, np.random.default_rng(0))
    k1, B, U, k2, N = (theta[:, problem.names.index(name)] for name in NAMES[:5])
    reached = -np.expm1(-k2 * HOLD_S**N)
    gained = {"a": 10.0**U * (1.0 - (1.0 - reached) ** 2), "b": 20.0**U * reached}
    longer = problem.prior.fixed[LENGTH_EXPONENT]
    columns = [problem.names.index(f"preload[{name}]") for name in "ab"]
    for sample, column in zip(problem.samples, columns, strict=True):
        weight, length = sample.protocol.setting[0], sample.protocol.length_mm
        creep = B * gained[sample.name] * (length / sample.model.length_ref_mm) ** longer
        end = sample.readings[-1, -1, 0]
        theta[:, column] = length * weight / k1 + creep * (1.0 + weight / k1) - end
    z = Transformation(problem).to_sampled(theta)
    assert z[:, columns] == pytest.approx(np.zeros((200, 2)), abs=1e-9)


@pytest.mark.parametrize("weights", [(WEIGHT_N,), (WEIGHT_N, 0.1 * WEIGHT_N, WEIGHT_N)], ids=["one hold", "a rest"])
@pytest.mark.parametrize("law", ["hooke", "modified"])
def test_the_map_goes_back_and_its_jacobian_is_that_of_differences(law, weights):
    problem = one_weight(law, weights, unrecorded=(2,))
    coordinates = Transformation(problem)
    theta = problem.prior.rvs(50, np.random.default_rng(1))
    theta = theta[theta[:, problem.names.index("k1")] > 2.0 * WEIGHT_N]
    z = coordinates.to_sampled(theta)
    assert coordinates.to_natural(z) == pytest.approx(theta, rel=1e-9)
    step = 1e-6 * np.eye(z.shape[1])
    slopes = (coordinates.to_natural(z[0] + step) - coordinates.to_natural(z[0] - step)) / 2e-6
    of_map = LogPosterior(problem).sampled_prior(theta[:1], z[:1]) - problem.prior.log_density()(theta[:1])
    assert np.linalg.slogdet(slopes)[1] == pytest.approx(of_map[0], abs=1e-6)


@pytest.mark.parametrize(
    ("problem", "has_one"),
    [
        (one_weight(), True),
        (one_weight(weights=(20.0, 18.1, 20.0)), True),
        (one_weight(weights=(20.0, 17.9, 20.0)), False),
        (one_weight(weights=(20.0, 2.0, 20.0), unrecorded=(2,)), True),
        (one_weight(weights=(20.0, 2.0, 20.0)), False),
        (one_weight(count=2), True),
        (draw([Bench("a", weights_N=(20.0,)), Bench("b", "other", weights_N=(20.0,))], seed=1).problem, False),
        (draw([Bench("a", weights_N=(20.0,)), Bench("b", weights_N=(20.0, 10.0))], seed=1).problem, False),
        (draw([Bench(displacements_mm=(3.0,))], seed=1).problem, False),
    ],
    ids=[
        "one weight",
        "alike",
        "two weights",
        "rest between",
        "rest that was read",
        "two tests",
        "two materials",
        "two weights in one of two",
        "one displacement",
    ],
)
def test_only_a_test_of_one_weight_has_this_coordinate(problem, has_one):
    has_it = any(isinstance(step, WeightLevel) for step in Transformation(problem).steps)
    assert has_it == has_one
