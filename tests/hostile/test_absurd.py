"""Absurd files and places, each named: what no random change of a valid file comes upon."""

import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.conftest import CSV, TOML
from tests.hostile.readers import BENCH
from wirebayes.cli import main

ROBOT = "linear-7"
MARKUP = "<img src=x onerror=alert(1)> $x_{ &amp;'\" 鋼線"


@pytest.fixture(autouse=True)
def watched() -> Iterator[None]:
    signal.alarm(120)  # a guard against reading without end
    yield
    signal.alarm(0)


def refused(arguments: list[str], folder: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """The one plain line of a command that refuses, and leaves nothing."""
    before = sorted(folder.rglob("*"))
    assert main(arguments) == 2
    out, err = capsys.readouterr()
    (line,) = err.splitlines()
    assert out == "" and line.isprintable() and "Traceback" not in line
    assert sorted(folder.rglob("*")) == before, "half written"
    return line


def commands(path: Path, folder: Path) -> list[list[str]]:
    """Every command that reads a file that a user names."""
    out = ["--output", str(folder / "out")]
    wires = ["--wires", str(folder)]
    return [
        *([name, str(path), *out] for name in ("fit", "discover", "compare", "check", "batch", "plan")),
        ["import", str(path), "--length-mm", "1000", *out],
        ["pose", str(path), *wires, *out],
        ["calibrate", str(path), str(path), *wires, *out],
        ["export", str(path), *wires, *out],
        ["fit", str(folder / "e.toml"), "--own-effects", str(path), *out],
    ]


def pipe(path: Path) -> None:
    os.mkfifo(path)


def device(path: Path) -> None:
    path.symlink_to("/dev/zero")


def loop(path: Path) -> None:
    path.symlink_to(path)


def folder_there(path: Path) -> None:
    path.mkdir()


def absent(path: Path) -> None:
    pass


def binary(path: Path) -> None:
    path.write_bytes(bytes(range(256)) * 10)


def empty(path: Path) -> None:
    path.write_bytes(b"")


@pytest.mark.parametrize("made", [pipe, device, loop, folder_there, absent, binary, empty])
def test_what_is_no_file_of_ours(
    made: Callable[[Path], None], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made(tmp_path / "x.toml")
    (tmp_path / "e.toml").write_text(TOML)
    (tmp_path / "a.csv").write_text(CSV)
    for arguments in commands(tmp_path / "x.toml", tmp_path):
        line = refused(arguments, tmp_path, capsys)
        assert "x.toml" in line and "expected" in line, arguments


@pytest.mark.parametrize(
    "name", ["../a.csv", "/etc/passwd", "outside.csv", "pipe.csv", "loop.csv", ".", "", "a\\u0000b", "x" * 5000]
)
def test_readings_lie_beside_their_experiment(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    inside = tmp_path / "inside"
    inside.mkdir()
    (tmp_path / "a.csv").write_text(CSV)
    (inside / "outside.csv").symlink_to(tmp_path / "a.csv")
    os.mkfifo(inside / "pipe.csv")
    (inside / "loop.csv").symlink_to(inside / "loop.csv")
    file = inside / "e.toml"
    file.write_text(TOML.replace('readings = "a.csv"', f'readings = "{name}"'))
    line = refused(["check", str(file), "--output", str(tmp_path / "out")], tmp_path, capsys)
    assert line.startswith(f"{file}, line 6, experiment wire-a, key readings: found ")


LINES = CSV.splitlines()
ABSURD = {
    "one reading": "\n".join(LINES[:2]),
    "one hold": "\n".join(LINES[:3]),
    "no readings": LINES[0],
    "times doubled": CSV.replace("1,1,60", "1,1,0"),
    "times fall": CSV.replace("3,2.5,90", "3,2.5,20"),
    "a hold twice": CSV + "1,1,90,0.8\n",
    "not a number": CSV.replace("0.90", "nan"),
    "infinite": CSV.replace("0.90", "inf"),
    "huge": CSV.replace("0.90", "1e300"),
    "a push": "\n".join([LINES[0], *(f"{h},{h},{t},{-h - 1}" for h in range(1, 5) for t in (0, 60))]),
    "no wire left": CSV.replace("4,0.5", "4,-1000"),
    "NUL": CSV.replace("0.90", "0.9\x00"),
    "columns": "\n".join(line + ",0" * 20_000 for line in LINES),
    "one line": "1" * 3_000_000,
    "half a quote": CSV.replace("0.90", '"0.90'),
    "a decimal comma in quotes": CSV.replace("0.90", '"0,90"'),
    "too many holds": "\n".join([LINES[0], *(f"{h},1,{t},2" for h in range(400) for t in range(400 * (h == 7) + 1))]),
}


@pytest.mark.parametrize("what", ABSURD)
def test_absurd_readings(what: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "e.toml").write_text(TOML)
    (tmp_path / "a.csv").write_text(ABSURD[what])
    line = refused(["fit", str(tmp_path / "e.toml"), "--output", str(tmp_path / "out")], tmp_path, capsys)
    assert "a.csv" in line and "found" in line and "expected" in line


@pytest.mark.slow
def test_a_million_rows_are_refused_before_they_fill_the_memory(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "e.toml").write_text(TOML)
    rows = (f"{h},{h},{t},1.5" for h in range(1, 11) for t in range(100_000))
    (tmp_path / "a.csv").write_text("\n".join([LINES[0], *rows]))
    line = refused(["fit", str(tmp_path / "e.toml"), "--output", str(tmp_path / "out")], tmp_path, capsys)
    assert "10 holds, the longest of 100000 readings" in line and "thins" in line


@pytest.mark.parametrize("key", ["length_mm = 1000.0", "resolution_N = 0.01"])
@pytest.mark.parametrize("value", ["0", "-1", "nan", "inf", "1e300", "1e-300", "1" + "0" * 400, "true", "'1'"])
def test_absurd_numbers(key: str, value: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    name = key.split()[0]
    (tmp_path / "e.toml").write_text(TOML.replace(key, f"{name} = {value}"))
    (tmp_path / "a.csv").write_text(CSV)
    if (name, value) == ("resolution_N", "1e-300"):
        pytest.skip("a step is never too small")
    line = refused(["fit", str(tmp_path / "e.toml"), "--output", str(tmp_path / "out")], tmp_path, capsys)
    assert f"key {name}: found " in line and "expected" in line


@pytest.mark.parametrize("cell", ["x" * 200_000, '"' + "y" * 200_000, "(" * 100_000, "9" * 1_000_000])
@pytest.mark.parametrize("place", ["Weg", "2,120", "Prüfstand 3"])
def test_a_cell_without_end(cell: str, place: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "raw.csv").write_text(BENCH.replace(place, cell))
    arguments = ["import", str(tmp_path / "raw.csv"), "--length-mm", "1000", "--output", str(tmp_path / "out")]
    if place == "Prüfstand 3":  # a preamble is nobody's business
        assert main(arguments) in (0, 2)
    else:
        assert "raw.csv" in refused(arguments, tmp_path, capsys)


def test_pages_and_pictures_show_markup_as_it_stands(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    raw = tmp_path / "raw.csv"
    raw.write_text(BENCH.replace("Weg", f"Weg {MARKUP[:20]}"))
    out = ["--output", str(tmp_path / "wire")]
    mapped = ["--map", f"Weg {MARKUP[:20]}=displacement [mm]"]
    assert main(["import", str(raw), "--length-mm", "1000", "--material", MARKUP, *mapped, *out]) == 0
    assert main(["check", str(tmp_path / "wire" / "raw.toml"), "--output", str(tmp_path / "check")]) == 0
    for folder in ("wire", "check"):
        assert main(["report", str(tmp_path / folder)]) == 0
        page = (tmp_path / folder / "report.html").read_text(encoding="utf-8")
        assert "<img src=x" not in page and "&lt;img src=x" in page
    assert "Warning" not in capsys.readouterr().err
