"""Outlying specimens: found where they do, hardly ever where they do not."""

import numpy as np
import pytest
from scipy import stats

from wirebayes.results import outliers as module
from wirebayes.results.outliers import FALSE_ALARMS, outliers, robust_z, threshold


def row(name, k1, sd=0.01, material="line", length=1000.0, b=0.2):
    def quantiles(middle):
        return {"q05": middle * np.exp(-1.645 * sd), "q50": middle, "q95": middle * np.exp(1.645 * sd)}

    return {
        "name": name,
        "material": material,
        "length_mm": length,
        "parameters": {"k1": quantiles(k1), "B": quantiles(b * length / 1000.0)},
    }


def lot(n=12, seed=0, **about):
    rng = np.random.default_rng(seed)
    return [row(f"s{i}", 1000.0 * np.exp(0.02 * rng.normal()), **about) for i in range(n)]


def test_a_specimen_that_lies_apart_is_named_with_its_parameter():
    (found,) = outliers([*lot(), row("odd", 2000.0)])
    assert (found["experiment"], found["parameter"], found["specimens"]) == ("odd", "k1", 13)
    assert found["z"] > threshold(13, 2)
    assert found["sentence"].startswith("odd: k1 is 2000, ")
    assert "above the median of 13 specimens of line" in found["sentence"]


def test_an_uncertain_specimen_is_none():
    assert not outliers([*lot(), row("vague", 2000.0, sd=0.5)])


def test_length_is_no_reason_to_lie_apart():
    assert not outliers([*lot(6), *(row(f"long{i}", 1000.0 + i, length=3000.0) for i in range(6))])


def on_a_bench(name, control, sensor_sd):
    specimen = row(name, 1000.0)
    error = {"q05": 0.9 * sensor_sd, "q50": sensor_sd, "q95": 1.1 * sensor_sd}
    return {**specimen, "control": control, "parameters": {**specimen["parameters"], "sensor_sd": error}}


def test_a_sensor_that_reads_millimetres_is_not_compared_with_those_that_read_newtons():
    steps = [on_a_bench(f"s{i}", "displacement", 0.02) for i in range(12)]
    weights = [on_a_bench(f"w{i}", "force", 3.0) for i in range(6)]
    assert not outliers([*steps, *weights])
    (found,) = outliers([*steps, *weights, on_a_bench("odd", "displacement", 3.0)])
    assert (found["experiment"], found["parameter"], found["specimens"]) == ("odd", "sensor_sd", 13)


def test_few_specimens_and_failed_ones_are_passed_over():
    failed = {"name": "f", "material": "line", "length_mm": 1.0, "parameters": {}}
    assert not outliers([*lot(4), row("odd", 9000.0), failed])
    assert not outliers([*lot(), *lot(3, material="other"), row("odd", 9000.0, material="other")])


@pytest.mark.parametrize(("specimens", "compared"), [(5, False), (6, True)])
def test_six_specimens_are_compared_five_are_not(specimens, compared):
    assert bool(outliers([*lot(specimens - 1), row("odd", 9e7)])) is compared


def test_creep_is_compared_per_metre_of_length_and_said_so():
    (found,) = outliers([*lot(), row("odd", 1000.0, length=2000.0, b=0.8)])
    assert (found["parameter"], found["value"], found["median"]) == ("B", pytest.approx(0.8), pytest.approx(0.2))
    assert "B per m of length is 0.8" in found["sentence"]


def creeping(unit_N, unit_s, odd=1.0, tension_N=40.0):
    """Specimens with powers of their own, of which the last creeps by a factor more at the tension of the test."""
    rng = np.random.default_rng(1)
    rows = []
    for i in range(12):
        own = np.exp(0.02 * rng.normal(size=2)) * (odd if i == 11 else 1.0)
        U, N = 0.8 + 0.1 * rng.normal(), 0.6 + 0.1 * rng.normal()
        tension, time = tension_N / unit_N, 300.0 / unit_s
        creep, exponent = 0.3 * own[0], 0.7 * own[1]
        middles = {"B": creep * tension**-U, "U": U, "k2": exponent * time**-N, "N": N}
        known = {name: {"q05": 0.99 * v, "q50": v, "q95": 1.01 * v} for name, v in middles.items()}
        at = {"B": creep, "k2": exponent}
        typical = {name: {"q05": 0.99 * v, "q50": v, "q95": 1.01 * v} for name, v in at.items()}
        typical |= {"tension_N": tension, "time_s": time}
        about = {"name": f"s{i}", "material": "line", "length_mm": 1000.0}
        rows.append(about | {"parameters": known, "at_typical": typical})
    return rows


