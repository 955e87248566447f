"""Warnings of posteriors that no sound test gives."""

from dataclasses import replace

import numpy as np
import pytest

from tests.simulated import SOFTER
from wirebayes.inference.fit import fit_problem
from wirebayes.inference.policy import Policy
from wirebayes.io.run_folder import read_json
from wirebayes.model.build import FINEST, build
from wirebayes.model.problem import with_readings
from wirebayes.model.sample import LENGTH_EXPONENT
from wirebayes.model.spec import ModelSpec
from wirebayes.numeric.distributions import Normal
from wirebayes.report.pages.fit import _cautions
from wirebayes.results import posterior_checks, store
from wirebayes.simulation.synthetic import Bench, Truth, draw

HASTY = Policy(walkers=64, rounds=2, round_draws=2048, most_rounds=2, block=4, most_steps=4)


@pytest.fixture(scope="module")
def simulated():
    return draw([Bench()], Truth(SOFTER), seed=1)


def test_a_sound_test_gets_no_warning_and_a_gross_one_is_first_in_summary_and_page(simulated, tmp_path):
    problem = simulated.problem
    sound = store.save_posterior(fit_problem(problem, 1, policy=HASTY), tmp_path, {})
    assert [notice for notice in sound["warnings"] if notice["kind"] != "not-converged"] == []
    mixed = problem.samples[0].readings[np.random.default_rng(0).permutation(12)]
    store.save_posterior(fit_problem(with_readings(problem, [mixed]), 1, policy=HASTY), tmp_path, {})
    summary = read_json(tmp_path / "summary.json")
    texts = [notice["text"] for notice in summary["warnings"] if notice["kind"] == "data"]
    assert any("setting_sd is at least" in text and "steps by 1 mm" in text for text in texts)
    assert "data" in [notice.kind for notice in _cautions(summary)[0].notices]


def draws(problem, **changes):
    """Draws of every parameter within a thousandth of the truth, some of them changed."""
    rng = np.random.default_rng(0)
    return {name: value * np.exp(0.001 * rng.normal(size=500)) for name, value in (SOFTER | changes).items()}


def test_the_setting_error_is_compared_with_the_steps(simulated):
    sample = simulated.problem.samples[0]
    for sd, warned in ((0.24, False), (0.26, True)):
        assert bool(posterior_checks.loose_steps(draws(simulated.problem, setting_sd=sd), sample)) == warned


@pytest.mark.parametrize(
    ("preload", "holds"), [(-0.65, None), (-0.77, "hold 1 "), (-0.85, None), (-1.2, None), (-1.77, "hold 2 ")]
)
def test_holds_that_begin_taut_and_creep_to_where_a_setting_error_decides_are_named(simulated, preload, holds):
    """The first holds are at 1 and 2 mm, two setting errors are 0.2 mm, and creep takes some hundredths of the stretch.

    With -0.85 mm and -1.2 mm the first hold is that near when it begins: then the likelihood knows both sides.
    """
    sample = simulated.problem.samples[0]
    said = posterior_checks.slackening(draws(simulated.problem, preload=preload, setting_sd=0.1), sample)
    assert bool(said) == (holds is not None)
    assert f"in {holds or ''}" in said or not said


@pytest.mark.parametrize(("often", "warned"), [(0.05, False), (0.2, True)])
def test_a_hold_that_comes_near_slack_in_few_draws_is_not_named(simulated, often, warned):
    own = draws(simulated.problem, preload=-0.5, setting_sd=0.1)
    own["preload"][: int(often * 500)] = -0.77
    assert bool(posterior_checks.slackening(own, simulated.problem.samples[0])) == warned


def test_a_hold_that_is_read_as_slack_is_named_by_its_readings_alone(simulated):
    readings = simulated.problem.samples[0].readings.copy()
    readings[0] = 0.0
    sample = replace(simulated.problem.samples[0], readings=readings)
    assert posterior_checks.slackening(draws(simulated.problem, preload=-0.77, setting_sd=0.1), sample) == ""


