"""``import.json``: what was understood of raw files of a bench."""

from typing import TypedDict


class ImportedExperiment(TypedDict):
    """The experiment out of one file; `notes` say what was recognised and done."""

    raw: str
    length_mm: float
    material: str
    resolution_N: float | None
    holds: int
    readings: int
    notes: list[str]
    warnings: list[str]


class ImportJson(TypedDict):
    """The whole file."""

    experiments: dict[str, ImportedExperiment]
