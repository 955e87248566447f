"""Sets of effects with and without a remainder: the prior's arithmetic, and what the sums mean."""

from itertools import combinations, product
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from wirebayes.discovery.model_space import EffectSet, log_prior, log_weights, posterior, smallest_set
from wirebayes.discovery.settings import LEAST_ALTERNATIVE
from wirebayes.discovery.stepwise import Accepted
from wirebayes.discovery.subsets import over_subsets
from wirebayes.discovery.verdict import Decision, alternatives, verdict_of

ONE = np.ones(1)
NONE = np.full(1, -20.0)  # a remainder that the readings speak against


def a_set(names: str, log_bayes: float, remainder: Any = NONE) -> EffectSet:
    return EffectSet(tuple(names), log_bayes, dict.fromkeys(names, ONE), remainder)


def judged(sets: list[EffectSet], names: int = 20, copies: dict[str, set[str]] | None = None) -> Any:
    return posterior(sets, *log_weights(sets, names, copies or {}), blocks=1, copies=copies or {})


def test_each_further_effect_is_ten_times_less_likely_whatever_the_catalogue_holds() -> None:
    for names in (4, 20):
        weights = [sum(np.exp(log_prior(size, names)) for _ in combinations(range(names), size)) for size in (1, 2, 3)]
        assert weights == pytest.approx([names, 0.1 * names, 0.01 * names])


def test_something_unknown_is_believed_as_readily_as_one_name() -> None:
    """Even odds before the test: with equal evidence *unknown* is as probable as the name, with less it is less."""
    for ahead in (-2.0, 0.0, 3.0):
        found = judged([a_set("", 0.0, np.array([8.0 + ahead])), a_set("a", 8.0)])
        assert found.shares[0]["unknown"] == pytest.approx(1.0 / (1.0 + np.exp(-ahead)))


def test_a_remainder_beside_a_name_has_half_the_weight_of_none() -> None:
    found = judged([a_set("", 0.0), a_set("a", 30.0, np.array([2.0]))])
    assert found.remainder[0] == pytest.approx(0.5 * np.exp(2.0) / (1.0 + 0.5 * np.exp(2.0)))
    assert found.shares[0]["a"] == pytest.approx(1.0)  # with the remainder beside it, too, it has the largest share


def test_inclusion_counts_every_set_and_the_first_name_has_the_share() -> None:
    found = judged([a_set("", 0.0), a_set("a", 10.0), a_set("ab", 16.0), a_set("c", 9.0)])
    pair = np.exp(16.0 + log_prior(2, 20))
    total = np.exp(10.0) + pair + np.exp(9.0)
    assert found.inclusion["a"][0] == pytest.approx((np.exp(10.0) + pair) / total)
    assert found.inclusion["b"][0] == pytest.approx(pair / total)
    assert found.shares[0]["a"] == pytest.approx(found.inclusion["a"][0])
    assert found.shares[0]["b"] == 0.0
    assert found.best.names == ("a", "b")
    assert list(found.shares[0]) == ["a", "c", "unknown", "b"]  # as they are listed: the most probable first


def test_the_same_effect_under_two_names_makes_it_no_likelier() -> None:
    """A catalogue that lists an effect twice names something with the same probability as one that lists it once."""
    unknown = a_set("", 0.0, np.array([10.0]))
    once = judged([unknown, a_set("a", 10.0)], 20)
    copies = {"a": {"a", "b"}, "b": {"a", "b"}}
    twice = judged([unknown, a_set("a", 10.0), a_set("b", 10.0)], 21, copies)
    assert twice.shares[0]["unknown"] == pytest.approx(once.shares[0]["unknown"])
    # nor any less likely to be there: each of the names stands for both
    assert twice.inclusion["a"] == twice.inclusion["b"] == pytest.approx(once.inclusion["a"])
    assert twice.shares[0]["a"] == pytest.approx(0.5 * once.shares[0]["a"])


def test_a_copy_acts_where_one_of_its_names_does() -> None:
    """In a set with both names it acts where either does; elsewhere each set counts with its own."""
    both = EffectSet(("a", "b"), 5.0, {"a": np.array([0.5]), "b": np.array([0.2])}, NONE)
    copies = {"a": {"a", "b"}, "b": {"a", "b"}}
    found = posterior([both, a_set("c", 5.0)], np.log([0.6, 0.4]), np.full(2, -np.inf), 1, copies)
    assert found.inclusion["a"] == found.inclusion["b"] == pytest.approx([0.6 * (1.0 - 0.5 * 0.8)])
    assert found.inclusion["c"] == pytest.approx([0.4])


