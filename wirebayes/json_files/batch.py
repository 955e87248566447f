"""``batch.json``: a row for each of many experiments; ``row.json`` in an experiment's folder is its row."""

from typing import TypedDict

from wirebayes.json_files.discovery import Verdict
from wirebayes.json_files.values import Quantiles, Statistics
from wirebayes.result_warnings import Warned


class AtTypical(TypedDict):
    """B and k2 in a specimen's own scales, as specimens are compared: creep, mm, at a tension, and k2 t^N after a time.

    B and k2 themselves are those at one newton and after one second, whatever these are to the wire.
    """

    tension_N: float
    time_s: float
    B: Quantiles
    k2: Quantiles


class FitColumns(Warned):
    """What a fit adds to a row."""

    converged: bool | None
    parameters: dict[str, Statistics]
    at_typical: AtTypical | None
    p_global: float | None
    check: str | None


class DiscoveryColumns(FitColumns):
    """What a search for missing effects adds to a row."""

    verdict: Verdict | None
    effects: list[str]
    best_effect: str | None


class Row(DiscoveryColumns):
    """One experiment; None where nothing was fitted or looked for.

    `control` says which units the parameters of the bench have: ``sensor_sd`` is in N where displacements are set, and
    in mm where tensions are.
    """

    name: str
    material: str | None
    file: str
    length_mm: float | None
    control: str | None
    holds: int | None
    readings: int | None
    error: str | None


class OutlierRow(TypedDict):
    """A parameter of a specimen that lies far from those of the others of its material.

    `value` is the specimen's posterior median, `median` that of all specimens of the material; `z` robust standard
    deviations lie between them. For B these are of the creep in mm per m of length at a tension, for k2 of the exponent
    k2 t^N after a time; the sentence names which. `specimens` of the material were compared.
    """

    experiment: str
    material: str
    parameter: str
    value: float
    median: float
    z: float
    specimens: int
    sentence: str


class BatchJson(Warned):
    """The whole file."""

    version: int
    experiments: list[Row]
    outliers: list[OutlierRow]
