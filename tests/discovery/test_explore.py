"""Which sets the search fits: by promise, a few at once, and no more than it says."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from wirebayes.discovery import fitted_sets, stepwise
from wirebayes.discovery.model_space import EffectSet, log_prior
from wirebayes.discovery.name_evidence import NameEvidence
from wirebayes.discovery.settings import FALLS_SHORT, LEFT_OVER, MORE, MOST_EFFECTS, MOST_LOOKS, REACH, Settings

NAMES = 20
ONE = np.ones(1)
PAIR = log_prior(2, NAMES)  # by which a set of two is less likely beforehand than one of one


def evidence(values: dict[str, float]) -> NameEvidence:
    refits = {name: [SimpleNamespace(effect=SimpleNamespace(key=name), blocks=(0,), sd=1.0)] for name in values}
    return NameEvidence(values, refits, dict.fromkeys(values, ONE))  # type: ignore[arg-type]


def explored(
    monkeypatch: pytest.MonkeyPatch,
    singles: dict[str, float],
    further: dict[str, dict[str, float]] | None = None,
    smooth: float = -20.0,
    credits: dict[str, float] | None = None,
    remainders: dict[str, float] | None = None,
    families: tuple[tuple[str, ...], ...] = (),
    own_fits: dict[str, float] | None = None,
    pair: str = "",
) -> tuple[stepwise.Explored, list[str]]:
    """What the search makes of sets whose evidence is written down, and the order in which it fitted them."""
    order: list[str] = []

    def fit(parent: Any, name: str, *others: Any, **common: Any) -> stepwise.FittedSet:
        names = (*parent.effects.names, name)
        order.append("".join(sorted(names)))
        left = np.array([(remainders or {}).get(order[-1], -20.0)])
        more = (further or {}).get(order[-1])
        found = None if more is None else evidence(more)
        block: Any = SimpleNamespace(log_evidence=(own_fits or {}).get(order[-1], np.inf))
        return stepwise.FittedSet(EffectSet(names, 0.0, {}, left), [block], (), found, ([], [], []))

    monkeypatch.setattr(stepwise, "_fit", fit)
    known = {name: np.array([value]) for name, value in (credits or {}).items()}
    monkeypatch.setattr(stepwise, "_credits", lambda expansions, trials: known)
    monkeypatch.setattr(stepwise, "_leading_pair", lambda expansions, trials: frozenset(pair))
    monkeypatch.setattr(stepwise, "reference_of", lambda block: None)
    monkeypatch.setattr(stepwise, "remainder_evidence", lambda block, reference: smooth)
    settings = Settings(kinds=dict.fromkeys(range(NAMES)))  # type: ignore[arg-type]
    plain: Any = SimpleNamespace(log_evidence=0.0)
    found = stepwise.explore([plain], evidence(singles), [], [], families, settings, np.random.default_rng(0), map)
    return found, order


def test_the_three_most_promising_names_are_fitted_first_then_two_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    singles = {name: 20.0 - 0.1 * k for k, name in enumerate("abcdefghij")}
    found, order = explored(monkeypatch, singles)
    assert "".join(order) == "abcdefg" and len(order) == MOST_LOOKS == 7
    assert [s.names for s in found.sets][0] == () and len(found.sets) == 11  # the others keep their evidence


def test_each_combination_of_families_is_looked_at_before_look_alikes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Seven look-alikes would use up all looks; what only shows beside one of them would never be met."""
    singles = {name: 20.0 - 0.1 * k for k, name in enumerate("abcdefghij")}
    found, order = explored(monkeypatch, singles, families=(tuple("abcdefgh"),))
    assert order == ["a", "i", "j", "b", "c", "d", "e"]
    beside, _ = explored(monkeypatch, singles, {"a": {"z": 6.0}}, families=(tuple("abcdefgh"),))
    assert frozenset("az") in beside.fitted


