"""Columns that are named by nothing but their unit, as a sketch for a microcontroller prints them."""

from pathlib import Path

import numpy as np
import pytest

import wirebayes as wb
from wirebayes.errors import InputError

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
