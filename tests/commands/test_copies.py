"""Readings that stand twice in what is judged together would count twice."""

from collections.abc import Sequence
from dataclasses import replace

import pytest

import wirebayes as wb
from wirebayes.inference.policy import Policy
from wirebayes.io.checked_test import CheckedTest
from wirebayes.io.data_checks import COPIED_TEST, copied_tests
from wirebayes.io.experiment import Experiment
from wirebayes.io.run_folder import read_json

FEW = Policy(walkers=32, ess=300, rounds=2, round_draws=1024, block=20, most_steps=60, r_hat=1.5)


@pytest.fixture
def twice() -> list[Experiment]:
    """A test, and its readings under another name and length, as a block leaves that was copied and half changed."""
    (test,) = wb.simulate_tests(displacements=range(1, 5), seed=1).experiments
    return [test, replace(test, name="copy", length_mm=2.0 * test.length_mm)]


def _copied(tests: Sequence[Experiment]) -> list[str]:
    """Names of tests that are said to be copies."""
    return list(copied_tests({e.name: CheckedTest(e.protocol(), e.readings(), e.resolution) for e in tests}))


def test_a_copy_is_warned_of_where_both_are_judged_together(twice: list[Experiment]) -> None:
    fitted = wb.fit(twice, together=twice[0].material, policy=FEW)
    found = wb.discover(twice, policy=FEW, simulations=19).summary()["experiments"]
    said = {name: found[name]["warnings"] for name in ("wire", "copy")}
    assert [w["kind"] for w in said["copy"] if "experiment wire once more" in w["text"]] == ["data"]
    assert not [w for w in said["wire"] if "once more" in w["text"]]
    text = str(fitted.summary())
    assert "copy: its readings are those of experiment wire once more" in text


def test_a_copy_among_specimens_is_warned_of(twice: list[Experiment], tmp_path) -> None:
    """Each is fitted by itself, and the scatter of a material's specimens is judged by all of them."""
    wb.batch(twice, discover=False, check=False, policy=FEW, output=tmp_path / "batch")
    rows = {row["name"]: row for row in read_json(tmp_path / "batch" / "batch.json")["experiments"]}
    said = {name: [w["text"] for w in row["warnings"] if "once more" in w["text"]] for name, row in rows.items()}
    assert said["wire"] == [] and len(said["copy"]) == 1 and "compared together they count twice" in said["copy"][0]
    assert "experiment wire once more" in (tmp_path / "batch" / "summary.csv").read_text()


def test_other_readings_of_the_same_settings_are_no_copy(twice: list[Experiment]) -> None:
    (other,) = wb.simulate_tests(displacements=range(1, 5), seed=2).experiments
    assert _copied(twice) == ["copy"]
    assert not _copied([twice[0], replace(other, name="other")])


@pytest.mark.parametrize("readings", [COPIED_TEST - 1, COPIED_TEST])
def test_few_readings_may_agree_by_chance(twice: list[Experiment], readings: int) -> None:
    short = []
    for test in twice:
        hold = test.holds[0]
        begun = replace(hold, time_s=hold.time_s[:readings], readings=hold.readings[:readings])
        short.append(replace(test, holds=(begun,)))
    assert bool(_copied(short)) == (readings >= COPIED_TEST)
