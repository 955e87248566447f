"""From weighed sets to a decision: the guard of further effects and the second test, each at its threshold."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from wirebayes.discovery import global_test, held_out, verdict
from wirebayes.discovery.held_out import LeftOut
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
    rng = np.random.default_rng(0)
    return decide([SimpleNamespace()], sets, {}, settings, LeftOut(rng, map), rng, map)  # type: ignore[list-item]


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
    """At .03 a remainder is as likely as none; the odds follow the density of p where more is missing."""
    found = decided(monkeypatch, explored({"a": 20.0}), {}, {"a": p})
    assert (found.posterior.remainder[0] > 0.5) == remains
    assert verdict_of(found, 0)[0] == ("partial" if remains else "named")
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
    assert set(found.posterior.inclusion) == {"c"} and verdict_of(found, 0)[0] == "named"


def test_nothing_left_to_add_passes_the_second_test() -> None:
    """No candidate is left that could be missing, so no simulation is needed."""
    whole = SimpleNamespace(probed=([], []), blocks=[None, None])
    found = verdict._retested(whole, np.random.default_rng(0), map)  # type: ignore[arg-type]
    assert found == Retest(None, [[], []])
    assert not verdict._fails(found)
    assert verdict._fails(Retest(0.03, [[]])) and not verdict._fails(Retest(0.0301, [[]]))


@pytest.mark.parametrize("before", [True, False])
def test_the_gain_of_an_effect_is_against_the_model_without_it(before: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the set without it was fitted, against that, else against the plain model; in its own materials alone."""
    monkeypatch.setattr(held_out, "truncated_leave_one_hold_out", lambda fit, rng: np.array(fit))
    plain = [[1.0], [2.0, 2.0], [3.0]]
    sets = explored({"a": 1.0, "ab": 2.0})
    sets.fitted[frozenset("a")].blocks[:] = [[5.0], [6.0, 6.0], [7.0]]
    best = sets.fitted[frozenset("ab")]
    best.blocks[:] = [[10.0], [20.0, 20.0], [30.0]]
    best.accepted = (best.accepted[0], Accepted("b", (1, 2), {}))  # type: ignore[misc]
    if not before:
        del sets.fitted[frozenset("a")]
    found = verdict._gain(plain, best, sets, LeftOut(np.random.default_rng(0), map))  # type: ignore[arg-type]
    assert found.tolist() == ([0.0, 28.0, 23.0] if before else [0.0, 36.0, 27.0])


