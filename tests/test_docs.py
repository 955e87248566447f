"""What the documentation shows is true: mistakes and their answers, the effect of one's own, the example."""

import csv
import importlib.util
import re
import subprocess
import sys
import textwrap
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from wirebayes.cli import COMMANDS, main
from wirebayes.io.experiment import read_experiments
from wirebayes.wire.staircase import Model, simulate

DOCS = Path(__file__).parent.parent / "docs"


def load(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


malformed = load("malformed")
OUT = "out"


def test_the_example_is_valid():
    (experiment,) = read_experiments(DOCS / "example" / "my-wire.toml")
    assert [hold.number for hold in experiment.holds] == [1, 2, None, 3, 4]


@pytest.mark.parametrize(
    "command", [name for name in ("fit", "compare", "discover", "batch", "check") if name in COMMANDS]
)
@pytest.mark.parametrize("case", malformed.CASES, ids=[case.mistake for case in malformed.CASES])
def test_a_mistake_is_exit_code_2_one_line_and_nothing_left_behind(case, command, tmp_path, capsys):
    toml = malformed.write(case, tmp_path)
    before = sorted(tmp_path.rglob("*"))
    assert main([command, str(toml), "--output", str(tmp_path / OUT)]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err == f"{tmp_path}/{malformed.message(toml)}\n"
    assert re.search(r"found .*[,;] expected", shown.err)
    assert sorted(tmp_path.rglob("*")) == before


def test_mistakes_of_both_files_are_shown_with_their_place():
    assert {case.file for case in malformed.CASES} == {"my-wire.toml", "my-wire.csv"}
    assert len(malformed.CASES) >= 10


def test_the_effect_of_ones_own_is_neutral_at_its_neutral_value_to_the_last_bit():
    (experiment,) = read_experiments(DOCS / "example" / "my-wire.toml")
    theta = {name: np.array([value]) for name, value in THETA.items()}
    effect = load("own_effect").PowerStrain()
    plain = simulate(experiment.protocol(), theta)
    neutral = simulate(experiment.protocol(), theta | {"power_strain.p": np.zeros(1)}, Model(effects=(effect,)))
    bent = simulate(experiment.protocol(), theta | {"power_strain.p": np.full(1, 0.2)}, Model(effects=(effect,)))
    assert (neutral == plain).all()
    assert (bent != plain)[experiment.protocol().mask].all()


@pytest.mark.slow
def test_the_effect_of_ones_own_is_fitted_as_shown():
    done = subprocess.run([sys.executable, DOCS / "own_effect.py"], capture_output=True, text=True, check=True)
    assert re.fullmatch(r"p = 0\.2\d, standard deviation 0\.0\d, converged: True\n", done.stdout)


@pytest.mark.slow
def test_the_tutorial_can_be_followed(tmp_path):
    """Its commands as they stand, its protocol, its Python; all but the last section, which is ``make run``."""
    text = (DOCS / "tutorial.rst").read_text()
    for file in (DOCS.parent / "data" / "paper").iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    protocol = re.search(r"::\n\n((?:    (?:hold,|\d).*\n)+)", text)[1]
    (tmp_path / "protocol.csv").write_text(re.sub("^    ", "", protocol, flags=re.MULTILINE))
    commands = re.findall(r"^    wirebayes (.*)", text, re.MULTILINE)
    assert [command.split()[0] for command in commands] == ["fit", "predict", "reproduce"]
    for command in commands[:-1]:
        done = run("-m", "wirebayes", *command.split(), cwd=tmp_path)
        said = {
            "fit": "nylon-1.5m: The plain model does not describe the readings",
            "predict": "protocol.csv: hold 8 of the training predicted as replicates; hold 9 predicted as a",
        }
        assert done.stderr.startswith(said[command.split()[0]])
    rows = list(csv.DictReader((tmp_path / "predicted.csv").read_text().splitlines()))
    assert [row["hold"] for row in rows] == ["8"] * 5 + ["9"] * 5
    measured = re.search(r"measured there: (.*) N\.", text.replace("\n", " "))[1]
    for row, reading in zip(rows[5:], re.findall(r"\d\.\d\d", measured), strict=True):
        assert abs(float(row["mean_N"]) - float(reading)) < 0.2
    for block in re.findall(r"code-block:: python\n\n((?:   .*\n|\n)+)", text):
        done = run("-W", "ignore", "-c", textwrap.dedent(block), cwd=tmp_path)
        assert done.stdout in ("", "nylon-1.5m 1500.0 (11, 5)\n")


def run(*arguments: str, cwd: Path) -> subprocess.CompletedProcess:
    return subprocess.run([sys.executable, *arguments], cwd=cwd, capture_output=True, text=True, check=True)


def test_the_readmes_python_runs():
    readme = (DOCS.parent / "README.md").read_text()
    (code,) = re.findall(r"```python\n(.*?)```", readme, re.DOTALL)
    done = subprocess.run([sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("(11, 5)\n")
    assert done.stdout.endswith("1545.245\n")


def test_the_readmes_mistake_is_answered_as_shown(tmp_path):
    readme = (DOCS.parent / "README.md").read_text()
    toml, csv = (re.search(rf"```{kind}\n(.*?)```", readme, re.DOTALL)[1] for kind in ("toml", "csv"))
    (tmp_path / "my-wire.toml").write_text(toml)
    (tmp_path / "my-wire.csv").write_text(csv)
    read_experiments(tmp_path / "my-wire.toml")
    (tmp_path / "my-wire.csv").write_text(csv.replace("1,1,30", "1,1,0"))
    assert f"\n{malformed.message(tmp_path / 'my-wire.toml')}\n" in readme


THETA = {"k1": 1545.0, "B": 2.0, "U": 0.14, "k2": 0.015, "N": 0.5, "preload": 1.0}
