"""Workbooks as people leave them: numbers beside text, names in merged cells, sheets of several words."""

import datetime

import openpyxl
import pytest

from tests.io.bench_files import convert
from wirebayes.io.bench.about import About
from wirebayes.io.bench.convert import convert as convert_all
from wirebayes.io.bench.undecided import Choices, Undecided

ABOUT = About("wire", "line", 1000.0)
WEIGHTS = [(kg, minutes, 20 * kg + minutes / 100) for kg in (0.1, 0.2, 0.3) for minutes in (0.5, 1, 2.5)]
HEADER = ["Mass (kg)", "Time (min)", "Displacement (mm)"]


def saved(path, rows):
    book = openpyxl.Workbook()
    for row in rows:
        book.active.append(row)
    book.save(path)
    return path


def with_comma(value, places=3):
    return f"{value:.{places}f}".replace(".", ",")


def test_numbers_typed_as_text_with_a_decimal_comma_stand_beside_numbers(tmp_path):
    rows = [[kg, minutes, with_comma(x, 2)] for kg, minutes, x in WEIGHTS]
    made = convert(saved(tmp_path / "a.xlsx", [HEADER, *rows]), ABOUT, Choices())
    assert [hold.readings[0] for hold in made.experiment.holds] == [2.0, 4.0, 6.0]
    assert [list(hold.time_s) for hold in made.experiment.holds] == [[30.0, 60.0, 150.0]] * 3


def test_a_comma_in_text_that_may_be_either_is_asked_about_and_the_answer_leaves_numbers_alone(tmp_path):
    rows = [[kg, minutes, with_comma(x, 3)] for kg, minutes, x in WEIGHTS]
    path = saved(tmp_path / "a.xlsx", [HEADER, *rows])
    with pytest.raises(Undecided, match="column C .*: found '2,005', which is 2.005 or 2005"):
        convert(path, ABOUT, Choices())
    made = convert(path, ABOUT, Choices(decimal="comma"))
    assert [hold.readings[0] for hold in made.experiment.holds] == [2.005, 4.005, 6.005]
    assert [hold.time_s[0] for hold in made.experiment.holds] == [30.0, 30.0, 30.0]


def test_thousands_in_text_are_known_by_the_commas_of_others_and_numbers_have_a_point(tmp_path):
    rows = [[kg, minutes + 0.125, f"{100 * x:,.0f}".replace(",", ".")] for kg, minutes, x in WEIGHTS]
    rows = [[kg, minutes, f"1{x}" if "." in x else f"1.{x}"] for kg, minutes, x in rows]
    rows[0][2] = "1.200,5"
    header = ["Mass (kg)", "Time (min)", "Displacement (µm)"]
    made = convert(saved(tmp_path / "a.xlsx", [header, *rows]), ABOUT, Choices())
    assert [hold.readings[0] for hold in made.experiment.holds] == [1.2005, 1.4, 1.6]
    assert [hold.time_s[0] for hold in made.experiment.holds] == [37.5, 37.5, 37.5]


def test_text_with_either_sign_is_read_cell_by_cell(tmp_path):
    rows = [[kg, minutes, f"{x:.2f}" if kg > 0.25 else with_comma(x, 2)] for kg, minutes, x in WEIGHTS]
    rows = [[f"{kg:.3f}" if kg > 0.15 else kg, *others] for kg, *others in rows]
    made = convert(saved(tmp_path / "a.xlsx", [HEADER, *rows]), ABOUT, Choices())
    assert [hold.readings[0] for hold in made.experiment.holds] == [2.0, 4.0, 6.0]


def test_text_with_a_comma_is_refused_where_a_point_is_stated(tmp_path):
    rows = [[kg, minutes, with_comma(x, 2)] for kg, minutes, x in WEIGHTS]
    rows[4][2] = "4.01"
    with pytest.raises(Exception, match=r"column C .*: found '2,00', expected a number \(decimal point"):
        convert(saved(tmp_path / "a.xlsx", [HEADER, *rows]), ABOUT, Choices(decimal="point"))


def test_a_name_in_a_cell_merged_with_the_one_below_it_is_in_the_header(tmp_path):
    begin = datetime.datetime(2026, 11, 3, 9)
    rows = [
        ["Timestamp", "Stage", None, "Load cell", None],
        [None, "Position [mm]", "Moving", "Force [N]", "Temp [°C]"],
    ]
    for hold in (1, 2, 3):
        for time in (0, 30, 60):
            moment = begin + datetime.timedelta(seconds=200 * hold + time)
            rows.append([moment, hold, "no", 5 * hold - time / 100, 21.5])
    made = convert(saved(tmp_path / "a.xlsx", rows), ABOUT, Choices())
    assert [hold.setting for hold in made.experiment.holds] == [1.0, 2.0, 3.0]
    assert [row[2] for row in made.rows if row[3] is not None] == [0.0, 30.0, 60.0] * 3


def test_a_title_above_a_column_without_a_name_is_not_its_name(tmp_path):
    rows = [["Force test 7"], [None, "Displacement (mm)", "Time (s)", "Force (N)"]]
    rows += [
        [i, hold, time, 5 * hold - time / 100] for i, (hold, time) in enumerate((h, t) for h in (1, 2) for t in (0, 9))
    ]
    made = convert(saved(tmp_path / "a.xlsx", rows), ABOUT, Choices())
    assert [row[3] for row in made.rows] == [5.0, 4.91, 10.0, 9.91]


def test_an_option_with_a_name_of_several_words_is_quoted(tmp_path):
    book = openpyxl.Workbook()
    for sheet in (book.active, book.create_sheet("Werte 2")):
        sheet.append(HEADER)
        for row in WEIGHTS:
            sheet.append(row)
    book.active.title = "Werte"
    book.save(tmp_path / "a.xlsx")
    with pytest.raises(Undecided, match='expected --sheet Werte or --sheet "Werte 2" to say'):
        convert_all(tmp_path / "a.xlsx", ABOUT, Choices())


def test_a_time_goes_on_beyond_24_hours(tmp_path):
    book = openpyxl.Workbook()
    book.active.append(["Elapsed", "Displacement (mm)", "Force (N)"])
    for hold in (1, 2, 3):
        for hours in (0, 4):
            book.active.append([(10 * hold + hours) / 24, hold, 5 * hold - hours / 10])
            book.active.cell(book.active.max_row, 1).number_format = "hh:mm:ss"
    book.save(tmp_path / "a.xlsx")
    made = convert(tmp_path / "a.xlsx", ABOUT, Choices())
    assert [hold.start_s for hold in made.experiment.holds] == [0.0, 36000.0, 72000.0]
    assert [row[2] for row in made.rows if row[3] is not None] == [0.0, 14400.0] * 3
