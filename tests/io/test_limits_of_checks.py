"""Each threshold of the checks of readings, on both of its sides."""

import numpy as np
import pytest

from tests.wire.protocols import protocol
from wirebayes.io import data_checks, gross_events
from wirebayes.io.data_checks import CheckedTest
from wirebayes.io.isolated_readings import outlier

TIMES = [0.0, 20.0, 40.0, 60.0]
NOISE = 0.1  # by rounding: readings on straight lines have no other


def checked(rows, settings=None, control="displacement", noise=NOISE, length=1000.0):
    """A test whose rounding alone is its noise."""
    settings = np.arange(1.0, len(rows) + 1) if settings is None else settings
    times = [20.0 * np.arange(len(row)) for row in rows]
    p = protocol(settings, times, length=length, control=control)
    values = np.zeros(p.mask.shape)
    for row, value in zip(values, rows, strict=True):
        row[: len(value)] = value
    return CheckedTest(p, values, noise * np.sqrt(12.0))


def flat(*levels, readings=4):
    return [[float(level)] * readings for level in levels]


@pytest.mark.parametrize(("counts", "warned"), [((4, 4), False), ((4, 5), True)])
def test_times_run_on_by_chance_of_one_in_a_hundred(counts, warned):
    """One order of 70, and one of 126."""
    first, second = np.arange(counts[0]), counts[0] + np.arange(counts[1])
    p = protocol([1.0, 2.0], [first, second])
    assert bool(data_checks.run_on_times(CheckedTest(p, np.ones(p.mask.shape), 0.0))) == warned


@pytest.mark.parametrize(
    ("lowest", "noise", "warned"),
    [(-0.495, 0.0, False), (-0.505, 0.0, True), (-0.595, 0.2, False), (-0.605, 0.2, True)],
)
def test_tension_is_negative_beyond_a_twentieth_of_the_largest_and_three_noise_levels(lowest, noise, warned):
    assert bool(data_checks.negative_tension(checked(flat(lowest, 10.0), noise=noise))) == warned


@pytest.mark.parametrize(
    ("levels", "said"),
    [
        ((0.297, 0.1), "no reading stands out"),
        ((0.303, 0.0), ""),
        ((10.0, 10.297), "tension stays"),
        ((10, 10.303), ""),
    ],
)
def test_readings_say_something_from_three_noise_levels_on(levels, said):
    found = data_checks.unresponsive_tension(checked(flat(*levels)))
    assert said in found and bool(said) == bool(found)


@pytest.mark.parametrize(("apart", "warned"), [(0.297, True), (0.303, False)])
def test_displacements_follow_weights_from_three_noise_levels_on(apart, warned):
    assert bool(data_checks.elongation(checked(flat(5.0, 5.0 + apart), control="force"))) == warned


@pytest.mark.parametrize(("correlation", "falling"), [(-0.899, False), (-0.901, True)])
def test_readings_fall_with_the_setting_from_a_correlation_of_nine_tenths_on(correlation, falling):
    along, across = np.array([-1.0, -1.0, 1.0, 1.0]), np.array([-1.0, 1.0, -1.0, 1.0])
    assert data_checks.falls(along, correlation * along + np.sqrt(1.0 - correlation**2) * across) == falling


@pytest.mark.parametrize(("strain", "warned"), [(4.95e-5, True), (5.05e-5, False), (0.495, False), (0.505, True)])
def test_strains_are_those_of_a_wire(strain, warned):
    test = checked(flat(1.0, 2.0), settings=[0.0, 1.0], length=1.0 / strain)
    assert bool(data_checks.strain_scale(test)) == warned


@pytest.mark.parametrize(("second", "warned"), [(5.0, False), (6.0, True)])
def test_strains_of_one_weight_say_nothing_of_units(second, warned):
    test = checked(flat(0.5, 0.501), settings=[5.0, second], control="force")
    assert bool(data_checks.strain_scale(test)) == warned


