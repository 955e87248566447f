"""A sensor zeroed anew between two holds: found where the moves beside it give it away, and hardly ever elsewhere."""

from dataclasses import replace

import numpy as np
import pytest

from tests.io.test_limits_of_checks import checked, flat
from tests.simulated import SOFTER
from wirebayes.effects import effect_named
from wirebayes.io.checked_test import CheckedTest
from wirebayes.io.zero_shifts import zero_shift
from wirebayes.simulation.synthetic import Bench, Truth, draw

UP, BOTH = tuple(range(1, 13)), (*range(1, 11), *range(9, 3, -1))
BENCHES = [
    Bench(),
    Bench(displacements_mm=BOTH, resolution_N=0.0),
    Bench(
        displacements_mm=np.cumsum([0.5, 1.5, 0.7, 1.1, 0.6, 1.6, 0.9, 1.2, 0.8]).tolist(), times_s=(0.0, 5.0, 600.0)
    ),
    Bench(temperatures_C=(20.0, 24.0, 19.0), times_s=(0.0, 10.0, 40.0, 120.0)),
    Bench(weights_N=UP),
    Bench(weights_N=BOTH),
]
STEPS = (0.2, 0.4, 0.6, 0.8, 3.8, 4.0, 4.2, 4.4, 4.6, 4.8)
TIMES_S = (0.0, 30.0, 60.0, 120.0, 300.0, 600.0, 900.0)
HONEST = [  # a move larger than the others, and a hold that was first read late
    Bench(displacements_mm=STEPS, resolution_N=0.001),
    Bench(times_s=[TIMES_S[4:] if hold == 5 else TIMES_S for hold in range(12)], resolution_N=0.0),
    Bench(weights_N=UP, times_s=[TIMES_S[4:] if hold == 5 else TIMES_S for hold in range(12)], resolution_mm=0.0),
]


def simulated(bench, seed, *effects, wire=None):
    """A test of a wire out of the prior, if none is given."""
    sample = draw([bench], Truth(wire or {}, effects), seed=seed).problem.samples[0]
    return CheckedTest(sample.protocol, sample.readings[..., 0], bench.resolution)


def shifted(test, hold, by):
    """The same with another zero from a hold on."""
    values = test.values.copy()
    values[hold:] += by * test.protocol.mask[hold:]
    return replace(test, values=values)


def test_sound_tests_have_no_other_zero():
    """Of wires out of the prior, by steps and weights, with unloading, warming and uneven steps."""
    said = [zero_shift(simulated(bench, seed)) for seed in range(60) for bench in BENCHES]
    assert len(said) == 360 and sum(map(bool, said)) <= 3


def test_a_larger_move_and_a_late_first_reading_are_no_other_zero():
    said = [zero_shift(simulated(bench, seed)) for seed in range(60) for bench in HONEST]
    assert len(said) == 180 and sum(map(bool, said)) <= 1


def test_readings_without_noise_are_judged_without_a_division_by_zero():
    with np.errstate(all="raise"):
        assert "from hold 4 to hold 5" in zero_shift(checked(flat(1.0, 2.0, 3.0, 4.0, 4.4, 5.4, 6.4, 7.4), noise=0.0))


@pytest.mark.parametrize("name", ["toe", "strain_stiffening", "guide_friction", "lost_motion", "steady_creep"])
def test_effects_that_bend_the_course_or_show_at_a_reversal_are_no_other_zero(name):
    said = [zero_shift(simulated(bench, seed, effect_named(name))) for seed in range(12) for bench in BENCHES[:2]]
    assert sum(map(bool, said)) <= 1


@pytest.mark.parametrize("part", [-0.5, 0.5, -1.0, "all"])
def test_another_zero_is_found_with_its_place(part):
    """Half of what a move adds, or all that was read when the sensor was zeroed under load.

    Of wires out of the prior, some of which are slack or set to a third of a step, only about half are found.
    """
    right = []
    for seed in range(50):
        test = simulated(BENCHES[seed % 2], 500 + seed, wire=SOFTER)
        hold = 2 + seed % 7
        move = float(np.median(np.abs(np.diff([row[0] for row in test.each]))))
        said = zero_shift(shifted(test, hold, -test.each[hold - 1][-1] if part == "all" else part * move))
        right.append(f"from hold {hold} to hold {hold + 1} the tension" in said)
    assert np.mean(right) >= 0.9


