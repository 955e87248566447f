"""Which forms of effects are candidates."""

from types import SimpleNamespace

import pytest
from scipy import stats

from wirebayes.discovery.screening import candidate_probes
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
