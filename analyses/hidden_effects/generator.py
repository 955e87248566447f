"""Noise-free readings of a rig: the chain of holds, hold by hold, for a batch of parameters and effects at once."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from .chain import Carried, Material, grow
from .creep import time_grid
from .elastic import natural_length, positions, tension
from .instrument import lagging, readings, sticking
from .rig import MATERIAL_PARAMETERS, Array, Bench, Index, Rig
from .state import Effects

SLOW = ("superposition", "sensor_lag", "sensor_hysteresis", "second_relaxation")  # rows with these are simulated apart
PER_LENGTH = ("second_relaxation", "steady_creep")  # elongations: they scale with the sample's length


@dataclass(frozen=True)
class Members:
    """Effects of a batch on a rig: amplitudes (n, benches) by name, shape constants (n,) by `name.constant`."""

    n: int
    amplitudes: dict[str, Array]
    shapes: dict[str, Array]

    def rows(self, index: Index) -> Members:
        """The chosen rows; effects neutral in all of them are dropped."""
        kept = {name: value[index] for name, value in self.amplitudes.items() if np.any(value[index] != 0)}
        return Members(len(index), kept, {key: value[index] for key, value in self.shapes.items()})


def plain_members(n: int) -> Members:
    """A batch without effects."""
    return Members(n, {}, {})


def simulate(
    rig: Rig, theta: Array | None = None, members: Members | None = None, eta_mm: Array | None = None
) -> Array:
    """Noise-free readings (N) of a batch.

    Parameters
    ----------
    theta : plain parameters in the order of `Rig.theta`, shape (n, d) or (d,); the truth when left out.
    members : effects of each row; none when left out.
    eta_mm : setting errors of all holds of all benches, shape (n, holds) or (holds,); none when left out.

    Returns
    -------
    shape (n, readings), benches one after the other.
    """
    theta = np.atleast_2d(rig.theta if theta is None else theta)
    eta = np.zeros((1, rig.n_holds)) if eta_mm is None else np.atleast_2d(eta_mm)
    n = max(len(theta), len(eta), 1 if members is None else members.n)
    theta, eta = np.broadcast_to(theta, (n, theta.shape[1])), np.broadcast_to(eta, (n, eta.shape[1]))
    members = plain_members(n) if members is None else members
    slow = np.zeros(n, dtype=bool)
    for name in set(SLOW) & set(members.amplitudes):
        slow |= np.any(members.amplitudes[name] != 0, axis=1)
    out = np.empty((n, rig.bench_slices[-1].stop))
    for part in (np.flatnonzero(slow), np.flatnonzero(~slow)):
        if len(part):
            out[part] = _simulate(rig, theta[part], members.rows(part), eta[part])
    return out


def with_reference(rig: Rig) -> Rig:
    """The rig with the reference tension of each material: geometric mean of its plain, noise-free tensions."""
    y = simulate(rig)[0]
    reference = {}
    for material in rig.materials:
        parts = [y[part] for b, part in zip(rig.benches, rig.bench_slices, strict=True) if b.material == material]
        values = np.concatenate(parts)
        reference[material] = float(np.exp(np.log(values[values > 0]).mean())) if np.any(values > 0) else 1.0
    return dataclasses.replace(rig, tau_ref=reference)


def _simulate(rig: Rig, theta: Array, members: Members, eta: Array) -> Array:
    blocks = []
    first_hold = 0
    for b, bench in enumerate(rig.benches):
        holds = slice(first_hold, first_hold + len(bench.holds))
        first_hold = holds.stop
        scale = bench.length_mm / rig.reference_length(bench.material)
        amplitudes = {
            name: value[:, b] * (scale if name in PER_LENGTH else 1.0)
            for name, value in members.amplitudes.items()
            if np.any(value[:, b] != 0)
        }
        fx = Effects(len(theta), amplitudes, members.shapes)
        preload = theta[:, len(MATERIAL_PARAMETERS) * len(rig.materials) + b]
        blocks.append(_bench(bench, _material(rig, bench, theta, fx, scale), preload, fx, eta[:, holds]))
    return np.concatenate(blocks, axis=1)


def _material(rig: Rig, bench: Bench, theta: Array, fx: Effects, scale: float) -> Material:
    """Creep is a strain, so B is proportional to length; `length_dependence` bends one parameter's power law.

    An exponent changes about the reference tension or a typical hold, where the creep stays what it is.
    """
    first = len(MATERIAL_PARAMETERS) * rig.materials.index(bench.material)
    values = {name: theta[:, first + i] for i, name in enumerate(MATERIAL_PARAMETERS)}
    values["B"] = values["B"] * scale
    tau_ref = rig.tau_ref.get(bench.material, 1.0)
    if fx.on("length_dependence"):
        power, which = fx["length_dependence"], fx.shape("length_dependence.which")
        before = dict(values)
        for code, name in enumerate(("k1", "B", "N", "U")):
            values[name] = values[name] * np.where(which == code, scale**power, 1.0)
        values["B"] = values["B"] * tau_ref ** (before["U"] - values["U"])
        values["k2"] = values["k2"] * rig.typical_hold_s ** (before["N"] - values["N"])
    return Material(**values, tau_ref=tau_ref)


def _bench(bench: Bench, m: Material, preload: Array, fx: Effects, eta: Array) -> Array:
    stretched = bench.length_mm + preload[:, None] + positions(bench, fx) + eta
    zero = np.zeros(fx.n)
    carried = Carried(zero, zero, zero, zero, zero)
    if fx.on("prior_creep"):
        unmoved = bench.length_mm + preload[:, None]
        carried = _wait(bench, m, carried, fx, 0, unmoved, fx["prior_creep"])
    shown = zero
    typical = float(np.median(m.k2)), float(np.median(m.N))
    columns = []
    for j, hold in enumerate(bench.holds):
        here = stretched[:, j : j + 1]
        if fx.on("unrecorded_hold"):
            seconds = np.where(fx.shape("unrecorded_hold.hold") == j, fx["unrecorded_hold"], 0.0)
            carried = _wait(bench, m, carried, fx, j, here, seconds)
        start = _tension_now(bench, m, carried, fx, j, here)
        times = np.array(hold.times_s if hold.times_s else [hold.duration_s])
        if hold.duration_s > times[-1]:
            times = np.append(times, hold.duration_s)
        grid, nodes = time_grid(times, *typical, fewest=8 if fx.on("second_relaxation") else 3)
        before = carried
        creep, carried = grow(m, before, fx, j, start, _by_a_late_clock(fx, grid, typical[1]))
        creep = creep[:, -len(grid) :]
        whole = fx.on("sensor_lag") or fx.on("sensor_hysteresis")
        keep = np.arange(len(grid)) if whole else nodes
        warmth = _warmth(bench, bench.starts_s[j] + grid[keep])
        force = tension(m.k1, here, natural_length(bench, fx, j, creep[:, keep], warmth), fx, j)
        if fx.on("sensor_lag"):
            force = lagging(force, grid, shown if j else force[:, 0], fx["sensor_lag"])
        if fx.on("sensor_hysteresis"):
            force = sticking(force, shown if j else force[:, 0], fx["sensor_hysteresis"])
        shown = force[:, -1]
        if whole:
            force = force[:, nodes]
        force = force[:, : len(hold.times_s)]
        if fx.on("reading_delay") and hold.times_s:
            force = _late_first(bench, m, before, fx, j, here, start, force)
        columns.append(force)
    return readings(bench, np.concatenate(columns, axis=1), fx)


def _tension_now(bench: Bench, m: Material, carried: Carried, fx: Effects, j: int, here: Array) -> Array:
    warmth = _warmth(bench, bench.starts_s[j : j + 1])
    return tension(m.k1, here, natural_length(bench, fx, j, carried.total[:, None], warmth), fx, j)[:, 0]


def _warmth(bench: Bench, elapsed_s: Array) -> Array | float:
    if bench.warming is None:
        return 0.0
    first = bench.starts_s[bench.hold_of_reading[0]] + bench.reading_times_s[0]
    return bench.warming.at(elapsed_s) - bench.warming.at(first)


def _wait(bench: Bench, m: Material, carried: Carried, fx: Effects, j: int, here: Array, seconds: Array) -> Carried:
    """State after some time (n,) at a position, in the rows that have any before hold j."""
    rows = np.flatnonzero(seconds > 0)
    if not len(rows):
        return carried
    part, sub, before = m.rows(rows), fx.rows(rows), carried.rows(rows)
    grid = np.linspace(0, 1, 81) ** (1 / min(float(np.median(part.N)), 1.0)) * seconds[rows, None]
    start = _tension_now(bench, part, before, sub, j, here[rows])
    _, after = grow(part, before, sub, j, start, grid)
    names = ("main", "second", "viscous", "apart", "goal")
    result = Carried(*(getattr(carried, name).copy() for name in names))
    for name in names:
        getattr(result, name)[rows] = getattr(after, name)
    nothing = (np.zeros(fx.n), np.ones(fx.n))
    for i, clock in enumerate(after.clocks):  # the last one is the waiting's own, new to the other rows
        owed, age = (part.copy() for part in (carried.clocks[i] if i < len(carried.clocks) else nothing))
        owed[rows], age[rows] = clock
        result.clocks.append((owed, age))
    return result if after.clocks else dataclasses.replace(result, clocks=carried.clocks)


def _by_a_late_clock(fx: Effects, grid: Array, exponent: float) -> Array:
    """True times of a hold's nodes where its clock was started late: some nodes before the first reading, then all."""
    if not fx.on("late_clock"):
        return grid
    late = fx["late_clock"][:, None]
    earlier = np.linspace(0, 1, 25)[:-1] ** (1 / min(exponent, 1.0)) * late
    return np.concatenate([earlier, late + grid], axis=1)


def _late_first(
    bench: Bench, m: Material, before: Carried, fx: Effects, j: int, here: Array, start: Array, force: Array
) -> Array:
    """Replace the first reading by the tension `reading_delay` seconds later."""
    rows = np.flatnonzero(fx["reading_delay"] > 0)
    if not len(rows):
        return force
    part, sub = m.rows(rows), fx.rows(rows)
    late = sub["reading_delay"] + bench.holds[j].times_s[0]
    grid = np.linspace(0, 1, 41) ** (1 / min(float(np.median(part.N)), 1.0)) * late[:, None]
    creep, _ = grow(part, before.rows(rows), sub, j, start[rows], grid)
    warmth = _warmth(bench, bench.starts_s[j] + late[:, None])
    force = force.copy()
    force[rows, 0] = tension(part.k1, here[rows], natural_length(bench, sub, j, creep[:, -1:], warmth), sub, j)[:, 0]
    return force
