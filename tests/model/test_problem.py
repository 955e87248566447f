"""The likelihood of whole experiments against dense normals: rounding, and samples of one material at two lengths."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from tests.model.dense import columns, log_density, normal
from tests.simulated import simulated_tests
from wirebayes.effects import effect_named
from wirebayes.effects.event import GripSlip
from wirebayes.io.experiment import Experiment
from wirebayes.model import single_holds
from wirebayes.model.build import build
from wirebayes.model.prior import Prior
from wirebayes.model.problem import Problem, with_protocols, with_readings
from wirebayes.model.replicate import readings as replicate
from wirebayes.model.sample import Likelihood
from wirebayes.model.scales import Units
from wirebayes.model.spec import ModelSpec
from wirebayes.simulation.synthetic import Bench, Truth
from wirebayes.wire.model import Model

WIRE = {"k1": 900.0, "B": 0.25, "U": 0.6, "k2": 0.05, "N": 0.7, "preload": 0.4, "sensor_sd": 0.004, "setting_sd": 0.02}


def at(problem, values):
    """One row of parameters; a column of one sample takes the value of its name without the sample."""
    return np.array([[values.get(name, values.get(name.split("[")[0])) for name in problem.names]])


def test_rounding_is_part_of_the_error_of_every_reading():
    """A display that shows tenths of a newton hides more than the sensor: Var = sensor² + resolution²/12."""
    bench = Bench(resolution_N=0.1)
    experiment = simulated_tests([bench], Truth(WIRE), seed=1)[0]
    problem = build([experiment], spec=ModelSpec(likelihood="hold"))
    sample = problem.samples[0]
    courses = single_holds.hold_courses(sample.protocol, columns(WIRE), Model(), sample.readings[:, 0])
    expected = 0.0
    for course, readings in zip(courses, experiment.tension(), strict=True):
        tension, slope, _ = course
        later = slope[1:, 0] / slope[0, 0]
        covariance = (0.004**2 + 0.1**2 / 12) * (np.eye(len(later)) + np.outer(later, later))
        expected += stats.multivariate_normal(tension[1:, 0], covariance).logpdf(readings[1:])
    assert problem.log_likelihood(at(problem, WIRE))[0] == pytest.approx(expected, rel=1e-9)

    problem = build([experiment])
    r, covariance, _ = normal(sample.protocol, WIRE, Model(), experiment.tension(), 0.1)
    assert problem.log_likelihood(at(problem, WIRE))[0] == pytest.approx(log_density(r, covariance), rel=1e-9)


@pytest.mark.parametrize("exponent", [0.4, 1.0, 1.7])
def test_creep_grows_with_length_to_the_fitted_power(exponent):
    """Two lengths fitted together are two wires of their own, the creep amount scaled by hand."""
    effects = (effect_named("grip_slip@4"), effect_named("lost_motion"))
    values = WIRE | {"grip_slip.w": 0.1, "lost_motion.w": 0.05}
    benches = [Bench("short", "line", 500.0), Bench("long", "line", 2000.0)]
    experiments = simulated_tests(benches, Truth(values, effects), seed=3)
    for length_exponent in (exponent, stats.norm(1.0, 0.5)):  # known, and learned
        problem = build(experiments, effects, spec=ModelSpec(length_exponent=length_exponent))
        assert ("creep_length_exponent" in problem.names) == (length_exponent is not exponent)
        expected = 0.0
        for e, own in zip(experiments, problem.samples, strict=True):
            alone = values | {"B": WIRE["B"] * (e.length_mm / 1000.0) ** exponent}  # 1000 is the geometric mean
            model = Model(effects=own.model.effects, tension_ref_N=own.model.tension_ref_N)
            r, covariance, _ = normal(e.protocol(), alone, model, e.tension(), e.resolution_N)
            expected += log_density(r, covariance)
        found = problem.log_likelihood(at(problem, values | {"creep_length_exponent": exponent}))[0]
        assert found == pytest.approx(expected, rel=1e-9)


def short(name: str = "a", material: str = "line", length_mm: float = 1000.0, **about: object) -> Experiment:
    """Three holds of three readings, the second not recorded."""
    times = ((0.0, 30.0, 60.0), (0.0, 50.0), (0.0, 20.0, 100.0))
    bench = Bench(name, material, length_mm, displacements_mm=(1.0, 3.0, 2.0), times_s=times, unrecorded=frozenset({2}))
    return replace(simulated_tests([bench], Truth(WIRE), seed=5)[0], **about)  # type: ignore[arg-type]


def test_a_parameter_is_that_of_the_sample_or_of_the_material_or_of_all() -> None:
    """The most specific name counts, whether it is sampled or fixed; one that is nowhere is an error."""
    problem = build([short()])
    sample = problem.samples[0]
    names = ("k1", "k1[line]", "k1[a]", "k1[b]")
    rest = dict.fromkeys(name for name in problem.names if name != "k1")
    for n in (1, 2, 3):  # none of the others hides the last
        free = {name: stats.norm() for name in (*names[:n], "k1[b]", *rest)}
        theta = np.arange(2.0 * len(free)).reshape(2, -1)
        own = replace(problem, prior=Prior(free, {}, frozenset())).parameters(theta, sample)
        assert own["k1"].tolist() == theta[:, n - 1].tolist() and set(own) == {*rest, "k1"}
    free = {name: stats.norm() for name in ("k1", *rest)}
    known = replace(problem, prior=Prior(free, {"k1[a]": 7.0}, frozenset()))
    assert known.parameters(np.zeros((3, len(free))), sample)["k1"].tolist() == [7.0] * 3
    lacking = replace(problem, prior=Prior(dict.fromkeys(rest, stats.norm()), {}, frozenset()))
    with pytest.raises(KeyError, match="k1"):
        lacking.parameters(np.zeros((3, len(rest))), sample)


def test_where_parameters_stand_is_known_of_the_sample_that_was_asked_for() -> None:
    """Not of another one that had its place in memory before, or in another process."""
    effect = effect_named("steady_creep")
    plain, larger = build([short()]), build([short()], [effect])
    before = plain.parameters(np.ones((1, len(plain.names))), plain.samples[0])
    [known] = plain._known_places.values()
    larger._known_places[id(larger.samples[0])] = known
    own = larger.parameters(np.ones((1, len(larger.names))), larger.samples[0])
    assert set(own) == {*before, *effect.columns()}


@pytest.mark.parametrize("likelihood", ["chain", "hold"])
def test_parameters_are_named_by_what_shares_them(likelihood: Likelihood) -> None:
    """Of one test plainly; of several by sample and by material, where there are several; amplitudes by their scope."""
    own = ["preload", "sensor_sd", "setting_sd"] if likelihood == "chain" else ["sensor_sd"]
    wire, effects = ["k1", "B", "U", "k2", "N"], (effect_named("superposition"), effect_named("sensor_drift"))
    assert build([short()], spec=ModelSpec(likelihood=likelihood)).names == (*wire, *own)
    two = build([short("a"), short("b")], effects, spec=ModelSpec(likelihood=likelihood))
    assert two.names == (*wire, "superposition.omega", "sensor_drift.a", *(f"{n}[{s}]" for s in "ab" for n in own))
    lots = build(
        [short("a"), short("b", "other"), short("c", length_mm=500.0)], effects, spec=ModelSpec(likelihood=likelihood)
    )
    shared = [f"{n}[{m}]" for m in ("line", "other") for n in (*wire, "superposition.omega")]
    assert set(lots.names) == {*shared, "sensor_drift.a", *(f"{n}[{s}]" for s in "abc" for n in own)}
    assert lots.prior.fixed == {"creep_length_exponent[line]": 1.0}  # the two of one material differ in length
    assert [s.name for s in lots.samples] == ["a", "c", "b"]


def test_what_is_positive_is_sampled_by_its_logarithm() -> None:
    """Lengths of time among the amplitudes too; not what a prior of the file lets be negative."""
    drift = effect_named("second_relaxation")
    assert build([short()], [drift]).prior.logarithmic == {
        "k1",
        "B",
        "U",
        "k2",
        "N",
        "sensor_sd",
        "setting_sd",
        "second_relaxation.T2",
    }
    below = {"distribution": "normal", "mean": 0.5, "sd": 0.1}
    zero = {"distribution": "uniform", "low": 0.0, "high": 1.0}
    problem = build([short("a", priors={"U": below, "N": zero, "preload": zero}), short("b")])
    assert problem.prior.logarithmic == {
        "k1",
        "B",
        "k2",
        "N",
        *(f"{name}[{s}]" for s in "ab" for name in ("sensor_sd", "setting_sd")),
    }


def test_priors_of_the_file_replace_those_of_the_most_specific_name() -> None:
    def prior(value: float) -> dict[str, float]:
        return {"fixed": value}

    tables = {"k1": prior(5.0), "preload": prior(0.2), "creep_length_exponent": prior(0.5), "ageing.a": prior(0.0)}
    problem = build([short("a", priors=tables), short("b", "other"), short("c", length_mm=500.0)])
    assert problem.prior.fixed == {"k1[line]": 5.0, "preload[a]": 0.2, "creep_length_exponent[line]": 0.5}
    # one test has no other name for its own; of one length no exponent is needed, and a table for it is no error
    assert build([short("a", priors=tables)]).prior.fixed == {"k1": 5.0, "preload": 0.2}


def test_data_without_noise_have_a_floor() -> None:
    """The stated resolution, but no less than a hundred-thousandth of the largest tension in size."""
    for stated in (0.0, 1e-6, 0.5):
        e = short(resolution=stated)
        holds = tuple(replace(h, readings=-h.readings) for h in e.holds)
        largest = max(h.tension_N.max() for h in e.holds if h.recorded)
        for test in (e, replace(e, holds=holds)):
            assert build([test]).samples[0].resolution == max(stated, 1e-5 * largest)


def test_samples_of_one_material_refer_to_one_length_and_one_tension() -> None:
    one, long, other = short("a"), short("b", length_mm=2000.0), short("c", "other", length_mm=4000.0)
    tensions = {e.name: e.tension()[e.protocol().mask] for e in (one, long, other)}

    def mean(*names: str) -> float:
        values = np.concatenate([tensions[name] for name in names])
        return float(np.exp(np.log(values[values > 0]).mean()))

    a, b, c = build([one, long, other]).samples
    assert a.model.tension_ref_N == b.model.tension_ref_N == pytest.approx(mean("a", "b"))
    assert c.model.tension_ref_N == pytest.approx(mean("c"))
    assert a.model.length_ref_mm == b.model.length_ref_mm == pytest.approx(np.sqrt(2.0) * 1000.0)
    assert c.model.length_ref_mm == 0.0 == build([one]).samples[0].model.length_ref_mm  # its own
    assert build([one, short("d")]).samples[0].model.length_ref_mm == 1000.0  # to the last bit
    priors = build([one, long, other]).prior.distributions
    assert priors["k1[other]"].median() == pytest.approx(priors["k1[line]"].median() * 4.0 / np.sqrt(2.0))


@pytest.mark.parametrize(
    ("first", "reference", "chosen"),
    [
        ((1.0, 16.0), 3.9, 1.0),  # by ratio: 4 stands in the middle
        ((1.0, 16.0), 4.1, 16.0),
        ((-3.0, 100.0), 4.0, 100.0),
        ((-3.0, 0.0), 4.0, 4.0),
    ],
)
def test_the_tested_tension_is_the_hold_s_that_is_nearest_to_the_reference(first, reference, chosen) -> None:
    sample = build([short()]).samples[0]
    readings = np.full_like(sample.readings, 4.0)  # later readings, and those of a hold that was not recorded
    readings[[0, 2], 0, 0] = first
    model = replace(sample.model, tension_ref_N=reference)
    assert replace(sample, readings=readings, model=model).tested_tension_N == chosen
    if first[0] > 0.0:
        weights = replace(sample.protocol, setting=np.array([first[0], 4.0, first[1]]), control="force")
        assert replace(sample, protocol=weights, model=model).tested_tension_N == chosen


def test_an_event_acts_in_its_own_test_alone() -> None:
    here, anywhere = GripSlip(hold=3, test="b"), GripSlip(hold=3)
    problem = build([short("a"), short("b")], [here, anywhere, effect_named("superposition")])
    keys = [[e.key for e in s.model.effects] for s in problem.samples]
    assert keys == [["grip_slip@3", "superposition"], ["grip_slip@b:3", "grip_slip@3", "superposition"]]


def test_a_typical_hold_lasts_the_median_of_the_recorded_ones() -> None:
    problem = build([short()])
    assert problem.samples[0].typical_hold_s == 80.0  # of 60 and 100; the unrecorded one lasts 50
    still = replace(problem.samples[0].protocol, duration_s=np.array([0.0, 50.0, 0.0]))
    assert with_protocols(problem, [still], [problem.samples[0].readings]).samples[0].typical_hold_s == 1.0


@pytest.mark.parametrize("likelihood", ["chain", "hold"])
def test_every_hold_s_part_and_all_readings_but_its_own(likelihood: Likelihood) -> None:
    """Of two samples, against problems that never saw the hold; what is left out of one stays in the other."""
    problem = build([short("a"), short("b", length_mm=1500.0)], spec=ModelSpec(likelihood=likelihood))
    values = WIRE | {"preload[b]": 0.1}
    theta = np.vstack([at(problem, values), at(problem, values | {"k1": 800.0})])
    whole, without = problem.without_each_hold(theta)
    assert whole == pytest.approx(problem.log_likelihood(theta), rel=1e-12)
    left = problem.leave_one_hold_out(theta)
    for s, sample in enumerate(problem.samples):
        for j in range(3):
            mask = sample.protocol.mask.copy()
            mask[j] = False
            protocols = [x.protocol for x in problem.samples]
            protocols[s] = replace(sample.protocol, mask=mask)
            blind = with_protocols(problem, protocols, [x.readings for x in problem.samples])
            assert without[s][j] == pytest.approx(blind.log_likelihood(theta), rel=1e-9)
            assert left[s][j] == pytest.approx(whole - without[s][j], abs=1e-9)
        assert left[s].shape == (3, 2) and (left[s][1] == 0.0).all()  # it was not recorded


def slackening(likelihood: Likelihood) -> Problem:
    """A test of two recorded holds of which the last begins slack."""
    experiment = short()
    last = experiment.holds[-1]
    slack = replace(last, readings=np.array([0.0, 0.02, 0.01]))
    return build([replace(experiment, holds=(*experiment.holds[:-1], slack))], spec=ModelSpec(likelihood=likelihood))


@pytest.mark.parametrize("likelihood", ["chain", "hold"])
def test_densities_in_other_units_differ_by_the_readings_that_they_are_of(likelihood: Likelihood) -> None:
    """Hold by hold the first reading of a hold is given, and all of one that begins slack."""
    problem = slackening(likelihood)
    other = problem.in_units(Units(1.0, 5.0, 1.0))
    theta = at(problem, WIRE)
    one, two = (
        p.hold_log_likelihood(t)[0] for p, t in ((problem, theta), (other, problem.theta_in(other.units, theta)))
    )
    (found,) = other.log_units(problem)
    assert found == pytest.approx((two - one)[:, 0], abs=1e-9)
    assert found[0] == pytest.approx({"chain": 3.0, "hold": 2.0}[likelihood] * np.log(5.0))


def test_hold_by_hold_a_replicate_of_a_slack_hold_is_slack() -> None:
    """Whatever its sensor's error was, the first reading stays, and no tension comes of none."""
    problem = slackening("hold")
    sample = problem.samples[0]
    sd = 0.02
    theta = np.repeat(at(problem, WIRE | {"sensor_sd": sd}), 400, axis=0)
    found = replicate(problem, theta, sample, np.random.default_rng(0))
    assert found[:, 0] == pytest.approx(np.repeat(sample.readings[:, 0], 400, axis=1), abs=sample.resolution)
    assert np.abs(found[2, 1:]).max() < 6.0 * sd


