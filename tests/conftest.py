"""Fixtures that several tests share."""

import gc
import importlib
import os
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

# Before anything draws or multiplies: no window, and one thread, so that bytes do not depend on the machine's load.
os.environ.setdefault("MPLBACKEND", "Agg")
for _threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_threads, "1")

# The same examples every time, and no clock: a red test stays red, a busy machine does not make one.
settings.register_profile("repeatable", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("repeatable")

CSV = """hold,displacement_mm,time_s,tension_N
1,1,0,1.00
1,1,60,0.90
3,2.5,0,2.00
3,2.5,30,1.90
3,2.5,90,1.80
4,0.5,10,0.20
"""

TOML = """[[experiment]]
name = "wire-a"
material = "Roc Line 2.2 kg"
length_mm = 1000.0
resolution_N = 0.01
readings = "a.csv"
unrecorded_holds = [{ before_hold = 3, displacement_mm = 2.0, duration_s = 45.0 }]
"""


@pytest.hookimpl(wrapper=True)
def pytest_collection(session: pytest.Session) -> Iterator[None]:
    """Collect without looking for garbage: a million objects are made, and all of them stay."""
    gc.disable()
    compile_a_share(session.config)
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def compile_a_share(config: pytest.Config) -> None:
    """Import a share of all test files before the others, as the other workers do with theirs.

    Each worker collects every file, and the first to import one rewrites and compiles it, which takes most of the time;
    in the same order all would do the same work at once. Only where everything is collected.
    """
    name, workers = (os.environ.get(f"PYTEST_XDIST_WORKER{end}", "") for end in ("", "_COUNT"))
    if not name or config.args != config.getini("testpaths"):
        return
    files = sorted(Path(__file__).parent.rglob("test_*.py"))
    for file in files[int(name.removeprefix("gw")) :: int(workers)]:
        with suppress(Exception, pytest.skip.Exception):  # collection says what is wrong with it
            importlib.import_module(".".join(file.relative_to(config.rootpath).with_suffix("").parts))


@pytest.fixture
def experiment_file(tmp_path: Path) -> Callable[..., Path]:
    """Writes a small valid experiment, with replacements ``{old: new}`` in its TOML or CSV; returns the TOML's path."""

    def write(toml: dict[str, str] | None = None, csv: dict[str, str] | None = None) -> Path:
        for name, text, changes in (("e.toml", TOML, toml), ("a.csv", CSV, csv)):
            for old, new in (changes or {}).items():
                assert old in text, f"{old!r} is not in the valid {name}"
                text = text.replace(old, new, 1)
            (tmp_path / name).write_bytes(text.encode())
        return tmp_path / "e.toml"

    return write
