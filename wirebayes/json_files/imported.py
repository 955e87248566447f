"""``import.json``: what was understood of raw files of a bench."""

from typing import Literal

from wirebayes.result_warnings import Warned


class ImportedExperiment(Warned):
    """The experiment out of one file; `notes` say what was recognised and done."""

    raw: str
    length_mm: float
    material: str
    control: Literal["displacement", "force"]
    resolution_N: float | None
    resolution_mm: float | None
    holds: int
    readings: int
    notes: list[str]


class ImportJson(Warned):
    """The whole file."""

    experiments: dict[str, ImportedExperiment]
