"""An instrument's amplitude over several materials, against one fit of everything at once."""

from pathlib import Path

import numpy as np
import pytest

from wirebayes.discovery.linear_scan import expand, scan
from wirebayes.discovery.name_evidence import weigh_names
from wirebayes.discovery.screening import candidate_probes
from wirebayes.discovery.sharing import _known, _table, alike, informed
from wirebayes.effects import effect_named
from wirebayes.effects.instrument import ScrewError
from wirebayes.inference.laplace_fit import LaplaceFit, fitted
from wirebayes.io.experiment import Experiment
from wirebayes.io.experiment_file import read_experiments
from wirebayes.model.build import build
from wirebayes.model.scales import scales_of
from wirebayes.model.spec import PLAIN_SPEC
from wirebayes.results.posterior_checks import _columns_of
from wirebayes.simulation.synthetic import Bench, Truth, write_tests

WIRE = {"U": 0.6, "B": 0.08, "k2": 0.02, "N": 0.7, "preload": 0.5, "sensor_sd": 0.01, "setting_sd": 0.01}


def fit(experiments: list[Experiment], effect: str) -> LaplaceFit:
    return fitted(experiments, [effect_named(effect)], PLAIN_SPEC, np.random.default_rng(0))


@pytest.mark.parametrize(
    ("name", "size"), [("sensor_nonlinearity", -0.006), ("lost_motion", 0.05)], ids=["either sign", "one-sided"]
)
def test_each_material_knows_what_a_fit_of_all_at_once_knows(tmp_path: Path, name: str, size: float) -> None:
    steps = (1, 2, 3, 4, 5, 6, 5, 4, 3, 4, 5, 6)
    benches = [Bench(name=f"on-{m}", material=m, displacements_mm=steps) for m in ("soft", "stiff")]
    amplitude = effect_named(name).columns()[0]
    write_tests(
        tmp_path,
        benches,
        Truth(WIRE | {"k1[soft]": 700.0, "k1[stiff]": 2500.0, amplitude: size}, [effect_named(name)]),
        0,
    )
    experiments = read_experiments(tmp_path / "experiments.toml")
    alone = [fit([e], name) for e in experiments]
    mean, sd = _known(fit(experiments, name), effect_named(name))
    shared = informed(alone, dict.fromkeys((0, 1), effect_named(name)), np.random.default_rng(1))
    after = [_known(b, effect_named(name)) for b in shared]
    assert max(_known(b, effect_named(name))[1] for b in alone) > 1.15 * sd  # there is something to be told
    for own_mean, own_sd in after:
        assert own_mean == pytest.approx(mean, abs=0.2 * sd)
        assert own_sd == pytest.approx(sd, rel=0.1)


def test_what_other_materials_say_is_no_prior_that_somebody_may_state(tmp_path: Path) -> None:
    benches = [Bench(name=f"on-{m}", material=m) for m in ("soft", "stiff")]
    drift = effect_named("sensor_drift")
    stiffness = {"k1[soft]": 700.0, "k1[stiff]": 2500.0, "sensor_drift.a": 4e-5}
    write_tests(tmp_path, benches, Truth(WIRE | stiffness, [drift]), 0)
    alone = [fit([e], "sensor_drift") for e in read_experiments(tmp_path / "experiments.toml")]
    shared = informed(alone, dict.fromkeys((0, 1), drift), np.random.default_rng(1))
    for block, asked in ((alone[0], True), (shared[0], False)):
        problem = build(block.experiments, block.effects, block.spec, scales=block.scales)
        columns = _columns_of(problem, problem.samples[0])
        assert ("sensor_drift.a" in columns) == asked
        assert {"k1", "B", "U", "k2", "N"} <= set(columns)


def test_what_is_hardly_known_of_a_one_sided_amplitude_is_not_handed_on() -> None:
    assert _table(effect_named("lost_motion").amplitudes[0], 0.01, 0.01) is None
    known = _table(effect_named("lost_motion").amplitudes[0], 0.5, 0.125)
    assert known == {"distribution": "log-normal", "median": 0.5, "sd_log": 0.25}
    assert _table(effect_named("sensor_drift").amplitudes[0], 0.01, 0.01) == {
        "distribution": "normal",
        "mean": 0.01,
        "sd": 0.01,
    }


def test_one_value_for_all_is_the_integral_of_the_product_of_what_each_says() -> None:
    means, sds = np.array([0.3, 0.5, 0.35]), np.array([0.2, 0.05, 0.1])
    x = np.linspace(-3.0, 3.0, 60_001)
    prior = np.full_like(x, 1.0 / 6.0)
    posteriors = np.exp(-0.5 * ((x - means[:, None]) / sds[:, None]) ** 2) / (sds[:, None] * np.sqrt(2.0 * np.pi))
    exact = np.log(np.trapezoid(posteriors.prod(axis=0) / prior**2, x))
    found = alike(means[:, None], sds[:, None], lambda value: np.full(value.shape, np.log(1.0 / 6.0)))
    assert found == pytest.approx([exact], abs=1e-9)
    assert alike(means[:1, None], sds[:1, None], lambda value: value) == pytest.approx([0.0])  # one is alike already


def weighed_by_both(folder: Path, periods: tuple[float, float]) -> tuple[float, float, float]:
    """A screw in two wires' tests, in opposite phases: log Bayes factors by refit and by one posterior of both; a."""
    experiments = []
    for at, material in enumerate(("soft", "stiff")):
        bench = Bench(name=f"on-{material}", material=material, displacements_mm=tuple(range(1, 13)))
        screw = {"screw_error.a": 0.06, "screw_error.P": periods[at], "screw_error.phi": -0.4 + np.pi * at}
        truth = Truth(WIRE | {"k1": (700.0, 2500.0)[at]} | screw, [ScrewError(6.0, of_several=True)])
        (folder / material).mkdir()
        write_tests(folder / material, [bench], truth, at)
        experiments += read_experiments(folder / material / "experiments.toml")
    scales = scales_of(experiments)
    plain = [fitted([e], [], PLAIN_SPEC, np.random.default_rng(0), scales=scales) for e in experiments]
    trials, candidates = candidate_probes(plain, {"screw_error": ScrewError})
    scans = [scan(expand(block.target, block.z, trials)) for block in plain]
    found = weigh_names(plain, trials, candidates, scans).winners["screw_error"][0]
    both = fitted(experiments, [found.effect], PLAIN_SPEC, np.random.default_rng(0), scales=scales)
    by_both = both.log_evidence - sum(block.log_evidence for block in plain)
    return found.log_bayes, by_both, plain[0].natural_amplitude(found.effect, found.amplitude)


def test_a_screw_that_two_materials_share_is_weighed_as_one_posterior_of_both_weighs_it(tmp_path: Path) -> None:
    by_refit, by_both, amplitude = weighed_by_both(tmp_path, (2.7, 2.7))
    assert by_refit == pytest.approx(by_both, abs=1.0)
    assert by_refit > 10.0
    assert amplitude == pytest.approx(0.06, abs=0.02)


def test_a_period_each_is_no_screw_that_they_share(tmp_path: Path) -> None:
    by_refit, by_both, _ = weighed_by_both(tmp_path, (2.7, 3.2))
    assert by_refit < by_both
