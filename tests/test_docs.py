"""What the documentation shows is true: mistakes and their answers, the effect of one's own, the example."""

import ast
import importlib.util
import json
import re
import shlex
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path
from types import ModuleType
from typing import get_type_hints

import numpy as np
import pytest

from analyses.project import readmes
from wirebayes.cli import COMMANDS, command_function, main
from wirebayes.effects import CATALOGUE
from wirebayes.io.experiment_file import read_experiments
from wirebayes.json_files.discovery import ExperimentFindings
from wirebayes.robot.mechanics import schema
from wirebayes.strict.toml_keys import Keys
from wirebayes.wire import compiled
from wirebayes.wire.model import Model
from wirebayes.wire.staircase import simulate

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
    said = tutorial.follow(tmp_path)
    for name, text in said.items():
        assert alike(text, (DOCS / "tutorial" / name).read_text(encoding="utf-8")), name
    assert alike(tutorial.readme(README, tmp_path, said), README)
    run_python_blocks("tutorial", tmp_path)
    shutil.copy(DOCS / "own_effect.py", tmp_path)
    for page in RECIPES:  # they begin where the tutorial has ended
        for command in tutorial.commands(page):
            if command[0] != "compare":  # minutes
                run("-m", "wirebayes", *command, cwd=tmp_path)
        run_python_blocks(page, tmp_path)


RECIPES = ("read-posterior", "predict", "compare", "arviz", "own-effect", "share")


def run_python_blocks(page: str, folder: Path) -> None:
    """Run the Python of a page in a folder, one block after the other."""
    text = (DOCS / f"{page}.rst").read_text(encoding="utf-8")
    blocks = re.findall(r"code-block:: python\n\n((?:   .*\n|\n)+)", text)
    run("-W", "ignore", "-c", "\n".join(map(textwrap.dedent, blocks)), cwd=folder)


@pytest.mark.parametrize("page", [*RECIPES, "prior"])
def test_a_recipe_says_its_task_in_a_line_and_is_short(page):
    """One task a page: a title that says it, a block within the first screen, and no page to scroll far."""
    title, underline, *lines = (DOCS / f"{page}.rst").read_text(encoding="utf-8").splitlines()
    assert len(title) <= 40 and underline == "=" * len(title)
    first = next(i for i, line in enumerate(lines) if line.startswith(("    ", "1.")) or "::" in line)
    assert first <= 6
    assert len(lines) <= 70


@pytest.mark.slow
def test_the_hangprinters_tutorial_says_what_its_commands_say(tmp_path):
    said = load("run_tutorial").follow_hangprinter(tmp_path)
    for name, text in said.items():
        assert alike(text, (DOCS / "hangprinter" / name).read_text(encoding="utf-8")), name


def test_every_output_of_the_hangprinters_tutorial_is_one_that_its_run_wrote():
    """Each is shown, and the intervals hold the truth as often as the table says."""
    text = (DOCS / "hangprinter.rst").read_text()
    shown = set(re.findall(r"(?:literalinclude|include|image):: hangprinter/(\S+)", text))
    assert shown == {path.name for path in (DOCS / "hangprinter").iterdir()}
    table = (DOCS / "hangprinter/anchors.inc").read_text()
    rows = re.findall(r"\* - [A-D] [xyz]\n\s+- (\S+)\n.*\n\s+- (\S+) to (\S+)", table)
    held = sum(float(low) <= float(true) <= float(high) for true, low, high in rows)
    assert len(rows) == 12 and held >= 9
    assert f"{held} of 12 intervals hold the truth" in table


_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")


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


README = (DOCS.parent / "README.md").read_text(encoding="utf-8")


def alike(found: str, shown: str) -> bool:
    """The same words, and the same numbers to a twentieth, as on any machine."""
    numbers = ([float(n) for n in _NUMBER.findall(text)] for text in (found, shown))
    return _NUMBER.sub("#", found) == _NUMBER.sub("#", shown) and next(numbers) == pytest.approx(
        next(numbers), rel=0.05, abs=2e-3
    )


def test_the_readmes_first_commands_say_what_it_shows(tmp_path):
    tutorial = load("run_tutorial")
    first = README[: README.index("```", README.index("```console") + 3) + 3]
    assert alike(tutorial.readme(first, tmp_path, tutorial_outputs()), first)


def test_the_readme_shows_what_the_tutorials_run_said():
    """Its other commands are the tutorial's, which a slow test runs again."""
    tutorial = load("run_tutorial")
    blocks = re.findall(r"```console\n(.*?)```", README, re.DOTALL)
    assert len(blocks) == 2
    known = {tuple(command): command[0] for command in tutorial.commands()}
    commands = re.findall(r"^\$ wirebayes (.*)\n", blocks[1], re.MULTILINE)
    said = re.split(r"^\$ .*\n", blocks[1], flags=re.MULTILINE)[1:]
    for command, text in zip(commands, said, strict=True):
        assert text == (DOCS / "tutorial" / f"{known[tuple(shlex.split(command))]}.txt").read_text(encoding="utf-8")


