"""Held-out holds in `discover`: the 90 % band against the dense normal, and truncated importance weights."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from tests.model.dense import given, jacobian, normal
from tests.simulated import simulated_tests
from wirebayes.discovery import held_out
from wirebayes.effects import effect_named
from wirebayes.inference.laplace_fit import fitted
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.inference.optimum import Optimum
from wirebayes.inference.sampler.ensemble import sample_posterior
from wirebayes.io.experiment import Experiment
from wirebayes.model.build import build
from wirebayes.model.scales import Scales
from wirebayes.model.spec import PLAIN_SPEC, ModelSpec
from wirebayes.simulation.synthetic import Bench, Truth
from wirebayes.wire.model import Model

SCALES = Scales(1.0, 12.0, 4.0, 120.0, 0.3)

WIRE = {"k1": 900.0, "B": 0.25, "U": 0.6, "k2": 0.05, "N": 0.7, "preload": 0.4, "sensor_sd": 0.01, "setting_sd": 0.02}
TRAIN = 7


def moved(experiment: Experiment, deviations: float) -> Experiment:
    """The readings of the holds after training, so many predictive standard deviations above their prediction."""
    r, covariance, hold = normal(experiment.protocol(), WIRE, Model(), experiment.tension(), experiment.resolution_N)
    past = hold < TRAIN
    gain, left = given(covariance, past)
    sd = np.sqrt(np.diag(left))
    nominal = experiment.tension()[TRAIN:].ravel() - r[~past]
    readings = (nominal + gain @ r[past] + deviations * sd).reshape(-1, experiment.tension().shape[1])
    later = [replace(h, readings=row) for h, row in zip(experiment.holds[TRAIN:], readings, strict=True)]
    return replace(experiment, holds=(*experiment.holds[:TRAIN], *later))


@pytest.mark.parametrize("side", [-1, 1])
def test_readings_are_inside_up_to_1_645_predictive_standard_deviations(
    side: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    experiment = simulated_tests([Bench()], Truth(WIRE), seed=2)[0]
    problem = build([experiment.train(TRAIN)])
    theta = np.tile([WIRE[name] for name in problem.names], (4000, 1))  # a posterior that is one point
    monkeypatch.setattr(held_out, "fitted", lambda *_, **__: None)
    monkeypatch.setattr(held_out, "_draws", lambda *_: (problem, theta))
    block = SimpleNamespace(effects=None, spec=PLAIN_SPEC, scales=None)
    # a quantile of 4000 normal draws has a standard error of 0.033 standard deviations
    for deviations, share in ((1.5, 1.0), (1.8, 0.0)):
        measured = moved(experiment, side * deviations)
        [found] = held_out.predicted([measured], [TRAIN], (), block, np.random.default_rng(0))  # type: ignore[arg-type]
        assert found.holds == [8, 9, 10, 11, 12] and found.readings == 5 * experiment.tension().shape[1]
        assert found.inside == share, deviations


def test_importance_weights_are_truncated(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ionides (2008): no importance weight above the mean weight times the square root of their number."""
    rng = np.random.default_rng(0)
    density = stats.lognorm(0.7).rvs((4, 1500), random_state=rng)
    density[1, 3] = 1e-9  # a draw under which hold 2 could hardly have happened
    density[2, :40] = 1e-5
    impossible = density.copy()
    impossible[0, 7] = 0.0
    recorded = np.array([True, True, True, False])
    problem = SimpleNamespace(
        leave_one_hold_out=lambda theta: [np.log(density)],
        samples=[SimpleNamespace(protocol=SimpleNamespace(recorded=recorded))],
    )
    monkeypatch.setattr(held_out, "_draws", lambda *_: (problem, np.zeros((1500, 1))))
    found = held_out.truncated_leave_one_hold_out(SimpleNamespace(), rng)  # type: ignore[arg-type]
    expected = []
    for p in density[:3]:
        weight = np.minimum(1 / p, np.mean(1 / p) * np.sqrt(1500))
        expected.append(np.log(np.average(p, weights=weight)))
    assert found == pytest.approx(expected, rel=1e-9)
    whole = np.log(stats.hmean(density[:3], axis=1))  # what weights without a ceiling give
    assert found[0] == pytest.approx(whole[0]) and found[1] > whole[1] + 3.0
    with np.errstate(divide="ignore"):  # a hold that cannot happen under one draw is not predicted by the others at all
        problem.leave_one_hold_out = lambda theta: [np.log(impossible)]
        found = held_out.truncated_leave_one_hold_out(SimpleNamespace(), rng)  # type: ignore[arg-type]
    assert found[0] < -1e5 and found[1:] == pytest.approx(expected[1:], rel=1e-9)


