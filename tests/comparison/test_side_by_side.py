"""The table of a comparison and what is judged, from scores that are written down."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from tests.comparison.test_compare import PLAIN, row
from wirebayes.comparison import candidates as module
from wirebayes.comparison import compare
from wirebayes.comparison.candidates import BASE
from wirebayes.comparison.compare import Task, judge, side_by_side, stacking
from wirebayes.effects import CATALOGUE, effect_named
from wirebayes.inference.policy import Policy
from wirebayes.io.paper import experiments
from wirebayes.io.run_folder import read_json
from wirebayes.model.build import build
from wirebayes.model.spec import ModelSpec
from wirebayes.prediction.held_out import HeldOutPrediction, Scores


def twelve(gain: float, spread: float = 0.0) -> list[float]:
    """Twelve holds that gain so much in all over ten each, with a standard error of the sum of `spread`."""
    each = np.tile([1.0, -1.0], 6) * spread * np.sqrt(11.0 / 12.0) / np.sqrt(12.0)
    return list(10.0 + gain / 12.0 + each)


@pytest.mark.parametrize(
    ("gain", "error", "message"),
    [
        (4.1, 1.0, "predicts better"),
        (3.9, 0.5, "no meaningful difference"),  # below four it may be chance
        (-4.1, 1.0, "predicts worse"),
        (-3.9, 0.5, "no meaningful difference"),
        (10.1, 5.0, "predicts better"),
        (9.9, 5.0, "no meaningful difference"),  # within two standard errors
    ],
)
def test_a_difference_means_something_from_four_and_from_two_standard_errors_on(
    gain: float, error: float, message: str
) -> None:
    table = side_by_side([row(BASE, twelve(0.0)), row("other", twelve(gain, error))], BASE)
    (other,) = (r for r in table["models"] if r["name"] == "other")
    assert other["difference"]["elpd"] == pytest.approx(gain)
    assert other["difference"]["se"] == pytest.approx(error)
    assert message in other["meaning"] and f"{gain:+.1f} ± {error:.1f}" in other["meaning"]


def held(free: list[float] | None, given: list[float]) -> dict[str, object]:
    return {
        "trained_on": 8,
        "free": free and {"per_hold": free, "elpd": sum(free), "readings": {}, "pit_band": []},
        "given_first": {"per_hold": given, "elpd": sum(given), "readings": {}, "pit_band": []},
    }


def test_held_out_differences_stand_beside_and_decide_where_models_are_scored_on_other_readings() -> None:
    later = "later readings given each hold's first"
    table = side_by_side(
        [
            row(BASE, [10.0, 10.0], held_out=held([1.0, 2.0], [3.0, 4.0])),
            row("alike", [16.0, 16.0], held_out=held([2.0, 5.0], [3.0, 5.0])),
            row("hold_by_hold", [9.0, 9.0], scored=later, held_out=held(None, [10.0, 10.0])),
        ],
        BASE,
    )
    found = {r["name"]: r for r in table["models"]}
    assert found["alike"]["difference"]["elpd"] == 12.0
    assert found["alike"]["held_out_difference"]["elpd"] == 4.0
    assert found["alike"]["given_first_difference"]["elpd"] == 1.0
    assert found["hold_by_hold"]["difference"] is None and found["hold_by_hold"]["held_out_difference"] is None
    assert found["hold_by_hold"]["given_first_difference"]["elpd"] == 13.0
    assert "on held-out holds given their first reading: predicts better" in found["hold_by_hold"]["meaning"]
    assert found[BASE]["meaning"] == "the reference for the other models"
    # the table carries scores, not readings
    assert found["alike"]["held_out"]["free"] == {"per_hold": [2.0, 5.0], "elpd": 7.0}
    # of models scored on the same readings the best comes first; weights are theirs alone
    assert [r["name"] for r in table["models"]] == ["alike", BASE, "hold_by_hold"]
    assert found["hold_by_hold"]["weight"] is None and found["alike"]["weight"] == pytest.approx(1.0)


def test_without_a_reference_nothing_is_compared() -> None:
    broken = {"name": BASE, "failed": "LinAlgError: no", "scored": "all readings", "warnings": []}
    table = side_by_side([broken, row("other", [10.0, 11.0]), row("best", [12.0, 11.0])], BASE)
    assert [r["name"] for r in table["models"]] == ["best", "other", BASE]
    assert all(r["weight"] is None and r["difference"] is None for r in table["models"])
    assert "not comparable" in table["models"][0]["meaning"] and "LinAlgError" in table["models"][2]["meaning"]


@pytest.mark.parametrize(("likelihood", "scored"), [("chain", "all readings"), ("hold", "later readings")])
def test_a_judgement_says_what_was_scored(likelihood: str, scored: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compare, "_scores", lambda task, seed, policy: {"parameters": 8, "converged": True})
    found = judge(Task(experiments()[0], replace(PLAIN, spec=ModelSpec(likelihood=likelihood))), 0)  # type: ignore[arg-type]
    assert found["scored"].startswith(scored) and found["failed"] is None and found["parameters"] == 8


@pytest.mark.parametrize("settled", [True, False])
@pytest.mark.parametrize(("train_holds", "fits", "early"), [(None, [12, 8], 8), (6, [6], 6)])
def test_the_last_third_is_predicted_from_a_posterior_of_the_others(
    train_holds: int | None, fits: list[int], early: int, settled: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All holds are left out in turn, and the last four of twelve held out; a given number of holds serves both.

    What importance sampling does not settle is fitted.
    """
    made: list[int] = []
    asked: list[float] = []
    received: dict[str, object] = {}

    def posterior(problem: object, converged: bool, why: str) -> object:
        holds = int(problem.samples[0].protocol.recorded.sum())  # type: ignore[attr-defined]
        return SimpleNamespace(problem=problem, converged=converged, why=why, holds=holds)

    def weighted(problem: object, seed: int, ess: float) -> object:
        asked.append(ess)
        found = posterior(problem, settled, "weights")
        made.append(found.holds)  # type: ignore[attr-defined]
        return found

    def fit(problem: object, seed: int, policy: object) -> object:
        return posterior(problem, True, "fit")

    def leave(full: object, seed: int) -> object:
        received.update(full=full.holds)  # type: ignore[attr-defined]
        nothing = np.zeros(2)
        return SimpleNamespace(
            hold=np.array([1, 2]),
            total=3.0,
            se=1.0,
            elpd=nothing,
            pareto_k=nothing,
            refitted=np.array([False, True]),
            converged=False,
        )

    monkeypatch.setattr(compare, "weighted_posterior", weighted)
    monkeypatch.setattr(compare, "fit_problem", fit)
    monkeypatch.setattr(compare, "smoothed_leave_one_hold_out", leave)
    monkeypatch.setattr(compare, "held_out", lambda early, whole, rng: (early.holds, len(whole.recorded_holds)))
    monkeypatch.setattr(compare, "_held_out", lambda result, trained: {"found": result})
    found = compare._scores(Task(experiments()[1], PLAIN, train_holds), 0, Policy(ess=600.0, most_steps=1000))
    assert set(asked) == {300.0}  # half of what is asked of a fit
    assert made == fits and found["held_out"]["found"] == (early, 12)
    assert received == {"full": fits[0]}
    assert found["leave_one_hold_out"]["refitted"].tolist() == [2]
    assert found["convergence"] == ("weights" if settled else "fit")
    assert found["converged"] is False  # one of three samplings was not
    assert found["effects"] == [] and found["parameters"] == 8
    for candidate, listed in (
        ("superposition", ["superposition"]),
        ("logarithmic", []),
    ):  # a rival law is no effect of the catalogue
        other = replace(PLAIN, effects=(candidate,))
        assert compare._scores(Task(experiments()[1], other, train_holds), 0, Policy())["effects"] == listed


