"""One run at a time in a folder; a run that was killed keeps nobody out."""

import json
import os
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from wirebayes.errors import InputError
from wirebayes.io.run_folder import open_run
from wirebayes.processes import lock
from wirebayes.processes.lock import LOCK, locked

fcntl = pytest.importorskip("fcntl")
CONFIGURATION = {"command": "fit"}
HOLD = """
import sys, time
from wirebayes.io.run_folder import open_run
with open_run(sys.argv[1], {"command": "fit"}):
    print("held", flush=True)
    time.sleep(600)
"""


@pytest.fixture
def holder(tmp_path: Path):
    """Another process that holds the folder."""
    process = subprocess.Popen([sys.executable, "-c", HOLD, str(tmp_path / "out")], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "held\n"
    yield process
    process.kill()
    process.communicate()


def test_the_second_run_says_who_holds_the_folder(holder, tmp_path: Path) -> None:
    before = sorted((tmp_path / "out").iterdir())
    with pytest.raises(InputError) as caught, open_run(tmp_path / "out", CONFIGURATION):
        pass
    line = str(caught.value)
    assert line.startswith(
        f"{tmp_path / 'out'}: found it in use by process {holder.pid} on {socket.gethostname()} since 20"
    )
    assert sorted((tmp_path / "out").iterdir()) == before
    assert json.loads((tmp_path / "out" / LOCK).read_text())["pid"] == holder.pid


def test_the_lock_of_a_killed_run_is_taken_over(holder, tmp_path: Path) -> None:
    holder.send_signal(signal.SIGKILL)
    holder.wait()
    assert (tmp_path / "out" / LOCK).exists()
    with open_run(tmp_path / "out", CONFIGURATION) as run:
        assert run.state == "resumed"
        assert json.loads((tmp_path / "out" / LOCK).read_text())["pid"] == os.getpid()
    assert not (tmp_path / "out" / LOCK).exists()


def test_a_lock_ends_with_its_block_however_that_ends(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError), locked(tmp_path):
        raise ZeroDivisionError
    with locked(tmp_path):
        with pytest.raises(InputError, match=f"process {os.getpid()} on"), locked(tmp_path):
            pass
        assert (tmp_path / LOCK).exists()  # the refused one has not removed it
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_its_holder_removed_meanwhile_is_no_lock(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    take, times = lock._lock, []

    def removed_once(handle: int) -> None:
        take(handle)
        times.append(handle)
        if len(times) == 1:
            (tmp_path / LOCK).unlink()

    monkeypatch.setattr(lock, "_lock", removed_once)
    with locked(tmp_path):
        assert len(times) == 2 and (tmp_path / LOCK).exists()
        with pytest.raises(InputError), locked(tmp_path):
            pass


def test_a_holder_that_has_not_yet_written_its_name_is_another_process(tmp_path: Path) -> None:
    with open(tmp_path / LOCK, "w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        with pytest.raises(InputError, match="in use by another process"), locked(tmp_path):
            pass


def test_finished_results_are_read_while_another_holds_the_folder(tmp_path: Path) -> None:
    with open_run(tmp_path, CONFIGURATION) as run:
        run.finish()
    with locked(tmp_path), open_run(tmp_path, CONFIGURATION) as run:
        assert run.state == "done"