def test_a_fit_is_scored_once_however_often_it_is_compared(monkeypatch: pytest.MonkeyPatch) -> None:
    scored: list[str] = []

    def score(fit: list[str], rng: np.random.Generator) -> NDArray[Any]:
        scored.append(fit[0])
        return rng.normal(size=3)

    monkeypatch.setattr(held_out, "truncated_leave_one_hold_out", score)
    plain, again, other = ["plain"], ["plain"], ["other"]  # two fits may be equal, and are two
    left_out: Any = held_out.LeftOut(np.random.default_rng(0), map)
    first = left_out.of([plain, other, plain])
    second = left_out.of([other, again, plain])
    assert scored == ["plain", "other", "plain"]
    assert first[0] is first[2] is second[2] and first[1] is second[0] and not np.allclose(second[1], first[0])
    assert left_out.of([]) == []


def test_scores_of_several_draws_are_averages_over_them() -> None:
    """Two stiffnesses, each with the dense normal of its own: the mean density, the mean prediction, the mean noise."""
    experiment = simulated_tests([Bench(unrecorded=frozenset({3}))], Truth(WIRE), seed=2)[0]
    problem = build([experiment])
    sample = problem.samples[0]
    members = [WIRE | {"k1": k1} for k1 in (880.0, 920.0)]
    theta = np.array([[values[name] for name in problem.names] for values in members])
    densities, means, floors = [], [], []
    for values in members:
        r, covariance, hold = normal(sample.protocol, values, sample.model, experiment.tension(), sample.resolution)
        _, derivative = jacobian(sample.protocol, values, sample.model)
        own = np.concatenate([derivative[j, sample.protocol.mask[j], j] for j in range(12)])
        past = hold < 9  # the first eight that were recorded
        gain, left = given(covariance, past)
        error = r[~past] - gain @ r[past]
        densities.append(
            [
                stats.multivariate_normal(error[at] * 0.0, left[np.ix_(at, at)]).pdf(error[at])
                for at in (hold[~past] == j for j in (9, 10, 11))
            ]
        )
        means.append(error)
        noise = values["sensor_sd"] ** 2 + sample.resolution**2 / 12.0
        floors.append((noise + own**2 * values["setting_sd"] ** 2)[~past])
    own_parameters = problem.parameters(theta, sample)
    found = held_out._scored(sample, sample.model, own_parameters, 8, np.random.default_rng(0))
    assert found.holds == [10, 11, 12] and found.readings == 3 * experiment.tension().shape[1]
    assert found.elpd == pytest.approx(np.log(np.mean(densities, axis=0)), rel=1e-6)
    assert found.squares == pytest.approx((np.mean(means, axis=0) ** 2).mean(), rel=1e-6)
    assert found.floor == pytest.approx(np.mean(floors), rel=1e-6)
    assert found.rmse_N == pytest.approx(np.sqrt(found.squares))
    # a draw with which the model cannot be computed has no density
    theta[1, problem.names.index("k1")] = np.nan
    with np.errstate(invalid="ignore"):
        broken = held_out._scored(sample, sample.model, problem.parameters(theta, sample), 8, np.random.default_rng(0))
    assert broken.elpd == pytest.approx(np.log(np.array(densities[0]) / 2.0), rel=1e-6)


