"""Writing a case: the experiment file the judged program reads, and the sealed truth it must not see."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np

from .rig import Array, Bench, Rig


def write_atomically(path: Path, text: str) -> None:
    """Write a file so that no reader ever sees half of it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(path.name + f".{os.getpid()}.part")
    part.write_text(text, encoding="utf-8")
    part.replace(path)


def write_json(path: Path, value: Any) -> None:
    """Write JSON atomically, keys in the order given."""
    write_atomically(path, json.dumps(value, indent=1) + "\n")


def logged_temperature(bench: Bench, rng: np.random.Generator) -> Array | None:
    """The temperature log (C) at the readings: 0.02 C of noise, rounded to 0.01 C."""
    if bench.warming is None:
        return None
    elapsed = bench.starts_s[bench.hold_of_reading] + bench.reading_times_s
    return np.round(bench.warming.at(elapsed) + rng.normal(0, 0.02, len(elapsed)), 2)


def write_experiments(folder: Path, rig: Rig, readings: Array, temperatures: list[Array | None]) -> Path:
    """Write `experiment.toml` and one CSV a bench.

    Parameters
    ----------
    readings : measured readings (N) of all benches, shape (R,).
    temperatures : logged temperatures (C) of each bench, or None.
    """
    sections = []
    for bench, part, temperature in zip(rig.benches, rig.bench_slices, temperatures, strict=True):
        decimals = 5 if bench.resolution_N is None else round(-np.log10(bench.resolution_N))
        lines = ["hold,displacement_mm,time_s,tension_N" + (",temperature_C" if temperature is not None else "")]
        for i, (j, t, y) in enumerate(zip(bench.hold_of_reading, bench.reading_times_s, readings[part], strict=True)):
            hold = bench.holds[j]
            row = f"{hold.number},{hold.displacement_mm:g},{t:g},{y + 0.0:.{decimals}f}"
            lines.append(row + (f",{temperature[i]:.2f}" if temperature is not None else ""))
        write_atomically(folder / f"{bench.name}.csv", "\n".join(lines) + "\n")
        section = [
            "[[experiment]]",
            f'name = "{bench.name}"',
            f'material = "{bench.material}"',
            f"length_mm = {bench.length_mm:.1f}",
        ]
        if bench.resolution_N is not None:
            section.append(f"resolution_N = {bench.resolution_N}")
        section.append(f'readings = "{bench.name}.csv"')
        blind = [(j, hold) for j, hold in enumerate(bench.holds) if not hold.times_s]
        if blind:
            items = ", ".join(
                f"{{ before_hold = {bench.holds[j + 1].number}, displacement_mm = {hold.displacement_mm}, "
                f"duration_s = {hold.duration_s} }}"
                for j, hold in blind
            )
            section.append(f"unrecorded_holds = [{items}]")
        sections.append("\n".join(section))
    path = folder / "experiment.toml"
    write_atomically(path, "\n\n".join(sections) + "\n")
    return path
