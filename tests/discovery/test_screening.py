"""Which forms of effects are candidates."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from wirebayes.discovery import screening
from wirebayes.discovery.linear_scan import expand
from wirebayes.discovery.screening import candidate_probes
from wirebayes.discovery.surprise import Scale, empirical_surprise
from wirebayes.effects import CATALOGUE
from wirebayes.inference.laplace_fit import fitted
from wirebayes.io.paper import experiments
from wirebayes.model.build import build
from wirebayes.model.spec import PLAIN_SPEC, ModelSpec


@pytest.mark.parametrize(("exponent", "missing"), [(1.0, set()), (stats.norm(1.0, 1.0), {"length_dependence@B"})])
def test_what_a_learned_exponent_says_is_no_candidate(exponent: object, missing: set[str]) -> None:
    """Creep that grows as L0^p: with p learned, an effect that changes B with length would be the same once more."""
    members = experiments()[:2]
    problem = build(members, spec=ModelSpec(length_exponent=exponent))
    block = SimpleNamespace(experiments=members, effects=(), target=SimpleNamespace(problem=problem))
    trials, candidates = candidate_probes([block], {"length_dependence": CATALOGUE["length_dependence"]})  # type: ignore[list-item]
    every = {f"length_dependence@{which}" for which in ("k1", "B", "U", "N")}
    assert {trials[c.probe].effect.key for c in candidates} == every - missing


def test_a_surprise_is_minus_the_log_share_of_what_chance_exceeds() -> None:
    """Exponential tails of other widths than a nat, and beyond the largest of the simulations."""
    rng = np.random.default_rng(0)
    for width in (0.5, 1.0, 2.0):
        scale = Scale.of(width * rng.exponential(size=100_000) - 3.0)
        for share in (0.1, 1e-3, 1e-6):
            value = -3.0 - width * np.log(share)
            assert scale.surprise(value) == pytest.approx(-np.log(share), abs=0.03 * -np.log(share))
            assert scale.value(float(scale.surprise(value))) == pytest.approx(value, rel=0.01)
    never = Scale.of(np.full(50, -2.0))  # a name that does not show in any simulation
    assert never.surprise(-2.0) == 0.0 < never.surprise(-1.9)


def test_where_a_tail_is_longer_than_exponential_the_count_decides() -> None:
    """Half of the upper values lie a hundred nats above the others; none is a nat more surprising than its share."""
    chance = np.concatenate([np.linspace(-1.0, 1.0, 95), [100.0, 101.0, 102.0, 103.0, 104.0]])
    scale = Scale.of(chance)
    assert float(scale.surprise(100.0)) == pytest.approx(np.log(101 / 6) + 1.0)
    assert float(scale.surprise(106.0)) == pytest.approx(np.log(101) + 2.0 + 1.0)
    assert scale.value(np.log(101) + 3.0) == pytest.approx(106.0)
    assert 1.0 < scale.value(np.log(101 / 4) + 1.0) < 104.0


@pytest.mark.statistical
def test_p_depends_less_on_the_simulations_drawn_than_by_counting(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fifteen names, one with a value that 4 in 1,000 exceed: as many simulations, but all of them counted."""
    rng = np.random.default_rng(0)
    monkeypatch.setattr(screening, "by_name", lambda candidates, scans: scans)
    data = {str(k): np.array([-np.log(0.004) if k == 0 else 0.0]) for k in range(15)}
    drawn = [{name: rng.exponential(size=999) for name in data} for _ in range(200)]
    p = np.array([screening.global_test([], data, chance).p for chance in drawn])  # type: ignore[arg-type]

    def by_counting(chance: dict[str, np.ndarray]) -> float:
        null = np.max([np.log(999) - np.log(stats.rankdata(-v)) for v in chance.values()], axis=0)
        return float((1 + (null >= empirical_surprise(data["0"], chance["0"])).sum()) / 1000)

    counts = np.array([by_counting(chance) for chance in drawn])
    share = 1.0 - (1.0 - 0.004) ** 15
    assert p.mean() == pytest.approx(share, rel=0.1) and counts.mean() == pytest.approx(share, rel=0.1)
    assert np.log(p).std() < 0.7 * np.log(counts).std()


def test_what_has_many_signatures_is_scanned_in_smaller_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    """As many simulations at once as fit, one at least, to the same log Bayes factors."""
    block = fitted(experiments()[1:2], (), PLAIN_SPEC, np.random.default_rng(0))
    trials, _ = candidate_probes([block], CATALOGUE)
    numbers = len(trials) * block.target.problem.samples[0].protocol.mask.size
    rows: list[int] = []

    def counted(target: Any, z: Any, *given: Any) -> Any:
        rows.append(len(z))
        return expand(target, z, *given)

    monkeypatch.setattr(screening, "expand", counted)
    found = []
    for room in (100.0, 3.0, 0.0):
        monkeypatch.setattr(screening, "_NUMBERS", room * numbers)
        found.append(screening.replicated(block, trials, 7, np.random.default_rng(1)).scan)
    assert rows == [7, 3, 3, 1, *[1] * 7]
    for scan in found[1:]:
        assert scan.effects == pytest.approx(found[0].effects, rel=1e-6, abs=1e-6)
        assert scan.flexible == pytest.approx(found[0].flexible, rel=1e-6, abs=1e-6)
