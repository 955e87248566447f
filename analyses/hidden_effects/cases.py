"""The list of sealed cases and how one is made from its specification alone."""

from __future__ import annotations

import hashlib
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from .catalogue import EFFECTS, FOREIGN, Candidate, bench_sets, draw, effect, fits, members
from .delta import Geometry, conditional, geometry, signature, solve_amplitude, solve_together
from .files import logged_temperature, write_experiments, write_json
from .noise import measure
from .rig import Array, Rig
from .truth import PROTOCOLS, draw_rig

GENERATION = 1  # raised with every change that makes other data of the same specification: old answers then lapse
KINDS = ("clean", "single", "pair", "without", "foreign", "gross", "two", "three", "mixed", "periodic", "some")
TOGETHER = ("two", "three", "mixed", "periodic")  # kinds whose delta is conditional on the other effects
LONG = ("unloading", "dense", "uneven")  # protocols that tell more than the paper's
ELASTIC = ("strain_stiffening", "toe", "power_strain", "sensor_nonlinearity")  # what bends the elastic curve
DELTAS = (3.0, 5.0, 10.0, 20.0)
ATTEMPTS = 60  # rigs tried before an effect counts as out of reach of a protocol


@dataclass(frozen=True)
class Spec:
    """What a case is to be; with the base seed it determines every byte of the case."""

    kind: str
    protocol: str
    names: tuple[str, ...]
    delta: float
    repeat: int
    seed: int = 0

    @property
    def key(self) -> str:
        """Name of the case: says nothing of what it hides."""
        text = (
            f"{GENERATION}|{self.seed}|{self.kind}|{self.protocol}|{','.join(self.names)}|{self.delta:g}|{self.repeat}"
        )
        return hashlib.sha256(text.encode()).hexdigest()[:12]

    def rng(self) -> np.random.Generator:
        """The case's own random stream."""
        return np.random.default_rng(np.random.SeedSequence([self.seed, int(self.key, 16)]))


@dataclass(frozen=True)
class Case:
    """A case with its truth."""

    spec: Spec
    rig: Rig
    geo: Geometry
    hidden: tuple[tuple[Candidate, float], ...]  # candidate and the size of its amplitude
    readings: Array
    temperatures: tuple[Array | None, ...]
    law: str


@dataclass(frozen=True)
class Plan:
    """How many cases of what."""

    clean: int
    single_deltas: tuple[float, ...]
    single_protocols: int  # protocols per effect; those that cannot show it are passed over
    repeats: int
    pairs: int
    without_deltas: tuple[float, ...]
    without_protocols: int
    foreign_deltas: tuple[float, ...]
    foreign_protocols: int
    gross: int
    together: int  # of each of two, three, one known beside one foreign, and a periodic one beside an elastic curve
    some: int  # several wires, an effect of the material in one, two or all three of them, each with its own amplitude


SIZES = {
    "tiny": Plan(8, (10.0,), 1, 1, 2, (), 0, (), 0, 0, 0, 0),
    "small": Plan(48, (5.0, 10.0, 20.0), 2, 1, 12, (10.0,), 1, (10.0,), 1, 8, 24, 9),
    "full": Plan(640, DELTAS, len(PROTOCOLS), 1, 80, (10.0, 20.0), 3, (8.0, 20.0), 4, 40, 160, 27),
}


def able(name: str, protocol: str) -> bool:
    """Whether a protocol could show an effect at all, by what it contains."""
    needs = effect(name).needs
    if needs == "unloading":
        return protocol in ("unloading", "slack")
    return needs in ("", "steps") or protocol == {"temperature": "temperature", "lengths": "two_lengths"}[needs]


