"""Stored posteriors opened with ArviZ: every statistic and plot that makes sense, on every kind of result."""

import json
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import arviz as az
import h5py
import matplotlib.pyplot as plt
import numpy as np
import pytest

from wirebayes.effects import effect_named
from wirebayes.errors import InputError
from wirebayes.inference.fit import Fit, fit_problem
from wirebayes.inference.policy import Policy
from wirebayes.io.experiment import Experiment
from wirebayes.io.experiment_file import read_experiments
from wirebayes.model.build import build
from wirebayes.model.spec import ModelSpec
from wirebayes.prediction.leave_one_hold_out import smoothed_leave_one_hold_out
from wirebayes.results import read_back, store

HASTY = Policy(walkers=64, rounds=2, round_draws=2048, most_rounds=2, block=4, most_steps=12)
# With effects the tails of a hasty proposal are so heavy that two versions of Pareto smoothing differ by up to 0.14 in
# eight seeds; after one learned from three times the draws, by 0.04.
LESS_HASTY = replace(HASTY, round_draws=6144)
# Ragged in every way: times, numbers of readings, hold numbers that skip, holds without a record, a slack end.
TESTS = {
    "short": """hold,displacement_mm,time_s,tension_N,temperature_C
1,1,0,1.52,20
1,1,30,1.41,20.5
1,1,70,1.35,21
2,2,0,2.31,21
4,3.5,0,3.62,21
4,3.5,10,3.4,21
4,3.5,20,3.32,21
4,3.5,40,3.24,21
4,3.5,90,3.14,21
7,5,0,4.6,20
7,5,120,4.1,20
9,6,0,5.1,20
9,6,60,4.8,20
""",
    "long": """hold,displacement_mm,time_s,tension_N
1,2,0,1.5
1,2,60,1.38
3,4,5,2.4
3,4,25,2.28
3,4,65,2.2
5,7,0,3.65
5,7,100,3.25
""",
}
TOML = """[[experiment]]
name = "short"
material = "line"
length_mm = 1000.0
resolution_N = 0.01
readings = "short.csv"
unrecorded_holds = [
  { before_hold = 4, displacement_mm = 2.5, duration_s = 30.0 },
  { before_hold = 4, displacement_mm = 3.0, duration_s = 40.0 },
  { before_hold = 9, displacement_mm = 5.5, duration_s = 10.0 },
]

[[experiment]]
name = "long"
material = "line"
length_mm = 2000.0
readings = "long.csv"
unrecorded_holds = [{ before_hold = 1, displacement_mm = 0.5, duration_s = 30.0 }]
"""
KINDS = ["chain", "hold", "together", "apart", "effects", "unknown"]


@pytest.fixture(scope="module")
def experiments(tmp_path_factory: pytest.TempPathFactory) -> list[Experiment]:
    folder = tmp_path_factory.mktemp("tests")
    for name, table in TESTS.items():
        (folder / f"{name}.csv").write_text(table)
    (folder / "tests.toml").write_text(TOML)
    return read_experiments(folder / "tests.toml")


@pytest.fixture(scope="module")
def stored(experiments: list[Experiment], tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[Path, Fit]]:
    """Kind of result -> folder of its posterior.nc, and the fit."""
    short, both = experiments[:1], experiments
    joint = fit_problem(build(both), 1, policy=HASTY)
    fits = {
        "chain": fit_problem(build(short), 1, policy=HASTY),
        "hold": fit_problem(build(short, spec=ModelSpec(likelihood="hold")), 1, policy=HASTY),
        "together": joint,
        "apart": joint,
        "effects": fit_problem(
            build(short, [effect_named("thermal_expansion"), effect_named("grip_slip@4")]), 1, policy=LESS_HASTY
        ),
        "unknown": fit_problem(build(short, [effect_named("discrepancy@8:0.3:70.0:1.0:7.0")]), 1, policy=HASTY),
    }
    out = {}
    for kind, done in fits.items():
        folder = tmp_path_factory.mktemp(kind)
        store.save_posterior(done, folder, {}, sample=done.problem.samples[0] if kind == "apart" else None)
        out[kind] = (folder, done)
    return out


# from 1.0 on, for Python 3.12 and later, ArviZ has other functions for pictures and other names for what they return
IS_NEW = int(az.__version__.split(".")[0]) >= 1
OLD_PICTURES = pytest.mark.skipif(IS_NEW, reason="pictures of ArviZ below 1.0")
# hold by hold, a hold of one reading has nothing to predict, and a constant density; the new one's loo refuses it
LOO_KINDS = [kind for kind in KINDS if not (IS_NEW and kind == "hold")]


def elpd_of(found: Any) -> Any:
    """The estimate by leaving one out, whatever this version of ArviZ calls it."""
    return found.elpd_loo if hasattr(found, "elpd_loo") else found.elpd


def pointwise_of(found: Any) -> Any:
    return (found.loo_i if hasattr(found, "loo_i") else found.elpd_i).values


def opened(stored: dict[str, tuple[Path, Fit]], kind: str) -> Any:  # what ArviZ opens is called otherwise from 1.0 on
    return az.from_netcdf(stored[kind][0] / "posterior.nc")


