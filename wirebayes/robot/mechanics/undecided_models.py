"""Draws of a line whose readings leave undecided which effects it has: those of several models as of one."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.result_warnings import Notice
from wirebayes.robot.mechanics.draws import CORE, LENGTH_EXPONENT, UndecidedModels, WireDraws
from wirebayes.sentences import spoken
from wirebayes.wire.effect import Effect


def that_go_together(models: Sequence[WireDraws]) -> list[int]:
    """The models, by their places, that one can hold: not those with another variant of an effect of an earlier one.

    Parameters
    ----------
    models : sequence of WireDraws
        The most probable first, which is always among them.
    """
    known: dict[str, str] = {}
    kept = []
    for place, model in enumerate(models):
        own = {effect.name: effect.key for effect in model.material()}
        if all(known.get(name, key) == key for name, key in own.items()):
            known |= own
            kept.append(place)
    return kept


def draws_of_each(probabilities: Floats, counts: Sequence[int], most: int) -> list[int]:
    """How many draws to take of each model: in proportion to its probability, as far as its draws reach.

    Parameters
    ----------
    probabilities : (m,) array
        Positive; need not sum to one.
    counts : sequence of int
        Draws that there are of each.
    most : int
        Of all together.
    """
    share = probabilities / probabilities.sum()
    total = int(min(most, (np.array(counts) / share).min()))
    ends = np.round(np.cumsum(share) * total).astype(int)
    return np.diff(ends, prepend=0).tolist()


def models_together(models: Sequence[WireDraws]) -> WireDraws:
    """One line of the draws of several models of it, in turn, so that some of them evenly taken are of all models.

    Parameters
    ----------
    models : sequence of WireDraws
        Of one test, the most probable first; as many draws of each as it is probable.
    """
    first = models[0]
    if len(models) == 1:
        return first
    effects = {effect.key: effect for model in models for effect in model.effects}
    united = replace(first, effects=tuple(effects.values()))
    names = list(CORE)
    for effect in united.material():
        names += effect.columns()
    if any(LENGTH_EXPONENT in model.parameters for model in models):
        names.append(LENGTH_EXPONENT)
    of_model = np.repeat(np.arange(len(models)), [model.count for model in models])
    within = np.concatenate([(np.arange(model.count) + 0.5) / model.count for model in models])
    order = np.argsort(within, kind="stable")
    parameters = {name: _of_all(name, models, united.material())[order] for name in names}
    keys = tuple(tuple(effect.key for effect in model.material()) for model in models)
    doubts = dict.fromkeys(doubt for model in models for doubt in model.doubts)
    undecided = UndecidedModels(keys, of_model[order])
    return replace(united, parameters=parameters, undecided=undecided, doubts=tuple(doubts))


def most_probable(line: WireDraws) -> WireDraws:
    """The draws of the most probable model alone, some of them repeated so that there are as many.

    For a calibration, whose unknowns are normal: a normal distribution cannot be of several models.

    Parameters
    ----------
    line : WireDraws
        One without undecided models is returned as it is.
    """
    others = {name: most_probable(other) for name, other in line.others.items()}
    if line.undecided is None:
        return replace(line, others=others)
    own = line.undecided.models[0]
    of_best = np.flatnonzero(line.undecided.of_draw == 0)
    share = len(of_best) / line.count
    rows = of_best[np.arange(line.count) * len(of_best) // line.count]
    left_out = [effect for effect in line.material() if effect.key not in own]
    columns = {column for effect in left_out for column in effect.columns()}
    parameters = {name: values[rows] for name, values in line.parameters.items() if name not in columns}
    effects = tuple(effect for effect in line.effects if effect not in left_out)
    named = " with ".join(spoken(key) for key in own) or "the plain one"
    text = f"of the models that the test leaves undecided only the most probable is used here: {named}"
    doubts = (*line.doubts, Notice("left-out", f"{text}, {100 * share:.0f} %"))
    return replace(line, parameters=parameters, effects=effects, undecided=None, doubts=doubts, others=others)


def _of_all(name: str, models: Sequence[WireDraws], effects: Sequence[Effect]) -> Floats:
    """(n,) values of a parameter, one model after the other."""
    known = [model.parameters[name] for model in models if name in model.parameters]
    elsewhere = _where_missing(name, effects, np.concatenate(known))
    each = [model.parameters.get(name, np.full(model.count, elsewhere)) for model in models]
    return np.concatenate(each)


def _where_missing(name: str, effects: Sequence[Effect], known: Floats) -> float:
    """The value of a parameter in a model without it: neutral, or of a shape, which then has no meaning, the mean."""
    for effect in effects:
        for amplitude, column in zip(effect.amplitudes, effect.columns(), strict=True):
            if column == name:
                return float(known.mean()) if amplitude.is_shape else amplitude.neutral
    return 1.0  # creep is a strain
