"""What is each second of a `fit`, from the start of its process to its end?

A fit of one of the paper's wires runs a few times, each in a process of its own that notes when each phase begins.
The fastest run is shown: whatever else the machine does only adds to it.

    python -m analyses.speed.seconds_of_a_fit --wire nylon-1.5m

With ``--output`` a whole `fit`, and a whole `discover`, of each wire are timed as well.
"""

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from analyses.options import study_options
from wirebayes.io import paper
from wirebayes.processes.workers import one_thread_each

DATA = paper.FOLDER / "experiments.toml"
# Where a phase is spent: module, function, and what it does. Processes beside this one do the check, and load
# what draws the page.
PHASES = (
    ("wirebayes.results.jobs", "fit_job", "modes and draws"),
    ("wirebayes.results.jobs", "store", "posterior.nc and summary.json"),
    ("wirebayes.discovery.model_check", "check_model", "the check, beside these"),
    ("wirebayes.cli.answer", "conclude", "the page"),
)


def watched(wire: str, folder: Path) -> None:
    """Run a fit in this process and print when each phase began and ended, s since the epoch, as JSON."""
    import wirebayes.cli.fit
    import wirebayes.commands.fit  # noqa: F401

    noted = {"imports": (time.time(), time.time())}
    for module, function, phase in PHASES:
        _note(noted, module, function, phase)
    from wirebayes.cli import main

    main(["fit", str(DATA), "--experiment", wire, "--output", str(folder), "--quiet"])
    print(json.dumps(noted))


def _note(noted: dict[str, tuple[float, float]], module: str, function: str, phase: str) -> None:
    place = import_module(module)
    original: Callable[..., Any] = getattr(place, function)

    def timed(*given: Any, **named: Any) -> Any:
        begin = time.time()
        result = original(*given, **named)
        noted[phase] = begin, time.time()
        return result

    setattr(place, function, timed)


def run(wire: str) -> tuple[float, dict[str, tuple[float, float]]]:
    """Seconds that a fit takes, and when each phase began and ended, s since its process was started."""
    with TemporaryDirectory() as folder:
        line = [sys.executable, "-m", __spec__.name, "--wire", wire, "--watched", f"{folder}/out"]
        begin = time.time()
        done = subprocess.run(line, check=True, capture_output=True, text=True)
        end = time.time()
    noted = json.loads(done.stdout.splitlines()[-1])
    return end - begin, {phase: (a - begin, b - begin) for phase, (a, b) in noted.items()}


def whole(command: str, wire: str) -> float:
    """Seconds by the clock that a command takes, from the start of its process to its end."""
    with TemporaryDirectory() as folder:
        line = [sys.executable, "-m", "wirebayes", command, str(DATA), "--experiment", wire, "--quiet"]
        begin = time.time()
        subprocess.run([*line, "--output", f"{folder}/out"], check=True, capture_output=True)
        return time.time() - begin


def main() -> None:
    """Print a line for each phase of the fastest run."""
    one_thread_each()  # as a command does before it loads numpy, which this file has loaded: for the runs it starts
    parser = study_options(__doc__)
    parser.add_argument("--wire", default="nylon-1.5m")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--output", type=Path, help="JSON with the phases, and whole commands of each wire")
    parser.add_argument("--watched", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.watched is not None:
        watched(options.wire, options.watched)
        return
    seconds, phases = min((run(options.wire) for _ in range(options.repeats)), key=lambda found: found[0])
    phases["imports"] = 0.0, phases["imports"][1]
    for phase, (begin, end) in phases.items():
        print(f"{phase:32} {begin:.2f} to {end:.2f} s: {end - begin:.2f}")
    print(f"{'whole':32} {seconds:.2f} s")
    if options.output is not None:
        wires = [e.name for e in paper.experiments()]
        each = {
            command: {wire: min(whole(command, wire) for _ in range(options.repeats)) for wire in wires}
            for command in ("fit", "discover")
        }
        content = {"wire": options.wire, "runs": options.repeats, "seconds": seconds, "phases": phases, "whole": each}
        options.output.write_text(json.dumps(content, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