def test_the_sensor_error_is_compared_with_the_signal(simulated):
    sample = simulated.problem.samples[0]
    signal = np.ptp(sample.readings)
    for share, warned in ((0.24, False), (0.26, True)):
        own = draws(simulated.problem, sensor_sd=share * signal)
        assert ("in all" in posterior_checks.noise(own, sample)) == warned


def test_a_stiffness_outside_its_prior_is_named(simulated):
    prior = simulated.problem.parameters(
        simulated.problem.prior.rvs(4000, np.random.default_rng(0)), simulated.problem.samples[0]
    )
    logs = np.log(prior["k1"])
    far = posterior_checks.FAR_OUT * logs.std()
    for away, warned in ((-1.02, True), (-0.98, False), (0.0, False), (0.98, False), (1.02, True)):
        k1 = float(np.exp(np.median(logs) + away * far))
        assert (
            "prior of its own" in posterior_checks.unlikely_stiffness(draws(simulated.problem, k1=k1), prior)
        ) == warned
    rope = prior | {"k1": prior["k1"] * 1e5}  # as a prior in the file says
    stiff = 1e5 * float(np.median(prior["k1"]))
    assert "prior of its own" in posterior_checks.unlikely_stiffness(draws(simulated.problem, k1=stiff), prior)
    assert posterior_checks.unlikely_stiffness(draws(simulated.problem, k1=stiff), rope) == ""


@pytest.mark.parametrize(("away", "named"), [(3.69, False), (3.71, True), (-3.71, True)])
def test_a_stiffness_is_far_outside_from_3_7_standard_deviations_of_its_logarithm_on(away, named):
    prior = {"k1": 500.0 * np.exp([-0.5, 0.5])}
    said = posterior_checks.unlikely_stiffness({"k1": np.full(3, 500.0 * np.exp(0.5 * away))}, prior)
    assert bool(said) == named


def test_a_posterior_that_is_the_prior_is_named(simulated):
    problem = simulated.problem
    one, other = (problem.prior.rvs(4000, np.random.default_rng(seed)) for seed in (0, 1))
    own, prior = (problem.parameters(theta, problem.samples[0]) for theta in (one, other))
    assert "say nothing of the wire" in posterior_checks.unchanged_prior(own, prior)
    assert posterior_checks.unchanged_prior(own | {"k1": 700.0 + own["k1"] / 100.0}, prior) == ""


def test_readings_without_noise_have_a_floor_and_say_so(simulated):
    sample = simulated.problem.samples[0]
    bare = draw([Bench(resolution_N=0.0)], Truth(SOFTER | {"sensor_sd": 1e-12}), seed=1)
    experiment = Bench(resolution_N=0.0).experiment()
    assert build([experiment]).samples[0].resolution == 0.0  # no tension, no floor
    read = with_tensions(experiment, bare.problem.samples[0].readings[..., 0])
    problem = build([read])
    assert problem.samples[0].resolution == pytest.approx(FINEST * np.max(bare.problem.samples[0].readings))
    assert build([with_tensions(Bench().experiment(), sample.readings[..., 0])]).samples[0].resolution == 0.01
    quiet = fit_problem(problem, 1, policy=HASTY)
    assert any(
        "carry no noise" in notice.text for notice in posterior_checks.posterior_warnings(quiet, problem.samples[0])
    )


def with_tensions(experiment, tension):
    holds = [replace(h, readings=tension[j, : h.time_s.size]) for j, h in enumerate(experiment.holds)]
    return replace(experiment, holds=tuple(holds))


def test_exact_thresholds_of_a_silent_check(simulated):
    """A test that never moved has no steps to compare with; a fit without setting errors has none to judge."""
    sample = simulated.problem.samples[0]
    own = draws(simulated.problem, setting_sd=5.0)
    still = replace(sample.protocol, setting=np.ones(len(sample.protocol.setting)))
    assert posterior_checks.loose_steps(own, replace(sample, protocol=still)) == ""
    assert posterior_checks.loose_steps({k: v for k, v in own.items() if k != "setting_sd"}, sample) == ""


