"""An exponent that depends on the length: both twins, their slopes, a robot, and what is stored."""

from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from tests.robot.lines import CORE, line_about
from tests.wire.protocols import PLAIN, columns, protocol
from wirebayes.effects import effect_named
from wirebayes.inference.fit import fit_problem
from wirebayes.inference.policy import Policy
from wirebayes.io.experiment_file import read_experiments
from wirebayes.model.build import build
from wirebayes.model.scales import scales_of
from wirebayes.results import read_back, store
from wirebayes.robot.mechanics import schema
from wirebayes.robot.mechanics.draws import for_robot
from wirebayes.simulation.synthetic import Bench, Truth, draw, write_tests
from wirebayes.wire import compiled
from wirebayes.wire.effect import Typical
from wirebayes.wire.fresh import FreshSample
from wirebayes.wire.model import Model
from wirebayes.wire.staircase import linearise, simulate

LENGTHS = 800.0, 1700.0
TYPICAL = Typical(2.5, 90.0)
HASTY = Policy(walkers=64, rounds=2, round_draws=2048, most_rounds=2, block=4, most_steps=4)
EXPONENTS = pytest.mark.parametrize("which", ["U", "N"])


def model_of(which: str) -> Model:
    return Model(effects=(effect_named(f"length_dependence@{which}"),), length_ref_mm=1000.0, typical=TYPICAL)


def theta_of(p: float = 0.7) -> dict[str, np.ndarray]:
    return columns(**PLAIN, **{"length_dependence.p": p})


def test_a_power_of_the_tension_leaves_the_creep_at_the_typical_tension_as_it_is() -> None:
    times = np.array([10.0, 90.0, 1e4])
    plain = FreshSample(columns(**PLAIN), Model(), 1000.0)
    for length in LENGTHS:
        wire = FreshSample(theta_of(), model_of("U"), length)
        assert wire.creep_mm(2.5, times) == pytest.approx(plain.creep_mm(2.5, times), rel=1e-12)
        power = PLAIN["U"] * (length / 1000.0) ** 0.7
        assert wire.creep_mm(5.0, times) == pytest.approx(plain.creep_mm(2.5, times) * 2.0**power, rel=1e-12)


def test_a_power_of_the_time_leaves_the_creep_of_a_typical_hold_as_it_is() -> None:
    plain = FreshSample(columns(**PLAIN), Model(), 1000.0)
    for length in LENGTHS:
        wire = FreshSample(theta_of(), model_of("N"), length)
        after_hold = np.array([90.0])
        assert wire.creep_mm(4.0, after_hold) == pytest.approx(plain.creep_mm(4.0, after_hold), rel=1e-12)
        hazard = PLAIN["k2"] * 90.0 ** PLAIN["N"] * 3.0 ** (PLAIN["N"] * (length / 1000.0) ** 0.7)
        reached = wire.creep_mm(4.0, np.array([270.0])) / wire.final_creep_mm(4.0)
        assert reached == pytest.approx(-np.expm1(-hazard), rel=1e-12)


@EXPONENTS
@pytest.mark.parametrize("control", ["displacement", "force"])
@pytest.mark.skipif(compiled.kernel is None, reason="nothing was compiled")
def test_both_twins_agree_to_rounding(which: str, control: str, monkeypatch: pytest.MonkeyPatch) -> None:
    test = protocol([1.0, 3.0, 5.0, 2.0], [[0.0, 20.0, 120.0]] * 4, length=1700.0, control=control)
    found = linearise(test, theta_of(), model_of(which))
    monkeypatch.setattr(compiled, "kernel", None)
    expected = linearise(test, theta_of(), model_of(which))
    for name in ("reading", "by_setting", "by_creep", "creep"):
        np.testing.assert_allclose(getattr(found, name), getattr(expected, name), rtol=1e-12, atol=1e-12)


