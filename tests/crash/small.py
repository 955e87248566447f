"""Every long command, made small: ``python -m tests.crash.small COMMAND FOLDER`` runs one as a process of its own."""

import sys
from collections.abc import Callable
from pathlib import Path

import wirebayes as wb
from wirebayes.inference.policy import Policy
from wirebayes.io import paper
from wirebayes.paper import run
from wirebayes.progress import silent

# too short to be believed, long enough to be cut off in search, burn-in and sampling
POLICY = Policy(walkers=32, ess=300.0, rounds=2, round_draws=1024, block=20, most_steps=60, r_hat=1.5)
KITE = [e for e in paper.experiments() if e.name == "kite-1.5m"]
PAIR = [e.train(5) for e in paper.experiments()[2:]]


def fit(folder: Path) -> None:
    wb.fit(PAIR, policy=POLICY, check=False, output=folder)


def discover(folder: Path) -> None:
    keep = {"toe", "superposition"}
    without = [effect.name for effect in wb.list_effects() if effect.name not in keep]
    wb.discover(PAIR[0], without=without, policy=POLICY, simulations=49, output=folder)


def compare(folder: Path) -> None:
    wb.compare(PAIR[0], only=("superposition", "modified_hooke"), policy=POLICY, output=folder)


def batch(folder: Path) -> None:
    wb.batch(PAIR, discover=False, check=False, policy=POLICY, output=folder)


def reproduce(folder: Path) -> None:
    run.paper.experiments = lambda: KITE
    run.reproduce(folder, 0, silent, POLICY)


COMMANDS: dict[str, Callable[[Path], None]] = {
    "fit": fit,
    "discover": discover,
    "compare": compare,
    "batch": batch,
    "reproduce": reproduce,
}

if __name__ == "__main__":
    COMMANDS[sys.argv[1]](Path(sys.argv[2]))
