"""Is the drift of a robot true whose wires have an effect that `discover` had to find, by whatever it left undecided?

Each test is of a wire of its own, simulated here hold by hold: plain, with a creep that runs faster or slower at higher
tension, with a stiffening, or with a tension below which it does not creep. `discover` searches the test, and three
wires of the line hold a mass. Its sinking after 10, 30, 60 and 120 s, solved here by equations of its own, is compared
with `pose` by three fits: the plain model, the leading one of the final models alone, and all that are left.

    python -m analyses.robots.discovered_wires --tests 48
"""

import json
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.optimize import brentq, fsolve

import wirebayes as wb
from analyses.resumable import Record, study
from wirebayes.inference.fit import seed_of
from wirebayes.io.run_folder import write_csv
from wirebayes.numeric.typing import Array

Wire = Mapping[str, float]

KINDS = ("plain", "tension_dependent_rate", "strain_stiffening", "creep_threshold")
MODELS = ("plain", "leading", "all")
EXITS_MM = np.array([[-800.0, -600.0, 1500.0], [900.0, -500.0, 1500.0], [0.0, 900.0, 1500.0]])
PLACE_MM = np.array([50.0, 100.0, 300.0])
WEIGHT_OF_A_KG = 9.80665
TIMES_S = (10.0, 30.0, 60.0, 120.0)
READ_S = (0.0, 15.0, 30.0, 60.0, 90.0, 120.0)
TOP_N = 4.0  # tension at the top of a test, half as much or half as much again
LOADED = 0.75  # of the test's highest tension, in the wire that bears most


def tension_of(strain: Array, wire: Wire) -> Array:
    """Tension, N."""
    taut = np.maximum(strain, 0.0)
    return wire["k1"] * taut * (1.0 + wire.get("c", 0.0) * taut)


def creep_after(time_s: float, tension_N: float, wire: Wire) -> tuple[float, float]:
    """The elongation, mm, that a tension leads to in the end, and which share of it comes within a time."""
    driving = max(tension_N - wire.get("threshold_N", 0.0), 0.0)
    rate = wire["k2"] * (max(tension_N, 1e-3) / 2.0) ** wire.get("m", 0.0)
    return wire["B"] * driving ** wire["U"], -np.expm1(-rate * time_s ** wire["N"])


def drawn_wire(kind: str, rng: np.random.Generator) -> tuple[dict[str, float], float, float]:
    """A wire, the length of its sample, mm, and the step of its test, mm."""
    length = rng.uniform(600.0, 2500.0)
    k1 = np.exp(rng.uniform(np.log(400.0), np.log(3000.0)))
    step = rng.uniform(0.5, 1.5) * TOP_N * length / k1 / 12
    wire = {"k1": k1, "U": rng.uniform(0.5, 1.2), "N": rng.uniform(0.4, 1.0), "preload": step * rng.uniform(0.2, 1.0)}
    wire["B"] = rng.uniform(0.03, 0.3) * 2.0 * length / k1 / 2.0 ** wire["U"]
    wire["k2"] = np.log(2.0) / rng.uniform(15.0, 120.0) ** wire["N"]
    if kind == "tension_dependent_rate":
        wire["m"] = rng.choice([-1, 1]) * rng.uniform(0.4, 1.2)
    if kind == "strain_stiffening":
        wire["c"] = rng.uniform(0.15, 0.5) * k1 / TOP_N
    if kind == "creep_threshold":
        wire["threshold_N"] = rng.uniform(0.5, 1.2)
    return wire, length, step


def readings(wire: Wire, length: float, step: float, rng: np.random.Generator) -> list[list[float]]:
    """Rows of a test: twelve steps up, four back."""
    sensor_N = rng.uniform(0.004, 0.015)
    setting_mm = step * rng.uniform(0.002, 0.01)
    rows = []
    carried = 0.0
    for number, steps in enumerate([*range(1, 13), *range(11, 7, -1)], start=1):
        stretched = length + wire["preload"] + step * steps + rng.normal(0.0, setting_mm)
        first = float(tension_of(stretched / (length + carried) - 1.0, wire))
        for time in READ_S:
            final, share = creep_after(time, first, wire)
            crept = carried + (final - carried) * share
            read = float(tension_of(stretched / (length + crept) - 1.0, wire)) + rng.normal(0.0, sensor_N)
            rows.append([number, step * steps, time, round(max(read, 0.0), 2)])
        carried = crept
    return rows


def pulls_of(mass_kg: float) -> Array:
    """Tensions, N, that hold the mass in its place."""
    away = EXITS_MM - PLACE_MM
    directions = away / np.linalg.norm(away, axis=1)[:, None]
    return np.linalg.solve(directions.T, [0.0, 0.0, mass_kg * WEIGHT_OF_A_KG])


