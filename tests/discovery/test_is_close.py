"""Whether a p-value is too close to its level to be on either side of it, against binomial sums."""

from math import comb
from types import SimpleNamespace

import numpy as np
import pytest

from wirebayes.discovery import global_test
from wirebayes.discovery.global_test import is_close


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
