"""Runs the commands of the tutorials and of the README as they stand, and keeps what they said beside them.

    python docs/run_tutorial.py            (make outputs)

writes the outputs and pictures of the tutorials and the gallery, and those of the README; with ``hangprinter`` behind
it those of the Hangprinter's tutorial alone. Tests run the same commands and compare (`tests/test_docs.py`).
"""

import csv
import json
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from matplotlib.figure import Figure

from wirebayes.answers.lines import in_columns
from wirebayes.report.drawn import save_figure
from wirebayes.report.figures import CHAIN, HOLD, INK, QUIET
from wirebayes.report.pictures.corner import corner
from wirebayes.report.pictures.curve import READ, curve, draw_curve, draw_readings, name_holds
from wirebayes.report.pictures.discover import left_over
from wirebayes.results.read_back import Stored, load_posterior

DOCS = Path(__file__).parent
COLUMNS = 80  # as many as a page of the documentation shows in a line
README = DOCS.parent / "README.md"
CONTROLLERS = {
    "hooke_only": "ignores creep",
    "creep_aware": "compensates, by this fit",
    "creep_aware_other_fit": "compensates, by the other fit",
}
PICTURES = {
    "import": "wire/bench.svg",
    "discover": "out/discover/bench.svg",
    "robot": "out/pose/robot.svg",
    "drift": "out/pose/drift.svg",
    "pose-error": "out/pose/pose-error.svg",
    "error-budget": "out/pose/error-budget.svg",
    "workspace": "out/pose/workspace-drift.svg",
}
_CONSOLE = re.compile(r"```console\n(.*?)```", re.DOTALL)
_PYTHON = re.compile(r"```python\n(.*?)```\n```text\n(.*?)```", re.DOTALL)


def commands(page: str = "tutorial") -> list[list[str]]:
    """The commands of a tutorial in their order, without the main one's last, which is ``make run``.

    Parameters
    ----------
    page : str
    """
    text = (DOCS / f"{page}.rst").read_text(encoding="utf-8")
    found = [shlex.split(line) for line in re.findall(r"^    wirebayes (.*)", text, re.MULTILINE)]
    return found[:-1] if page == "tutorial" else found


def start(folder: Path) -> None:
    """Put the file that the commands read into an empty folder."""
    shutil.copy(DOCS / "example" / "bench.csv", folder)


def said_by(command: list[str], folder: Path) -> str:
    """What a command prints in a folder on a terminal of `COLUMNS`."""
    program = [sys.executable, "-m", "wirebayes", *command]
    both = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    done = subprocess.run(program, cwd=folder, **both, text=True)
    if done.returncode:
        raise RuntimeError(f"{shlex.join(command)}: {done.stdout}")
    lines = done.stdout.rstrip().splitlines()
    return "".join(f"{part}\n" for line in lines for part in in_columns(line, COLUMNS))


def follow(folder: Path) -> dict[str, str]:
    """Run the tutorial's commands and return what each said, by its name; and two tables.

    Parameters
    ----------
    folder : Path
        Empty; receives the example's files and all results.
    """
    start(folder)
    outputs = {f"{command[0]}.txt": said_by(command, folder) for command in commands()}
    outputs["next.csv"] = (folder / "out/discover/bench/next.csv").read_text(encoding="utf-8")
    outputs["predicted.csv"] = _rounded((folder / "predicted.csv").read_text())
    outputs["pose-error.inc"] = _errors(json.loads((folder / "out/pose/pose.json").read_text()))
    return outputs


def follow_hangprinter(folder: Path) -> dict[str, str]:
    """Run the commands of the Hangprinter's tutorial; what each said, the settings, and anchors beside the truth.

    Parameters
    ----------
    folder : Path
        Empty; receives the example's files and all results.
    """
    for name in ("config.g", "line.toml", "line.csv", "hangprinter-log.csv"):
        shutil.copy(DOCS / "example" / name, folder)
    said = {f"{command[0]}.txt": said_by(command, folder) for command in commands("hangprinter")}
    outputs = {name: text for name, text in said.items() if text.strip()}
    outputs["reprapfirmware.g"] = (folder / "out/config/reprapfirmware.g").read_text(encoding="utf-8")
    found = json.loads((folder / "out/anchors/calibration.json").read_text(encoding="utf-8"))
    outputs["anchors.inc"] = _anchors(found, json.loads((DOCS / "example" / "hangprinter-truth.json").read_text()))
    return outputs


