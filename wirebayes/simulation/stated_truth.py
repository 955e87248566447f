"""What a user states of the truth behind a simulated test: effects with their amplitudes, and numbers."""

from collections.abc import Sequence

import numpy as np

from wirebayes.effects import CATALOGUE, effect_named
from wirebayes.errors import InputError
from wirebayes.model.sample import Sample
from wirebayes.simulation.synthetic import Simulated
from wirebayes.wire.effect import Effect, Kinds
from wirebayes.wire.staircase import simulate


def effect_option(text: str, known: Kinds = CATALOGUE) -> tuple[Effect, dict[str, float]]:
    """An effect and the amplitude given with it, from ``NAME``, ``NAME.p=VALUE`` or ``NAME@HOLD.p=VALUE``.

    Parameters
    ----------
    known : mapping of name to effect class, optional

    Raises
    ------
    InputError
        If there is no such effect or parameter, or the value is no number.
    """
    left, equals, value = text.partition("=")
    if not equals:
        return effect_named(text, known), {}
    key, _, parameter = left.rpartition(".")
    effect = effect_named(key or left, known)
    own = [amplitude.name for amplitude in effect.amplitudes]
    if parameter not in own:
        raise InputError(f"--effect {text}: {effect.name} has no amplitude {parameter!r}; it has {', '.join(own)}")
    return effect, {f"{effect.name}.{parameter}": finite_number(f"--effect {text}", value)}


def finite_number(key: str, text: str) -> float:
    """A finite number, or an `InputError` that names `key`."""
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise InputError(f"{key}: found {text!r}, expected a finite number")
    return value


def without_trace(made: Simulated, effects: Sequence[Effect]) -> list[Effect]:
    """The effects that leave every reading as it would be without them, though they have a size.

    Parameters
    ----------
    made : Simulated
    effects : sequence of Effect
        Of its truth.
    """
    out = []
    for effect in effects:
        # by its key: a sample's model may have it with a prior of its own
        acting = [s for s in made.problem.samples if effect.key in {own.key for own in s.model.effects}]
        if not any(_is_neutral_or_shows(made, sample, effect) for sample in acting):
            out.append(effect)
    return out


def _is_neutral_or_shows(made: Simulated, sample: Sample, effect: Effect) -> bool:
    """Whether an effect of a sample changes its readings, or has the amplitude that changes nothing."""
    column = effect.amplitude_column
    own = made.problem.parameters(made.theta, sample)
    neutral = np.full(1, effect.amplitudes[0].neutral)
    if own[column] == neutral:
        return True
    mask = sample.protocol.mask
    there = simulate(sample.protocol, own, sample.model)[mask]
    without = simulate(sample.protocol, own | {column: neutral}, sample.model)[mask]
    return not np.array_equal(there, without)
