"""Which materials of a problem have a ridge, and what their tests show of it."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from wirebayes.inference.coordinates.columns import ColumnMap
from wirebayes.inference.coordinates.power_of_tension import suiting_powers
from wirebayes.inference.coordinates.ridge import Ridge
from wirebayes.inference.coordinates.shares import Elongation
from wirebayes.model.problem import Problem
from wirebayes.model.sample import MATERIAL, Sample
from wirebayes.numeric.distributions import ONE_SD
from wirebayes.numeric.typing import Array
from wirebayes.wire.effect import Effect, HoldContext


def ridges_of(problem: Problem, columns: ColumnMap) -> list[Ridge]:
    """The ridges of a problem's materials; a column that several samples share follows the first of them.

    Parameters
    ----------
    columns : ColumnMap
        How each parameter is measured by itself.
    """
    found: list[Ridge] = []
    taken: set[int] = set()
    for sample in problem.samples:
        where, fixed = _parameters(problem, sample, columns)
        known = len(where) + len(fixed)
        if known < len(MATERIAL):
            continue  # a user's prior that allows negative values: leave this material's columns as they are
        free = {name for name, column in where.items() if column not in taken}
        shifted = _shifted(problem, sample, free)
        if not shifted:
            continue
        taken |= {where[name] for name in shifted}
        ridge = _ridge(problem, sample, where, fixed, shifted)
        owned = [column for each in found for column in each.shares]
        found.append(_with_shares(ridge, problem, sample, columns, owned))
    return found


def for_sample(ridge: Ridge, problem: Problem, sample: Sample) -> Ridge:
    """The ridge of a material as one of its samples has it: its holds and tensions.

    Parameters
    ----------
    ridge : Ridge
    problem : Problem
    sample : Sample
        Of the same material.
    """
    if sample is problem.samples[0]:
        return ridge
    return _ridge(problem, sample, dict(ridge.where), dict(ridge.fixed), ridge.shifted - {"U"})


def _parameters(problem: Problem, sample: Sample, columns: ColumnMap) -> tuple[dict[str, int], dict[str, float]]:
    """Columns of a sample's positive creep parameters, and what others are fixed at."""
    names = problem.names
    mark = _mark(problem, sample.material)
    where: dict[str, int] = {}
    fixed: dict[str, float] = {}
    for name in MATERIAL:
        own = f"{name}[{sample.name}]"
        called = own if own in names else f"{name}{mark}"
        if called in problem.prior.fixed:
            fixed[name] = problem.prior.fixed[called]
        if called in names and columns.positive[names.index(called)]:
            where[name] = names.index(called)
    if "k1" not in sample.parameters(problem.likelihood):
        fixed["k1"] = 1.0  # no reading depends on it
    return where, fixed


def _mark(problem: Problem, material: str) -> str:
    marked = f"k1[{material}]"
    return f"[{material}]" if marked in problem.names or marked in problem.prior.fixed else ""


def _shifted(problem: Problem, sample: Sample, free: set[str]) -> frozenset[str]:
    """The free parameters that have another coordinate than their logarithm."""
    shifted = {"k2", "U", "B", "k1"} & free
    if "B" not in shifted:
        shifted -= {"k1"}  # what is gained in a hold is not known
    if "k2" not in shifted or sample.model.history != "saturating" or problem.likelihood != "chain":
        shifted -= {"U"}  # every hold creeps anew, or the rate of the creep is not sampled here
    return frozenset(shifted)


def _ridge(
    problem: Problem,
    sample: Sample,
    where: dict[str, int],
    fixed: dict[str, float],
    shifted: frozenset[str],
) -> Ridge:
    effects = tuple(e for e in sample.model.at("amount") if e.has_formula)  # others may ask for B
    _place_amplitudes(effects, problem, sample, where, fixed)
    tension = _driving(sample)
    steps = np.diff(tension, prepend=0.0)
    hold_s = sample.typical_hold_s
    durations = np.where(sample.protocol.duration_s > 0, sample.protocol.duration_s, hold_s)
    powers = np.zeros(1), np.zeros(1)  # U is sampled as it is
    if "U" in shifted:
        powers = _powers(problem, sample, np.log(tension), durations / (0.5 * hold_s))
    carries = sample.model.history == "saturating" and problem.likelihood == "chain"
    return Ridge(
        where,
        fixed,
        shifted,
        log_tension=np.log(tension),
        log_step=0.5 * float(np.log(np.mean(steps**2))),
        **_times(sample, durations),
        kept=1.0 if carries else 0.0,
        hold_s=hold_s,
        log_length=float(np.log(sample.length_ref_mm)),
        effects=effects,
        holds=_holds(sample, tension),
        powers=powers,
        elongations=sample.protocol.control == "force",
    )


def _place_amplitudes(
    effects: Sequence[Effect], problem: Problem, sample: Sample, where: dict[str, int], fixed: dict[str, float]
) -> None:
    """Add the columns of effects' amplitudes to `where`, or their values to `fixed`."""
    for effect in effects:
        for column in effect.columns():
            name = problem.column(column, sample)
            if name in problem.names:
                where[column] = problem.names.index(name)
            else:
                fixed[column] = problem.prior.fixed[name]


