"""Hints for unknown words: a unit is never taken for a typing mistake of another."""

import pytest

from wirebayes.io.readings import OPTIONAL, REQUIRED
from wirebayes.strict.hint import hint

COLUMNS = (*REQUIRED, *OPTIONAL)


@pytest.mark.parametrize(
    ("word", "message"),
    [
        ("tension_kgf", "1 kgf = 9.80665 N; convert it to tension_N"),
        ("tension_kN", "1 kN = 1000 N"),
        ("tension [kN]", "1 kN = 1000 N"),
        ("tension_mN", "1 mN = 0.001 N"),
        ("tension_MN", "1 MN = 1000000 N"),
        ("tensionkN", "1 kN = 1000 N"),
        ("tension (lbf)", "1 lbf = 4.448221615 N"),
        ("displacement_m", "1 m = 1000 mm; convert it to displacement_mm"),
        ("displacement_um", "1 um = 0.001 mm"),
        ("displacement_in", "1 in = 25.4 mm"),
        ("time_ms", "1 ms = 0.001 s; convert it to time_s"),
        ("time_min", "1 min = 60 s"),
        ("temperature_K", "°C = K - 273.15; convert it to temperature_C"),
        ("temperature_F", "°C = (°F - 32) / 1.8"),
    ],
)
def test_another_unit_is_named_with_its_factor(word, message):
    meant = hint(word, COLUMNS)
    assert message in meant
    assert "did you mean" not in meant


@pytest.mark.parametrize("word", ["tension_mn", "tension_V", "displacement_px", "time_samples", "force_kN", "hold_mm"])
def test_a_unit_that_is_not_known_gets_no_suggestion_in_another(word):
    assert hint(word, COLUMNS) in ("", " (did you mean hold?)" if word == "hold_mm" else "")


@pytest.mark.parametrize(
    ("word", "meant"),
    [
        ("tensoin_N", "tension_N"),
        ("tension_n", "tension_N"),
        ("Tension (N)", "tension_N"),
        ("displ_mm", "displacement_mm"),
        ("time", "time_s"),
        ("holt", "hold"),
        ("temprature_C", "temperature_C"),
    ],
)
def test_typing_mistakes_are_still_recognised(word, meant):
    assert hint(word, COLUMNS) == f" (did you mean {meant}?)"


@pytest.mark.parametrize(
    ("word", "message"),
    [
        ("x_mm", "1 mm = 0.001 m; convert it to x_m"),
        ("y_in", "1 in = 0.0254 m; convert it to y_m"),
        ("joint_2_mm", "1 mm = 0.001 m; convert it to joint_2_m"),
        ("roll_deg", "1 deg = 0.01745329252 rad; convert it to roll_rad"),
    ],
)
def test_columns_of_a_robot_are_in_metres_and_radians(word, message):
    assert message in hint(word, ["time_s", "x_m", "y_m", "z_m", "joint_1_m", "joint_2_m", "roll_rad"])


def test_words_without_units_are_compared_as_before():
    assert hint("wire_a", ["wire_b", "kite"]) == " (did you mean wire_b?)"
    assert hint("kite-15m", ["kite-1.5m"]) == " (did you mean kite-1.5m?)"
