"""What the data taught, on normal models whose posterior is known."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from wirebayes.effects import effect_named
from wirebayes.io.paper import experiments
from wirebayes.model.build import build
from wirebayes.model.prior import PowerScaled, Prior
from wirebayes.results import identifiability as module
from wirebayes.results.identifiability import (
    SENSITIVE,
    Extrapolation,
    _weighted_quantiles,
    distances_per_doubling,
    extrapolation,
    identifiability,
    log_priors,
    parameter_in_words,
)


def normal_model(noise: dict[str, float], draws: int = 4000, total: float | None = None) -> Any:
    """Unit-normal priors; each parameter (or with `total` their sum alone) measured with a normal error."""
    names = tuple(noise)
    d = len(names)
    design = np.eye(d) if total is None else np.ones((1, d))
    error = np.array(list(noise.values())) if total is None else np.array([total])
    precision = np.eye(d) + design.T @ np.diag(error**-2.0) @ design
    theta = np.random.default_rng(0).multivariate_normal(np.zeros(d), np.linalg.inv(precision), draws)
    problem = SimpleNamespace(
        samples=(),
        prior=Prior(dict.fromkeys(names, stats.norm(0.0, 1.0)), {}, frozenset()),
        names=names,
        log_likelihood=lambda rows: -0.5 * ((rows @ design.T / error) ** 2).sum(axis=1),
    )
    return SimpleNamespace(problem=problem, flat=theta)


def test_contraction_is_the_share_of_variance_taken_away() -> None:
    found = identifiability(normal_model({"sharp": 0.1, "even": 1.0, "vague": 30.0}))
    for name, noise in (("sharp", 0.1), ("even", 1.0), ("vague", 30.0)):
        posterior = 1.0 / (1.0 + noise**-2)
        assert found[name]["contraction"] == pytest.approx(1.0 - posterior, abs=0.05)
        assert found[name]["posterior_range_90"] == pytest.approx(2 * 1.645 * np.sqrt(posterior), rel=0.06)
        assert (
            found[name]["prior_range_90"] == pytest.approx(2 * 1.645, rel=1e-3) and not found[name]["range_is_factor"]
        )
    assert "the data determine it" in found["sharp"]["sentence"]
    assert "data and prior both determine it" in found["even"]["sentence"]
    assert "next to nothing" in found["vague"]["sentence"]
    assert found["sharp"]["prior_sensitivity"] < 0.02 < SENSITIVE < found["vague"]["prior_sensitivity"]
    assert found["vague"]["likelihood_sensitivity"] < 0.02 < SENSITIVE < found["sharp"]["likelihood_sensitivity"]


def test_a_sum_alone_is_a_ridge() -> None:
    found = identifiability(normal_model({"a": 1.0, "b": 1.0}, total=0.05))
    # the sum is known, the difference has the prior's variance: correlation (0.0025 - 2) / (0.0025 + 2) nearly
    assert set(found) == {"a", "b"}
    assert found["a"]["ridges"]["b"] < -0.98
    assert "correlated with b" in found["a"]["sentence"]


def test_sensitivity_is_zero_for_a_flat_component_and_grows_with_its_part() -> None:
    values = np.random.default_rng(1).normal(size=4000)

    def moved(component: np.ndarray) -> float:
        (distance,) = distances_per_doubling(values[:, None], component)
        return distance

    assert moved(np.zeros(4000)) == 0.0
    assert moved(1e-7 * values) == 0.0  # readings of a sensor too coarse to say anything
    assert 0.0 < moved(1e-6 * values) < 1e-5
    small, large = (moved(-0.5 * part * values**2) for part in (0.01, 0.5))
    assert small < 0.02 < large


def test_extrapolation_of_prior_draws_is_the_prior_and_hangs_on_it() -> None:
    problem = build([experiments()[0]])
    rows = problem.prior.rvs(20000, np.random.default_rng(2))
    rows[:, problem.names.index("k1")] = 700.0
    band = extrapolation(SimpleNamespace(problem=problem, flat=rows), 2.0, np.array([120.0, 3600.0, 86400.0]))  # type: ignore[arg-type]
    assert np.allclose(np.log(band.posterior_mm), np.log(band.prior_mm), atol=0.25)
    assert (np.diff(band.posterior_mm[1]) > 0).all()
    # draws of the prior with its power halved spread by a factor sqrt(2) where logarithms are normal
    assert band.prior_share[0] == pytest.approx(np.sqrt(2) - 1, abs=0.25)


def test_extrapolation_says_whose_work_the_band_is() -> None:
    problem = build([experiments()[0]])
    rows = problem.prior.rvs(4000, np.random.default_rng(3))
    rows[:, problem.names.index("k1")] = 700.0
    whole = extrapolation(SimpleNamespace(problem=problem, flat=rows), 2.0).to_dict()  # type: ignore[arg-type]
    assert ": it depends on the prior" in whole["sentence"] and "24 h at 2 N" in whole["sentence"]
    likely = rows * np.exp(0.02 * np.random.default_rng(4).normal(size=rows.shape)) / rows * rows[:1]
    known = extrapolation(SimpleNamespace(problem=problem, flat=likely), 2.0).to_dict()  # type: ignore[arg-type]
    assert "hardly depends on the prior" in known["sentence"] and known["prior_share"][-1] < 0.05


def test_extrapolation_of_draws_that_do_not_creep_says_so() -> None:
    problem = build([experiments()[0]], [effect_named("creep_threshold")])
    rows = problem.prior.rvs(1000, np.random.default_rng(3))
    rows[:200, problem.names.index("creep_threshold.tau_c")] = 2.5
    band = extrapolation(SimpleNamespace(problem=problem, flat=rows), 2.0)  # type: ignore[arg-type]
    assert (band.posterior_mm[0] == 0.0).all()
    assert "do not creep at this tension" in band.to_dict()["sentence"]


def sentence(contraction: float, sensitivity: float) -> str:
    return parameter_in_words(
        "k1",
        {
            "contraction": contraction,
            "prior_range_90": 100.0,
            "posterior_range_90": 1.5,
            "range_is_factor": True,
            "prior_sensitivity": sensitivity,
            "likelihood_sensitivity": 1.0,
            "ridges": {},
        },
        "N",
    )


@pytest.mark.parametrize(
    ("contraction", "sensitivity", "part"),
    [
        (0.29, 0.0, "next to nothing"),
        (0.31, 0.0, "data and prior both"),
        (0.89, 0.0, "data and prior both"),
        (0.91, 0.049, "the data determine it"),
        (0.91, 0.051, "data and prior both"),
    ],
)
def test_what_determines_a_parameter_turns_at_its_thresholds(contraction: float, sensitivity: float, part: str) -> None:
    assert part in sentence(contraction, sensitivity)


@pytest.mark.parametrize(("correlation", "ridge"), [(0.88, False), (0.92, True), (-0.92, True)])
def test_a_ridge_is_a_correlation_above_nine_tenths(correlation: float, ridge: bool) -> None:
    root = np.linalg.cholesky(np.array([[1.0, correlation], [correlation, 1.0]]))
    model = normal_model({"a": 1.0, "b": 1.0})
    z = stats.norm.ppf((np.arange(4000) + 0.5) / 4000)
    model.flat = np.column_stack([z, np.random.default_rng(0).permutation(z)]) @ root.T
    one, other = identifiability(model).values()
    assert (list(one["ridges"]), list(other["ridges"])) == ((["b"], ["a"]) if ridge else ([], []))


def test_a_range_of_a_positive_parameter_is_a_factor() -> None:
    """Log-normal draws of a log-normal prior; both ranges are ratios, whatever the unit."""
    model = normal_model({"k": 1.0})
    model.problem.prior = Prior({"k": stats.lognorm(0.5, scale=700.0)}, {}, frozenset({"k"}))
    model.flat = 800.0 * np.exp(0.1 * stats.norm.ppf((np.arange(4000) + 0.5) / 4000))[:, None]
    model.problem.log_likelihood = lambda rows: np.zeros(len(rows))
    (found,) = identifiability(model).values()
    assert found["range_is_factor"] and "spans a factor of" in found["sentence"]
    assert found["prior_range_90"] == pytest.approx(np.exp(2 * 1.645 * 0.5), rel=1e-3)
    assert found["posterior_range_90"] == pytest.approx(np.exp(2 * 1.645 * 0.1), rel=1e-3)
    assert found["contraction"] == pytest.approx(1.0 - 0.1**2 / 0.5**2, abs=0.002)


def far_out(share: float = 0.0, k: float = 0.2, longest_s: float = 600.0) -> Extrapolation:
    """Bands of which the one with a weaker prior is wider by a share, in logarithms."""
    band = np.exp(np.array([[-1.0], [0.0], [1.0]]))
    return Extrapolation(np.array([3600.0]), 2.0, band, band ** (1.0 + share), band, k, longest_s)


@pytest.mark.parametrize(
    ("share", "k", "part"),
    [
        (0.09, 0.2, "hardly depends on the prior: with half the prior's weight the band is 9 % wider"),
        (-0.08, 0.2, "hardly depends on the prior: with half the prior's weight the band is 8 % narrower"),
        (0.11, 0.2, "it depends on the prior: with half the prior's weight the band is 11 % wider"),
        (0.5, 0.69, "it depends on the prior"),
        (0.5, 0.71, "cannot show"),
    ],
)
def test_the_prior_s_part_in_an_extrapolation_turns_at_a_tenth(share: float, k: float, part: str) -> None:
    found = far_out(share, k)
    assert found.prior_share == pytest.approx([share])
    assert part in found.to_dict()["sentence"] and "after 1 h at 2 N" in found.to_dict()["sentence"]


def test_an_extrapolation_is_one_beyond_the_longest_hold() -> None:
    assert far_out(longest_s=3600.0).warning == "" == far_out(longest_s=7200.0).warning
    assert "1 h is 6 times the longest hold (10 min)" in far_out().warning
    assert "1 h is 1.03 times the longest hold (58.3 min)" in far_out(longest_s=3500.0).warning
    assert far_out(longest_s=0.0).warning != ""  # no hold lasted at all


def test_weighted_quantiles_are_those_of_repeated_values() -> None:
    values, counts = np.array([3.0, 1.0, 2.0]), np.array([200.0, 500.0, 300.0])
    found = _weighted_quantiles(values, counts, [0.05, 0.25, 0.65, 0.9])
    assert found == pytest.approx([1.0, 1.0, 2.0, 3.0])
    # halfway between the middles of two values' shares
    assert _weighted_quantiles(values, counts, [0.45]) == pytest.approx([1.5])


def test_the_prior_of_a_positive_parameter_is_that_of_its_logarithm() -> None:
    """Each parameter's own density by scipy, times the value where logarithms are what is measured."""
    forms = {"k": stats.lognorm(0.5, scale=700.0), "shift": stats.norm(1.0, 2.0), "share": stats.beta(2.0, 5.0)}
    prior = Prior(forms, {}, frozenset({"k", "share"}))
    theta = prior.rvs(50, np.random.default_rng(0))
    found = log_priors(SimpleNamespace(problem=SimpleNamespace(prior=prior)), theta)  # type: ignore[arg-type]
    for i, form in enumerate(forms.values()):
        own = form.logpdf(theta[:, i]) + (np.log(theta[:, i]) if i != 1 else 0.0)
        assert found[:, i] == pytest.approx(own, rel=1e-12)
    # the density of log k is normal
    assert found[:, 0] == pytest.approx(stats.norm(np.log(700.0), 0.5).logpdf(np.log(theta[:, 0])))


