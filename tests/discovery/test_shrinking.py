"""Whether the gap shrinks: the rule at its thresholds, sums over holds by hand, and which model is which."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from wirebayes.discovery import held_out, shrinking
from wirebayes.discovery.held_out import HeldOut, gap_closed, last_third
from wirebayes.discovery.shrinking import _compared, _Gain
from wirebayes.effects import effect_named
from wirebayes.io.paper import experiments
from wirebayes.model.build import build
from wirebayes.model.spec import ModelSpec
from wirebayes.wire.staircase import simulate


def held(squares: float, elpd: Any = (0.0, 0.0), floor: float = 1.0, inside: float = 0.9) -> HeldOut:
    return HeldOut([9, 10], squares, 10, floor, np.array(elpd, float), inside)


@pytest.mark.parametrize(
    ("final", "error", "flexible", "shrinks"),
    [
        (4.1, 1.0, 0.0, True),
        (3.9, 1.0, 0.0, False),  # a difference below four may be chance
        (4.0, 1.0, 0.0, False),  # and one of four
        (6.1, 3.0, 0.0, True),
        (5.9, 3.0, 0.0, False),  # two standard errors
        (6.0, 3.0, 0.0, False),
        (9.0, 1.0, 9.0, True),  # as good as a smooth curve
        (9.0, 1.0, 9.1, False),
    ],
)
def test_the_gap_shrinks_when_the_gain_is_clear_and_no_curve_does_better(
    final: float, error: float, flexible: float, shrinks: bool
) -> None:
    assert _Gain(final, error, flexible).shrinks is shrinks


def test_the_gap_closed_is_a_share_of_the_excess_over_noise() -> None:
    """Mean squared errors of 5 and 2 above a noise of 1: three quarters of the excess are gone."""
    assert gap_closed(held(5.0), held(2.0)) == pytest.approx(0.75)
    assert gap_closed(held(5.0), held(9.0)) == pytest.approx(-1.0)
    assert gap_closed(held(5.0, floor=7.0), held(1.0)) == 1.0  # the final model's noise counts
    assert gap_closed(held(1.0), held(0.5)) is None  # nothing was in excess
    assert held(4.0).rmse_N == 2.0


@pytest.mark.parametrize(("holds", "train"), [(2, 0), (3, 2), (4, 3), (5, 3), (6, 4), (9, 6), (11, 7)])
def test_the_last_third_is_held_out_where_there_are_three_holds(holds: int, train: int) -> None:
    one = experiments()[2]
    assert last_third(replace(one, holds=one.recorded_holds[:holds])) == train


@pytest.mark.parametrize("remains", [False, True])
def test_gains_are_sums_over_holds_with_their_spread(remains: bool) -> None:
    """Two experiments; fits in the order plain, with the effects, plain with a discrepancy, effects with one."""
    plain, effects = np.array([1.0, 2.0, 3.0, 4.0]), np.array([4.0, 4.0, 4.0, 8.0])
    smooth, both = [np.array([2.0, 3.0]), np.array([4.0, 5.0])], [np.array([7.0, 7.0]), np.array([7.0, 11.0])]
    fits = [plain, effects, *smooth, *(both if remains else [])]
    found = shrinking._gain(fits, 1, 2, remains)
    gained = np.array([6.0, 5.0, 4.0, 7.0] if remains else [3.0, 2.0, 1.0, 4.0])
    assert found.final == gained.sum() and found.flexible == 4.0
    assert found.standard_error == pytest.approx(2.0 * np.std(gained, ddof=1))  # the root of four holds


def test_a_gain_without_named_effects_is_that_of_the_discrepancy() -> None:
    fits = [np.array([1.0, 2.0]), np.array([4.0, 8.0])]
    found = shrinking._gain(fits, 0, 1, True)
    assert found.final == found.flexible == 9.0


def test_a_report_compares_the_final_model_with_the_plain_one() -> None:
    plain, final = held(5.0, [1.0, 2.0], inside=0.5), held(2.0, [4.0, 6.0])
    gain = _Gain(9.0, 1.0, 2.0)
    found = _compared(plain, final, held(3.0), gain)
    assert found["plain"] == {"rmse_N": np.sqrt(5.0), "elpd": 3.0, "coverage_90": 0.5}
    assert found["final"]["elpd"] == 10.0
    assert found["final"]["elpd_difference_se"] == pytest.approx(1.0)  # of 3 and 4: sd √½, times √2
    assert (found["floor_N"], found["gap_closed"], found["shrinks"]) == (1.0, 0.75, True)
    assert found["leave_one_hold_out"]["flexible_elpd_difference"] == 2.0
    alone = _compared(held(5.0, [1.0]), held(2.0, [4.0]), None, None)
    assert alone["final"]["elpd_difference_se"] is None and alone["flexible"] is None
    assert alone["gap_closed"] is None and alone["shrinks"] is False
    assert _compared(plain, final, None, _Gain(0.0, 1.0, 0.0))["shrinks"] is False


def test_an_event_of_another_test_and_a_comparison_of_lengths_do_not_act_on_one_alone() -> None:
    one = experiments()[0]
    slip = replace(effect_named("grip_slip@4"), test=one.name)  # type: ignore[type-var]
    elsewhere, anywhere = replace(slip, test="another"), effect_named("superposition")
    lengths = SimpleNamespace(compares_lengths=True)
    assert shrinking.acting_alone([slip, elsewhere, anywhere, lengths], one) == (slip, anywhere)  # type: ignore[list-item]


def test_a_discrepancy_is_as_slow_as_the_holds_are_long_and_spans_what_is_set() -> None:
    one = experiments()[0]
    long = zip(one.holds, (150.0, 600.0, 200.0), (2.0, 5.0, 3.0), strict=False)
    holds = [replace(h, duration_s=seconds, setting=setting) for h, seconds, setting in long]
    found = shrinking.discrepancy(replace(one, holds=tuple(holds)), 0.3)
    assert found == type(found)(3, 0.3, 200.0, 2.0, 3.0)
    at_once = [replace(h, time_s=0.0 * h.time_s, duration_s=0.0) for h in holds]
    assert shrinking.discrepancy(replace(one, holds=tuple(at_once)), 0.3) == type(found)(3, 0.3, 1.0, 2.0, 3.0)


class Model(SimpleNamespace):
    """A fit that knows its name and its experiments."""


def scored(monkeypatch: pytest.MonkeyPatch, stages: list[str], remains: bool, holds: int = 9) -> list[Any]:
    """Reports of two experiments where a model's squared error says which one it is, and on what."""
    error = {"plain": 50.0, "a": 40.0, "ab": 30.0, "abc": 25.0, "plain~": 20.0, "a~": 15.0, "ab~": 10.0, "abc~": 5.0}
    pair = tuple(replace(e, holds=e.recorded_holds[:holds]) for e in experiments()[1:3])
    models = [Model(name=name, experiments=pair, effects=(), spec=None, scales=None) for name in ("plain", *stages)]

    def predicted(trained: Any, rng: Any) -> list[HeldOut]:
        smooth = "~" if trained.effects == ("discrepancy",) else ""
        assert list(trained.train) == [last_third(e) for e in trained.experiments]
        names = [e.name for e in pair]
        return [held(error[trained.block.name + smooth] + names.index(e.name)) for e in trained.experiments]

    def gained(elpd: list[str], named: int, n: int, remains: bool) -> _Gain:
        base = (["plain", stages[-1]] if stages else ["plain"]) + ["~"] * (4 if remains and stages else 2)
        assert elpd == base and named == bool(stages) and n == 2
        return _Gain(9.0, 1.0, 2.0)

    monkeypatch.setattr(shrinking, "_predicted", predicted)
    monkeypatch.setattr(held_out, "truncated_leave_one_hold_out", lambda fit, rng: fit.name)
    monkeypatch.setattr(shrinking, "with_discrepancy", lambda base, e, rng: ("discrepancy",))
    monkeypatch.setattr(shrinking, "fitted", lambda *given, **_: Model(name="~"))
    monkeypatch.setattr(shrinking, "_gain", gained)
    return shrinking.shrinking(
        models[0],
        models[1:],
        stages,
        remains,
        held_out.LeftOut(np.random.default_rng(0), map),  # type: ignore[arg-type]
        np.random.default_rng(0),
        map,
    )


