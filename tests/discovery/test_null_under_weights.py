"""The study of p under weights: simulations at the truth are made with the true parameters, in the fit's own units."""

import numpy as np
import pytest

from analyses.discovery.null_under_weights import at_truth, one, summary
from analyses.posterior.any_scale import made_test
from wirebayes.inference.laplace_fit import fitted
from wirebayes.model.spec import PLAIN_SPEC


def test_the_centre_of_simulations_at_the_truth_is_the_truth():
    made = made_test(3, 0)
    assert made.weights
    block = fitted([made.test], (), PLAIN_SPEC, np.random.default_rng(0))
    assert at_truth(block, made.truth).best == pytest.approx(made.truth, rel=1e-9)
    assert block.best != pytest.approx(made.truth, rel=1e-3)


def test_each_test_has_a_p_by_either_kind_of_simulations():
    row = one(0, 1)
    assert row["weights"] and 0.0 < row["fit"] <= 1.0 and 0.0 < row["truth"] <= 1.0
    found = summary([row, row | {"fit": 0.03}])
    assert found["fit"]["0.04"]["k"] == 1 and found["truth"]["0.04"]["k"] == (row["truth"] <= 0.04) * 2