def test_sensitivity_is_the_distance_over_powers_a_tenth_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[float] = []

    def weights(component: np.ndarray, power: float) -> np.ndarray:
        asked.append(power)
        return power * component

    def distance(values: np.ndarray, low: np.ndarray, high: np.ndarray, powers: tuple[float, float]) -> float:
        assert list(powers) == asked
        assert low == pytest.approx(np.exp(component / 1.1)) and high == pytest.approx(np.exp(component * 1.1))
        return float(values[-1])

    component = np.array([0.1, -0.2, 0.3])
    monkeypatch.setattr(module, "power_scaled", weights)
    monkeypatch.setattr(module, "power_sensitivity", distance)
    values = np.array([[1.0, 0.0], [2.0, 0.0], [4.0, 3.0]])
    assert distances_per_doubling(values, component) == [4.0, 3.0]  # of each column, with weights found once
    assert asked == pytest.approx([1.0 / 1.1, 1.1])


class Course:
    """A fresh sample that creeps by the exponential of its first parameter, times the hours and the tension."""

    def __init__(self, own: np.ndarray, model: object, length_mm: float) -> None:
        assert length_mm == 1500.0
        self.own = own

    def creep_mm(self, tension_N: float, times_s: np.ndarray) -> np.ndarray:
        return np.exp(self.own[:, 0]) * tension_N * np.asarray(times_s)[:, None] / 3600.0


