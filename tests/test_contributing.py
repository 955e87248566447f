"""The worked examples of CONTRIBUTING do what is said of them, as they stand there."""

import re
from pathlib import Path

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from wirebayes.io.bench import labview
from wirebayes.io.bench.about import About
from wirebayes.io.bench.convert import Choices, convert
from wirebayes.io.experiment_file import read_experiments
from wirebayes.io.paper import FOLDER
from wirebayes.io.run_folder import read_json
from wirebayes.wire.model import Model
from wirebayes.wire.staircase import simulate

TEXT = (Path(__file__).parent.parent / "CONTRIBUTING.md").read_text(encoding="utf-8")
PAPER = FOLDER / "experiments.toml"
WIRE = {"k1": 900.0, "B": 0.25, "U": 0.6, "k2": 0.05, "N": 0.7, "preload": 1.0}


def example(name):
    """What an example defines."""
    (block,) = re.findall(rf"```python\n# {name}\n(.*?)```", TEXT, re.DOTALL)
    defined: dict = {"__name__": name.replace(" ", "_")}
    exec(compile(block, f"CONTRIBUTING.md, {name}", "exec"), defined)
    return defined


@pytest.mark.parametrize(("name", "effect"), [("effect", "SoftGuide"), ("law", "LogarithmicCreep")])
def test_an_effect_is_nothing_at_its_neutral_value_and_lowers_the_tension_above(name, effect):
    own = example(name)[effect]()
    protocol = read_experiments(PAPER)[0].protocol()
    (amplitude,) = own.amplitudes

    def tensions(effects, value):
        theta = {key: np.array([number]) for key, number in WIRE.items()}
        if effects:
            theta[f"{own.name}.{amplitude.name}"] = np.array([value])
        return simulate(protocol, theta, Model(effects=effects))[protocol.mask]

    plain = tensions((), 0.0)
    np.testing.assert_allclose(tensions((own,), amplitude.neutral), plain, rtol=1e-12)
    assert np.abs(tensions((own,), 0.2) - plain).max() > 1e-3 * plain.max()


def test_a_command_writes_its_folder_once_and_prints(tmp_path):
    defined = example("command")
    app = typer.Typer()
    app.command()(defined["durations_command"])
    said = [CliRunner().invoke(app, [str(PAPER), "--output", str(tmp_path / "out")]) for _ in range(2)]
    assert [one.exit_code for one in said] == [0, 0]
    assert said[0].output == said[1].output
    written = read_json(tmp_path / "out" / "durations.json")
    assert f"{next(iter(written))}: {next(iter(written.values())):g} s" in said[0].output
    assert len(written) == 4


def test_a_bench_format_gives_the_readings_it_was_made_of(tmp_path, monkeypatch):
    defined = example("bench format")
    monkeypatch.setattr(labview, "is_measurement", defined["is_pairs"])
    monkeypatch.setattr(labview, "sheet_of_measurement", defined["sheet_of_pairs"])
    rows = [(hold, 2.0 * hold, time, 3.0 * hold - 0.01 * time) for hold in (1, 2, 3) for time in (0, 30, 60)]
    names = ("hold", "displacement_mm", "time_s", "tension_N")
    lines = [" ".join(f"{name}={value:g}" for name, value in zip(names, row, strict=True)) for row in rows]
    path = tmp_path / "bench.txt"
    path.write_text("#pairs\n" + "\n".join(lines) + "\n")
    (converted,) = convert(path, About("bench", "line", 1000.0), Choices())
    holds = converted.experiment.recorded_holds
    assert [hold.setting for hold in holds] == [2.0, 4.0, 6.0]
    assert np.concatenate([hold.readings for hold in holds]).tolist() == pytest.approx([row[3] for row in rows])