def sinking(wire: Wire, length: float, mass_kg: float) -> list[float]:
    """Height of the mass at the times over where new wires hold it, mm: below zero."""
    pulls = pulls_of(mass_kg)
    strain = [brentq(lambda s, at=pull: tension_of(s, wire) - at, 0.0, 0.5) for pull in pulls]
    new_mm = np.linalg.norm(EXITS_MM - PLACE_MM, axis=1) / (1.0 + np.array(strain))

    def force(place: Array, zero_mm: Array) -> Array:
        away = EXITS_MM - place
        distance = np.linalg.norm(away, axis=1)
        pull = tension_of(distance / zero_mm - 1.0, wire)
        return (pull / distance) @ away - [0.0, 0.0, mass_kg * WEIGHT_OF_A_KG]

    out = []
    for time in TIMES_S:
        crept = [np.prod(creep_after(time, pull, wire)) / length for pull in pulls]
        place = fsolve(force, PLACE_MM, args=(new_mm * (1.0 + np.array(crept)),), xtol=1e-13)
        out.append(float(place[2] - PLACE_MM[2]))
    return out


def robot_of(mass_kg: float) -> str:
    """The file of a mass on three wires."""
    legs = [f"[[leg]]\nexit_point_m = {(at / 1e3).tolist()}\nplatform_point_m = [0.0, 0.0, 0.0]" for at in EXITS_MM]
    tables = (
        'version = 1\nname = "three"\nfreedom = "position"\ndescription = "A mass on three wires"\nsource = "Invented"',
        f"[platform]\nmass_kg = {mass_kg}",
        f"[pose]\nposition_m = {(PLACE_MM / 1e3).tolist()}",
        '[tension]\nchoice = "minimum_norm"\nlowest_N = 0.1\nhighest_N = 50.0',
        "[workspace]\nlower_m = [-0.1, -0.1, 0.1]\nupper_m = [0.1, 0.1, 0.4]",
        *legs,
    )
    return "\n".join(tables) + "\n"


def one(seed: int, index: int) -> Record:
    """A test, what `discover` says of it, and by each fit how far off the sinking is and whether its band holds it."""
    rng = np.random.default_rng([seed, index])
    kind = KINDS[index % len(KINDS)]
    wire, length, step = drawn_wire(kind, rng)
    rows = readings(wire, length, step, rng)
    mass = LOADED * max(row[-1] for row in rows) / pulls_of(1.0).max()
    truth = sinking(wire, length, mass)
    with TemporaryDirectory() as name:
        folder = Path(name)
        write_csv(folder / "wire.csv", ["hold", "displacement_mm", "time_s", "tension_N"], rows)
        about = f'[[experiment]]\nname = "wire"\nmaterial = "line"\nlength_mm = {length}\nresolution_N = 0.01\n'
        (folder / "wire.toml").write_text(f'{about}readings = "wire.csv"\n')
        (folder / "robot.toml").write_text(robot_of(mass))
        wb.discover(folder / "wire.toml", seed=seed_of(seed, str(index)), output=folder / "found")
        said = json.loads((folder / "found" / "discovery.json").read_text())["experiments"]["wire"]
        final = folder / "found" / "wire" / "final"
        alone = folder / "leading"
        alone.mkdir()
        for file in ("posterior.nc", "summary.json"):
            shutil.copy(final / file, alone / file)
        fits = dict(zip(MODELS, (final.parent / "plain", alone, final), strict=True))
        by_fit = {model: _compared(folder, fit, truth) for model, fit in fits.items()}
    return {"index": index, "kind": kind, "verdict": said["verdict"], "accepted": said["accepted"], **by_fit}


def _compared(folder: Path, fit: Path, truth: Sequence[float]) -> Record:
    """Deviations in standard deviations, and which bands hold the truth."""
    output = folder / f"pose-{fit.name}"
    pose = wb.pose(folder / "robot.toml", wires=fit, times=[0.0, *TIMES_S], specimen_spread=1e-6, output=output)
    moved = pose.summary()["drift"][0]["displacement_mm"]
    rise = {key: np.array(moved[key])[1:, 2] for key in ("mean", "sd", "q05", "q95")}
    held = (rise["q05"] <= truth) & (truth <= rise["q95"])
    return {"z": ((truth - rise["mean"]) / rise["sd"]).tolist(), "held": held.tolist()}


def summary_of(rows: Sequence[Record]) -> Record:
    """Root mean square deviation and share of bands that hold the truth, of wires with an effect and of plain ones."""
    out: Record = {"tests": len(rows)}
    for name, own in (
        ("effect", [r for r in rows if r["kind"] != "plain"]),
        ("plain", [r for r in rows if r["kind"] == "plain"]),
    ):
        for model in MODELS:
            z = np.array([row[model]["z"] for row in own])
            held = np.array([row[model]["held"] for row in own])
            out[f"{name}, {model}"] = {
                "tests": len(own),
                "rms_z": float(np.sqrt((z**2).mean())),
                "largest_z": float(np.abs(z).max()),
                "held": float(held.mean()),
            }
    return out


if __name__ == "__main__":
    study(__doc__, "discovered-wires", ("tests", 48), one, summary_of)