@pytest.mark.parametrize("units", [(1.0, 1.0), (1000.0, 60.0), (1e-3, 1e-3)])
def test_creep_is_compared_in_the_scales_of_the_tests_whatever_is_called_a_newton(units):
    assert not outliers(creeping(*units))
    found = {o["parameter"]: o for o in outliers(creeping(*units, odd=1.5))}
    assert set(found) == {"B", "k2"} and {o["experiment"] for o in found.values()} == {"s11"}
    assert found["B"]["value"] == pytest.approx(0.45, rel=0.05)
    tension, time = (f"{value:.3g}" for value in (40.0 / units[0], 300.0 / units[1]))
    assert f"s11: creep at {float(tension):.9g} N in mm per m of length is" in found["B"]["sentence"]
    assert f"s11: k2 t^N after {float(time):.9g} s is" in found["k2"]["sentence"]


@pytest.mark.parametrize("odd", [1.0, 1.5])
def test_a_specimen_tested_at_another_tension_is_compared_at_that_of_the_others(odd):
    rows = creeping(1.0, 1.0)
    last = rows[-1]
    grown = 10.0 ** last["parameters"]["U"]["q50"]
    creep = {name: odd * grown * value for name, value in last["at_typical"]["B"].items()}
    last["at_typical"] |= {"tension_N": 400.0, "B": creep}
    found = outliers(rows)
    assert [o["parameter"] for o in found] == ["B"] * (odd > 1.0)
    assert all(o["value"] == pytest.approx(0.45, rel=0.05) for o in found)


def test_a_low_specimen_lies_below_and_the_farthest_comes_first():
    found = outliers([*lot(), row("low", 500.0), row("lower", 200.0)])
    assert [o["experiment"] for o in found] == ["lower", "low"]
    assert "below the median" in found[0]["sentence"] and found[0]["z"] < 0


@pytest.mark.parametrize(("distance", "far"), [(0.95, False), (1.05, True)])
def test_specimens_that_agree_are_judged_by_the_width_of_the_posterior(distance, far):
    """Seven agree, each known to a tenth; the eighth lies so many times the threshold of that tenth away."""
    away = np.exp(0.1 * distance * threshold(8, 2))
    same = [row(f"s{i}", 1000.0, sd=0.1) for i in range(7)]
    assert bool(outliers([*same, row("odd", 1000.0 * away, sd=0.1)])) is far
    assert bool(outliers([*same, row("odd", 1000.0 / away, sd=0.1)])) is far


def test_positive_parameters_are_compared_by_their_logarithms_others_as_they_are():
    """Stiffnesses spread by a factor: a hundredth lies far, though by its difference it would be among the others."""
    spread = [row(f"s{i}", 1000.0 * np.exp(0.4 * z)) for i, z in enumerate(np.linspace(-2.0, 2.0, 21))]
    assert [o["experiment"] for o in outliers([*spread, row("soft", 10.0)])] == ["soft"]

    def offset(name, at):
        quantiles = {"q05": at - 0.01, "q50": at, "q95": at + 0.01}
        return {"name": name, "material": "line", "length_mm": 1.0, "parameters": {"offset": quantiles}}

    even = [offset(f"s{i}", at) for i, at in enumerate(np.linspace(-1.0, 1.0, 21))]
    assert not outliers(even)
    assert [o["experiment"] for o in outliers([*even, offset("odd", 9.0)])] == ["odd"]


def test_a_robust_z_is_the_distance_in_expected_distances():
    """Nine values whose median absolute deviation is one, each known to 0.5, one of them badly."""
    values = np.array([-4.0, -3.0, -1.0, -0.5, 0.0, 0.5, 1.0, 3.0, 4.0])
    sd = np.full(9, 0.5)
    sd[8] = 3.0
    spread = 1.4826**2 - 0.25  # what the posteriors' width does not explain
    expected = values / np.sqrt(spread + sd**2)
    assert robust_z(values, sd) == pytest.approx(expected)
    # scatter that the posteriors explain leaves no spread
    assert robust_z(values, np.full(9, 2.0)) == pytest.approx(values / 2.0)


def test_equal_specimens_divide_nothing_by_zero():
    same = [row(f"s{i}", 1000.0, sd=0.0) for i in range(8)]
    assert not outliers(same)
    assert [o["experiment"] for o in outliers([*same, row("odd", 1001.0, sd=0.0)])] == ["odd"]


def share_of_false_alarms(specimens, sets=10_000):
    """Of parameters of alike specimens."""
    rng = np.random.default_rng(1)
    limit, known = threshold(specimens, 8), np.zeros(specimens)
    return np.mean([np.abs(robust_z(rng.normal(size=specimens), known)).max() > limit for _ in range(sets)])


@pytest.mark.parametrize("specimens", [6, 12, 50])
def test_the_share_of_false_alarms_is_what_is_said(specimens):
    # eight parameters of a material; 10,000 sets tell the share of one to .0008
    assert 0.5 * FALSE_ALARMS / 8 < share_of_false_alarms(specimens) < 1.5 * FALSE_ALARMS / 8