@EXPONENTS
@pytest.mark.parametrize("compiled_kernel", [True, False])
def test_slopes_are_those_of_finite_differences(
    which: str, compiled_kernel: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not compiled_kernel:
        monkeypatch.setattr(compiled, "kernel", None)
    test = protocol([1.0, 3.0, 5.0, 2.0], [[0.0, 20.0, 120.0]] * 4, length=1700.0)
    line = linearise(test, theta_of(), model_of(which))
    both = {name: np.repeat(value, 2) for name, value in theta_of().items()}
    for j in range(4):
        error = np.zeros((4, 2))
        error[j] = 1e-5, -1e-5
        moved = simulate(test, both, model_of(which), error)
        slope = (moved[j, :, 0] - moved[j, :, 1]) / 2e-5
        assert slope == pytest.approx(line.by_setting[j, :, 0], rel=1e-6)


@EXPONENTS
def test_a_wire_in_a_robot_creeps_as_a_sample_of_its_length(which: str) -> None:
    """Two lines whose tests had other tensions and holds: each leg's is that of its own."""
    robot = schema.read_robot_file("linear-6")
    robot = replace(robot, wire=tuple("thick" if leg in (1, 4) else "default" for leg in range(6)))
    effect = effect_named(f"length_dependence@{which}")
    wire = line_about(CORE | {"length_dependence.p": 0.7}, 0.1, 3, 1, "hooke")
    thin = replace(wire, effects=(effect,), typical=TYPICAL)
    thick = replace(thin, name="thick", typical=Typical(40.0, 600.0))
    wires = for_robot(robot, replace(thin, others={"thick": thick}))
    times = np.array([30.0, 900.0])
    for leg in range(6):
        own = thick if leg in (1, 4) else thin
        model = Model(effects=own.effects, length_ref_mm=own.length_mm, typical=own.typical)
        length_mm = 1e3 * robot.wire_m[leg]
        sample = FreshSample(own.parameters, model, length_mm)
        # B is of the tested length on both sides: creep is a strain
        expected = sample.creep_mm(3.0, times)
        np.testing.assert_allclose(wires.sample(leg).creep_mm(3.0, times), expected, rtol=1e-12)


@pytest.fixture(scope="module", params=["U", "N"])
def fitted(request: pytest.FixtureRequest):
    effects = [effect_named(f"length_dependence@{request.param}")]
    benches = [Bench(name, "line", length) for name, length in zip(("short", "long"), LENGTHS, strict=True)]
    joint = draw(benches, Truth({"length_dependence.p": 0.4}, effects), seed=3).problem
    return fit_problem(joint, 1, policy=HASTY)


@pytest.mark.parametrize("sample", [0, 1])
@pytest.mark.parametrize("apart", [False, True])
def test_what_is_stored_predicts_as_the_fit_does(fitted, sample: int, apart: bool, tmp_path: Path) -> None:
    joint = fitted.problem
    here = joint.samples[sample]
    assert here.model.typical == joint.samples[0].model.typical != (1.0, 1.0)
    store.save_posterior(fitted, tmp_path, {}, sample=here if apart else None)
    stored = read_back.load_posterior(tmp_path, here.name)
    assert stored.sample.model.typical == here.model.typical
    read = {name: values[:20] for name, values in stored.draws.items()}
    expected = simulate(here.protocol, joint.parameters(fitted.flat[:20], here), here.model)
    assert simulate(stored.sample.protocol, read, stored.sample.model) == pytest.approx(expected, rel=1e-9)


def test_a_file_that_does_not_say_what_was_typical_refers_to_one_newton_and_one_second(fitted, tmp_path: Path) -> None:
    store.save_posterior(fitted, tmp_path, {})
    with h5py.File(tmp_path / "posterior.nc", "a") as file:
        for name in ("typical_tension_N", "typical_hold_s"):
            del file["posterior"].attrs[name]
    stored = read_back.load_posterior(tmp_path, "long")
    assert stored.sample.model.typical == (1.0, 1.0)
    here = fitted.problem.samples[1]
    as_before = replace(here.model, typical=Typical(1.0, 1.0))
    read = {name: values[:20] for name, values in stored.draws.items()}
    expected = simulate(here.protocol, fitted.problem.parameters(fitted.flat[:20], here), as_before)
    assert simulate(stored.sample.protocol, read, stored.sample.model) == pytest.approx(expected, rel=1e-9)


def test_tests_fitted_together_have_one_typical_tension_and_hold(tmp_path: Path) -> None:
    longer = Bench("long", "line", LENGTHS[1], times_s=(0.0, 100.0, 400.0))
    write_tests(tmp_path, [Bench("short", "line", LENGTHS[0]), longer], Truth(), 3)
    tests = read_experiments(tmp_path / "experiments.toml")
    scales = scales_of(tests)
    for sample in build(tests, [effect_named("length_dependence@U")]).samples:
        assert sample.model.typical == (scales.tension_N, scales.hold_s)
