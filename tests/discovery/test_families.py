"""Families: names that look alike, by their likeness to the best of them."""

from typing import Any

import numpy as np
import pytest

from tests.simulated import WIRE, simulated_tests
from wirebayes.discovery import screening
from wirebayes.discovery.families import (
    PATTERNS,
    block_ratio,
    called,
    families_of,
    family_sentence,
    grouped,
    refitted_probe,
)
from wirebayes.discovery.judgement import Evidence, FamilyEvidence
from wirebayes.discovery.linear_scan import expand, scan
from wirebayes.discovery.name_evidence import weigh_names
from wirebayes.discovery.search import _families
from wirebayes.effects import CATALOGUE, effect_named
from wirebayes.inference.laplace_fit import fitted
from wirebayes.model.spec import PLAIN_SPEC
from wirebayes.sentences import families_said, said_beside, undecided
from wirebayes.simulation.synthetic import Bench, Truth


def likeness(pairs: dict[tuple[int, int], float], m: int) -> np.ndarray:
    out = np.eye(m)
    for (i, j), cos in pairs.items():
        out[i, j] = out[j, i] = cos
    return out


def test_members_are_alike_to_the_best_and_not_to_each_other_s_neighbours() -> None:
    """a is like b, b like c; c, which is not like a, begins a family of its own and does not take b along."""
    cosine = likeness({(0, 1): 0.96, (1, 2): 0.97, (2, 3): 0.951}, 4)
    assert grouped("abcd", cosine) == [("a", "b"), ("c", "d")]
    assert grouped("bacd", cosine[np.ix_([1, 0, 2, 3], [1, 0, 2, 3])]) == [("b", "a", "c"), ("d",)]


@pytest.mark.parametrize(("cos", "families"), [(0.9501, [("a", "b")]), (0.95, [("a",), ("b",)])])
def test_alike_means_more_than_the_threshold(cos: float, families: list[tuple[str, ...]]) -> None:
    assert grouped("ab", likeness({(0, 1): cos}, 2)) == families


def test_a_family_is_called_by_what_its_members_have_in_common() -> None:
    assert called(("toe", "strain_stiffening")) == "elastic curve" and called(("toe",)) == "toe"
    assert called(("screw_wobble", "toe")) == "screw_wobble"  # a user's own effect has no other name
    assert {n for n, kind in CATALOGUE.items() if kind.pattern not in PATTERNS} == set(), "an effect needs a pattern"


def test_families_with_the_same_in_common_have_names_and_sentences_of_their_own() -> None:
    members = [
        {"prior_creep": 0.7, "unrecorded_hold": 0.3},
        {"toe": 0.6, "power_strain": 0.4},
        {"creep_threshold": 0.8, "ageing": 0.2},
    ]
    families = tuple(FamilyEvidence(each, inclusion=0.95, gain=5.0) for each in members)
    found = _families(Evidence(0.001, 0.0, families, {}, None, 0.1, None))
    names = ["creep from hold to hold: prior creep", "elastic curve", "creep from hold to hold: creep threshold"]
    assert [family["name"] for family in found] == names
    assert found[0]["sentence"].startswith("the creep changes from hold to hold: prior creep 70 %")
    assert found[2]["sentence"].startswith("the creep changes from hold to hold, in another way: creep threshold 80 %")


def test_a_family_is_said_as_a_person_who_tests_lines_would() -> None:
    found = {"strain_stiffening": 0.83, "sensor_nonlinearity": 0.08, "toe": 0.06, "power_strain": 0.004}
    assert (
        family_sentence(found) == "the elastic curve is bent: strain stiffening 83 %, sensor nonlinearity 8 %, toe 6 %"
    )
    assert family_sentence({"screw_wobble": 0.9}) == "there is screw wobble, 90 %"
    assert family_sentence({"screw_wobble": 1.0}) == "there is screw wobble"
    assert family_sentence({"toe": 0.996, "power_strain": 0.003}) == "the elastic curve is bent: toe"


def test_only_established_families_of_several_are_said_and_a_remainder_that_does_not_count() -> None:
    several = {"members": ["a", "b"], "established": True, "sentence": "one of both"}
    families = [several, several | {"established": False}, several | {"members": ["c"]}]
    found: Any = {"verdict": "ambiguous", "families": families, "remainder": {"probability": 0.51}}
    assert families_said(found) == ["one of both"]
    assert undecided(found) == "one of both; these readings do not tell which"
    assert said_beside(found) == ["something beyond it is likely (51 %), but predicts nothing better"]
    assert said_beside(found | {"remainder": {"probability": 0.5}}) == []
    assert said_beside(found | {"verdict": "partial"}) == ["one of both"]


def test_without_an_established_family_the_likely_names_are_said() -> None:
    family = {"members": ["a", "b"], "established": False, "sentence": "one of both"}
    found: Any = {"families": [family], "set": ["a", "b"], "probabilities": {"a": 0.6, "b": 0.35, "unknown": 0.05}}
    assert undecided(found) == "something is missing; these readings do not tell what: a (60 %) or b (35 %)"


def test_a_bent_line_and_a_bent_sensor_are_one_family_and_a_delay_is_another() -> None:
    """Refitted on the paper's protocol, where the two differ by a few degrees."""
    effect = effect_named("strain_stiffening")
    experiments = simulated_tests([Bench()], Truth(WIRE | {"strain_stiffening.c": 12.0}, [effect]), seed=3)
    plain = [fitted(experiments, (), PLAIN_SPEC, np.random.default_rng(0))]
    kinds = {name: CATALOGUE[name] for name in ("strain_stiffening", "sensor_nonlinearity", "reading_delay")}
    trials, candidates = screening.candidate_probes(plain, kinds)
    data = [scan(expand(plain[0].target, plain[0].z, trials))]
    found = weigh_names(plain, trials, candidates, data)
    order = [n for n in ("strain_stiffening", "sensor_nonlinearity", "reading_delay") if n in found.winners]
    probed = {n: {0: refitted_probe(plain[0], found.winners[n][0], 0)} for n in order}
    families = families_of(plain, probed, [block_ratio(plain[0])])
    assert families[0] == ("strain_stiffening", "sensor_nonlinearity")
    assert [f for f in families if "reading_delay" in f] in ([], [("reading_delay",)])
    amplitude = probed["strain_stiffening"][0].own["strain_stiffening.c"]
    assert amplitude == pytest.approx(found.winners["strain_stiffening"][0].amplitude)
