"""What the data taught, on normal models whose posterior is known."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from wirebayes.effects import named
from wirebayes.io.paper import experiments
from wirebayes.model.prior import Prior
from wirebayes.model.problem import build
from wirebayes.results.identifiability import SENSITIVE, extrapolation, identifiability, sensitivity, to_dict


def normal_model(noise: dict[str, float], draws: int = 4000, total: float | None = None) -> Any:
    """Unit-normal priors; each parameter (or with `total` their sum alone) measured with a normal error."""
    names = tuple(noise)
    d = len(names)
    design = np.eye(d) if total is None else np.ones((1, d))
    error = np.array(list(noise.values())) if total is None else np.array([total])
    precision = np.eye(d) + design.T @ np.diag(error**-2.0) @ design
    theta = np.random.default_rng(0).multivariate_normal(np.zeros(d), np.linalg.inv(precision), draws)
    problem = SimpleNamespace(
        prior=Prior(dict.fromkeys(names, stats.norm(0.0, 1.0)), {}, frozenset()), names=names,
        log_likelihood=lambda rows: -0.5 * ((rows @ design.T / error) ** 2).sum(axis=1),
    )  # fmt: skip
    return SimpleNamespace(problem=problem, flat=theta)


def test_contraction_is_the_share_of_variance_taken_away() -> None:
    taught = {t.name: t for t in identifiability(normal_model({"sharp": 0.1, "even": 1.0, "vague": 30.0}))}
    for name, noise in (("sharp", 0.1), ("even", 1.0), ("vague", 30.0)):
        posterior = 1.0 / (1.0 + noise**-2)
        assert taught[name].contraction == pytest.approx(1.0 - posterior, abs=0.05)
        assert taught[name].posterior_range == pytest.approx(2 * 1.645 * np.sqrt(posterior), rel=0.06)
    assert "the data determine it" in taught["sharp"].sentence
    assert "data and prior both determine it" in taught["even"].sentence
    assert "next to nothing" in taught["vague"].sentence
    assert taught["sharp"].prior_sensitivity < 0.02 < SENSITIVE < taught["vague"].prior_sensitivity
    assert taught["vague"].likelihood_sensitivity < 0.02 < SENSITIVE < taught["sharp"].likelihood_sensitivity


def test_a_sum_alone_is_a_ridge() -> None:
    taught = identifiability(normal_model({"a": 1.0, "b": 1.0}, total=0.05))
    # the sum is known, the difference has the prior's variance: correlation (0.0025 - 2) / (0.0025 + 2) nearly
    assert taught[0].ridges["b"] < -0.98
    assert "correlated with b" in taught[0].sentence
    assert set(to_dict(taught)) == {"a", "b"}


def test_sensitivity_is_zero_for_a_flat_component_and_grows_with_its_part() -> None:
    values = np.random.default_rng(1).normal(size=4000)
    assert sensitivity(values, np.zeros(4000)) == 0.0
    small, large = (sensitivity(values, -0.5 * part * values**2) for part in (0.01, 0.5))
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
    taught = rows * np.exp(0.02 * np.random.default_rng(4).normal(size=rows.shape)) / rows * rows[:1]
    known = extrapolation(SimpleNamespace(problem=problem, flat=taught), 2.0).to_dict()  # type: ignore[arg-type]
    assert "hardly depends on the prior" in known["sentence"] and known["prior_share"][-1] < 0.05


def test_extrapolation_of_draws_that_do_not_creep_says_so() -> None:
    problem = build([experiments()[0]], [named("creep_threshold")])
    rows = problem.prior.rvs(1000, np.random.default_rng(3))
    rows[:200, problem.names.index("creep_threshold.tau_c")] = 2.5
    band = extrapolation(SimpleNamespace(problem=problem, flat=rows), 2.0)  # type: ignore[arg-type]
    assert (band.posterior_mm[0] == 0.0).all()
    assert "do not creep at this tension" in band.to_dict()["sentence"]
