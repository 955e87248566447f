"""One reader of keys and one of tables: each limit at its edge, and every complaint with its place."""

import re
from pathlib import Path

import numpy as np
import pytest

from wirebayes.errors import InputError
from wirebayes.strict.columns import columns_table
from wirebayes.strict.table import Header, Numbers, csv_table
from wirebayes.strict.toml_keys import LARGEST_NUMBER, Keys

FILE = Path("file.toml")


def keys(text):
    return Keys.of_file(FILE, text)


@pytest.mark.parametrize(("value", "good"), [("0", False), ("1e-9", True), ("1e12", True), ("1.1e12", False)])
def test_a_number_keeps_its_limits(value, good):
    table = keys(f"mass_kg = {value}\n")
    if good:
        assert table.number("mass_kg", above=0) == float(value)
        return
    with pytest.raises(InputError, match=r"^file.toml, line 1, key mass_kg: found .*, expected a number above 0"):
        table.number("mass_kg", above=0)


@pytest.mark.parametrize("value", ["true", "nan", "inf", '"1"', "[1]", "1" + "0" * 400])
def test_what_is_no_finite_number_is_none(value):
    with pytest.raises(InputError, match=re.escape(f"expected a number of at most {LARGEST_NUMBER:.0e} in size")):
        keys(f"x = {value}\n").number("x")


def test_a_key_that_nobody_asked_for_is_refused_with_its_line():
    table = keys("known = 1\n[inner]\na = 1\nb = 2\n")
    table.number("known")
    inner = table.inside("inner")
    table.finish()
    inner.number("a")
    with pytest.raises(InputError, match=r"^file.toml, line 4, key inner.b: found an unknown key.*, expected only a$"):
        inner.finish()


def test_tables_of_a_list_are_counted_and_found_by_line():
    text = "[[leg]]\nx = 1\n[[leg]]\nx = -1\n"
    with pytest.raises(InputError, match=r"^file.toml, line 4, leg 2, key x: found -1, expected"):
        [leg.number("x", least=0) for leg in keys(text).tables("leg", least=2)]
    with pytest.raises(InputError, match=r"found 1 \[\[leg\]\], expected at least two \[\[leg\]\]"):
        keys("[[leg]]\nx = 1\n").tables("leg", least=2)


HEADER = Header(("a", "b"), (("x", "y"), ("note",)))


@pytest.mark.parametrize(
    ("head", "message"),
    [
        ("a,b,x", "line 1: found no column y, expected a header of a,b (and optionally x…y, note)"),
        ("a,c", "line 1, column 2: found 'c'"),
        ("a,a,b", "line 1, column 2: found a a second time"),
        ("b", "line 1: found no column a"),
    ],
)
def test_a_header_is_checked(head, message):
    with pytest.raises(InputError) as caught:
        csv_table(Path("log.csv"), f"{head}\n").check_header(HEADER)
    assert str(caught.value).startswith(f"log.csv, {message}")


def test_cells_are_numbers_of_their_column_and_empty_lines_count():
    table = csv_table(Path("log.csv"), 'a,b\n\n"1", 2\n3,\n')
    kinds = {"a": Numbers("a whole number", whole=True), "b": Numbers(empty=True)}
    np.testing.assert_array_equal(table.numbers(kinds.get), [[1.0, 2.0], [3.0, np.nan]])
    with pytest.raises(InputError, match=r"^log.csv, line 4, column 2 \(b\): found an empty cell, expected a number"):
        table.numbers(lambda name: Numbers())
    with pytest.raises(InputError, match=r"^log.csv, line 3, column 1 \(a\): found '1', expected less"):
        table.numbers(lambda name: Numbers("less", most=0.0))


def test_columns_in_memory_are_the_same_table_without_lines():
    table = columns_table({"a": [1, 2], "b": [0.5, np.nan]}, Path("columns"), lambda name: name == "b")
    assert table.rows == [["1", "0.5"], ["2", ""]]
    with pytest.raises(InputError, match=r"^columns, row 1 \(from 0\), column b: found an empty cell"):
        table.numbers(lambda name: Numbers())
    with pytest.raises(InputError, match="^columns, columns: found 'c', expected a header of a,b"):
        columns_table({"a": [1], "b": [1], "c": [1]}, Path("columns"), lambda name: False).check_header(HEADER)