def test_materials_are_judged_each_by_what_acts_there() -> None:
    presence = {"a": np.array([1.0, 0.0])}
    sets = [EffectSet((), 0.0, {}, np.array([-20.0, 6.0])), EffectSet(("a",), 30.0, presence, np.array([-20.0, 6.0]))]
    found = posterior(sets, *log_weights(sets, 20, {}), blocks=2)
    assert found.inclusion["a"] == pytest.approx([1.0, 0.0])
    # a remainder in the second of two materials: half of the weight for one of them, a quarter for this one
    odds = 0.5 * 0.25 * np.exp(6.0)
    assert found.remainder == pytest.approx([0.0, odds / (1.0 + odds)], abs=1e-6)
    assert found.nothing == pytest.approx([0.0, 1.0 / (1.0 + odds)], abs=1e-6)


def test_the_smallest_set_holds_what_it_must() -> None:
    assert smallest_set({"a": 0.9, "b": 0.1}) == ["a"]
    assert smallest_set({"a": 0.89, "b": 0.06, "c": 0.05}) == ["a", "b"]


def decision(shares: dict[str, float], inclusion: float, remainder: float, gain: float, nothing: float = 0.0) -> Any:
    found = SimpleNamespace(
        shares=[shares], inclusion={"a": np.array([inclusion])}, remainder=np.array([remainder]),
        nothing=np.array([nothing]),
    )  # fmt: skip
    best = SimpleNamespace(accepted=(Accepted("a", (0,), {}),))
    return Decision(found, best, None, {"a": np.array([gain])})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("inclusion", "remainder", "gain", "verdict", "accepted"),
    [
        (1.0, 0.49, 50.0, "named", 1),
        (1.0, 0.51, 50.0, "partial", 1),
        (0.91, 0.51, 4.1, "partial", 1),
        (0.89, 0.51, 50.0, "unknown", 0),  # not established: it may be another name
        (1.0, 0.51, 3.9, "unknown", 0),  # it does not predict
    ],
)
def test_verdicts_turn_at_their_thresholds(
    inclusion: float, remainder: float, gain: float, verdict: str, accepted: int
) -> None:
    decided, effects = verdict_of(decision({"a": 1.0}, inclusion, remainder, gain), 0)
    assert decided == verdict and len(effects) == accepted


def test_two_names_in_the_set_are_ambiguous_and_a_material_may_lack_nothing() -> None:
    assert verdict_of(decision({"a": 0.89, "b": 0.11}, 0.89, 0.1, 50.0), 0)[0] == "ambiguous"
    assert verdict_of(decision({"a": 0.91, "b": 0.09}, 0.91, 0.1, 50.0), 0)[0] == "named"
    assert verdict_of(decision({"a": 1.0}, 0.3, 0.1, 50.0, nothing=0.51), 0) == ("nothing-missing", [])
    assert verdict_of(decision({"a": 1.0}, 0.3, 0.1, 50.0, nothing=0.49), 0)[0] == "named"


def test_what_is_left_beside_a_name_counts_for_the_name_as_far_as_the_smooth_curve_needs_it() -> None:
    from wirebayes.discovery.verdict import _more_beside

    sets = [a_set("", 0.0), a_set("a", 10.0)]
    for ahead in (-3.0, 0.0, 3.0):  # of the name with a smooth remainder, over the remainder alone
        more = np.exp(_more_beside(sets, np.array([-40.0, -40.0 + ahead]), 1, 5.0))
        assert more.sum() == pytest.approx(np.exp(5.0))
        assert more[1] / more[0] == pytest.approx(np.exp(ahead))


