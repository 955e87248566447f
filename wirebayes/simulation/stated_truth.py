"""What a user states of the truth behind a simulated test: effects with their amplitudes, and numbers."""

import numpy as np

from wirebayes.effects import CATALOGUE, effect_named
from wirebayes.errors import InputError
from wirebayes.wire.effect import Effect, Kinds


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
