"""From weighed sets to a decision: the guard of further effects and the second test, each at its threshold."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from wirebayes.discovery import verdict
from wirebayes.discovery.model_space import EffectSet, log_prior
from wirebayes.discovery.settings import Settings
from wirebayes.discovery.stepwise import Accepted, Explored
from wirebayes.discovery.verdict import Retest, decide, verdict_of

ONE = np.ones(1)
UNLIKELIER = -log_prior(2, 20)  # nats by which a set of two has less prior weight than one of one, of twenty names
NONE = np.full(1, -20.0)  # a remainder that the readings speak against


def explored(sets: dict[str, float], smooth: float = -20.0) -> Explored:
    """Sets of one-letter effects with their log Bayes factors, all fitted, and a remainder beside none of them."""
    known = [EffectSet(tuple(names), value, dict.fromkeys(names, ONE), NONE) for names, value in sets.items()]
    fitted: dict[Any, Any] = {}
    for s in known:
        accepted = tuple(Accepted(n, (0,), {0: n}) for n in s.names)  # type: ignore[dict-item]
        fitted[s.key] = SimpleNamespace(effects=s, accepted=accepted, blocks=[SimpleNamespace(effects=s.names)])
    return Explored((EffectSet((), 0.0, {}, np.array([smooth])), *known), fitted, {})


def decided(
    monkeypatch: pytest.MonkeyPatch, sets: Explored, gains: dict[str, float], p: dict[str, float]
) -> verdict.Decision:
    """The decision where leaving out a hold, and the second test, give these values for each set."""

    def gain(plain: Any, best: Any, *others: Any) -> np.ndarray:
        return np.array([gains.get("".join(best.effects.names), 50.0)])

    def retested(best: Any, *others: Any) -> Retest:
        return Retest(p.get("".join(best.effects.names), 0.5), [[]])

    monkeypatch.setattr(verdict, "_gain", gain)
    monkeypatch.setattr(verdict, "_retested", retested)
    settings = Settings(kinds=dict.fromkeys("abcdefghijklmnopqrst"))  # type: ignore[arg-type]
    return decide([SimpleNamespace()], sets, {}, settings, np.random.default_rng(0), map)  # type: ignore[list-item]


def names(found: verdict.Decision) -> str:
    return "" if found.best is None else "".join(found.best.effects.names)


@pytest.mark.parametrize(("gain", "kept"), [(4.1, "ab"), (3.9, "a")])
def test_a_second_effect_must_predict(monkeypatch: pytest.MonkeyPatch, gain: float, kept: str) -> None:
    found = decided(monkeypatch, explored({"a": 10.0, "ab": 30.0, "abc": 20.0}), {"ab": gain}, {})
    assert names(found) == kept
    # what does not predict has no weight, nor has any set that contains it
    assert ("b" in found.posterior.inclusion) == (kept == "ab")


@pytest.mark.parametrize(("p", "remains"), [(0.031, False), (0.029, True)])
def test_what_fails_the_second_test_leaves_something_over(
    monkeypatch: pytest.MonkeyPatch, p: float, remains: bool
) -> None:
    """At .03 a remainder is as likely as none; above it nothing is changed."""
    found = decided(monkeypatch, explored({"a": 20.0}), {}, {"a": p})
    assert (found.posterior.remainder[0] > 0.5) == remains
    assert verdict_of(found, 0)[0] == ("partial" if remains else "named")
    odds = found.posterior.remainder[0] / (1.0 - found.posterior.remainder[0])
    assert odds == pytest.approx((0.03 / p) ** 0.8 if remains else 0.0, abs=1e-3)


@pytest.mark.parametrize(("behind", "p", "best"), [(1.9, 0.5, "b"), (2.1, 0.5, "a"), (1.9, 0.02, "a")])
def test_a_set_that_leaves_something_over_gives_way_to_one_that_does_not(
    monkeypatch: pytest.MonkeyPatch, behind: float, p: float, best: str
) -> None:
    """If it is no more than two nats behind, and passes the test itself."""
    found = decided(monkeypatch, explored({"a": 20.0, "b": 20.0 - behind}), {}, {"a": 0.01, "b": p})
    assert names(found) == best
    assert verdict_of(found, 0)[0] == ("named" if best == "b" else "partial")


@pytest.mark.parametrize(("gain", "best"), [(4.1, "bc"), (3.9, "a")])
def test_a_set_that_takes_over_must_predict_too(monkeypatch: pytest.MonkeyPatch, gain: float, best: str) -> None:
    found = decided(monkeypatch, explored({"a": 20.0, "bc": 19.0 + UNLIKELIER}), {"bc": gain}, {"a": 0.01, "bc": 0.5})
    assert names(found) == best


def test_the_set_that_passed_the_second_test_is_the_one_that_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    """Even where another one, which was not tested, is more probable then."""
    sets = explored({"a": 20.0, "b": 19.0, "c": 19.5})
    del sets.fitted[frozenset("c")]  # known by a chain of refits alone
    found = decided(monkeypatch, sets, {}, {"a": 0.01, "b": 0.4})
    assert found.posterior.best.names == ("c",)
    assert names(found) == "b" and found.retest is not None and found.retest.p == 0.4
    assert list(found.gains) == ["b"]


def test_a_set_known_by_refits_alone_keeps_its_weight(monkeypatch: pytest.MonkeyPatch) -> None:
    sets = explored({"a": 20.0, "b": 21.0})
    del sets.fitted[frozenset("b")]
    found = decided(monkeypatch, sets, {}, {})
    assert names(found) == "a" and found.posterior.inclusion["b"][0] > 0.7
    assert verdict_of(found, 0)[0] == "ambiguous"


def test_a_remainder_alone_needs_no_test(monkeypatch: pytest.MonkeyPatch) -> None:
    found = decided(monkeypatch, explored({"a": 3.0}, smooth=12.0), {}, {})
    assert found.best is None and verdict_of(found, 0) == ("unknown", [])
