"""Readings that stand twice in what is judged together would count twice."""

from dataclasses import replace
from pathlib import Path

import pytest

import wirebayes as wb
from wirebayes.io.experiment import Experiment, refuse_copies


@pytest.fixture
def twice() -> list[Experiment]:
    """A test, and its readings under another name and length, as a block leaves that was copied and half changed."""
    (test,) = wb.simulate_tests(displacements=range(1, 5), seed=1).experiments
    return [test, replace(test, name="copy", length_mm=2.0 * test.length_mm)]


def test_readings_that_stand_twice_are_not_judged_together(twice: list[Experiment], tmp_path: Path) -> None:
    found = "experiment copy, key readings: found the readings of experiment wire"
    with pytest.raises(wb.InputError, match=found):
        wb.fit(twice, together=twice[0].material, output=tmp_path / "fit")
    with pytest.raises(wb.InputError, match=found):
        wb.discover(twice, output=tmp_path / "discover")
    assert not list(tmp_path.iterdir())


def test_other_readings_of_the_same_settings_are_no_copy(twice: list[Experiment]) -> None:
    (other,) = wb.simulate_tests(displacements=range(1, 5), seed=2).experiments
    refuse_copies([twice[0], replace(other, name="other")])


def test_few_readings_may_agree_by_chance(twice: list[Experiment]) -> None:
    short = []
    for test in twice:
        hold = test.holds[0]
        begun = replace(hold, time_s=hold.time_s[:3], readings=hold.readings[:3])
        short.append(replace(test, holds=(begun,)))
    refuse_copies(short)
