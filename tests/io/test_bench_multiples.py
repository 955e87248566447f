"""Readings counted in divisions of a gauge, steps of a motor or shares of a load."""

import numpy as np
import pytest

from tests.io.bench_files import convert
from wirebayes.errors import InputError
from wirebayes.io.bench.about import About
from wirebayes.io.bench.multiples import unit_in_header
from wirebayes.io.bench.numerals import is_count
from wirebayes.io.bench.quantities import quantity_unit
from wirebayes.io.bench.undecided import Choices, Undecided

ABOUT = About("wire", "line", 1000.0)


def displacements(tmp_path, header, cells=("403", "413", "424"), **choices):
    path = tmp_path / "raw.csv"
    path.write_text(f"Weight (kg);Time (min);{header}\n" + "".join(f"2;{i};{cell}\n" for i, cell in enumerate(cells)))
    return [row[1] for row in convert(path, ABOUT, Choices(control="force", zero_mm=0.0, **choices)).rows]


@pytest.mark.parametrize(
    "header",
    ["Dial (1/100 mm)", "Dial [0.01 mm]", "Dial 0.01 mm", "Messuhr in 1/100 mm", "Dial [mm/100]", "Dial 0,01mm",
     "Dial (1 / 100 mm)", "Dial (0.01 × mm)"],
)  # fmt: skip
def test_divisions_of_a_gauge_are_counted(tmp_path, header):
    assert displacements(tmp_path, header) == [4.03, 4.13, 4.24]


def test_divisions_of_another_unit_and_in_the_row_of_units(tmp_path):
    assert displacements(tmp_path, "Dial (0.001 in)", ("100", "200", "300")) == [2.54, 5.08, 7.62]
    path = tmp_path / "raw.csv"
    path.write_text("Weight;Time;Dial\nkg;min;0.01 mm\n2;0;403\n2;1;413\n2;2;424\n")
    assert [row[1] for row in convert(path, ABOUT, Choices(control="force")).rows] == [4.03, 4.13, 4.24]


def test_a_quantity_over_a_number_is_asked_about(tmp_path):
    """It may be in tenths of a millimetre, or in millimetres of a tenth."""
    with pytest.raises(Undecided, match="found no unit") as found:
        displacements(tmp_path, "Weg/10 mm", ("40", "41", "42"))
    assert any(answer.endswith("[mm]") for answer in found.value.answers)
    assert displacements(tmp_path, "Weg 10 mm", ("40", "41", "42")) == [40.0, 41.0, 42.0]


@pytest.mark.parametrize("step", ["0.01 mm", ".01 mm", ",01 mm", "1e-2 mm", "1.0E-02 mm", "1/100 mm"])
def test_a_step_may_be_written_as_numbers_are(tmp_path, step):
    mapping = (f"Steps=displacement [{step}]",)
    assert displacements(tmp_path, "Steps", ("400", "410", "420"), mapping=mapping) == pytest.approx([4.0, 4.1, 4.2])


def test_numbers_that_are_no_counts_are_asked_about(tmp_path):
    header, cells = "Dial (0.001 in)", ("0.1", "0.2", "0.3")
    with pytest.raises(Undecided, match="found '0.1' under '0.001 in', which may be the unit or the step") as found:
        displacements(tmp_path, header, cells)
    step, unit = (answer.removeprefix("--map ") for answer in found.value.answers)
    assert displacements(tmp_path, header, cells, mapping=(step,)) == [2.54, 5.08, 7.62]
    assert displacements(tmp_path, header, cells, mapping=(unit,)) == [0.00254, 0.00508, 0.00762]


def test_words_between_counts_do_not_make_them_lengths(tmp_path):
    cells = ("403", "NaN", "413", "424")
    assert displacements(tmp_path, "Dial (0.01 mm)", cells, drop_breaks=True) == [4.03, 4.13, 4.24]


@pytest.mark.parametrize(
    ("text", "factor"),
    [("0.1 N", 0.1), ("0.2 N", None), ("2 N", None), ("50 N", None), ("0.05 N", 0.05), ("0.03 N", None), ("0 N", None),
     ("1/10 N", 0.1), ("N/0", None), ("-0.1 N", -0.1), ("0.1 mm", None)],
)  # fmt: skip
def test_a_header_names_divisions_of_a_tenth_or_finer(text, factor):
    unit = unit_in_header(text, "tension")
    assert (unit and unit.factor) == factor


