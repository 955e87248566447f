"""From weighed sets to a decision: the guard of further effects and the second test, each at its threshold."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from wirebayes.discovery import alternatives, global_test, held_out, predicting, retest, verdict
from wirebayes.discovery import gains as gains_module
from wirebayes.discovery.fitted_sets import Accepted, Explored, FittedSet
from wirebayes.discovery.held_out import LeftOut
from wirebayes.discovery.judgement import verdict_on
from wirebayes.discovery.model_space import EffectSet, log_prior
from wirebayes.discovery.retest import Retest
from wirebayes.discovery.settings import MORE, REACH, Settings
from wirebayes.discovery.verdict import accepted_effects, decide, evidence

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
    root = EffectSet((), 0.0, {}, np.array([smooth]))
    return Explored((root, *known), fitted, {}, {}, FittedSet(root, [], (), None, ([], [])))


def decided(
    monkeypatch: pytest.MonkeyPatch,
    sets: Explored,
    gains: dict[str, float],
    p: dict[str, float],
    families: list[tuple[str, ...]] = [],  # noqa: B006
) -> verdict.Decision:
    """The decision where leaving out a hold, and the second test, give these values for each set."""

    def gain(best: Any, *others: Any) -> float:
        return gains.get("".join(best.effects.names), 50.0)

    def retested(best: Any, *others: Any) -> Retest:
        return Retest(p.get("".join(best.effects.names), 0.5), [[]])

    for module in (verdict, gains_module):
        monkeypatch.setattr(module, "name_gain", gain)
        monkeypatch.setattr(module, "family_gain", gain)
    for module in (verdict, retest):
        monkeypatch.setattr(module, "retested", retested)
    settings = Settings(kinds=dict.fromkeys("abcdefghijklmnopqrst"))  # type: ignore[arg-type]
    rng = np.random.default_rng(0)
    plain: Any = [SimpleNamespace(experiments=[SimpleNamespace(recorded_holds=range(12))])]
    return decide(plain, sets, families, settings, LeftOut(rng, map), rng, map)


def verdict_of(found: verdict.Decision, gain: float = 50.0) -> str:
    """The verdict where a smooth discrepancy gains so much beside what is established."""
    return verdict_on(evidence(found, 0.01, 0, gain)).verdict


def names(found: verdict.Decision) -> str:
    return "" if found.best is None else "".join(found.best.effects.names)


@pytest.mark.parametrize(("gain", "kept"), [(4.1, "ab"), (3.9, "a")])
def test_a_second_effect_must_predict(monkeypatch: pytest.MonkeyPatch, gain: float, kept: str) -> None:
    found = decided(monkeypatch, explored({"a": 10.0, "ab": 30.0, "abc": 20.0}), {"ab": gain}, {})
    assert names(found) == kept
    # what does not predict has no weight, nor has any set that contains it
    assert ("b" in found.posterior.inclusion) == (kept == "ab")


def contested(pair: float, smooth: float, beside: dict[str, float]) -> Explored:
    """Two names with so much evidence, a remainder alone, and remainders beside the first."""
    sets = {"a": 20.0, "ab": pair}
    known = explored(sets, smooth)
    changed = [replace(s, remainder=np.array([beside.get("".join(s.names), -20.0)])) for s in known.sets[1:]]
    for s in changed:
        known.fitted[s.key].effects = s
    return replace(known, sets=(known.sets[0], *changed))


def left_out_scores(
    monkeypatch: pytest.MonkeyPatch, elpd: dict[str, float], remainder: dict[str, float | None]
) -> None:
    """What leaving out one hold at a time gives of each set, and what a remainder gains beside it."""

    def names_of(block: Any) -> str:
        return "".join(getattr(block, "effects", ()))

    monkeypatch.setattr(LeftOut, "of", lambda self, fits: [np.array([elpd[names_of(fit)]]) for fit in fits])
    monkeypatch.setattr(predicting, "discrepancy_gain", lambda block, *others: remainder[names_of(block)])


@pytest.mark.parametrize(("by_pair", "established"), [(14.1, ["a", "b"]), (13.9, ["a"])])
def test_a_remainder_gives_way_to_a_further_name_that_predicts_better(
    monkeypatch: pytest.MonkeyPatch, by_pair: float, established: list[str]
) -> None:
    """By more than four, which is what a name has to gain; evidence has the remainder far ahead."""
    sets = contested(30.0 + UNLIKELIER, -20.0, {"a": 12.0})
    left_out_scores(monkeypatch, {"": 0.0, "a": 20.0, "ab": 20.0 + by_pair}, {"a": 10.0})
    found = decided(monkeypatch, sets, {}, {})
    assert [f.name for f in evidence(found, 0.01, 0).established] == established
    assert (found.posterior.remainder[0] > 0.5) == (established == ["a"])


def test_what_a_remainder_loses_does_not_count_for_a_name(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside a remainder that only harms, a name has to gain four as beside none."""
    sets = contested(30.0 + UNLIKELIER, -20.0, {"a": 12.0})
    left_out_scores(monkeypatch, {"": 0.0, "a": 20.0, "ab": 23.0}, {"a": -5.0})
    assert decided(monkeypatch, sets, {}, {}).posterior.remainder[0] > 0.5


