"""Parameters of a fit under the names and in the units in which they are stored."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from wirebayes.json_files.values import UNITS
from wirebayes.model.column_units import parameter_of
from wirebayes.model.problem import Problem
from wirebayes.model.sample import LENGTH_EXPONENT, Sample
from wirebayes.numeric.typing import Array
from wirebayes.wire.away_from_bench import steady_hold
from wirebayes.wire.control import READ_UNIT, SET_UNIT
from wirebayes.wire.effect import Effect
from wirebayes.wire.model import Model
from wirebayes.wire.protocol import Control


def variables(problem: Problem, theta: Array, sample: Sample | None) -> dict[str, Array]:
    """Parameters (chains, draws), of one sample, or of all with those of one sample each along a last axis.

    Parameters
    ----------
    theta : (chains, draws, d) array
    sample : Sample or None
        None for all.
    """
    if sample is None:
        return _together_variables(problem, theta)
    own = _own(problem, theta.reshape(-1, theta.shape[-1]), sample)
    return {name: values.reshape(theta.shape[:2]) for name, values in own.items()}


def length_of_creep_amount(problem: Problem, sample: Sample | None) -> float:
    """Zero-tension length, mm, that B as `variables` has it belongs to; of samples fitted together their mean."""
    if sample is not None:
        return sample.protocol.length_mm
    first = problem.samples[0]
    return first.model.length_ref_mm or first.protocol.length_mm


def _own(problem: Problem, theta: Array, sample: Sample) -> dict[str, Array]:
    """A sample's parameters as they are at its own length, with which it can stand alone."""
    own = problem.parameters(theta, sample)
    return by_length(own, sample.model, sample.protocol.length_mm, sample.length_ref_mm)


def by_length(own: dict[str, Array], model: Model, length_mm: float, reference_mm: float) -> dict[str, Array]:
    """Parameters that depend on the length as they are at this one: alone, a sample has no other to compare with.

    Parameters
    ----------
    own : dict of name to (n,) array
    model : Model
        Of the fit.
    length_mm, reference_mm : float
        Of the sample, and of those that it was fitted with.
    """
    reference_N = model.tension_ref_N
    typical = model.typical
    hold = steady_hold(own, length_mm, reference_N, law=model.law, length_ref_mm=reference_mm, typical=typical)
    out: Any = own
    for effect in (e for e in model.effects if e.compares_lengths):
        amplitudes = {a.name: own[c] for a, c in zip(effect.amplitudes, effect.columns(), strict=True)}
        out = effect.apply(out, amplitudes, hold)
    return dict(out)


def _together_variables(problem: Problem, theta: Array) -> dict[str, Array]:
    """Parameters under their plain names; those of one sample each, or of one instrument, by sample along a last axis.

    An exponent of the length that is fixed is no parameter of a wire: see `fixed_length_exponent`.
    """
    columns = dict(zip(problem.names, np.moveaxis(theta, -1, 0), strict=True))
    fixed = {name: np.full(theta.shape[:-1], value) for name, value in problem.prior.fixed.items()}
    known = columns | fixed
    out: dict[str, Array] = {}
    for name in known:
        plain = parameter_of(name)
        if plain in out or (plain == LENGTH_EXPONENT and name in fixed):
            continue
        if plain == name:
            out[plain] = known[name]
        else:
            of_samples = [problem.column(plain, sample) for sample in problem.samples]
            values = [known[column] for column in of_samples]
            out[plain] = np.stack(values, axis=-1)
    return out


def fixed_length_exponent(problem: Problem, sample: Sample) -> float | None:
    """The power of the length that creep grows with: 1 among samples of one length, None where it is estimated."""
    try:
        column = problem.column(LENGTH_EXPONENT, sample)
    except KeyError:  # of samples of one length
        return 1.0
    return problem.prior.fixed.get(column)


def all_effects(samples: Sequence[Sample]) -> tuple[Effect, ...]:
    """The effects of any of these samples, in an order that is each sample's own: some act on one of them alone."""
    every: list[Effect] = []
    for sample in samples:
        at = 0
        for effect in sample.model.effects:
            keys = [known.key for known in every]
            if effect.key in keys:
                at = keys.index(effect.key) + 1
            else:
                every.insert(at, effect)
                at += 1
    return tuple(every)


def unit_of(name: str, effects: tuple[Effect, ...] = (), controls: Sequence[Control] = ("displacement",)) -> str:
    """Unit of a parameter; where several controls differ in it, of each in turn.

    Parameters
    ----------
    effects : tuple of Effect
    controls : sequence of {"displacement", "force"}
        What was set in the tests that it belongs to.
    """
    each = []
    for control in controls:
        errors = {"sensor_sd": READ_UNIT[control], "setting_sd": SET_UNIT[control]}
        own = {c: e.unit_under(a, control) for e in effects for c, a in zip(e.columns(), e.amplitudes, strict=True)}
        each.append((UNITS | {LENGTH_EXPONENT: "1"} | errors | own).get(name, "1"))
    return " or ".join(dict.fromkeys(each))
