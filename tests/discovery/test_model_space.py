"""Sets of effects with and without a remainder: the prior's arithmetic, and what the sums mean."""

from itertools import combinations, product
from typing import Any

import numpy as np
import pytest

from wirebayes.discovery.model_space import EffectSet, log_prior, log_weights, posterior, smallest_set
from wirebayes.discovery.settings import MORE
from wirebayes.discovery.subsets import over_subsets

ONE = np.ones(1)
NONE = np.full(1, -20.0)  # a remainder that the readings speak against


def a_set(names: str, log_bayes: float, remainder: Any = NONE) -> EffectSet:
    return EffectSet(tuple(names), log_bayes, dict.fromkeys(names, ONE), remainder)


def judged(sets: list[EffectSet], names: int = 20, families: list[tuple[str, ...]] | None = None) -> Any:
    return posterior(sets, *log_weights(sets, names, families or []), 1, families or [])


def test_each_further_effect_is_half_as_likely_whatever_the_catalogue_holds() -> None:
    for names in (4, 20):
        weights = [sum(np.exp(log_prior(size, names)) for _ in combinations(range(names), size)) for size in (1, 2, 3)]
        assert weights == pytest.approx([names, MORE * names, MORE**2 * names])


def test_something_unknown_is_believed_as_readily_as_one_name() -> None:
    """Even odds before the test: with equal evidence *unknown* is as probable as the name, with less it is less."""
    for ahead in (-2.0, 0.0, 3.0):
        found = judged([a_set("", 0.0, np.array([8.0 + ahead])), a_set("a", 8.0)])
        assert found.shares[0]["unknown"] == pytest.approx(1.0 / (1.0 + np.exp(-ahead)))


def test_a_remainder_beside_a_name_has_the_weight_of_all_further_names() -> None:
    found = judged([a_set("", 0.0), a_set("a", 30.0, np.array([2.0]))])
    assert found.remainder[0] == pytest.approx(MORE * np.exp(2.0) / (1.0 + MORE * np.exp(2.0)))
    assert found.shares[0]["a"] == pytest.approx(1.0)  # with the remainder beside it, too, it has the largest share
    assert sum(np.exp(log_prior(2, 20)) for _ in range(19)) / 2 == pytest.approx(MORE, rel=1e-9)


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


def test_look_alikes_share_the_weight_of_one_and_are_judged_together() -> None:
    """A catalogue with an effect under two names finds something missing with the same probability as with one."""
    unknown = a_set("", 0.0, np.array([10.0]))
    once = judged([unknown, a_set("a", 10.0)], 20)
    twice = judged([unknown, a_set("a", 10.0), a_set("b", 10.0)], 21, [("a", "b")])
    assert twice.shares[0]["unknown"] == pytest.approx(once.shares[0]["unknown"])
    assert twice.families == (("a", "b"),) and twice.together[0] == pytest.approx(once.inclusion["a"])
    assert twice.inclusion["a"] == twice.inclusion["b"] == pytest.approx(0.5 * once.inclusion["a"])


def test_a_family_acts_where_one_of_its_members_does() -> None:
    """In a set with both names it acts where either does; elsewhere each set counts with its own."""
    both = EffectSet(("a", "b"), 5.0, {"a": np.array([0.5]), "b": np.array([0.2])}, NONE)
    found = posterior([both, a_set("c", 5.0)], np.log([0.6, 0.4]), np.full(2, -np.inf), 1, [("a", "b")])
    assert found.families == (("a", "b"), ("c",)) and found.family("b") == ("a", "b")
    assert found.together[0] == pytest.approx([0.6 * (1.0 - 0.5 * 0.8)]) and found.together[1] == pytest.approx([0.4])
    assert found.inclusion["a"] == pytest.approx([0.3]) and found.inclusion["b"] == pytest.approx([0.12])


def test_materials_are_judged_each_by_what_acts_there() -> None:
    presence = {"a": np.array([1.0, 0.0])}
    sets = [EffectSet((), 0.0, {}, np.array([-20.0, 6.0])), EffectSet(("a",), 30.0, presence, np.array([-20.0, 6.0]))]
    found = posterior(sets, *log_weights(sets, 20), blocks=2)
    assert found.inclusion["a"] == pytest.approx([1.0, 0.0])
    # a remainder in the second of two materials: half of the weight for one of them, a quarter for this one
    odds = MORE * 0.25 * np.exp(6.0)
    assert found.remainder == pytest.approx([0.0, odds / (1.0 + odds)], abs=1e-6)
    assert found.nothing == pytest.approx([0.0, 1.0 / (1.0 + odds)], abs=1e-6)


def test_the_smallest_set_holds_what_it_must() -> None:
    assert smallest_set({"a": 0.9, "b": 0.1}) == ["a"]
    assert smallest_set({"a": 0.89, "b": 0.06, "c": 0.05}) == ["a", "b"]


