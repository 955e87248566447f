"""One wire under steps and under weights: both find it, and together they know it better."""

from dataclasses import replace

import numpy as np
import pytest

from tests.simulated import simulated_tests
from wirebayes.effects import CATALOGUE
from wirebayes.inference import rough_draws
from wirebayes.inference.fit import fit_problem
from wirebayes.inference.laplace_fit import fitted
from wirebayes.io.experiment import Experiment
from wirebayes.model.build import build
from wirebayes.model.scales import NATURAL
from wirebayes.model.spec import PLAIN_SPEC, ModelSpec
from wirebayes.simulation.synthetic import Bench, Truth, draw

TIMES = (0.0, 15.0, 30.0, 60.0, 120.0, 300.0)
WIRE = {"k1": 900.0, "B": 0.2, "U": 0.8, "k2": 0.03, "N": 0.8}
STEPS = Bench("steps", "line", displacements_mm=(1, 2, 3, 4, 5, 6, 4), times_s=TIMES, resolution_N=0.001)
WEIGHTS = Bench("weights", "line", weights_N=(1, 2, 3, 4, 5, 2), times_s=TIMES, resolution_mm=0.001)
ERRORS = {
    "steps": {"preload": 0.4, "sensor_sd": 0.006, "setting_sd": 0.02},
    "weights": {"preload": -3.0, "sensor_sd": 0.006, "setting_sd": 0.02},
}


@pytest.fixture(scope="module")
def both() -> dict[str, Experiment]:
    made = [simulated_tests([b], Truth(WIRE | ERRORS[b.name]), seed) for seed, b in enumerate((STEPS, WEIGHTS), 1)]
    return {tests[0].name: tests[0] for tests in made}


def draws(experiments: list[Experiment]) -> dict[str, np.ndarray]:
    """Of the first experiment's parameters, by the normal approximation weighted by the posterior."""
    rng = np.random.default_rng(0)
    block = fitted(experiments, (), PLAIN_SPEC, rng)
    own, natural = block.target.problem, block.target.problem.in_units(NATURAL)
    theta = own.theta_in(NATURAL, rough_draws.draws(block.target, block.modes, rng))
    return natural.parameters(theta, natural.samples[0])


def test_a_pair_of_tests_agrees_with_the_wire_and_is_sharper_together(both: dict[str, Experiment]) -> None:
    sd = {}
    for name, chosen in (("steps", ["steps"]), ("weights", ["weights"]), ("together", ["steps", "weights"])):
        found = draws([both[key] for key in chosen])
        for parameter, value in WIRE.items():
            logs = np.log(found[parameter]) - np.log(value)
            assert abs(logs.mean()) < 3.0 * logs.std(), (name, parameter)
            sd[name, parameter] = logs.std()
    for parameter in WIRE:
        assert sd["together", parameter] < min(sd["steps", parameter], sd["weights", parameter]), parameter


def test_hold_by_hold_a_test_under_weights_has_neither_stiffness_nor_preload(both: dict[str, Experiment]) -> None:
    problem = build([both["weights"]], spec=ModelSpec(likelihood="hold"))
    assert problem.names == ("B", "U", "k2", "N", "sensor_sd")
    theta = np.array([[WIRE["B"], WIRE["U"], WIRE["k2"], WIRE["N"], 0.006]])
    assert np.isfinite(problem.log_likelihood(theta)).all()
    assert build([both["steps"]], spec=ModelSpec(likelihood="hold")).names[0] == "k1"


def test_a_law_whose_wire_cannot_carry_the_weights_has_no_likelihood(both: dict[str, Experiment]) -> None:
    problem = build([both["weights"]], spec=ModelSpec(law="modified"))
    theta = np.array([[k1, 0.2, 0.8, 0.03, 0.8, -3.0, 0.006, 0.02] for k1 in (4.9, 900.0)])
    assert np.isfinite(problem.log_likelihood(theta)).tolist() == [False, True]


def test_an_instrument_s_amplitude_is_not_shared_by_steps_and_weights(both: dict[str, Experiment]) -> None:
    drift, stiffening = CATALOGUE["sensor_drift"](), CATALOGUE["strain_stiffening"]()
    own = {"sensor_drift.a[displacement]", "sensor_drift.a[force]"}
    assert own <= set(build(list(both.values()), (drift,)).names)
    assert "strain_stiffening.c" in build(list(both.values()), (stiffening,)).names
    assert build([both["weights"]], (drift,)).names[-4:-3] == ("sensor_drift.a",)


@pytest.mark.parametrize("powers", [(10, 7, 6), (-20, 3, -4)])
def test_weights_in_other_units_are_the_same_problem_to_the_last_bit(
    both: dict[str, Experiment], powers: tuple[int, int, int]
) -> None:
    """Tensions, lengths and times times powers of two: in the test's own units nothing has changed."""
    tension, length, time = (2.0**power for power in powers)
    test = both["weights"]
    holds = [
        replace(
            hold,
            setting=hold.setting * tension,
            readings=hold.readings * length,
            time_s=hold.time_s * time,
            duration_s=hold.duration_s * time,
            start_s=hold.start_s * time,
        )
        for hold in test.holds
    ]
    other = replace(test, holds=tuple(holds), length_mm=test.length_mm * length, resolution=test.resolution * length)
    first, second = (p.in_units(p.own_units) for p in (build([test]), build([other])))
    theta = first.prior.rvs(200, np.random.default_rng(1))
    values = first.log_likelihood(theta) + first.prior.log_density()(theta)
    assert np.isfinite(values).any()
    np.testing.assert_array_equal(values, second.log_likelihood(theta) + second.prior.log_density()(theta))


def test_weights_hung_to_and_fro_and_read_twice_a_hold_by_hand_converge() -> None:
    """Elastic stretch and creep before the first reading are hardly told apart: k1 has a long tail, and the preload."""
    bench = Bench(weights_N=(2.4, 8.4) * 10, times_s=(40.0, 120.0), resolution_mm=0.0)
    truth = Truth({"k1": 600.0, "B": 0.3, "U": 0.9, "k2": 0.04, "N": 0.8} | ERRORS["weights"] | {"sensor_sd": 0.1})
    done = fit_problem(draw([bench], truth, seed=1).problem)
    assert done.converged, done.why
    assert done.chains.evaluations < 150_000
