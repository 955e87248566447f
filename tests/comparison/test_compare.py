"""Models side by side: weights, meanings, rival laws, and the command."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from wirebayes import cli
from wirebayes.comparison import compare
from wirebayes.comparison.candidates import BASE, ModelToCompare, candidates, effects_of, problem_of
from wirebayes.comparison.compare import Task, judge, side_by_side, stacking
from wirebayes.effects import CATALOGUE, effect_named
from wirebayes.effects.rivals import RIVALS
from wirebayes.inference.policy import Policy
from wirebayes.io.paper import FOLDER, experiments
from wirebayes.model.build import build
from wirebayes.model.spec import ModelSpec
from wirebayes.wire.model import Model
from wirebayes.wire.staircase import linearise, simulate

QUICK = Policy(ensembles=2, walkers=64, ess=300.0, r_hat=1.1, most_steps=80)
PLAIN = ModelToCompare(BASE, "", "")
TRUTH = {"k1": 700.0, "B": 0.25, "U": 0.7, "k2": 0.05, "N": 1.0, "preload": 0.3}


def one(name: str) -> ModelToCompare:
    return next(c for c in candidates(experiments()[0], PLAIN, CATALOGUE) if c.name == name)


def theta(**more: float) -> dict[str, np.ndarray]:
    return {name: np.array([value]) for name, value in (TRUTH | more).items()}


def test_stacking_maximises_the_log_score_of_the_mixture() -> None:
    rng = np.random.default_rng(0)
    log_p = rng.normal(size=(12, 3))
    weights = stacking(log_p)
    grid = [(a, b, 1 - a - b) for a in np.linspace(0, 1, 101) for b in np.linspace(0, 1, 101) if a + b <= 1]
    best = max(grid, key=lambda w: float(np.log(np.exp(log_p) @ np.array(w)).sum()))
    assert weights.sum() == pytest.approx(1.0)
    assert np.abs(weights - best).max() < 0.015
    assert stacking(np.array([[-900.0, -1000.0]] * 4))[0] == pytest.approx(1.0)


def row(name: str, elpd: list[float], **more: object) -> dict[str, object]:
    return {
        "name": name,
        "scored": "all readings",
        "failed": None,
        "converged": True,
        "held_out": None,
        "warnings": [],
        "leave_one_hold_out": {"per_hold": elpd, "elpd": sum(elpd)},
    } | more


def test_differences_are_said_only_where_they_mean_something() -> None:
    base = row(BASE, [10.0, 10.0, 10.0, 10.0])
    table = side_by_side(
        [
            base,
            row("better", [12.0, 12.5, 11.5, 12.0]),
            row("noisy", [30.0, 10.0, 0.0, 10.0]),
            row("hardly", [10.5, 10.6, 10.4, 10.5]),
            row("worse", [8.0, 8.0, 7.0, 8.0]),
            row("doubtful", [13.0, 13.0, 13.0, 13.0], converged=False),
            row("other", [1.0], scored="later readings given each hold's first"),
            {"name": "broken", "failed": "LinAlgError: no", "scored": "all readings", "warnings": []},
        ],
        BASE,
    )
    meanings = {r["name"]: r["meaning"] for r in table["models"]}
    assert "predicts better" in meanings["better"] and "+8.0 ± 0.8" in meanings["better"]
    assert all("no meaningful difference" in meanings[name] for name in ("noisy", "hardly"))
    assert "predicts worse" in meanings["worse"]
    assert "did not converge" in meanings["doubtful"]
    assert "not comparable" in meanings["other"]
    assert "LinAlgError: no" in meanings["broken"]
    assert [r["name"] for r in table["models"]][-1] == "broken"
    assert sum(r["weight"] or 0.0 for r in table["models"]) == pytest.approx(1.0)


def test_one_hold_alone_says_nothing_of_its_error() -> None:
    table = side_by_side([row(BASE, [10.0]), row("better", [30.0])], BASE)
    (meaning,) = (r["meaning"] for r in table["models"] if r["name"] == "better")
    assert meaning.startswith("elpd +20.0 against") and "one hold alone" in meaning


def test_rival_laws_are_what_they_say() -> None:
    protocol = experiments()[0].protocol()

    def tension(key: str, **more: float) -> np.ndarray:
        return simulate(protocol, theta(**more), Model(effects=(RIVALS[key](),)))[..., 0]

    k1, length = TRUTH["k1"], 1000.0
    first = k1 * (TRUTH["preload"] + 1.0) / length
    target = TRUTH["B"] * first ** TRUTH["U"]

    def course(share: float) -> float:
        return k1 * ((length + 1.0 + TRUTH["preload"]) / (length + target * share) - 1.0)

    log_law = tension("logarithmic", **{"logarithmic.t0": 5.0})
    power = tension("power_law", **{"power_law.n": 0.2})
    two = tension("two_modes", **{"two_modes.slow_share": 0.4, "two_modes.slower": 10.0})
    for k, t in enumerate(protocol.time_s[0]):
        assert log_law[0, k] == pytest.approx(course(np.log1p(t / 5) / np.log1p(86400 / 5)), rel=1e-12)
        assert power[0, k] == pytest.approx(course((t / 86400) ** 0.2), rel=1e-12)
        share = 0.6 * (1 - np.exp(-0.05 * t)) + 0.4 * (1 - np.exp(-0.005 * t))
        assert two[0, k] == pytest.approx(course(share), rel=1e-12)
    assert tension("two_modes", **{"two_modes.slow_share": 0.0, "two_modes.slower": 9.0}) == pytest.approx(
        simulate(protocol, theta())[..., 0], rel=1e-12
    )


def test_creep_at_once_solves_eq_2_and_stands_still() -> None:
    protocol = experiments()[0].protocol()
    model = Model(effects=(RIVALS["at_once"](), RIVALS["not_in_time"]()))
    tension = simulate(protocol, theta(), model)[..., 0]
    assert np.ptp(tension, axis=1).max() == 0
    strain = (protocol.setting + TRUTH["preload"]) / 1000.0
    parts = tension[:, 0] / TRUTH["k1"] + TRUTH["B"] * tension[:, 0] ** TRUTH["U"] / 1000.0
    assert parts == pytest.approx(strain, rel=1e-12)
    line = linearise(protocol, theta(), model)
    step = 1e-6
    moved = [simulate(protocol, theta(preload=TRUTH["preload"] + d), model)[..., 0] for d in (step, -step)]
    assert line.by_setting[..., 0] == pytest.approx((moved[0] - moved[1]) / (2 * step), rel=1e-5)


def test_hooke_without_creep_is_a_spring() -> None:
    problem = problem_of(one("hooke_without_creep"), experiments()[0], [])
    assert problem.names == ("k1", "preload", "sensor_sd", "setting_sd")
    rows = np.array([[700.0, 0.3, 0.01, 0.02]])
    line = problem.linearised(rows, problem.samples[0])[0]
    displacement = problem.samples[0].protocol.setting
    assert line.reading[:, :, 0] == pytest.approx(np.tile(0.7 * (displacement + 0.3)[:, None], 5))


def test_every_candidate_differs_from_the_base_in_its_one_thing() -> None:
    everything = candidates(experiments()[0], PLAIN, CATALOGUE)
    names = [c.name for c in everything]
    assert len(set(names)) == len(names)
    assert {
        "exponential",
        "logarithmic",
        "modified_hooke",
        "additive",
        "hold_by_hold",
        "independent_errors",
        "unrecorded_skipped",
        "superposition",
        "grip_slip",
    } <= set(names)
    assert "unrecorded_skipped" not in [c.name for c in candidates(experiments()[1], PLAIN, CATALOGUE)]
    assert "lost_motion" not in names  # nothing turns back on this protocol
    for c in everything[1:]:
        again = replace(c, name=PLAIN.name, question="", sentence="")
        assert again != PLAIN, c.name
    with_law = candidates(experiments()[0], replace(PLAIN, spec=ModelSpec("modified", "additive")), CATALOGUE)
    assert {c.spec.law for c in with_law} == {"hooke", "modified"}
    assert next(c for c in with_law if c.name == "toe").spec.history == "additive"


def test_an_event_is_put_where_the_readings_say() -> None:
    experiment = experiments()[1]
    slip = effect_named("grip_slip@7")
    problem = build([experiment], [slip])
    truth = {"k1": 700.0, "B": 0.25, "U": 0.7, "k2": 0.05, "N": 0.8, "preload": 0.3, "grip_slip.w": 0.6}
    rng = np.random.default_rng(4)
    tension = simulate(experiment.protocol(), {k: np.array([v]) for k, v in truth.items()}, problem.samples[0].model)
    tension = np.round(tension[..., 0] + 0.006 * rng.normal(size=tension.shape[:2]), 2)
    holds = tuple(replace(h, readings=tension[j]) for j, h in enumerate(experiment.holds))
    chosen = effects_of(one("grip_slip"), replace(experiment, holds=holds), CATALOGUE, 0)
    assert [e.key for e in chosen] == ["grip_slip@7"]


def test_a_model_that_fails_stays_with_its_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*arguments: object) -> None:
        raise FloatingPointError("no answer")

    monkeypatch.setattr(compare, "_scores", broken)
    assert judge(Task(experiments()[0], PLAIN), 0)["failed"] == "FloatingPointError: no answer"


@pytest.mark.statistical
def test_command_finds_that_a_creeping_wire_is_no_spring(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # with short chains: what is tested is the command, not the sampler
    monkeypatch.setattr(compare, "POLICY", QUICK)
    monkeypatch.setattr(compare.judge_all, "__defaults__", (QUICK, *compare.judge_all.__defaults__[1:]))
    out = tmp_path / "out"
    words = ["compare", str(FOLDER / "experiments.toml"), "--experiment", "roc-line-1.71m", "--output", str(out),
             "--train-holds", "6", "--only", "hooke_without_creep", "--only", "hold_by_hold"]  # fmt: skip
    assert cli.main(words) == 0
    content = (out / "comparison.json").read_bytes()
    table = {r["name"]: r for r in json.loads(content)["experiments"]["roc-line-1.71m"]["models"]}
    assert set(table) == {"plain", "hooke_without_creep", "hold_by_hold"}
    assert "predicts worse" in table["hooke_without_creep"]["meaning"]
    assert table["plain"]["leave_one_hold_out"]["holds"] == [1, 2, 3, 4, 5, 6]
    assert table["plain"]["held_out"]["holds"] == [7, 8, 9, 10, 11, 12]
    assert table["hold_by_hold"]["held_out"]["free"] is None
    assert (out / "roc-line-1.71m" / "differences.svg").stat().st_size > 2000
    # cut off before one model was done, the run goes on to the same bytes
    (out / "complete.json").unlink()
    (out / "comparison.json").unlink()
    (out / "roc-line-1.71m" / "models" / "hooke_without_creep.json").unlink()
    assert cli.main(words) == 0
    assert (out / "comparison.json").read_bytes() == content


def test_command_refuses_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = str(FOLDER / "experiments.toml")
    for words, message in (
        (["--only", "springy", "--experiment", "kite-1.5m"], "--only springy"),
        (["--train-holds", "40"], "found --train-holds 40"),
        (["--train-holds", "2"], "found --train-holds 2, expected 3 or more: each of them is left out"),
        (["--experiment", "kite"], "did you mean kite-1.5m"),
    ):
        assert cli.main(["compare", file, "--output", str(tmp_path / "no"), *words]) == 2
        assert message in capsys.readouterr().err
    assert not (tmp_path / "no").exists()
