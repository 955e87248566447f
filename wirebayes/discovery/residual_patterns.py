"""Where model and measurement disagree: residual patterns along what was varied, each with a simulated p-value."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from wirebayes.discovery.scans import Scan
from wirebayes.json_files.discovery import Disagreement
from wirebayes.model.problem import Problem
from wirebayes.model.sample import NOISES, Sample
from wirebayes.numeric.typing import Array
from wirebayes.wire.control import READ_UNIT
from wirebayes.wire.protocol import Control

_SMALLEST = 0.001  # of p in a sentence
_PARAMETERS = {"k1": "the stiffness k1", "B": "the creep amount B", "k2": "the creep rate k2"}


def _warming(s: Sample) -> Array:
    return np.zeros(s.protocol.time_s.shape) if s.protocol.warming_K is None else s.protocol.warming_K


def _of(what: Control) -> Callable[[Sample], Array]:
    """Displacements or tensions: what is set in a test is noted once a hold, the other was read."""

    def values(s: Sample) -> Array:
        return s.protocol.setting[:, None] if s.protocol.control == what else s.readings[..., 0]

    return values


# What was varied, of a sample's readings: (H, R) or what broadcasts to it.
COVARIATES: dict[str, Callable[[Sample], Array]] = {
    "hold": lambda s: s.protocol.number[:, None],
    "displacement": _of("displacement"),
    "time in hold": lambda s: s.protocol.time_s,
    "elapsed time": lambda s: s.protocol.start_s[:, None] + s.protocol.time_s,
    "tension": _of("force"),
    "direction": lambda s: np.sign(np.diff(s.protocol.setting, prepend=0.0))[:, None],
    "temperature": _warming,
    "length": lambda s: np.array(s.protocol.length_mm),
}


@dataclass(frozen=True)
class Pattern:
    """One column of the search.

    Attributes
    ----------
    covariate : str
    hold : int or None
        The hold it belongs to, where it is one.
    moves : str or None
        The parameter that would move with the covariate.
    counts_as : float
        How many `unit` the readings of the hold count as one.
    unit : {"N", "mm"}
    """

    covariate: str
    hold: int | None = None
    moves: str | None = None
    counts_as: float = 1.0
    unit: str = "N"


def patterns(problem: Problem) -> tuple[list[Pattern], Callable[[Problem, int, Array, Array], Array]]:
    """The patterns to look for in a block, and the function that makes their columns.

    Along each covariate: smooth functions of it as an added tension, and the model's own parameters moving with it.
    """
    covariates = _covariates(problem)
    moving = [name.split("[")[0] for name in problem.names]
    moving = [name for name in moving if name not in NOISES]
    along = [name for name in (_set_in(problem), "elapsed time") if any(c[0] == name for c in covariates)]
    holds = [
        (at, int(sample.protocol.number[j]), j)
        for at, sample in enumerate(problem.samples)
        for j in np.flatnonzero(sample.protocol.recorded)
    ]
    listed = [Pattern(name) for name, _, degrees in covariates for _ in range(degrees)]
    listed += [Pattern(name, moves=p) for name in along for p in _PARAMETERS if p in moving]
    listed += [_of_hold(problem, problem.samples[at], number) for at, number, _ in holds]

    def columns(problem: Problem, at: int, tension: Array, slopes: Array) -> Array:
        out: list[Array] = []
        by_name = {name: values[at] for name, values, _ in covariates}
        for name, _, degrees in covariates:
            out += [np.broadcast_to((by_name[name] ** d)[..., None], tension.shape) for d in range(1, degrees + 1)]
        for name in along:
            out += [slopes[..., moving.index(p)] * by_name[name][..., None] for p in _PARAMETERS if p in moving]
        for of_sample, _, j in holds:
            out.append(np.zeros(tension.shape))
            if of_sample == at:
                out[-1][j] = 1.0
        return np.stack(out, axis=-1).reshape(*tension.shape, -1)

    return listed, columns


def _set_in(problem: Problem) -> str:
    """The covariate that is set in the tests: the displacement, where any of them has steps."""
    return "displacement" if any(s.protocol.control == "displacement" for s in problem.samples) else "tension"


def _of_hold(problem: Problem, sample: Sample, number: int) -> Pattern:
    """A hold that lies off by itself."""
    unit = READ_UNIT[sample.protocol.control]
    return Pattern("hold", hold=number, counts_as=problem.read_unit(sample), unit=unit)


def _covariates(problem: Problem) -> list[tuple[str, list[Array], int]]:
    """Name, values (H, R) for each sample scaled to about one, and the highest power."""
    samples = problem.samples
    out: list[tuple[str, list[Array], int]] = []

    def add(name: str, values: list[Array], degrees: int) -> None:
        everything = np.concatenate([v[s.protocol.mask] for v, s in zip(values, samples, strict=True)])
        middle, spread = everything.mean(), everything.std()
        if spread > 1e-9 * (1.0 + abs(middle)):
            out.append((name, [(v - middle) / spread for v in values], degrees))

    def of(name: str) -> list[Array]:
        return [np.broadcast_to(COVARIATES[name](s), s.protocol.time_s.shape) for s in samples]

    add("displacement", of("displacement"), 3)
    scales = [max(0.1 * s.typical_hold_s, 1e-9) for s in samples]
    add("time in hold", [np.log1p(t / scale) for t, scale in zip(of("time in hold"), scales, strict=True)], 3)
    for name, degrees in (("elapsed time", 3), ("tension", 3), ("direction", 1), ("temperature", 2), ("length", 1)):
        add(name, of(name), degrees)
    return out


def findings(listed: Sequence[Pattern], skip: int, data: Scan, null: Scan, names: str) -> list[Disagreement]:
    """The covariates along which the data disagree, most improbable first.

    Parameters
    ----------
    listed : sequence of Pattern
    skip : int
        Columns before the patterns' (the probes').
    data, null : Scan
    names : str
        The experiments, for the sentence.
    """
    out: list[Disagreement] = []
    for covariate in dict.fromkeys(p.covariate for p in listed):
        columns = [skip + i for i, p in enumerate(listed) if p.covariate == covariate]
        here, chance = data.effects[0, columns], null.effects[:, columns].max(axis=1)
        p = float((1 + (chance >= here.max()).sum()) / (1 + len(chance)))
        best = columns[int(np.argmax(here))]
        pattern = listed[best - skip]
        out.append(
            {
                "covariate": covariate,
                "hold": pattern.hold,
                "p": p,
                "sentence": _sentence(pattern, float(data.amplitude[0, best]), p, names),
            }
        )
    return sorted(out, key=lambda item: item["p"])


def _sentence(pattern: Pattern, amplitude: float, p: float, names: str) -> str:
    chance = f"p = {p:.3f}" if p >= _SMALLEST else f"p < {_SMALLEST:g}"
    if p > 0.05:
        return f"{names}: the residuals show no dependence on {pattern.covariate} ({chance})."
    if pattern.hold is not None:
        side = "above" if amplitude > 0 else "below"
        size = f"{abs(amplitude) * pattern.counts_as:.3g} {pattern.unit}"
        return f"{names}: hold {pattern.hold} lies {size} {side} what the others predict ({chance})."
    if pattern.moves is not None:
        way = "grows" if amplitude > 0 else "decreases"
        factor = np.exp(np.clip(2 * abs(amplitude), 0, 20))
        share = 100 * (factor - 1 if amplitude > 0 else 1 - 1 / factor)
        size = f"{share:.2g} %" if factor < 2 else f"a factor of {factor:.3g}"
        return (
            f"{names}: the residuals suggest that {_PARAMETERS[pattern.moves]} {way} with {pattern.covariate}, "
            f"by {size} over two standard deviations of {pattern.covariate} ({chance})."
        )
    return f"{names}: the residuals of the plain model depend on {pattern.covariate} ({chance})."