@pytest.mark.parametrize(
    ("off", "rest", "warned"),
    [
        (0.99, 1.0, False),  # ten noise levels, where all others are alike
        (1.01, 1.0, True),
        (1.98, 11.0, False),  # a fifth of the range of all others
        (2.02, 11.0, True),
    ],
)
def test_a_reading_is_an_outlier_beyond_ten_noise_levels_and_a_fifth_of_the_range(off, rest, warned):
    rows = flat(1.0, *np.linspace(1.0, rest, 8), readings=5)
    rows[3][2] += off
    assert bool(outlier(checked(rows))) == warned


def rising_holds(rises):
    """Holds on loading that rise by so much."""
    return [np.linspace(level, level + rise, 4) for level, rise in zip(5.0 * np.arange(1, 99), rises, strict=False)]


@pytest.mark.parametrize(
    ("rises", "warned"),
    [
        ([0.3] * 4, False),
        ([0.3] * 5, True),
        ([0.198] * 5, False),  # two noise levels in the middle
        ([0.202] * 5, True),
        ([0.3] * 8 + [-0.3] * 2, True),  # four in five
        ([0.3] * 7 + [-0.3] * 2, False),
    ],
)
def test_tension_rises_in_four_of_five_holds_and_by_two_noise_levels(rises, warned):
    assert bool(data_checks.rising(checked(rising_holds(rises)))) == warned


@pytest.mark.parametrize(
    ("row", "noise", "jumps"),
    [
        ([5.0, 5.0, 5.99, 5.99, 5.99], 0.1, False),  # ten noise levels
        ([5.0, 5.0, 6.01, 6.01, 6.01], 0.1, True),
        ([5.0, 4.9, 5.098, 5.098, 5.098], 0.0, False),  # twice the changes beside it
        ([5.0, 4.9, 5.102, 5.102, 5.102], 0.0, True),
        ([5.0, 4.9, 5.9, 5.6, 5.3, 5.098], 0.0, False),  # a fifth of it is left
        ([5.0, 4.9, 5.9, 5.6, 5.3, 5.102], 0.0, True),
        ([4.0, 4.4, 5.5, 5.397], 0.1, True),  # against the hold's course, to three noise levels
        ([4.0, 4.4, 5.5, 5.403], 0.1, False),
        ([5.0, 4.9, 4.405, 4.3], 0.0, False),  # five times as fast as that goes
        ([5.0, 4.9, 4.395, 4.3], 0.0, True),
    ],
)
def test_a_jump_stands_out_from_noise_and_from_its_hold_and_stays(row, noise, jumps):
    assert (data_checks._jump(np.array(row), np.arange(len(row)), noise) is not None) == jumps


@pytest.mark.parametrize(("pause_s", "jumps"), [(1.0, True), (40.0, False)])
def test_much_creep_in_a_long_pause_is_no_jump(pause_s, jumps):
    times = np.cumsum([0.0, 1.0, 1.0, pause_s, 1.0, 1.0])
    assert (data_checks._jump(np.array([5.0, 4.9, 4.8, 4.0, 3.99, 3.98]), times, 0.01) is not None) == jumps


@pytest.mark.parametrize(("readings", "warned"), [([5.0, 4.9, 4.9, 4.9], False), ([5.0, 4.9, 4.8, 4.8], True)])
def test_a_copy_has_three_different_readings(readings, warned):
    assert bool(data_checks.repeated(checked([readings, readings]))) == warned


@pytest.mark.parametrize(
    ("changes", "warned"),
    [
        ([0.4] * 3 + [1.0] * 3, False),  # of them half
        ([0.4] * 6 + [1.0] * 5, True),
        ([0.49] * 6 + [3.0], True),  # half the resolution
        ([0.51] * 6 + [3.0], False),
        ([0.011] * 6 + [3.0], True),  # rounding of a number's own digits is no reading
        ([0.009] * 6 + [3.0], False),
    ],
)
def test_readings_are_off_their_grid_where_most_change_by_less_than_half_of_it(changes, warned):
    row = 5.0 + np.cumsum([0.0, *changes])
    assert bool(data_checks.off_grid(checked([row], noise=1.0 / np.sqrt(12.0)))) == warned