@pytest.mark.parametrize(("ahead", "stays"), [(REACH - 0.1, False), (REACH + 0.1, True)])
def test_a_remainder_stays_where_names_are_far_less_probable(
    monkeypatch: pytest.MonkeyPatch, ahead: float, stays: bool
) -> None:
    beside = ahead - np.log(MORE)  # of the remainder beside the first name
    sets = contested(20.0 + UNLIKELIER, -20.0, {"a": beside})
    left_out_scores(monkeypatch, {"": 0.0, "a": 20.0, "ab": 90.0}, {"a": 1.0})
    assert (decided(monkeypatch, sets, {}, {}).posterior.remainder[0] > 0.5) == stays


def test_a_remainder_alone_gives_way_to_two_names_and_not_to_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """One name and a remainder alone have the same prior: their evidence decides."""
    left_out_scores(monkeypatch, {"": 0.0, "a": 30.0, "ab": 60.0}, {"": 5.0})
    one = decided(monkeypatch, explored({"a": 20.0}, smooth=21.0), {}, {})
    assert one.best is None and one.posterior.remainder[0] > 0.7
    two = decided(monkeypatch, contested(30.0, 31.0, {}), {}, {})
    assert names(two) == "ab" and two.posterior.remainder[0] < 0.1


def test_a_remainder_does_not_give_way_to_names_that_do_not_predict(monkeypatch: pytest.MonkeyPatch) -> None:
    sets = contested(30.0 + UNLIKELIER, -20.0, {"a": 12.0})
    left_out_scores(monkeypatch, {"": 0.0, "a": 20.0, "ab": 90.0}, {"a": 10.0})
    found = decided(monkeypatch, sets, {"ab": 3.9}, {})
    assert names(found) == "a" and found.posterior.remainder[0] > 0.5


def test_with_too_few_holds_to_leave_one_out_no_remainder_gives_way(monkeypatch: pytest.MonkeyPatch) -> None:
    sets = contested(30.0 + UNLIKELIER, -20.0, {"a": 12.0})
    left_out_scores(monkeypatch, {"": 0.0, "a": 20.0, "ab": 90.0}, {"a": None})
    assert decided(monkeypatch, sets, {}, {}).posterior.remainder[0] > 0.5


@pytest.mark.parametrize(("p", "remains"), [(0.031, False), (0.029, True)])
def test_what_fails_the_second_test_leaves_something_over(
    monkeypatch: pytest.MonkeyPatch, p: float, remains: bool
) -> None:
    """At .03 a remainder is as likely as none; the odds follow the density of p where more is missing."""
    found = decided(monkeypatch, explored({"a": 20.0}), {}, {"a": p})
    assert (found.posterior.remainder[0] > 0.5) == remains
    assert verdict_of(found) == ("partial" if remains else "named")
    odds = found.posterior.remainder[0] / (1.0 - found.posterior.remainder[0])
    assert odds == pytest.approx((0.03 / p) ** 0.8, rel=1e-3)


@pytest.mark.parametrize("p", [0.05, 0.3, 1.0])
def test_a_set_that_passes_the_second_test_may_leave_something_too(monkeypatch: pytest.MonkeyPatch, p: float) -> None:
    """Also where another one gave way to it: the larger its p, the less."""
    for sets, passing in (({"a": 20.0}, "a"), ({"a": 20.0, "b": 19.5}, "b")):
        found = decided(monkeypatch, explored(sets), {}, {"a": 0.01} | {passing: p})
        assert names(found) == passing
        assert found.posterior.remainder[0] == pytest.approx(1.0 / (1.0 + (p / 0.03) ** 0.8), rel=1e-3)


