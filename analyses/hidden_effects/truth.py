"""Random wires and protocols round those of the paper."""

from __future__ import annotations

import dataclasses

import numpy as np

from .generator import simulate, with_reference
from .rig import Bench, Hold, Rig, Warming, Wire

PROTOCOLS = ("paper", "unloading", "uneven", "dense", "temperature", "two_lengths", "slack", "several_wires")
PAPER_TIMES = (0.0, 30.0, 60.0, 90.0, 120.0)


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """One log-uniform number."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def draw_wire(rng: np.random.Generator, length_mm: float) -> Wire:
    """A creeping wire: 0.02 to 1 mm of creep at 3 N, creep times from seconds to hours, 0.3 to 5 N for each mm."""
    while True:
        k1 = log_uniform(rng, 300.0, 10000.0)
        exponent = rng.uniform(0.1, 0.8)
        n, k2 = rng.uniform(0.35, 1.05), log_uniform(rng, 0.005, 0.08)
        creep = log_uniform(rng, 0.02, 1.0)
        if 0.3 < k1 / length_mm < 5.0 and 15.0 < (1 / k2) ** (1 / n) < 20000.0:
            return Wire(k1, creep / 3.0**exponent, exponent, k2, n)


def steady_holds(displacements: list[float], times: tuple[float, ...], skip: int | None = None) -> tuple[Hold, ...]:
    """Holds with the same times; hold `skip` was held but not recorded."""
    return tuple(
        Hold(j + 1, round(float(x), 3), () if j == skip else times, times[-1]) for j, x in enumerate(displacements)
    )


def draw_holds(rng: np.random.Generator, protocol: str) -> tuple[Hold, ...]:
    """The holds of one bench."""
    if protocol == "unloading":
        up, down = int(rng.integers(6, 9)), int(rng.integers(4, 6))
        path = [float(i + 1) for i in range(up)] + [float(up - i - 1) for i in range(down)]
        return steady_holds(path, PAPER_TIMES)
    if protocol == "uneven":
        holds, x = [], 0.0
        for j in range(int(rng.integers(9, 14))):
            x = round(x + rng.uniform(0.4, 1.7), 2)
            gaps = rng.uniform(4.0, 50.0, int(rng.integers(3, 8)))
            times = tuple(float(round(t)) for t in np.concatenate([[0.0], np.cumsum(gaps)]))
            holds.append(Hold(j + 1, x, times, times[-1]))
        return tuple(holds)
    if protocol == "dense":
        times = (0.0, *(float(round(t, 1)) for t in np.geomspace(1.0, 600.0, 24)))
        return steady_holds([float(i + 1) for i in range(int(rng.integers(7, 11)))], times)
    if protocol == "slack" and rng.random() < 0.5:  # slack at the end of unloading
        up = int(rng.integers(6, 9))
        return steady_holds([float(i + 1) for i in range(up)] + [up - 2.0, up - 4.0, 2.0, 0.2, 2.2], PAPER_TIMES)
    count = int(rng.integers(8, 11)) if protocol in ("several_wires", "two_lengths") else int(rng.integers(10, 14))
    skip = int(rng.integers(3, 6)) if protocol == "paper" and rng.random() < 0.3 else None
    return steady_holds([float(i + 1) for i in range(count)], PAPER_TIMES, skip)


def draw_bench(rng: np.random.Generator, protocol: str, name: str, material: str, length_mm: float) -> Bench:
    """A bench whose noise is still to be set (it goes by the tension)."""
    preload = rng.uniform(0.1, 1.0)
    if protocol == "slack":
        preload = -rng.uniform(0.3, 2.2)
    warming = None
    if protocol == "temperature":
        warming = Warming(
            round(rng.uniform(17, 22), 1),
            rng.uniform(1.0, 6.0) * rng.choice([1, -0.5]),
            log_uniform(rng, 200, 2500),
            rng.uniform(0.1, 1.5),
            log_uniform(rng, 400, 2500),
            rng.uniform(0, 6.28),
        )
    resolution = [0.01, 0.01, 0.001, None][int(rng.integers(4))]
    return Bench(name, material, length_mm, draw_holds(rng, protocol), preload, 0.0, 0.0, resolution, warming)


def draw_rig(rng: np.random.Generator, protocol: str) -> Rig:
    """A rig of a protocol; wires that creep away most of their stretch are drawn again."""
    while True:
        if protocol == "two_lengths":
            short = log_uniform(rng, 500, 1500)
            lengths, labels = [short, short * rng.uniform(1.5, 2.2)], ["line-a", "line-a"]
        elif protocol == "several_wires":
            lengths = [log_uniform(rng, 500, 3000) for _ in range(3)]
            labels = ["line-a", "line-b", "line-c"]
        else:
            lengths, labels = [log_uniform(rng, 500, 3000)], ["line-a"]
        lengths = [round(length) * 1.0 for length in lengths]
        wires: dict[str, Wire] = {}
        for label, length in zip(labels, lengths, strict=True):
            if label not in wires:
                wires[label] = draw_wire(rng, length)
        benches = tuple(
            draw_bench(rng, protocol, f"sample-{i + 1}", label, length)
            for i, (label, length) in enumerate(zip(labels, lengths, strict=True))
        )
        rig = _with_noise(rng, Rig(protocol, benches, wires))
        if rig is not None:
            return with_reference(rig)


def _with_noise(rng: np.random.Generator, rig: Rig) -> Rig | None:
    y = simulate(rig)[0]
    setting = log_uniform(rng, 0.002, 0.03)  # the machine is one, its setting error too
    benches = []
    for bench, part in zip(rig.benches, rig.bench_slices, strict=True):
        wire = rig.wires[bench.material]
        top = float(y[part].max())
        creep = wire.B * top**wire.U * bench.length_mm / rig.reference_length(bench.material)
        if top < 1.0 or creep > 0.45 * (bench.displacements_mm.max() + bench.preload_mm):
            return None
        recorded = [j for j, hold in enumerate(bench.holds) if hold.times_s]
        first = [y[part][bench.hold_of_reading == j][0] for j in recorded]
        slack = bool(np.any(y[part] <= 0))
        if sum(tau > 0 for tau in first) < 6 or slack != (rig.protocol == "slack"):
            return None
        sensor = float(np.clip(top * log_uniform(rng, 4e-4, 3e-3), 0.003, 0.04))
        benches.append(dataclasses.replace(bench, sensor_sd=sensor, setting_sd=setting))
    return dataclasses.replace(rig, benches=tuple(benches))
