"""What is tested: holds, benches (one wire on one machine), and rigs (the benches of one file)."""

from __future__ import annotations

import functools
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Index = NDArray[np.int64]

MATERIAL_PARAMETERS = ("k1", "B", "U", "k2", "N")


@dataclass(frozen=True)
class Hold:
    """One position held.

    Attributes
    ----------
    number : hold number in the file.
    displacement_mm : commanded displacement.
    times_s : reading times since the hold began, rising; empty when the hold was not recorded.
    duration_s : length of the hold.
    """

    number: int
    displacement_mm: float
    times_s: tuple[float, ...]
    duration_s: float


@dataclass(frozen=True)
class Warming:
    """Room temperature over elapsed time: a saturating rise and a slow wave."""

    start_C: float
    rise_C: float
    scale_s: float
    wave_C: float
    period_s: float
    phase: float

    def at(self, elapsed_s: Array) -> Array:
        """Temperature (C) at elapsed times (s), any shape."""
        wave = np.sin(2 * np.pi * elapsed_s / self.period_s + self.phase)
        return self.start_C + self.rise_C * (1 - np.exp(-elapsed_s / self.scale_s)) + self.wave_C * wave


@dataclass(frozen=True)
class Wire:
    """True parameters of one material (units of physics: N, mm, s); `B` belongs to the rig's first length of it."""

    k1: float
    B: float
    U: float
    k2: float
    N: float


@dataclass(frozen=True)
class Bench:
    """One sample on the machine: protocol, preload and noise."""

    name: str
    material: str
    length_mm: float
    holds: tuple[Hold, ...]
    preload_mm: float
    sensor_sd: float
    setting_sd: float
    resolution_N: float | None = None
    warming: Warming | None = None

    @functools.cached_property
    def starts_s(self) -> Array:
        """Elapsed time at which each hold begins, shape (holds,)."""
        return np.concatenate([[0.0], np.cumsum([hold.duration_s for hold in self.holds])[:-1]])

    @functools.cached_property
    def displacements_mm(self) -> Array:
        """Commanded displacements, shape (holds,)."""
        return np.array([hold.displacement_mm for hold in self.holds])

    @functools.cached_property
    def directions(self) -> Array:
        """Direction of the move before each hold, +1 or -1, shape (holds,); the first is +1."""
        signs = np.sign(np.diff(self.displacements_mm, prepend=min(0.0, self.displacements_mm[0] - 1.0)))
        for j in range(1, len(signs)):
            if signs[j] == 0:
                signs[j] = signs[j - 1]
        return signs

    @functools.cached_property
    def hold_of_reading(self) -> Index:
        """Index of the hold of each reading, shape (readings,)."""
        return np.concatenate([np.full(len(h.times_s), j, dtype=np.int64) for j, h in enumerate(self.holds)])

    @functools.cached_property
    def reading_times_s(self) -> Array:
        """Time in its hold of each reading, shape (readings,)."""
        return np.concatenate([np.asarray(h.times_s, dtype=float) for h in self.holds])

    @property
    def n_readings(self) -> int:
        """Number of readings."""
        return len(self.reading_times_s)


@dataclass(frozen=True)
class Rig:
    """All benches of one file and the true material parameters; benches of one material share them."""

    protocol: str
    benches: tuple[Bench, ...]
    wires: dict[str, Wire]
    tau_ref: dict[str, float] = field(default_factory=dict)  # N, of powers of the tension

    @functools.cached_property
    def materials(self) -> tuple[str, ...]:
        """Material names in order of appearance."""
        return tuple(dict.fromkeys(bench.material for bench in self.benches))

    @functools.cached_property
    def typical_hold_s(self) -> float:
        """Median duration of all holds, s."""
        return float(np.median([hold.duration_s for bench in self.benches for hold in bench.holds]))

    def reference_length(self, material: str) -> float:
        """Length (mm) at which the material's `B` is stated: that of its first bench."""
        return next(bench.length_mm for bench in self.benches if bench.material == material)

    @functools.cached_property
    def theta(self) -> Array:
        """True plain parameters: five for each material, then one preload for each bench, shape (d,)."""
        values = [getattr(self.wires[m], name) for m in self.materials for name in MATERIAL_PARAMETERS]
        return np.array(values + [bench.preload_mm for bench in self.benches])

    @functools.cached_property
    def n_holds(self) -> int:
        """Number of holds over all benches, unrecorded ones included."""
        return sum(len(bench.holds) for bench in self.benches)

    @functools.cached_property
    def bench_slices(self) -> tuple[slice, ...]:
        """Where each bench's readings lie in the rig's stacked readings."""
        edges = np.cumsum([0] + [bench.n_readings for bench in self.benches])
        return tuple(slice(int(a), int(b)) for a, b in zip(edges[:-1], edges[1:], strict=True))
