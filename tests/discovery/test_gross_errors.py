"""A reading that is struck out is gone; everything else of its test stays, whatever was set in it."""

import numpy as np
import pytest

from tests.simulated import simulated_tests
from wirebayes.discovery.gross_errors import place_in_file, without
from wirebayes.io.experiment import Experiment
from wirebayes.simulation.synthetic import Bench, Truth

STEPS = Bench(displacements_mm=(1.0, 2.0), temperatures_C=(20.0, 21.0))
WEIGHTS = Bench(weights_N=(1.0, 2.0))


def one(bench: Bench) -> Experiment:
    return simulated_tests([bench], Truth(), seed=1)[0]


@pytest.mark.parametrize("bench", [STEPS, WEIGHTS])
def test_one_reading_is_struck_out_of_what_was_read(bench: Bench) -> None:
    before = one(bench)
    after = without(before, 2, 1)
    kept = [0, 2, 3, 4]
    assert after.holds[0] is before.holds[0] and after.holds[1].number == 2
    assert after.holds[1].readings.tolist() == before.holds[1].readings[kept].tolist()
    assert after.holds[1].time_s.tolist() == before.holds[1].time_s[kept].tolist()
    assert after.holds[1].duration_s == before.holds[1].duration_s == 120.0
    if bench is STEPS:
        assert after.holds[1].temperature_C.tolist() == before.holds[1].temperature_C[kept].tolist()


def test_a_hold_whose_only_reading_is_struck_out_was_not_recorded() -> None:
    before = one(Bench(displacements_mm=(1.0, 2.0, 3.0), times_s=((0.0, 60.0), (0.0,), (0.0, 60.0))))
    after = without(before, 2, 0)
    assert [hold.recorded for hold in after.holds] == [True, False, True]
    assert after.protocol().number.tolist() == [1, -1, 3] and np.array_equal(after.protocol().setting, [1.0, 2.0, 3.0])


def test_a_further_reading_of_a_hold_is_named_as_the_file_counts_it() -> None:
    """Whatever was struck out of the hold before, in any order."""
    rng = np.random.default_rng(0)
    for _ in range(50):
        in_file, struck = list(range(8)), []
        for _ in range(5):
            left = int(rng.integers(len(in_file)))
            found = place_in_file(left, struck)
            assert found == in_file.pop(left)
            struck.append(found)
