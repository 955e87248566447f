"""Effects led up a ladder of amplitudes, and the global test over names."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from wirebayes.discovery import ascent, continuation, noise_integral, path_weights, refit, screening
from wirebayes.discovery.ascent import PathEvidence, Start, lead, start
from wirebayes.discovery.continuation import Continuation, strengths
from wirebayes.discovery.ladders import AmplitudePath, _LadderEnds, _rungs, ladders
from wirebayes.discovery.linear_scan import expand, scan
from wirebayes.discovery.name_evidence import weigh_names
from wirebayes.discovery.noise_integral import RATIOS
from wirebayes.discovery.scans import Scan
from wirebayes.discovery.screening import GlobalTest
from wirebayes.discovery.surprise import Scale, empirical_surprise
from wirebayes.discovery.tangent import Tangent, moving_columns
from wirebayes.effects import CATALOGUE, effect_named
from wirebayes.inference.laplace_fit import LaplaceFit, fitted
from wirebayes.io.experiment_file import read_experiments
from wirebayes.model.likelihoods import reading_variance
from wirebayes.model.spec import PLAIN_SPEC
from wirebayes.simulation.synthetic import Bench, Truth, write_tests
from wirebayes.wire.effect import Effect
from wirebayes.wire.staircase import simulate

Array = NDArray[Any]

STIFF = {"k1": 3000.0, "B": 0.02, "U": 0.8, "k2": 0.02, "N": 0.7, "preload": 0.1, "sensor_sd": 0.02, "setting_sd": 0.01}


def block_of(folder: Path, truth: dict[str, float], effects: list[Effect], seed: int) -> LaplaceFit:
    write_tests(folder, [Bench()], Truth(STIFF | truth, effects), seed)
    experiments = read_experiments(folder / "experiments.toml")
    return fitted(experiments, (), PLAIN_SPEC, np.random.default_rng(0))


def scanned(block: LaplaceFit, kinds: dict[str, type[Effect]]) -> tuple[list, list, Scan]:
    trials, candidates = screening.candidate_probes([block], kinds)
    return trials, candidates, scan(expand(block.target, block.z, trials))


@pytest.mark.parametrize(("widest", "rungs"), [(2.0, 2), (2.01, 3), (64.0, 7), (64.1, 8), (1e4, 8)])
def test_rungs_are_a_factor_of_two_apart_unless_they_would_be_more_than_eight(widest: float, rungs: int) -> None:
    ends = [_LadderEnds(None, 0.5, 0.5 * widest), _LadderEnds(None, -3.0, -3.0 * widest / 2.0)]  # type: ignore[arg-type]
    made = _rungs(ends)
    assert made.shape == (rungs, 2)
    assert made[[0, -1]] == pytest.approx(np.array([[0.5, -3.0], [0.5 * widest, -1.5 * widest]]))


@pytest.mark.parametrize(
    ("name", "size"), [("creep_threshold", 12.0), ("strain_stiffening", 12.0), ("tension_dependent_rate", 1.5)]
)
def test_a_ladder_finds_what_refits_of_the_whole_density_find(tmp_path: Path, name: str, size: float) -> None:
    """Newton's method on the density itself, noise and all, pinned at many amplitudes, shares no step with it.

    To a quarter: a path knows an amplitude's prior at its best amplitude alone, and says only what is worth a refit.
    """
    effect = effect_named(name)
    block = block_of(tmp_path, {effect.columns()[0]: size}, [effect], 1)
    trials, candidates, data = scanned(block, {name: CATALOGUE[name]})
    ways = ladders([block], trials, candidates, [data])
    found = strengths(ways, [{0: lead(block, way, start(block, block.z))} for way in ways])
    best = max(range(len(trials)), key=lambda k: data.effects[0, k])
    per_delta = 1.0 / float(data.norm[0, best])
    truth = refit.refit([block], (0,), trials[best].effect, per_delta, float(data.amplitude[0, best]))
    assert truth.log_bayes > 5.0  # the case is worth testing
    assert max(float(v[0]) for v in found.values()) == pytest.approx(truth.log_bayes, rel=0.25)


def test_a_wire_that_goes_slack_in_every_hold_is_climbed_past() -> None:
    """No setting error moves a reading there, so that what setting errors do has no size to be measured in."""
    experiments = read_experiments(Path(__file__).parents[1] / "data" / "all-slack.toml")
    block = fitted(experiments, (), PLAIN_SPEC, np.random.default_rng(0))
    trials, candidates, data = scanned(block, {"strain_stiffening": CATALOGUE["strain_stiffening"]})
    (way,) = ladders([block], trials, candidates, [data])
    found = lead(block, way, start(block, block.z))
    assert np.isfinite([found.log_bayes, found.amplitude, found.norm]).all() and found.log_bayes.max() > -2.0


def test_a_data_set_without_a_tangent_says_nothing_and_changes_no_other(tmp_path: Path) -> None:
    block = block_of(tmp_path, {}, [], 3)
    trials, _ = screening.candidate_probes([block], {"toe": CATALOGUE["toe"]})
    x = expand(block.target, np.repeat(block.z, 3, axis=0), trials)
    for name in ("parameters", "residual", "flexible", "signatures"):
        for wild in (np.nan, np.inf, 1e200):
            part = getattr(x, name).copy()
            part[1] = wild
            found, before = scan(replace(x, **{name: part})), scan(x)
            assert found.effects[1] == pytest.approx(0.0) and found.flexible[1] == pytest.approx(0.0)
            np.testing.assert_allclose(found.effects[[0, 2]], before.effects[[0, 2]], rtol=1e-6, atol=1e-6)


def test_rows_climb_alone(tmp_path: Path) -> None:
    """A data set says the same in any company."""
    block = block_of(tmp_path, {}, [], 3)
    trials, candidates, data = scanned(block, {"toe": CATALOGUE["toe"]})
    drawn = screening.replicated(block, trials, 30, np.random.default_rng(0))
    way = ladders([block], trials, candidates, [data])[0]
    together = lead(block, way, start(block, drawn.z, drawn.readings)).log_bayes
    for i in (0, 11, 22):
        own = start(block, drawn.z[i : i + 1], [y[..., i : i + 1] for y in drawn.readings])
        alone = lead(block, way, own).log_bayes
        np.testing.assert_allclose(together[:, i], alone[:, 0], rtol=1e-4, atol=1e-3)


def test_a_large_effect_that_the_plain_fit_took_in_is_seen_further_out(tmp_path: Path) -> None:
    kinds = {name: CATALOGUE[name] for name in ("creep_threshold", "permanent_creep", "strain_stiffening")}
    block = block_of(tmp_path, {"creep_threshold.tau_c": 16.0}, [effect_named("creep_threshold")], 1)
    trials, candidates, data = scanned(block, kinds)
    drawn = screening.replicated(block, trials, 199, np.random.default_rng(1))
    near = screening.global_test(candidates, [data], [drawn.scan])
    larger = Continuation([block], trials, candidates, [data])
    far, log_bayes = larger.test([drawn], near), larger.log_bayes
    assert far.surprises["creep_threshold"] > near.surprises["creep_threshold"] + 1.0
    assert far.p == 1 / (1 + len(far.null)) and max(log_bayes, key=lambda c: log_bayes[c]).name == "creep_threshold"


def test_all_noise_ratios_at_once_are_what_dense_algebra_says_of_each() -> None:
    rng = np.random.default_rng(0)
    n, readings, holds, p, degrees = 70, 12, 3, 4, 8
    k = rng.normal(size=(n, readings, holds))
    left, singular, _ = np.linalg.svd(k, full_matrices=False)
    gradient, residual = rng.normal(size=(n, p)), rng.normal(size=(n, readings))
    precision = rng.uniform(0.5, 2.0, size=(n, p))[..., None] * np.eye(p)
    parameters, signature = rng.normal(size=(n, readings, p)), rng.normal(size=(n, readings))
    one = np.ones(n)
    x = Tangent(residual, parameters, left, singular, one, gradient, precision, 1e-6 * one, one)
    found = path_weights.weigh(x, signature, -0.1, 0.2, degrees)
    for i in (0, n - 1):  # of several pieces
        heights, moves, steps, promises = [], [], [], []
        for ratio in RATIOS:
            inverse = np.linalg.inv(np.eye(readings) + ratio * k[i] @ k[i].T)
            pp = parameters[i].T @ inverse @ parameters[i] + precision[i]
            pr = parameters[i].T @ inverse @ residual[i] + gradient[i]
            free = signature[i] - parameters[i] @ np.linalg.solve(pp, parameters[i].T @ inverse @ signature[i])
            c = free @ inverse @ signature[i]
            b = signature[i] @ inverse @ residual[i] - pr @ np.linalg.solve(
                pp, parameters[i].T @ inverse @ signature[i]
            )
            a = np.clip(b / c, -0.1, 0.2)
            volume = 0.5 * np.linalg.slogdet(inverse)[1] - 0.5 * np.linalg.slogdet(pp)[1]
            left_over = residual[i] @ inverse @ residual[i] - 2 * a * b + a**2 * c
            heights.append(volume - 0.5 * degrees * np.log(left_over))
            moves.append(a)
            steps.append(np.linalg.solve(pp, pr))
            promises.append(0.5 * degrees * np.log(left_over / max(left_over - steps[-1] @ pr, 1e-6 * degrees)))
        best = int(np.argmax(heights))
        assert found.height[i] == pytest.approx(np.logaddexp.reduce(heights), rel=1e-9)
        assert found.move[i] == pytest.approx(moves[best], rel=1e-6) and found.ratio[i] == RATIOS[best]
        assert found.promise[i] == pytest.approx(promises[best], rel=1e-6)
        np.testing.assert_allclose(found.step[i], steps[best], rtol=1e-6)


@pytest.mark.parametrize(("promise", "goes_on"), [(0.0499, False), (0.05, True)])
def test_no_step_is_tried_that_promises_too_little(
    promise: float, goes_on: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    block = block_of(tmp_path, {}, [], 3)
    trials, candidates, data = scanned(block, {"strain_stiffening": CATALOGUE["strain_stiffening"]})
    way = ladders([block], trials, candidates, [data])[0]
    weigh, follow, tried = ascent.weigh, ascent.stepped, []

    def promising(*arguments: Any) -> Any:
        found = weigh(*arguments)
        return replace(found, promise=np.full(len(found.promise), promise))

    def followed(*arguments: Any) -> Any:
        tried.append(len(arguments[1]))
        return follow(*arguments)

    monkeypatch.setattr(ascent, "weigh", promising)
    monkeypatch.setattr(ascent, "stepped", followed)
    begin = start(block, block.z)
    assert bool(tried) == goes_on
    tried.clear()
    lead(block, way, begin)
    assert bool(tried) == goes_on


def test_what_a_smooth_process_takes_is_its_determinant_and_its_part_of_the_square() -> None:
    rng = np.random.default_rng(0)
    root, along = rng.normal(size=(5, 7, 4)), rng.normal(size=(5, 4))
    square = np.swapaxes(root, 1, 2) @ root
    log_volume, less = noise_integral._taken_by(square, along)
    for i in range(5):
        for j, size in enumerate(noise_integral.SIZES):
            share = size**2 / np.trace(square[i])
            whole = np.eye(4) + share * square[i]
            assert log_volume[i, j] == pytest.approx(0.5 * np.linalg.slogdet(whole)[1], rel=1e-10)
            assert less[i, j] == pytest.approx(share * along[i] @ np.linalg.solve(whole, along[i]), rel=1e-10)


def test_simulations_that_come_later_are_climbed_and_the_others_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    block = block_of(tmp_path, {"strain_stiffening.c": 12.0}, [effect_named("strain_stiffening")], 1)
    trials, candidates, data = scanned(block, {"strain_stiffening": CATALOGUE["strain_stiffening"]})
    drawn = [screening.replicated(block, trials, 40, np.random.default_rng(i)) for i in (0, 1)]
    both = screening.joined_replicates(drawn)
    rows: list[int] = []

    def counted(block: LaplaceFit, way: AmplitudePath, begin: Start) -> PathEvidence:
        rows.append(begin.data_sets)
        return lead(block, way, begin)

    monkeypatch.setattr(continuation, "lead", counted)
    larger, anew = (Continuation([block], trials, candidates, [data]) for _ in range(2))
    monkeypatch.setattr(continuation, "BY_LARGER", 1.0)  # no surprise is too small to be found out
    for each in (larger, anew):
        each._values = {"strain_stiffening": 50.0}  # more than the scan says
    for simulated in (drawn[0], both):
        found = larger.test([simulated], screening.global_test(candidates, [data], [simulated.scan]))
    assert rows == [1, 1, 40, 40]
    again = anew.test([both], screening.global_test(candidates, [data], [both.scan]))
    assert found.surprises == again.surprises and anew.log_bayes == larger.log_bayes


@pytest.mark.parametrize(("as_high", "counts"), [(0, True), (19, True), (20, False), (400, False)])
def test_larger_effects_count_where_they_are_clear(as_high: int, counts: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """A name that by its ladder surprises as much as the most surprising name in 2 % of the data sets, or less."""
    null = np.linspace(0.0, 10.0, 999)
    height = float(null[-1 - as_high] + 0.001)
    test = GlobalTest(
        {"a": np.linspace(-2.0, 4.0, 999)}, {"a": Scale.of(np.linspace(-2.0, 4.0, 999))}, {"a": 1.0, "b": 5.0}, null
    )
    larger = Continuation.__new__(Continuation)
    larger._values = {"a": 20.0}
    monkeypatch.setattr(Continuation, "_chance", lambda *given: np.empty(0))
    monkeypatch.setattr(continuation, "_surprise", lambda value, chance: height)
    found = larger.test([], test)
    assert found.p == ((1 + as_high) / 1000 if counts else test.p) and test.p == 0.501
    assert found.surprises == ({"a": height, "b": 5.0} if counts else test.surprises)


@pytest.mark.parametrize(("rank", "led"), [(18, ["a"]), (20, [])])
def test_what_could_not_become_clear_is_not_led_through_the_simulations(
    rank: int, led: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A path only raises the simulations: a value that so many exceed in the scan already is no more surprising."""
    null = np.log(1000.0) - np.log(np.arange(1.0, 1000.0))  # of one name alone: the k-th is as surprising as k in 1,000
    scale = Scale.of(np.linspace(-2.0, 4.0, 999))
    larger = Continuation.__new__(Continuation)
    larger._values = {"a": scale.value(float(null[rank]))}
    tried: list[str] = []
    monkeypatch.setattr(Continuation, "_chance", lambda self, name, *given: tried.append(name) or np.full(999, 9.0))
    larger.test([], GlobalTest({"a": np.linspace(-2.0, 4.0, 999)}, {"a": scale}, {"a": 0.0}, null))
    assert tried == led


