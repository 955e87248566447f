"""The effects the judge can hide: scope, sign, shape constants, largest sensible amplitude, protocol needed."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from .generator import Members
from .rig import Array, Bench, Rig


@dataclass(frozen=True)
class Scale:
    """Magnitudes of one bench that bound sensible amplitudes."""

    stretch_mm: float  # largest stretch
    tension_N: float  # largest tension
    clock_s: float  # duration of the test
    gap_s: float  # shortest time from a first to a second reading
    k1: float
    length_mm: float
    holds: int
    warming_C: float


@dataclass(frozen=True)
class Effect:
    """One hidden effect; amplitude 0 is the plain model.

    Attributes
    ----------
    scope : `material`, `instrument` or `event`.
    signs : signs the amplitude may have.
    largest : largest sensible amplitude on a bench.
    shapes : shape constants as (lowest, highest), drawn log-uniform; the library takes three values of each.
    choices : shape constants that take listed values.
    needs : `""`, `unloading`, `temperature`, `lengths` or `steps` (many enough for a period).
    """

    name: str
    scope: str
    signs: tuple[int, ...]
    largest: Callable[[Scale], float]
    unit: str
    shapes: dict[str, tuple[float, float]] = field(default_factory=dict)
    choices: dict[str, tuple[float, ...]] = field(default_factory=dict)
    needs: str = ""


BOTH, UP = (1, -1), (1,)

EFFECTS = {
    e.name: e
    for e in (
        Effect("strain_stiffening", "material", BOTH, lambda s: 0.45 * s.length_mm / s.stretch_mm, "-"),
        Effect("toe", "material", UP, lambda s: s.stretch_mm, "mm"),
        Effect("power_strain", "material", BOTH, lambda s: 0.8, "-", shapes={"typical": (0.001, 0.01)}),
        Effect("permanent_creep", "material", UP, lambda s: 1.0, "-"),
        Effect("superposition", "material", UP, lambda s: 1.0, "-"),
        Effect("prior_creep", "event", UP, lambda s: 7200.0, "s"),
        Effect(
            "second_relaxation",
            "material",
            UP,
            lambda s: 0.3 * s.stretch_mm / s.tension_N,
            "mm/N",
            shapes={"time_s": (5.0, 500.0)},
        ),
        Effect(
            "steady_creep",
            "material",
            UP,
            lambda s: s.stretch_mm / s.tension_N / s.clock_s,
            "mm/(N s)",
            choices={"variant": (0.0, 1.0)},
        ),
        Effect("tension_dependent_rate", "material", BOTH, lambda s: 1.5, "-"),
        Effect("ageing", "material", UP, lambda s: 1.5, "-"),
        Effect("creep_threshold", "material", UP, lambda s: 0.8 * s.tension_N, "N"),
        Effect("reading_delay", "instrument", UP, lambda s: min(0.9 * s.gap_s, 25.0), "s"),
        Effect("late_clock", "instrument", UP, lambda s: 0.2 * s.clock_s / s.holds, "s"),
        Effect(
            "screw_error",
            "instrument",
            UP,
            lambda s: 0.1 * s.stretch_mm,
            "mm",
            shapes={"phase": (0.1, 6.2), "period": (0.0, 0.0)},  # the period is of a rig: see `periods`
            needs="steps",
        ),
        Effect("grip_slip", "event", UP, lambda s: 0.5 * s.stretch_mm, "mm"),
        Effect("unrecorded_hold", "event", UP, lambda s: 7200.0, "s"),
        Effect("sensor_drift", "instrument", BOTH, lambda s: 0.3 * s.tension_N / s.clock_s, "N/s"),
        Effect("sensor_nonlinearity", "instrument", BOTH, lambda s: 0.4 / s.tension_N, "1/N"),
        Effect(
            "thermal_expansion",
            "material",
            BOTH,
            lambda s: 0.4 * s.stretch_mm / s.length_mm / max(s.warming_C, 0.5),
            "1/K",
            needs="temperature",
        ),
        Effect("fixture_compliance", "instrument", UP, lambda s: s.length_mm / s.k1, "mm/N", needs="lengths"),
        Effect(
            "length_dependence",
            "material",
            BOTH,
            lambda s: 1.0,
            "-",
            choices={"which": (0.0, 1.0, 2.0, 3.0)},
            needs="lengths",
        ),
        Effect("lost_motion", "instrument", UP, lambda s: 0.4 * s.stretch_mm, "mm", needs="unloading"),
        Effect("guide_friction", "instrument", BOTH, lambda s: 0.3, "-", needs="unloading"),
        Effect("clamp_transient", "instrument", BOTH, lambda s: 0.3, "-", shapes={"time_s": (5.0, 90.0)}),
    )
}

FOREIGN = {
    e.name: e
    for e in (
        Effect(
            "worn_thread", "instrument", UP, lambda s: 0.4, "mm", shapes={"width": (0.5, 1.2), "centre": (1.0, 1.0)}
        ),
        Effect("yield", "material", UP, lambda s: 0.7, "-", shapes={"strain": (1.0, 1.0)}),
        Effect("hold_softening", "material", UP, lambda s: 0.5 / s.holds, "-"),
        Effect("log_creep", "material", UP, lambda s: 1.0, "-", shapes={"onset_s": (1.0, 30.0)}),
        Effect("exponent_by_tension", "material", BOTH, lambda s: 0.3, "-"),
        Effect("sensor_lag", "instrument", UP, lambda s: 60.0, "s"),
        Effect("sensor_hysteresis", "instrument", UP, lambda s: 0.2 * s.tension_N, "N"),
        Effect(
            "tension_wave",
            "instrument",
            UP,
            lambda s: 0.2 * s.tension_N,
            "N",
            shapes={"period_s": (170.0, 900.0), "phase": (0.1, 6.2)},
        ),
        Effect("gain_step", "event", BOTH, lambda s: 0.3, "-"),
        Effect("zero_step", "event", BOTH, lambda s: 0.2 * s.tension_N, "N"),
        Effect(
            "passing_draught",
            "instrument",
            BOTH,
            lambda s: 0.2 * s.tension_N,
            "N",
            shapes={"centre_s": (300.0, 1000.0), "width_s": (40.0, 150.0)},
        ),
    )
}


@dataclass(frozen=True)
class Candidate:
    """An effect with everything but its amplitude: sign, shape constants (hold included), the benches it acts on."""

    name: str
    sign: int
    shapes: tuple[tuple[str, float], ...]
    benches: tuple[int, ...]

    @property
    def hold(self) -> int | None:
        """Index of the hold of an event."""
        value = dict(self.shapes).get("hold")
        return None if value is None else int(value)


def effect(name: str) -> Effect:
    """The effect of that name, in the catalogue or foreign."""
    return EFFECTS[name] if name in EFFECTS else FOREIGN[name]


def fits(e: Effect, rig: Rig) -> bool:
    """Whether the rig's protocol could show the effect at all."""
    if e.needs == "unloading":
        return any(np.any(bench.directions < 0) for bench in rig.benches)
    if e.needs == "temperature":
        return any(bench.warming is not None for bench in rig.benches)
    if e.needs == "lengths":
        return len(rig.materials) < len(rig.benches)
    if e.needs == "steps":
        shortest, longest = periods(rig)
        return longest > 1.5 * shortest
    return True


