"""More parts of the global test: a p-value on its level against binomial sums, gross errors among few readings."""

from math import comb
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from wirebayes.discovery import global_test, gross_errors
from wirebayes.discovery.global_test import is_close
from wirebayes.discovery.screening import Candidate
from wirebayes.io.paper import experiments


def risk(larger: int, alpha: float, simulations: int) -> float:
    """The smaller chance of so few, or so many, exceedances where a p is exactly on the level."""
    chance = [comb(simulations, k) * alpha**k * (1.0 - alpha) ** (simulations - k) for k in range(simulations + 1)]
    return min(sum(chance[: larger + 1]), sum(chance[larger:]))


@pytest.mark.parametrize(("alpha", "simulations"), [(0.04, 199), (0.2, 99), (0.5, 49)])
def test_a_p_is_close_where_the_level_may_give_it_by_chance(alpha: float, simulations: int) -> None:
    """With a risk of more than 0.135 % on either side, three standard errors; far away on both sides it is not."""
    found = [is_close((1 + larger) / (1 + simulations), alpha, simulations) for larger in range(simulations + 1)]
    assert found == [risk(larger, alpha, simulations) > 0.00135 for larger in range(simulations + 1)]
    assert found[round(alpha * simulations)] and not found[-1]
    assert any(found) and not all(found)


def test_simulations_are_scanned_for_patterns_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        global_test.residual_patterns, "patterns", lambda problem: (f"{problem} list", f"{problem} columns")
    )
    monkeypatch.setattr(global_test.screening, "replicated", lambda *given: given)
    block = SimpleNamespace(target=SimpleNamespace(problem="p"))
    rng = np.random.default_rng(0)
    found = global_test.simulated_with_patterns(block, ["probe"], 7, rng)  # type: ignore[list-item, arg-type]
    assert found == (block, ["probe"], 7, rng, "p columns")  # type: ignore[comparison-overlap]


def test_of_few_readings_one_may_be_struck_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """One in twenty of fifteen is none, but a single gross error is looked for in any test."""
    one = experiments()[2].train(3)
    assert gross_errors.readings_of([one]) < 20
    asked: list[float] = []

    def suspect(block: Any, rival: float) -> Any:
        asked.append(rival)
        return one.name, one.holds[0].number, 1, 9.0

    monkeypatch.setattr(gross_errors, "suspect", suspect)
    monkeypatch.setattr(global_test, "expand", lambda *given: None)
    # a smooth curve explains 4, no effect explains anything
    monkeypatch.setattr(
        global_test, "scan", lambda x: SimpleNamespace(effects=np.array([[-7.0]]), flexible=np.array([4.0]))
    )
    block: Any = SimpleNamespace(experiments=(one,), target=None, modes=SimpleNamespace(z=np.zeros((1, 1))), effects=(),
                                 law="hooke", history="saturating", exponent=None)  # fmt: skip
    monkeypatch.setattr(global_test, "fitted", lambda members, *given, **known: SimpleNamespace(experiments=members))
    candidates = [Candidate(0, "a", (0,), True)]
    found, gone = global_test._strike_gross_errors(block, [], candidates, 0, np.random.default_rng(0))
    assert len(gone) == 1 and asked == [4.0]
    assert gross_errors.readings_of(found.experiments) == gross_errors.readings_of([one]) - 1


@pytest.mark.parametrize(("linear", "further"), [(0.002, {}), (0.003, {"a": 3.0})])
def test_of_many_simulations_two_in_a_thousand_are_plain_to_see(
    linear: float, further: dict[str, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """However many there are; above that larger effects are tried."""
    from tests.discovery import test_global_test

    monkeypatch.setattr(test_global_test, "SIMULATIONS", 999)
    found, _ = test_global_test.examined(monkeypatch, linear=linear, larger=0.9)
    assert found.further == further and found.test.p == (0.9 if further else linear)


def test_where_no_effect_acts_a_gross_error_is_held_against_the_smooth_curve(monkeypatch: pytest.MonkeyPatch) -> None:
    """However little that explains; effects of other blocks do not count."""
    asked: list[float] = []
    monkeypatch.setattr(gross_errors, "suspect", lambda block, rival: asked.append(rival))
    monkeypatch.setattr(global_test, "expand", lambda *given: None)
    found = SimpleNamespace(effects=np.array([[9.0]]), flexible=np.array([0.25]))
    monkeypatch.setattr(global_test, "scan", lambda x: found)
    one = experiments()[2].train(3)
    block: Any = SimpleNamespace(experiments=(one,), target=None, modes=SimpleNamespace(z=np.zeros((1, 1))))
    for flexible, rival in ((0.25, 0.25), (-3.0, 0.0)):
        found.flexible[0] = flexible
        same, gone = global_test._strike_gross_errors(block, [], [Candidate(0, "a", (1,), True)], 0, None)  # type: ignore[arg-type]
        assert same is block and gone == [] and asked[-1] == rival
