"""What errors of several weights have in common has one width, whatever sizes are expected of them."""

from dataclasses import replace

import numpy as np
import pytest

from wirebayes.inference.coordinates.common_error import common_error
from wirebayes.model.build import build
from wirebayes.simulation.synthetic import Bench, Truth, draw

WEIGHTS_N = np.array([10.0, 20.0, 30.0])
BENCHES = [Bench(name, weights_N=(weight,)) for name, weight in zip("abc", WEIGHTS_N, strict=True)]
PROBLEM = draw(BENCHES, Truth(), seed=1).problem
KNOWN = [replace(bench.experiment(), priors={"setting_sd": {"fixed": 0.01}}) for bench in BENCHES]


def test_errors_of_their_expected_sizes_have_a_normal_mean_that_tells_nothing_of_the_others():
    rng = np.random.default_rng(0)
    theta = PROBLEM.prior.rvs(20_000, rng)
    columns = [PROBLEM.names.index(f"setting_sd[{name}]") for name in "abc"]
    sizes = theta[:, columns].T / WEIGHTS_N[:, None]
    errors = sizes * rng.normal(size=sizes.shape)
    common, *apart = common_error(PROBLEM).coordinates(errors, theta)
    standard_error = 1.0 / np.sqrt(len(theta))
    assert common.std() == pytest.approx(1.0, abs=4.0 * standard_error)
    of_one_size = np.array(apart) / sizes[0]
    for other in (*of_one_size, *np.log(sizes)):
        rank = np.argsort(np.argsort(other))  # these have heavy tails
        assert abs(np.corrcoef(common, rank)[0, 1]) < 4.0 * standard_error


def test_errors_come_back_and_shifts_of_all_of_them_move_one_coordinate_alone():
    theta = PROBLEM.prior.rvs(50, np.random.default_rng(1))
    errors = np.random.default_rng(2).normal(size=(3, 50))
    step = common_error(PROBLEM)
    coordinates = step.coordinates(errors, theta)
    assert step.errors(coordinates, theta) == pytest.approx(errors, rel=1e-9)
    shifted = step.coordinates(errors + 0.1, theta)
    assert shifted[1:] == pytest.approx(coordinates[1:], abs=1e-12)
    assert (shifted[0] > coordinates[0]).all()


@pytest.mark.parametrize(
    ("problem", "has_one"),
    [(PROBLEM, True), (draw(BENCHES[:1], Truth(), seed=1).problem, False), (build(KNOWN), False)],
    ids=["three tests", "one test", "sizes are known"],
)
def test_only_errors_of_several_tests_whose_sizes_are_open_have_something_in_common(problem, has_one):
    assert (common_error(problem) is not None) == has_one