def _anchors(found: dict, truth: dict) -> str:
    """Coordinates of all anchors as a table: the truth, and how far tape and calibration are from it."""
    told_mm = _stated_mm(DOCS / "example" / "config.g")
    exits, anchors = found["exit_points_m"], truth["exit_points_m"]
    rows, held = [], 0
    for leg, letter in enumerate("ABCD"):
        for axis, name in enumerate("xyz"):
            true, low, high = (1e3 * value[leg][axis] for value in (anchors, exits["q05"], exits["q95"]))
            held += low <= true <= high
            rows += [
                f"   * - {letter} {name}",
                f"     - {true:.1f}",
                f"     - {told_mm[leg][axis]:.1f}",
                f"     - {low:.1f} to {high:.1f}",
            ]
    head = [
        ".. list-table::",
        "   :header-rows: 1",
        "",
        "   * - anchor",
        "     - truth",
        "     - tape",
        "     - calibrated, 90 %",
    ]
    return "\n".join([*head, *rows, "", f"{held} of {len(rows) // 4} intervals hold the truth."]) + "\n"


def _stated_mm(config: Path) -> list[list[float]]:
    """The anchors that RepRapFirmware's settings state, mm."""
    text = config.read_text(encoding="utf-8")
    return [[float(v) for v in m.split(":")] for m in re.findall(r" [ABCD](-?[\d.]+:-?[\d.]+:-?[\d.]+)", text)]


def hangprinter() -> None:
    """Write the outputs of the Hangprinter's tutorial."""
    (DOCS / "hangprinter").mkdir(exist_ok=True)
    with TemporaryDirectory() as name:
        folder = Path(name)
        for file, text in follow_hangprinter(folder).items():
            (DOCS / "hangprinter" / file).write_text(text, encoding="utf-8")
        shutil.copy(folder / "out/map/workspace-drift.svg", DOCS / "hangprinter" / "workspace-drift.svg")


def _rounded(text: str) -> str:
    """A table with numbers of four digits."""
    rows = [
        [f"{float(c):.4g}" if re.fullmatch(r"[\d.e+-]+", c) else c for c in row] for row in csv.reader(text.split())
    ]
    return "\n".join(",".join(row) for row in rows) + "\n"


def _errors(pose: dict) -> str:
    """The pose errors of specimens that are alike, as a table."""
    times = (60.0, 600.0, 3600.0)
    lines = [".. list-table::", "   :header-rows: 1", "", "   * - controller"]
    lines += [f"     - after {t:g} s, mm" for t in times]
    for entry in pose["pose_error"]:
        if entry["specimen_spread"] == 0:
            at = [entry["times_s"].index(t) for t in times]
            band = [[entry["distance_mm"][q][i] for q in ("q50", "q05", "q95")] for i in at]
            lines += [f"   * - {CONTROLLERS[entry['controller']]}"]
            lines += [f"     - {middle:.2g} ({low:.2g} to {high:.2g})" for middle, low, high in band]
    return "\n".join(lines) + "\n"


def readme(text: str, folder: Path, known: dict[str, str]) -> str:
    """The README with what its commands say.

    Parameters
    ----------
    text : str
    folder : Path
        Where the tutorial has been followed.
    known : dict
        What its commands said there, as `follow` returns it.
    """
    tutorial = {shlex.join(command): known[f"{command[0]}.txt"] for command in commands()}
    text = _CONSOLE.sub(lambda block: f"```console\n{_console(block[1], folder, tutorial)}```", text)
    return _PYTHON.sub(lambda block: f"```python\n{block[1]}```\n```text\n{python(block[1], folder)}```", text)


def _console(block: str, folder: Path, tutorial: dict[str, str]) -> str:
    """Commands after ``$``, each with what it says; what the tutorial has run is not run again."""
    lines = []
    for prompt in re.findall(r"^\$ .*\n", block, re.MULTILINE):
        lines.append(prompt)
        program, *command = shlex.split(prompt[2:])
        if program == "wirebayes":
            known = tutorial.get(shlex.join(command))
            lines.append(known if known is not None else said_by(command, folder))
    return "".join(lines)


