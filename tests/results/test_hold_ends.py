"""What it costs to take a hold's last reading for its end: against tests whose holds did go on, and recorded it."""

from dataclasses import replace

import numpy as np
import pytest

import wirebayes as wb
from wirebayes.effects import effect_named
from wirebayes.model.build import build
from wirebayes.model.scales import Units
from wirebayes.result_warnings import Notice
from wirebayes.results import hold_ends
from wirebayes.simulation.synthetic import Bench, Truth, draw
from wirebayes.wire.effect import Effect

WIRE = {"k1": 900.0, "B": 0.15, "U": 0.9, "k2": 0.05, "N": 0.8, "preload": 0.5, "sensor_sd": 0.002, "setting_sd": 0.002}
READ_S = (0.0, 10.0, 30.0, 60.0, 90.0)
WENT_ON = (*READ_S, READ_S[-1] / hold_ends.COVERED)  # the last moment is the hold's end, and not read


def lasting(effects: list[Effect], truth: dict[str, float], *, recorded: bool):
    """Readings without the last moment of each hold, which is known or not."""
    places = (*range(1, 8), *range(6, 2, -1))
    bench = Bench(resolution_N=0.0, displacements_mm=places, times_s=WENT_ON)
    made = draw([bench], Truth(WIRE | truth, effects), 3)
    (sample,) = made.problem.samples
    holds = []
    for hold, y in zip(bench.experiment().holds, sample.readings[..., 0], strict=True):
        end = WENT_ON[-1] if recorded else READ_S[-1]
        holds.append(replace(hold, time_s=np.array(READ_S), readings=y[:-1], duration_s=end))
    return build([replace(bench.experiment(), holds=tuple(holds))], effects)


def near(problem, truth):
    return np.array([(WIRE | truth)[name] for name in problem.names])


@pytest.mark.parametrize(("key", "truth"), [(None, {}), ("lost_motion", {"lost_motion.w": 0.1})])
def test_the_shift_is_the_distance_to_the_fit_that_knows_the_ends(key, truth):
    effects = [effect_named(key)] if key else []
    unknown, known = (lasting(effects, truth, recorded=r) for r in (False, True))
    best = near(unknown, truth)
    draws = around(best)
    told = hold_ends.cost(unknown, best, draws)
    assert told is not None and hold_ends.cost(known, best, draws) is None
    before, after = hold_ends._modes(unknown, known, best)
    early = hold_ends._early(unknown)
    before, after = unknown.in_units(unknown.own_units).theta_in(early, np.array([before, after]))
    spread = unknown.theta_in(early, draws).std(axis=0, ddof=1)
    assert list(told["moved"]) == ["k1", "k2", *truth]
    for name, move in told["moved"].items():
        i = unknown.names.index(name)
        shift = after[i] - before[i]
        unit = {"k1": early.tension_N, "k2": 1.0}.get(name, early.length_mm)
        assert move["shift"] == pytest.approx(shift * unit, rel=0.02)  # priors follow the holds
        assert move["sd_share"] == pytest.approx(abs(shift) / spread[i], rel=0.02)
        assert move["relative"] == (None if name in truth else pytest.approx(abs(shift) / before[i], rel=0.02))
    assert told["moved"]["k2"]["quantity"] == "k2 t^N after 0.9 s"


def around(best):
    """Draws of which k2 and N are known together better than each alone, as in a posterior."""
    steps = np.random.default_rng(0).normal(size=(500, len(best)))
    return best * np.exp(0.01 * (steps + 2.0 * steps[:, :1]))


@pytest.mark.parametrize("time_s", [1 / 32, 32.0, 86400.0])
def test_what_is_called_a_second_does_not_decide_how_far_k2_moves(time_s):
    problem = lasting([], {}, recorded=False)
    best = near(problem, {})
    draws = around(best)
    told = hold_ends.cost(problem, best, draws)
    other = problem.in_units(Units(1.0, 1.0, time_s))
    (there,) = problem.theta_in(other.units, best[None])
    otherwise = hold_ends.cost(other, there, problem.theta_in(other.units, draws))
    one, two = (found["moved"]["k2"] for found in (told, otherwise))
    assert two["sd_share"] == pytest.approx(one["sd_share"], rel=1e-3)  # climbs end within a tolerance
    assert two["shift"] == pytest.approx(one["shift"], rel=1e-3)
    assert two["quantity"] == one["quantity"]


