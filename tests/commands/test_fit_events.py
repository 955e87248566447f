"""Events that a fit is asked for: at a hold of any of its tests, or of the one that is named."""

from dataclasses import replace

import pytest

import wirebayes as wb
from tests.simulated import WIRE, simulated_tests
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
