"""Synthetic tests: what is written is what was asked, and the truth written beside it explains the readings."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from wirebayes.cli import main
from wirebayes.effects import effect_named
from wirebayes.io.experiment_file import read_experiments
from wirebayes.io.run_folder import read_json
from wirebayes.simulation.stated_truth import effect_option
from wirebayes.simulation.synthetic import Bench, Truth, draw, write_tests

TRUE = {"k1": 700.0, "B": 0.2, "U": 0.4, "k2": 0.02, "N": 1.0, "preload": 0.3, "sensor_sd": 0.005, "setting_sd": 0.01}


def by_hand(truth, displacements, times):
    """Eqs (4)-(6) of the saturating chain at the written setting errors, in plain Python."""
    p, length, carried, out = truth["parameters"], 1000.0, 0.0, []
    for displacement, setting in zip(displacements, truth["setting_mm"], strict=True):
        stretched = length + p["preload"] + displacement + setting
        first = max(p["k1"] * (stretched / (length + carried) - 1), 0.0)
        goal = p["B"] * first ** p["U"] if first > 0 else 0.0
        course = [carried + (goal - carried) * (1 - np.exp(-p["k2"] * t ** p["N"])) for t in times]
        out.append([max(p["k1"] * (stretched / (length + e) - 1), 0.0) for e in course])
        carried = course[-1]
    return np.array(out)


def test_the_files_hold_what_was_asked_and_the_truth_explains_them(tmp_path):
    path, times = [1.0, 2.5, 4.0, 2.0], [0.0, 20.0, 200.0]
    write_tests(tmp_path, [Bench("a", "line", 1000.0, 0.01, path, times, frozenset({2}))], Truth(TRUE), seed=5)
    (experiment,) = read_experiments(tmp_path / "experiments.toml")
    truth = read_json(tmp_path / "truth.json")["experiments"]["a"]
    expected = by_hand(truth, path, times)
    assert [hold.displacement_mm for hold in experiment.holds] == path
    assert [hold.recorded for hold in experiment.holds] == [True, False, True, True]
    assert [hold.number for hold in experiment.recorded_holds] == [1, 3, 4]
    measured = experiment.tension()[[0, 2, 3]]
    assert np.allclose(truth["noise_free_N"][0], expected[0], atol=1e-12)
    assert np.abs(measured - expected[[0, 2, 3]]).max() < 5 * TRUE["sensor_sd"] + 0.005
    assert np.allclose(measured * 100, np.round(measured * 100), atol=1e-9)
    assert truth["parameters"] == TRUE


def test_noise_and_setting_error_have_the_size_that_was_asked():
    many = Bench(displacements_mm=np.linspace(1, 12, 800), times_s=(0.0, 10.0), resolution_N=0.0)
    made = draw([many], Truth(TRUE | {"sensor_sd": 0.02, "setting_sd": 0.05}), seed=1)
    noise = made.problem.samples[0].readings[..., 0] - made.noise_free[0]
    assert np.std(made.setting_error[0]) == pytest.approx(0.05, rel=4 / np.sqrt(2 * 800))
    assert np.std(noise) == pytest.approx(0.02, rel=4 / np.sqrt(2 * 1600))


def test_open_parameters_follow_the_prior_and_samples_of_a_line_share_it():
    benches = [Bench("a", "line", 1000.0), Bench("b", "line", 2000.0), Bench("c", "other", 1000.0)]
    made = draw(benches, Truth(effects=(effect_named("strain_stiffening"),)), seed=2)
    a, b, c = (made.problem.parameters(made.theta, s) for s in made.problem.samples)
    assert a["k1"] == b["k1"] != c["k1"]
    assert b["B"] == pytest.approx(2 * a["B"])
    assert a["preload"] != b["preload"]
    assert a["strain_stiffening.c"] == b["strain_stiffening.c"] != c["strain_stiffening.c"]
    k1 = [draw([Bench()], seed=s).theta[0, 0] for s in range(60)]
    assert np.mean(np.log(k1)) == pytest.approx(np.log(2000.0), abs=4 * 1.5 / np.sqrt(60))


def test_an_effect_is_in_the_readings():
    plain = draw([Bench(resolution_N=0.0)], Truth(TRUE | {"setting_sd": 1e-9, "sensor_sd": 1e-9}), seed=3)
    slipped = draw(
        [Bench(resolution_N=0.0)],
        Truth(TRUE | {"setting_sd": 1e-9, "sensor_sd": 1e-9, "grip_slip.w": 0.5}, (effect_named("grip_slip@7"),)),
        seed=3,
    )
    gap = slipped.noise_free[0][:, 0] - plain.noise_free[0][:, 0]
    assert np.abs(gap[:6]).max() < 1e-6
    assert gap[6] == pytest.approx(-700.0 * 0.5 / 1000, rel=0.02)


def test_same_seed_same_bytes_and_another_seed_other_readings(tmp_path):
    options = ["--tests", "2", "--unload", "3", "--temperature", "20,22", "--effect", "thermal_expansion.alpha=1e-4"]
    for folder, seed in (("a", "4"), ("b", "4"), ("c", "5")):
        assert main(["simulate", "--output", str(tmp_path / folder), "--seed", seed, *options]) == 0
    for name in ("experiments.toml", "truth.json", "wire-1.csv", "wire-2.csv", "configuration.json"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    assert (tmp_path / "a" / "wire-1.csv").read_bytes() != (tmp_path / "c" / "wire-1.csv").read_bytes()
    experiment = read_experiments(tmp_path / "a" / "experiments.toml")[0]
    assert [h.displacement_mm for h in experiment.holds[-4:]] == [12.0, 11.0, 10.0, 9.0]
    assert experiment.holds[0].temperature_C[0] == 20.0
    assert experiment.holds[-1].temperature_C[-1] == 22.0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--parameter", "k=3"], "no such parameter (did you mean k"),
        (["--parameter", "k1"], "expected a finite number"),
        (["--parameter", "k1=-3"], "k1: found -3, expected a number from 0"),
        (["--effect", "stiffening.c=3"], "no such effect"),
        (["--effect", "strain_stiffening.d=3"], "has no amplitude 'd'; it has c"),
        (["--effect", "grip_slip.w=1"], "grip_slip@7"),
        (["--times", "0,30,30"], "expected rising times"),
        (["--displacements", "1,2,x"], "--displacements: found 'x'"),
        (["--displacements", "1,2,-1000"], "expected more than -1000 mm"),
        (["--unload", "12"], "expected fewer than the 12"),
        (["--weights", "1,2", "--displacements", "1,2"], "found --displacements beside it, expected one of the two"),
        (["--weights", "1,200", "--parameter", "k1=150", "--elastic-law", "modified"], "hold of 200 N: found a wire"),
        (["--effect", "grip_slip@13.w=0.2"], "grip_slip@13: found hold 13, expected a recorded one from 1 to 12"),
        (["--effect", "grip_slip@3.w=0.2", "--unrecorded", "3"], "found hold 3, expected a recorded one"),
        (["--effect", "toe.w=1", "--effect", "toe.w=2"], "--effect toe.w=2: found toe.w a second time"),
        (["--parameter", "k1=400", "--parameter", "k1=500"], "--parameter k1=500: found k1 a second time"),
        (["--lengths", "1e-9"], "expected lengths from 1e-03 to 1e+08 mm"),
        (["--unrecorded", "12"], "expected a hold from 1 to 11"),
        (["--lengths", "1000,1000"], "expected different lengths"),
        (["--effect", "thermal_expansion.alpha=1e-5"], "found tests that read the same without it"),
        (["--effect", "lost_motion.w=0.1", "--weights", "2,4"], "found tests that read the same without it"),
        (["--effect", "superposition.omega=1", "--history", "additive"], "found --history additive"),
    ],
)
def test_wrong_options_are_said_and_nothing_is_written(options, message, tmp_path, capsys):
    assert main(["simulate", "--output", str(tmp_path / "out"), *options]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_effect_options_name_hold_and_amplitude():
    effect, chosen = effect_option("grip_slip@7.w=.2")
    assert (effect.key, chosen) == ("grip_slip@7", {"grip_slip.w": 0.2})
    assert effect_option("superposition")[1] == {}


WEIGHTS = ["--weights", "1,2,3,4,5,6"]


@pytest.mark.parametrize(
    ("effect", "control"),
    [
        ("strain_stiffening.c=30", []),
        ("strain_stiffening.c=30", WEIGHTS),
        ("sensor_nonlinearity.a=0.05", []),
        ("sensor_nonlinearity.a=0.05", WEIGHTS),
        ("screw_error.a=0.05", []),
    ],
)
def test_effects_whose_priors_follow_the_test_are_simulated(effect, control, tmp_path):
    """A sample's model has them with priors of its own, and they are the same effects."""
    assert main(["simulate", "--effect", effect, *control, "--output", str(tmp_path / "out")]) == 0
    name, value = effect.split("=")
    truth = read_json(tmp_path / "out" / "truth.json")["experiments"]["wire"]["parameters"]
    assert truth[name] == float(value)


def test_an_effect_of_ones_own_is_written_into_the_readings(tmp_path):
    own = str(Path(__file__).parents[2] / "docs" / "own_effect.py")
    wire = ["--parameter", "sensor_sd=1e-6", "--parameter", "setting_sd=1e-6", "--parameter", "k1=700"]
    for name, p in (("plain", "0"), ("power", "0.5")):
        options = ["--own-effects", own, "--effect", f"own_power.p={p}", *wire]
        assert main(["simulate", "--output", str(tmp_path / name), *options]) == 0
    plain, power = (read_experiments(tmp_path / name / "experiments.toml")[0].tension() for name in ("plain", "power"))
    assert (power[-1, 0] / plain[-1, 0]) > 2.0  # strains well above 0.001
    assert main(["simulate", "--output", str(tmp_path / "no"), "--effect", "own_power.p=1"]) == 2


def test_the_experiment_file_is_plain_toml(tmp_path):
    write_tests(tmp_path, [Bench("a"), Bench("b", resolution_N=0.0)], seed=0)
    tables = tomllib.loads((tmp_path / "experiments.toml").read_text())["experiment"]
    assert [t["name"] for t in tables] == ["a", "b"]
    assert "resolution_N" not in tables[1]