def test_what_is_left_beside_a_name_counts_for_the_name_as_far_as_the_smooth_curve_needs_it() -> None:
    from wirebayes.discovery.verdict import _more_beside

    sets = [a_set("", 0.0), a_set("a", 10.0)]
    for ahead in (-3.0, 0.0, 3.0):  # of the name with a smooth remainder, over the remainder alone
        more = np.exp(_more_beside(sets, np.array([-np.inf, 4.0]), np.array([-40.0, -40.0 + ahead]), [1], 1.0))
        assert more.sum() == pytest.approx(np.exp(5.0))
        assert more[1] / more[0] == pytest.approx(np.exp(ahead))


def test_what_the_best_of_look_alikes_leaves_over_counts_for_all_of_them() -> None:
    """By their weights, and against a remainder alone by what they have together."""
    from wirebayes.discovery.verdict import _more_beside

    sets = [a_set("", 0.0), a_set("a", 10.0), a_set("b", 9.0)]
    beside = np.log([0.3, 0.4, 0.3])
    without = np.array([-np.inf, 5.0, 4.0])
    added = np.exp(_more_beside(sets, without, beside, [1, 2], 1.0)) - np.exp(beside)
    assert added[1] / added[2] == pytest.approx(np.e) and added[0] == pytest.approx(0.3 * added.sum())
    assert added.sum() == pytest.approx(np.exp(1.0) * (np.exp(5.0) + np.exp(4.0)))


def test_shares_of_a_material_sum_to_one_though_effects_may_not_act_there() -> None:
    influence = {"a": np.array([1.0, 0.3]), "b": np.array([1.0, 0.6])}
    sets = [EffectSet((), 0.0, {}, np.full(2, -20.0))]
    sets += [EffectSet((name,), 5.0, {name: acts}, np.full(2, -20.0)) for name, acts in influence.items()]
    found = posterior(sets, *log_weights(sets, 20), blocks=2)
    assert [sum(shares.values()) for shares in found.shares] == pytest.approx([1.0, 1.0])
    assert found.shares[1]["b"] / found.shares[1]["a"] == pytest.approx(2.0)


def test_none_or_one_effect_has_no_factor_whatever_the_catalogue_holds() -> None:
    assert log_prior(0, 20) == log_prior(1, 20) == log_prior(1, 3) == 0.0
    assert log_prior(2, 20) == pytest.approx(np.log(0.5 * 20 / (20 * 19 / 2)))


def test_weights_by_hand() -> None:
    """Of a set alone, and beside a remainder that is smooth or not; of nothing at all, and of a remainder alone."""
    sets = [a_set("", 0.0, np.array([3.0])), a_set("a", 5.0, np.array([1.0])), a_set("ab", 9.0, None)]
    families = [("a", "x"), ("b", "y", "z")]
    without, beside = log_weights(sets, 20, families)
    pair = log_prior(2, 17) - np.log(2.0) - np.log(3.0)
    assert without == pytest.approx([-np.inf, 5.0 - np.log(2.0), 9.0 + pair])
    assert beside == pytest.approx([3.0, 5.0 - np.log(2.0) + np.log(MORE) + 1.0, -np.inf])
    _, rough = log_weights(sets, 20, families, {frozenset("a"): 1.0, frozenset("ab"): 2.0})
    assert rough == pytest.approx([3.0, beside[1] + np.log(2.0), 9.0 + pair + np.log(MORE) + 2.0])


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


def test_the_best_set_begins_with_a_name_of_the_best_first_family() -> None:
    """Look-alikes share what speaks for them: c alone has the most, the family of a and b has more."""
    sets = [a_set(name, 0.0, None) for name in "abc"]
    found = posterior(sets, np.log([0.3, 0.31, 0.39]), np.full(3, -np.inf), 1, [("a", "b")])
    assert found.best.names == ("b",)


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
    bare = np.array([-np.inf, 0.0, 4.0])
    needed = _more_beside(sets, bare, np.array([-40.0, 1.0, -40.0 + far]), [2], far - 4.0)
    assert needed == pytest.approx([-40.0, 1.0, np.logaddexp(-40.0 + far, far)])
    idle = _more_beside(sets, bare, np.array([-40.0, 1.0, -40.0 - far]), [2], 1.0)
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
                    chances = [
                        s.presence[n][b] if on else 1.0 - s.presence[n][b]
                        for n, on in zip(s.names, acting, strict=True)
                    ]
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


def test_no_probability_exceeds_one_however_much_evidence_there_is() -> None:
    """Evidence of ten thousand nats leaves rounding errors in the sums; they are probabilities all the same."""
    rng = np.random.default_rng(5)
    for trial in range(200):
        certain = np.array([30.0 + 10.0 * rng.random()])
        sets = [a_set("a" + more, 1e4 + rng.normal(), certain) for more in ("", "b", "c", "d", "bc")]
        found = judged([a_set("", 0.0), *sets], families=[("b", "c")])
        sums = [*found.nothing, *found.remainder, *np.ravel(list(found.inclusion.values())), *np.ravel(found.together)]
        assert max(*sums, *found.shares[0].values()) <= 1.0, trial
