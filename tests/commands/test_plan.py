"""`wirebayes plan`: from a plan file, from readings, from a fit and from findings that could not decide."""

from dataclasses import replace
from pathlib import Path
from shutil import copytree
from types import SimpleNamespace

import numpy as np
import pytest

import wirebayes as wb
from wirebayes.cli import main
from wirebayes.commands import plan as module
from wirebayes.commands import plan_content
from wirebayes.commands.wires import robot_of
from wirebayes.effects import CATALOGUE
from wirebayes.io.run_folder import read_json, write_json
from wirebayes.planning import sensitivity
from wirebayes.results.mixture import write_mixture
from wirebayes.robot.mechanics import schema
from wirebayes.wire.model import PLAIN

FIELD = Path(__file__).parents[1] / "robot" / "field"
FEW = wb.Policy(walkers=32, ess=100, rounds=2, most_rounds=2, round_draws=512, block=8, most_steps=16, r_hat=99)
PLAN = """budget_min = 4.0
robot = "linear-7"
[guess]
k1 = { distribution = "log-normal", median = 1500.0, sd_log = 0.1 }
B = { distribution = "log-normal", median = 0.3, sd_log = 0.2 }
U = 0.6
k2 = { distribution = "log-normal", median = 0.03, sd_log = 0.2 }
N = 0.7
preload = 0.5
sensor_sd = 0.008
setting_sd = 0.015
[[protocol]]
name = "short"
length_mm = 1000.0
step_mm = 1.0
holds = 5
hold_s = 40.0
readings = 3
[[protocol]]
name = "long"
length_mm = 2000.0
step_mm = 2.0
holds = 5
hold_s = 400.0
readings = 9
"""


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    """Few simulations, and a catalogue of four effects."""
    few = {name: CATALOGUE[name] for name in ("toe", "steady_creep", "sensor_drift", "lost_motion")}
    monkeypatch.setattr(sensitivity, "SIMULATIONS", 40)
    monkeypatch.setattr(module, "_ROBOT_TESTS", 2)
    monkeypatch.setattr(plan_content, "_ROBOT_DRAWS", 20)
    monkeypatch.setattr(module, "catalogue", lambda own: few)


@pytest.fixture
def plan_file(tmp_path):
    path = tmp_path / "plan.toml"
    path.write_text(PLAN)
    return path


@pytest.fixture(scope="module")
def measured():
    parameters = {"k1": 1500.0, "B": 0.3, "U": 0.6, "k2": 0.03, "N": 0.7, "preload": 0.5, "sensor_sd": 0.008}
    options = {"displacements": range(1, 6), "times": [0, 30, 60], "seed": 2, "parameters": parameters}
    return wb.simulate_tests(**options).experiments[0]


@pytest.fixture(scope="module")
def fitted(measured, tmp_path_factory):
    return wb.fit(measured, check=False, policy=FEW, output=tmp_path_factory.mktemp("fitted") / "out").folder.parent


def test_a_robot_on_wires_of_its_own_is_said_to_be_changed_by_no_test(plan_file, tmp_path, capsys):
    table = "\n[wires.mine]\nk1_N = 800.0\nB_mm = 0.3\nU = 1.0\nk2 = 0.03\nN = 0.7\nlength_mm = 1000.0\n"
    text = schema.robot_text("hangprinter-4").replace("[[leg]]", '[[leg]]\nwire = "mine"') + table
    robot, out = tmp_path / "own.toml", tmp_path / "out"
    robot.write_text(text)
    plan_file.write_text(PLAN.replace('"linear-7"', f'"{robot}"'))
    assert main(["plan", str(plan_file), "--output", str(out)]) == 0
    found = read_json(out / "plan.json")
    assert [row["robot"] for row in found["protocols"]] == [None, None]
    assert [one["kind"] for one in found["warnings"]] == ["left-out"]
    printed = capsys.readouterr()
    assert "no test of this line changes the drift of" in printed.err and "drift of the robot" not in printed.out
    assert "drift in 1 h" not in (out / "report.html").read_text()