def specs(
    plan: Plan,
    seed: int = 0,
    kinds: tuple[str, ...] = KINDS,
    protocols: tuple[str, ...] = PROTOCOLS,
    names: tuple[str, ...] = tuple(EFFECTS),
) -> list[Spec]:
    """All cases of a plan. A smaller choice of kinds, protocols or effects gives a part of the same cases."""
    found: list[Spec] = []
    for i in range(plan.clean):
        found.append(Spec("clean", PROTOCOLS[i % len(PROTOCOLS)], (), 0.0, i // len(PROTOCOLS), seed))
    for i in range(plan.gross):
        found.append(Spec("gross", PROTOCOLS[i % len(PROTOCOLS)], (), 0.0, i // len(PROTOCOLS), seed))
    for kind, pool, deltas, count in (
        ("single", EFFECTS, plan.single_deltas, plan.single_protocols),
        ("without", EFFECTS, plan.without_deltas, plan.without_protocols),
        ("foreign", FOREIGN, plan.foreign_deltas, plan.foreign_protocols),
    ):
        for place, name in enumerate(pool):
            possible = [p for p in PROTOCOLS if able(name, p)]
            turned = possible[place % len(possible) :] + possible[: place % len(possible)]
            for protocol in turned[:count]:
                for delta in deltas:
                    found += [Spec(kind, protocol, (name,), delta, r, seed) for r in range(plan.repeats)]
    rng = np.random.default_rng(seed)
    for i in range(plan.pairs):
        protocol = PROTOCOLS[i % len(PROTOCOLS)]
        options = [name for name in EFFECTS if able(name, protocol)]
        first, second = rng.choice(len(options), 2, replace=False)
        found.append(Spec("pair", protocol, (options[first], options[second]), 12.0, i, seed))
    for kind in TOGETHER:
        rng = np.random.default_rng([seed, TOGETHER.index(kind)])
        for i in range(plan.together):
            protocol = LONG[i // 2 % 3] if i % 2 else "paper"
            options = [name for name in EFFECTS if able(name, protocol)]
            drawn = [options[k] for k in rng.choice(len(options), 3 if kind == "three" else 2, replace=False)]
            if kind == "periodic":
                drawn = [ELASTIC[int(rng.integers(len(ELASTIC)))], "screw_error"]
            if kind == "mixed":
                drawn[1] = list(FOREIGN)[int(rng.integers(len(FOREIGN)))]
            found.append(Spec(kind, protocol, tuple(drawn), 10.0, i, seed))
    own = [name for name, e in EFFECTS.items() if e.scope == "material" and able(name, "several_wires")]
    found += [Spec("some", "several_wires", (own[i % len(own)],), 10.0, i, seed) for i in range(plan.some)]
    chosen = set(names) | set(FOREIGN)
    return [s for s in found if s.kind in kinds and s.protocol in protocols and set(s.names) <= chosen]


def build(spec: Spec) -> Case | None:
    """Make a case; None when no rig tried lets the protocol show the effect at that delta."""
    rng = spec.rng()
    for _ in range(ATTEMPTS):
        rig = draw_rig(rng, spec.protocol)
        if not all(fits(effect(name), rig) for name in spec.names):
            continue
        geo = geometry(rig)
        candidates = [draw(effect(name), rig, rng) for name in spec.names]
        if spec.kind == "some":
            wires = bench_sets(effect(spec.names[0]), rig)
            places = sorted(rng.choice(len(wires), int(rng.integers(len(wires))) + 1, replace=False))
            candidates = [replace(candidates[0], benches=wires[int(i)]) for i in places]
        if spec.kind in TOGETHER:
            sizes = solve_together(geo, candidates, spec.delta)
        else:
            sizes = [solve_amplitude(geo, c, spec.delta) for c in candidates]
        if np.any(np.isnan(sizes)):
            continue
        law = "gross" if spec.kind == "gross" else ("heavy" if rng.random() < 0.15 else "gaussian")
        hidden = tuple(zip(candidates, sizes, strict=True))
        readings = measure(rig, members(rig, [list(hidden)]) if hidden else None, rng, law)
        temperatures = tuple(logged_temperature(bench, rng) for bench in rig.benches)
        return Case(spec, rig, geo, hidden, readings, temperatures, law)
    return None


def truth(case: Case) -> dict[str, Any]:
    """The sealed truth as plain data; amplitudes carry their sign, holds their number in the file."""
    rig = case.rig
    effects = []
    sizes = conditional(case.geo, list(case.hidden)) if case.hidden else []
    for (candidate, size), alone in zip(case.hidden, sizes, strict=True):
        hold = candidate.hold
        bench = rig.benches[candidate.benches[0]]
        effects.append(
            {
                "name": candidate.name,
                "amplitude": candidate.sign * size,
                "unit": effect(candidate.name).unit,
                "hold": None if hold is None else bench.holds[hold].number,
                "shapes": {k: v for k, v in candidate.shapes if k != "hold"},
                "experiments": [rig.benches[b].name for b in candidate.benches],
                "delta": case.spec.delta,
                "conditional_delta": float(alone),
            }
        )
    total = float(np.linalg.norm(signature(case.geo, [list(case.hidden)]))) if case.hidden else 0.0
    return {
        **asdict(case.spec),
        "key": case.spec.key,
        "law": case.law,
        "effects": effects,
        "delta_total": total,
        "wires": {m: asdict(w) for m, w in rig.wires.items()},
        "benches": {
            b.name: {
                "material": b.material,
                "length_mm": b.length_mm,
                "preload_mm": b.preload_mm,
                "sensor_sd": b.sensor_sd,
                "setting_sd": b.setting_sd,
                "resolution_N": b.resolution_N,
                "tau_ref_N": rig.tau_ref[b.material],
                "holds": len(b.holds),
                "slack_readings": int(np.sum(case.geo.plain[part] <= 0)),
            }
            for b, part in zip(rig.benches, rig.bench_slices, strict=True)
        },
    }


def seal(spec: Spec, cases: Path, sealed: Path) -> bool:
    """Write a case's experiment file and, in another folder, its truth; False when it is out of reach."""
    if (sealed / f"{spec.key}.json").exists():
        return True
    case = build(spec)
    if case is None:
        write_json(sealed / "out_of_reach" / f"{spec.key}.json", asdict(spec))
        return False
    write_experiments(cases / spec.key, case.rig, case.readings, list(case.temperatures))
    write_json(sealed / f"{spec.key}.json", truth(case))
    return True