def test_shares_of_a_material_sum_to_one_though_effects_may_not_act_there() -> None:
    influence = {"a": np.array([1.0, 0.3]), "b": np.array([1.0, 0.6])}
    sets = [EffectSet((), 0.0, {}, np.full(2, -20.0))]
    sets += [EffectSet((name,), 5.0, {name: acts}, np.full(2, -20.0)) for name, acts in influence.items()]
    found = posterior(sets, *log_weights(sets, 20, {}), blocks=2)
    assert [sum(shares.values()) for shares in found.shares] == pytest.approx([1.0, 1.0])
    assert found.shares[1]["b"] / found.shares[1]["a"] == pytest.approx(2.0)


def test_what_the_final_model_shares_the_probability_with() -> None:
    """Sets with and without a remainder, the final model first; the improbable and the plain model are left out."""
    sets = [a_set(names, 0.0, None) for names in ("", "a", "b", "c")]
    block = {n: SimpleNamespace(effects=[SimpleNamespace(key=n)] if n else []) for n in ("", "a", "b", "c")}
    weights = {"": (0.1, 0.0), "a": (0.5, 0.2), "b": (0.16, 0.0), "c": (0.5 * LEAST_ALTERNATIVE, 0.015)}
    space = SimpleNamespace(
        sets=sets,
        without=[weights["".join(s.names)][0] for s in sets],
        beside=[weights["".join(s.names)][1] for s in sets],
    )
    explored = SimpleNamespace(fitted={s.key: SimpleNamespace(blocks=[block["".join(s.names)]]) for s in sets})
    given = SimpleNamespace(posterior=space), explored, 0, block["a"]
    found = alternatives(*given, "named")  # type: ignore[arg-type]
    assert [(a.block.effects[0].key, a.remains) for a in found] == [("a", False), ("a", True), ("b", False)]
    assert [a.probability for a in found] == pytest.approx(np.array([0.5, 0.2, 0.16]) / 0.86)
    partial = alternatives(*given, "partial")  # type: ignore[arg-type]
    assert (partial[0].remains, partial[1].remains) == (True, False)
    assert partial[0].probability == pytest.approx(0.2 / 0.86)


def test_none_or_one_effect_has_no_factor_whatever_the_catalogue_holds() -> None:
    assert log_prior(0, 20) == log_prior(1, 20) == log_prior(1, 3) == 0.0
    assert log_prior(2, 20) == pytest.approx(np.log(0.1 * 20 / (20 * 19 / 2)))


def test_weights_by_hand() -> None:
    """Of a set alone, and beside a remainder that is smooth or not; of nothing at all, and of a remainder alone."""
    sets = [a_set("", 0.0, np.array([3.0])), a_set("a", 5.0, np.array([1.0])), a_set("ab", 9.0, None)]
    copies = {"a": {"a", "x"}, "b": {"b", "y", "z"}}
    without, beside = log_weights(sets, 20, copies)
    pair = log_prior(2, 20) - np.log(2.0) - np.log(3.0)
    assert without == pytest.approx([-np.inf, 5.0 - np.log(2.0), 9.0 + pair])
    assert beside == pytest.approx([3.0, 5.0 - np.log(2.0) + np.log(0.5) + 1.0, -np.inf])
    _, rough = log_weights(sets, 20, copies, {frozenset("a"): 1.0, frozenset("ab"): 2.0})
    assert rough == pytest.approx([3.0, beside[1] + np.log(2.0), 9.0 + pair + np.log(0.5) + 2.0])


def test_where_nothing_can_be_missing_there_are_no_shares() -> None:
    """Effects that do not act in a material, and a remainder that is elsewhere."""
    sets = [EffectSet((), 0.0, {}, np.array([8.0, -40.0])), EffectSet(("a",), 9.0, {"a": np.array([1.0, 0.0])}, None)]
    found = posterior(sets, np.array([-np.inf, 2.0]), np.array([-np.inf, -np.inf]), blocks=2)
    assert found.shares == [{"a": 1.0, "unknown": 0.0}, {}]
    assert found.nothing.tolist() == [0.0, 1.0] and found.remainder.tolist() == [0.0, 0.0]


def test_a_set_whose_remainder_was_not_looked_for_has_it_everywhere_where_it_has_one() -> None:
    sets = [EffectSet(("a",), 0.0, {"a": np.array([1.0, 0.5])}, None)]
    found = posterior(sets, np.log([0.75]), np.log([0.25]), blocks=2)
    assert found.remainder == pytest.approx([0.25, 0.25]) and found.nothing == pytest.approx([0.0, 0.375])
    assert found.shares[1] == pytest.approx({"a": 0.5 / 0.625, "unknown": 0.125 / 0.625})


