"""Noise of the judge's own: exact setting errors, sensor errors, rounding, now and then a gross error."""

from __future__ import annotations

import numpy as np

from .generator import Members, simulate
from .rig import Array, Rig

LAWS = ("gaussian", "heavy", "gross")
HEAVY_DOF = 8.0


def setting_errors(rig: Rig, rng: np.random.Generator) -> Array:
    """Position errors (mm) of all holds of all benches, shape (holds,)."""
    return np.concatenate([rng.normal(0.0, bench.setting_sd, len(bench.holds)) for bench in rig.benches])


def sensor_errors(rig: Rig, rng: np.random.Generator, law: str) -> Array:
    """Errors (N) of all readings, shape (R,), with the sensor's standard deviation whatever the law.

    `heavy`: Student-t with 8 degrees of freedom. `gross`: Gaussian, and one reading of each bench 8 to 20 sd off.
    """
    parts = []
    for bench in rig.benches:
        if law == "heavy":
            unit = rng.standard_t(HEAVY_DOF, bench.n_readings) * np.sqrt((HEAVY_DOF - 2) / HEAVY_DOF)
        else:
            unit = rng.normal(size=bench.n_readings)
        if law == "gross":
            unit[rng.integers(bench.n_readings)] += rng.choice([-1, 1]) * rng.uniform(8, 20)
        parts.append(unit * bench.sensor_sd)
    return np.concatenate(parts)


def rounded(rig: Rig, y: Array) -> Array:
    """Readings (N) as shown, shape (R,): rounded to each bench's resolution."""
    shown = y.copy()
    for bench, part in zip(rig.benches, rig.bench_slices, strict=True):
        if bench.resolution_N is not None:
            shown[part] = np.round(y[part] / bench.resolution_N) * bench.resolution_N
    return shown


def measure(rig: Rig, members: Members | None, rng: np.random.Generator, law: str = "gaussian") -> Array:
    """One measured data set (N), shape (R,): setting errors go through the whole non-linear simulation."""
    exact = simulate(rig, members=members, eta_mm=setting_errors(rig, rng))[0]
    return rounded(rig, exact + sensor_errors(rig, rng, law))