def test_a_path_that_adds_nothing_is_not_led_through_the_simulations(monkeypatch: pytest.MonkeyPatch) -> None:
    """The scan has said already how surprising that value is."""
    larger = Continuation.__new__(Continuation)
    larger._values = {"a": 9.0}
    monkeypatch.setattr(Continuation, "_chance", lambda *given: pytest.fail("it was"))
    scale, null = Scale.of(np.linspace(-2.0, 4.0, 999)), np.linspace(0.0, 5.0, 99)
    test = GlobalTest({"a": null}, {"a": scale}, {"a": float(scale.surprise(9.0))}, null)
    assert larger.test([], test).p == test.p == 0.01


@pytest.mark.parametrize(("value", "climbed"), [(0.0, 40), (2.0, 80), (2.9, 160), (9.0, 320)])
def test_no_more_simulations_climb_than_it_takes(value: float, climbed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Once several are as high as the data, these cannot be surprising enough."""
    larger, simulated = paths_of_one_name(value, monkeypatch)
    found = larger._chance("a", np.full(999, -2.0), [simulated], needed=np.log(1000 / 3), largest=np.inf)
    assert len(found) == climbed


@pytest.mark.parametrize("more", [0.0, 1e-9])
def test_what_is_clearly_more_surprising_than_all_simulations_needs_no_more(
    more: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    larger, simulated = paths_of_one_name(9.0, monkeypatch)
    surprise = continuation._surprise(9.0, simulated.z[:160, 0])
    found = larger._chance("a", np.full(999, -2.0), [simulated], needed=8.0, largest=surprise - 3.0 + more)
    assert (len(found) == 160) == (more == 0.0)


def paths_of_one_name(value: float, monkeypatch: pytest.MonkeyPatch) -> tuple[Continuation, Any]:
    """The data's log Bayes factor, and simulations of which 100 in a row have all from 0 to 3."""
    larger = Continuation.__new__(Continuation)
    way: Any = SimpleNamespace(effect=SimpleNamespace(name="a"))
    larger._values, larger._known, larger._ways = {"a": value}, {}, [way]
    simulated: Any = SimpleNamespace(z=np.tile(np.arange(100.0), 10)[:999, None] / 33.0, readings=[])
    monkeypatch.setattr(Continuation, "_strengths", lambda self, ways, plain: {"a": plain[0][0][:, 0]})
    return larger, simulated


def test_no_setting_error_of_several_steps_explains_a_clamp_transient(tmp_path: Path) -> None:
    """Seven dense holds: setting errors of three steps, which no bench has, would describe them."""
    times = (0.0, *np.geomspace(1.0, 600.0, 24).round(1).tolist())
    bench = Bench(length_mm=1272.0, resolution_N=0.0, displacements_mm=tuple(range(1, 8)), times_s=times)
    wire = {"k1": 500.0, "B": 0.04, "U": 0.75, "k2": 0.008, "N": 0.5, "sensor_sd": 0.007, "setting_sd": 0.026}
    effect = effect_named("clamp_transient")
    write_tests(tmp_path, [bench], Truth(wire | {"clamp_transient.a": -0.05, "clamp_transient.T": 31.0}, [effect]), 0)
    experiments = read_experiments(tmp_path / "experiments.toml")
    block = fitted(experiments, (), PLAIN_SPEC, np.random.default_rng(0))
    assert block.parameters("simulated")["setting_sd"] < 0.5
    kinds = {name: CATALOGUE[name] for name in ("clamp_transient", "strain_stiffening")}
    trials, candidates, data = scanned(block, kinds)
    drawn = screening.replicated(block, trials, 499, np.random.default_rng(1))
    near = screening.global_test(candidates, [data], [drawn.scan])
    larger = Continuation([block], trials, candidates, [data])
    assert min(near.p, larger.test([drawn], near).p) <= 0.04
    chosen = weigh_names([block], trials, candidates, [data])
    assert max(chosen.winners, key=chosen.log_bayes.__getitem__) == "clamp_transient"
    assert chosen.winners["clamp_transient"][0].amplitude == pytest.approx(-0.05, abs=0.005)


def test_a_ladder_broken_off_keeps_the_places_of_its_rungs(tmp_path: Path) -> None:
    """Blocks that share an amplitude are added rung by rung, also where one of them gave up."""
    block = block_of(tmp_path, {}, [], 3)
    trials, candidates, data = scanned(block, {"permanent_creep": CATALOGUE["permanent_creep"]})
    way = ladders([block], trials, candidates, [data])[0]
    found = lead(block, way, start(block, block.z))
    rungs, starts = way.amplitudes.shape
    assert found.log_bayes.shape == found.amplitude.shape == found.norm.shape == ((rungs + 1) * starts, 1)
    assert (found.log_bayes < -1e200).any()  # it was broken off: no more than all creep can be permanent


def test_the_noise_ratio_of_a_fit_is_that_of_its_setting_and_sensor_errors(tmp_path: Path) -> None:
    """Sensor variance times I + ρKKᵀ is the covariance that steps of each hold's setting error give."""
    block = block_of(tmp_path, {}, [], 3)
    x, sample = expand(block.target, block.z, []), block.target.problem.samples[0]
    own = block.target.problem.parameters(block.theta, sample)
    mask, holds, step = sample.protocol.mask, len(sample.readings), 1e-5
    each = {name: np.repeat(value, holds) for name, value in own.items()}
    up, down = (simulate(sample.protocol, each, sample.model, s * np.eye(holds))[mask] for s in (step, -step))
    by_setting = (up - down) / (2 * step)
    variance = float(reading_variance(own["sensor_sd"], sample.resolution)[0])
    covariance = variance * np.eye(mask.sum()) + float(own["setting_sd"][0]) ** 2 * by_setting @ by_setting.T
    implied = variance * (np.eye(mask.sum()) + x.ratio[0] * x.left[0] * x.singular[0] ** 2 @ x.left[0].T)
    np.testing.assert_allclose(implied, covariance, rtol=1e-4, atol=1e-6 * covariance.max())


@pytest.mark.statistical
def test_the_most_surprising_name_is_as_surprising_as_said(monkeypatch: pytest.MonkeyPatch) -> None:
    """p is uniform whatever the tails and the correlations of the names: an analytic case, one row as the data."""
    rng = np.random.default_rng(0)
    values = []
    for _ in range(2000):
        common = rng.exponential(size=100)
        names = {str(k): np.maximum(common, s * rng.exponential(size=100)) for k, s in enumerate((0.3, 1.0, 1.0, 3.0))}
        chance = {name: v[1:] for name, v in names.items()}
        monkeypatch.setattr(screening, "by_name", lambda candidates, scans: scans)
        found = {name: v[:1] for name, v in names.items()}
        values.append(screening.global_test([], found, chance).p)  # type: ignore[arg-type]
    for alpha in (0.02, 0.04, 0.1, 0.5):
        share, sd = np.mean(np.array(values) <= alpha), np.sqrt(alpha * (1 - alpha) / 2000)
        assert abs(share - alpha) < 4 * sd, alpha


def test_an_effect_gets_no_credit_for_what_the_plain_fit_gains_nearby(tmp_path: Path) -> None:
    """Ladders begun beside the plain fit give the same, because what they are compared with moves as well."""
    block = block_of(tmp_path, {}, [], 3)
    trials, candidates, data = scanned(block, {"toe": CATALOGUE["toe"]})
    way = ladders([block], trials, candidates, [data])[0]
    best, beside = start(block, block.z), block.z.copy()
    free = moving_columns(block.target.problem)
    beside[:, free] += 0.3 / np.sqrt(np.diag(block.modes.curvature[0]))[free]
    moved = start(block, beside)
    assert moved.log_density[0] == pytest.approx(best.log_density[0], abs=0.06)
    climbed = [lead(block, way, begin).log_bayes.max() for begin in (best, moved)]
    assert climbed[0] == pytest.approx(climbed[1], abs=0.12)  # each settles within .05


def test_a_path_surprises_as_much_as_both_the_line_and_the_count_say() -> None:
    rng = np.random.default_rng(0)
    short, long = rng.exponential(size=999), rng.standard_cauchy(size=999)
    few = np.minimum(short, 4.0)  # by chance, none of some eighteen that should exceed it
    assert continuation._surprise(4.5, few) == Scale.of(few).surprise(4.5) < empirical_surprise(4.5, few)
    assert continuation._surprise(100.0, long) == empirical_surprise(100.0, long) < Scale.of(long).surprise(100.0)
