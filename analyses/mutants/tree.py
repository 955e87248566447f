"""Runs tests on a copy of the checkout, each time in a process forked from one that has loaded the libraries."""

import compileall
import json
import os
import resource
import shutil
import sys
import time
from collections.abc import Generator, Sequence
from importlib import import_module
from pathlib import Path
from py_compile import PycInvalidationMode
from typing import Any

from analyses.mutants.mistakes import ROOT, Mutant

FAST = "not slow and not browser and not statistical"  # the last are in make test, but too dear for every mutant


def preload() -> None:
    """What every test imports and no mutant changes."""
    for name in ("arviz_base", "arviz_stats", "coverage", "emcee", "hypothesis", "matplotlib.figure", "pytest",
                 "scipy.integrate", "scipy.optimize", "scipy.stats", "typer", "xarray"):  # fmt: skip
        import_module(name)


def copy_of_the_checkout(scratch: Path) -> Path:
    """A tree that mutants may change."""
    tree = scratch / "tree"
    left_out = shutil.ignore_patterns(".git", ".venv*", ".nox", "out", "build", "_build", "__pycache__", "*.egg-info")
    shutil.copytree(ROOT, tree, ignore=left_out, symlinks=True)
    # compiled once; by the source's hash, for two mutants may have one size and one second
    compileall.compile_dir(tree / "wirebayes", quiet=1, invalidation_mode=PycInvalidationMode.CHECKED_HASH)
    return tree


def run(
    tree: Path, tests: Sequence[str], patience_cpu_s: float, mutant: Mutant | None = None
) -> tuple[str, float, str]:
    """Tests on the tree, with a mutant or as it is: "passed", "failed" or "hung", the seconds, the test that failed."""
    answer = tree.parent / "failed.txt"
    answer.write_text("")
    original = None
    if mutant is not None:
        original = (tree / mutant.file).read_text(encoding="utf-8")
        (tree / mutant.file).write_text(mutant.text, encoding="utf-8")
    began = time.monotonic()
    try:
        child = os.fork()
        if not child:
            _in_the_child(tree, patience_cpu_s)
            os._exit(_pytest(["-x", *tests], [_Failed(answer)]))
        _, status = os.waitpid(child, 0)
        outcome = "hung" if os.WIFSIGNALED(status) else "failed" if status else "passed"
        return outcome, time.monotonic() - began, answer.read_text()
    finally:
        if mutant is not None and original is not None:
            (tree / mutant.file).write_text(original, encoding="utf-8")


class _Failed:
    """Writes down the first test that fails; nothing if not even its file could be read."""

    def __init__(self, answer: Path) -> None:
        self.answer = answer

    def pytest_runtest_logreport(self, report: Any) -> None:
        if report.failed:
            self.answer.write_text(_without_parameters(report.nodeid))


def reach_of(tree: Path, test_file: str, answer: Path, patience_cpu_s: float) -> dict[str, Any]:
    """The lines of the package that each test of a file runs, and its seconds; lines of fixtures count for all of them.

    Nothing, where the file takes longer than the patience.
    """
    child = os.fork()
    if not child:
        _in_the_child(tree, patience_cpu_s)
        os._exit(_measured(tree, test_file, answer))
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status):
        return {"seconds": {}, "lines": {}}
    if status:
        raise SystemExit(f"{test_file} fails without any mutant")
    return json.loads(answer.read_text(encoding="utf-8"))


def _in_the_child(tree: Path, patience_cpu_s: float) -> None:
    """On the tree, quietly, and not for ever; processor time, for others may be at work on the machine."""
    resource.setrlimit(resource.RLIMIT_CPU, (int(patience_cpu_s) + 1,) * 2)
    os.setpgid(0, 0)
    os.chdir(tree)
    sys.path[:] = [str(tree), *(path for path in sys.path if Path(path or ".").resolve() != ROOT)]
    for name in [name for name in sys.modules if name.split(".")[0] in ("wirebayes", "analyses", "tests")]:
        del sys.modules[name]
    quiet = os.open(os.devnull, os.O_WRONLY)
    os.dup2(quiet, 1)
    os.dup2(quiet, 2)


def _pytest(arguments: list[str], plugins: Sequence[object] = ()) -> int:
    import pytest

    options = ["-q", "-m", FAST, "-p", "no:cacheprovider", "-p", "no:faulthandler", "-p", "no:cov", "-p", "no:xdist"]
    options += ["-W", "ignore::pytest.PytestAssertRewriteWarning"]  # of what was loaded before
    return int(pytest.main([*options, *arguments], plugins=list(plugins)))


def _measured(tree: Path, test_file: str, answer: Path) -> int:
    import coverage
    import pytest

    measured = coverage.Coverage(data_file=None, source=[str(tree / "wirebayes")], config_file=False)
    seconds: dict[str, float] = {}

    class Watch:
        @pytest.hookimpl(wrapper=True)
        def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, object, object]:
            began, test = time.process_time(), _without_parameters(item.nodeid)
            measured.switch_context("fixtures")
            try:
                return (yield)
            finally:
                seconds[test] = seconds.get(test, 0.0) + time.process_time() - began

        @pytest.hookimpl(tryfirst=True)
        def pytest_runtest_call(self, item: pytest.Item) -> None:
            measured.switch_context(_without_parameters(item.nodeid))

    measured.start()
    code = _pytest([test_file], [Watch()])
    measured.stop()
    data = measured.get_data()
    lines: dict[str, dict[str, list[int]]] = {}
    for file in data.measured_files():
        for line, tests in data.contexts_by_lineno(file).items():
            for test in tests:
                if test:
                    name = str(Path(file).relative_to(tree))
                    lines.setdefault(test, {}).setdefault(name, []).append(line)
    answer.write_text(json.dumps({"seconds": seconds, "lines": lines}), encoding="utf-8")
    return 0 if code in (0, 5) else 1  # 5: every test of the file is slow


def _without_parameters(test: str) -> str:
    return test.split("[")[0]