def tutorial_outputs() -> dict[str, str]:
    return {path.name: path.read_text(encoding="utf-8") for path in (DOCS / "tutorial").glob("*.txt")}


def test_the_theory_says_of_every_effect_what_it_is_under_weights():
    theory = (DOCS / "theory.rst").read_text(encoding="utf-8")
    table = theory.partition("- under weights\n")[2].partition("\n\n")[0]
    missing = {name for name in CATALOGUE if f"``{name}``" not in table}
    assert missing == set(), "an effect needs a row in the table of docs/theory.rst"


def test_measured_figures_stand_in_the_texts_as_the_studies_gave_them():
    for path, text in load("measure").texts().items():
        assert path.read_text(encoding="utf-8") == text, path


def test_the_readme_states_no_figure_by_hand():
    """Outside what runs wrote: no number with a unit, no share."""
    by_hand = re.sub(r"```.*?```|<!-- measured -->.*?<!-- end -->", "", README, flags=re.DOTALL)
    assert not re.findall(r"\d[\d.,]* ?(?:%|mm|N|s|min|times|of \d+)\b", by_hand)
    assert len(README.splitlines()) <= 110
    assert README.index("my-wire: converged") < README.index("## ")


def figures_typed_by_hand(page: Path) -> list[str]:
    """Numbers with a unit, shares and counts in a page's own text: not in what it includes, literal or in tables."""
    text = re.sub(r"::\n\n(?:(?: {2,}.*)?\n)+", "\n", page.read_text(encoding="utf-8"))
    text = re.sub(r"``[^`]*``|:width: .*|^ +\* .*|^ +- .*", "", text, flags=re.MULTILINE)
    return FIGURE.findall(text)


FIGURE = re.compile(r"\d[\d.,]*(?: ?%| (?:mm|N|s|ms|min|h|MB|times|of \d[\d,]*|files|tests|wires|robots|holds)\b)")


def test_the_readme_is_as_long_and_its_first_result_as_near_as_the_table_of_readmes_says():
    assert readmes.table() == (DOCS / "readmes.inc").read_text(encoding="utf-8")
    lines = readmes.README.read_text(encoding="utf-8").splitlines()
    mine = readmes.ours()
    assert mine.lines == len(lines) and mine.result is not None and "converged" in lines[mine.result - 1]


def test_no_page_has_more_figures_typed_by_hand_than_it_had():
    """A figure that a run found is included from what the run wrote; the list of what was typed may only shrink."""
    lines = (Path(__file__).parent / "typed_figures.txt").read_text(encoding="utf-8").splitlines()
    listed = {name: int(count) for name, count in (line.split() for line in lines if not line.startswith("#"))}
    typed = {path.name: figures_typed_by_hand(path) for path in sorted(DOCS.glob("*.rst"))}
    assert {name: found for name, found in typed.items() if len(found) > listed.get(name, 0)} == {}


def test_a_figure_typed_by_hand_would_be_found(tmp_path):
    page = tmp_path / "page.rst"
    page.write_text("In 175 files of one test, ``12 s`` apart, 8.5 s each::\n\n    run 30 files\n\n* - 5 %\n  - 6 mm\n")
    assert figures_typed_by_hand(page) == ["175 files", "8.5 s", "5 %"]


@pytest.mark.parametrize(
    "page", ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", "data/README.md", "data/robots/README.md"]
)
def test_links_of_a_page_lead_to_files(page):
    path = DOCS.parent / page
    links = re.findall(r"\]\(([^)#]+)[^)]*\)", path.read_text(encoding="utf-8"))
    inside = [link for link in links if "://" not in link]
    assert [link for link in inside if not (path.parent / link).exists()] == []


def test_links_of_the_documentation_lead_to_pages_and_files():
    for path in DOCS.glob("*.rst"):
        text = path.read_text(encoding="utf-8")
        pages = re.findall(r":doc:`(?:[^`<]*<)?([\w/-]+)>?`", text)
        assert [page for page in pages if not (DOCS / f"{page}.rst").is_file()] == [], path.name
        files = re.findall(r"(?:image|figure|literalinclude|include):: (\S+)|:download:`[^`<]*<([^`>]+)>`", text)
        files = [name for pair in files for name in pair if name and not name.startswith("generated/")]
        assert [name for name in files if not (DOCS / name).is_file()] == [], path.name


def test_the_page_on_discover_has_every_key_of_what_it_writes():
    page = (DOCS / "discover.rst").read_text(encoding="utf-8")
    table = page[page.index("What it writes") : page.index("How it decides, in detail")]
    named = set(re.findall(r"``(\w+)``", table))
    assert set(get_type_hints(ExperimentFindings)) - named == set()