def test_two_effects_that_only_show_together_are_fitted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Alone neither comes near the best: the better one is fitted first, and then both."""
    singles = {"a": 20.0, "b": 19.0, "y": 1.0, "z": 0.5}
    beside = {"y": {"z": 10.0}}
    assert explored(monkeypatch, singles, beside)[1] == ["a", "b"]
    found, order = explored(monkeypatch, singles, beside, pair="yz")
    assert order == ["y", "a", "b", "yz"]
    assert found.fitted[frozenset("yz")].effects.log_bayes == 11.0
    # one of which no climb ended, and one that finds nothing beside it, lead nowhere
    assert explored(monkeypatch, singles, beside, pair="xz")[1] == ["z", "a", "b"]


def test_what_lies_too_far_below_the_best_is_not_fitted(monkeypatch: pytest.MonkeyPatch) -> None:
    assert explored(monkeypatch, {"a": 20.0, "b": 20.1 - REACH, "c": 19.9 - REACH})[1] == ["a", "b"]


def test_the_best_set_is_fitted_though_all_looks_are_spent(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each fit finds a still better set of one effect more; four effects are the most."""
    chain = {"a": {"b": 15.0}, "ab": {"c": 15.0}, "abc": {"d": 15.0}, "abcd": {"e": 15.0}}
    singles = dict.fromkeys("a", 20.0)
    found, order = explored(monkeypatch, singles, chain)
    assert order == ["a", "ab", "abc", "abcd"] and MOST_EFFECTS == 4
    assert found.fitted[frozenset("abc")].effects.log_bayes == 50.0
    many = {name: 20.0 - 0.01 * k for k, name in enumerate("abcdefg")}
    last = {"g": {"h": 15.0}}  # the seventh look finds the best set of all
    assert explored(monkeypatch, many, last)[1][-1] == "gh"


def test_an_effect_that_explains_nothing_more_makes_no_set(monkeypatch: pytest.MonkeyPatch) -> None:
    found, _ = explored(monkeypatch, {"a": 20.0}, {"a": {"b": 0.1, "c": 0.0, "d": -1.0}})
    assert [set(s.names) for s in found.sets] == [set(), {"a"}, {"a", "b"}]
    assert [s.log_bayes for s in found.sets] == [0.0, 20.0, 20.1]


