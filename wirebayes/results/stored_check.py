"""What a stored posterior must satisfy before anything is computed from it."""

from collections.abc import Mapping
from typing import Any, get_args

import numpy as np

from wirebayes.model.prior import ABOVE_ZERO, NOT_BELOW_ZERO
from wirebayes.model.sample import Likelihood, Sample
from wirebayes.numeric.typing import Array
from wirebayes.wire.laws import ElasticLaw, History

_LARGEST = 1e30  # no parameter, time or tension comes near, and its square does not overflow


def check_stored(draws: Mapping[str, Array], sample: Sample, likelihood: str) -> None:
    """Raise a `ValueError` that says what is wrong with a posterior that was read back.

    Parameters
    ----------
    draws : mapping of name to (n,) array
    """
    _check_words(sample, likelihood)
    _check_draws(draws, sample, likelihood)
    _check_shapes(sample)
    _check_numbers(sample)


def _check_words(sample: Sample, likelihood: str) -> None:
    """Law, history and likelihood are those that there are."""
    for what, value, known in (
        ("elastic law", sample.model.law, get_args(ElasticLaw)),
        ("history", sample.model.history, get_args(History)),
        ("likelihood", likelihood, get_args(Likelihood)),
    ):
        if value not in known:
            raise ValueError(f"{what} {value!r}")


def _check_draws(draws: Mapping[str, Array], sample: Sample, likelihood: str) -> None:
    """Every parameter of the model has draws, and each a value that it can have."""
    needed = [*sample.parameters(likelihood)]  # type: ignore[arg-type]
    needed += [column for effect in sample.model.effects for column in effect.columns()]
    missing = [name for name in needed if name not in draws]
    if missing:
        raise ValueError(f"no draws of {', '.join(missing)}")
    for name, values in draws.items():
        if len(values) < 2 or not _usable(values):
            raise ValueError(f"draws of {name} that are too few or no finite numbers")
        if (name in ABOVE_ZERO and values.min() <= 0) or (name in NOT_BELOW_ZERO and values.min() < 0):
            raise ValueError(f"draws of {name} below zero")


def _check_shapes(sample: Sample) -> None:
    """Arrays of holds and of readings belong together."""
    protocol = sample.protocol
    mask = sample.protocol.mask
    holds = len(protocol.setting)
    for what, array in (("durations", protocol.duration_s), ("hold numbers", protocol.number)):
        if array.shape != (holds,):
            raise ValueError(f"{len(array)} {what} for {holds} holds")
    if mask.ndim != 2 or not mask.any() or len(mask) != holds:
        raise ValueError("no readings")
    of_readings = [protocol.time_s, sample.readings[..., 0]]
    if protocol.warming_K is not None:
        of_readings.append(protocol.warming_K)
    for array in of_readings:
        if array.shape != mask.shape:
            raise ValueError("readings, times and temperatures that do not belong together")


def _check_numbers(sample: Sample) -> None:
    """Numbers are finite and have the sign that they must have."""
    protocol = sample.protocol
    numbers: dict[str, Any] = {
        "length": protocol.length_mm,
        "displacements": protocol.setting,
        "times": protocol.time_s,
        "durations": protocol.duration_s,
        "tensions": sample.readings[..., 0],
        "resolution": sample.resolution,
        "reference tension": sample.model.tension_ref_N,
        "typical tension": sample.model.typical.tension_N,
        "typical hold": sample.model.typical.hold_s,
    }
    for what, value in numbers.items():
        if not _usable(np.asarray(value)):
            raise ValueError(f"{what} that are no finite numbers")
    for what in ("times", "durations", "resolution"):
        if np.min(numbers[what]) < 0:
            raise ValueError(f"{what} below zero")
    for what in ("length", "reference tension", "typical tension", "typical hold"):
        if numbers[what] <= 0:
            raise ValueError(f"{what} that is not above zero")


def _usable(values: Array) -> bool:
    return values.dtype.kind in "fiu" and bool((np.abs(values) < _LARGEST).all())
