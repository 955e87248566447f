"""What a whole command costs, from its start to its end, beside the same command of another checkout.

Each command runs on each of the paper's four wires in both checkouts in turn, a few times; the least of each counts,
because whatever else the machine does only adds to it. Processor time (user and system, of all processes that the
command starts) says the same beside other work; time by the clock only on an idle machine.

    python -m analyses.speed.command_cost --against ../before --commands fit discover
"""

import argparse
import ctypes
import os
import resource
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from wirebayes.io import paper

_ADOPT_ORPHANS = 36  # PR_SET_CHILD_SUBREAPER of Linux's <sys/prctl.h>
DATA = paper.FOLDER / "experiments.toml"


def seconds(command: list[str], tree: Path) -> tuple[float, float]:
    """Processor time and time by the clock of a command of a checkout, which leaves its results in a new folder."""
    environment = os.environ | {"PYTHONPATH": str(tree.resolve())}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)  # an installed program has its modules compiled
    with TemporaryDirectory() as folder:
        begin, before = time.perf_counter(), processor_seconds()
        line = [sys.executable, "-m", "wirebayes", *command, "--output", f"{folder}/out", "--quiet"]
        subprocess.run(line, check=True, env=environment, cwd=tree, stderr=subprocess.DEVNULL)
        elapsed = time.perf_counter() - begin
        wait_for_orphans()
        return processor_seconds() - before, elapsed


def processor_seconds() -> float:
    """User and system time of all processes that have ended and were waited for."""
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime


def wait_for_orphans() -> None:
    """Wait for what a command started and did not wait for itself, such as the process that others are forked from."""
    try:
        while True:
            os.waitpid(-1, 0)
    except ChildProcessError:
        return


def main() -> None:
    """Print a line for each command and wire."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--against", type=Path, required=True, help="checkout to compare with")
    parser.add_argument("--commands", nargs="+", default=["fit", "discover"], help="quote one that has options")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--wires", nargs="+", default=[e.name for e in paper.experiments()])
    options = parser.parse_args()
    ctypes.CDLL(None).prctl(_ADOPT_ORPHANS, 1)
    trees = [Path(__file__).parents[2], options.against]
    seconds(["fit", str(DATA), "--experiment", "nylon-1.5m"], trees[0])  # files are read from the disk once
    for command in options.commands:
        ratios = []
        for wire in options.wires:
            name, *given = command.split()
            line = [name, str(DATA), "--experiment", wire, *given]
            times = np.array([[seconds(line, tree) for tree in trees] for _ in range(options.repeats)])
            new, old = times.min(axis=0)
            ratios.append(old / new)
            print(f"{command:20} {wire:15} " + "; ".join(map(_in_words, ("processor", "clock"), new, old)), flush=True)
        median, worst = np.median(ratios, axis=0), np.min(ratios, axis=0)
        for kind, middle, least in zip(("processor", "clock"), median, worst, strict=True):
            print(f"{command}: ratio by the {kind} {middle:.2f} in the median, {least:.2f} at worst", flush=True)


def _in_words(kind: str, new: float, old: float) -> str:
    return f"{kind} {new:.2f} s, before {old:.2f}, ratio {old / new:.2f}"


if __name__ == "__main__":
    main()
