"""How long a whole command takes, from its start to its end, beside the same command of another checkout.

Each command runs on each of the paper's four wires in both checkouts in turn, a few times; the shortest time of each
counts, because whatever else the machine does only adds to it.

    python -m analyses.speed.command_cost --against ../before --commands fit discover
"""

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from wirebayes.io import paper

DATA = paper.FOLDER / "experiments.toml"


def seconds(command: list[str], tree: Path) -> float:
    """Seconds until the command of a checkout has ended and left its results in a new folder."""
    environment = os.environ | {"PYTHONPATH": str(tree.resolve())}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)  # an installed program has its modules compiled
    with TemporaryDirectory() as folder:
        begin = time.perf_counter()
        line = [sys.executable, "-m", "wirebayes", *command, "--output", f"{folder}/out", "--quiet"]
        subprocess.run(line, check=True, env=environment, cwd=tree, stderr=subprocess.DEVNULL)
        return time.perf_counter() - begin


def main() -> None:
    """Print a line for each command and wire."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--against", type=Path, required=True, help="checkout to compare with")
    parser.add_argument("--commands", nargs="+", default=["fit", "discover"], help="quote one that has options")
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    trees = [Path(__file__).parents[2], options.against]
    seconds(["fit", str(DATA), "--experiment", "nylon-1.5m"], trees[0])  # files are read from the disk once
    for command in options.commands:
        ratios = []
        for wire in (e.name for e in paper.experiments()):
            name, *given = command.split()
            line = [name, str(DATA), "--experiment", wire, *given]
            times = np.array([[seconds(line, tree) for tree in trees] for _ in range(options.repeats)])
            new, old = times.min(axis=0)
            ratios.append(old / new)
            print(f"{command:20} {wire:15} {new:6.1f} s, before {old:6.1f} s, ratio {ratios[-1]:.2f}", flush=True)
        print(f"{command}: ratio {np.median(ratios):.2f} in the median, {min(ratios):.2f} at worst", flush=True)


if __name__ == "__main__":
    main()
