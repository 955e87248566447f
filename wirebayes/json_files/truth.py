"""``truth.json``: what synthetic tests were made of."""

from typing import NotRequired, TypedDict

from wirebayes.json_files.values import Numbers
from wirebayes.result_warnings import Warned


class TrueWire(TypedDict):
    """The wire of one test; its setting errors, a value a hold, and its readings before sensor error and rounding.

    Under weights the errors are in N and the readings in mm.
    """

    material: str
    elastic_law: str
    history: str
    effects: list[str]
    parameters: dict[str, float]
    tension_ref_N: float
    typical_tension_N: float
    typical_hold_s: float
    setting_mm: NotRequired[Numbers]
    noise_free_N: NotRequired[list[Numbers]]
    setting_N: NotRequired[Numbers]
    noise_free_mm: NotRequired[list[Numbers]]


class TruthJson(Warned):
    """The whole file."""

    seed: int
    experiments: dict[str, TrueWire]
