"""Which forms of effects are candidates."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from wirebayes.discovery import screening
from wirebayes.discovery.screening import Scale, candidate_probes
from wirebayes.effects import CATALOGUE
from wirebayes.io.paper import experiments
from wirebayes.model.problem import build


@pytest.mark.parametrize(("exponent", "missing"), [(1.0, set()), (stats.norm(1.0, 1.0), {"length_dependence@B"})])
def test_what_a_learned_exponent_says_is_no_candidate(exponent: object, missing: set[str]) -> None:
    """Creep that grows as L0^p: with p learned, an effect that changes B with length would be the same once more."""
    members = experiments()[:2]
    problem = build(members, length_exponent=exponent)
    block = SimpleNamespace(experiments=members, effects=(), target=SimpleNamespace(problem=problem))
    trials, candidates = candidate_probes([block], {"length_dependence": CATALOGUE["length_dependence"]})  # type: ignore[list-item]
    every = {f"length_dependence@{which}" for which in ("k1", "B", "U", "N")}
    assert {trials[c.probe].effect.key for c in candidates} == every - missing


def test_a_surprise_is_minus_the_log_share_of_what_chance_exceeds() -> None:
    """Exponential tails of other widths than a nat, and far beyond the largest of the simulations."""
    rng = np.random.default_rng(0)
    for width in (0.5, 1.0, 2.0):
        scale = Scale.of(width * rng.exponential(size=100_000) - 3.0)
        for share in (0.1, 1e-3, 1e-6):
            value = -3.0 - width * np.log(share)
            assert scale.surprise(value) == pytest.approx(-np.log(share), abs=0.03 * -np.log(share))
            assert scale.value(float(scale.surprise(value))) == pytest.approx(value, rel=1e-12)
    never = Scale.of(np.full(50, -2.0))  # a name that does not show in any simulation
    assert never == Scale(-2.0, 1.0) and never.surprise(-2.0) == 0.0 < never.surprise(-1.9)


@pytest.mark.statistical
def test_p_hardly_depends_on_which_simulations_were_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fifteen names, one with a value that 4 in 1,000 exceed: by counting these, p varied by half of itself."""
    rng = np.random.default_rng(0)
    monkeypatch.setattr(screening, "by_name", lambda candidates, scans: scans)
    data = {str(k): np.array([-np.log(0.004) if k == 0 else 0.0]) for k in range(15)}
    drawn = [{name: rng.exponential(size=999) for name in data} for _ in range(200)]
    p = [screening.global_test([], data, chance).p for chance in drawn]  # type: ignore[arg-type]
    share = 1.0 - (1.0 - 0.004) ** 15
    assert np.mean(p) == pytest.approx(share, rel=0.1)
    assert np.std(np.log(p)) < 0.25
