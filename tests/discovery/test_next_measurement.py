"""Plans of another measurement: what they are, which is proposed, and in which words."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from wirebayes.discovery import next_measurement as module
from wirebayes.discovery.next_measurement import other_measurements
from wirebayes.io.paper import experiments
from wirebayes.model.build import build
from wirebayes.model.scales import NATURAL
from wirebayes.wire.protocol import Protocol


def probe(name: str) -> Any:
    return SimpleNamespace(effect=SimpleNamespace(name=name))


TIMES = np.array([0.0, 10.0, 40.0])
PROTOCOL = Protocol(
    1500.0,
    np.array([1.0, 2.0, 4.0]),
    np.array([[0.0, 5.0, 0.0], TIMES, [0.0, 0.0, 0.0]]),
    np.array([[True, True, False], [True, True, True], [False, False, False]]),
    np.array([5.0, 40.0, 30.0]),
    np.arange(1, 4),
)
WHOLE = Protocol(
    1500.0, np.array([1.0, 2.0, 4.0]), np.tile(TIMES, (3, 1)), np.ones((3, 3), bool), np.full(3, 40.0), np.arange(1, 4)
)


def test_plans_are_what_their_words_say() -> None:
    unload, longer, both, finer = other_measurements(WHOLE, True)
    assert unload.setting.tolist() == both.setting.tolist() == [1.0, 2.0, 4.0, 2.0, 1.0]
    assert longer.setting.tolist() == [1.0, 2.0, 4.0]
    assert finer.setting.tolist() == [1.0, 1.5, 2.0, 3.0, 4.0]
    assert unload.times_s.tolist() == finer.times_s.tolist() == TIMES.tolist()
    for plan in (longer, both):
        assert "200 s with 25 readings" in plan.words and len(plan.times_s) == 25
        assert plan.times_s[0] == 0.0 and plan.times_s[-1] == pytest.approx(200.0)
        assert np.ptp(np.diff(np.log(plan.times_s[1:]))) < 1e-9
    assert "from 4 to 1 mm, each held 40 s" in unload.words and "1 to 4 mm" in longer.words
    assert "of every sample" in other_measurements(WHOLE, False)[0].words
    made = finer.protocol
    assert made.length_mm == 1500.0 and made.mask.all() and made.time_s.tolist() == [TIMES.tolist()] * 5
    assert made.number.tolist() == [1, 2, 3, 4, 5] and made.duration_s.tolist() == [40.0] * 5


def test_plans_under_weights_speak_of_weights_and_hang_them() -> None:
    hung = replace(WHOLE, control="force")
    unload, longer, *_ = other_measurements(hung, True)
    assert "the same weights back from 4 to 1 N" in unload.words and "weights 1 to 4 N" in longer.words
    assert unload.protocol.control == "force" and unload.setting.tolist() == [1.0, 2.0, 4.0, 2.0, 1.0]


def test_plans_hold_the_displacements_that_were_read_for_the_longest_series() -> None:
    unload = other_measurements(PROTOCOL, True)[0]
    assert unload.setting.tolist() == [1.0, 2.0, 1.0]
    assert unload.times_s.tolist() == TIMES.tolist()
    one = PROTOCOL.__class__(1500.0, np.array([2.0]), TIMES[None], np.ones((1, 3), bool), np.array([40.0]), np.ones(1))
    assert other_measurements(one, True)[0].setting.tolist() == [2.0, 2.0]
    assert other_measurements(one, True)[3].setting.tolist() == [0.5, 1.0, 1.5, 2.0]
    assert other_measurements(one, True)[3].words == "go to 2 mm in four steps, each held 40 s"


def test_plans_of_a_test_that_unloads_go_its_way_and_say_so() -> None:
    unloads = replace(WHOLE, setting=np.array([1.0, 4.0, 2.0]))
    again, _, both, finer = other_measurements(unloads, True)
    assert again.setting.tolist() == both.setting.tolist() == [1.0, 4.0, 2.0, 4.0, 1.0]
    assert (
        again.words == "after the last hold, go through the same displacements again in reverse order, each held 40 s"
    )
    assert both.words.startswith("go through the same displacements and then through them in reverse order, each hold")
    assert finer.setting.tolist() == [1.0, 2.5, 4.0, 3.0, 2.0]


def test_another_length_is_twice_the_longest_with_steps_scaled_alike() -> None:
    words, more = module._another_length(build([experiments()[1]]))
    first, second = more.samples
    assert "a second length, 3420 mm" in words or f"{2 * first.protocol.length_mm:g} mm" in words
    assert second.protocol.length_mm == 2.0 * first.protocol.length_mm
    recorded = first.protocol.setting[first.protocol.recorded]
    assert second.protocol.setting == pytest.approx(2.0 * recorded)
    assert more.prior.fixed == {"creep_length_exponent": 1.0}  # creep is a strain until readings say otherwise
    theta = more.prior.rvs(1, np.random.default_rng(0))
    own = [more.parameters(theta, s)["B"][0] for s in more.samples]
    assert own[1] == pytest.approx(2.0 * own[0])


@pytest.mark.parametrize(
    ("ratio", "pair", "message"),
    [
        (1.05, True, "None of the tests considered"),
        (1.15, True, "would then differ 1.1 times as much as now"),
        (900.0, True, "would then differ 900.0 times as much as now"),
        (1100.0, True, "at present they do not"),
        (np.inf, True, "at present they do not"),
        (1.05, False, "reveal a smaller"),
        (2.04, False, "Its trace in the readings would be 2.0 times as large as now"),
        (1100.0, False, "To detect toe, which this test does not show: load it twice."),
        (np.inf, False, "To detect toe, which this test does not show: load it twice."),
    ],
)
def test_a_measurement_is_proposed_where_it_tells_more(
    ratio: float, pair: bool, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_best_plan", lambda block, value: ("load it twice", ratio))
    one, other = probe("toe"), probe("superposition")
    found = module.next_measurement(None, (one, other) if pair else None, None if pair else one)  # type: ignore[arg-type]
    assert message in found
    assert ("load it twice" in found) == (ratio >= 1.1)
    assert ("toe from superposition" in found) == pair
    remainder = module.next_for_remainder(None)  # type: ignore[arg-type]
    assert ("load it twice" in remainder) == (ratio >= 1.1)
    assert ("times as much" in remainder) == (1.1 <= ratio < 1000.0)


def test_without_a_candidate_nothing_is_to_be_distinguished() -> None:
    assert module.next_measurement(None, None, None).startswith("No candidate remains")  # type: ignore[arg-type]


def test_the_plan_with_the_largest_value_wins_and_is_compared_with_the_present_test(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A plan's value is here the number of holds: unloading makes five of three, twice as many steps too."""
    problem = SimpleNamespace(units=NATURAL, samples=[SimpleNamespace(protocol=WHOLE)])
    monkeypatch.setattr(module, "_another_length", lambda problem: ("length", WHOLE))
    monkeypatch.setattr(module, "with_protocols", lambda problem, protocols, empty: protocols[0])
    monkeypatch.setattr(module, "replace_problem", lambda target, other: other)
    fit: Any = SimpleNamespace(target=SimpleNamespace(problem=problem, setting=WHOLE.setting))
    words, ratio = module._best_plan(fit, lambda x: float(x.setting.sum()))  # type: ignore[attr-defined]
    assert words == "take twice as many, half as large steps over 1 to 4 mm" and ratio == pytest.approx(11.5 / 7.0)
    problem.samples.append(problem.samples[0])
    assert module._best_plan(fit, lambda x: float(x.setting.sum()))[0].endswith("each sample's displacements")  # type: ignore[attr-defined]
    assert module._best_plan(fit, lambda x: 0.0 if x is fit.target else 1.0)[1] == np.inf


def test_what_a_second_effect_takes_up_does_not_distinguish_the_first(monkeypatch: pytest.MonkeyPatch) -> None:
    """A signature 3 long beside the other, 4 along it: what distinguishes is 3, whatever the other's size."""
    monkeypatch.setattr(module, "expand", lambda target, z, trials: SimpleNamespace(ratio=[2.0], trials=trials))
    sizes = np.array([[4.0, 10.0], [3.0, 0.0]])
    monkeypatch.setattr(module, "projected", lambda x, ratio: sizes[:, : len(x.trials)] if ratio == 2.0 else None)
    fit: Any = SimpleNamespace(z=np.zeros((1, 1)))
    assert module._separation(None, fit, ["a", "b"]) == pytest.approx(3.0)  # type: ignore[arg-type, list-item]
    assert module._separation(None, fit, ["a"]) == pytest.approx(5.0)  # type: ignore[arg-type, list-item]
    sizes[:, 1] = [1e-3, 0.0]
    assert module._separation(None, fit, ["a", "b"]) == pytest.approx(3.0)  # type: ignore[arg-type, list-item]
    sizes[:, 1] = 0.0
    assert module._separation(None, fit, ["a", "b"]) == pytest.approx(5.0)  # type: ignore[arg-type, list-item]
