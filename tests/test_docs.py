"""What the documentation shows is true: mistakes and their answers, the effect of one's own, the example."""

import ast
import importlib
import importlib.util
import json
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
from wirebayes.robot.mechanics import schema
from wirebayes.wire import compiled
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


def test_the_effect_of_ones_own_is_neutral_at_its_neutral_value_to_the_last_bit(monkeypatch):
    monkeypatch.setattr(compiled, "kernel", None)  # numpy computes such effects, and compiled code rounds otherwise
    (experiment,) = read_experiments(DOCS / "example" / "my-wire.toml")
    theta = {name: np.array([value]) for name, value in THETA.items()}
    effect = load("own_effect").OwnPower()
    plain = simulate(experiment.protocol(), theta)
    neutral = simulate(experiment.protocol(), theta | {"own_power.p": np.zeros(1)}, Model(effects=(effect,)))
    bent = simulate(experiment.protocol(), theta | {"own_power.p": np.full(1, 0.2)}, Model(effects=(effect,)))
    assert (neutral == plain).all()
    assert (bent != plain)[experiment.protocol().mask].all()


@pytest.mark.slow
def test_the_effect_of_ones_own_is_fitted_as_shown():
    done = subprocess.run([sys.executable, DOCS / "own_effect.py"], capture_output=True, text=True, check=True)
    assert re.fullmatch(r"p = 0\.2\d, standard deviation 0\.0\d, converged: True\n", done.stdout)


@pytest.mark.slow
def test_the_tutorial_says_what_its_commands_say(tmp_path):
    """Its commands as they stand: the same words, and the same numbers to a twentieth on any machine."""
    tutorial = load("run_tutorial")
    names = [command[0] for command in tutorial.commands()]
    assert names == ["import", "check", "fit", "discover", "report", "predict", "pose"]
    for name, text in tutorial.follow(tmp_path).items():
        shown = (DOCS / "tutorial" / name).read_text(encoding="utf-8")
        assert _NUMBER.sub("#", text) == _NUMBER.sub("#", shown), name
        found, expected = ([float(n) for n in _NUMBER.findall(t)] for t in (text, shown))
        assert found == pytest.approx(expected, rel=0.05, abs=2e-3), name
    for block in re.findall(r"code-block:: python\n\n((?:   .*\n|\n)+)", (DOCS / "tutorial.rst").read_text()):
        run("-W", "ignore", "-c", textwrap.dedent(block), cwd=tmp_path)


_NUMBER = re.compile(r"(?<![\w-])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")


def test_every_output_of_the_tutorial_is_one_that_its_run_wrote():
    tutorial = load("run_tutorial")
    text = (DOCS / "tutorial.rst").read_text()
    shown = set(re.findall(r"(?:literalinclude|include):: tutorial/(\S+)", text))
    assert shown == {path.name for path in (DOCS / "tutorial").iterdir()}
    pictures = set(re.findall(r"image:: gallery/(\S+)\.svg", text))
    assert pictures <= set(tutorial.PICTURES)
    gallery = set(re.findall(r"figure:: gallery/(\S+)\.svg", (DOCS / "gallery.rst").read_text()))
    assert gallery == {path.stem for path in (DOCS / "gallery").iterdir()} == set(tutorial.PICTURES) | {"corner"}


@pytest.mark.parametrize("name", ["wire", "robot"])
def test_a_notebook_runs_from_top_to_bottom(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    cells = json.loads((DOCS / "notebooks" / f"{name}.ipynb").read_text(encoding="utf-8"))["cells"]
    names: dict[str, object] = {}
    last: object = None
    for cell in cells:
        if cell["cell_type"] == "code":
            assert cell["outputs"] == []  # nothing that a run did not just show
            *before, end = ast.parse("".join(cell["source"])).body
            exec(compile(ast.Module(before, []), name, "exec"), names)
            if isinstance(end, ast.Expr):
                last = eval(compile(ast.Expression(end.value), name, "eval"), names)
            else:
                exec(compile(ast.Module([end], []), name, "exec"), names)
    assert last == {"wire": "5 of 5 readings lie in the 90 % band", "robot": True}[name]


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


ROBOTS = (DOCS / "robot.rst").read_text(encoding="utf-8")


@pytest.mark.parametrize("command", ["pose", "calibrate", "export"])
def test_the_page_on_robots_has_every_option(command):
    import typer

    app = typer.Typer(add_completion=False)
    app.command()(getattr(importlib.import_module("wirebayes.cli.robot"), command))
    after = ROBOTS.split(f"\n``{command}``\n{'^' * (len(command) + 4)}\n")[1]
    listed = re.findall(r"\* - ``(--[a-z-]+)", after.split("^^^^")[0])
    options = [name for one in typer.main.get_command(app).params for name in one.opts if name.startswith("--")]
    assert sorted({*listed, "--json", "--quiet"}) == sorted({*options, "--json", "--quiet"})


def test_the_page_on_robots_has_every_key_of_a_robots_file(monkeypatch):
    """The keys that the reader asks for, of robots with everything that a robot can have."""
    asked, take = set(), schema._Table.take

    def noted(self, key, *rest):
        asked.add(re.sub(r"\[\d+\]", "", f"{self.path}.{key}"))
        return take(self, key, *rest)

    monkeypatch.setattr(schema._Table, "take", noted)
    text = (Path(schema.__file__).parents[2] / "data" / "robots" / "hangprinter-4.toml").read_text()
    drum = "drum_radius_m = 0.03\ndrum_layer_turns = 20\ndrum_layer_height_m = 1e-3\nwire_length_m = 9.0\n"
    leg = "[[leg]]\nwire = 'own'\npulley_radius_m = 0.01\nswivel_axis = [0, 0, 1]\n" + drum
    wire = "[wires.own]\nk1_N = 800\nB_mm = 0.3\nU = 0.8\nk2 = 0.03\nN = 0.64\nlength_mm = 1000\n"
    schema.parse(text.replace("[[leg]]\n", leg) + wire, "whole")
    schema.read("linear-7")
    known = set(re.findall(r"[A-Za-z]\w+|[UN]\b", " ".join(re.findall(r"\* - (.+)", ROBOTS))))
    missing = {key for key in asked if key.rpartition(".")[2] not in known and key != "wires.own"}
    assert len(asked) > 40
    assert not missing