def python(code: str, folder: Path) -> str:
    """What a piece of Python prints in a folder."""
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=True)
    return done.stdout


def picture(plain: Stored, final: Stored) -> Figure:
    """The readings with the final curve through them; beside it, what both models leave over.

    Parameters
    ----------
    plain, final : Stored
    """
    figure = Figure(figsize=(9.6, 3.8), layout="constrained")
    left, right = figure.subfigures(1, 2, width_ratios=(1.1, 1.0))
    axes = left.subplots()
    found = curve(final)
    draw_readings(axes, final, found)
    draw_curve(axes, final, found, HOLD, "the curve through them, 90 % band")
    axes.set_title("A tension test and the curve through it", loc="left", fontsize=10, color=INK)
    axes.set_ylabel(f"{READ['displacement']}, N")
    axes.legend(frameon=False, fontsize=8.5)
    name_holds(axes, final)
    rows = right.subplots(2, 1, sharex=True, sharey=True)
    titles = ("measured − predicted, N: before discover", "after discover, to the same scale")
    for axis, stored, colour, title in zip(rows, (plain, final), (HOLD, CHAIN), titles, strict=True):
        _left_over(axis, stored, colour)
        axis.set_title(title, loc="left", fontsize=10, color=INK)
    name_holds(rows[1], final)
    rows[1].set_xlabel("hold")
    for axis in (axes, *rows):
        axis.spines[["top", "right"]].set_visible(False)
        axis.tick_params(labelsize=8.5)
    return figure


def _left_over(axis: Any, stored: Stored, colour: str) -> None:
    """What a model leaves over, hold after hold."""
    protocol = stored.sample.protocol
    hold, reading = protocol.mask.nonzero()
    place = hold + 0.1 + 0.8 * protocol.time_s[hold, reading] / protocol.duration_s[hold]
    axis.axhline(0.0, color=QUIET, lw=0.8)
    axis.plot(place, left_over(stored)[hold, reading], "o", color=colour, ms=3)


def first_screen(page: Path, target: Path) -> None:
    """A picture of the top of a page; nothing where no Chromium is installed."""
    names = ("chromium", "chromium-browser", "google-chrome")
    browser = next(filter(None, map(shutil.which, names)), None)
    if browser is None:
        print(f"{target}: left as it was, no browser is installed")
        return
    with TemporaryDirectory() as profile:
        quiet = ("--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--no-first-run")
        where = (f"--user-data-dir={profile}", f"--screenshot={target}", "--window-size=1000,760")
        subprocess.run([browser, *quiet, *where, page.resolve().as_uri()], capture_output=True, check=True)


def pairs(posterior: Path, target: Path) -> None:
    """Draw every pair of parameters, as the page of a fit does."""
    stored = load_posterior(posterior)
    figure = corner(stored.draws, stored.sample.model.effects)
    assert figure is not None
    save_figure(figure, target)


def main() -> None:
    hangprinter()
    (DOCS / "tutorial").mkdir(exist_ok=True)
    (DOCS / "gallery").mkdir(exist_ok=True)
    with TemporaryDirectory() as name:
        folder = Path(name)
        outputs = follow(folder)
        for file, text in outputs.items():
            (DOCS / "tutorial" / file).write_text(text, encoding="utf-8")
        for picture_name, file in PICTURES.items():
            shutil.copy(folder / file, DOCS / "gallery" / f"{picture_name}.svg")
        found = folder / "out/discover/bench"
        pairs(found / "final", DOCS / "gallery" / "corner.svg")
        drawn = picture(load_posterior(found / "plain"), load_posterior(found / "final"))
        drawn.savefig(DOCS / "images" / "readings.png", dpi=110, metadata={"Software": None})
        README.write_text(readme(README.read_text(encoding="utf-8"), folder, outputs), encoding="utf-8")
        first_screen(folder / "my-wire-fit" / "report.html", DOCS / "images" / "page.png")


if __name__ == "__main__":
    (hangprinter if sys.argv[1:] == ["hangprinter"] else main)()