def test_every_page_stands_in_one_of_the_five_parts():
    index, robots = ((DOCS / page).read_text(encoding="utf-8") for page in ("index.rst", "robot.rst"))
    parts = re.findall(r":caption: (.+)\n   :maxdepth: 1\n   :hidden:\n\n((?:   \S+\n)+)", index)
    assert [name for name, _ in parts] == ["Tutorials", "How-to", "Explanation", "Reference", "Studies"]
    under_robots = re.findall(r":hidden:\n\n((?:   \S+\n)+)", robots)
    listed = [page for pages in [*(pages for _, pages in parts), *under_robots] for page in pages.split()]
    assert sorted(listed) == sorted(path.stem for path in DOCS.glob("*.rst") if path.stem != "index")


THETA = {"k1": 1545.0, "B": 2.0, "U": 0.14, "k2": 0.015, "N": 0.5, "preload": 1.0}


OPTIONS, KEYS = ((DOCS / f"robot-{page}.rst").read_text(encoding="utf-8") for page in ("options", "file"))


@pytest.mark.parametrize("command", ["pose", "calibrate", "export"])
def test_the_page_on_robots_has_every_option(command):
    import typer

    app = typer.Typer(add_completion=False)
    app.command()(command_function(command))
    after = OPTIONS.split(f"\n``{command}``\n{'^' * (len(command) + 4)}\n")[1]
    listed = re.findall(r"\* - ``(--[a-z-]+)", after.split("^^^^")[0])
    options = [name for one in typer.main.get_command(app).params for name in one.opts if name.startswith("--")]
    assert sorted({*listed, "--json", "--quiet"}) == sorted({*options, "--json", "--quiet"})


def test_the_page_on_robots_has_every_key_of_a_robots_file(monkeypatch):
    """The keys that the reader asks for, of robots with everything that a robot can have."""
    asked, value = set(), Keys.value

    def noted(self, key, *rest):
        asked.add(re.sub(r"\[\d+\]", "", f"{self.prefix}{key}"))
        return value(self, key, *rest)

    monkeypatch.setattr(Keys, "value", noted)
    text = (Path(schema.__file__).parents[2] / "data" / "robots" / "hangprinter-4.toml").read_text()
    drum = "drum_radius_m = 0.03\ndrum_layer_turns = 20\ndrum_layer_height_m = 1e-3\nwire_length_m = 9.0\n"
    leg = "[[leg]]\nwire = 'own'\npulley_radius_m = 0.01\nswivel_axis = [0, 0, 1]\n" + drum
    wire = "[wires.own]\nk1_N = 800\nB_mm = 0.3\nU = 0.8\nk2 = 0.03\nN = 0.64\nlength_mm = 1000\n"
    schema.parse(text.replace("[[leg]]\n", leg) + wire, "whole")
    schema.read_robot_file("linear-7")
    known = set(re.findall(r"[A-Za-z]\w+|[UN]\b", " ".join(re.findall(r"\* - (.+)", KEYS))))
    missing = {key for key in asked if key.rpartition(".")[2] not in known and key != "wires.own"}
    assert len(asked) > 40
    assert not missing


def test_a_sampler_has_a_ratio_only_where_it_converged_and_is_said_to_be_off_where_its_means_are():
    texts_of_samplers = load("measure").samplers
    run = {"ess_of_means": 1e4, "ess": 1e4, "all_costs_per_cpu_s": 5e4, "sampling_per_cpu_s": 9e4, "converged": True}
    peer = run | {"all_costs_per_cpu_s": 100.0, "sampling_per_cpu_s": 3e3, "divergences": 0, "r_hat": 1.002}
    peer |= {"ratio_all_costs_cpu": 500.0, "ratio_sampling_cpu": 30.0, "agreement": {"mean_in_sd": 0.01, "log_sd": 0.0}}
    peers = {
        "right": peer,
        "off": peer | {"ratio_all_costs_cpu": 2.0, "agreement": {"mean_in_sd": 0.4, "log_sd": 0.0}},
        "diverged": peer | {"converged": False, "divergences": 7},
        "stuck": peer | {"converged": False, "r_hat": 1.2, "ess": 80.0},
        "absent": {"converged": False, "why": "TimeoutError"},
    }
    case = {"case": "nylon", "log_density_difference": 1e-10, "ours": [run] * len(peers), "peers": peers}
    short = texts_of_samplers.samplers_in_short({"minutes": 1.0, "wanted_ess": 20_000, "cases": [case]})
    kept = {"command": "c", "commit": "a", "date": "d", "result": short}
    text = texts_of_samplers.against_other_samplers(kept)
    cells = dict(re.findall(r"\* - (.*)\n     - (.*)\n", text))
    assert cells == {
        "sampler": "nylon",
        "wirebayes (median)": "50,000",
        "right": "100 (500; 30)",
        "off": "100 (2; 30), off by 0.40 sd, a spread by a factor of 1.0",
        "diverged": "! 7 divergences",
        "stuck": "! R-hat 1.200, 80 draws",
        "absent": "! not run",
    }
    assert "1 of 5" in text and "500 to 500 times" in text
    agree = texts_of_samplers.other_samplers_agree(kept)
    assert "Of 2 runs" in agree and "0.7 standard errors" in agree
    assert agree.endswith("\noff, is off by 0.40 standard deviations on nylon.\n")
