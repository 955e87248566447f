"""Streams and file names as shells leave them: no command ends in a traceback, and what was done stays done."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from wirebayes.cli import main
from wirebayes.report.blocks import files_beside
from wirebayes.report.page import _way

ROOT = Path(__file__).parents[1]
CHECK = ["check", str(ROOT / "data" / "paper" / "experiments.toml"), "--experiment", "roc-line-1.71m"]
NO_ROOM = "standard output: cannot be written (No space left on device), expected room for what is printed\n"
CLOSED = ">&-", "<&- >&- 2>&-", "| true", "2>&1 | head -c 1"
LATER = {"check": CLOSED[::3], "effects": CLOSED[1:3]}  # in the full tests, for commands that load much: half of each
ASCII = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
pytestmark = pytest.mark.skipif(os.name == "nt", reason="written for a POSIX shell")


def in_shell(arguments, redirection, **variables):
    """Exit code and what came out of a command under bash, in which ``"$@"`` is the program."""
    shell = ["bash", "-c", f'set -o pipefail; "$@" {redirection}', "bash"]
    program = [sys.executable, "-m", "wirebayes", *arguments]
    done = subprocess.run([*shell, *program], cwd=ROOT, env=os.environ | variables, capture_output=True)
    return done.returncode, done.stdout, done.stderr.decode()


@pytest.mark.parametrize(
    ("arguments", "way"),
    [
        pytest.param(arguments, way, marks=pytest.mark.slow if way in LATER.get(arguments[0], ()) else [])
        for arguments in (CHECK, ["effects"], ["--help"], ["fit", "--help"], ["--version"])
        for way in CLOSED
    ],
)
def test_streams_that_are_closed_or_that_nobody_reads(arguments, way):
    code, _, said = in_shell(arguments, way)
    assert (code, said) == (0, "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
@pytest.mark.parametrize("arguments", [CHECK, ["effects", "toe"], ["--help"], ["--version"]])
def test_standard_output_without_room_is_one_line(arguments):
    assert in_shell(arguments, ">/dev/full") == (2, b"", NO_ROOM)


def test_no_stream_that_is_closed_lends_its_number_to_a_file_of_results(tmp_path):
    code, _, _ = in_shell([*CHECK, "--output", str(tmp_path / "o")], ">&- 2>&-")
    in_the_open = main([*CHECK, "--output", str(tmp_path / "p")])
    assert (code, in_the_open) == (0, 0)
    for path in (tmp_path / "p").iterdir():
        assert (tmp_path / "o" / path.name).read_bytes() == path.read_bytes()


def test_letters_that_an_encoding_lacks(tmp_path, capfd):
    code, said, errors = in_shell(CHECK, "", **ASCII)
    assert (code, errors) == (0, "") and b"mm N\\u207b\\u1d41" in said
    assert main(["init", str(tmp_path / "wire")]) == 0
    capfd.readouterr()
    (file,) = (tmp_path / "wire").glob("*.toml")
    file.write_text(file.read_text(encoding="utf-8").replace("Dyneema", "Schnür"), encoding="utf-8")
    as_json = ["check", str(file), "--json"]
    code, said, _ = in_shell(as_json, "", **ASCII)
    assert main(as_json) == 0
    as_utf_8 = capfd.readouterr().out
    assert code == 0 and said.isascii() and not as_utf_8.isascii()
    assert json.loads(said) == json.loads(as_utf_8)


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere names of files are text")
def test_names_of_files_that_are_no_utf_8(tmp_path, capsys):
    raw = Path(os.fsdecode(os.fsencode(tmp_path) + b"/w\xe9.csv"))
    rows = [f"{hold},{time},{hold}.5\n" for hold in (1, 2, 3) for time in (0, 30, 60)]
    raw.write_text("displacement [mm],time [s],force [N]\n" + "".join(rows))
    assert main(["import", str(raw), "--length-mm", "1000", "--output", str(tmp_path / "o"), "--name", "w"]) == 0
    assert (tmp_path / "o" / "w.toml").read_text(encoding="utf-8").startswith("# From w\\udce9.csv.")


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere names of files are text")
def test_links_to_files_of_such_names(tmp_path):
    (tmp_path / os.fsdecode(b"w\xe9.csv")).write_text("")
    (links,) = files_beside(tmp_path, [("*.csv", "rows")]).blocks
    assert links.files == [("w%E9.csv", "rows")]
    assert _way(tmp_path, tmp_path / os.fsdecode(b"\xe9")) == "%E9/"