def test_an_event_is_not_put_where_its_fit_did_not_converge(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever evidence it claims; of several modes the best one counts."""
    ends = iter([([True, True], [1.0, 3.0]), ([False, True], [90.0, 2.0]), ([True, False], [4.0, 5.0])])

    def modes(target: object, rng: object) -> SimpleNamespace:
        converged, evidence = next(ends)
        return SimpleNamespace(converged=np.array(converged), log_evidence=np.array(evidence))

    monkeypatch.setattr(module, "modes", modes)
    variants = CATALOGUE["grip_slip"].variants([experiments()[1].protocol()])[:3]
    assert module._most_evident(PLAIN, experiments()[1], variants, 0) is variants[2]


@pytest.mark.parametrize("name", ["exponential", "two_modes"])
def test_a_law_of_time_constants_creeps_by_exponentials(name: str) -> None:
    """By the tensions of the first hold: one time constant of 20 s, or a second, ten times as long, with two fifths."""
    experiment = experiments()[0]
    (law,) = (c for c in module.candidates(experiment, PLAIN, CATALOGUE) if c.name == name)
    problem = module.problem_of(law, experiment, module.effects_of(law, experiment, CATALOGUE, 0))
    values = {
        "k1": 700.0,
        "B": 0.25,
        "U": 0.7,
        "k2": 0.05,
        "preload": 0.3,
        "sensor_sd": 0.01,
        "setting_sd": 0.01,
        "two_modes.slow_share": 0.4,
        "two_modes.slower": 10.0,
    }
    theta = np.array([[values[parameter] for parameter in problem.names]])
    sample = problem.samples[0]
    tension, t = problem.linearised(theta, sample)[0].reading[0, :, 0], sample.protocol.time_s[0]
    crept = (1000.0 + 1.0 + 0.3) / (1.0 + tension / 700.0) - 1000.0  # zero-tension length less that of the start, mm
    share = 1.0 - np.exp(-0.05 * t)
    if name == "two_modes":
        share = 0.6 * share + 0.4 * (1.0 - np.exp(-0.005 * t))
    assert crept[1:] / crept[-1] == pytest.approx(share[1:] / share[-1], rel=1e-9)


def test_candidates_differ_from_the_base_as_their_sentences_say() -> None:
    """Every one but the effects of the catalogue: what is kept at a value, what acts, and which law is another."""
    fixed = {
        "hooke_without_creep": {"B", "U", "k2", "N"},
        "creep_at_once": {"k2", "N"},
        "exponential": {"N"},
        "logarithmic": {"k2", "N"},
        "power_law": {"k2", "N"},
        "two_modes": {"N"},
        "independent_errors": {"setting_sd"},
    }
    acting = {
        "creep_at_once": ("at_once", "not_in_time"),
        "logarithmic": ("logarithmic",),
        "power_law": ("power_law",),
        "two_modes": ("two_modes",),
    }
    chosen = module.candidates(experiments()[0], PLAIN, {})
    assert [c.name for c in chosen] == [
        BASE, "hooke_without_creep", "creep_at_once", "exponential", "logarithmic", "power_law", "two_modes",
        "modified_hooke", "additive", "hold_by_hold", "independent_errors", "unrecorded_skipped",
    ]  # fmt: skip
    laws = {
        "modified_hooke": ModelSpec(law="modified"),
        "additive": ModelSpec(history="additive"),
        "hold_by_hold": ModelSpec(likelihood="hold"),
    }
    for c in chosen:
        assert set(c.fixed) == fixed.get(c.name, set()) and c.effects == acting.get(c.name, ())
        same = replace(c, name=BASE, question="", sentence="", fixed={}, effects=())
        unrecorded = c.name != "unrecorded_skipped"
        assert same == replace(PLAIN, spec=laws.get(c.name, PLAIN.spec), unrecorded=unrecorded)
        assert c is chosen[0] or (c.question and c.sentence)
    values = {c.name: c.fixed for c in chosen}
    assert values["hooke_without_creep"]["B"] == 0.0 == values["independent_errors"]["setting_sd"]
    assert values["exponential"]["N"] == 1.0 == values["two_modes"]["N"]


def test_of_another_base_the_laws_of_the_plain_model_are_candidates() -> None:
    base = replace(PLAIN, spec=ModelSpec("modified", "additive", "hold"))
    chosen = {c.name: c for c in module.candidates(experiments()[1], base, {})}
    assert {"hooke", "saturating", "chain"} <= set(chosen) and len(chosen) == 10
    assert not {"modified_hooke", "additive", "hold_by_hold", "independent_errors", "unrecorded_skipped"} & set(chosen)
    assert chosen["hooke"] == replace(
        base, name="hooke", spec=replace(base.spec, law="hooke"), question=module.LAW, sentence=chosen["hooke"].sentence
    )
    assert (chosen["saturating"].spec.history, chosen["chain"].spec.likelihood) == ("saturating", "chain")
    assert all(c.spec.law == "modified" for name, c in chosen.items() if name != "hooke")


def test_effects_that_the_test_could_show_are_candidates_and_only_those_asked_for() -> None:
    """An event once, whatever hold; the base always."""
    known = {name: CATALOGUE[name] for name in ("superposition", "grip_slip", "lost_motion")}
    names = [c.name for c in module.candidates(experiments()[0], PLAIN, known)]
    assert names[12:] == ["superposition", "grip_slip"]  # nothing turns back, so no motion is lost
    some = module.candidates(experiments()[0], PLAIN, known, ["grip_slip", "additive"])
    assert [c.name for c in some] == [BASE, "additive", "grip_slip"]
    assert some[2].effects == ("grip_slip",) and some[2].sentence == CATALOGUE["grip_slip"].sentence
    placed = replace(PLAIN, effects=("grip_slip@7", "superposition", "two_modes"))
    assert [e.key for e in module.effects_of(placed, experiments()[0], CATALOGUE, 0)] == list(placed.effects)


def test_what_a_candidate_fixes_leaves_the_posterior() -> None:
    """Unless the model has no such parameter."""
    experiment = experiments()[0]
    plain = module.problem_of(PLAIN, experiment, [])
    fixed = replace(PLAIN, fixed={"N": 1.0, "setting_sd": 0.0, "nothing": 3.0})
    found = module.problem_of(fixed, experiment, []).prior
    assert found.fixed == {"N": 1.0, "setting_sd": 0.0}
    assert list(found.distributions) == [name for name in plain.names if name not in ("N", "setting_sd")]
    assert found.logarithmic == plain.prior.logarithmic - {"N", "setting_sd"}
    by_hold = module.problem_of(replace(fixed, spec=ModelSpec("modified", likelihood="hold")), experiment, [])
    assert by_hold.prior.fixed == {"N": 1.0} and by_hold.samples[0].model.law == "modified"


@pytest.mark.parametrize(
    ("gains", "meaning"),
    [
        ([2.0, 2.0], "elpd +4.0 ± 0.0 against plain, leaving out each hold in turn: predicts better"),
        ([-2.0, -2.0], "elpd -4.0 ± 0.0 against plain, leaving out each hold in turn: predicts worse"),
        ([6.0, 2.0], "elpd +8.0 ± 4.0 against plain, leaving out each hold in turn: predicts better"),
        ([-6.0, -2.0], "elpd -8.0 ± 4.0 against plain, leaving out each hold in turn: predicts worse"),
        ([7.0, 1.0], "elpd +8.0 ± 6.0 against plain, leaving out each hold in turn: no meaningful difference"),
    ],
)
def test_exactly_four_and_exactly_two_standard_errors_mean_something(gains: list[float], meaning: str) -> None:
    table = side_by_side([row(BASE, [0.0, 0.0]), row("other", gains)], BASE)
    assert [r["meaning"] for r in table["models"] if r["name"] == "other"] == [meaning]


def test_models_come_by_score_then_those_scored_otherwise_then_failures() -> None:
    later = "later readings given each hold's first"
    models = [
        {"name": "broken", "failed": "no", "scored": "all readings", "warnings": []},
        row("low", [1.0, 1.0]),
        row(BASE, [2.0, 2.0]),
        row("worse", [8.0, 7.0], scored=later),
        row("better", [9.0, 9.0], scored=later),
        row("high", [3.0, 3.0]),
        {"name": "also", "failed": "no", "scored": later, "warnings": []},
    ]
    table = side_by_side(models, BASE)  # type: ignore[arg-type]
    assert [r["name"] for r in table["models"]] == ["high", BASE, "low", "better", "worse", "broken", "also"]
    assert table["base"] == BASE


def scored(elpd: list[float]) -> Scores:
    at = np.arange(3.0)
    return Scores(
        hold=np.array([2, 2, 3]),
        time_s=at,
        observed_N=at + 1.0,
        mean_N=at,
        sd_N=at + 0.5,
        quantiles_N=np.outer([-9.0, -3.0, -2.0, 0.0, 2.0, 3.0, 9.0], np.ones(3)) + at,
        pit=at / 3.0,
        elpd=np.array(elpd),
        elpd_together=7.0,
        pit_band=np.zeros((3, 101)),
        pit_p=0.25,
    )


def test_held_out_holds_as_plain_values() -> None:
    fit = SimpleNamespace(problem=build([experiments()[1]], [effect_named("superposition")]))
    found = compare._held_out(HeldOutPrediction("wire", 8, scored([1.0, 2.5]), scored([4.0])), fit)  # type: ignore[arg-type]
    assert found["trained_on"] == 8 and found["holds"].tolist() == [2, 3] and found["effects"] == ["superposition"]
    free, given = found["free"], found["given_first"]
    assert (free["elpd"], given["elpd"]) == (3.5, 4.0) and free["per_hold"].tolist() == [1.0, 2.5]
    assert free["rmse_N"] == 1.0 and free["elpd_together"] == 7.0 and free["pit_p"] == 0.25
    assert free["coverage"] == {"50": 1.0, "90": 1.0, "99": 1.0} and free["pit_band"].shape == (3, 101)
    readings = free["readings"]
    assert readings["hold"].tolist() == [2, 2, 3] and readings["observed_N"].tolist() == [1.0, 2.0, 3.0]
    assert readings["mean_N"].tolist() == readings["time_s"].tolist() == [0.0, 1.0, 2.0]
    assert readings["sd_N"][0] == 0.5 and readings["quantiles_N"].shape == (7, 3) and readings["pit"][0] == 0.0
    assert compare._held_out(HeldOutPrediction("wire", 8, None, scored([4.0])), fit)["free"] is None  # type: ignore[arg-type]


def test_only_what_is_missing_is_judged_and_every_model_has_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Named for its experiment and itself; a hold in the name is set off by a hyphen."""
    experiment = experiments()[1]
    tasks = [Task(experiment, replace(PLAIN, name=name)) for name in (BASE, "grip_slip@3", "superposition")]
    assert tasks[1].file == Path("roc-line-1.71m/models/grip_slip-3.json")
    done = tmp_path / tasks[0].file
    done.parent.mkdir(parents=True)
    done.write_text("known")
    judged: list[tuple[str, int, object]] = []

    def judge(task: Task, seed: int, policy: object) -> dict[str, str]:
        judged.append((task.candidate.name, seed, policy))
        return {"name": task.candidate.name}

    @contextmanager
    def alone(pieces: int) -> Iterator[type[map]]:
        assert pieces == 2
        yield map

    monkeypatch.setattr(compare, "judge", judge)
    monkeypatch.setattr(compare, "workers", alone)
    told: list[tuple[str, float, float]] = []
    compare.judge_all(tasks, tmp_path, 5, report=lambda *about: told.append(about))
    assert judged == [("grip_slip@3", 5, compare.POLICY), ("superposition", 5, compare.POLICY)]
    assert told == [("models", 1, 2), ("models", 2, 2)]
    assert done.read_text() == "known" and read_json(tmp_path / tasks[2].file) == {"name": "superposition"}
    # half the draws of a fit, from half the walkers
    assert (compare.POLICY.ess, compare.POLICY.walkers, compare.POLICY.round_draws) == (
        Policy().ess / 2,
        Policy().walkers / 2,
        Policy().round_draws / 2,
    )


def test_a_judgement_has_seeds_of_its_own_for_every_model_and_number_of_holds(monkeypatch: pytest.MonkeyPatch) -> None:
    seeds: list[int] = []

    def weighted(problem: object, seed: int, ess: float) -> object:
        seeds.append(seed)
        raise InterruptedError("enough")

    monkeypatch.setattr(compare, "weighted_posterior", weighted)
    for seed, name, train in ((0, "a", None), (0, "a", 6), (0, "b", None), (1, "a", None), (0, "a", None)):
        found = judge(Task(experiments()[1], replace(PLAIN, name=name), train), seed)
        assert found["failed"] == "InterruptedError: enough" and found["name"] == name
    assert len(set(seeds)) == 4 and seeds[0] == seeds[4]


def test_without_the_holds_that_were_not_recorded_there_is_one_less(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[int] = []

    def weighted(problem: object, seed: int, ess: float) -> object:
        seen.append(len(problem.samples[0].protocol.number))  # type: ignore[attr-defined]
        raise InterruptedError

    monkeypatch.setattr(compare, "weighted_posterior", weighted)
    for unrecorded in (True, False):
        judge(Task(experiments()[0], replace(PLAIN, unrecorded=unrecorded)), 0)
    assert seen == [13, 12]


def test_stacking_by_one_step_of_its_iteration() -> None:
    """New weights are the mean shares of the densities; from equal ones on, until they stay."""
    density = np.array([[1.0, 3.0], [2.0, 2.0], [4.0, 1.0]])
    once = stacking(np.log(density), iterations=1)
    assert once == pytest.approx((density / density.sum(axis=1, keepdims=True)).mean(axis=0))
    share = density * once
    assert stacking(np.log(density), iterations=2) == pytest.approx(
        (share / share.sum(axis=1, keepdims=True)).mean(axis=0)
    )
    assert stacking(np.log(density), iterations=0) == pytest.approx([0.5, 0.5])


def test_a_model_that_has_no_such_score_is_not_compared_by_it() -> None:
    """Neither way round: held out freely, given the first reading, or not held out at all."""
    whole, bare = held([1.0, 2.0], [3.0, 4.0]), held(None, [3.0, 4.0]) | {"given_first": None}
    for one, other in ((whole, bare), (bare, whole), (whole, None), (None, whole), (bare, bare)):
        models = [row(BASE, [10.0, 10.0], held_out=other), row("other", [11.0, 11.0], held_out=one)]
        (found,) = (r for r in side_by_side(models, BASE)["models"] if r["name"] == "other")  # type: ignore[arg-type]
        assert found["held_out_difference"] is None and found["given_first_difference"] is None
        assert found["difference"]["elpd"] == 2.0
