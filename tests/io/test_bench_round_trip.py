"""A known test, written as any bench might, is the same test when it is imported."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import wirebayes as wb
from tests.io.bench_files import Dialect, convert, write_text, write_workbook
from wirebayes.io.bench.about import About
from wirebayes.io.bench.undecided import Choices

ABOUT = About("wire", "line", 800.0)
PREAMBLES = ((), ("# bench 4",), ("Sample;7",), ("Test of Monday", "", "operator: K. Müller"))
HOLDS = [
    (1, 1.5, [0.0, 12.5, 60.0], [1234.56, 1201.02, 1188.3]),
    (2, 3.0, [0.0, 30.0, 60.0, 90.0], [2410.07, 2333.3, 2304.0, 2299.91]),
    (4, 2.0, [0.0, 45.0, 120.0], [1506.1, 1511.25, 1517.4]),
]


@st.composite
def held_tests(draw):
    """Three to six holds; consecutive displacements differ, and in each hold the tension relaxes.

    Tensions without a law would now and then stay while the displacement changes, as under weights, or be a missing
    reading's 9999.99: such a file does not say which test it is.
    """
    count = draw(st.integers(3, 6))
    stiffness = draw(st.integers(21, 2000))  # N/mm
    number, holds, before = 0, [], None
    for _ in range(count):
        number += draw(st.integers(1, 2))
        x = draw(st.integers(1, 200).filter(lambda v, before=before: v != before))
        before = x
        gaps = draw(st.lists(st.integers(1, 3000), min_size=2, max_size=5))
        times = [0.0, *(float(t) / 10.0 for t in np.cumsum(gaps))]
        falls = draw(st.lists(st.integers(1, 3), min_size=len(times), max_size=len(times)))  # in per cent
        left = 1.0 - np.cumsum(falls) / 100.0
        displacement = x / 20.0
        tensions = np.round(stiffness * displacement * left, 2)
        holds.append((number, displacement, times, tensions.tolist()))
    return holds


@st.composite
def dialects(draw):
    """Any way of writing that leaves one reading."""
    delimiter = draw(st.sampled_from([",", ";", "\t", "|"]))
    decimal = draw(st.sampled_from([".", ","]))
    language = draw(st.sampled_from(["en", "de", "fr", "es", "it"]))
    thousands = {".": ["", "'", ","], ",": ["", ".", "\u202f"]}[decimal]
    encodings = ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32"]
    chosen = draw(st.sampled_from(thousands))
    if chosen != "\u202f":
        encodings += ["latin-1", "cp1252"]
    return Dialect(
        delimiter=delimiter,
        decimal=decimal,
        thousands=chosen,
        encoding=draw(st.sampled_from(encodings)),
        newline=draw(st.sampled_from(["\n", "\r\n"])),
        language=language,
        units=draw(st.sampled_from(["bracket", "slash", "underscore", "row"])),
        displacement=draw(st.sampled_from(["mm", "cm", "m", "in"])),
        time=draw(st.sampled_from(["s", "min", "h", "ms"])),
        tension=draw(st.sampled_from(["N", "kN", "mN", "kgf", "gf", "lbf", "kg"])),
        preamble=draw(st.sampled_from(PREAMBLES)),
        absolute=draw(st.booleans()),
        numbered=draw(st.booleans()),
        quoted=delimiter == "," and decimal == "," or draw(st.booleans()),
        reverse=draw(st.booleans()),
    )


def same(experiment, holds, numbered):
    recorded = experiment.recorded_holds
    assert len(recorded) == len(holds)
    for i, (found, (number, x, times, tensions)) in enumerate(zip(recorded, holds, strict=True)):
        assert found.number == (number if numbered else i + 1)
        assert found.displacement_mm == pytest.approx(x, abs=1e-6)
        assert found.time_s == pytest.approx(np.array(times), abs=1e-4)
        assert found.tension_N == pytest.approx(np.array(tensions), abs=1e-5)


@settings(max_examples=150)
@given(held_tests(), dialects())
def test_any_dialect_is_the_same_test(tmp_path_factory, holds, dialect):
    path = write_text(tmp_path_factory.mktemp("raw") / "raw.csv", holds, dialect)
    same(convert(path, ABOUT, Choices()).experiment, holds, dialect.numbered)


@pytest.mark.parametrize("units", ["bracket", "row"])
@pytest.mark.parametrize("absolute", [True, False])
def test_a_workbook_is_the_same_test(tmp_path, units, absolute):
    dialect = Dialect(units=units, absolute=absolute, tension="kgf", preamble=("Probe 7",), numbered=absolute)
    path = write_workbook(tmp_path / "raw.xlsx", HOLDS, dialect)
    same(convert(path, ABOUT, Choices()).experiment, HOLDS, absolute)


def test_spaces_between_cells(tmp_path):
    dialect = Dialect(delimiter=" ", decimal=",", units="underscore")
    path = write_text(tmp_path / "raw.txt", HOLDS, dialect)
    path.write_text(path.read_text().replace(" ", "   "))
    same(convert(path, ABOUT, Choices()).experiment, HOLDS, True)


def test_the_files_written_are_the_same_test_and_fit_is_given_them(tmp_path):
    raw = write_text(tmp_path / "my raw file.csv", HOLDS, Dialect(delimiter=";", decimal=",", absolute=True))
    imported = wb.import_bench(raw, length_mm=800, material="line", output=tmp_path / "out")
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "complete.json",
        "configuration.json",
        "import.json",
        "my-raw-file.csv",
        "my-raw-file.svg",
        "my-raw-file.toml",
    ]
    (read,) = wb.read_experiments(tmp_path / "out" / "my-raw-file.toml")
    assert read.data_hash == convert(raw, About("my-raw-file", "line", 800.0), Choices()).experiment.data_hash
    same(read, HOLDS, True)
    assert read.data_hash == imported.experiments[0].data_hash
    assert wb.load(tmp_path / "out").summary() == imported.summary()
    again = wb.import_bench(raw, length_mm=800, material="line", output=tmp_path / "out")
    assert not again.computed
    with pytest.raises(wb.InputError, match="length_mm is 800"):
        wb.import_bench(raw, length_mm=801, material="line", output=tmp_path / "out")


def test_several_files_are_an_experiment_each(tmp_path):
    raws = [write_text(tmp_path / f"{name}.csv", HOLDS, Dialect()) for name in ("a", "b")]
    wb.import_bench(raws, length_mm=800, material="line", output=tmp_path / "out")
    assert [e.name for e in wb.read_experiments(tmp_path / "out" / "experiments.toml")] == ["a", "b"]
    assert [e.name for e in wb.read_experiments(tmp_path / "out" / "b.toml")] == ["b"]
    with pytest.raises(wb.InputError, match="--name: found 'n' for 2 files"):
        wb.import_bench(raws, length_mm=800, name="n")