def test_readings_that_do_not_differ_are_not_called_noisy(simulated):
    """No tension at all, or one and the same: the check before the fit names that."""
    sample = simulated.problem.samples[0]
    same = replace(sample, readings=np.full_like(sample.readings, 2.0))
    assert posterior_checks.noise(draws(simulated.problem), same) == ""


@pytest.mark.parametrize(("share", "named"), [(1.9, True), (2.1, False)])
def test_an_error_finer_than_a_load_cell_resolves_is_no_noise(simulated, share, named):
    sample = replace(simulated.problem.samples[0], resolution=0.0)
    largest = np.abs(sample.readings).max()
    own = draws(simulated.problem, sensor_sd=share * FINEST * largest / np.exp(0.001 * 1.645))
    assert ("carry no noise" in posterior_checks.noise(own, sample)) is named
    coarse = replace(sample, resolution=0.01)  # the display hides what noise there is
    assert posterior_checks.noise(own, coarse) == ""


@pytest.mark.parametrize(("left", "named"), [(0.89, False), (0.91, True)])
def test_an_interval_that_shrank_by_less_than_a_tenth_taught_nothing(simulated, left, named):
    """Of any parameter but the sensor's error, which every reading shows."""
    even = np.linspace(0.0, 1.0, 1001)
    prior = {"k1": even, "B": even, "sensor_sd": even}
    own = {"k1": left * even, "B": even, "sensor_sd": 0.1 * even}
    assert ("say nothing of the wire" in posterior_checks.unchanged_prior(own, prior)) is named
    constant = {"k1": np.ones(9)}
    assert posterior_checks.unchanged_prior({"k1": even[:1] + 0 * even}, constant) == ""  # nothing was to be learned


def test_intervals_reach_from_the_5_to_the_95_percent_point():
    """Seven draws of a hundred lie far below, or above, the others: the interval is no narrower than the prior's."""
    even = np.linspace(0.0, 1.0, 1001)
    far = np.where(even < 0.07, -9.0, 0.5 + 0.1 * even)
    for own in (far, -far):
        assert "say nothing of the wire" in posterior_checks.unchanged_prior({"k1": own}, {"k1": even})
        assert (
            posterior_checks.unchanged_prior({"k1": np.where(even < 0.04, own, 0.5 + 0.1 * even)}, {"k1": even}) == ""
        )


def test_an_error_must_be_large_in_nineteen_of_twenty_draws(simulated):
    """Of the setting and of the sensor; six draws of a hundred below the limit are enough to doubt it."""
    sample, signal = simulated.problem.samples[0], np.ptp(simulated.problem.samples[0].readings)
    for few, warned in ((4, True), (6, False)):
        some = np.arange(100) < few
        loose = {"setting_sd": np.where(some, 0.1, 0.6)}
        noisy = {"sensor_sd": np.where(some, 0.1, 0.3) * signal}
        assert bool(posterior_checks.loose_steps(loose, sample)) is warned
        assert ("in all" in posterior_checks.noise(noisy, sample)) is warned
    bare = replace(sample, resolution=0.0)
    largest = np.abs(sample.readings).max()
    for few, warned in ((4, True), (6, False)):  # and small in as many to be called none
        quiet = {"sensor_sd": np.where(np.arange(100) < few, 1.0, 0.1) * 2 * FINEST * largest}
        assert ("no noise" in posterior_checks.noise(quiet, bare)) is warned


def test_steps_are_the_typical_ones_of_those_that_move(simulated):
    """Their median, whatever the direction; holds at one place are no steps."""
    protocol = replace(simulated.problem.samples[0].protocol, setting=np.array([0.0, 2.0, 2.0, 0.0, 0.0, 2.0, 9.0]))
    sample = replace(simulated.problem.samples[0], protocol=protocol)
    for sd, warned in ((0.49, False), (0.51, True)):
        found = posterior_checks.loose_steps({"setting_sd": np.full(9, sd)}, sample)
        assert bool(found) is warned and ("steps by 2 mm" in found) is warned
    still = replace(sample, protocol=replace(protocol, setting=np.full(7, 3.0)))
    assert posterior_checks.loose_steps({"setting_sd": np.full(9, 5.0)}, still) == ""
    assert posterior_checks.loose_steps({}, sample) == ""  # hold by hold there is no such error