def kinds(rows, times=None, settings=None, control="displacement", resolution=0.0):
    """The gross events of a test."""
    settings = np.arange(1.0, len(rows) + 1) if settings is None else settings
    p = protocol(settings, [times or TIMES] * len(rows), control=control)
    return [event.kind for event in gross_events.of_readings(p, np.array(rows, float), resolution)]


@pytest.mark.parametrize(("left", "found"), [(0.297, ["break"]), (0.303, [])])
def test_nothing_is_three_hundredths_of_the_reading_before(left, found):
    assert kinds([[10.0] * 4, [10.0] * 4, [10.0, 10.0, left, left]]) == found


@pytest.mark.parametrize(("largest", "found"), [(99.0, ["break"]), (101.0, [])])
def test_a_fall_is_from_a_tenth_of_the_largest_reading(largest, found):
    assert kinds([[10.0] * 4, [largest] * 4, [10.0, 10.0, 0.0, 0.0]]) == found


@pytest.mark.parametrize(("kept", "found"), [(7.05, ["break"]), (6.95, [])])
def test_a_hold_that_breaks_had_kept_seven_tenths(kept, found):
    assert kinds([[10.0] * 4, [10.0] * 4, [10.0, kept, 0.0, 0.0]]) == found


@pytest.mark.parametrize(("third_s", "found"), [(59.0, ["break"]), (61.0, [])])
def test_a_fall_is_sudden_within_three_times_the_time_of_the_reading_before(third_s, found):
    """With two holds before it the wire's course does not show it otherwise."""
    assert kinds([[10.0] * 4, [10.0] * 4, [10.0, 10.0, 0.0, 0.0]], times=[0.0, 20.0, third_s, 99.0]) == found


@pytest.mark.parametrize(
    ("kept", "earlier", "found"), [(0.855, 3, ["break"]), (0.845, 3, []), (0.855, 2, []), (0.855, 4, ["break"])]
)
def test_a_break_between_holds_is_seen_where_three_holds_had_kept_their_tension(kept, earlier, found):
    rows = [[10.0, 10.0, 10.0, 10.0 * kept]] * earlier
    assert kinds([*rows, [0.0] * 4]) == found


@pytest.mark.parametrize(("back", "found"), [(5.05, ["dropout"]), (4.95, ["tared"])])
def test_a_dropout_comes_back_to_half(back, found):
    assert kinds([[10.0] * 4, [10.0, 10.0, 0.0, back], [back + 1.0] * 4]) == found


@pytest.mark.parametrize(("jump", "found"), [(2.97, []), (3.03, ["break"])])
def test_a_break_under_weights_is_longer_than_all_elongation_before(jump, found):
    """Three holds of 1 N more each, which add 1.5 mm each: 3 mm had been seen."""
    rows = [[0.0] * 4, [1.5] * 4, [3.0] * 4]
    assert kinds([*rows, [4.5 + jump] * 4], control="force") == found


@pytest.mark.parametrize(("at_limit", "found"), [(2, []), (3, ["saturation"])])
def test_three_readings_stand_at_a_limit(at_limit, found):
    rows = [
        [1.0] * 4,
        [2.0] * 4,
        [3.0] * 4,
        [4.0, 3.99, 3.98, 3.97],
        [4.0, *[4.0] * (at_limit - 2), *[3.9] * (5 - at_limit)],
    ]
    assert kinds(rows) == found


@pytest.mark.parametrize(("resolution", "found"), [(0.198, ["saturation"]), (0.202, [])])
def test_at_a_limit_readings_should_have_moved_by_five_steps(resolution, found):
    """By the holds before they should differ by 1 N."""
    rows = [[1.0] * 4, [2.0] * 4, [3.0] * 4, [4.0] * 4, [4.0] * 4]
    assert kinds(rows, resolution=resolution) == found