@pytest.mark.parametrize(("behind", "p", "best"), [(1.9, 0.5, "b"), (2.1, 0.5, "a"), (1.9, 0.02, "a")])
def test_a_set_that_leaves_something_over_gives_way_to_one_that_does_not(
    monkeypatch: pytest.MonkeyPatch, behind: float, p: float, best: str
) -> None:
    """If it is no more than two nats behind, and passes the test itself."""
    found = decided(monkeypatch, explored({"a": 20.0, "b": 20.0 - behind}), {}, {"a": 0.01, "b": p})
    assert names(found) == best
    assert verdict_of(found) == ("named" if best == "b" else "partial")


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
    assert list(found.gains) == [("b",)]


def test_a_set_known_by_refits_alone_keeps_its_weight(monkeypatch: pytest.MonkeyPatch) -> None:
    sets = explored({"a": 20.0, "b": 21.0})
    del sets.fitted[frozenset("b")]
    found = decided(monkeypatch, sets, {}, {})
    assert names(found) == "a" and found.posterior.inclusion["b"][0] > 0.7
    assert verdict_of(found) == "ambiguous"


def test_a_remainder_alone_needs_no_test(monkeypatch: pytest.MonkeyPatch) -> None:
    found = decided(monkeypatch, explored({"a": 3.0}, smooth=12.0), {}, {})
    assert found.best is None and verdict_of(found) == "unknown"


def test_a_remainder_in_question_is_tried_on_four_sets_at_most(monkeypatch: pytest.MonkeyPatch) -> None:
    """The best one and three others; the fifth would pass, and is not asked."""
    sets = {"a": 20.0, "b": 19.9, "c": 19.8, "d": 19.7, "e": 19.6}
    failing = dict.fromkeys("abcd", 0.01)
    assert names(decided(monkeypatch, explored(sets), {}, failing)) == "a"
    failing.pop("d")
    assert names(decided(monkeypatch, explored(sets), {}, failing)) == "d"


def test_sets_that_failed_the_second_test_lose_their_weight_to_the_one_that_passed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = decided(monkeypatch, explored({"a": 20.0, "b": 19.0, "c": 18.5}), {}, {"a": 0.01, "b": 0.02})
    assert names(found) == "c"
    assert set(found.posterior.inclusion) == {"c"} and verdict_of(found) == "named"


def test_nothing_left_to_add_passes_the_second_test() -> None:
    """No candidate is left that could be missing, so no simulation is needed."""
    whole = SimpleNamespace(probed=([], []), blocks=[None, None])
    found = retest.retested(whole, np.random.default_rng(0), map)  # type: ignore[arg-type]
    assert found == Retest(None, [[], []])
    assert not retest.fails(found)
    assert retest.fails(Retest(0.03, [[]])) and not retest.fails(Retest(0.0301, [[]]))


class Scored:
    """Fits that are their own left-out densities, by set."""

    def __init__(self, known: dict[str, list[list[float]]]) -> None:
        self.known = {frozenset(names): blocks for names, blocks in known.items()}

    def knows(self, key: frozenset[str]) -> bool:
        return key in self.known

    def of(self, key: frozenset[str]) -> list[list[float]]:
        return self.known[key]


def scored(monkeypatch: pytest.MonkeyPatch) -> LeftOut:
    monkeypatch.setattr(held_out, "truncated_leave_one_hold_out", lambda fit, rng: np.array(fit))
    return LeftOut(np.random.default_rng(0), map)


def test_the_gain_of_an_effect_is_against_the_set_without_it_where_it_acts(monkeypatch: pytest.MonkeyPatch) -> None:
    fits: Any = Scored({"a": [[5.0], [6.0, 6.0], [7.0]]})
    names = SimpleNamespace(key=frozenset("ab"), names=("a", "b"))
    accepted = (Accepted("a", (0, 1, 2), {}), Accepted("b", (1, 2), {}))
    best: Any = SimpleNamespace(effects=names, accepted=accepted, blocks=[[10.0], [20.0, 20.0], [30.0]])
    assert gains_module.name_gain(best, "b", fits, scored(monkeypatch)) == 28.0 + 23.0


