"""A joint fit of two lengths, stored and read back at each sample's own length."""

import json
from dataclasses import replace

import numpy as np
import pytest
import xarray

from wirebayes.effects import effect_named
from wirebayes.effects.creep import SecondRelaxation, SteadyCreep
from wirebayes.effects.elastic import LengthDependence
from wirebayes.inference.fit import fit_problem
from wirebayes.inference.policy import Policy
from wirebayes.io.experiment_file import read_experiments
from wirebayes.json_files.summary import CREEP_TIMES_S
from wirebayes.model.build import build
from wirebayes.model.spec import PLAIN_SPEC
from wirebayes.numeric.distributions import Normal
from wirebayes.results import jobs, read_back, store
from wirebayes.results.jobs import Job
from wirebayes.results.netcdf import read_groups
from wirebayes.simulation.synthetic import Bench, Truth, draw, write_tests
from wirebayes.wire.staircase import simulate

HASTY = Policy(walkers=64, rounds=2, round_draws=2048, most_rounds=2, block=4, most_steps=4)
BENCHES = [Bench("short", "line", 800.0), Bench("long", "line", 1700.0)]


@pytest.fixture(scope="module")
def fitted():
    effects = [SecondRelaxation(), SteadyCreep(), LengthDependence("k1")]
    joint = draw(BENCHES, Truth({"length_dependence.p": 0.4}, effects), seed=3).problem
    return fit_problem(joint, 1, policy=HASTY)


@pytest.mark.parametrize("sample", [0, 1])
@pytest.mark.parametrize("apart", [False, True])
def test_what_is_read_back_predicts_as_the_joint_fit_does(fitted, sample, apart, tmp_path):
    joint = fitted.problem
    here = joint.samples[sample]
    store.save_posterior(fitted, tmp_path, {}, sample=here if apart else None)
    stored = read_back.load_posterior(tmp_path, here.name)
    theta = np.concatenate(list(fitted.theta))[:20]
    read = {name: values[:20] for name, values in stored.draws.items()}
    expected = simulate(here.protocol, joint.parameters(theta, here), here.model)
    assert simulate(stored.sample.protocol, read, stored.sample.model) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(("sample", "of_amount", "of_creep"), [(None, (800 * 1700) ** 0.5, 800), (1, 1700, 1700)])
def test_of_samples_of_two_lengths_it_is_said_to_which_length_creep_belongs(
    fitted, sample, of_amount, of_creep, tmp_path
):
    here = None if sample is None else fitted.problem.samples[sample]
    summary = store.save_posterior(fitted, tmp_path, {}, sample=here)
    assert summary["B_length_mm"] == pytest.approx(of_amount)
    assert summary["derived"]["length_mm"] == of_creep
    with xarray.open_dataset(tmp_path / "posterior.nc", group="posterior") as posterior:
        assert posterior.attrs["B_length_mm"] == summary["B_length_mm"]


def test_the_summary_s_figures_of_a_fresh_sample_include_all_effects_of_the_wire(fitted, tmp_path):
    """Each written out here, for the sample at its own length."""
    joint = fitted.problem
    here = joint.samples[1]
    summary = store.save_posterior(fitted, tmp_path, {}, sample=here)
    derived, load = summary["derived"], summary["derived"]["tension_N"]
    assert load == summary["extrapolation"]["tension_N"] == here.tested_tension_N
    assert load in here.readings[:, 0, 0]

    def creep(own, t):
        mode = own["second_relaxation.A"] * load * (1 - np.exp(-t / own["second_relaxation.T2"]))
        slow = own["B"] * load ** own["U"] * (1 - np.exp(-own["k2"] * t ** own["N"]))
        return slow + mode + own["steady_creep.a"] * load * t

    draws = joint.parameters(fitted.flat, here)
    for key, time in CREEP_TIMES_S.items():
        values = creep(draws, time)
        assert [derived[key][q] for q in ("q05", "q50", "q95")] == pytest.approx(np.quantile(values, [0.05, 0.5, 0.95]))
        assert derived[key]["mean"] == pytest.approx(values.mean(), rel=1e-12)
    assert derived["final_creep_mm"] is None and derived["median_creep_time_s"] is None  # steady creep never ends
    stiffness = draws["k1"] * (1700.0 / here.model.length_ref_mm) ** draws["length_dependence.p"]
    assert derived["stiffness_N"]["q50"] == pytest.approx(np.median(stiffness), rel=1e-12)
    ahead = summary["extrapolation"]
    rows = fitted.flat[np.linspace(0, len(fitted.flat) - 1, min(4000, len(fitted.flat))).round().astype(int)]
    expected = [np.median(creep(joint.parameters(rows, here), t)) for t in ahead["time_s"]]
    assert list(ahead["posterior_mm"]["q50"]) == pytest.approx(expected, rel=1e-9)


def test_a_sample_twice_as_long_moved_twice_as_far_reads_the_same():
    """Creep and what flows beside it are strains of the whole wire."""
    effects = [SecondRelaxation(), SteadyCreep()]
    far = Bench("long", "line", 2000.0, displacements_mm=tuple(range(2, 26, 2)))
    problem = draw([Bench("short", "line", 1000.0), far], Truth(effects=effects), seed=1).problem
    short, long = (problem.parameters(problem.prior.rvs(5, np.random.default_rng(0)), s) for s in problem.samples)
    long["preload"] = 2.0 * short["preload"]
    one, two = (simulate(s.protocol, own, s.model) for s, own in zip(problem.samples, (short, long), strict=True))
    assert two == pytest.approx(one, rel=1e-9)