def finite(array: object) -> np.ndarray:
    return np.isfinite(np.asarray(array))


@pytest.mark.parametrize("kind", KINDS)
def test_what_was_measured_is_labelled_masked_and_has_units(
    stored: dict[str, tuple[Path, Fit]], experiments: list[Experiment], kind: str
) -> None:
    data = opened(stored, kind)
    of = experiments if kind == "together" else experiments[:1]
    holds = [(e.name, hold) for e in of for hold in e.recorded_holds]
    labels = [f"{name}:{hold.number}" if kind == "together" else hold.number for name, hold in holds]
    for group in ("observed_data", "posterior_predictive", "log_likelihood", "constant_data"):
        assert list(data[group].hold.values) == labels, group
        for name, variable in data[group].data_vars.items():
            if variable.dtype.kind == "f":
                assert "units" in variable.attrs, (group, name)
    observed, predicted, constant = data.observed_data, data.posterior_predictive, data.constant_data
    for i, (_, hold) in enumerate(holds):
        n = len(hold.time_s)
        assert np.array_equal(observed.tension_N[i, :n], hold.tension_N)
        assert np.array_equal(constant.time_s[i, :n], hold.time_s)
        assert float(observed.hold_mean_N[i]) == pytest.approx(hold.tension_N.mean())
        assert not finite(observed.tension_N[i, n:]).any() and not finite(constant.time_s[i, n:]).any()
    assert list(constant.displacement_mm.values) == [hold.displacement_mm for _, hold in holds]
    # what ArviZ flattens together has values in the same places
    assert (finite(predicted.tension_N) == finite(observed.tension_N)).all()
    assert finite(predicted.hold_mean_N).all() and finite(data.log_likelihood.tension_N).all()
    units = {
        str(n): v.attrs["units"]
        for g in (observed, predicted, constant)
        for n, v in g.data_vars.items()
        if v.dtype.kind == "f"
    }
    assert units["tension_N"] == units["hold_mean_N"] == "N" and units["time_s"] == units["duration_s"] == "s"
    assert units["displacement_mm"] == units["unrecorded_displacement_mm"] == "mm" and units["warming_K"] == "K"
    assert data.posterior.k1.attrs["units"] == "N" and json.loads(data.posterior.attrs["experiments"])


@pytest.mark.parametrize("kind", KINDS)
def test_a_protocol_comes_back_as_it_was(
    stored: dict[str, tuple[Path, Fit]], experiments: list[Experiment], kind: str
) -> None:
    for experiment in experiments if kind == "together" else experiments[:1]:
        sample = read_back.load_posterior(stored[kind][0], experiment.name).sample
        expected = experiment.protocol()
        for name, value in vars(expected).items():
            assert np.array_equal(getattr(sample.protocol, name), value), name
        assert np.array_equal(sample.readings[..., 0], experiment.tension())


@pytest.mark.parametrize("kind", KINDS)
def test_predicted_draws_are_labelled_with_the_parameters_they_were_made_of(
    stored: dict[str, tuple[Path, Fit]], kind: str
) -> None:
    data = opened(stored, kind)
    few = data.sel(draw=data.posterior_predictive.draw)
    assert few.posterior.sizes["draw"] == data.posterior_predictive.sizes["draw"] < data.posterior.sizes["draw"]
    if kind == "hold":
        return  # levels are given there
    # the first hold's level follows the preload of the same draw
    level = few.posterior_predictive.hold_mean_N[..., 0].values.ravel()
    preload = few.posterior.preload.values.reshape(len(level), -1)[:, 0]
    stiffness = few.posterior.k1.values.ravel()
    by_chance = 1.0 / np.sqrt(len(level))
    assert np.corrcoef(level, preload * stiffness)[0, 1] > 5.0 * by_chance


@pytest.mark.parametrize("kind", LOO_KINDS)
def test_statistics(stored: dict[str, tuple[Path, Fit]], kind: str) -> None:
    data = opened(stored, kind)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # heavy tails: holds of a few readings
        assert finite(az.summary(data).loc["k1"]).all()
        for statistic in (az.rhat, az.ess, az.mcse):
            assert all(finite(v).all() for v in statistic(data).data_vars.values())
        assert finite(az.hdi(data).k1).all()
        loo = az.loo(data, pointwise=True)
        assert loo.n_data_points == data.observed_data.sizes["hold"] and np.isfinite([elpd_of(loo), loo.se]).all()
        table = az.compare({"one": data, "other": data})
    assert finite(elpd_of(table)).all() and float(table.elpd_diff.abs().max()) == 0.0