def test_what_speaks_against_a_robots_file_stands_in_the_plan_that_moves_it():
    cube = robot_of(FIELD / "balanced-home" / "cube4.toml")
    far = replace(cube, beyond_m=np.full(4, 1e4))
    assert [one.kind for one in plan_content._of_robot(far)] == ["geometry", "unheld"]
    assert plan_content._of_robot(schema.read_robot_file("linear-7")) == []


def test_a_robot_that_nothing_holds_at_home_has_no_drift():
    """Nor does numpy complain of medians of nothing: warnings are errors here."""
    robot = schema.read_robot_file("cogiro-desk")
    high = replace(robot, home_m=robot.home_m + [0.0, 0.0, 1.0])
    draws = {name: np.full(3, value) for name, value in {"k1": 5e3, "B": 0.1, "U": 0.6, "k2": 0.01, "N": 0.6}.items()}
    judged = SimpleNamespace(
        test=SimpleNamespace(length_mm=1e3), expected=SimpleNamespace(draws=[draws, draws], model=PLAIN)
    )
    guess = SimpleNamespace(draws=draws, length_mm=1e3)
    request = SimpleNamespace(guess=guess, model=PLAIN)
    assert plan_content._drift(judged, request, high) is None
    assert plan_content._drift(judged, request, robot)["drift_mm"] > 0


def test_a_plan_file_is_ranked_within_its_budget(plan_file, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["plan", str(plan_file), "--output", str(out)]) == 0
    found = read_json(out / "plan.json")
    short, long = found["protocols"]
    assert [(p["name"], p["within_budget"]) for p in (short, long)] == [("short", True), ("long", False)]
    assert (short["duration_min"], short["readings"]) == (pytest.approx(200 / 60), 15)
    assert long["information_bits"] > short["information_bits"]
    assert long["robot"]["drift_sd_mm"] < short["robot"]["drift_sd_mm"]
    assert long["robot"]["drift_sd_mm"] < long["robot"]["drift_sd_guess_mm"]
    assert short["creep"]["tension_N"] == long["creep"]["tension_N"]
    assert found["guess"]["parameters"]["B"]["q50"] == pytest.approx(0.3, rel=0.2)
    printed = capsys.readouterr().out
    assert printed.startswith("1. short: 3.33 min, ")
    assert "2. long: 33.3 min, longer than the available time" in printed
    page = (out / "report.html").read_text()
    assert "What a test would teach" in page
    assert "steady creep" in page
    units = {name: width["unit"] for name, width in short["parameters"].items()}
    assert (units["k1"], units["B"], units["sensor_sd"], units["setting_sd"]) == ("N", "mm N^-U", "N", "mm")
    assert "error of a setting (setting_sd), mm" in page and "error of a reading (sensor_sd), N" in page
    assert (out / "plan.svg").is_file()
    before = (out / "plan.json").read_bytes()
    assert main(["plan", str(plan_file), "--output", str(out)]) == 0
    assert (out / "plan.json").read_bytes() == before
    assert main(["plan", str(plan_file), "--output", str(out), "--aim", "creep"]) == 2
    assert "made with another configuration: aim" in capsys.readouterr().err


def test_the_same_seed_gives_the_same_bytes(plan_file, tmp_path):
    plan_file.write_text(PLAN.replace('robot = "linear-7"\n', ""))
    options = {"tests": 4}
    one = wb.plan(plan_file, **options, output=tmp_path / "one")
    wb.plan(plan_file, **options, output=tmp_path / "two")
    assert (tmp_path / "one" / "plan.json").read_bytes() == (tmp_path / "two" / "plan.json").read_bytes()
    assert wb.load(one.save(tmp_path / "three")).protocols == one.protocols
    other = wb.plan(plan_file, **options, seed=1, budget_min=0.5)
    assert other.best["parameters"]["k1"]["sd"] != one.best["parameters"]["k1"]["sd"]
    assert other.messages == ("warning: no test is done within 0.5 min",)


