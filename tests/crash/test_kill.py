"""kill -9 at random moments: the rerun ends with the bytes of an undisturbed run, and nothing of the killed is left.

When a process is killed is left to the clock and a seeded generator; what is asserted does not depend on it.
"""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.processes.test_interrupt import processes_of

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for processes in /proc")


def start(command: str, folder: Path) -> "subprocess.Popen[str]":
    arguments = [sys.executable, "-m", "tests.crash.small", command, str(folder)]
    return subprocess.Popen(
        arguments, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True
    )


def finished(command: str, folder: Path) -> float:
    """Run to the end; how long it took."""
    began = time.monotonic()
    process = start(command, folder)
    output, _ = process.communicate()
    assert process.returncode == 0, output
    return time.monotonic() - began


def killed(command: str, folder: Path, after_s: float) -> bool:
    """Kill a run after a while; False where it was done before. No process of it stays."""
    process = start(command, folder)
    try:
        process.communicate(timeout=after_s)
        assert process.returncode == 0
        return False
    except subprocess.TimeoutExpired:
        os.kill(process.pid, signal.SIGKILL)  # the parent alone: its workers must see to themselves
        process.communicate()
        for _ in range(200):  # they take a moment to notice
            if not processes_of(process.pid):
                return True
            time.sleep(0.05)
        raise AssertionError("orphans") from None
    finally:
        for left in processes_of(process.pid):
            os.kill(left, signal.SIGKILL)


def content(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def attacked(command: str, kills: int, place: Path) -> None:
    whole = place / "whole"
    lasts = finished(command, whole)
    expected, rng, done = content(whole), random.Random(command), 0
    assert "complete.json" in expected and not [name for name in expected if "/." in f"/{name}"]
    folder = place / "0"
    while done < kills:
        if killed(command, folder, rng.uniform(0.0, lasts)):
            done += 1
        else:
            assert content(folder) == expected
            folder = place / str(done)
    finished(command, folder)
    assert content(folder) == expected


@pytest.mark.parametrize("command", ["batch"])
def test_kill(command: str, tmp_path: Path) -> None:
    attacked(command, 2, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("command", ["fit", "discover", "compare", "batch", "reproduce"])
def test_kill_in_full(command: str, tmp_path: Path) -> None:
    attacked(command, 11, tmp_path)
