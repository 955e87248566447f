"""``truth.json``: what synthetic tests were made of."""

from typing import TypedDict

from wirebayes.json_files.values import Numbers
from wirebayes.notice import Warned


class TrueWire(TypedDict):
    """The wire of one test; its setting errors, a value a hold, and its tensions before sensor error and rounding."""

    material: str
    elastic_law: str
    history: str
    effects: list[str]
    parameters: dict[str, float]
    tension_ref_N: float
    setting_mm: Numbers
    noise_free_N: list[Numbers]


class TruthJson(Warned):
    """The whole file."""

    seed: int
    experiments: dict[str, TrueWire]
