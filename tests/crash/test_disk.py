"""A full disk and places that nothing can be written to: one plain line, and what was finished before stays."""

import os
import resource
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.crash.small import PAIR
from tests.test_damage import HASTY
from wirebayes.cli import main
from wirebayes.errors import InputError
from wirebayes.inference.fit import Fit, fit_problem
from wirebayes.io.run_folder import open_run
from wirebayes.model.build import build
from wirebayes.results import store

ROOT = Path(__file__).parents[2]
PAPER = str(ROOT / "data" / "paper" / "experiments.toml")
FULL = "cannot be written .File too large"


@contextmanager
def room(size: int) -> Iterator[None]:
    """No file may grow beyond so many bytes, as on a disk that has no more."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.fixture(scope="module")
def fitted() -> Fit:
    return fit_problem(build([PAIR[1]]), 1, policy=HASTY)


@pytest.mark.parametrize("share", [0.0, 0.001, 0.05, 0.3, 0.6, 0.9, 0.99])
def test_a_posterior_that_does_not_fit(fitted: Fit, share: float, tmp_path: Path) -> None:
    """HDF5, left to write by itself, ends in a segmentation fault at some of these."""
    store.save_posterior(fitted, tmp_path, {})
    whole = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    size = int(share * len(whole["posterior.nc"]))
    (tmp_path / "out").mkdir()
    with (
        pytest.raises(InputError, match=FULL),
        open_run(tmp_path / "out", {}),
        room(size),
    ):
        store.save_posterior(fitted, tmp_path / "out", {})
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"configuration.json"}
    with room(size), pytest.raises(InputError, match=FULL):
        store.save_posterior(fitted, tmp_path, {})
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()} == whole


@pytest.mark.parametrize(
    "place", ["file", "file/deeper", "/proc/wirebayes", "/dev/null", "/dev/null/x", "x" * 300, "loop"]
)
@pytest.mark.parametrize("command", ["fit", "check", "import"])
def test_a_place_that_takes_no_results(
    command: str, place: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("file").write_text("mine")
    Path("loop").symlink_to("loop")
    rows = (f"{h},{t},{h}.5\n" for h in (1, 2, 3) for t in (0, 30, 60))
    Path("raw.csv").write_text("displacement [mm],time [s],force [N]\n" + "".join(rows))
    what = [command, PAPER, "--experiment", "kite-1.5m"]
    if command == "import":
        what = ["import", "raw.csv", "--length-mm", "1000"]
    before = sorted(os.listdir())
    assert main([*what, "--output", place]) == 2
    out, err = capsys.readouterr()
    (line,) = err.splitlines()
    assert out == "" and place in line and "expected" in line
    assert sorted(os.listdir()) == before and Path("file").read_text() == "mine"


def test_a_page_that_does_not_fit_leaves_the_results(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "discover"
    shutil.copytree(ROOT / "tests" / "data" / "results" / "discover", out)
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    with room(1000):
        assert main(["report", str(out)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"{out / 'report.html'}: cannot be written (File too large)")
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before
