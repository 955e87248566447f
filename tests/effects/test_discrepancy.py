"""The smooth discrepancy that stands for something unknown: what it is in the training holds, and beyond them."""

from dataclasses import replace

import numpy as np
import pytest

from tests.simulated import simulated_tests
from wirebayes.discovery import held_out, shrinking
from wirebayes.effects import effect_named
from wirebayes.effects.unknown import Discrepancy
from wirebayes.errors import InputError
from wirebayes.inference.laplace_fit import fitted
from wirebayes.io.experiment import Experiment
from wirebayes.model.spec import PLAIN_SPEC
from wirebayes.numeric.typing import Array
from wirebayes.simulation.synthetic import Bench, Truth
from wirebayes.wire.effect import HoldContext
from wirebayes.wire.protocol import Protocol

HOLDS = 31
SIZE = 0.2
OF_TEST = Discrepancy(HOLDS, SIZE, 100.0, 1.0, 15.0)
WIRE = {"k1": 900.0, "B": 0.25, "U": 0.6, "k2": 0.05, "N": 0.7, "preload": 0.4, "sensor_sd": 0.01, "setting_sd": 0.01}


def contexts(setting: Array) -> list[HoldContext]:
    """Holds read at once and after 100 s."""
    count = len(setting)
    times = np.tile([0.0, 100.0], (count, 1))
    durations = np.full(count, 100.0)
    protocol = Protocol(1000.0, setting, times, np.ones_like(times, bool), durations, np.arange(1, count + 1))
    others = {"length_ref_mm": 1000.0, "tension_ref_N": 1.0, "theta": {}}
    return [HoldContext(**hold, **others) for hold in protocol.holds]


def alone(kind: str, setting: Array) -> Array:
    """(H, 2, k) of each amplitude of a kind, one and the others zero."""
    names = [a.name for a in OF_TEST.amplitudes]
    which = [name for name in names if name.startswith(kind)]
    own = {name: np.array([float(name == other) for other in which]) for name in names}
    return np.array([OF_TEST.apply(np.zeros((2, len(which))), own, hold) for hold in contexts(setting)])


def straightened(values: Array) -> Array:
    """What is left of (H, n) values over the holds once each one's straight line is taken out."""
    place = np.arange(len(values))
    return values - np.array([np.polyval(np.polyfit(place, each, 1), place) for each in values.T]).T


LOADING = 1.0 + 0.5 * np.arange(HOLDS)


def test_a_curve_is_as_large_as_it_is_said_to_be_and_straight_at_no_cost() -> None:
    """Half of the variance each: what a straight line leaves of a curve is what a fit leaves over."""
    for curve in ("order", "setting"):
        heights = alone(curve, LOADING)[:, 0]
        np.testing.assert_allclose(heights[[0, -1]], 0.0, atol=1e-12)
        sd = next(a.prior.std() for a in OF_TEST.amplitudes if a.name.startswith(curve))
        left = straightened(sd * heights)
        assert np.sqrt((left**2).sum(axis=1).mean()) == pytest.approx(SIZE / np.sqrt(2.0), rel=0.05)


def test_walks_end_as_large_as_they_are_said_to_be() -> None:
    level, course = alone("level", LOADING), alone("course", LOADING)
    sd = next(a.prior.std() for a in OF_TEST.amplitudes if a.name == "level0")
    assert np.sqrt(((sd * level[-1, 0]) ** 2).sum()) == pytest.approx(SIZE / np.sqrt(2.0))
    # the course turns about the middle of the hold's logarithmic time: from -1/2 to 1/2
    np.testing.assert_allclose(course[:, 1], 0.5 * level[:, 1], rtol=1e-12)
    np.testing.assert_allclose(course[:, 0], -0.5 * level[:, 0], rtol=1e-12)


