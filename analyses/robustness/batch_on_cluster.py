"""Does a Dask cluster give the bytes of one process, how much sooner, and does it survive the loss of a worker?

``python -m analyses.robustness.batch_on_cluster --output out/batch-on-cluster``: simulated tests of five holds through
``wb.batch`` (fits without the check, short chains), once in one process and once on two workers on loopback, of which
one is killed after a quarter of the experiments and replaced.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from unittest.mock import patch

import wirebayes as wb

SHORT = wb.Policy(walkers=32, ess=300, rounds=2, most_rounds=3, round_draws=1024, block=20, most_steps=60, r_hat=1.1)


class Cluster:
    """A scheduler and its workers, each a process of this machine."""

    def __init__(self, folder: Path) -> None:
        self.file = folder / "scheduler.json"
        self.file.unlink(missing_ok=True)
        self.scheduler = self._start("scheduler", "--port", "0")
        while not self.file.is_file():
            time.sleep(0.1)
        self.workers: list[subprocess.Popen[bytes]] = []

    def _start(self, part: str, *options: str) -> subprocess.Popen[bytes]:
        loopback = ("--host", "127.0.0.1", "--no-dashboard", "--scheduler-file", str(self.file))
        command = [sys.executable, "-m", f"distributed.cli.dask_{part}", *options, *loopback]
        return subprocess.Popen(command, stderr=subprocess.DEVNULL, env={**os.environ, "PYTHONPATH": os.getcwd()})

    def add_worker(self) -> None:
        self.workers.append(self._start("worker", "--nthreads", "1", "--no-nanny"))

    @property
    def address(self) -> str:
        return str(json.loads(self.file.read_text())["address"])

    def stop(self) -> None:
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()


@contextmanager
def cluster(folder: Path) -> Iterator[Cluster]:
    """Two workers."""
    started = Cluster(folder)
    try:
        for _ in range(2):
            started.add_worker()
        time.sleep(5.0)  # both are up before the clock runs
        yield started
    finally:
        started.stop()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=Path("out/batch-on-cluster"))
    parser.add_argument("--experiments", type=int, default=200)
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    made = wb.simulate_tests(tests=options.experiments, displacements=range(1, 6), times=[0, 30, 60], seed=1)
    file = made.folder / "experiments.toml"
    settings = {"discover": False, "check": False, "posteriors": False, "policy": SHORT}

    def run(name: str, **more: object) -> float:
        begin = time.monotonic()
        wb.batch(file, **settings, output=options.output / name, **more)  # type: ignore[arg-type]
        return time.monotonic() - begin

    with patch("wirebayes.processes.workers.cores", lambda: 1):
        alone = run("one-process")
    print(f"one process: {alone:.0f} s", flush=True)
    with cluster(options.output) as two:
        both = run("two-workers", scheduler=two.address)
        print(f"two Dask workers: {both:.0f} s, {alone / both:.2f} times as fast", flush=True)

        def kill(name: str, done: float, total: float) -> None:
            if done == total // 4 and len(two.workers) == 2:
                two.workers[0].kill()
                two.add_worker()

        lost = run("one-killed", scheduler=two.address, progress=kill)
        print(f"the same, one killed after a quarter: {lost:.0f} s, {len(two.workers)} workers started", flush=True)
    first = _content(options.output / "one-process")
    same = [_content(options.output / name) == first for name in ("two-workers", "one-killed")]
    print(f"same bytes as one process: {same}")
    return 0 if all(same) else 1


def _content(folder: Path) -> dict[str, bytes]:
    files = [path for path in folder.rglob("*") if path.suffix in (".csv", ".json")]
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


if __name__ == "__main__":
    sys.exit(main())
