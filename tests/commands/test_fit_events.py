"""Events that a fit is asked for: at a hold of any of its tests, or of the one that is named."""

from dataclasses import replace

import pytest

import wirebayes as wb
from tests.simulated import WIRE, simulated_tests
from wirebayes.effects import effect_named
from wirebayes.io.experiment import Experiment
from wirebayes.simulation.synthetic import Bench, Truth

FEW = wb.Policy(walkers=32, ess=300, rounds=2, round_draws=1024, block=20, most_steps=60, r_hat=1.5)


@pytest.fixture(scope="module")
def pair() -> list[Experiment]:
    """Two tests of one line, of which only the second has a fifth hold."""
    benches = [
        Bench(name, "line", displacements_mm=tuple(range(1, last))) for name, last in (("first", 5), ("second", 6))
    ]
    return simulated_tests(benches, Truth(WIRE), seed=1)


def test_an_event_may_name_its_test(pair: list[Experiment]) -> None:
    found = wb.fit(pair, together="line", effects=["grip_slip@second:5"], check=False, policy=FEW)
    assert found.summary()["effects"] == ["grip_slip@second:5"]
    effects = {name: found.stored(name).sample.model.effects for name in ("first", "second")}
    assert effects["first"] == () and [e.key for e in effects["second"]] == ["grip_slip@second:5"]


def test_the_readings_say_how_long_a_pause_was_not_its_prior() -> None:
    """Seventeen holds long: a prior of some holds without a tail answered 1,400 s, and said that it decides."""
    times = (0.0, 10.0, 20.0, 40.0, 60.0, 90.0, 120.0)
    bench = Bench("pause", "line", displacements_mm=tuple(range(1, 11)), times_s=times)
    wire = {"k1": 900.0, "B": 0.5, "U": 0.8, "k2": 0.01, "N": 0.75, "preload": 0.3}
    errors = {"sensor_sd": 0.004, "setting_sd": 0.01}
    effect = effect_named("unrecorded_hold@6")
    pause = {"unrecorded_hold.T": 2000.0}
    tests = simulated_tests([bench], Truth(wire | errors | pause, effects=[effect]), seed=1)
    summary = wb.fit(tests, effects=[effect.key], check=False, policy=FEW).summary()
    found = summary["parameters"]["unrecorded_hold.T"]
    assert found["q05"] < 2000.0 < found["q95"]
    assert "prior" not in [notice["kind"] for notice in summary["warnings"]]


@pytest.mark.parametrize(
    ("effect", "found"),
    [
        ("grip_slip@6", "found no recorded hold 6 in first, second of"),
        ("grip_slip@first:5", "found no recorded hold 5 in first, second of"),
        ("grip_slip@third:5", "found no experiment third in first, second of"),
    ],
)
def test_an_event_at_no_hold_is_refused(pair: list[Experiment], effect: str, found: str) -> None:
    with pytest.raises(wb.InputError, match=f"--effect {effect}: {found}"):
        wb.fit(pair, together="line", effects=[effect], check=False, policy=FEW)


def test_experiments_whose_folders_would_be_one_somewhere_are_refused(pair: list[Experiment]) -> None:
    alike = [pair[0], replace(pair[1], name="First")]
    with pytest.raises(wb.InputError, match="found first, First, expected names that differ more"):
        wb.fit(alike, check=False, policy=FEW)


def test_a_material_is_found_however_its_accents_are_written(pair: list[Experiment]) -> None:
    cable = [replace(test, material="c\u00e2ble") for test in pair]
    with pytest.raises(wb.InputError, match="found no recorded hold 6 in first, second of"):
        wb.fit(cable, together="ca\u0302ble", effects=["grip_slip@6"], check=False, policy=FEW)