def test_half_the_prior_s_weight_takes_half_of_its_precision_away(monkeypatch: pytest.MonkeyPatch) -> None:
    """From a posterior of precision 2 under a unit normal prior; the second of two samples, at a tension of 2 N."""
    model = normal_model({"a": 1.0})
    samples = [
        SimpleNamespace(model=None, protocol=SimpleNamespace(length_mm=length, duration_s=np.array(durations)))
        for length, durations in ((1000.0, [60.0, 900.0]), (1500.0, [120.0]))
    ]
    model.problem.samples = samples
    model.problem.parameters = lambda theta, sample: theta
    model.flat = np.sqrt(1.0 / 2.0) * stats.norm.ppf((np.arange(12_001) + 0.5) / 12_001)[:, None]
    monkeypatch.setattr(module, "FreshSample", Course)
    times = np.array([3600.0, 36_000.0])
    found = extrapolation(model, 2.0, times, sample=1)
    z = 1.6449 * np.array([-1.0, 0.0, 1.0])[:, None]
    posterior, weaker = (np.log(band / times * 1800.0) for band in (found.posterior_mm, found.weaker_prior_mm))
    assert posterior == pytest.approx(np.sqrt(1.0 / 2.0) * np.tile(z, 2), abs=0.002)
    assert weaker == pytest.approx(np.sqrt(1.0 / 1.5) * np.tile(z, 2), abs=0.02)
    assert np.log(found.prior_mm / times * 1800.0) == pytest.approx(np.tile(z, 2), abs=0.15)
    assert found.longest_hold_s == 900.0 and found.tension_N == 2.0 and found.time_s is times
    assert found.pareto_k == pytest.approx(0.25, abs=0.15)  # a weight above t, exp(x²/4) that is, is as rare as 1/t⁴
    # without times and sample: to a day, of the first sample
    with pytest.raises(AssertionError):
        extrapolation(model, 2.0)
    samples[0].protocol.length_mm = 1500.0
    hours = extrapolation(model, 2.0).time_s / 3600.0
    assert hours[-6:].tolist() == [1 / 3, 1.0, 2.0, 4.0, 8.0, 24.0] and hours[0] == 10 / 3600.0
    assert (np.diff(np.log(hours)) > 0.6).all() and (np.diff(np.log(hours)) < 1.2).all()  # evenly, about twice as long