@pytest.mark.parametrize("kind", [k for k in LOO_KINDS if k in ("chain", "hold", "together", "effects")])
def test_loo_is_leaving_one_hold_out(
    stored: dict[str, tuple[Path, Fit]], kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Before it refits: each hold given all others, not only those before it."""
    monkeypatch.setattr("wirebayes.prediction.leave_one_hold_out.LARGEST_K", np.inf)
    folder, fitted = stored[kind]
    ours = smoothed_leave_one_hold_out(fitted)
    data = opened(stored, kind)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        theirs = az.loo(data, pointwise=True, reff=1.0)
        # the factors of the joint density, each given the holds before, are another quantity
        all_holds = zip(fitted.problem.hold_log_likelihood(fitted.flat), fitted.problem.samples, strict=True)
        factors = [values[sample.protocol.recorded] for values, sample in all_holds]
        data.log_likelihood["tension_N"].values = np.concatenate(factors).T.reshape(data.log_likelihood.tension_N.shape)
        before = az.loo(data, pointwise=True, reff=1.0)
    # two versions of Pareto smoothing fit the tail a little differently, and a heavy one more so
    between = np.abs(pointwise_of(theirs) - ours.elpd)
    assert (between < np.where(ours.pareto_k < 0.7, 0.02, 0.1)).all()
    assert (pointwise_of(before) == pytest.approx(pointwise_of(theirs), abs=1e-3)) == (kind == "hold")


def drawn(data: Any, names: list[str]) -> None:
    few = data.sel(draw=data.posterior_predictive.draw)
    makers = {
        "ppc": lambda: az.plot_ppc(data, num_pp_samples=10, random_seed=1),
        "ppc of a hold": lambda: az.plot_ppc(data, coords={"hold": data.observed_data.hold[:1]}, num_pp_samples=10),
        "ppc cumulative": lambda: az.plot_ppc(data, kind="cumulative", num_pp_samples=10),
        "ppc scatter": lambda: az.plot_ppc(data, kind="scatter", num_pp_samples=3),
        "loo_pit": lambda: az.plot_loo_pit(few, y="hold_mean_N"),
        "loo_pit ecdf": lambda: az.plot_loo_pit(few, y="hold_mean_N", ecdf=True),
        "bpv": lambda: az.plot_bpv(data, kind="u_value", var_names=["hold_mean_N"]),
        "lm": lambda: az.plot_lm(idata=few, y="hold_mean_N", x=few.constant_data.displacement_mm, y_hat="hold_mean_N"),
        "khat": lambda: az.plot_khat(az.loo(data, pointwise=True)),
        "elpd": lambda: az.plot_elpd({"one": data, "other": data}),
        "trace": lambda: az.plot_trace(data, compact=True),
        "posterior": lambda: az.plot_posterior(data),
        "pair": lambda: az.plot_pair(data, var_names=["k1", "B", "U"]),
        "forest": lambda: az.plot_forest(data),
        "density": lambda: az.plot_density(data, var_names=["k1", "B"]),
        "violin": lambda: az.plot_violin(data, var_names=["k1"]),
        "rank": lambda: az.plot_rank(data, var_names=["k1"]),
        "autocorr": lambda: az.plot_autocorr(data, var_names=["k1"]),
        "ess": lambda: az.plot_ess(data, var_names=["k1"]),
        "mcse": lambda: az.plot_mcse(data, var_names=["k1"]),
        "prior and posterior": lambda: az.plot_dist_comparison(data, var_names=["k1"]),
    }
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of matplotlib's and pandas' future versions, and of heavy tails
        for name in names or makers:
            makers[name]()
            plt.close("all")


# one sample, two fitted together, and a discrepancy; the others in the full tests
FEW_KINDS = [k if k in ("chain", "together", "unknown") else pytest.param(k, marks=pytest.mark.slow) for k in KINDS]


@OLD_PICTURES
@pytest.mark.parametrize("kind", FEW_KINDS)
def test_predictive_plots(stored: dict[str, tuple[Path, Fit]], kind: str) -> None:
    drawn(opened(stored, kind), ["ppc", "loo_pit", "khat"])


@OLD_PICTURES
@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_all_plots(stored: dict[str, tuple[Path, Fit]], kind: str) -> None:
    drawn(opened(stored, kind), [])


@OLD_PICTURES
@pytest.mark.parametrize("kind", ["chain", "together"])
def test_the_plotted_observation_is_the_measured_one(stored: dict[str, tuple[Path, Fit]], kind: str) -> None:
    data = opened(stored, kind)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        axes = az.plot_ppc(data, kind="cumulative", var_names=["tension_N"], num_pp_samples=5, random_seed=1)
    lines = {line.get_label(): line for line in np.ravel(axes)[0].get_lines()}
    plotted = np.asarray(lines["Observed"].get_xdata(), float)
    measured = data.observed_data.tension_N.values
    assert np.array_equal(plotted[np.isfinite(plotted)], np.sort(measured[np.isfinite(measured)]))
    plt.close("all")


def test_a_reading_without_its_time_is_refused(stored: dict[str, tuple[Path, Fit]], tmp_path: Path) -> None:
    copy = tmp_path / "posterior.nc"
    copy.write_bytes((stored["chain"][0] / "posterior.nc").read_bytes())
    with h5py.File(copy, "a") as file:
        file["constant_data/time_s"][0, 1] = np.nan
    with pytest.raises(InputError, match="readings and times that do not belong together"):
        read_back.load_posterior(tmp_path)
