"""The global test by its parts: gross errors struck out first, larger effects tried where the scan decides nothing."""

from dataclasses import replace
from math import comb
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from wirebayes.discovery import global_test, gross_errors
from wirebayes.discovery.global_test import MOST_TIMES, examine, is_close
from wirebayes.discovery.screening import Candidate
from wirebayes.discovery.settings import ALPHA
from wirebayes.errors import InputError
from wirebayes.io.paper import experiments
from wirebayes.model.spec import PLAIN_SPEC

SIMULATIONS = 199


def examined(
    monkeypatch: pytest.MonkeyPatch,
    linear: float,
    larger: float,
    alpha: float = ALPHA,
    simulations: int = SIMULATIONS,
    counts: bool = True,
) -> tuple[Any, int]:
    """The test of a block whose scan has one p and whose test from larger effects another, and the simulations made."""
    made: list[int] = []

    def simulated(block: Any, trials: Any, n: int, rng: Any) -> Any:
        made.append(n)
        return SimpleNamespace(scan=None, z=np.zeros((n, 1)))

    def joined(parts: Any) -> Any:
        return SimpleNamespace(scan=None, z=np.concatenate([part.z for part in parts]))

    class Larger:
        p = larger

        def __init__(self, *given: Any) -> None:
            pass

        def test(self, *given: Any) -> Any:
            return SimpleNamespace(p=larger if counts else linear, null=np.zeros(sum(made)))

    test = lambda *given: SimpleNamespace(p=linear, null=np.zeros(sum(made)))  # noqa: E731
    monkeypatch.setattr(global_test.screening, "candidate_probes", lambda *given: ([], [Candidate(0, "a", (0,), True)]))
    monkeypatch.setattr(global_test.screening, "joined_replicates", joined)
    monkeypatch.setattr(global_test.screening, "global_test", test)
    monkeypatch.setattr(global_test.residual_patterns, "patterns", lambda problem: ([], None))
    monkeypatch.setattr(global_test, "_strike_gross_errors", lambda block, *given: (block, []))
    monkeypatch.setattr(global_test, "simulated_with_patterns", simulated)
    monkeypatch.setattr(global_test, "Continuation", Larger)
    for name in ("expand", "scan"):
        monkeypatch.setattr(global_test, name, lambda *given, **known: None)
    block: Any = SimpleNamespace(target=SimpleNamespace(problem=None), z=np.zeros((1, 1)))
    return examine([block], {}, simulations, np.random.default_rng(0), alpha=alpha), sum(made)


def test_what_is_plain_to_see_needs_no_larger_effects(monkeypatch: pytest.MonkeyPatch) -> None:
    """No simulation of 300 is as surprising: nothing that is tried further could change the verdict."""
    found, made = examined(monkeypatch, linear=1 / 301, larger=0.9, simulations=600)
    assert found.test.p == 1 / 301 and made == 300


