"""Where the time goes: the whole of `reproduce`, one `discover`, one fit, by the module whose own lines take it.

    python -m analyses.benchmarks.profile --output out/benchmarks

Worker processes are replaced by calls in this one, so that every second is seen. A function of a library counts for
the module of the package that calls it. Shares matter; the seconds are longer than without the profiler.
"""

import argparse
import cProfile
import pstats
import tempfile
from collections import defaultdict
from concurrent import futures
from pathlib import Path
from typing import Any
from unittest.mock import patch

import wirebayes
from analyses.benchmarks import parsed
from wirebayes.discovery.search import investigate
from wirebayes.discovery.settings import Settings
from wirebayes.inference.fit import fit_problem
from wirebayes.io.paper import experiments
from wirebayes.io.run_folder import write_json
from wirebayes.model.build import build
from wirebayes.paper import run

HOME = str(Path(wirebayes.__file__).parent)
SHOWN = 12


class Here(futures.Executor):
    """An executor that does the work at once, in this process."""

    def __init__(self, *args, **kwargs):
        pass

    def submit(self, fn, /, *args, **kwargs):
        future: futures.Future[Any] = futures.Future()
        future.set_result(fn(*args, **kwargs))
        return future


def reproduce():
    with tempfile.TemporaryDirectory() as folder, patch.object(futures, "ProcessPoolExecutor", Here):
        run.reproduce(Path(folder) / "out")


WORK = {
    "one fit": lambda: fit_problem(build(experiments()[:1]), 0),
    "one discover": lambda: investigate(experiments()[:1], Settings()),
    "reproduce": reproduce,
}


def shares(profile):
    """Share of the time by module of the package, libraries counted for the module that calls them."""
    profiled: Any = pstats.Stats(profile)
    stats = profiled.stats
    known: dict[Any, dict[str, float]] = {}

    def owners(function):
        """Modules of the package that a function works for, with their shares."""
        if function[0].startswith(HOME):
            return {str(Path(function[0]).relative_to(HOME).with_suffix("")): 1.0}
        if function not in known:
            known[function] = {}  # a function that calls itself by way of others adds nothing on the way back
            over = {caller: row[3] for caller, row in stats[function][4].items() if row[3]}
            total: dict[str, float] = defaultdict(float)
            for caller, seconds in over.items():
                for module, share in owners(caller).items():
                    total[module] += share * seconds
            whole = sum(total.values())
            known[function] = {k: v / whole for k, v in total.items()} if whole else {"(not the package)": 1.0}
        return known[function]

    spent: dict[str, float] = defaultdict(float)
    for function, row in stats.items():
        for module, share in owners(function).items():
            spent[module] += share * row[2]
    whole = sum(spent.values())
    return {k: v / whole for k, v in sorted(spent.items(), key=lambda item: -item[1])}, whole


def main():
    options = parsed(argparse.ArgumentParser(description=__doc__.splitlines()[0]))
    out = {}
    for name, work in WORK.items():
        profile = cProfile.Profile()
        profile.runcall(work)
        by_module, seconds = shares(profile)
        out[name] = {"seconds_with_profiler": seconds, "shares": by_module}
        print(f"\n{name}: {seconds:.1f} s with the profiler")
        for module, share in list(by_module.items())[:SHOWN]:
            print(f"  {module:32s} {share:6.1%}", flush=True)
    write_json(options.output / "profile.json", out)


if __name__ == "__main__":
    main()
