"""A search for what is missing says the same of a test that is written in other units."""

from dataclasses import replace

import numpy as np
import pytest

from tests.rescaled import Drawn, drawn, factors, likelihood_of
from wirebayes.discovery.search import investigate
from wirebayes.discovery.settings import ALPHA, Settings
from wirebayes.io.experiment import Experiment
from wirebayes.model.scales import NATURAL, Units

SIMULATIONS = 59
SEARCHED = [i for i in range(34) if likelihood_of(i) == "chain"]  # a search takes chains
QUICK = 1  # under weights, misread, with an effect to find
SOME = [pytest.param(index, marks=[] if index == QUICK else pytest.mark.slow) for index in SEARCHED]


def misread(experiment: Experiment) -> Experiment:
    """The test with a tenth less read in its first holds, which no plain model explains."""
    holds = [
        replace(hold, readings=hold.readings * (0.9 if number < 3 else 1.0))
        for number, hold in enumerate(experiment.holds)
    ]
    return replace(experiment, holds=tuple(holds))


def found(case: Drawn, by: Units, *, disturbed: bool) -> dict[str, object]:
    """What `discover` reports of the first test in other units."""
    tests = [misread(test) if disturbed else test for test in case.rewritten(by)]
    report = investigate(tests, Settings(simulations=SIMULATIONS), 1).report
    return dict(next(iter(report["experiments"].values())))


@pytest.mark.parametrize("index", SOME)
def test_for_powers_of_two_p_verdict_and_probabilities_are_the_same(index):
    case, disturbed = drawn(index), index % 2 == 1
    one, other = (found(case, by, disturbed=disturbed) for by in (NATURAL, factors(index, powers_of_two=True)))
    for key in ("verdict", "effects", "best", "set", "accepted", "not_identifiable"):
        assert other[key] == one[key], key
    for key in ("probabilities", "inclusion"):
        assert other[key] == pytest.approx(one[key], rel=1e-12)
    assert other["p_global"] == pytest.approx(one["p_global"], rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("index", SEARCHED)
def test_for_other_factors_p_is_the_same_within_its_error(index):
    case = drawn(index)
    one, other = (found(case, by, disturbed=False) for by in (NATURAL, factors(index, powers_of_two=False)))
    p = one["p_global"]
    error = np.sqrt(p * (1.0 - p) * (1.0 / one["p_simulations"] + 1.0 / other["p_simulations"]))
    assert abs(other["p_global"] - p) <= 3.0 * error
    if abs(p - ALPHA) > 3.0 * error:
        assert other["verdict"] == one["verdict"]