@pytest.mark.parametrize(
    ("years", "said"), [(99.9, "nine tenths after 3e+09 s;"), (100.1, "after more than a century;")]
)
def test_creep_that_goes_on_for_more_than_a_century_is_not_given_in_seconds(years, said):
    prior, exponent = {"N": np.linspace(0.1, 1.0, 11)}, 0.1
    hazard = np.log(10.0) * (years * 365.25 * 86400) ** -exponent
    assert said in posterior_checks.endless({"N": np.full(9, exponent), "k2": np.full(9, hazard)}, prior)
    with np.errstate(all="raise", under="ignore"):  # so small an N that the times overflow
        assert "more than a century" in posterior_checks.endless({"N": np.full(9, 0.001), "k2": np.ones(9)}, prior)


@pytest.mark.parametrize(("decades", "named"), [(4.01, True), (3.99, False)])
def test_creep_over_more_decades_than_a_test_reads_is_said_to_want_a_power_law(decades, named):
    """The tenth and nine tenths of 1 - exp(-k2 t^N), found here by trying times, lie so many decades apart."""
    prior = {"N": np.linspace(0.1, 1.0, 11)}
    k2, N = 0.4, np.log10(np.log(10.0) / np.log(10.0 / 9.0)) / decades
    times = np.geomspace(1e-6, 1e6, 240001)
    begins, ends = np.interp([0.1, 0.9], -np.expm1(-k2 * times**N), times)
    assert np.log10(ends / begins) == pytest.approx(decades, abs=1e-3)
    said = posterior_checks.endless({"N": np.full(100, N), "k2": np.full(100, k2)}, prior)
    assert ("as a power law or the logarithm of time" in said) == named
    in_words = f"a tenth is reached after {float(f'{begins:.1g}'):g} s and nine tenths after {float(f'{ends:.1g}'):g} s"
    assert (in_words in said) == named
    assert posterior_checks.endless({"N": np.full(9, 0.1), "k2": np.ones(9)}, {"N": np.full(9, 0.1)}) == ""  # stated
    assert posterior_checks.endless({}, prior) == ""


def test_a_stated_preload_that_leaves_a_pulling_wire_slack_is_the_first_to_be_said(simulated):
    readings = simulated.problem.samples[0].readings[..., 0]
    experiment = replace(with_tensions(Bench().experiment(), readings), priors={"preload": {"fixed": -4.5}})
    problem = build([experiment])
    found = posterior_checks.posterior_warnings(fit_problem(problem, 1, policy=HASTY), problem.samples[0])
    assert "(preload_mm) leaves the wire slack in holds 1, 2, 3 and 4" in found[0].text


@pytest.mark.parametrize(
    ("lengths", "exponent", "said"),
    [
        ((1000.0, 2000.0), 1.6, "1.5 times as much as the shortest"),
        ((2000.0, 1000.0), 0.5, "0.71 times as much as the shortest"),
        ((1000.0, 2000.0), 1.05, ""),
        ((1000.0, 2000.0, 2000.0), 1.6, ""),  # two of one length show whether samples differ
        ((1000.0, 1000.0), None, ""),
    ],
)
def test_one_sample_of_each_length_does_not_tell_a_power_of_the_length_from_samples_that_differ(
    lengths, exponent, said
):
    experiments = []
    for length in lengths:
        bench = Bench(name=f"w{len(experiments)}", length_mm=length)
        experiments.append(bench.experiment())
    problem = build(experiments, [], ModelSpec(length_exponent=Normal(1.0, 1.0)))
    theta = np.ones((500, len(problem.names)))
    if exponent is not None:
        theta[:, problem.names.index(LENGTH_EXPONENT)] = np.random.default_rng(0).normal(exponent, 0.05, 500)
    notices = posterior_checks.of_lengths(problem, theta)
    assert [notice.kind for notice in notices] == ["extrapolation"] * bool(said)
    assert all(said in notice.text for notice in notices)
