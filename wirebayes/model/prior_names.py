"""Whether the priors of a file name something that a model can have."""

import re
from collections.abc import Sequence

from wirebayes.errors import InputError
from wirebayes.io.experiment import Experiment
from wirebayes.model.sample import LENGTH_EXPONENT, MATERIAL, SAMPLE
from wirebayes.strict.hint import hint
from wirebayes.wire.effect import Kinds

PLAIN = (*MATERIAL, *SAMPLE, LENGTH_EXPONENT)


def check_prior_names(experiments: Sequence[Experiment], kinds: Kinds) -> None:
    """Refuse a prior that would count for nothing, whatever effects are added to the model.

    Parameters
    ----------
    experiments : sequence of Experiment
    kinds : mapping of name to Effect
        All effects that a model may have.

    Raises
    ------
    InputError
        A prior names neither a parameter of the plain model nor an amplitude of an effect.
    """
    amplitudes = {name: [f"{name}.{each.name}" for each in kind.amplitudes] for name, kind in kinds.items()}
    of_effects = [column for columns in amplitudes.values() for column in columns]
    for experiment in experiments:
        for name in experiment.priors:
            if name in PLAIN or name in of_effects:
                continue
            key = place_of_prior(experiment, name)
            effect, _, amplitude = name.partition(".")
            if effect in amplitudes and amplitude:
                expected = " or ".join(amplitudes[effect])
                raise InputError(f"{key}: found no amplitude {amplitude} of {effect}, expected {expected}")
            without_form = re.sub("@[^.]*", "", name)  # the amplitudes of all forms of an effect have one name
            meant = hint(without_form, [*sorted(PLAIN), *of_effects])
            expected = f"one of {', '.join(sorted(PLAIN))}, or effect.amplitude as wirebayes effects lists them"
            raise InputError(f"{key}: found no such parameter{meant}, expected {expected}")


def place_of_prior(experiment: Experiment, name: str) -> str:
    """File, line and key of a parameter's prior, for messages."""
    line = experiment.prior_lines.get(name)
    place = f"{experiment.source}, line {line}" if line else f"{experiment.source}"
    return f"{place}: prior.{name}"
