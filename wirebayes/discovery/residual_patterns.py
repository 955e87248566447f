"""Where model and measurement disagree: residual patterns along what was varied, each with a simulated p-value."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from wirebayes.discovery.linear_scan import AddedColumns
from wirebayes.discovery.scans import Scan
from wirebayes.json_files.discovery import Disagreement
from wirebayes.model.column_units import parameter_of
from wirebayes.model.problem import Problem
from wirebayes.model.sample import NOISES, Sample
from wirebayes.numeric.typing import Array
from wirebayes.sentences import p_in_words, short
from wirebayes.wire.control import READ_UNIT
from wirebayes.wire.protocol import Control

_PARAMETERS = {"k1": "the stiffness k1", "B": "the creep amount B", "k2": "the creep rate k2"}


def _warming(sample: Sample) -> Array:
    protocol = sample.protocol
    return np.zeros(protocol.time_s.shape) if protocol.warming_K is None else protocol.warming_K


def _of(what: Control) -> Callable[[Sample], Array]:
    """Displacements or tensions: what is set in a test is noted once a hold, the other was read."""

    def values(sample: Sample) -> Array:
        protocol = sample.protocol
        return protocol.setting[:, None] if protocol.control == what else sample.readings[..., 0]

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


# of a covariate, up to which its powers are tried; a direction has but two values
_HIGHEST_POWER = {
    "displacement": 3,
    "time in hold": 3,
    "elapsed time": 3,
    "tension": 3,
    "direction": 1,
    "temperature": 2,
    "length": 1,
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


def patterns(problem: Problem) -> tuple[list[Pattern], AddedColumns]:
    """The patterns to look for in a block, and the function that makes their columns.

    Along each covariate: smooth functions of it as an added tension, and the model's own parameters moving with it.
    """
    covariates = _covariates(problem)
    parameters = _moving_parameters(problem)
    found = {name for name, _, _ in covariates}
    along = [name for name in (_set_in(problem), "elapsed time") if name in found]
    listed = []
    for name, _, degrees in covariates:
        listed += [Pattern(name)] * degrees
    for name in along:
        listed += [Pattern(name, moves=parameter) for parameter in parameters]
    holds = _recorded_holds(problem)
    listed += [_of_hold(problem, problem.samples[at], j) for at, j in holds]
    columns = _Columns(covariates, along, list(parameters.values()), holds)
    return listed, columns


def _moving_parameters(problem: Problem) -> dict[str, int]:
    """The parameters that may move along a covariate, and the number of each among those that move the mean."""
    kinds = [parameter_of(name) for name in problem.names]
    moving = [kind for kind in kinds if kind not in NOISES]
    return {name: moving.index(name) for name in _PARAMETERS if name in moving}


def _recorded_holds(problem: Problem) -> list[tuple[int, int]]:
    """Sample and row of each."""
    out = []
    for at, sample in enumerate(problem.samples):
        rows = np.flatnonzero(sample.protocol.recorded)
        out += [(at, int(j)) for j in rows]
    return out


@dataclass(frozen=True)
class _Columns:
    """The columns of a block's patterns.

    Attributes
    ----------
    covariates : list
        As `_covariates` returns them.
    along : list of str
        Covariates with which parameters may move.
    parameters : list of int
        Their numbers among those that move the mean.
    holds : list of (int, int)
        Sample and row of each hold that may lie off.
    """

    covariates: list[tuple[str, list[Array], int]]
    along: list[str]
    parameters: list[int]
    holds: list[tuple[int, int]]

    def __call__(self, at: int, tension: Array, slopes: Array) -> Array:
        """(H, R, n, more) of one sample, of its tension and the derivatives."""
        shape = tension.shape
        out: list[Array] = []
        by_name = {}
        for name, values, degrees in self.covariates:
            value = values[at]
            by_name[name] = value
            powers = [value**power for power in range(1, degrees + 1)]
            out += [np.broadcast_to(power[..., None], shape) for power in powers]
        for name in self.along:
            value = by_name[name][..., None]
            out += [slopes[..., number] * value for number in self.parameters]
        for of_sample, j in self.holds:
            level = np.zeros(shape)
            if of_sample == at:
                level[j] = 1.0
            out.append(level)
        columns = np.stack(out, axis=-1)
        return columns.reshape(*shape, -1)


def _set_in(problem: Problem) -> str:
    """The covariate that is set in the tests: the displacement, where any of them has steps."""
    return "displacement" if any(s.protocol.control == "displacement" for s in problem.samples) else "tension"


def _of_hold(problem: Problem, sample: Sample, j: int) -> Pattern:
    """A hold that lies off by itself."""
    number = int(sample.protocol.number[j])
    unit = READ_UNIT[sample.protocol.control]
    return Pattern("hold", hold=number, counts_as=problem.read_unit(sample), unit=unit)


def _covariates(problem: Problem) -> list[tuple[str, list[Array], int]]:
    """Name, values (H, R) for each sample scaled to about one, and the highest power."""
    samples = problem.samples
    out: list[tuple[str, list[Array], int]] = []
    for name, degrees in _HIGHEST_POWER.items():
        values = [_values(name, sample) for sample in samples]
        read = np.concatenate([v[s.protocol.mask] for v, s in zip(values, samples, strict=True)])
        middle = read.mean()
        spread = read.std()
        if spread > 1e-9 * (1.0 + abs(middle)):
            out.append((name, [(v - middle) / spread for v in values], degrees))
    return out


def _values(name: str, sample: Sample) -> Array:
    """(H, R) a covariate of a sample; the time in a hold by its logarithm."""
    values = np.broadcast_to(COVARIATES[name](sample), sample.protocol.time_s.shape)
    if name != "time in hold":
        return values
    scale = max(0.1 * sample.typical_hold_s, 1e-9)
    return np.log1p(values / scale)


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
    columns_of: dict[str, list[int]] = {}
    for column, pattern in enumerate(listed, start=skip):
        columns_of.setdefault(pattern.covariate, []).append(column)
    simulations = len(null.effects)
    out: list[Disagreement] = []
    for covariate, columns in columns_of.items():
        evidence = data.effects[0, columns]
        best = columns[int(np.argmax(evidence))]
        best_pattern = listed[best - skip]
        p = _p_value(columns, data, null)
        said = _sentence(best_pattern, float(data.amplitude[0, best]), p)
        sentence = f"{names}: {said} ({p_in_words(p, simulations)})."
        out.append({"covariate": covariate, "hold": best_pattern.hold, "p": p, "sentence": sentence})
    return sorted(out, key=lambda item: item["p"])


def _p_value(columns: list[int], data: Scan, null: Scan) -> float:
    """Share of simulations in which the best of some columns explains as much, the data counted with them."""
    here = data.effects[0, columns].max()
    chance = null.effects[:, columns].max(axis=1)
    as_large = (chance >= here).sum()
    return float((1 + as_large) / (1 + len(chance)))


def _sentence(pattern: Pattern, amplitude: float, p: float) -> str:
    """What a pattern says, without its name and its p."""
    covariate = pattern.covariate
    if p > 0.05:
        return f"the residuals show no dependence on {covariate}"
    if pattern.hold is not None:
        side = "above" if amplitude > 0 else "below"
        size = abs(amplitude) * pattern.counts_as
        off = f"{short(size, 3)} {pattern.unit}"
        return f"hold {pattern.hold} lies {off} {side} what the others predict"
    if pattern.moves is not None:
        parameter = _PARAMETERS[pattern.moves]
        changes = _change(amplitude, covariate)
        return f"the residuals suggest that {parameter} {changes} over two standard deviations of {covariate}"
    return f"the residuals of the plain model depend on {covariate}"


def _change(amplitude: float, covariate: str) -> str:
    """Whether a parameter grows or falls, and by how much, if its logarithm changes by `amplitude` for an sd."""
    grows = amplitude > 0
    factor = np.exp(np.clip(2 * abs(amplitude), 0, 20))
    share = factor - 1 if grows else 1 - 1 / factor
    size = f"{short(100 * share, 2)} %" if factor < 2 else f"a factor of {short(factor, 3)}"
    way = "grows" if grows else "decreases"
    return f"{way} with {covariate}, by {size}"