def test_half_a_test_further_a_parabola_that_leaves_as_much_is_inside_the_bands() -> None:
    """Readings at once, by the normal distribution given those of the training holds; any straight line is free."""
    place = np.arange(HOLDS + HOLDS // 2) / (HOLDS - 1)
    heights = np.hstack([alone(kind, 1.0 + 15.0 * place)[:, 0] for kind in ("level", "order", "setting")])
    sds = np.array([a.prior.std() for a in OF_TEST.amplitudes if not a.name.startswith("course")])
    line = 1e3 * np.column_stack([np.ones_like(place), place])
    parts = np.hstack([heights * sds, line])
    covariance = parts @ parts.T + (0.05 * SIZE) ** 2 * np.eye(len(place))
    curve = place**2
    left = straightened(curve[:HOLDS, None])
    curve *= SIZE / np.sqrt((left**2).mean())
    gain = np.linalg.solve(covariance[:HOLDS, :HOLDS], covariance[:HOLDS, HOLDS:])
    missed = curve[HOLDS:] - gain.T @ curve[:HOLDS]
    sd = np.sqrt(np.diag(covariance[HOLDS:, HOLDS:] - covariance[HOLDS:, :HOLDS] @ gain))
    assert (np.abs(missed) < 1.645 * sd).all()
    by_line = np.polyval(np.polyfit(place[:HOLDS], curve[:HOLDS], 1), place[HOLDS:])
    assert abs(missed[-1]) < 0.5 * abs(curve[-1] - by_line[-1])
    assert (np.diff(sd) > 0.0).all()


def test_one_curve_follows_what_is_set_and_the_other_the_order_of_holds() -> None:
    """Back at a displacement, the one has its height of before; the other goes on."""
    there_and_back = np.concatenate([LOADING, LOADING[-2::-1]])
    by_setting, by_order = alone("setting", there_and_back)[:, 0], alone("order", there_and_back)[:, 0]
    np.testing.assert_allclose(by_setting[HOLDS:], by_setting[HOLDS - 2 :: -1])
    further = LOADING[-1] + 0.5 * np.arange(1, HOLDS)
    went_on = alone("order", np.concatenate([LOADING, further]))[:, 0]
    np.testing.assert_allclose(by_order, went_on)


def test_holds_at_one_displacement_have_no_curve_over_it() -> None:
    relaxing = replace(OF_TEST, least=3.0, range_=0.0)
    own = {a.name: np.array([float(a.name.startswith("setting"))]) for a in relaxing.amplitudes}
    values = [relaxing.apply(np.zeros((2, 1)), own, hold) for hold in contexts(np.full(HOLDS, 3.0))]
    assert not np.any(values)


def stretched(effect: str, amplitudes: dict[str, float], seed: int) -> Experiment:
    bench = Bench(displacements_mm=tuple(range(1, 13)))
    truth = Truth(WIRE | amplitudes, effects=(effect_named(effect),))
    return simulated_tests([bench], truth, seed)[0]


@pytest.mark.parametrize(
    ("effect", "amplitudes"),
    [("power_strain", {"power_strain.p": 0.25}), ("strain_stiffening", {"strain_stiffening.c": 25.0})],
)
def test_a_bend_is_continued_and_the_bands_hold_what_the_plain_model_misses(
    effect: str, amplitudes: dict[str, float]
) -> None:
    inside, errors = [], []
    for seed in (1, 2, 3):
        test = stretched(effect, amplitudes, seed)
        rng = np.random.default_rng(seed)
        block = fitted([test.train(8)], (), PLAIN_SPEC, rng)
        left = shrinking.residual_rms(block, test.name)
        unknown = shrinking.discrepancy(test.train(8), left)
        [plain] = held_out.predicted([test], [8], (), block, rng)
        [smooth] = held_out.predicted([test], [8], (unknown,), block, rng)
        inside.append((plain.inside, smooth.inside))
        errors.append((plain.rmse_N, smooth.rmse_N))
    by_plain, by_smooth = np.mean(inside, axis=0)
    print(inside, errors)
    assert by_plain < 0.5 and by_smooth >= 0.9
    assert all(smooth < 0.7 * plain for plain, smooth in errors)


def test_a_key_says_all_of_it() -> None:
    assert effect_named(OF_TEST.key) == OF_TEST
    with pytest.raises(InputError, match="expected discrepancy@HOLDS:SIZE:HOLD_S:LEAST:RANGE"):
        effect_named("discrepancy@13:0.1:60.0")
