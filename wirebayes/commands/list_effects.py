"""The catalogue of effects, for people."""

import inspect
from dataclasses import dataclass

from wirebayes.commands.options import path_of
from wirebayes.effects import catalogue
from wirebayes.strict.files import PathLike
from wirebayes.wire.effect import Amplitude, Effect


@dataclass(frozen=True)
class EffectDescription:
    """One effect of the catalogue.

    Attributes
    ----------
    name : str
        As ``effects=`` of `fit` takes it.
    formula : str
        What it changes, or how.
    meaning : str
        What it says of the wire or the bench.
    amplitudes : tuple of Amplitude
        Its parameters: name, unit, neutral value and prior each. The first is the size of the effect.
    unit : str
        Of the first amplitude.
    scope : {"material", "instrument", "environment", "event"}
        What it belongs to, so what else shares its amplitude.
    shows : str
        What it looks like in the readings.
    meaning_of_weights : str
        What it says of the wire or the bench where weights are set and displacements are read.

    Examples
    --------
    >>> effects["toe"].shows
    'deficit at low tension only'
    """

    name: str
    formula: str
    meaning: str
    amplitudes: tuple[Amplitude, ...]
    unit: str
    scope: str
    shows: str
    meaning_of_weights: str


def list_effects(own_effects: PathLike | None = None) -> list[EffectDescription]:
    """The effects that a model may be missing.

    Parameters
    ----------
    own_effects : path, optional
        A Python file with effects of your own, which join the list.

    Returns
    -------
    list of EffectDescription

    Raises
    ------
    InputError
        The file of effects is wrong.

    Examples
    --------
    >>> effects = {effect.name: effect for effect in wb.list_effects()}
    >>> effects["strain_stiffening"].formula
    'τ = k1 s (1 + c s).'
    >>> effects["sensor_drift"].unit, effects["sensor_drift"].scope
    ('N/s', 'instrument')
    """
    return [_described(kind) for kind in catalogue(path_of(own_effects)).values()]


def _described(kind: type[Effect]) -> EffectDescription:
    formula = inspect.cleandoc(kind.__doc__ or "").split("\n\n")[0]
    unit = kind.amplitudes[0].unit
    weights = kind.sentence_under("force")
    return EffectDescription(kind.name, formula, kind.sentence, kind.amplitudes, unit, kind.scope, kind.shows, weights)
