"""Every effect is one model whatever is called a newton, a second or a millimetre."""

from dataclasses import replace

import numpy as np
import pytest

from tests.rescaled import drawn, rewritten
from wirebayes.effects import CATALOGUE, effect_named
from wirebayes.effects.rivals import RIVALS, TwoModes
from wirebayes.effects.unknown import Discrepancy
from wirebayes.inference.laplace_fit import fitted
from wirebayes.io.experiment import Experiment
from wirebayes.model.build import build
from wirebayes.model.problem import Problem
from wirebayes.model.scales import Units
from wirebayes.model.spec import PLAIN_SPEC, ModelSpec
from wirebayes.numeric.distributions import Normal
from wirebayes.wire.effect import Effect, EventEffect
from wirebayes.wire.staircase import simulate

# kilonewtons, minutes and metres: in these everything that was measured is so many times smaller
SMALLER = Units(1e-3, 1e-3, 1.0 / 60.0)
TWO_LENGTHS, UNDER_WEIGHTS = 22, 18  # drawn tests of two lengths each; under weights they go back
FREE = ModelSpec(length_exponent=Normal(1.0, 0.3))


def measured_at(index: int) -> list[Experiment]:
    """Drawn tests with a log of the temperature, in holds whose numbers go on."""
    out = []
    for experiment in drawn(index).experiments:
        holds = [
            replace(hold, temperature_C=20.0 + 0.1 * i + np.linspace(0.0, 0.05, len(hold.time_s)))
            for i, hold in enumerate(experiment.holds)
        ]
        out.append(replace(experiment, holds=tuple(holds)))
    return out


def forms(index: int) -> list[Effect]:
    """Every form of the catalogue that the tests could show, an event at one hold, and the other laws of creep."""
    protocols = [test.protocol() for test in measured_at(index)]
    found = {}
    for kind in CATALOGUE.values():
        if issubclass(kind, EventEffect):
            effect = kind(hold=3, test="test-0")
            found[effect.key] = effect
        else:
            found |= {effect.key: effect for effect in kind.variants(protocols)}
    return [*found.values(), *(kind() for kind in RIVALS.values())]


CASES = [(index, effect) for index in (TWO_LENGTHS, UNDER_WEIGHTS) for effect in forms(index)]
OF_ALL = pytest.mark.parametrize(
    ("index", "effect"), [pytest.param(i, e, id=f"{drawn(i).kind}-{e.key}") for i, e in CASES]
)


def pair(index: int, effects: list[Effect], spec: ModelSpec = PLAIN_SPEC) -> tuple[Problem, Problem]:
    """The problem of some tests, and that of the same tests in other units; each in its natural units."""
    tests = measured_at(index)
    if any(effect.name == TwoModes.name for effect in effects):  # its rates have no other exponent
        tests = [replace(test, priors={"N": {"fixed": 1.0}}) for test in tests]
    return build(tests, effects, spec), build([rewritten(test, SMALLER) for test in tests], effects, spec)


def written(one: Problem, other: Problem, theta: np.ndarray) -> np.ndarray:
    """Parameters of a problem as the numbers that they are in the units of another's tests."""
    length, tension, time = SMALLER.length_mm, SMALLER.tension_N, SMALLER.time_s
    unit = Units(1.0 / length, 1.0 / tension, 1.0 / time)  # of the other problem, in those of this one
    return one.theta_in(unit, theta)


def draws(problem: Problem) -> np.ndarray:
    """Parameters of the prior at which the model can be computed."""
    theta = problem.prior.rvs(60, np.random.default_rng(0))
    value = problem.log_likelihood(theta)
    usual = np.isfinite(value) & (np.abs(value) < 1e12)
    assert usual.sum() > 10
    return theta[usual]


def reads_the_same(one: Problem, other: Problem) -> None:
    """Readings, likelihood and prior of both are those of one model."""
    theta = draws(one)
    there = written(one, other, theta)
    read = 0.0
    for a, b in zip(one.samples, other.samples, strict=True):
        unit = SMALLER.tension_N if a.protocol.control == "displacement" else SMALLER.length_mm
        here = simulate(a.protocol, one.parameters(theta, a), a.model) * unit
        np.testing.assert_allclose(
            simulate(b.protocol, other.parameters(there, b), b.model), here, rtol=1e-9, atol=1e-9 * np.abs(here).max()
        )
        read += a.protocol.mask.sum() * np.log(unit)
    density = one.log_likelihood(theta) - read
    np.testing.assert_allclose(other.log_likelihood(there), density, rtol=1e-9)
    of_parameters = np.log(np.abs(there / theta)).sum(axis=1)
    prior = one.prior.log_density()(theta) - of_parameters
    np.testing.assert_allclose(other.prior.log_density()(there), prior, rtol=1e-9, atol=1e-9)


def test_the_tests_could_show_every_effect() -> None:
    assert {effect.name for _, effect in CASES} == {*CATALOGUE, *RIVALS}


@OF_ALL
def test_an_effect_reads_the_same_in_other_units(index: int, effect: Effect) -> None:
    one, other = pair(index, [effect])
    reads_the_same(one, other)


@OF_ALL
def test_an_effect_is_the_same_model_where_it_is_sampled_and_where_it_is_stored(index: int, effect: Effect) -> None:
    """Fits are in units of the test, what they leave is in mm, N and s."""
    one, _ = pair(index, [effect])
    own = one.in_units(one.own_units)
    theta = draws(one)
    shift = sum(np.sum(units) for units in own.log_units(one))
    found = own.log_likelihood(one.theta_in(own.units, theta))
    np.testing.assert_allclose(found - shift, one.log_likelihood(theta), rtol=1e-9)


@pytest.mark.parametrize("index", [TWO_LENGTHS, UNDER_WEIGHTS])
def test_so_does_creep_that_grows_with_a_free_power_of_the_length(index: int) -> None:
    one, other = pair(index, [], FREE)
    reads_the_same(one, other)


def test_so_does_a_smooth_remainder() -> None:
    tests = measured_at(TWO_LENGTHS)[:1]
    holds = len(tests[0].holds)
    here = Discrepancy(holds, 0.3, 100.0, 1.0, 7.0)
    there = here.in_units(SMALLER.length_mm, SMALLER.tension_N, SMALLER.time_s)
    reads_the_same(build(tests, [here]), build([rewritten(test, SMALLER) for test in tests], [there]))


@pytest.mark.parametrize("which", ["U", "N"])
def test_evidence_and_best_fit_are_the_same_in_other_units(which: str) -> None:
    effects = [effect_named(f"length_dependence@{which}")]
    tests = measured_at(TWO_LENGTHS)
    one, other = (
        fitted(measured, effects, PLAIN_SPEC, np.random.default_rng(0))
        for measured in (tests, [rewritten(test, SMALLER) for test in tests])
    )
    assert other.log_evidence == pytest.approx(one.log_evidence, abs=1e-3)
    problems = pair(TWO_LENGTHS, effects)
    best = np.array([[one.best[name] for name in problems[0].names]])
    found = np.array([other.best[name] for name in problems[0].names])
    np.testing.assert_allclose(found, written(*problems, best)[0], rtol=1e-3)
