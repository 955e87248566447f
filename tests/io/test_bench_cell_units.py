"""Cells that bear their units: read as if these stood in the header."""

import re
from pathlib import Path

import pytest

from tests.io.bench_files import convert
from wirebayes.errors import InputError
from wirebayes.io.bench.about import About
from wirebayes.io.bench.cell_units import with_units_apart
from wirebayes.io.bench.sheet import Sheet, SheetRow
from wirebayes.io.bench.undecided import Choices

ABOUT = About("wire", "line", 1000.0)
READINGS = [(x, t, 3.0 * x - t / 100.0) for x in (1.0, 2.0) for t in (0.0, 30.0, 120.0)]


def read(tmp_path, text):
    path = tmp_path / "raw.csv"
    path.write_text(text)
    made = convert(path, ABOUT, Choices())
    return [tuple(row[1:]) for row in made.rows], made.notes


@pytest.mark.parametrize(("sign", "decimal"), [(",", "."), (";", ","), ("\t", "."), ("  ", "."), (" ", ",")])
@pytest.mark.parametrize("header", [["Displacement", "Time", "Force"], ["x (mm)", "t (s)", "F (N)"]])
def test_units_of_all_cells_are_those_of_columns(tmp_path, sign, decimal, header):
    rows = [[f"{x} mm", f"{t:g} s", f"{f:.2f} N"] for x, t, f in READINGS]
    text = "\n".join([sign.join(header), *(sign.join(row).replace(".", decimal) for row in rows)])
    found, notes = read(tmp_path, text)
    assert found == [pytest.approx(reading) for reading in READINGS]
    assert "units in the cells" in notes[0]


@pytest.mark.parametrize(("below", "read_so"), [(99, True), (100, False)])
def test_units_in_cells_are_looked_for_in_the_last_hundred_lines(below, read_so):
    cells = [(f"{x} mm", f"{t:g} s", f"{f:.2f} N") for x, t, f in READINGS]
    rows = [("x", "t", "F"), *cells, *[("end of a part",)] * below]
    sheet = Sheet(Path("raw.csv"), tuple(SheetRow(line, row) for line, row in enumerate(rows, 1)))
    assert (with_units_apart(sheet) is not sheet) == read_so


def test_columns_may_bear_units_alone_or_under_a_row_of_them(tmp_path):
    rows = [f"{x},{t:g},{f:.2f}N,21.5 °C" for x, t, f in READINGS]
    text = "\n".join(["x (mm),t (s),Force,Temp", *rows])
    assert read(tmp_path, text)[0][1] == pytest.approx((1.0, 30.0, 2.7, 21.5))
    under = text.replace("x (mm),t (s),Force,Temp", "x,t,Force,Temp\nmm,s,N,°C").replace("1.0,", "1.0 mm,")
    under = under.replace("2.0,", "2.0 mm,").replace("0,", "0 s,")
    assert read(tmp_path, under)[0][1] == pytest.approx((1.0, 30.0, 2.7, 21.5))


@pytest.mark.parametrize("decimal", [".", ","])
def test_several_units_of_one_quantity_are_written_in_the_smallest(tmp_path, decimal):
    times = {0.0: "0", 30.0: "30 s", 120.0: "2 min"}
    rows = [f"{'10 mm' if x == 1 else '2.5 cm'};{times[t]};{f:.2f} N".replace(".", decimal) for x, t, f in READINGS]
    found, _ = read(tmp_path, "\n".join(["Weg;Zeit;Kraft", *rows]))
    assert [row[:2] for row in found] == [(10.0 if x == 1 else 25.0, t) for x, t, _ in READINGS]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("2.70 N", "2.7", "line 1, column 3 (Force): found no unit"),  # a number among measures
        ("2.70 N", "2.70 mm", "line 1, column 3 (Force): found no unit"),
        ("Force", "Force (N)", None),
        ("Force", "Force (kN)", "found the units kN in the header and N under it"),
    ],
)
def test_units_that_are_not_those_of_all_cells_are_refused(tmp_path, old, new, said):
    rows = [f"{x},{t:g},{f:.2f} N" for x, t, f in READINGS]
    text = "\n".join(["x (mm),t (s),Force", *rows]).replace(old, new)
    if said is None:
        assert read(tmp_path, text)[0] == [pytest.approx(reading) for reading in READINGS]
    else:
        with pytest.raises(InputError, match=re.escape(said)):
            read(tmp_path, text)


def test_names_of_holds_keep_their_units(tmp_path):
    rows = [f"{x:g} mm,{x + t / 1e5},{t:g},{f:.2f}" for x, t, f in READINGS]
    _, notes = read(tmp_path, "\n".join(["Step,x (mm),t (s),F (N)", *rows]))
    assert any("holds numbered in order, 1 mm to 2 mm" in note for note in notes)