def test_the_last_hold_of_a_test_may_end_with_its_last_reading():
    problem = lasting([], {}, recorded=False)
    (sample,) = problem.samples
    lasted = sample.protocol.duration_s.copy()
    lasted[-1] *= 1.1
    p = replace(sample.protocol, duration_s=lasted)
    assert not hold_ends.are_recorded(p)
    first = p.number[:1]
    one = replace(p, setting=p.setting[:1], time_s=p.time_s[:1], mask=p.mask[:1], duration_s=lasted[:1], number=first)
    assert hold_ends.are_recorded(one)


@pytest.mark.parametrize(
    ("share", "words"), [(0.49, "k2 would move by less than 0.5"), (0.51, "k2 would be lower by 0.00300 s⁻ᴺ (0.5")]
)
def test_a_small_shift_is_said_to_be_small(share, words):
    assert words in hold_ends.hold_ends_sentence(
        {"k2": {"quantity": "k2", "shift": -0.003, "sd_share": share, "relative": 0.1, "unit": "s^-N"}}
    )


@pytest.mark.parametrize(
    ("share", "relative", "warned"),
    [(0.99, 0.1, False), (1.01, 0.1, True), (9.0, 0.019, False), (9.0, 0.021, True), (1.01, None, True)],
)
def test_a_shift_of_a_standard_deviation_that_is_large_enough_to_count_is_warned_of(share, relative, warned):
    told = {
        "covered": 0.9,
        "moved": {"k1": {"quantity": "k1", "shift": 0.1, "sd_share": share, "relative": relative, "unit": "N"}},
        "sentence": "as it is",
    }
    assert hold_ends.hold_ends_notice(told) == [Notice("hold-ends", "as it is")] * warned
    assert hold_ends.hold_ends_notice(None) == []


def with_rests(*, until_s):
    """A slowly creeping wire, read for 90 s in each hold, which is said to go on until then."""
    places = (*range(1, 8), *range(6, 2, -1))
    bench = Bench(resolution_N=0.0, displacements_mm=places, times_s=(*READ_S, until_s))
    made = draw([bench], Truth(WIRE | {"k2": 0.004}), 3)
    (sample,) = made.problem.samples
    holds = [
        replace(hold, time_s=np.array(READ_S), readings=y[:-1], duration_s=until_s)
        for hold, y in zip(bench.experiment().holds, sample.readings[..., 0], strict=True)
    ]
    return replace(bench.experiment(), holds=tuple(holds))


def test_a_long_rest_is_a_part_of_its_hold_only_where_it_stayed_as_set():
    checked = wb.check(with_rests(until_s=1290.0)).summary()
    (warning,) = checked["warnings"]
    assert warning["kind"] == "hold-ends"
    assert "8, 9 and 10 (up to 20 min) went on long after the last reading" in warning["text"]
    assert "had nothing followed that reading, k1 would be" in warning["text"]
    assert "k2 t^N after 12.9 s would be higher by" in warning["text"]
    assert wb.check(with_rests(until_s=130.0)).summary()["warnings"] == []


def test_a_fit_warns_of_it_as_a_check_does(tmp_path):
    few = wb.Policy(walkers=32, ess=100, rounds=2, round_draws=1024, block=20, most_steps=60, r_hat=1.5)
    posterior = wb.fit(with_rests(until_s=1290.0), policy=few, check=False, output=tmp_path / "fit")
    assert "hold-ends" in [notice["kind"] for notice in posterior.summary()["warnings"]]
    assert "went on long after the last reading" in "".join(posterior.messages)
    page = wb.write_report(tmp_path / "fit").read_text(encoding="utf-8")
    assert page.count("(up to 20 min) went on") == 1