def periods(rig: Rig) -> tuple[float, float]:
    """Shortest and longest period (mm) that a screw can show: two usual steps, half the way."""
    ways = [np.append(0.0, bench.displacements_mm) for bench in rig.benches]
    steps = [np.abs(np.diff(way[1:])) for way in ways]
    shortest = 2 * min(float(np.median(step[step > 0])) for step in steps)
    return shortest, 0.5 * max(float(np.ptp(way)) for way in ways)


def scale(rig: Rig, bench: Bench, y: Array) -> Scale:
    """Magnitudes of a bench; `y` are its plain, noise-free readings."""
    warmth = bench.warming.at(bench.starts_s) if bench.warming else np.zeros(1)
    gaps = [hold.times_s[1] - hold.times_s[0] for hold in bench.holds if len(hold.times_s) > 1]
    return Scale(
        stretch_mm=float(bench.displacements_mm.max() + bench.preload_mm),
        tension_N=float(y.max()),
        clock_s=float(bench.starts_s[-1] + bench.holds[-1].duration_s),
        gap_s=min(gaps),
        k1=rig.wires[bench.material].k1,
        length_mm=bench.length_mm,
        holds=len(bench.holds),
        warming_C=float(np.ptp(warmth)),
    )


def bench_sets(e: Effect, rig: Rig) -> list[tuple[int, ...]]:
    """Sets of benches that share one amplitude: all (instrument), those of a material, or one (event)."""
    if e.scope == "instrument":
        return [tuple(range(len(rig.benches)))]
    if e.scope == "event":
        return [(b,) for b in range(len(rig.benches))]
    if e.scope != "material":
        raise ValueError(f"{e.name}: nothing says which benches share the amplitude of scope {e.scope!r}")
    sets = [tuple(i for i, b in enumerate(rig.benches) if b.material == m) for m in rig.materials]
    return [s for s in sets if len(s) > 1] if e.needs == "lengths" else sets