def test_an_extrapolation_as_plain_values_has_the_figures_under_their_names() -> None:
    band = np.array([[1.0], [2.0], [4.0]])
    found = Extrapolation(np.array([7200.0]), 3.0, band, 10.0 * band, 100.0 * band, 0.3, 7200.0).to_dict()
    for name, size in (("posterior_mm", 1.0), ("weaker_prior_mm", 10.0), ("prior_mm", 100.0)):
        assert {q: v.tolist() for q, v in found[name].items()} == {"q05": [size], "q50": [2 * size], "q95": [4 * size]}
    assert found["prior_share"] == pytest.approx([0.0]) and found["pareto_k"] == 0.3 and found["tension_N"] == 3.0
    assert found["sentence"].startswith("Creep after 2 h at 3 N: it hardly depends") and found["warning"] == ""


def test_a_ridge_names_all_who_are_on_it_but_itself() -> None:
    words = parameter_in_words(
        "k1",
        {
            "contraction": 0.95,
            "prior_range_90": 20.0,
            "posterior_range_90": 1.5,
            "range_is_factor": False,
            "prior_sensitivity": 0.0,
            "likelihood_sensitivity": 1.0,
            "ridges": {"B": -0.95, "U": 0.991},
        },
        "N",
    )
    assert words == (
        "k1: the data determine it; its 90 % interval is 1.50 N wide, the prior's 20.0 N; it is correlated with B "
        "(r = −0.95) and U (r = 0.99), and their combination is known better."
    )


def test_no_more_than_four_thousand_draws_are_looked_at_evenly() -> None:
    rows = np.arange(9001.0)[:, None]
    some = module._thinned(rows)[:, 0]
    assert len(some) == 4000 and (some[0], some[-1]) == (0.0, 9000.0) and set(np.diff(some)) == {2.0, 3.0}
    assert np.array_equal(module._thinned(rows[:7]), rows[:7])


def creep_amounts(newtons: float) -> SimpleNamespace:
    """Draws of a creep amount that is known at a tension of so many newtons, and of its exponent."""
    rng = np.random.default_rng(5)
    at_tension = np.exp(rng.normal(0.0, 0.02, 4000))
    power = np.exp(rng.normal(0.0, 0.1, 4000))
    distributions = dict.fromkeys(("B", "U"), stats.lognorm(0.7))
    powers = {"B": PowerScaled("U", float(np.log(newtons)))}
    prior = Prior(distributions, {}, frozenset(distributions), powers)
    problem = SimpleNamespace(
        samples=(),
        prior=prior,
        names=prior.names,
        log_likelihood=lambda rows: -0.5 * (np.log(prior.known(rows)) ** 2 @ [1.0 / 0.02**2, 1.0 / 0.1**2]),
    )
    return SimpleNamespace(problem=problem, flat=np.column_stack([at_tension * newtons**-power, power]))


def test_what_is_known_of_a_creep_amount_does_not_depend_on_what_is_called_a_newton() -> None:
    in_newtons, in_kilonewtons = (identifiability(creep_amounts(newtons)) for newtons in (4000.0, 4.0))
    for name in ("B", "U"):
        for key, value in in_newtons[name].items():
            same = value if isinstance(value, (str, dict)) else pytest.approx(value, rel=1e-9)
            assert in_kilonewtons[name][key] == same
    assert in_newtons["B"]["ridges"] == {}  # at 1 N, far below what was tested, B and U are known together only
    assert in_newtons["B"]["sentence"].startswith("B at the test's typical tension: the data determine it")