@pytest.mark.parametrize(
    ("larger", "wanted"), [(0.5, 100), (0.002, SIMULATIONS), (0.1, SIMULATIONS), (0.04, MOST_TIMES * SIMULATIONS)]
)
def test_larger_effects_decide_and_a_p_on_the_level_gets_more_simulations(
    larger: float, wanted: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Half of the simulations where they decide, then all, then twice as many each time."""
    found, made = examined(monkeypatch, linear=0.3, larger=larger)
    assert found.test.p == larger
    assert made == wanted


def test_the_requested_level_decides_what_is_close(monkeypatch: pytest.MonkeyPatch) -> None:
    assert examined(monkeypatch, linear=0.3, larger=0.2, alpha=0.2)[1] == MOST_TIMES * SIMULATIONS
    assert examined(monkeypatch, linear=0.3, larger=0.09, alpha=0.2)[1] == 100


@pytest.mark.parametrize(("larger", "wanted"), [(0.02, SIMULATIONS), (0.08, SIMULATIONS), (0.09, 100), (0.9, 100)])
def test_all_simulations_are_made_where_larger_effects_nearly_count(
    larger: float, wanted: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With half of them they do not; with all they might. More than were asked for are for the level alone."""
    found, made = examined(monkeypatch, linear=0.3, larger=larger, counts=False)
    assert found.test.p == 0.3 and made == wanted


def test_without_an_effect_that_could_show_nothing_is_tested(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(global_test.screening, "candidate_probes", lambda *given: ([], []))
    with pytest.raises(InputError, match="no effect of the catalogue could show"):
        examine([], {}, SIMULATIONS, np.random.default_rng(0))


@pytest.mark.parametrize(("wrong", "struck"), [(0, 0), (1, 1), (4, 4), (9, 5)])
def test_readings_are_struck_out_one_by_one_of_their_own_experiment(
    wrong: int, struck: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As long as one is suspect, and no more than one in twenty: five of a hundred and some."""
    one, other = experiments()[1:3]
    pair = (one, replace(other, holds=other.holds[: (110 - gross_errors.readings_of([one])) // 5]))
    assert 100 <= gross_errors.readings_of(pair) < 120
    rivals: list[float] = []

    def suspect(block: Any, rival: float) -> Any:
        rivals.append(rival)
        return None if len(rivals) > wrong else (pair[1].name, pair[1].holds[2].number, 1, 9.0)

    def fitted(members: Any, *given: Any, **known: Any) -> Any:
        return SimpleNamespace(**(vars(block) | {"experiments": tuple(members)}))

    block: Any = SimpleNamespace(experiments=pair, target=None, z=np.zeros((1, 1)), effects=(), spec=None, scales=None)
    # the best effect of this block explains 7, one of another block 50, a smooth curve 4
    effects = SimpleNamespace(effects=np.array([[7.0, 50.0]]), flexible=np.array([4.0]))
    monkeypatch.setattr(gross_errors, "suspect", suspect)
    monkeypatch.setattr(global_test, "fitted", fitted)
    monkeypatch.setattr(global_test, "expand", lambda *given: None)
    monkeypatch.setattr(global_test, "scan", lambda x: effects)
    candidates = [Candidate(0, "a", (0,), True), Candidate(1, "b", (1,), True)]
    found, gone = global_test._strike_gross_errors(block, [], candidates, 0, np.random.default_rng(0))
    assert len(gone) == struck and set(rivals) == {7.0}
    where = {"experiment": other.name, "hold": pair[1].holds[2].number}
    # the second of those that are left is the next of the file
    assert gone == [where | {"reading": 1 + before, "log_bayes": 9.0} for before in range(struck)]
    lost = [
        gross_errors.readings_of([before]) - gross_errors.readings_of([after])
        for before, after in zip(pair, found.experiments, strict=True)
    ]
    assert lost == [0, min(struck, 4)]  # a hold of five readings has no second one after four are gone


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


def test_of_few_readings_one_may_be_struck_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """One in twenty of fifteen is none, but a single gross error is looked for in any test."""
    one = experiments()[2].train(3)
    assert gross_errors.readings_of([one]) < 20
    asked: list[float] = []

    def suspect(block: Any, rival: float) -> Any:
        asked.append(rival)
        return one.name, one.holds[0].number, 1, 9.0

    monkeypatch.setattr(gross_errors, "suspect", suspect)
    monkeypatch.setattr(global_test, "expand", lambda *given: None)
    # a smooth curve explains 4, no effect explains anything
    monkeypatch.setattr(
        global_test, "scan", lambda x: SimpleNamespace(effects=np.array([[-7.0]]), flexible=np.array([4.0]))
    )
    block: Any = SimpleNamespace(
        experiments=(one,),
        target=None,
        z=np.zeros((1, 1)),
        effects=(),
        spec=PLAIN_SPEC,
        scales=None,
    )
    monkeypatch.setattr(global_test, "fitted", lambda members, *given, **known: SimpleNamespace(experiments=members))
    candidates = [Candidate(0, "a", (0,), True)]
    found, gone = global_test._strike_gross_errors(block, [], candidates, 0, np.random.default_rng(0))
    assert len(gone) == 1 and asked == [4.0]
    assert gross_errors.readings_of(found.experiments) == gross_errors.readings_of([one]) - 1


@pytest.mark.parametrize(("linear", "p"), [(0.002, 0.002), (8 / 501, 8 / 501), (9 / 501, 0.9)])
def test_larger_effects_are_led_through_the_simulations_only_where_they_could_change_the_verdict(
    linear: float, p: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of 500 simulations none as surprising is plain to see, and 7 below the level of .04 beyond doubt; not 8."""
    found, _ = examined(monkeypatch, linear=linear, larger=0.9, simulations=999)
    assert found.test.p == p


def test_where_no_effect_acts_a_gross_error_is_held_against_the_smooth_curve(monkeypatch: pytest.MonkeyPatch) -> None:
    """However little that explains; effects of other blocks do not count."""
    asked: list[float] = []
    monkeypatch.setattr(gross_errors, "suspect", lambda block, rival: asked.append(rival))
    monkeypatch.setattr(global_test, "expand", lambda *given: None)
    found = SimpleNamespace(effects=np.array([[9.0]]), flexible=np.array([0.25]))
    monkeypatch.setattr(global_test, "scan", lambda x: found)
    one = experiments()[2].train(3)
    block: Any = SimpleNamespace(experiments=(one,), target=None, z=np.zeros((1, 1)))
    for flexible, rival in ((0.25, 0.25), (-3.0, 0.0)):
        found.flexible[0] = flexible
        same, gone = global_test._strike_gross_errors(block, [], [Candidate(0, "a", (1,), True)], 0, None)  # type: ignore[arg-type]
        assert same is block and gone == [] and asked[-1] == rival