def test_the_sentence_says_what_is_expected_and_what_may_have_been():
    levels = [1.0, 2.0, 3.0, 4.0, 4.4, 5.4, 6.4, 7.4]
    said = zero_shift(checked(flat(*levels), noise=0.01))
    assert said == (
        "from hold 4 to hold 5 the tension changes by 0.4 N, where the other moves suggest 1 N, and the difference "
        "stays: was the sensor zeroed there, did the wire slip, or is time or a move not recorded? correct the "
        "readings from there on, or leave them out"
    )
    under_weights = zero_shift(checked(flat(*levels), noise=0.01, control="force"))
    assert "the displacement changes by 0.4 mm, where the other moves suggest 1 mm" in under_weights


@pytest.mark.parametrize(
    ("noise", "offs", "found"),
    [
        (0.1, {4: 0.56}, False),  # four times what two readings are off by
        (0.1, {4: 0.57}, True),
        (0.001, {4: 0.247}, False),  # a quarter of what a move adds
        (0.001, {4: 0.253}, True),
        (0.001, {4: 1.0, 5: -0.495}, True),  # half of it is taken back
        (0.001, {4: 1.0, 5: -0.505}, False),
        (0.001, {4: -1.0, 3: 0.505}, False),
        (0.001, {2: 1.0, 6: 1.0}, False),  # one of seven other moves is off as far
    ],
)
def test_a_step_stands_out_from_the_other_moves(noise, offs, found):
    added = np.array([1.0 + offs.get(i, 0.0) for i in range(8)])
    assert bool(zero_shift(checked(flat(*(5.0 + np.cumsum([0.0, *added]))), noise=noise))) == found


@pytest.mark.parametrize(
    ("first", "noise", "moves", "found"),
    [
        (5.0, 0.001, 5, False),  # moves that go the same way
        (5.0, 0.001, 6, True),
        (0.0198, 0.001, 6, False),  # of the largest reading, which is 1: the first hold may be slack
        (0.0202, 0.001, 6, True),
        (0.0495, 0.01, 6, False),  # five noise levels
        (0.0505, 0.01, 6, True),
    ],
)
def test_six_moves_of_a_taut_wire_show_what_a_move_adds(first, noise, moves, found):
    largest = 1.0 if first < 1.0 else 20.0
    added = np.full(moves, 1.0)
    added[3] = 2.0
    levels = first + (largest - first) * np.concatenate([[0.0], np.cumsum(added) / added.sum()])
    assert bool(zero_shift(checked(flat(*levels), noise=noise))) == found


@pytest.mark.parametrize(("beside", "found"), [(1.0, True), (0.505, True), (0.495, False), (0.0, False)])
@pytest.mark.parametrize("at", ["first", "last"])
def test_a_wrong_first_or_last_reading_is_no_other_zero(beside, found, at):
    rows = flat(*range(5, 14), readings=5)
    if at == "first":
        rows[4:] = [[value + beside for value in row] for row in rows[4:]]
        rows[4][0] += 1.0 - beside
    else:
        rows[:4] = [[value - beside for value in row] for row in rows[:4]]
        rows[3][-1] -= 1.0 - beside
    assert bool(zero_shift(checked(rows, noise=0.001))) == found


def test_moves_over_an_unrecorded_hold_and_after_a_reversal_show_nothing():
    levels = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]
    there = checked(flat(*levels, 5.0), settings=[*range(8), 6.0], noise=0.001)
    assert not zero_shift(there)  # the first move down adds another amount
    gap = shifted(checked(flat(*range(1, 10)), noise=0.001), 5, -0.5)
    assert zero_shift(gap)
    mask = gap.protocol.mask.copy()
    mask[4] = False
    number = np.where(mask.any(axis=1), gap.protocol.number, -1)
    assert not zero_shift(replace(gap, protocol=replace(gap.protocol, mask=mask, number=number)))
