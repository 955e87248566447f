"""Logs of dead weights: masses hung on a wire and the dial gauge beside it, and tables that are wide."""

import pytest

import wirebayes as wb
from wirebayes.errors import InputError

ROWS = [
    (step, mass, 60 * minute, 1.0 * step + 0.1 * minute) for step, mass in ((1, 0.2), (2, 0.4)) for minute in (0, 1, 5)
]


def written(path, header, cells):
    path.write_text("\n".join([header, *(",".join(map(str, row)) for row in cells)]) + "\n")
    return path


def test_masses_and_a_dial_gauge_are_known_by_their_names(tmp_path):
    file = written(tmp_path / "log.csv", "step,mass (kg),time (s),dial (mm)", ROWS)
    wb.import_bench(file, length_mm=1500, material="Kevlar", output=tmp_path / "out")
    (test,) = wb.read_experiments(tmp_path / "out" / "log.toml")
    assert test.control == "force"
    assert [hold.setting for hold in test.recorded_holds] == pytest.approx([0.2 * 9.80665, 0.4 * 9.80665])


def test_a_rest_in_which_nothing_was_read_is_no_reading(tmp_path):
    """An empty displacement is filled where it was set, as in merged cells; under weights it was not read."""
    rows = [*ROWS[:3], (2, 0.01, 400, ""), *((3, *row[1:]) for row in ROWS[3:])]
    file = written(tmp_path / "log.csv", "step,mass (kg),time (s),dial (mm)", rows)
    with pytest.raises(InputError, match=r"line 5, column 4 \(dial \(mm\)\): found an empty cell, expected a reading"):
        wb.import_bench(file, length_mm=1500, material="Kevlar", output=tmp_path / "out")


def test_a_column_that_speaks_of_a_force_comes_before_a_mass(tmp_path):
    rows = [(step, mass, time, float(step), 3.0 * step - 0.001 * time) for step, mass, time, _ in ROWS]
    file = written(tmp_path / "log.csv", "step,mass (kg),time (s),Position (mm),Load (N)", rows)
    imported = wb.import_bench(file, length_mm=1500, material="Kevlar", output=tmp_path / "out")
    assert "tension from 'Load (N)'" in str(imported)


def test_a_table_with_a_column_for_each_time_is_read_and_two_sensors_are_none(tmp_path):
    file = written(tmp_path / "wide.csv", "Position (mm),F 0 s (N),F 10 s (N),F 60 s (N)", [(1, 1.2, 1.1, 1.0)])
    (made,) = wb.import_bench(file, length_mm=800, material="rope", output=tmp_path / "out").experiments
    assert made.holds[0].time_s.tolist() == [0.0, 10.0, 60.0] and made.holds[0].readings.tolist() == [1.2, 1.1, 1.0]
    two = written(tmp_path / "two.csv", "Position (mm),A (N),B (N)", [(1, 1.2, 1.1)])
    with pytest.raises(InputError, match="found no column of time"):
        wb.import_bench(two, length_mm=800, material="rope", output=tmp_path / "two")