def test_both_tails_of_every_specimen_and_parameter_share_the_risk():
    one_tail = stats.t.sf(threshold(12, 8), 1.0 + module.MAD_EFFICIENCY * 12)
    assert 2 * one_tail * 12 * 8 == pytest.approx(FALSE_ALARMS)


def test_the_share_would_be_seen_to_be_wrong(monkeypatch):
    monkeypatch.setattr(module, "MAD_EFFICIENCY", 1.0)
    assert share_of_false_alarms(12) > 1.5 * FALSE_ALARMS / 8


def only(name, values, half=0.01, material="line"):
    """Rows with one parameter, known to so much on either side."""
    return [
        {
            "name": f"s{i}",
            "material": material,
            "length_mm": 500.0,
            "parameters": {name: {"q05": v - half, "q50": v, "q95": v + half}},
        }
        for i, v in enumerate(values)
    ]


@pytest.mark.parametrize("unit", [1.0, 1e-3, 1e4])
def test_a_positive_parameter_is_compared_by_its_logarithm_in_any_unit(unit):
    """Eleven specimens a factor of two apart from the first to the last but one, which lies at a hundredth."""
    values = unit * np.append(np.geomspace(1.0, 2.0, 11), 0.01)
    found = outliers(only("k2", values, 1e-4 * unit))
    assert [o["experiment"] for o in found] == ["s11"]
    x, sd = np.log(values), np.log((values + 1e-4 * unit) / (values - 1e-4 * unit)) / (2.0 * stats.norm.ppf(0.95))
    assert found[0]["z"] == pytest.approx(robust_z(x, sd)[-1])


def test_a_parameter_that_may_be_zero_is_compared_as_it_is():
    """One whose interval begins at zero, or that is negative in a single specimen."""
    for low in (0.0, -0.5):
        values = np.append(np.linspace(1.0, 2.0, 11), low + 0.01)
        found = outliers(only("slack", values, half=0.01))
        z = robust_z(values, np.full(12, 0.02 / (2.0 * stats.norm.ppf(0.95))))
        assert bool(found) == bool(abs(z[-1]) > threshold(12, 1))
        assert outliers(only("slack", np.append(values, 40.0), half=0.01))[0]["z"] > 10.0


def test_an_outlier_says_all_there_is_to_it():
    values = [1.0, 1.01, 0.99, 1.02, 0.98, 1.0, 1.0, 3.0]
    (found,) = outliers(only("preload", values))
    assert found == {
        "experiment": "s7",
        "material": "line",
        "parameter": "preload",
        "value": 3.0,
        "median": 1.0,
        "z": found["z"],
        "specimens": 8,
        "sentence": f"s7: preload is 3, {found['z']:.1f} robust standard deviations above the median of 8 specimens "
        "of line, 1",
    }


def test_specimens_without_a_parameter_or_a_material_do_not_count_for_it():
    """Five of a lot have it: too few; of another lot six. What no lot is known of stands alone."""
    values = [1.0, 1.01, 0.99, 1.02, 90.0]
    some = only("preload", values)
    others = [row(f"k{i}", 1000.0) for i in range(6)]
    assert not outliers([*some, *others])
    one_more = only("preload", [*values, 1.0])
    assert [(o["experiment"], o["specimens"]) for o in outliers([*one_more, *others])] == [("s4", 6)]
    assert not outliers(only("preload", [*values, 1.0], material=None))


def test_equally_far_outliers_come_by_name():
    values = [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 9.0, -7.0]
    rows = only("preload", values)
    for name, at in (("b", 9), ("a", 10)):
        rows[at]["name"] = name
    assert [(o["experiment"], o["z"] > 0) for o in outliers(rows)] == [("a", False), ("b", True)]


def test_the_threshold_is_student_s_t_for_all_comparisons_of_a_material():
    for specimens, parameters in ((6, 1), (12, 8)):
        level = 1.0 - 0.05 / (2 * specimens * parameters)
        assert threshold(specimens, parameters) == pytest.approx(stats.t(1.0 + 0.37 * specimens).ppf(level))


def test_a_spread_counts_down_to_a_billionth():
    """Specimens that agree to a millionth are judged by that; what has no spread at all is a billionth wide."""
    values = 1e-6 * np.array([-4.0, -2.0, -1.0, 0.0, 1.0, 2.0, 40.0])
    assert robust_z(values, np.full(7, 1e-9)) == pytest.approx(values / (1.4826 * 2e-6), rel=1e-5)
    assert robust_z(values * 0.0 + np.array([0, 0, 0, 0, 0, 0, 1e-3]), np.zeros(7))[-1] == pytest.approx(1e6)