def event_holds(bench: Bench) -> list[int]:
    """Holds at which an event can be seen: recorded, not the first (its level is the preload's)."""
    recorded = [j for j, hold in enumerate(bench.holds) if hold.times_s]
    return recorded[1:]


def has_hold(e: Effect) -> bool:
    """Whether the effect belongs to one hold; creep before the test is an event of none."""
    return e.scope == "event" and e.name != "prior_creep"


def shape_ranges(e: Effect, rig: Rig) -> dict[str, tuple[float, float]]:
    """Shape constants of an effect on a rig as (lowest, highest)."""
    return e.shapes | ({"period": periods(rig)} if "period" in e.shapes else {})


def draw(e: Effect, rig: Rig, rng: np.random.Generator) -> Candidate:
    """A random candidate of an effect on a rig."""
    sets = bench_sets(e, rig)
    benches = sets[int(rng.integers(len(sets)))]
    ranges = shape_ranges(e, rig)
    shapes = {k: float(np.exp(rng.uniform(np.log(lo), np.log(hi)))) for k, (lo, hi) in ranges.items()}
    shapes |= {k: float(rng.choice(values)) for k, values in e.choices.items()}
    if has_hold(e):
        shapes["hold"] = float(rng.choice(event_holds(rig.benches[benches[0]])[1:-1]))
    if e.name == "worn_thread":  # in the middle of the way
        shapes["centre"] = float(rng.uniform(0.3, 0.7) * rig.benches[benches[0]].displacements_mm.max())
    if e.name == "yield":  # somewhere in the middle of the strains visited
        bench = rig.benches[benches[0]]
        stretch = bench.displacements_mm.max() + bench.preload_mm
        shapes["strain"] = float(rng.uniform(0.35, 0.65) * stretch / bench.length_mm)
    return Candidate(e.name, int(rng.choice(e.signs)), tuple(shapes.items()), benches)


def library(rig: Rig, values: int = 3) -> list[Candidate]:
    """Every candidate on a rig: both signs, some values of each shape constant, all holds."""
    found = []
    for e in EFFECTS.values():
        if not fits(e, rig):
            continue
        middles = (np.arange(values) + 0.5) / values
        axes = {k: tuple(lo * (hi / lo) ** middles) for k, (lo, hi) in shape_ranges(e, rig).items()}
        if "period" in e.shapes:  # no two so near that one fits in the other's place
            shortest, longest = periods(rig)
            count = min(2 + int(2 * longest * (1 / shortest - 1 / longest)), 12)
            axes["period"] = tuple(1 / np.linspace(1 / longest, 1 / shortest, count))
        axes = axes | e.choices
        for benches in bench_sets(e, rig):
            places = tuple(float(j) for j in event_holds(rig.benches[benches[0]]))
            holds = {"hold": places} if has_hold(e) else {}
            keys = list(axes) + list(holds)
            for point in itertools.product(*axes.values(), *holds.values()):
                for sign in e.signs:
                    shapes = tuple((k, float(v)) for k, v in zip(keys, point, strict=True))
                    found.append(Candidate(e.name, sign, shapes, benches))
    return found


def members(rig: Rig, rows: list[list[tuple[Candidate, float]]]) -> Members:
    """A batch: for each row the candidates at work and the sizes (>= 0) of their amplitudes."""
    n, nb = len(rows), len(rig.benches)
    amplitudes: dict[str, Array] = {}
    shapes: dict[str, Array] = {}
    for i, row in enumerate(rows):
        for candidate, size in row:
            target = amplitudes.setdefault(candidate.name, np.zeros((n, nb)))
            target[i, list(candidate.benches)] = candidate.sign * size
            for key, value in candidate.shapes:
                shapes.setdefault(f"{candidate.name}.{key}", np.ones(n))[i] = value
    return Members(n, amplitudes, shapes)


def largest(rig: Rig, candidate: Candidate, y: Array) -> float:
    """Largest sensible amplitude of a candidate; `y` the rig's plain readings (readings,)."""
    e = effect(candidate.name)
    return min(e.largest(scale(rig, rig.benches[b], y[rig.bench_slices[b]])) for b in candidate.benches)
