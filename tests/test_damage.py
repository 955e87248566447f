"""Damaged, truncated and foreign files: every command that reads them works or ends in one plain line, exit code 2."""

import collections
import json
import random
import shutil
import subprocess
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.hostile.mutations import json_changed, netcdf_changed, scrambled, text_changed
from wirebayes.cli import main
from wirebayes.inference.fit import fit_problem
from wirebayes.inference.policy import Policy
from wirebayes.results import store
from wirebayes.simulation.synthetic import Bench, Truth, draw

ROOT = Path(__file__).parents[1]
STORED = ROOT / "tests" / "data" / "results"
SESSION = ROOT / "docs" / "example" / "linear-7-session.csv"
ROBOTS = ROOT / "data" / "robots"
HASTY = Policy(walkers=64, rounds=2, round_draws=1024, most_rounds=2, block=2, most_steps=2)


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folders as commands leave them: fit, discover, pose, calibrate."""
    folder = tmp_path_factory.mktemp("results")
    shutil.copytree(STORED, folder, dirs_exist_ok=True)
    wire = folder / "fit" / "simulated"
    wire.mkdir(parents=True)
    bench = Bench("simulated", "line", 1000.0, displacements_mm=(1.0, 2.0, 3.0, 4.0))
    problem = draw([bench], Truth(), seed=3).problem
    store.save_posterior(fit_problem(problem, 1, policy=HASTY), wire, {})
    configuration = {"command": "fit", "version": "0.1.0", "seed": 0, "own_effects": None}
    (folder / "fit" / "configuration.json").write_text(json.dumps(configuration))
    (folder / "protocol.csv").write_text("hold,displacement_mm,time_s\n9,5,0\n9,5,60\n")
    return folder


# what is damaged, and the commands that read it
READERS = {
    "fit/simulated/posterior.nc": [
        ["predict", "{r}/fit", "{r}/protocol.csv", "--output", "{o}/p.csv"],
        ["export", "hangprinter-4", "--wires", "{r}/fit/simulated", "--draws", "5", "--output", "{o}/export"],
    ],
    "fit/simulated/summary.json": [["report", "{r}/fit"]],
    "fit/configuration.json": [["report", "{r}/fit"]],
    "discover/discovery.json": [["report", "{r}/discover"]],
    "discover/configuration.json": [["report", "{r}/discover"]],
    "pose/pose.json": [["report", "{r}/pose"]],
    "calibrate/calibration.json": [["report", "{r}/calibrate"]],
}


def output_of(arguments: list[str], out: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """The plain line of a command that refused, or nothing; anything else fails."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        code = main(arguments)
    printed = capsys.readouterr()
    if code == 0:
        return ""
    assert code == 2, (arguments, code, printed)
    assert len(printed.err.splitlines()) == 1, printed.err
    (line,) = printed.err.splitlines()
    assert "Traceback" not in printed.err and len(line) <= 2100
    assert not [path for path in out.rglob("*") if path.is_file()], "half written"
    return line


def damage_stored(seed: int, results: Path, folder: Path, capsys: pytest.CaptureFixture[str]) -> str:
    rng = random.Random(seed)
    name = list(READERS)[seed % len(READERS)]
    if "fit/" in name and name.endswith(".json") and rng.random() < 0.8:
        name = "fit/simulated/posterior.nc"  # drawing the pages of a fit takes seconds
    original = (results / name).read_bytes()
    if rng.random() < 0.3:
        content = scrambled(rng, original)
    elif name.endswith(".nc"):
        content = netcdf_changed(rng, original, folder / "changed.nc")
    else:
        content = json_changed(rng, original)
    out = folder / "out"
    out.mkdir()
    (results / name).write_bytes(content)
    try:
        command = rng.choice(READERS[name])
        return output_of([word.format(r=results, o=out) for word in command], out, capsys)
    finally:
        (results / name).write_bytes(original)
        (results / name.split("/")[0] / "report.html").unlink(missing_ok=True)


def damage_robot(seed: int, results: Path, folder: Path, capsys: pytest.CaptureFixture[str]) -> str:
    rng = random.Random(seed)
    robot, session, out = "linear-7", SESSION, folder / "out"
    if rng.random() < 0.5:
        text = SESSION.read_bytes()
        session = folder / "session.csv"
        session.write_bytes(text_changed(rng, b"".join(text.splitlines(True)[:4])))
    else:
        text = (ROBOTS / f"{robot}.toml").read_bytes()
        robot = str(folder / "robot.toml")
        Path(robot).write_bytes(text_changed(rng, text))
    wires = ["--wires", str(results / "fit" / "simulated"), "--draws", "5", "--output", str(out)]
    command = ["calibrate", robot, str(session)] if session != SESSION or rng.random() < 0.3 else ["export", robot]
    return output_of([*command, *wires], out, capsys)