def test_a_set_keeps_the_better_of_two_chains(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two orders of the same names, whose refits found different evidence."""
    found, _ = explored(monkeypatch, {"a": 10.0, "b": 10.0}, {"a": {"b": 2.5}, "b": {"a": 3.0}})
    (pair,) = [s for s in found.sets if len(s.names) == 2]
    assert pair.log_bayes == 13.0 and pair.names == ("b", "a")


@pytest.mark.parametrize(("short", "expected"), [(FALLS_SHORT - 0.1, 35.0), (FALLS_SHORT + 0.1, 32.9)])
def test_what_a_fit_falls_short_of_is_no_evidence_for_the_next_effect(
    monkeypatch: pytest.MonkeyPatch, short: float, expected: float
) -> None:
    """At a kink of its density the fit with a may have less evidence than a's refits found; b beside it has more."""
    found, _ = explored(monkeypatch, {"a": 20.0}, {"a": {"b": 15.0}}, own_fits={"a": 20.0 - short})
    (pair,) = [s for s in found.sets if len(s.names) == 2]
    assert pair.log_bayes == pytest.approx(expected)


@pytest.mark.parametrize(("ahead", "names"), [(0.29, "ab"), (0.31, "ba")])
def test_of_two_orders_with_one_evidence_the_weaker_effect_comes_last(
    monkeypatch: pytest.MonkeyPatch, ahead: float, names: str
) -> None:
    """It has to predict holds that are left out; which order the search met first is chance."""
    beside = {"a": {"b": 13.0}, "b": {"a": 14.0 + ahead}}
    found, _ = explored(monkeypatch, {"a": 11.0, "b": 10.0}, beside)
    (pair,) = [s for s in found.sets if len(s.names) == 2]
    assert pair.names == tuple(names)


def test_a_set_that_is_good_beside_a_remainder_is_fitted_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """Alone b is hopeless; beside a remainder, which has a tenth of the weight of none, it may come to 24.7 nats."""
    promised = {"a": -30.0, "b": 22.0}
    order = explored(monkeypatch, {"a": 24.0, "b": 1.0}, smooth=5.0, credits=promised)[1]
    assert order == ["b", "a"]
    assert explored(monkeypatch, {"a": 24.0, "b": 1.0}, smooth=5.0, credits={"a": -30.0, "b": 14.0})[1] == ["a"]


def test_the_promise_of_a_fitted_set_is_what_its_fit_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """With b fitted, its remainder is known to be small, so that c, six nats below the best name, is within reach."""
    singles, promised = {"a": 24.0, "b": 1.0, "c": 20.5}, {"a": -30.0, "b": 40.0, "c": -30.0}
    order = explored(monkeypatch, singles, smooth=5.0, credits=promised)[1]
    assert order == ["b", "a", "c"]


def test_what_further_effects_explain_may_be_a_remainder_that_is_not_smooth(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is a tenth as likely as one further effect, and explains no more than its bound."""
    for value in (5.0, 20.0):
        found, _ = explored(monkeypatch, {"a": 20.0, "b": 18.0}, {"a": {"c": value, "d": 1.0}})
        # the remainder's weight of a half comes on top
        assert found.left_over == {frozenset("a"): pytest.approx(np.log(0.1 / MORE) + PAIR + min(value, LEFT_OVER))}


def test_a_step_back_finds_a_set_whose_names_are_little_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Alone a is the best name by far; beside c, which came last, b explains more than a and b together."""
    singles, chain = {"a": 20.0, "b": 8.0, "c": 7.0}, {"a": {"b": 12.0}, "ab": {"c": 12.0}, "b": {"c": 35.0}}
    found, order = explored(monkeypatch, singles, chain)
    assert order == ["a", "ab", "abc", "b", "bc"]
    assert found.fitted[frozenset("bc")].effects.log_bayes == 43.0


def test_a_look_alike_is_tried_in_the_place_of_one_of_the_best_set(monkeypatch: pytest.MonkeyPatch) -> None:
    """By itself x explains little, and a, which it resembles, much; beside b it is the better one.

    On the way the set of a and b is met in the other order, with more evidence, though it has been fitted.
    """
    singles, chain = {"a": 20.0, "b": 8.0, "x": 7.0}, {"a": {"b": 12.0}, "b": {"a": 25.0, "x": 30.0}}
    found, order = explored(monkeypatch, singles, chain, families=(("a", "x"),))
    assert order == ["a", "ab", "b", "bx"]
    assert found.fitted[frozenset("bx")].effects.log_bayes == 38.0
    assert found.fitted[frozenset("ab")].effects.log_bayes == 33.0
    assert [s.log_bayes for s in found.sets if s.key == frozenset("ab")] == [33.0]
    assert explored(monkeypatch, singles, chain)[1] == ["a", "ab"]


def test_a_step_back_goes_no_way_that_was_gone_before(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside b, c was found to explain nothing, so the set of both is not looked for again."""
    singles, chain = {"a": 20.0, "b": 19.0, "c": 7.0}, {"a": {"b": 12.0}, "ab": {"c": 12.0}, "b": {"d": 1.0}}
    assert explored(monkeypatch, singles, chain)[1] == ["a", "b", "ab", "abc"]


def test_credit_beside_a_remainder_is_that_of_the_best_form(monkeypatch: pytest.MonkeyPatch) -> None:
    from wirebayes.discovery.refit import occam

    values = {"x": np.array([1.0, 5.0, 3.0, 9.0]), "y": np.array([4.0, 2.0, 0.0, 9.0])}
    monkeypatch.setattr(stepwise, "beside_smooth", lambda x: values[x])
    trials: Any = [SimpleNamespace(effect=SimpleNamespace(name=n), one_sided=n == "a") for n in "aab"]
    found = stepwise._credits(["x", "y"], trials)  # type: ignore[list-item]
    assert found["a"] == pytest.approx(np.array([5.0, 4.0]) + occam(True))
    assert found["b"] == pytest.approx(np.array([3.0, 0.0]) + occam(False))


def test_when_all_looks_are_spent_the_best_set_alone_is_fitted(monkeypatch: pytest.MonkeyPatch) -> None:
    """The seventh look finds two sets better than all before; the second of them is not looked at."""
    many = {name: 20.0 - 0.01 * k for k, name in enumerate("abcdefg")}
    found, order = explored(monkeypatch, many, {"g": {"h": 15.0, "i": 14.5}})
    assert order == [*"abcdefg", "gh"]
    assert {frozenset("gh"), frozenset("gi")} <= {s.key for s in found.sets} and frozenset("gi") not in found.fitted


def test_without_a_single_name_there_is_the_plain_model_with_its_remainder(monkeypatch: pytest.MonkeyPatch) -> None:
    found, order = explored(monkeypatch, {}, smooth=3.0)
    assert order == [] and found.fitted == {} and found.left_over == {}
    assert [(s.names, s.log_bayes, s.remainder) for s in found.sets] == [((), 0.0, np.array([3.0]))]


def test_a_fitted_set_keeps_its_evidence_and_has_the_remainder_of_its_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    found, _ = explored(monkeypatch, {"a": 20.0, "b": 3.0}, {"a": {"b": 2.2}}, remainders={"a": 4.0, "ab": -1.0})
    by_key = {s.key: s for s in found.sets}
    assert list(found.fitted) == [frozenset("a")] and by_key[frozenset("a")] is found.fitted[frozenset("a")].effects
    assert by_key[frozenset("a")].remainder == 4.0 and by_key[frozenset("a")].log_bayes == 20.0
    pair = by_key[frozenset("ab")]
    assert pair.remainder is None and pair.log_bayes == 22.2 and set(pair.presence) == {"a", "b"}


class Fits:
    """What `stepwise._fit` does with two blocks, one effect shared by them or in one alone, instead of fitting them."""

    def __init__(
        self,
        monkeypatch: pytest.MonkeyPatch,
        *,
        scanned: float = 0.0,
        tried: dict[str, float] | None = None,
        refitted: dict[str, float] | None = None,
        on: tuple[int, ...] = (0, 1),
        shared: bool = False,
    ) -> None:
        self.did: list[Any] = []
        self.blocks: Any = [
            SimpleNamespace(
                experiments=f"e{b}",
                effects=(f"old{b}",),
                target=b,
                z=np.ones((1, 1)),
                scales="scales",
            )
            for b in range(2)
        ]
        places = [on] * len(on) if shared else [(b,) for b in on]
        refits = {
            b: SimpleNamespace(effect="new", blocks=place, theta=[np.array([10.0 * c]) for c in place])
            for b, place in zip(on, places, strict=True)
        }
        self.evidence = None if refitted is None else evidence(refitted)
        further = SimpleNamespace(amplitudes=lambda name: refits, reach={}, tried=tried or {})
        self.parent: Any = stepwise.FittedSet(
            EffectSet(("a",), 7.0, {}, None),
            self.blocks,
            ("first",),
            further,
            ([], [], []),  # type: ignore[arg-type]
        )
        self.settings: Any = SimpleNamespace(spec="spec", kinds={})

        def fitted(experiments: str, effects: Any, spec: str, rng: Any, near: Any, scales: Any) -> Any:
            assert scales == "scales"
            self.did.append(("fitted", experiments, effects, spec, near.tolist()))
            return SimpleNamespace(target=experiments, z=np.ones((1, 1)))

        def informed(blocks: Any, effects: Any, rng: Any) -> Any:
            self.did.append(("informed", effects))
            return blocks

        def weighed(blocks: Any, *given: Any, reach: Any, before: Any, most: int, forms_a_name: int) -> Any:
            self.did.append(("weighed", most, forms_a_name))
            self.before = before
            return self.evidence

        remainders = {"e0": 3.0, "e1": 4.0, 0: 5.0, 1: 6.0}
        monkeypatch.setattr(fitted_sets, "fitted", fitted)
        monkeypatch.setattr(fitted_sets, "informed", informed)
        monkeypatch.setattr(stepwise, "weigh_names", weighed)
        monkeypatch.setattr(stepwise, "remainder_evidence", lambda block, reference: remainders[block.target])
        monkeypatch.setattr(stepwise, "expand", lambda target, z, trials: None)
        monkeypatch.setattr(stepwise, "scan", lambda x: None)
        monkeypatch.setattr(stepwise.screening, "candidate_probes", lambda blocks, kinds: (["probe"], ["candidate"]))
        monkeypatch.setattr(stepwise.screening, "scanned", lambda c, scans: SimpleNamespace(log_bayes=[scanned]))

    def fit(self) -> stepwise.FittedSet:
        rng = np.random.default_rng(0)
        families = [("b", "twin")]
        return stepwise._fit(self.parent, "b", rng, families=families, references=[[], []], settings=self.settings)


def test_one_more_effect_is_fitted_from_where_its_refit_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    fits = Fits(monkeypatch, on=(1,))
    found = fits.fit()
    assert fits.did[0] == ("fitted", "e1", ("old1", "new"), "spec", [10.0])
    assert found.blocks[0] is fits.blocks[0] and found.blocks[1].target == "e1"
    assert found.effects.names == ("a", "b") and found.effects.remainder.tolist() == [5.0, 4.0]  # type: ignore[union-attr]
    assert found.accepted == ("first", stepwise.Accepted("b", (1,), {1: "new"}))  # type: ignore[comparison-overlap, dict-item]
    assert found.probed == (["probe"], ["candidate"])


@pytest.mark.parametrize(("on", "shared", "told"), [((0, 1), False, False), ((0, 1), True, True), ((0,), True, False)])
def test_materials_inform_each_other_of_an_amplitude_that_they_share(
    on: tuple[int, ...], shared: bool, told: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where each has its own there is nothing to tell, and of one material alone there is nobody."""
    fits = Fits(monkeypatch, on=on, shared=shared)
    fits.fit()
    assert ("informed", dict.fromkeys(on, "new")) in fits.did if told else all(d[0] != "informed" for d in fits.did)


@pytest.mark.parametrize(
    ("scanned", "tried", "refitted", "weighed", "further"),
    [
        (1.29, {}, {"c": 9.0}, False, False),  # by the scan not worth a refit
        (1.3, {}, {"c": 1.9, "d": 2.0}, True, True),
        (9.0, {}, {"c": 1.99}, True, False),  # refitted not worth adding
        (9.0, {}, {}, True, False),
        (-2.0, {"c": 1.3}, {"c": 9.0}, True, True),  # the scan may be blind: without b it was worth a refit
        (-2.0, {"c": 1.29}, {"c": 9.0}, False, False),
        (-2.0, {"b": 9.0, "twin": 9.0}, {"twin": 9.0}, False, False),  # what b explains as well
    ],
)
def test_a_further_effect_is_refitted_and_added_where_that_is_worth_it(
    scanned: float,
    tried: dict[str, float],
    refitted: dict[str, float],
    weighed: bool,
    further: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    fits = Fits(monkeypatch, scanned=scanned, tried=tried, refitted=refitted)
    found = fits.fit()
    assert (("weighed", 6, 1) in fits.did) is weighed
    assert found.further is (fits.evidence if further else None)
