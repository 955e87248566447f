"""The table of a comparison and what is judged, from scores that are written down."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from wirebayes.comparison import candidates as module
from wirebayes.comparison import compare
from wirebayes.comparison.candidates import BASE, Candidate
from wirebayes.comparison.compare import Task, judge, side_by_side
from wirebayes.effects import CATALOGUE
from wirebayes.inference.policy import Policy
from wirebayes.io.paper import experiments

PLAIN = Candidate(BASE, "", "")


def row(name: str, elpd: list[float], **more: object) -> dict[str, object]:
    return {
        "name": name, "scored": "all readings", "failed": None, "converged": True, "held_out": None,
        "leave_one_hold_out": {"per_hold": elpd, "elpd": sum(elpd)},
    } | more  # fmt: skip


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
    return {"trained_on": 8, "free": free and {"per_hold": free, "elpd": sum(free), "readings": {}, "pit_band": []},
            "given_first": {"per_hold": given, "elpd": sum(given), "readings": {}, "pit_band": []}}  # fmt: skip


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
    broken = {"name": BASE, "failed": "LinAlgError: no", "scored": "all readings"}
    table = side_by_side([broken, row("other", [10.0, 11.0]), row("best", [12.0, 11.0])], BASE)
    assert [r["name"] for r in table["models"]] == ["best", "other", BASE]
    assert all(r["weight"] is None and r["difference"] is None for r in table["models"])
    assert "not comparable" in table["models"][0]["meaning"] and "LinAlgError" in table["models"][2]["meaning"]


@pytest.mark.parametrize(("likelihood", "scored"), [("chain", "all readings"), ("hold", "later readings")])
def test_a_judgement_says_what_was_scored(likelihood: str, scored: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compare, "_scores", lambda task, seed, policy: {"parameters": 8})
    found = judge(Task(experiments()[0], replace(PLAIN, likelihood=likelihood)), 0)  # type: ignore[arg-type]
    assert found["scored"].startswith(scored) and found["failed"] is None and found["parameters"] == 8


@pytest.mark.parametrize(("train_holds", "fits", "early"), [(None, [12, 8], 8), (6, [6], 6)])
def test_the_last_third_is_predicted_from_a_fit_of_the_others(
    train_holds: int | None, fits: list[int], early: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All holds are left out in turn, and the last four of twelve held out; a given number of holds serves both."""
    made: list[int] = []
    received: dict[str, object] = {}

    def fit(problem: object, seed: int, policy: object) -> object:
        holds = int(problem.samples[0].protocol.recorded.sum())  # type: ignore[attr-defined]
        made.append(holds)
        chains = SimpleNamespace(converged=True, why="message")
        return SimpleNamespace(problem=problem, chains=chains, holds=holds)

    def leave(full: object, seed: int) -> object:
        received.update(full=full.holds)  # type: ignore[attr-defined]
        nothing = np.zeros(2)
        return SimpleNamespace(hold=np.array([1, 2]), total=3.0, se=1.0, elpd=nothing, pareto_k=nothing,
                               refitted=np.array([False, True]), converged=False)  # fmt: skip

    monkeypatch.setattr(compare, "fit", fit)
    monkeypatch.setattr(compare, "smoothed_leave_one_hold_out", leave)
    monkeypatch.setattr(compare, "held_out", lambda early, whole, rng: (early.holds, len(whole.recorded_holds)))
    monkeypatch.setattr(compare, "_held_out", lambda result, trained: {"found": result})
    found = compare._scores(Task(experiments()[1], PLAIN, train_holds), 0, Policy(ess=600.0, most_steps=1000))
    assert made == fits and found["held_out"]["found"] == (early, 12)
    assert received == {"full": fits[0]}
    assert found["leave_one_hold_out"]["refitted"].tolist() == [2]
    assert found["converged"] is False  # one of three samplings was not
    assert found["effects"] == [] and found["parameters"] == 8
    for candidate, listed in (("memory", ["memory"]), ("logarithmic", [])):  # a rival law is no effect of the catalogue
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
    values = {"k1": 700.0, "B": 0.25, "U": 0.7, "k2": 0.05, "preload": 0.3, "sensor_sd": 0.01, "setting_sd": 0.01,
              "two_modes.slow_share": 0.4, "two_modes.slower": 10.0}  # fmt: skip
    theta = np.array([[values[parameter] for parameter in problem.names]])
    sample = problem.samples[0]
    tension, t = problem.linearised(theta, sample)[0].tension[0, :, 0], sample.protocol.time_s[0]
    crept = (1000.0 + 1.0 + 0.3) / (1.0 + tension / 700.0) - 1000.0  # zero-tension length less that of the start, mm
    share = 1.0 - np.exp(-0.05 * t)
    if name == "two_modes":
        share = 0.6 * share + 0.4 * (1.0 - np.exp(-0.005 * t))
    assert crept[1:] / crept[-1] == pytest.approx(share[1:] / share[-1], rel=1e-9)
