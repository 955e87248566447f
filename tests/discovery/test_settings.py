"""The page on thresholds says what the search goes by: every number of the settings, and no other value."""

import re
from pathlib import Path

import numpy as np
import pytest

from wirebayes.discovery import settings
from wirebayes.discovery.settings import ALPHA, ALPHA_AFTER, REACH, RETESTS, SIMULATIONS, Settings

PAGE = Path(__file__).parents[2] / "docs" / "thresholds.rst"


def documented() -> dict[str, float | tuple[float, ...]]:
    """Names and values of the table."""
    found: dict[str, float | tuple[float, ...]] = {}
    for names, text in re.findall(r"^   \* - (``.+``)\n     - (.+)$", PAGE.read_text(encoding="utf-8"), re.M):
        keys, values = re.findall(r"``(\w+)``", names), tuple(map(float, text.split(", ")))
        found |= {keys[0]: values} if len(keys) == 1 < len(values) else dict(zip(keys, values, strict=True))
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
