"""The example of a hold to come that lies beside a fit is what the `Next:` line says: a protocol that predict reads."""

import csv
import shlex
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import wirebayes as wb
from wirebayes.cli import main
from wirebayes.io.next_hold import NEXT_HOLD, write_next_hold
from wirebayes.io.readings import protocol_holds, protocol_table

FEW = wb.Policy(walkers=32, ess=300, rounds=2, round_draws=1024, block=20, most_steps=60, r_hat=1.5)
JOINT = replace(FEW, round_draws=4096, most_steps=400)  # several tests together: a better proposal, and more steps


def one_test(**options: Any) -> wb.Experiment:
    (one,) = wb.simulate_tests(**{"seed": 1, "times": [0, 30, 60], "parameters": {"k1": 900}} | options).experiments
    return one


def example_of(experiment: wb.Experiment, folder: Path) -> list[dict[str, str]]:
    write_next_hold(experiment, folder)
    with (folder / NEXT_HOLD).open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize(
    ("options", "set_", "value"),
    [
        ({"displacements": [1.1, 2.2, 3.3], "unload": 2}, "displacement_mm", "4.4"),  # beyond the largest, not the last
        ({"displacements": [5.0, 0.5, 7.0, 0.5]}, "displacement_mm", "9.0"),
        ({"displacements": [4.0]}, "displacement_mm", "4.0"),
        ({"weights": [5.0, 10.0, 20.0]}, "tension_N", "30.0"),
    ],
)
def test_the_next_hold_is_a_step_beyond_the_furthest(options, set_, value, tmp_path) -> None:
    experiment = one_test(**options)
    rows = example_of(experiment, tmp_path)
    assert [list(row) for row in rows] == [["hold", set_, "time_s"]] * 3
    assert {row["hold"] for row in rows} == {str(len(experiment.holds) + 1)}
    assert {row[set_] for row in rows} == {value}
    assert [row["time_s"] for row in rows] == ["0.0", "30.0", "60.0"]


def test_the_next_hold_of_an_elastic_thread_is_one_that_predict_reads(tmp_path) -> None:
    rows = example_of(one_test(lengths=[10.0], displacements=[20, 40, 70]), tmp_path)
    assert {row["displacement_mm"] for row in rows} == {"80.0"}
    assert protocol_holds(protocol_table(tmp_path / NEXT_HOLD), 10.0)


def test_it_goes_on_at_the_last_temperature_and_has_few_of_many_times(tmp_path) -> None:
    rows = example_of(one_test(times=range(1001), temperature=[20.0, 24.0], displacements=[1, 2]), tmp_path)
    assert {float(row["temperature_C"]) for row in rows} == {24.0}
    assert [float(row["time_s"]) for row in rows] == [0.0, 250.0, 500.0, 750.0, 1000.0]


@pytest.mark.parametrize("options", [{"displacements": [1, 2, 3, 2]}, {"weights": [2.0, 5.0, 9.0, 1.0]}])
def test_hold_by_hold_the_next_hold_has_its_first_reading_and_runs_too(options, tmp_path, capsys) -> None:
    experiment = one_test(**options)
    found = wb.fit(experiment, likelihood="hold", policy=FEW, check=False, output=tmp_path / "out of holds")
    (next_step,) = found.next_step().splitlines()  # no robot: it needs the stiffness
    command = shlex.split(next_step.partition("  (")[0])[1:]
    assert main(command) == 0
    highest = experiment.holds[2]
    assert f"{highest.readings[0]:.3g}" in capsys.readouterr().out
    with Path(command[2]).open(newline="") as file:
        first, *others = csv.DictReader(file)
    read = "tension_N" if "displacements" in options else "displacement_mm"
    assert float(first[read]) == highest.readings[0] and {row[read] for row in others} == {""}
    assert {row["hold"] for row in (first, *others)} == {"5"}


@pytest.mark.parametrize(("lengths", "together"), [([1000], False), ([1000, 1500], False), ([1000, 1500], True)])
def test_the_command_that_the_next_line_names_runs_as_it_stands(lengths, together, tmp_path, capsys) -> None:
    experiments = wb.simulate_tests(seed=1, displacements=[1, 2, 3], times=[0, 30, 60], lengths=lengths).experiments
    material = experiments[0].material if together else None
    found = wb.fit(experiments, together=material, policy=JOINT, check=False, output=tmp_path / "out")
    command = shlex.split(found.next_step().partition("  (")[0])
    assert command.pop(0) == "wirebayes"
    assert main(command) == 0
    assert f"Hold 4 of {experiments[0].name}, at 4 mm" in capsys.readouterr().out


def test_a_fit_of_two_kinds_of_test_has_an_example_of_each(tmp_path, capsys) -> None:
    hung = replace(one_test(weights=[5.0, 10.0, 20.0]), name="hung")
    pulled = one_test(displacements=[1, 2, 3])
    tests = [pulled, replace(pulled, name="again"), hung]
    found = wb.fit(tests, together=hung.material, policy=JOINT, check=False, output=tmp_path / "out")
    steps = [shlex.split(step.partition("  (")[0])[1:] for step in found.next_step().splitlines()]
    predictions = [step for step in steps if step[0] == "predict"]
    for command, (name, at) in zip(predictions, [(pulled.name, "4 mm"), ("hung", "30 N")], strict=True):
        assert main(command) == 0
        assert f"Hold 4 of {name}, at {at}" in capsys.readouterr().out
    assert not (tmp_path / "out" / hung.material_folder / "next-again.csv").exists()


def test_commands_that_follow_are_given_effects_of_the_user_s_own(tmp_path, capsys) -> None:
    (tmp_path / "of mine.py").write_text(Path("docs/own_effect.py").read_text())
    test = one_test(displacements=[1, 2, 3])
    own = {"effects": "own_power", "own_effects": tmp_path / "of mine.py"}
    found = wb.fit(test, **own, policy=FEW, check=False, output=tmp_path / "out")
    for step in found.next_step().splitlines():
        command = shlex.split(step.partition("  (")[0])[1:]
        assert main(command[:-2]) == 2
        assert "posterior.nc: found effects of the user's own, own_power, expected the file" in capsys.readouterr().err
        few = ["--draws", "4", "--tolerance", "1e-6"] if command[0] == "pose" else []  # left at once
        assert main([*command, *few, "--output", str(tmp_path / command[0])]) == 0, capsys.readouterr().err