@pytest.mark.parametrize(
    ("stages", "remains", "final", "flexible"),
    [
        (["a", "ab"], False, 30.0, 20.0),
        (["a", "ab"], True, 10.0, 20.0),
        ([], True, 20.0, 20.0),
        ([], False, 50.0, 0.0),
        (["a"], False, 40.0, 20.0),
        (["a"], True, 15.0, 20.0),
        (["a", "ab", "abc"], False, 25.0, 20.0),
        (["a", "ab", "abc"], True, 5.0, 20.0),
    ],
)
def test_every_model_is_scored_under_its_own_name(
    stages: list[str], remains: bool, final: float, flexible: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    for i, report in enumerate(scored(monkeypatch, stages, remains)):
        squares = {m["model"]: round(m["rmse_N"] ** 2, 9) for m in report.steps}
        alone = {"plain": 50.0, "a": 40.0, "ab": 30.0, "abc": 25.0}
        assert squares == {name: alone[name] + i for name in ("plain", *stages)}
        assert report.held_out["final"]["rmse_N"] ** 2 == pytest.approx(final + i)
        if flexible:
            assert report.held_out["flexible"]["rmse_N"] ** 2 == pytest.approx(flexible + i)
            assert report.held_out["shrinks"]
        else:  # nothing was added, so nothing shrinks
            assert report.held_out["flexible"] is None and not report.held_out["shrinks"]


def test_one_experiment_with_too_few_holds_is_enough_to_hold_none_out(monkeypatch: pytest.MonkeyPatch) -> None:
    pair = experiments()[1], experiments()[2].train(2)
    block: Any = Model(name="plain", experiments=pair, effects=(), spec=None)
    monkeypatch.setattr(shrinking, "_predicted", lambda *given: pytest.fail("predicted"))
    rng = np.random.default_rng(0)
    found = shrinking.shrinking(block, [], [], True, held_out.LeftOut(rng, map), rng, map)
    assert [(f.held_out["holds"], f.held_out["gap_closed"]) for f in found] == [([], None)] * 2
    assert [m["rmse_N"] for m in found[0].steps] == [None] and found[0].held_out is not found[1].held_out


def test_too_few_holds_are_not_held_out(monkeypatch: pytest.MonkeyPatch) -> None:
    found = scored(monkeypatch, ["a"], False, holds=2)
    assert [(f.held_out["holds"], f.held_out["shrinks"], f.held_out["final"]["elpd"]) for f in found] == [
        ([], False, None)
    ] * 2
    assert [m["model"] for m in found[0].steps] == ["plain", "a"]


def test_a_trained_model_predicts_by_what_it_is_made_of(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(held_out, "predicted", lambda *given: given)
    trained = shrinking._Trained(("e",), [4], ("effect",), "block")  # type: ignore[arg-type]
    assert shrinking._predicted(trained, "rng") == (("e",), [4], ("effect",), "block", "rng")  # type: ignore[arg-type, comparison-overlap]


def test_a_discrepancy_is_as_large_as_what_the_effects_leave_over(monkeypatch: pytest.MonkeyPatch) -> None:
    """The root mean square of the readings of that experiment alone, at the best parameters; padding does not count."""
    one, other = experiments()[1].train(4), experiments()[3].train(4)
    values = {
        "k1": 700.0,
        "B": 0.21,
        "U": 0.6,
        "k2": 0.03,
        "N": 0.7,
        "preload": 0.4,
        "sensor_sd": 0.01,
        "setting_sd": 0.02,
    }
    problem = build([one, other])
    best = np.array([values[name.split("[")[0]] for name in problem.names])
    names = [s.name for s in problem.samples]
    block: Any = SimpleNamespace(target=SimpleNamespace(problem=problem), theta=best[None], names=names)
    theta = {name: np.array([value]) for name, value in values.items()}
    for e in (one, other):
        mask = e.protocol().mask
        left = (e.tension() - simulate(e.protocol(), theta)[..., 0])[mask]
        assert shrinking.residual_rms(block, e.name) == pytest.approx(np.sqrt((left**2).mean()))

    asked: list[Any] = []

    def fitted(*given: Any, scales: Any) -> Any:
        asked.append((*given, scales))
        return block

    monkeypatch.setattr(shrinking, "fitted", fitted)
    slip = replace(effect_named("grip_slip@4"), test="another")  # type: ignore[type-var]
    whole: Any = SimpleNamespace(
        effects=(slip, effect_named("superposition")),
        spec=ModelSpec(history="additive"),
        names=(one.name, other.name),
        experiments=(one, other),
        scales="scales",
    )
    memory, smooth = shrinking.with_discrepancy(whole, other, "rng")  # type: ignore[arg-type]
    assert memory is whole.effects[1] and asked == [([other], (memory,), whole.spec, "rng", "scales")]
    assert smooth == shrinking.discrepancy(other, shrinking.residual_rms(block, other.name))
    # a block that is this experiment alone has been fitted, its first holds have not
    block.effects, block.experiments, block.names = (memory,), (other,), (other.name,)
    block.spec, block.scales = ModelSpec(history="additive"), "scales"
    first = other.train(3)
    monkeypatch.setattr(shrinking, "residual_rms", lambda fit, name: 0.5 if fit is block else np.nan)
    _, smooth = shrinking.with_discrepancy(block, other, "rng")  # type: ignore[arg-type]
    assert smooth == shrinking.discrepancy(other, 0.5) and len(asked) == 1
    shrinking.with_discrepancy(block, first, "rng")  # type: ignore[arg-type]
    assert asked[1:] == [([first], (memory,), whole.spec, "rng", "scales")]


def test_a_gain_is_reported_by_its_three_numbers() -> None:
    assert _Gain(9.0, 1.0, 2.0).to_dict() == {
        "elpd_difference": 9.0,
        "elpd_difference_se": 1.0,
        "flexible_elpd_difference": 2.0,
    }
