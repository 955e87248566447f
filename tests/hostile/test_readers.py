"""Thousands of damaged text files: each is read or refused in the contract's plain line, and none takes for ever."""

import collections
import random
import signal
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.hostile.mutations import text_changed
from tests.hostile.readers import READERS, Reader
from wirebayes.cli import _one_line
from wirebayes.errors import InputError

PATIENCE_S = 60  # a guard against endless loops, not a measurement: a file of this size takes milliseconds


@pytest.fixture(autouse=True)
def watched() -> Iterator[None]:
    def late(number: int, frame: object) -> None:
        raise AssertionError(f"a file was not read in {PATIENCE_S} s")

    before = signal.signal(signal.SIGALRM, late)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


def place(reader: Reader, folder: Path) -> Path:
    for name, content in reader.beside.items():
        (folder / name).write_bytes(content)
    path = folder / reader.file
    path.write_bytes(reader.content)
    return path


def refusal(read: Callable[[Path], object], path: Path) -> str:
    """What a user reads where the file is refused; nothing where it is read; every other exception fails."""
    signal.alarm(PATIENCE_S)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            read(path)
    except InputError as error:
        line = _one_line(str(error))
        assert line.isprintable() and len(line) <= 2100
        assert str(path.parent) in line and "found" in line and "expected" in line, line
        return line
    finally:
        signal.alarm(0)
    return ""


def attacked(name: str, seeds: range, folder: Path) -> collections.Counter[bool]:
    """How many were refused, and how many read."""
    reader = READERS[name]
    path = place(reader, folder)
    assert refusal(reader.read, path) == ""
    refused = collections.Counter[bool]()
    for seed in seeds:
        path.write_bytes(text_changed(random.Random(seed), reader.content))
        try:
            refused[bool(refusal(reader.read, path))] += 1
        except BaseException as error:
            error.add_note(f"{name}, seed {seed}")
            raise
    return refused


@pytest.mark.parametrize("name", READERS)
def test_damaged_text(name: str, tmp_path: Path) -> None:
    assert attacked(name, range(25), tmp_path)[True] > 10


@pytest.mark.slow
@pytest.mark.parametrize("name", READERS)
def test_damaged_text_in_full(name: str, tmp_path: Path) -> None:
    counted = attacked(name, range(1000, 2000), tmp_path)
    assert counted[True] > 500 and counted[False] > 10


CELL = st.one_of(
    st.floats().map(repr),
    st.integers().map(str),
    st.text(max_size=8),
    st.sampled_from(["0", "1", "2.5", "1e9", "-0.0"]),
)
HEADER = st.lists(
    st.sampled_from(["hold", "displacement_mm", "time_s", "tension_N", "temperature_C", "Kraft [N]", "", "t [min]"]),
    min_size=1,
    max_size=6,
)


@st.composite
def tables(draw: st.DrawFn) -> str:
    """Rows of numbers and words under a header: times unordered or doubled, one reading, one hold, empty lines."""
    header = draw(st.one_of(HEADER, st.just(["hold", "displacement_mm", "time_s", "tension_N"])))
    rows = draw(st.lists(st.lists(CELL, min_size=len(header), max_size=len(header)), max_size=8))
    sign = draw(st.sampled_from([",", ",", ";", "\t"]))
    return draw(st.sampled_from(["\n", "\r\n"])).join(sign.join(row) for row in [header, *rows])


def drawn(text: str, folder: Path) -> None:
    for name in ("readings", "protocol", "session", "bench"):
        path = place(READERS[name], folder)
        path.write_bytes(text.encode("utf-8", "surrogatepass"))
        refusal(READERS[name].read, path)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("drawn")


@settings(max_examples=25)
@given(text=tables())
def test_tables_of_anything(text: str, folder: Path) -> None:
    drawn(text, folder)


@pytest.mark.slow
@settings(max_examples=500)
@given(text=tables())
def test_tables_of_anything_in_full(text: str, folder: Path) -> None:
    drawn(text, folder)


SCALAR = st.one_of(
    st.floats().map(repr),
    st.integers().map(str),
    st.sampled_from(["true", '"x"', '""', '"../a.csv"', '"a.csv"', '"normal"', "1979-05-27", "07:32:00"]),
)
KEY = st.sampled_from(["fixed", "mean", "sd", "distribution", "duration_s"])
VALUE = st.recursive(
    SCALAR,
    lambda inner: st.one_of(
        st.lists(inner, max_size=3).map(lambda values: f"[{', '.join(values)}]"),
        st.dictionaries(KEY, inner, max_size=3).map(lambda table: f"{{ {', '.join(map(' = '.join, table.items()))} }}"),
    ),
    max_leaves=6,
)


def revalued(line: int, value: str, folder: Path) -> None:
    """One key of each TOML with a value of any type."""
    for name in ("experiment", "plan", "robot"):
        path = place(READERS[name], folder)
        lines = READERS[name].content.decode().splitlines()
        keys = [i for i, text in enumerate(lines) if " = " in text and not text.startswith("#")]
        at = keys[line % len(keys)]
        lines[at] = f"{lines[at].split(' = ')[0]} = {value}"
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        refusal(READERS[name].read, path)


@settings(max_examples=25)
@given(line=st.integers(0, 200), value=VALUE)
def test_values_of_any_type(line: int, value: str, folder: Path) -> None:
    revalued(line, value, folder)


@pytest.mark.slow
@settings(max_examples=500)
@given(line=st.integers(0, 200), value=VALUE)
def test_values_of_any_type_in_full(line: int, value: str, folder: Path) -> None:
    revalued(line, value, folder)
