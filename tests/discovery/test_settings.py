"""The page on thresholds says what the search goes by: every number of the settings, and no other value."""

import re
from pathlib import Path

import numpy as np
import pytest

from wirebayes.discovery import settings
from wirebayes.discovery.settings import ALPHA, ALPHA_AFTER, REACH, RETESTS, SIMULATIONS, Settings

PAGE = Path(__file__).parents[2] / "docs" / "thresholds.rst"


def documented() -> dict[str, float | tuple[float, ...]]:
    """Names and values of the list."""
    found: dict[str, float | tuple[float, ...]] = {}
    for line in re.findall(r"^``\w+`` = .+$", PAGE.read_text(encoding="utf-8"), re.M):
        for name, text in re.findall(r"``(\w+)`` = (\d[\d., ]*)", line):
            values = tuple(map(float, text.strip(", ").split(", ")))
            found[name] = values if len(values) > 1 else values[0]
    return found


def test_every_threshold_is_documented_with_its_value() -> None:
    other = ("PLAIN_SPEC", "CATALOGUE")
    numbers = {name: value for name, value in vars(settings).items() if name.isupper() and name not in other}
    assert documented() == numbers


def test_numbers_are_what_the_page_says_of_them() -> None:
    def error(p: float, simulations: int) -> float:
        return float(np.sqrt(p * (1.0 - p) / simulations))

    assert error(ALPHA, SIMULATIONS) == pytest.approx(0.006, abs=5e-4)
    assert error(ALPHA_AFTER, RETESTS) == pytest.approx(0.01, abs=5e-4)
    assert 0.01 < np.exp(-REACH) < 0.02
    assert Settings().simulations == SIMULATIONS