@pytest.mark.parametrize(("same", "near"), [(True, [1.0, 2.0]), (False, None)])
def test_training_begins_at_the_block_s_own_fit_where_it_has_the_same_effects(
    same: bool, near: list[float] | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On the first holds of each experiment, with the laws of the block and five hundred draws."""
    pair = simulated_tests([Bench("a"), Bench("b", displacements_mm=(1, 2, 3, 4))], Truth(WIRE), seed=2)
    effects = (effect_named("superposition"),)
    problem = build([e.train(k) for e, k in zip(pair, (7, 3), strict=True)], effects, spec=ModelSpec(law="modified"))
    given: list[tuple[object, ...]] = []

    def fitted(experiments: list[Experiment], *rest: object, scales: object) -> str:
        assert scales == SCALES
        given.append(([len(e.recorded_holds) for e in experiments], *rest))
        return "trained"

    def draws(trained: str, rng: object, n: int, wanted: float) -> tuple[object, np.ndarray]:
        assert trained == "trained" and n == 4000 and wanted == 5000
        values = WIRE | {"superposition.omega": 0.5}
        return problem, np.tile([values[name.split("[")[0]] for name in problem.names], (5, 1))

    monkeypatch.setattr(held_out, "fitted", fitted)
    monkeypatch.setattr(held_out, "_draws", draws)
    theta = np.array([[1.0, 2.0]])
    spec = ModelSpec(law="modified")
    block = SimpleNamespace(effects=effects if same else (), spec=spec, target=None, scales=SCALES, theta=theta)
    found = held_out.predicted(pair, [7, 3], effects, block, np.random.default_rng(0))  # type: ignore[arg-type]
    ((counts, extra, asked, _, start),) = given
    assert (counts, extra, asked) == ([7, 3], effects, spec)
    assert start is None if near is None else start.tolist() == near  # type: ignore[attr-defined]
    assert [one.holds for one in found] == [[8, 9, 10, 11, 12], [4]]


def test_draws_of_a_block_come_with_all_its_parameters(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        held_out.rough_draws, "draws", lambda target, modes, rng, n, wanted: (target.problem, modes, n, wanted)
    )
    monkeypatch.setattr(held_out, "completed", lambda problem, theta, rng: (f"whole {problem}", theta, None))
    block = SimpleNamespace(target=SimpleNamespace(problem="problem"), modes="modes")
    assert held_out._draws(block, np.random.default_rng(0), 7, 9.0) == (  # type: ignore[arg-type]
        "whole problem",
        ("problem", "modes", 7, 9.0),
    )


def test_errors_of_predictions_with_a_long_tail_are_those_of_a_long_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """The posterior of B and U is curved here; with 500 draws the error of the mean was half as large."""
    creep = {"B": 0.35, "U": 0.8, "k2": 0.03, "N": 0.6, "tension_dependent_rate.m": 0.8}
    effects = (effect_named("tension_dependent_rate"),)
    displacements = [*range(1, 13), *range(11, 6, -1)]
    bench = Bench(length_mm=1200.0, displacements_mm=displacements, times_s=[0, 15, 30, 60, 120])
    tests = simulated_tests([bench], Truth(WIRE | creep | {"setting_sd": 0.006}, effects), seed=2)
    train = [held_out.last_third(tests[0])]
    block = fitted(tests, effects, PLAIN_SPEC, np.random.default_rng(0))
    [found] = held_out.predicted(tests, train, effects, block, np.random.default_rng(1))

    def long_run(target: LogPosterior, modes: Optimum, *_: object) -> np.ndarray:
        chains = sample_posterior(target, 2, found=modes)
        return target.coordinates.to_natural(chains.z.reshape(-1, chains.z.shape[-1]))

    monkeypatch.setattr(held_out.rough_draws, "draws", long_run)
    [expected] = held_out.predicted(tests, train, effects, block, np.random.default_rng(1))
    assert found.rmse_N == pytest.approx(expected.rmse_N, rel=0.2)
    assert found.elpd.sum() == pytest.approx(expected.elpd.sum(), abs=1.0)


@pytest.mark.parametrize(("deviations", "share"), [(1.5, 1.0), (-1.5, 1.0), (1.8, 0.0), (-1.8, 0.0)])
def test_what_is_not_known_of_the_creep_widens_the_bands(
    deviations: float, share: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A stiff wire of which only the first hold was read, and that crept unseen in a second one."""
    wire = WIRE | {"k1": 4000.0, "B": 1.0, "sensor_sd": 0.05, "setting_sd": 0.1}
    bench = Bench(displacements_mm=(2, 4, 6), unrecorded=frozenset({2}))
    experiment = simulated_tests([bench], Truth(wire), seed=2)[0]
    problem = build([experiment])
    sample = problem.samples[0]
    r, covariance, hold = normal(sample.protocol, wire, Model(), experiment.tension(), sample.resolution)
    past = hold < 2
    gain, left = given(covariance, past)
    readings = sample.readings.copy()
    readings[2, :, 0] += gain @ r[past] - r[~past] + deviations * np.sqrt(np.diag(left))
    own = problem.parameters(np.tile([wire[name] for name in problem.names], (4000, 1)), sample)
    moved = replace(sample, readings=readings)
    assert held_out._scored(moved, moved.model, own, 1, np.random.default_rng(0)).inside == share
