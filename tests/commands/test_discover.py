"""`discover`: the models before and after are of the same readings."""

from dataclasses import replace

import pytest

import wirebayes as wb

HASTY = wb.Policy(walkers=64, rounds=2, round_draws=1024, most_rounds=2, block=2, most_steps=2)


@pytest.fixture
def with_a_gross_error():
    (test,) = wb.simulate_tests(displacements=range(1, 13), times=[0, 30, 60, 90, 120], seed=1).experiments
    holds = list(test.holds)
    readings = holds[6].readings.copy()
    readings[2] -= 1.0
    holds[6] = replace(holds[6], readings=readings)
    return replace(test, holds=tuple(holds))


def test_the_plain_model_is_of_the_readings_that_were_not_struck_out(with_a_gross_error, tmp_path):
    found = wb.discover(with_a_gross_error, policy=HASTY, simulations=99, output=tmp_path / "out")
    name = with_a_gross_error.name
    ((hold, reading),) = [(g["hold"], g["reading"]) for g in found.report["experiments"][name]["gross_errors"]]
    assert (hold, reading) == (7, 2)  # counted from 0
    count = with_a_gross_error.readings().size - 1
    for posterior in (found.plain[name], found.final[name]):
        (sample,) = posterior.stored().problem.samples
        assert int(sample.protocol.mask.sum()) == count