def test_the_best_set_begins_with_the_best_first_name() -> None:
    """Two sets that begin with b together outweigh the heaviest set, and the heavier of them is the best."""
    sets = [a_set("a", 0.0, None), a_set("b", 0.0, None), a_set("bc", 0.0, None)]
    found = posterior(sets, np.log([0.3, 0.2, 0.1]), np.log([0.1, 0.05, 0.25]), blocks=1)
    assert found.best.names == ("b", "c") and sets[0].first == "a" and a_set("", 0.0).first == ""


def test_a_set_that_holds_exactly_enough_is_enough() -> None:
    assert smallest_set({"b": 0.25, "a": 0.5, "c": 0.25}, 0.75) == ["a", "b"]
    assert smallest_set({"a": 0.5, "b": 0.5}, 0.5) == ["a"] and smallest_set({}) == []
    assert smallest_set({"a": 0.5, "b": 0.3}) == ["a", "b"]


@pytest.mark.parametrize("far", [60.0, 1e4])
def test_far_beyond_doubt_all_of_what_is_left_counts_for_one_side(far: float) -> None:
    """For the remainder beside the name where the smooth curve needs it, or for a remainder alone where it does not."""
    from wirebayes.discovery.verdict import _more_beside

    sets = [a_set("", 0.0), a_set("b", 3.0), a_set("a", 10.0)]
    needed = _more_beside(sets, np.array([-40.0, 1.0, -40.0 + far]), 2, far)
    assert needed == pytest.approx([-40.0, 1.0, np.logaddexp(-40.0 + far, far)])
    idle = _more_beside(sets, np.array([-40.0, 1.0, -40.0 - far]), 2, 5.0)
    assert idle[0] == pytest.approx(np.logaddexp(-40.0, 5.0)) and idle[1] == 1.0
    assert idle[2] == pytest.approx(np.logaddexp(-40.0 - far, 5.0 - 50.0))


def test_sums_over_the_sets_are_those_over_all_that_may_be_true_in_a_material() -> None:
    """Effects act each on its own, a remainder is there or not; with nothing of both nothing is missing."""
    rng = np.random.default_rng(0)
    names = ("a", "b", "c")
    sets = [EffectSet((), 0.0, {}, np.array([0.5, -1.0]))]
    for chosen in (("a",), ("b", "a"), ("c", "b", "a"), ("c",)):
        presence = {name: rng.uniform(size=2) for name in chosen}
        sets.append(EffectSet(chosen, 0.0, presence, None if chosen == ("c",) else rng.normal(size=2)))
    without, beside = np.log(rng.uniform(size=(2, 5)))
    found = posterior(sets, without, beside, blocks=2)
    total = np.exp(without).sum() + np.exp(beside).sum()
    for b in range(2):
        nothing = remainder = 0.0
        inclusion, first = dict.fromkeys(names, 0.0), dict.fromkeys((*names, "unknown"), 0.0)
        for s, bare, more in zip(sets, np.exp(without) / total, np.exp(beside) / total, strict=True):
            remains = 1.0 if s.remainder is None else over_subsets(s.remainder)[1][b]
            for rest, weight in ((False, bare), (False, more * (1.0 - remains)), (True, more * remains)):
                for acting in product((False, True), repeat=len(s.names)):
                    chances = [s.presence[n][b] if on else 1.0 - s.presence[n][b]
                               for n, on in zip(s.names, acting, strict=True)]  # fmt: skip
                    chance = weight * float(np.prod(chances))
                    there = [n for n, on in zip(s.names, acting, strict=True) if on]
                    nothing += chance * (not there and not rest)
                    remainder += chance * rest
                    for n in there:
                        inclusion[n] += chance
                    if there or rest:
                        first[there[0] if there else "unknown"] += chance
        assert found.nothing[b] == pytest.approx(nothing) and found.remainder[b] == pytest.approx(remainder)
        assert {n: found.inclusion[n][b] for n in names} == pytest.approx(inclusion)
        missing = sum(first.values())
        assert missing == pytest.approx(1.0 - nothing)
        assert found.shares[b] == pytest.approx({n: share / missing for n, share in first.items()})