def test_replicates_take_the_place_of_the_readings_row_by_row() -> None:
    problem = build([short("a"), short("b")])
    theta = np.vstack([at(problem, WIRE), at(problem, WIRE | {"B": 0.3})])
    rng = np.random.default_rng(0)
    drawn = [s.readings + 0.01 * rng.normal(size=(*s.readings.shape[:2], 2)) for s in problem.samples]
    found = problem.log_likelihood(theta, drawn)
    for i in range(2):
        own = with_readings(problem, [y[..., i : i + 1] for y in drawn])
        assert found[i] == pytest.approx(own.log_likelihood(theta[i : i + 1])[0], rel=1e-12)
        parts = own.hold_log_likelihood(theta[i : i + 1])
        assert found[i] == pytest.approx(sum(part.sum() for part in parts), rel=1e-12)
    bad = theta.copy()
    bad[0, 0] = np.nan
    values = problem.log_likelihood(bad)
    assert values[0] == -np.inf and np.isfinite(values[1])


def test_a_test_without_readings_has_the_resolution_that_is_stated() -> None:
    """As a plan has it, and a bench before it is simulated; nothing is known of its tensions."""
    empty = short()
    nothing = tuple(replace(h, number=None, time_s=h.time_s[:0], readings=h.tension_N[:0]) for h in empty.holds)
    for stated in (0.0, 0.01):
        sample = build([replace(empty, holds=nothing, resolution=stated)]).samples[0]
        assert sample.resolution == stated and sample.model.tension_ref_N == 1.0
