"""Runs the tutorial's commands as they stand and keeps what they said, and the gallery's pictures, beside it.

    python docs/run_tutorial.py

A test runs the same commands and compares (`tests/test_docs.py`).
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

from wirebayes.report.blocks import save
from wirebayes.report.figures import corner
from wirebayes.results.store import load

DOCS = Path(__file__).parent
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


def commands() -> list[list[str]]:
    """The commands of the tutorial in their order, without the last one, which is ``make run``."""
    text = (DOCS / "tutorial.rst").read_text(encoding="utf-8")
    return [shlex.split(line) for line in re.findall(r"^    wirebayes (.*)", text, re.MULTILINE)][:-1]


def follow(folder: Path) -> dict[str, str]:
    """Run them in a folder and return what each said, by its name; and two tables.

    Parameters
    ----------
    folder : Path
        Empty; receives the example's files and all results.
    """
    for name in ("bench.csv", "next.csv"):
        shutil.copy(DOCS / "example" / name, folder)
    outputs = {}
    for command in commands():
        done = subprocess.run(
            [sys.executable, "-m", "wirebayes", *command], cwd=folder, capture_output=True, text=True, check=True
        )
        outputs[f"{command[0]}.txt"] = "\n".join(filter(None, (done.stdout.rstrip(), done.stderr.rstrip()))) + "\n"
    outputs["predicted.csv"] = _rounded((folder / "predicted.csv").read_text())
    outputs["pose-error.inc"] = _errors(json.loads((folder / "out/pose/pose.json").read_text()))
    return outputs


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


def main() -> None:
    (DOCS / "tutorial").mkdir(exist_ok=True)
    (DOCS / "gallery").mkdir(exist_ok=True)
    with TemporaryDirectory() as folder:
        for name, text in follow(Path(folder)).items():
            (DOCS / "tutorial" / name).write_text(text, encoding="utf-8")
        for name, file in PICTURES.items():
            shutil.copy(Path(folder) / file, DOCS / "gallery" / f"{name}.svg")
        pairs(Path(folder) / "out/discover/bench/final", DOCS / "gallery" / "corner.svg")


def pairs(posterior: Path, target: Path) -> None:
    """Draw every pair of parameters, as the page of a fit does."""
    stored = load(posterior)
    figure = corner(stored.draws, stored.sample.model.effects)
    assert figure is not None
    save(figure, target)


if __name__ == "__main__":
    main()
