"""Ctrl-C and SIGTERM end a command in one line, whatever it is doing, and leave no process and no half file behind."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAPER = str(ROOT / "data" / "paper" / "experiments.toml")
INT, TERM = signal.SIGINT, signal.SIGTERM
pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for processes in /proc")


def processes_of(group: int) -> list[int]:
    """Processes of a group that still run."""
    out = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, owner = stat.read_text().rpartition(")")[2].split()[:3]
        except OSError:
            continue
        if int(owner) == group and state != "Z":
            out.append(int(stat.parent.name))
    return out


def interrupted(
    arguments: list[str], ready: Callable[[int], bool], number: int, whole_group: bool
) -> tuple[int, str, str]:
    """Start a command as a terminal does, in a process group of its own, and send a signal once it is ready."""
    command = [sys.executable, "-m", "wirebayes", *arguments]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True, cwd=ROOT
    )
    try:
        while not ready(process.pid):
            assert process.poll() is None, process.communicate()
            time.sleep(0.01)
        (os.killpg if whole_group else os.kill)(process.pid, number)
        out, err = process.communicate(timeout=60)
        for _ in range(100):  # a process that was killed takes a moment to be gone
            if not processes_of(process.pid):
                break
            time.sleep(0.05)
        assert processes_of(process.pid) == []
    finally:
        for left in processes_of(process.pid):
            os.kill(left, signal.SIGKILL)
        process.wait()
    return process.returncode, out, err


def said_once(code: int, out: str, err: str, number: int = INT) -> str:
    assert code == 128 + number
    assert out == ""
    (line,) = err.splitlines()
    assert line.startswith({INT: "interrupted; ", TERM: "terminated; "}[number])
    return line


def exists(path: Path) -> Callable[[int], bool]:
    return lambda pid: path.exists()


def working(number: int) -> Callable[[int], bool]:
    """So many processes, the command itself among them, each past its start-up."""

    def ready(pid: int) -> bool:
        own = [p for p in processes_of(pid) if _loaded(p)]
        return len(own) >= number

    return ready


def _loaded(pid: int) -> bool:
    try:
        return "numpy" in Path(f"/proc/{pid}/maps").read_text()
    except OSError:
        return False


@pytest.mark.parametrize("module", ["typer", "numpy.linalg", "emcee"])
@pytest.mark.parametrize("number", [INT, TERM])
def test_during_an_import(module: str, number: int, tmp_path: Path) -> None:
    # sent by the process itself at a fixed place: no clock decides where it arrives
    code = (
        "import os, sys\n"
        "class Finder:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        f"        if name == {module!r}: os.kill(os.getpid(), {int(number)})\n"
        "sys.meta_path.insert(0, Finder())\n"
        "from wirebayes.cli import main\n"
        "sys.exit(main())\n"
    )
    command = [sys.executable, "-c", code, "fit", PAPER, "--output", str(tmp_path / "out")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert "no results were kept" in said_once(done.returncode, done.stdout, done.stderr, number)
    assert not (tmp_path / "out").exists()


def fit(out: Path) -> tuple[list[str], Callable[[int], bool]]:
    arguments = ["fit", PAPER, "--experiment", "kite-1.5m", "--effect", "superposition", "--output", str(out)]
    return arguments, exists(out / "kite-1.5m" / ".checkpoint")


def fits(out: Path) -> tuple[list[str], Callable[[int], bool]]:
    return ["fit", PAPER, "--output", str(out)], exists(out / "nylon-1.5m" / ".checkpoint")


def discover(out: Path) -> tuple[list[str], Callable[[int], bool]]:
    return ["discover", PAPER, "--output", str(out)], working(2)


def compare(out: Path) -> tuple[list[str], Callable[[int], bool]]:
    return ["compare", PAPER, "--experiment", "nylon-1.5m", "--output", str(out)], working(2)


def reproduce(out: Path) -> tuple[list[str], Callable[[int], bool]]:
    return ["reproduce", "--output", str(out)], working(2)


LONG = (fits, discover, compare, reproduce)


@pytest.mark.parametrize("whole_group", [True, False])
@pytest.mark.parametrize("what", [fit, discover])
def test_ctrl_c(what: Callable, whole_group: bool, tmp_path: Path) -> None:
    out = tmp_path / "out"
    arguments, ready = what(out)
    line = said_once(*interrupted(arguments, ready, INT, whole_group))
    assert "to go on" in line or what is discover  # which keeps its plain fits, if they have begun
    assert not list(out.rglob("*.partial"))


@pytest.mark.slow
@pytest.mark.parametrize(("number", "whole_group"), [(INT, True), (INT, False), (TERM, False)])
@pytest.mark.parametrize(
    ("what", "wait_s"),
    # a fit of one test is done within two seconds
    [*((what, 0.3) for what in LONG), (fit, 0.3), (fit, 0.8), *((what, 2.0) for what in LONG)],
)
def test_signals_later_on(what: Callable, number: int, whole_group: bool, wait_s: float, tmp_path: Path) -> None:
    out = tmp_path / "out"
    arguments, begun = what(out)
    at: list[float] = []

    def ready(pid: int) -> bool:
        if begun(pid):
            at.append(time.monotonic())
        return bool(at) and time.monotonic() - at[0] >= wait_s

    code, said, err = interrupted(arguments, ready, number, whole_group)
    # a fit may have reported its check by then
    rest = [line for line in err.splitlines() if "does not describe the readings" not in line]
    said_once(code, said, "\n".join(rest), number)
    assert not list(out.rglob("*.partial"))


def test_workers_leave_when_their_parent_is_killed(tmp_path: Path) -> None:
    arguments, ready = discover(tmp_path / "out")
    assert interrupted(arguments, ready, signal.SIGKILL, False)[0] == -signal.SIGKILL


def test_a_copy_that_is_ended_while_it_begins_says_nothing(tmp_path: Path) -> None:
    code = (
        "import os, signal, sys\n"
        "from wirebayes.processes.interrupt import held_back, watch, watch_silently\n"
        "watch([])\n"
        "with held_back():\n"
        "    child = os.fork()\n"
        "    if child == 0:\n"
        "        change = signal.signal\n"
        "        def ended_meanwhile(which, handler):\n"
        "            signal.signal = change\n"
        "            os.kill(os.getpid(), signal.SIGTERM)\n"
        "            return change(which, handler)\n"
        "        signal.signal = ended_meanwhile\n"
        "        watch_silently()\n"
        "        os._exit(0)\n"
        "sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.stderr == ""
    assert done.returncode == 128 + TERM


@pytest.mark.parametrize(
    ("begun", "said"),
    [
        ("pass", "no results were kept"),
        ("(run.directory / 'a.csv').touch()", "run the same command again to go on"),
        ("with open_run('o/in', {}) as inner: inner.finish()", "run the same command again to go on"),
        ("run.finish()", "the results are complete"),
    ],
)
def test_what_was_kept_in_a_folder_that_no_argument_names(begun: str, said: str, tmp_path: Path) -> None:
    code = (
        "import os, signal\n"
        "from wirebayes.io.run_folder import open_run\n"
        "from wirebayes.processes.interrupt import watch\n"
        "watch(['fit', 'o.toml'])\n"
        "with open_run('o', {}) as run:\n"
        f"    {begun}\n"
        "    os.kill(os.getpid(), signal.SIGTERM)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.stderr == f"terminated; {said}\n"


@pytest.mark.slow
def test_an_interrupted_fit_goes_on_to_the_same_bytes(tmp_path: Path) -> None:
    out, whole = tmp_path / "out", tmp_path / "whole"
    arguments, ready = fit(out)
    assert "to go on" in said_once(*interrupted(arguments, ready, INT, True))
    for folder in (out, whole):
        subprocess.run([sys.executable, "-m", "wirebayes", *fit(folder)[0]], check=True, cwd=ROOT)
    summary = Path("kite-1.5m") / "summary.json"
    assert (out / summary).read_bytes() == (whole / summary).read_bytes()
