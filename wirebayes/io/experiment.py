"""Tests of one wire each, read from TOML and CSV files and checked completely."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from wirebayes.errors import InputError
from wirebayes.io.readings import Hold
from wirebayes.numeric.frozen import frozen
from wirebayes.numeric.typing import Floats
from wirebayes.sentences import counted
from wirebayes.wire.protocol import Control, Protocol


def folder_key(name: str) -> str:
    """What the names of folders that are one folder have in common.

    File systems of Windows and macOS do not tell upper case from lower case, and Windows drops periods at the end.
    """
    return name.casefold().rstrip(".")


@dataclass(frozen=True, eq=False)
class Experiment:
    """One test of one wire sample.

    Attributes
    ----------
    name, material : str
    length_mm : float
        Zero-tension length before the test.
    resolution : float
        Step to which readings were rounded, in N, or in mm where the tension is set; 0.0 when not stated.
    holds : tuple of Hold
        In order, the unrecorded ones at their place.
    source : Path
        The TOML file it was read from.
    priors : dict
        ``[prior]`` tables by parameter name, as written: the file's, then the experiment's own over them.
    prior_lines : dict
        The line in `source` on which each of them stands.
    control : {"displacement", "force"}
        What was set in each hold; the other was read.
    preload_mm : float, optional
        The stretch at displacement zero, where it is known.
    told : frozenset of str
        Parameters whose prior is what readings of other materials say of them, and nothing that was stated.

    Examples
    --------
    >>> kite.first(5).tension().shape
    (6, 5)
    """

    name: str
    material: str
    length_mm: float
    resolution: float
    holds: tuple[Hold, ...]
    source: Path
    priors: dict[str, dict[str, Any]] = field(default_factory=dict)
    prior_lines: dict[str, int] = field(default_factory=dict)
    control: Control = "displacement"
    preload_mm: float | None = None
    told: frozenset[str] = frozenset()

    def __repr__(self) -> str:
        holds, readings = len(self.recorded_holds), sum(hold.time_s.size for hold in self.recorded_holds)
        set_ = "" if self.control == "displacement" else ", tensions set"
        many = f"{counted(holds, 'hold')}, {counted(readings, 'reading')}"
        return f"Experiment({self.name}: {self.length_mm:g} mm of {self.material}, {many}{set_})"

    @property
    def resolution_N(self) -> float:
        """Step to which tensions were rounded; 0.0 where they were set."""
        return self.resolution if self.control == "displacement" else 0.0

    @property
    def recorded_holds(self) -> tuple[Hold, ...]:
        """The holds that have readings."""
        return tuple(hold for hold in self.holds if hold.recorded)

    @property
    def material_folder(self) -> str:
        """The material as a folder name: spaces become hyphens."""
        return self.material.replace(" ", "-")

    def protocol(self) -> Protocol:
        """What was done, padded to (H, R) arrays."""
        first = next((hold.temperature_C[0] for hold in self.holds if hold.temperature_C is not None), None)
        return protocol_of(self.holds, self.length_mm, first)

    def readings(self) -> Floats:
        """What was read, (H, R), padded with 0 as `protocol` is: tensions in N, or displacements in mm."""
        read = _padded([hold.readings for hold in self.holds])
        return np.pad(read, [(0, 0), (0, self.protocol().mask.shape[1] - read.shape[1])])

    def tension(self) -> Floats:
        """Tensions, (H, R) in N, padded with 0 as `protocol` is: as read, or as set."""
        if self.control == "displacement":
            return self.readings()
        return self.protocol().mask * np.array([hold.setting for hold in self.holds])[:, None]

    def plot(self, axes: Any = None) -> Any:
        """Draw what was read against the time of the whole test.

        Parameters
        ----------
        axes : matplotlib.axes.Axes, optional
            Where to draw; new ones when left out.

        Returns
        -------
        matplotlib.axes.Axes

        Examples
        --------
        >>> kite.plot().get_ylabel()
        'tension, N'
        """
        if axes is None:
            import matplotlib.pyplot as plt  # only where it is needed

            axes = plt.subplots()[1]
        for hold in self.recorded_holds:
            axes.plot(hold.start_s + hold.time_s, hold.readings, "o-", color="#30506d", ms=3, lw=1)
        axes.set_xlabel("time of the test, s")
        axes.set_ylabel("tension, N" if self.control == "displacement" else "displacement, mm")
        axes.set_title(self.name)
        return axes

    def train(self, holds: int) -> "Experiment":
        """The first `holds` recorded holds, and the unrecorded ones before the last of them.

        Raises
        ------
        InputError
            When there are not that many.
        """
        places = [place for place, hold in enumerate(self.holds) if hold.recorded]
        if not 1 <= holds <= len(places):
            raise InputError(
                f"{self.source}, experiment {self.name}: found --train-holds {holds}, "
                f"expected 1 to {len(places)}, the recorded holds"
            )
        return replace(self, holds=self.holds[: places[holds - 1] + 1])

    def without_unrecorded(self) -> "Experiment":
        """The same test as if the unrecorded holds had never been."""
        return replace(self, holds=in_sequence(self.recorded_holds))

    def first(self, holds: int) -> "Experiment":
        """`train`, for what a user wants fitted.

        Raises
        ------
        InputError
            When there are not that many holds, or too few readings in them for a fit.
        """
        trained = self.train(holds)
        if not enough(trained.recorded_holds):
            raise InputError(
                f"{self.source}, experiment {self.name}: found {holds_and_readings(trained.recorded_holds)} in the "
                f"first {holds} of {counted(len(self.recorded_holds), 'recorded hold')}, expected {ENOUGH}"
            )
        return trained

    @property
    def data_hash(self) -> str:
        """SHA-256 of everything measured (not of the priors, nor of how the files spell it)."""
        content = [self.name, self.material, self.length_mm, self.resolution, self.control]
        holds = [
            [hold.number, hold.setting, hold.duration_s, hold.time_s.tolist(), hold.readings.tolist()]
            + ([] if hold.temperature_C is None else [hold.temperature_C.tolist()])
            for hold in self.holds
        ]
        return hashlib.sha256(json.dumps([content, holds]).encode()).hexdigest()


LEAST_READINGS = 3  # level, slope and curvature of one relaxation
ENOUGH = f"at least one recorded hold and {LEAST_READINGS} readings in all"


def by_material(experiments: Sequence[Experiment]) -> dict[str, list[Experiment]]:
    """The experiments of each material, in the order given."""
    materials: dict[str, list[Experiment]] = {}
    for experiment in experiments:
        materials.setdefault(experiment.material, []).append(experiment)
    return materials


def enough(holds: Sequence[Hold]) -> bool:
    """True where there are readings enough for a fit."""
    return sum(hold.time_s.size for hold in holds) >= LEAST_READINGS


def holds_and_readings(holds: Sequence[Hold]) -> str:
    """How many holds and readings there are, in words."""
    recorded = [hold.time_s.size for hold in holds if hold.recorded]
    return f"{counted(len(recorded), 'hold')} with {counted(sum(recorded), 'reading')}"


def protocol_of(holds: tuple[Hold, ...], length_mm: float, reference_C: float | None) -> Protocol:
    """Pad holds to rectangular arrays.

    Parameters
    ----------
    holds : tuple of Hold
    reference_C : float or None
        Temperature from which warming counts; without it there is no warming.

    Returns
    -------
    Protocol
        With H holds and R columns, R the largest number of readings in a hold.
    """
    numbers = [-1 if hold.number is None else hold.number for hold in holds]
    read = [np.ones(hold.time_s.size) for hold in holds]
    warming = None
    if reference_C is not None:
        reference_C = float(reference_C)
        above = []
        for hold in holds:
            logged = hold.temperature_C
            above.append(frozen([]) if logged is None else logged - reference_C)
        warming = _padded(above)
    return Protocol(
        length_mm=length_mm,
        setting=np.array([hold.setting for hold in holds]),
        time_s=_padded([hold.time_s for hold in holds]),
        mask=_padded(read) > 0,
        duration_s=np.array([hold.duration_s for hold in holds]),
        number=np.array(numbers, dtype=np.int64),
        warming_K=warming,
        reference_C=reference_C,
        control=holds[0].control if holds else "displacement",
    )


def _padded(rows: list[Floats]) -> Floats:
    array = np.zeros((len(rows), max((row.size for row in rows), default=0)))
    for target, row in zip(array, rows, strict=True):
        target[: row.size] = row
    return array


def in_sequence(holds: tuple[Hold, ...]) -> tuple[Hold, ...]:
    starts = np.concatenate([[0.0], np.cumsum([hold.duration_s for hold in holds])])
    return tuple(replace(hold, start_s=float(start)) for hold, start in zip(holds, starts, strict=False))