def test_readings_are_planned_again_and_otherwise(measured):
    planned = wb.plan(measured, tests=4, budget_min=9.0, aim="creep")
    assert {row["name"] for row in planned.protocols} == {"again", "unload", "dense", "unload-dense", "half-steps"}
    again = next(row for row in planned.protocols if row["name"] == "again")
    assert (again["holds"], again["readings"], again["duration_min"]) == (5, 15, 5.0)
    assert planned.best["within_budget"]
    assert planned.summary()["guess"]["source"] == "a quick fit of wire"
    assert planned.messages == ()


def test_a_fits_posterior_is_the_guess(fitted, measured, plan_file, tmp_path):
    posterior = wb.load(fitted).draws()["k1"]
    planned = wb.plan(fitted, tests=4)
    guess = planned.summary()["guess"]
    assert guess["source"] == f"the posterior of wire in {fitted.name}"
    for doubt in wb.load(fitted).stored().doubts:
        assert any(doubt.text in message for message in planned.messages)
    assert guess["parameters"]["k1"]["q50"] == pytest.approx(float(sorted(posterior)[len(posterior) // 2]), rel=0.05)
    head, _, rest = PLAN.partition("[guess]")
    text = f'{head}posterior = "{fitted}"\n[[protocol]]{rest.partition("[[protocol]]")[2]}'
    plan_file.write_text(text.replace('robot = "linear-7"\n', ""))
    assert wb.plan(plan_file, tests=4).summary()["guess"]["parameters"] == guess["parameters"]


def test_findings_that_could_not_decide_say_what_to_tell_apart(fitted, tmp_path):
    folder = wb.load(fitted).save(tmp_path / "found")
    found = {"wire": {"set": ["steady_creep", "unknown"], "group": ["steady_creep", "sensor_drift"]}}
    write_json(folder / "discovery.json", {"version": 1, "experiments": found})
    planned = wb.plan(folder, tests=4)
    assert planned.summary()["aim"] == ["steady_creep", "sensor_drift"]
    scores = [row["score"] for row in planned.protocols]
    assert scores == sorted(scores, reverse=True)
    assert planned.best["name"] in ("dense", "unload-dense", "unload")  # one climb tells drift from flow badly


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"aim": "fame"}, "--aim: found fame, expected parameters, creep, or two different effects"),
        ({"aim": ["toe", "toe"]}, "--aim: found toe, toe, expected parameters, creep, or two different effects"),
        ({"budget_min": 0.0}, "--budget-min"),
        ({"tests": 1}, "tests: found 1, expected a whole number, 2 or more"),
        ({"robot": "nobody"}, "nobody"),
    ],
)
def test_a_wrong_option_is_named_and_nothing_written(plan_file, tmp_path, options, message):
    with pytest.raises(wb.InputError, match=message):
        wb.plan(plan_file, **options, output=tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_files_that_cannot_be_planned_with_are_refused(plan_file, experiment_file, tmp_path, capsys):
    plan_file.write_text(PLAN.replace("median = 1500.0", "median = -1.0"))
    assert main(["plan", str(plan_file), "--output", str(tmp_path / "out")]) == 2
    assert "line 4: guess.k1.median: found -1.0, expected a number above zero" in capsys.readouterr().err
    two = experiment_file().read_text()
    path = tmp_path / "two.toml"
    path.write_text(two + two.replace("wire-a", "wire-b"))
    with pytest.raises(wb.InputError, match="found the experiments wire-a, wire-b, expected one of them"):
        wb.plan(path)
    with pytest.raises(wb.InputError, match=r"found no posterior\.nc"):
        wb.plan(tmp_path)


def test_tests_under_weights_are_simulated_and_planned(tmp_path):
    hung = wb.simulate_tests(weights=[2, 4, 6], unload=1, times=[0, 60, 300], resolution=0.001, parameters=HUNG)
    (test,) = hung.experiments
    assert test.control == "force" and [hold.setting for hold in test.holds] == [2.0, 4.0, 6.0, 4.0]
    assert test.resolution == 0.001
    found = wb.plan(test, tests=10, output=tmp_path / "out").summary()
    assert {p["name"] for p in found["protocols"]} == {"again", "unload", "dense", "unload-dense", "half-steps"}
    assert found["protocols"][0]["creep"]["tension_N"] == 4.0
    path = tmp_path / "plan.toml"
    path.write_text(WEIGHTS)
    (row,) = wb.plan(path, tests=10, output=tmp_path / "file").summary()["protocols"]
    assert row["holds"] == 4 and row["parameters"]["k1"]["sd"] < 100.0


HUNG = {"k1": 900.0, "B": 0.1, "U": 0.9, "k2": 0.05, "N": 0.8, "preload": 0.0, "sensor_sd": 0.003, "setting_sd": 0.01}
WEIGHTS = """[guess]
k1 = { distribution = "log-normal", median = 900.0, sd_log = 0.2 }
[[protocol]]
length_mm = 1000.0
control = "force"
step_N = 2.0
holds = 3
unload = 1
hold_s = 600.0
"""


def test_a_plan_under_weights_refuses_what_only_steps_have(tmp_path):
    path = tmp_path / "plan.toml"
    path.write_text(WEIGHTS.replace("step_N", "step_mm"))
    with pytest.raises(wb.InputError, match="step_mm"):
        wb.plan(path)
    with pytest.raises(wb.InputError, match="--weights: found -1, expected more than 0 N"):
        wb.simulate_tests(weights=[1, -1])


BOTH = """[guess]
k1 = 90000.0
B = 0.002
U = 0.9
k2 = 0.05
N = 0.8
[[protocol]]
name = "steps"
length_mm = 1000.0
step_mm = 4.0
holds = 4
hold_s = 600.0
[[protocol]]
name = "weights"
length_mm = 1000.0
control = "force"
step_N = 360.0
holds = 4
hold_s = 600.0
resolution_mm = 0.01
"""


def test_steps_and_weights_in_one_plan_each_have_the_errors_of_their_own_bench(tmp_path):
    head, steps, weights = BOTH.split("[[protocol]]")
    plans = {"both": BOTH, "turned": f"{head}[[protocol]]{weights}[[protocol]]{steps}"}
    plans |= {"steps": f"{head}[[protocol]]{steps}", "weights": f"{head}[[protocol]]{weights}"}
    spread = {}
    for name, text in plans.items():
        path = tmp_path / f"{name}.toml"
        path.write_text(text)
        for row in wb.plan(path, tests=10, output=tmp_path / name).summary()["protocols"]:
            spread[name, row["name"]] = row["parameters"]["sensor_sd"]["guess_sd"]
            assert row["creep"]["creep_1h_mm"]["sd"] < 1.0  # draws of next to no weight creep by 0 times infinity
    for control in ("steps", "weights"):
        for plan in ("both", "turned"):
            ratio = spread[plan, control] / spread[control, control]
            assert 0.1 < ratio < 10.0  # other draws; newtons taken for millimetres are 90 times as many


@pytest.mark.parametrize(
    ("plan", "key"),
    [
        (BOTH.replace("U = 0.9", "sensor_sd = 0.02"), r"line 4, key guess\.sensor_sd"),
        (f"{BOTH}[prior]\nsetting_sd = {{ fixed = 0.1 }}\n", r"key prior\.setting_sd"),
    ],
)
def test_an_error_without_one_unit_is_refused(tmp_path, plan, key):
    path = tmp_path / "plan.toml"
    path.write_text(plan)
    with pytest.raises(wb.InputError, match=f"{key}: found one number for tests by steps and for tests under weights"):
        wb.plan(path)


def test_a_guess_of_numbers_alone_is_one(tmp_path):
    path = tmp_path / "plan.toml"
    numbers = "\n".join(f"{name} = {value}" for name, value in HUNG.items())
    path.write_text(f"[guess]\n{numbers}\n[[protocol]]{BOTH.split('[[protocol]]')[1]}")
    (row,) = wb.plan(path, tests=10, output=tmp_path / "out").summary()["protocols"]
    k1 = row["parameters"]["k1"]
    assert k1["guess_sd"] < 1e-9 < k1["sd"]


def test_a_fits_folder_is_planned_with_the_priors_and_the_laws_of_that_fit(measured, tmp_path):
    stated = replace(measured, priors={"N": {"fixed": 0.7}, "preload": {"fixed": 0.5}})
    options = {"check": False, "policy": FEW, "elastic_law": "modified"}
    wb.fit(stated, **options, output=tmp_path / "fit")
    for folder in (tmp_path / "fit", tmp_path / "fit" / stated.name):
        planned = wb.plan(folder, tests=4)
        assert {"N", "preload"}.isdisjoint(planned.best["parameters"])  # known, so the later fit does not estimate them
        assert all(one["kind"] != "left-out" for one in planned.summary()["warnings"])
    wb.plan(tmp_path / "fit", tests=4, output=tmp_path / "plan")
    assert read_json(tmp_path / "plan" / "configuration.json")["elastic_law"] == "modified"
    with pytest.raises(wb.InputError, match="--history: found additive, expected saturating"):
        wb.plan(tmp_path / "fit", tests=4, history="additive")


def _warned(planned):
    return [one["text"] for one in planned.summary()["warnings"] if one["kind"] == "left-out"]


def test_lasting_effects_of_a_fit_are_planned_with_and_others_said_to_be_left_out(measured, plan_file, tmp_path):
    wb.fit(measured, effects=["toe"], check=False, policy=FEW, output=tmp_path / "toe")
    planned = wb.plan(tmp_path / "toe", tests=4)
    assert not _warned(planned)
    assert "toe.w" in planned.summary()["guess"]["parameters"]
    assert planned.summary()["guess"]["source"] == "the posterior of wire in toe, with toe"
    assert planned.best["parameters"]["toe.w"]["unit"] == "mm"
    assert "toe" not in planned.best["effects"]  # it is not missing
    assert not any(sentence.startswith("toe: ") for sentence in planned.best["not_identifiable"])
    wb.fit(measured, effects=["prior_creep"], check=False, policy=FEW, output=tmp_path / "crept")
    (said,) = _warned(wb.plan(tmp_path / "crept", tests=4))
    assert said.startswith("wire was fitted with prior creep: the plan simulates and fits without")
    head, _, rest = PLAN.partition("[guess]")
    text = f'{head}posterior = "{tmp_path / "toe"}"\n[[protocol]]{rest.partition("[[protocol]]")[2]}'
    plan_file.write_text(text.replace('robot = "linear-7"\n', ""))
    (said,) = _warned(wb.plan(plan_file, tests=4))  # of other lengths and benches
    assert said.startswith("wire was fitted with toe")


def test_a_plan_after_discover_has_the_final_model_where_it_is_decided(fitted, measured, tmp_path):
    found = tmp_path / "found"
    final = found / "wire" / "final"
    wb.fit(measured, effects=["toe"], check=False, policy=FEW, output=tmp_path / "toe")
    copytree(fitted / "wire", found / "wire" / "plain")
    copytree(tmp_path / "toe" / "wire", final)
    found_there = {
        "wire": {"verdict": "nothing-missing", "warnings": [], "set": ["toe"], "group": ["toe", "sensor_drift"]}
    }
    write_json(found / "discovery.json", {"version": 1, "experiments": found_there})
    decided = wb.plan(found, tests=4)
    assert "toe.w" in decided.best["parameters"] and decided.summary()["aim"] == ["parameters"]
    asked = wb.plan(found, tests=4, aim=["toe", "sensor_drift"])
    assert "toe.w" not in asked.best["parameters"] and asked.best["score"] > 0
    write_mixture(final, [(".", 0.6, ["toe"]), ("../plain", 0.4, [])])
    assert "toe.w" not in wb.plan(found, tests=4).best["parameters"]
