"""Columns that are named by nothing but their unit, as a sketch for a microcontroller prints them."""

from pathlib import Path

import numpy as np
import pytest

import wirebayes as wb
from tests.io.bench_files import convert
from wirebayes.errors import InputError
from wirebayes.io.bench.about import About
from wirebayes.io.bench.convert import Converted
from wirebayes.io.bench.undecided import Choices

LOG = "millis,{},pos_mm\n" + "".join(
    f"{1000 * time},{weight},{10 * weight + 0.01 * time}\n"
    for weight, begin in ((1, 0), (2, 100), (3, 200))
    for time in (begin, begin + 20, begin + 60)
)


def tensions(header: str, column: str, folder: Path) -> list[float]:
    raw = folder / "rig.csv"
    raw.write_text(LOG.format(header))
    imported = wb.import_bench(raw, length_mm=1000.0, mapping=[column], control="force", output=folder / "wire")
    return [hold.tension_N for hold in imported.experiments[0].recorded_holds]


@pytest.mark.parametrize(("header", "one"), [("kg", 9.80665), ("N", 1.0), ("kN", 1000.0)])
def test_a_name_that_is_a_unit_says_the_unit_of_the_column_that_it_is_said_to_be(header, one, tmp_path) -> None:
    np.testing.assert_allclose(tensions(header, f"{header}=tension", tmp_path), [one, 2 * one, 3 * one], rtol=1e-12)


def test_a_unit_of_something_else_is_none(tmp_path) -> None:
    with pytest.raises(InputError, match="found no unit"):
        tensions("w", "w=tension", tmp_path)


READINGS = [(time, hold + 1.0, 10.0 * hold + 10.0 - time / 100) for hold in (0, 1, 2) for time in (0.0, 30.0, 60.0)]


def read(folder: Path, header: str, more: str = "", length: float | None = None, **choices) -> Converted:
    """A table of times, lengths and forces, perhaps with another column or one length in all rows."""
    lines = [f"{time},{length or x},{force}{more}" for time, x, force in READINGS]
    raw = folder / "rig.csv"
    raw.write_text("\n".join([header, *lines]) + "\n")
    return convert(raw, About("rig", None, 1000.0), Choices(**choices))


@pytest.mark.parametrize(
    ("header", "more"), [("s,mm,N", ""), ("[s],[mm],[N]", ""), ("Roc,,\ns,mm,N", ""), ("s,mm,N,V", ",5.1")]
)
def test_a_time_a_length_and_a_force_that_units_alone_name_are_read_and_said(tmp_path, header, more) -> None:
    made = read(tmp_path, header, more)
    assert [(time, x, force) for _, x, time, force in made.rows] == READINGS
    length, time, force = (header.strip(",V").split("\n")[-1].split(",")[i] for i in (1, 0, 2))
    assert made.notes[1] == (
        f"columns named by units alone: {length} is the displacement, {time} is the time and {force} is the tension; "
        f"if {length} is a diameter or a gauge length, say so with --map {length}=ignore"
    )


def test_the_units_that_name_columns_convert_them(tmp_path) -> None:
    rows = read(tmp_path, "min,cm,kN").rows
    np.testing.assert_allclose([row[1:] for row in rows], [(10 * x, 60 * t, 1000 * f) for t, x, f in READINGS])


@pytest.mark.parametrize(
    ("header", "more", "length"),
    [
        ("s,mm,N,cm", ",1", None),  # two lengths
        ("s,mm,N,Ø [mm]", ",1", None),
        ("s,mm,N,kN", ",1", None),  # two forces
        ("s,mm,N,kg", ",1", None),
        ("s,mm,N,min", ",1", None),
        ("V,mm,N", "", None),  # no time
        ("s,m,N", "", None),  # a mass, or minutes
        ("s,mm,kg", "", None),
        ("s,mm,MPa", "", None),
        ("channel 1 [s],mm,N", "", None),
        ("s,mm,N", "", 0.8),  # in all rows, as a diameter is
    ],
)
def test_units_that_leave_a_doubt_name_no_column(tmp_path, header, more, length) -> None:
    with pytest.raises(InputError, match="found no column of "):
        read(tmp_path, header, more, length)


def test_columns_that_units_alone_name_in_doubt_stand_in_the_options(tmp_path) -> None:
    with pytest.raises(InputError, match='--map "mm=displacement" --map "s=time" --map "N=tension"$'):
        read(tmp_path, "s,mm,N", length=0.8)
    mapping = ("mm=displacement", "s=time", "N=tension")
    assert {row[1] for row in read(tmp_path, "s,mm,N", length=0.8, mapping=mapping, time_since="hold").rows} == {0.8}


def test_a_length_that_is_to_be_ignored_is_no_displacement(tmp_path) -> None:
    with pytest.raises(InputError, match="found no column of displacement"):
        read(tmp_path, "s,mm,N", mapping=("mm=ignore",))
    made = read(tmp_path, "s,mm,N,Ø [mm]", ",1", mapping=("Ø [mm]=ignore",))
    assert [row[1] for row in made.rows] == [x for _, x, _ in READINGS]