@pytest.mark.parametrize(("names_", "gain"), [("a", 4.0), ("abc", 20.0)])
def test_the_first_effect_gains_over_the_plain_model_the_third_over_two(
    names_: str, gain: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(held_out, "truncated_leave_one_hold_out", lambda fit, rng: np.array(fit))
    sets = explored({"a": 1.0, "ab": 2.0, "abc": 3.0})
    for set_, elpd in (("a", 5.0), ("ab", 10.0), ("abc", 30.0)):
        sets.fitted[frozenset(set_)].blocks[:] = [[elpd]]  # type: ignore[list-item]
    best = sets.fitted[frozenset(names_)]
    left_out = LeftOut(np.random.default_rng(0), map)
    assert verdict._gain([[1.0]], best, sets, left_out).tolist() == [gain]  # type: ignore[list-item]


def test_effects_are_established_in_the_materials_where_they_act(monkeypatch: pytest.MonkeyPatch) -> None:
    found = decided(monkeypatch, explored({"a": 30.0, "ab": 60.0}), {"ab": 20.0}, {})
    assert [a.name for a in verdict.established(found, 0)] == ["a", "b"]
    assert verdict.established(found, 1) == []  # no effect acts in a second material
    assert found.gains.keys() == {"a", "b"} and found.gains["b"].tolist() == [20.0]
    none = decided(monkeypatch, explored({"a": 3.0}, smooth=12.0), {}, {})
    assert verdict.established(none, 0) == []


def test_the_chain_of_sets_is_reported_effect_by_effect(monkeypatch: pytest.MonkeyPatch) -> None:
    """A step whose set was never fitted has no gain of its own."""
    sets = explored({"a": 20.0, "ab": 40.0, "abc": 60.0})
    del sets.fitted[frozenset("ab")]
    assert list(decided(monkeypatch, sets, {}, {}).gains) == ["a", "c"]


def test_more_models_than_three_beside_the_final_one_are_not_listed() -> None:
    from wirebayes.discovery.verdict import alternatives

    letters = "abcdef"
    sets = [EffectSet((n,), 0.0, {}, None) for n in letters]
    block = {n: SimpleNamespace(effects=[SimpleNamespace(key=n)]) for n in letters}
    chances = [0.3, 0.2, 0.17, 0.13, 0.11, 0.09]
    space = SimpleNamespace(sets=sets, without=chances, beside=[0.0] * 6)
    known = SimpleNamespace(fitted={s.key: SimpleNamespace(blocks=[block[s.names[0]]]) for s in sets})
    given = SimpleNamespace(posterior=space), known, 0, block["b"]
    found = alternatives(*given, "named")  # type: ignore[arg-type]
    assert [a.block.effects[0].key for a in found] == ["b", "a", "c", "d"]
    assert sum(a.probability for a in found) == pytest.approx(1.0)
    assert found[1].probability == pytest.approx(0.3 / 0.8)
    space.without = [0.04, 0.9, 0.03, 0.03, 0.0, 0.0]  # improbable ones are not sampled beside it
    assert alternatives(*given, "named") == []  # type: ignore[arg-type]
    space.without = [0.05, 0.9, 0.03, 0.02, 0.0, 0.0]
    assert len(alternatives(*given, "named")) == 2  # type: ignore[arg-type]
    space.without = [0.0] * 6
    assert alternatives(*given, "named") == []  # type: ignore[arg-type]


def stood(inclusion: float = 1.0, gain: float = 50.0, remainder: float = 0.0, nothing: float = 0.0, **more: Any) -> Any:
    """A decision for one effect in the first of two materials."""
    found = SimpleNamespace(
        shares=[more.get("shares", {"a": 1.0}), {"a": 1.0}], inclusion={"a": np.full(2, inclusion)},
        remainder=np.full(2, remainder), nothing=np.full(2, nothing),
    )  # fmt: skip
    best = SimpleNamespace(accepted=(Accepted("a", (0,), {}),))
    return verdict.Decision(found, best, None, {"a": np.array([gain, 0.0])})  # type: ignore[arg-type]


def test_at_a_threshold_exactly() -> None:
    """Nine tenths establish, a gain of four does not; with even odds nothing is said to be missing or to remain."""
    assert len(verdict.established(stood(inclusion=0.9), 0)) == 1 and not verdict.established(
        stood(inclusion=0.8999), 0
    )
    assert not verdict.established(stood(gain=4.0), 0) and len(verdict.established(stood(gain=4.0001), 0)) == 1
    assert verdict_of(stood(nothing=0.5), 0)[0] == "named"
    assert verdict_of(stood(remainder=0.5), 0)[0] == "named" and verdict_of(stood(remainder=0.5001), 0)[0] == "partial"
    assert verdict_of(stood(shares={}), 0) == ("nothing-missing", [])
    assert verdict_of(stood(), 1) == ("unknown", [])  # the only effect acts in the other material
    assert verdict_of(stood(remainder=0.9), 1) == ("unknown", [])


def test_an_effect_that_gains_exactly_four_does_not_predict(monkeypatch: pytest.MonkeyPatch) -> None:
    assert names(decided(monkeypatch, explored({"a": 10.0, "ab": 30.0}), {"ab": 4.0}, {})) == "a"
    # the only effect need not predict
    assert names(decided(monkeypatch, explored({"a": 10.0}), {"a": -9.0}, {})) == "a"


def retested(monkeypatch: pytest.MonkeyPatch, p: float) -> tuple[Any, list[Any], Any]:
    """The second test of a set on two blocks, where p is as given, its blocks, and what was simulated."""
    blocks: Any = [
        SimpleNamespace(target=SimpleNamespace(problem=f"p{b}"), modes=SimpleNamespace(z=np.array([[b], [9]])),
                        names=[f"n{b}", "m"])
        for b in range(2)
    ]  # fmt: skip
    asked: list[Any] = []

    def simulated(block: Any, trials: Any, n: int, rng: Any) -> Any:
        asked.append((block, trials, n))
        return SimpleNamespace(scan=f"{n} null of {block.target.problem}")

    def joined(parts: Any) -> Any:
        return SimpleNamespace(scan=" and ".join(part.scan for part in parts))

    def findings(listed: Any, first: int, data: Any, null: Any, where: str) -> Any:
        return [listed, first, data, null, where]

    def tested(candidates: Any, data: Any, nulls: Any) -> Any:
        assert candidates == ["candidate"] and [null[-2:] for null in nulls] == ["p0", "p1"]
        assert data == [("p0", 0, "p0 columns"), ("p1", 1, "p1 columns")]
        return SimpleNamespace(p=p, null=np.zeros(100 if len(asked) == 2 else 200))

    def expand(target: Any, z: Any, trials: Any, columns: Any) -> Any:
        assert trials == ["t1", "t2"] and z.shape == (1, 1)
        return target.problem, z[0, 0], columns

    monkeypatch.setattr(global_test, "simulated_with_patterns", simulated)
    monkeypatch.setattr(global_test.screening, "joined_replicates", joined)
    monkeypatch.setattr(
        verdict.residual_patterns, "patterns", lambda problem: (f"{problem} list", f"{problem} columns")
    )
    monkeypatch.setattr(verdict.residual_patterns, "findings", findings)
    monkeypatch.setattr(verdict.screening, "global_test", tested)
    monkeypatch.setattr(verdict, "expand", expand)
    monkeypatch.setattr(verdict, "scan", lambda x: x)
    best: Any = SimpleNamespace(blocks=blocks, probed=(["t1", "t2"], ["candidate"]))
    return blocks, asked, verdict._retested(best, np.random.default_rng(0), map)


def test_the_second_test_has_the_effects_of_the_set_inside(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every block simulated with its probes and its patterns; their scans are what p and the findings come from."""
    blocks, asked, found = retested(monkeypatch, 0.3)
    assert asked == [(block, ["t1", "t2"], 150) for block in blocks] and found.p == 0.3
    assert found.where == [
        [f"p{b} list", 2, (f"p{b}", b, f"p{b} columns"), f"150 null of p{b}", f"n{b}, m"] for b in range(2)
    ]  # fmt: skip


@pytest.mark.parametrize(("larger", "decides"), [(0, False), (9, False), (10, True), (60, True)])
def test_the_second_test_takes_half_of_its_simulations_where_p_is_clearly_above_its_level(
    larger: int, decides: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With p on the level, three of a hundred are as surprising on average, and ten or more once in 1,144 times."""
    _, asked, found = retested(monkeypatch, (1 + larger) / 101)
    assert [n for _, _, n in asked] == ([150, 150] if decides else [150, 150, 149, 149])
    assert all(item[3].startswith("150 null") == decides or "and 149" in item[3] for item in found.where)


def test_a_remainder_that_fails_the_test_may_leave_no_effect(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the smooth curve does not need the name, the remainder alone becomes the most probable."""
    sets = explored({"a": 20.0}, smooth=19.0)
    found = decided(monkeypatch, sets, {}, {"a": 1e-6})
    assert found.best is None and found.retest is not None and found.retest.p == 1e-6 and found.gains == {}
    assert verdict_of(found, 0) == ("unknown", [])


def test_where_every_set_fails_to_predict_the_remainder_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    found = decided(monkeypatch, explored({"ab": 30.0, "ac": 29.0}), {"ab": 1.0, "ac": 1.0}, {})
    assert found.best is None and found.retest is None and found.posterior.best.names == ()


def alternative_models(**weights: tuple[float, float]) -> tuple[Any, Any, dict[str, Any]]:
    sets = [EffectSet(tuple(names), 0.0, {}, np.zeros(1) if names == "b" else None) for names in weights]
    block = {n: SimpleNamespace(effects=[SimpleNamespace(key=key) for key in n]) for n in weights}
    space: Any = SimpleNamespace(
        sets=sets, without=[w[0] for w in weights.values()], beside=[w[1] for w in weights.values()]
    )
    known: Any = SimpleNamespace(fitted={s.key: SimpleNamespace(blocks=[None, block["".join(s.names)]]) for s in sets})
    return SimpleNamespace(posterior=space), known, block


def test_a_remainder_that_is_in_another_material_does_not_remain_here() -> None:
    """Of the weight beside b as much as the remainder is probable in this material: a half, alone, of even odds."""
    decision, known, block = alternative_models(a=(0.4, 0.0), b=(0.2, 0.4))
    known.fitted[frozenset("b")].effects = None
    subsets = {"b": 0.25}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(verdict, "over_subsets", lambda remainder: (0.0, np.array([9.0, subsets["b"]]), []))
        found = verdict.alternatives(decision, known, 1, block["a"], "named")
    shares = [(a.block.effects[0].key, a.remains, a.probability) for a in found]
    assert [s[:2] for s in shares] == [("a", False), ("b", False), ("b", True)]
    assert [s[2] for s in shares] == pytest.approx([0.4, 0.2 + 0.4 * 0.75, 0.4 * 0.25])


def test_sets_that_are_one_model_in_this_material_add_up_and_the_final_one_may_be_none_of_them() -> None:
    decision, known, block = alternative_models(ab=(0.3, 0.0), ba=(0.2, 0.0), c=(0.5, 0.0))
    known.fitted[frozenset("ab")].blocks[1] = block["ab"]
    found = verdict.alternatives(decision, known, 1, block["c"], "named")
    assert [round(a.probability, 9) for a in found] == [0.5, 0.5]
    other: Any = SimpleNamespace(effects=[SimpleNamespace(key="z")])
    found = verdict.alternatives(decision, known, 1, other, "named")
    assert found[0].block is other and found[0].probability == 0.0 and not found[0].remains


def test_of_sets_that_were_fitted_the_most_probable_one_stands_for_the_best(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a chain of refits is all that is known of that; in whatever order they come."""
    for values in ({"a": 20.0, "b": 21.0, "c": 19.0}, {"c": 19.0, "a": 20.0, "b": 21.0}):
        sets = explored(values)
        del sets.fitted[frozenset("b")]
        assert names(decided(monkeypatch, sets, {}, {})) == "a"
    sets.fitted.clear()
    found = decided(monkeypatch, sets, {}, {})
    assert found.best is None and found.posterior.best.names == ("b",)
