"""From tension to reading, without noise."""

from __future__ import annotations

import numpy as np

from .rig import Array, Bench
from .state import Effects

_SETTLE_S = 2.0  # between the move and the first node, spent at the first tension


def lagging(tension: Array, grid_s: Array, shown: Array, lag_s: Array) -> Array:
    """First-order sensor: r' = (tension - r) / lag, exact for tension linear between nodes.

    Parameters
    ----------
    tension : shape (n, G); grid_s : (G,); shown : what the sensor showed before the hold, (n,); lag_s : (n,).

    Returns
    -------
    shape (n, G).
    """
    lag = np.maximum(lag_s, 1e-3)
    out = np.empty_like(tension)
    out[:, 0] = tension[:, 0] + (shown - tension[:, 0]) * np.exp(-_SETTLE_S / lag)
    for i, step in enumerate(np.diff(grid_s)):
        slope = (tension[:, i + 1] - tension[:, i]) / step
        trail = (out[:, i] - tension[:, i] + lag * slope) * np.exp(-step / lag)
        out[:, i + 1] = tension[:, i + 1] - lag * slope + trail
    return out


def sticking(tension: Array, shown: Array, width: Array) -> Array:
    """Play in the sensor: the reading stays until the tension is more than `width` (n,) away; shapes as `lagging`."""
    out = np.empty_like(tension)
    for i in range(tension.shape[1]):
        shown = np.clip(shown, tension[:, i] - width, tension[:, i] + width)
        out[:, i] = shown
    return out


def readings(bench: Bench, tension: Array, fx: Effects) -> Array:
    """Noise-free readings (N), shape (n, readings), of true tensions at the reading times, same shape."""
    y = tension
    t, j = bench.reading_times_s, bench.hold_of_reading
    elapsed = bench.starts_s[j] + t
    if fx.on("guide_friction"):
        y = y * (1 + fx["guide_friction"][:, None] * bench.directions[j])
    if fx.on("clamp_transient"):
        y = y * (1 + fx["clamp_transient"][:, None] * np.exp(-t / fx.shape("clamp_transient.time_s")[:, None]))
    if fx.on("sensor_nonlinearity"):
        y = y + fx["sensor_nonlinearity"][:, None] * y * y
    if fx.on("gain_step"):
        y = y * (1 + fx["gain_step"][:, None] * (j >= fx.shape("gain_step.hold")[:, None]))
    if fx.on("zero_step"):
        y = y + fx["zero_step"][:, None] * (j >= fx.shape("zero_step.hold")[:, None])
    if fx.on("sensor_drift"):
        y = y + fx["sensor_drift"][:, None] * elapsed
    if fx.on("tension_wave"):
        period, phase = fx.shape("tension_wave.period_s")[:, None], fx.shape("tension_wave.phase")[:, None]
        y = y + fx["tension_wave"][:, None] * np.sin(2 * np.pi * elapsed / period + phase)
    if fx.on("passing_draught"):
        centre, width = fx.shape("passing_draught.centre_s"), fx.shape("passing_draught.width_s")
        y = y + fx["passing_draught"][:, None] * np.exp(-0.5 * ((elapsed - centre[:, None]) / width[:, None]) ** 2)
    return y