def _times(sample: Sample, durations: Array) -> dict[str, Any]:
    """The distinct times of a `Ridge`, and where holds that last so long (H,) begin and end among them."""
    times, which = np.unique([*_seen(sample, durations), durations], return_inverse=True)
    first, last, end = which.reshape(3, -1)
    pairs = np.column_stack([first, last])
    between, which_pair = np.unique(pairs, axis=0, return_inverse=True)
    return {"times_s": times, "which_end": end, "between": between, "which_pair": which_pair.reshape(-1)}


def _holds(sample: Sample, tension: Array) -> tuple[HoldContext, ...]:
    """What effects see of the holds, which begin at these tensions (H,)."""
    length = sample.length_ref_mm
    reference = sample.model.tension_ref_N
    typical = sample.model.typical
    contexts = []
    for hold, first in zip(sample.protocol.holds, tension, strict=True):
        begun = np.full((1, 1), first)
        contexts.append(
            HoldContext(
                **hold,
                length_ref_mm=length,
                tension_ref_N=reference,
                theta={},
                initial_tension=begun,
                typical=typical,
            )
        )
    return tuple(contexts)


def _seen(sample: Sample, durations: Array) -> tuple[Array, Array]:
    """(H,) when the first and last reading of each hold were taken; its beginning and end where there are no two."""
    protocol = sample.protocol
    first = protocol.time_s[:, 0]
    last = protocol.time_s[np.arange(len(durations)), protocol.last_reading]
    several = protocol.mask.sum(axis=1) > 1
    return np.where(several, first, 0.0), np.where(several, last, durations)


def _driving(sample: Sample) -> Array:
    """(H,) tensions that drive the creep: as set, or the first readings."""
    if sample.protocol.control == "force":
        return sample.protocol.setting
    recorded = np.flatnonzero(sample.protocol.recorded)
    first = np.interp(np.arange(len(sample.readings)), recorded, sample.readings[recorded, 0, 0])
    # a slack wire drives no creep; a small share of the largest tension stands in for it
    return np.maximum(first, 0.02 * first.max()) if first.max() > 0 else np.ones_like(first)


def _powers(problem: Problem, sample: Sample, log_tension: Array, relative_s: Array) -> tuple[Array, Array]:
    """Log hazards and the log U that suits the losses of a sample's holds best at each of them."""
    prior = problem.prior
    power, exponent = (problem.column(name, sample) for name in ("U", "N"))
    low, middle, high = np.log(prior.distributions[power].ppf([ONE_SD[0], 0.5, ONE_SD[1]]))
    N = prior.fixed[exponent] if exponent in prior.fixed else prior.distributions[exponent].median()
    lost = _lost(sample)
    return suiting_powers(lost, log_tension, relative_s, float(N), float(middle), 0.5 * float(high - low))


def _lost(sample: Sample) -> Array:
    """(H,) what readings show of the creep of each hold, positive while it goes on; nan where there are no two."""
    protocol = sample.protocol
    readings = sample.readings[..., 0]
    first = readings[:, 0]
    last = readings[np.arange(len(readings)), protocol.last_reading]
    changed = last - first if protocol.control == "force" else first - last
    several = protocol.mask.sum(axis=1) > 1
    return np.where(several, changed, np.nan)


def _with_shares(ridge: Ridge, problem: Problem, sample: Sample, columns: ColumnMap, owned: Collection[int]) -> Ridge:
    """The ridge with what is to be sampled by its share: amounts that are half-normal under the prior.

    Of these any sum and any share is possible. What other ridges own stays there.
    """
    for effect in sample.model.effects:
        names = [problem.column(column, sample) for column in effect.columns()]
        if not names or names[0] not in problem.names:
            continue
        amount = problem.names.index(names[0])
        if amount in owned or amount in ridge.shares:
            continue
        edge = columns.edges.get(amount)
        if edge is None or edge.ends:
            continue
        shifted = ridge.shifted
        if effect.in_series and "k1" in shifted and not ridge.elongations:
            ridge = replace(ridge, fixture=amount)
        elif effect.amplitudes[0].is_elongation and effect.place != "strain" and "B" in shifted:
            elongation = _elongation(ridge, problem, effect, names)
            beside = (*ridge.beside, elongation)
            ridge = replace(ridge, beside=beside)
    return ridge


def _elongation(ridge: Ridge, problem: Problem, effect: Effect, names: list[str]) -> Elongation:
    """What an effect with amplitudes of these names adds to the creep of a ridge."""
    columns = [problem.names.index(n) if n in problem.names else problem.prior.fixed[n] for n in names]
    others = {a.name: column for a, column in zip(effect.amplitudes[1:], columns[1:], strict=True)}
    ends = tuple(
        replace(hold, time_s=ridge.times_s[time].reshape(1, 1))
        for hold, time in zip(ridge.holds, ridge.which_end, strict=True)
    )
    return Elongation(problem.names.index(names[0]), effect, others, ends, ridge.kept)