def test_samples_fitted_at_once_are_stored_apart_and_again_where_one_is_missing(tmp_path):
    write_tests(tmp_path, BENCHES, Truth(), 3)
    experiments = tuple(read_experiments(tmp_path / "experiments.toml"))
    job = Job("short/final", experiments, apart=("short/final", "long/final"))
    jobs.run([job], tmp_path, 0, policy=HASTY)
    texts = [(tmp_path / folder / "summary.json").read_text() for folder in job.folders]
    short, long = (json.loads(text)["parameters"] for text in texts)
    assert short["k1"] == long["k1"] and short["preload"] != long["preload"]
    (tmp_path / "long/final/summary.json").unlink()
    jobs.run([job], tmp_path, 0, policy=HASTY)
    assert [(tmp_path / folder / "summary.json").read_text() for folder in job.folders] == texts


@pytest.mark.parametrize("stated", [{"N": 1.0}, {"creep_length_exponent": 0.0}, {"N": 0.9, "preload": 0.3}])
def test_what_is_fixed_is_read_back_as_it_was_fitted(stated, tmp_path):
    """Of each of two lengths: what no draw says of a parameter, or of how creep grows with the length."""
    write_tests(tmp_path, BENCHES, Truth(), 3)
    priors = {name: {"fixed": value} for name, value in stated.items()}
    experiments = [replace(e.train(4), priors=priors) for e in read_experiments(tmp_path / "experiments.toml")]
    fit = fit_problem(build(experiments), 1, policy=HASTY)
    summary = store.save_posterior(fit, tmp_path, {})
    assert ("N" in summary["parameters"]) and "creep_length_exponent" not in summary["parameters"]
    for sample in fit.problem.samples:
        own = fit.problem.parameters(np.concatenate(list(fit.theta)), sample)
        stored = read_back.load_posterior(tmp_path, sample.name)
        for name, values in own.items():
            assert stored.draws[name] == pytest.approx(values, rel=1e-12)
        exponent = stored.length_exponent
        assert exponent is None if "N" in stated else exponent.tolist() == [0.0] * len(own["B"])


@pytest.mark.parametrize(
    ("exponent", "attribute", "is_drawn"), [(1.0, 1.0, False), (0.5, 0.5, False), (Normal(1.0, 1.0), None, True)]
)
def test_a_file_says_of_the_exponent_of_the_length_what_is_fixed_and_draws_what_is_not(
    tmp_path, exponent, attribute, is_drawn
):
    write_tests(tmp_path, BENCHES, Truth(), 3)
    experiments = [e.train(4) for e in read_experiments(tmp_path / "experiments.toml")]
    problem = build(experiments, spec=replace(PLAIN_SPEC, length_exponent=exponent))
    store.save_posterior(fit_problem(problem, 1, policy=HASTY), tmp_path, {})
    posterior = read_groups(tmp_path / "posterior.nc", ["posterior"])["posterior"]
    assert posterior.attributes.get("creep_length_exponent") == attribute
    assert ("creep_length_exponent" in posterior.variables) == is_drawn


def test_an_event_is_read_back_in_its_own_test_alone(tmp_path):
    """The second of two, behind effects that both have."""
    write_tests(tmp_path, BENCHES, Truth(), 3)
    experiments = [e.train(4) for e in read_experiments(tmp_path / "experiments.toml")]
    effects = [effect_named("grip_slip@long:2"), SteadyCreep(), effect_named("unrecorded_hold@short:3")]
    fit = fit_problem(build(experiments, effects), 1, policy=HASTY)
    summary = store.save_posterior(fit, tmp_path, {})
    assert summary["effects"] == ["grip_slip@long:2", "steady_creep", "unrecorded_hold@short:3"]
    assert [summary["parameters"][name]["unit"] for name in ("grip_slip.w", "unrecorded_hold.T")] == ["mm", "s"]
    for sample in fit.problem.samples:
        stored = read_back.load_posterior(tmp_path, sample.name)
        assert [e.key for e in stored.sample.model.effects] == [e.key for e in sample.model.effects]


def test_the_reference_temperature_is_stored_for_each_sample(tmp_path):
    """Later holds need it: their warming counts from a temperature that their protocol does not repeat."""
    write_tests(tmp_path, BENCHES, Truth(), 3)
    table = (tmp_path / "long.csv").read_text().splitlines()
    logged = [table[0] + ",temperature_C", *(f"{row},{21.5 + 0.1 * i}" for i, row in enumerate(table[1:]))]
    (tmp_path / "long.csv").write_text("\n".join(logged) + "\n")
    experiments = read_experiments(tmp_path / "experiments.toml")
    store.save_posterior(fit_problem(build(experiments), 1, policy=HASTY), tmp_path, {})
    short, long = (read_back.load_posterior(tmp_path, e.name).sample.protocol for e in experiments)
    assert short.reference_C is None and short.warming_K is None
    assert long.reference_C == 21.5
    assert np.array_equal(long.warming_K, experiments[1].protocol().warming_K)