@pytest.mark.parametrize(("unit", "first"), [("5 mm", 2015.0), ("0.005 mm", 2.015), ("1/200 mm", 2.015), ("mm", 403.0)])
def test_any_number_of_a_unit_may_be_said(tmp_path, unit, first):
    assert displacements(tmp_path, "Steps", mapping=(f"Steps=displacement [{unit}]",))[0] == first


def test_a_share_of_the_breaking_load_asks_for_what_one_is(tmp_path):
    path = tmp_path / "raw.csv"
    path.write_text("Time (s),x (mm),Load (%MBL)\n0,2,20\n1,2,19\n2,2,18\n")
    with pytest.raises(InputError, match=r"found the unit '%MBL', .* or \[0.5 N\] if one %MBL is 0.5 N"):
        convert(path, ABOUT, Choices())
    made = convert(path, ABOUT, Choices(mapping=("Load (%MBL)=tension [0.5 N]",)))
    assert [row[3] for row in made.rows] == [10.0, 9.5, 9.0]


@pytest.mark.parametrize(("unit", "value", "celsius"), [("°F", 38.3, 3.5), ("°F", 33.8, 1.0), ("K", 274.35, 1.2)])
def test_temperatures_have_no_more_digits_than_were_written(unit, value, celsius):
    known = quantity_unit(unit, "temperature")
    assert known is not None
    assert known.convert(np.array([value])).tolist() == [celsius]


@pytest.mark.parametrize(
    ("cell", "count"),
    [("1234", True), ("-12", True), ("1'234", True), ("1 234", True), ("1,234,567", True), ("1,234", False),
     ("1.234", False), ("1'23", False), ("0'123", False), ("1,234.567", False)],
)  # fmt: skip
def test_thousands_are_counts_where_they_can_be_no_fraction(cell, count):
    assert is_count(cell) == count


def test_counts_grouped_by_apostrophes_are_read_as_counts(tmp_path):
    path = tmp_path / "raw.csv"
    rows = [f"{t};{x};{5 + n}\n" for n, x in enumerate(("1'000", "2'015")) for t in (0, 10, 20)]
    path.write_text("Time (s);Dial [0.001 mm];Force (N)\n" + "".join(rows))
    assert [hold.setting for hold in convert(path, ABOUT, Choices()).experiment.holds] == [1.0, 2.015]


def test_the_refusal_of_turns_says_how_to_write_the_length_of_one(tmp_path):
    path = tmp_path / "raw.csv"
    path.write_text("screw (turns),Time (s),Force (N)\n2,0,5\n2,30,4.9\n4,0,9\n4,30,8.9\n")
    wanted = r'--map "screw \(turns\)=displacement \[0.5 mm\]" \(with the length of one in place of 0.5 mm\)'
    with pytest.raises(InputError, match=wanted):
        convert(path, About("wire", "line", 1000.0), Choices())


@pytest.mark.parametrize(
    ("unit", "weight"), [("short_ton", 8896.443231), ("long_ton", 9964.016418), ("tonne", 9806.65)]
)
def test_tons_are_asked_about(tmp_path, unit, weight):
    path = tmp_path / "raw.csv"
    lines = [f"{t},{x},{x * (1 - t / 1000)}" for x in (1, 2) for t in (0, 30, 60)]
    path.write_text("\n".join(["Time (s),Displacement (mm),Load (tons)", *lines]))
    with pytest.raises(
        Undecided, match=r"found tons, which may be of 2000 lb, .* --map \"Load \(tons\)=tension"
    ) as refused:
        convert(path, ABOUT, Choices())
    option = next(option for option in refused.value.answers if unit in option)
    made = convert(path, ABOUT, Choices().with_option(option))
    assert made.rows[0][3] == pytest.approx(weight)


def test_kilonewtons_in_capitals(tmp_path):
    path = tmp_path / "raw.csv"
    lines = [f"{t},{x},{x * (1 - t / 1000)}" for x in (1, 2) for t in (0, 30, 60)]
    path.write_text("\n".join(["TIME (S),DISPLACEMENT (MM),LOAD (KN)", *lines]))
    assert convert(path, ABOUT, Choices()).rows[0][3] == pytest.approx(1000.0)