def test_the_gain_of_a_family_is_that_of_the_mixture_over_its_members(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside the others of the set; the weights forget each hold, and a member of less than a twentieth has none."""
    sets = [EffectSet(tuple(names), 0.0, {}, None) for names in ("ab", "ac", "ad", "b", "e")]
    weights = np.array([0.6, 0.3, 0.02, 0.05, 0.03])
    found: Any = SimpleNamespace(weights={s.key: w for s, w in zip(sets, weights, strict=True)})
    fits: Any = Scored({"a": [[1.0, 2.0]], "ac": [[3.0, 1.0]], "ad": [[90.0, 90.0]], "b": [[9.0, 9.0]]})
    accepted = (Accepted("a", (0,), {}), Accepted("b", (0,), {}))
    best: Any = SimpleNamespace(effects=sets[0], accepted=accepted, blocks=[[2.0, 4.0]])
    gain = gains_module.family_gain(best, ("b", "c", "d"), found, fits, scored(monkeypatch))
    each = [0.9 / (0.6 / np.exp(one) + 0.3 / np.exp(other)) for one, other in ((2.0, 3.0), (4.0, 1.0))]
    assert gain == pytest.approx(np.log(each).sum() - 3.0)


def test_a_mixture_of_one_model_is_that_model_and_otherwise_between_the_two() -> None:
    elpd = np.array([[1.0, -2.0], [3.0, -9.0]])
    assert gains_module.mixed(np.zeros(1), elpd[:1]) == pytest.approx(elpd[0])
    found = gains_module.mixed(np.log([0.5, 0.5]), elpd)
    assert (found > elpd.min(axis=0)).all() and (found < elpd.max(axis=0)).all()


def test_a_family_whose_mixture_does_not_predict_takes_all_its_sets_along(monkeypatch: pytest.MonkeyPatch) -> None:
    """b and c are one family: where the mixture beside a gains nothing, neither is kept there."""
    sets = explored({"a": 10.0, "ab": 30.0, "ac": 29.0})
    found = decided(monkeypatch, sets, {"ab": 3.9}, {}, [("b", "c")])
    assert names(found) == "a" and not {"b", "c"} & set(found.posterior.inclusion)
    alone = decided(monkeypatch, sets, {"ab": 3.9}, {})
    assert names(alone) == "ac"


def test_look_alikes_are_established_together_though_none_of_them_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    sets = explored({"a": 20.0, "b": 19.8, "c": 5.0})
    found = decided(monkeypatch, sets, {}, {}, [("a", "b"), ("c",)])
    on_material = evidence(found, 0.01, 0)
    assert max(found.posterior.inclusion[n][0] for n in "ab") < 0.9
    assert on_material.families[0].members.keys() == {"a", "b"} and on_material.families[0].is_established
    assert verdict_on(on_material).verdict == "ambiguous" and verdict_on(on_material).undecided == ("a", "b")
    assert [a.name for a in accepted_effects(found, on_material, 0)] == ["a"]


def test_effects_are_accepted_in_the_materials_where_they_act(monkeypatch: pytest.MonkeyPatch) -> None:
    found = decided(monkeypatch, explored({"a": 30.0, "ab": 60.0}), {"ab": 20.0}, {})
    assert found.gains == {("a",): 20.0, ("b",): 20.0}
    assert [a.name for a in accepted_effects(found, evidence(found, 0.01, 0), 0)] == ["a", "b"]
    assert accepted_effects(found, evidence(found, 0.01, 0), 1) == []  # no effect acts in a second material
    none = decided(monkeypatch, explored({"a": 3.0}, smooth=12.0), {}, {})
    assert accepted_effects(none, evidence(none, 0.01, 0), 0) == []


def test_of_a_set_only_established_families_are_accepted(monkeypatch: pytest.MonkeyPatch) -> None:
    """The second effect is in the best set, but not beyond doubt."""
    found = decided(monkeypatch, explored({"a": 30.0, "ab": 31.0 + UNLIKELIER}), {}, {})
    assert names(found) == "ab"
    on_material = evidence(found, 0.01, 0)
    assert [a.name for a in accepted_effects(found, on_material, 0)] == ["a"] and verdict_on(
        on_material
    ).verdict == "named"


def test_too_few_holds_establish_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    sets = explored({"a": 30.0})
    few: Any = [SimpleNamespace(experiments=[SimpleNamespace(recorded_holds=range(2))])]
    monkeypatch.setattr(verdict, "retested", lambda *given: Retest(0.5, [[]]))
    rng = np.random.default_rng(0)
    settings = Settings(kinds=dict.fromkeys("abcdefghijklmnopqrst"))  # type: ignore[arg-type]
    found = decide(few, sets, [], settings, LeftOut(rng, map), rng, map)
    assert found.gains == {} and verdict_of(found) == "unknown"


def alternative_models(weights: dict[str, float]) -> tuple[Any, Any, Any]:
    """A decision between sets of one material, fits of them, and the fit of one as the final model."""
    sets = [EffectSet(tuple(n), 0.0, dict.fromkeys(n, ONE), None) for n in weights]
    space = SimpleNamespace(sets=sets, weights={s.key: w for s, w in zip(sets, weights.values(), strict=True)})

    def final(names: str) -> Any:
        return SimpleNamespace(effects=[SimpleNamespace(name=n, key=n) for n in names])

    fits = Scored({n: [final(n)] for n in weights})
    return SimpleNamespace(posterior=space), fits, final


@pytest.mark.parametrize(("last", "kept"), [(0.012, "bacdef"), (0.008, "bacde")])
def test_undecided_models_beside_the_final_one_hold_nearly_all_of_its_probability(last: float, kept: str) -> None:
    decision, fits, final = alternative_models({"a": 0.5, "b": 0.2 - last, "c": 0.17, "d": 0.1, "e": 0.03, "f": last})
    found = alternatives.alternatives(decision, fits, 0, final("b"), "abcdef", False)
    assert [a.block.effects[0].key for a in found] == list(kept)
    assert sum(a.probability for a in found) == pytest.approx(1.0)
    total = 1.0 if "f" in kept else 1.0 - last
    assert found[1].probability == pytest.approx(0.5 / total) and not found[1].remains


def test_models_that_differ_elsewhere_are_not_sampled_beside_it() -> None:
    decision, fits, final = alternative_models({"a": 0.005, "b": 0.9, "c": 0.095, "bd": 0.5})
    found = alternatives.alternatives(decision, fits, 0, final("b"), "abc", True)
    assert [a.block.effects[0].key for a in found] == ["b", "c"] and all(a.remains for a in found)
    assert alternatives.alternatives(decision, fits, 0, final("b"), "ab", False) == []


def test_an_effect_that_gains_exactly_four_does_not_predict(monkeypatch: pytest.MonkeyPatch) -> None:
    assert names(decided(monkeypatch, explored({"a": 10.0, "ab": 30.0}), {"ab": 4.0}, {})) == "a"
    # the only effect need not predict
    assert names(decided(monkeypatch, explored({"a": 10.0}), {"a": -9.0}, {})) == "a"


def retested(monkeypatch: pytest.MonkeyPatch, p: float, *enough: Any) -> tuple[Any, list[Any], Any]:
    """The second test of a set on two blocks, where p is as given, its blocks, and what was simulated."""
    blocks: Any = [
        SimpleNamespace(target=SimpleNamespace(problem=f"p{b}"), z=np.array([[b]]), names=[f"n{b}", "m"])
        for b in range(2)
    ]
    asked: list[Any] = []

    def simulated(block: Any, trials: Any, n: int, rng: Any) -> Any:
        assert trials == ["t1", "t2"]
        asked.append((block, n))
        return SimpleNamespace(scan=f"{n} null of {block.target.problem}")

    def joined(parts: Any) -> Any:
        return SimpleNamespace(scan=" and ".join(part.scan for part in parts))

    def findings(listed: Any, first: int, data: Any, null: Any, where: str) -> Any:
        return [listed, first, data, null, where]

    def tested(candidates: Any, data: Any, nulls: Any) -> Any:
        assert candidates == ["candidate"] and [null[-2:] for null in nulls] == ["p0", "p1"]
        assert data == [("p0", 0, "p0 columns"), ("p1", 1, "p1 columns")]
        return SimpleNamespace(p=p, null=np.zeros(100 if len(asked) == 4 else 200))

    def expand(target: Any, z: Any, trials: Any, columns: Any) -> Any:
        assert trials == ["t1", "t2"] and z.shape == (1, 1)
        return target.problem, z[0, 0], columns

    monkeypatch.setattr(global_test, "simulated_with_patterns", simulated)
    monkeypatch.setattr(global_test.screening, "joined_replicates", joined)
    monkeypatch.setattr(retest.residual_patterns, "patterns", lambda problem: (f"{problem} list", f"{problem} columns"))
    monkeypatch.setattr(retest.residual_patterns, "findings", findings)
    monkeypatch.setattr(retest.screening, "global_test", tested)
    monkeypatch.setattr(retest, "expand", expand)
    monkeypatch.setattr(retest, "scan", lambda x: x)
    best: Any = SimpleNamespace(blocks=blocks, probed=(["t1", "t2"], ["candidate"]))
    return blocks, asked, retest.retested(best, np.random.default_rng(0), map, *enough)


def test_the_second_test_has_the_effects_of_the_set_inside(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every block simulated with its probes and its patterns; their scans are what p and the findings come from."""
    blocks, asked, found = retested(monkeypatch, 0.3)
    assert asked == [(block, 75) for block in blocks for _ in range(2)] and found.p == 0.3
    assert found.where == [
        [f"p{b} list", 2, (f"p{b}", b, f"p{b} columns"), f"75 null of p{b} and 75 null of p{b}", f"n{b}, m"]
        for b in range(2)
    ]


@pytest.mark.parametrize(("larger", "decides"), [(0, False), (9, False), (10, True), (60, True)])
def test_the_second_test_takes_half_of_its_simulations_where_p_is_clearly_above_its_level(
    larger: int, decides: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With p on the level, three of a hundred are as surprising on average, and ten or more once in 1,144 times."""
    _, asked, found = retested(monkeypatch, (1 + larger) / 101)
    sizes = [n for _, n in asked]
    assert sizes == [75] * 4 if decides else sizes == [75] * 4 + [75, 74] * 2
    assert all(("and 74" in item[3]) != decides for item in found.where)


@pytest.mark.parametrize(("larger", "decides"), [(0, True), (1, False), (9, False), (10, True)])
def test_where_only_the_side_of_the_level_counts_no_simulation_as_surprising_decides_too(
    larger: int, decides: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, asked, _ = retested(monkeypatch, (1 + larger) / 101, retest._is_decided)
    assert (len(asked) == 4) == decides


def test_of_a_set_that_may_replace_the_best_one_only_the_side_of_the_level_counts(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked = []

    def fails_both(best: Any, rng: Any, parallel_map: Any, *enough: Any) -> Retest:
        asked.append((best.effects.names, enough))
        return Retest(0.01, [[]])

    sets = explored({"a": 20.0, "b": 19.0})
    found = decided(monkeypatch, sets, {}, {})
    monkeypatch.setattr(retest, "retested", fails_both)
    best = sets.fitted[found.best.effects.key]  # type: ignore[union-attr]
    assert retest.complete(found.posterior, sets, best, lambda one: True, np.random.default_rng(0), map) is None
    assert asked == [(("b",), (retest._is_decided,))]


def test_a_remainder_that_fails_the_test_may_leave_no_effect(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the smooth curve does not need the name, the remainder alone becomes the most probable."""
    sets = explored({"a": 20.0}, smooth=19.0)
    found = decided(monkeypatch, sets, {}, {"a": 1e-6})
    assert found.best is None and found.retest is not None and found.retest.p == 1e-6 and found.gains == {}
    assert verdict_of(found) == "unknown"


def test_where_every_set_fails_to_predict_the_remainder_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    found = decided(monkeypatch, explored({"ab": 30.0, "ac": 29.0}), {"ab": 1.0, "ac": 1.0}, {})
    assert found.best is None and found.retest is None and found.posterior.best.names == ()


def test_of_sets_that_were_fitted_the_most_probable_one_stands_for_the_best(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a chain of refits is all that is known of that; in whatever order they come."""
    for values in ({"a": 20.0, "b": 21.0, "c": 19.0}, {"c": 19.0, "a": 20.0, "b": 21.0}):
        sets = explored(values)
        del sets.fitted[frozenset("b")]
        assert names(decided(monkeypatch, sets, {}, {})) == "a"
    sets.fitted.clear()
    found = decided(monkeypatch, sets, {}, {})
    assert found.best is None and found.posterior.best.names == ("b",)