def count(lines: list[str]) -> str:
    """Kinds of error: what was found and where differ, the words do not."""
    kinds = collections.Counter(line.split("expected")[-1][:60] if line else "worked" for line in lines)
    return f"{len(lines)} cases, {len(kinds)} kinds: {kinds.most_common(12)}"


def every(attack: Callable[..., str], seeds: range, results: Path, tmp_path: Path, capsys: Any) -> None:
    lines = []
    for seed in seeds:
        folder = tmp_path / str(seed)
        folder.mkdir()
        try:
            lines.append(attack(seed, results, folder, capsys))
        except BaseException as error:
            error.add_note(f"{attack.__name__}, seed {seed}, in {folder}")
            raise
        shutil.rmtree(folder)
    with capsys.disabled():
        print(f"\n{attack.__name__}: {count(lines)}")
    assert "" in lines and len(set(lines)) > 3


@pytest.mark.parametrize("name", ["discover", "pose", "calibrate"])
def test_results_that_are_damaged_are_read_when_they_are_not(name: str, results: Path, capsys: Any) -> None:
    """Else every damage would be refused for another reason: a command has changed what it writes."""
    assert main(["report", str(results / name)]) == 0, capsys.readouterr().err
    (results / name / "report.html").unlink()


def test_damaged_results(results: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    every(damage_stored, range(90), results, tmp_path, capsys)


def test_a_damaged_file_leaves_one_line_and_no_traceback(results: Path, tmp_path: Path) -> None:
    """As a process of its own: destructors speak up late."""
    (tmp_path / "posterior.nc").write_bytes((results / "fit" / "simulated" / "posterior.nc").read_bytes()[:9000])
    command = [sys.executable, "-m", "wirebayes", "predict", str(tmp_path), str(results / "protocol.csv")]
    done = subprocess.run([*command, "--output", str(tmp_path / "p.csv")], capture_output=True, text=True, check=False)
    assert done.returncode == 2 and done.stdout == ""
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"{tmp_path / 'posterior.nc'}: cannot be used")


@pytest.mark.parametrize(
    ("text", "expected"),
    [("raise SystemExit(3)", 2), ("# -*- coding: latin-1 -*-\n# \xe9\n", 2), ("import sys; sys.exit()", 2)],
)
def test_a_users_own_effects_cannot_end_the_command(text: str, expected: int, tmp_path: Path, capsys: Any) -> None:
    own = tmp_path / "own.py"
    own.write_bytes(text.encode("latin-1"))
    arguments = ["compare", str(ROOT / "data" / "paper" / "experiments.toml"), "--own-effects", str(own)]
    assert main([*arguments, "--output", str(tmp_path / "out")]) == expected
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_damaged_robots_and_sessions(results: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    every(damage_robot, range(16), results, tmp_path, capsys)


def test_readings_that_nothing_explains_end_unconverged(
    results: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A tension beyond all strength: matrices are singular or overflow."""
    monkeypatch.setattr("wirebayes.robot.self_calibration.estimate._ROUNDS", 8)  # sixty that lead nowhere take long
    header, first, second = SESSION.read_text().splitlines()[:3]
    columns = zip(header.split(","), second.split(","), strict=True)
    cells = ["9e8" if key == "tension_1_N" else cell for key, cell in columns]
    file, out = tmp_path / "session.csv", tmp_path / "out"
    file.write_text("\n".join([header, first, ",".join(cells)]) + "\n")
    wires = ["--wires", str(results / "fit" / "simulated"), "--draws", "5", "--output", str(out)]
    assert main(["calibrate", "linear-7", str(file), *wires]) == 0
    line, doubt = capsys.readouterr().err.splitlines()
    assert doubt.startswith("warning: the fit of simulated")
    assert line.startswith("warning: not converged")
    assert json.loads((out / "calibration.json").read_text())["joint_values_for_home_m"] is None
    assert main(["report", str(out)]) == 0


@pytest.mark.slow
def test_damaged_results_in_full(results: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    every(damage_stored, range(1000, 2400), results, tmp_path, capsys)


@pytest.mark.slow
def test_damaged_robots_and_sessions_in_full(results: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    every(damage_robot, range(1000, 1700), results, tmp_path, capsys)
