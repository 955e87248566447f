"""Whether what is stated comes true: probabilities of remainders, of names and of families, in five bins."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from wirebayes.discovery.settings import MORE, UNKNOWN_WEIGHT

from .catalogue import EFFECTS
from .rates import Row, rate, weighted_rate
from .rows import accepted_of_group

Bins = list[dict[str, Any]]
BINS = (0.0, 0.2, 0.4, 0.6, 0.8)  # where each begins
WIDTH = 0.2
LEVEL = 0.95  # of the intervals
WITH_FOREIGN = ("without", "foreign", "mixed")  # kinds with an effect that no catalogue has, or not this one


def remainders(rows: list[Row], weights: Mapping[str, float] = {}) -> Bins:
    """How often something is left beside the names.

    Something is left where an effect is foreign, was removed, or is hidden and neither it nor one like it was accepted.

    Parameters
    ----------
    weights : of the cases of each kind, where not all count the same; a kind that is missing counts nothing.
    """
    seen = [r for r in _hiding(rows) if r["remainder"] is not None]
    stated = [r["remainder"] for r in seen]
    left = [not all(accepted_of_group(r)) for r in seen]
    return _binned(stated, left, _of_kinds(seen, weights))


def names(rows: list[Row], weights: Mapping[str, float] = {}) -> Bins:
    """How often an effect is there whose inclusion is stated."""
    each = [(r, name, value) for r in _hiding(rows) for name, value in r["inclusion"].items()]
    there = [name in r["names"] for r, name, _ in each]
    return _binned([value for *_, value in each], there, _of_kinds([r for r, *_ in each], weights))


def families(rows: list[Row], weights: Mapping[str, float] = {}) -> Bins:
    """How often an effect of a family is there whose inclusion is stated."""
    each = [(r, family) for r in _hiding(rows) for family in r["families"]]
    there = [bool(set(family["members"]) & set(r["names"])) for r, family in each]
    return _binned([family["inclusion"] for _, family in each], there, _of_kinds([r for r, _ in each], weights))


def apart(rows: list[Row]) -> dict[str, Bins]:
    """All that is stated, kinds as frequent as the prior expects; and families where all effects are known, or not.

    A family that resembles an effect of no catalogue counts as wrong.
    """
    expected = prior_weights(rows)
    known = [r for r in rows if r["kind"] not in WITH_FOREIGN]
    return {
        "name": names(rows, expected),
        "family": families(rows, expected),
        "family, all effects in the catalogue": families(known),
        "family, an effect in no catalogue": families([r for r in rows if r["kind"] in WITH_FOREIGN]),
        "something else": remainders(rows, expected),
    }


def _hiding(rows: list[Row]) -> list[Row]:
    return [r for r in rows if r["detected"] and r["names"]]


def _of_kinds(rows: list[Row], weights: Mapping[str, float]) -> list[float] | None:
    return [weights.get(r["kind"], 0.0) for r in rows] if weights else None


def _binned(stated: Sequence[float], came_true: Sequence[bool], weights: Sequence[float] | None) -> Bins:
    """What was said on average, and what was found with its interval, for each bin."""
    said, true = np.asarray(stated, dtype=float), np.asarray(came_true, dtype=bool)
    w = np.ones(len(said)) if weights is None else np.asarray(weights, dtype=float)
    which = np.minimum((said / WIDTH).astype(int), len(BINS) - 1)
    out = []
    for i, low in enumerate(BINS):
        own = which == i
        mean = float(np.average(said[own], weights=w[own])) if w[own].sum() > 0 else None
        found = rate(true[own], LEVEL) if weights is None else weighted_rate(true[own], w[own], LEVEL)
        out.append({"from": low, "said": mean, "found": found})
    return out


def prior_weights(rows: list[Row]) -> dict[str, float]:
    """Weight of a case of each kind with which the kinds are as frequent as the prior of `discover` expects.

    A single name has weight 1, so all n of them have n; all pairs together have `MORE` of that, all threes as
    much of the pairs; a remainder beside one name has `MORE` of what the name has without, and a remainder
    alone has `UNKNOWN_WEIGHT`. What the benchmark has no cases of, such as a remainder beside two names, is left out.
    """
    n = len(EFFECTS)
    expected = {
        ("single",): 1.0 * n,
        ("pair", "two", "periodic"): MORE * n,
        ("three",): MORE**2 * n,
        ("mixed",): MORE * n,
        ("without", "foreign"): UNKNOWN_WEIGHT,
    }
    out: dict[str, float] = {}
    for kinds, share in expected.items():
        count = sum(r["kind"] in kinds for r in rows)
        out |= {kind: share / count for kind in kinds if count}
    return out
