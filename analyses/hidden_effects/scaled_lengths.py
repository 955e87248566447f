"""Two lengths of one line, each in a test of its own, and effects that only their comparison shows."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .rig import Array
from .scaled_cases import EVERY, OF_LENGTHS, ScaledCase
from .scaled_law import Hidden
from .scaled_sizes import PLAIN, Signatures, basis_of

DEPENDENT = ("k1", "B", "U", "N")  # parameters that may depend on the length beyond what the plain model says
_OF_ONE_TEST = ("grip_slip", "unrecorded_hold", "prior_creep")


@dataclass(frozen=True)
class TwoLengths(Signatures):
    """Two tests of one line; what is the line's they have in common, B in proportion to the length.

    Attributes
    ----------
    parts : (ScaledCase, ScaledCase)
    """

    parts: tuple[ScaledCase, ScaledCase]

    @property
    def _length_mm(self) -> float:
        """The length of which parameters that depend on it are stated."""
        return float(np.sqrt(self.parts[0].test.length_mm * self.parts[1].test.length_mm))

    @cached_property
    def typical_tension_N(self) -> float:
        """Geometric mean of the tensions to which powers refer in the tests."""
        return float(np.sqrt(self.parts[0].test.tension_ref_N * self.parts[1].test.tension_ref_N))

    @cached_property
    def typical_hold_s(self) -> float:
        """Geometric mean of the median holds of the tests."""
        first, second = (float(np.median(part.test.durations_s)) for part in self.parts)
        return float(np.sqrt(first * second))

    def _each_with(self, hidden: Hidden) -> list[tuple[ScaledCase, Hidden]]:
        """Each test with the truth that it has under an effect, and what of the effect acts on it."""
        if hidden.name == "length_dependence":
            return [(self._at_own_length(part, hidden), Hidden()) for part in self.parts]
        acts_on = int(hidden.shapes.get("test", -1.0))
        return [(part, hidden if acts_on in (-1, i) else Hidden()) for i, part in enumerate(self.parts)]

    def _at_own_length(self, part: ScaledCase, hidden: Hidden) -> ScaledCase:
        """A test with the truth at its length; creep at the typical tension and after a typical hold is what it was."""
        name = DEPENDENT[int(hidden.shapes["which"])]
        truth = part.truth
        changed = truth[name] * (part.test.length_mm / self._length_mm) ** hidden.amplitude
        bent = truth | {name: changed}
        bent["B"] *= self.typical_tension_N ** (truth["U"] - bent["U"])
        bent["k2"] *= self.typical_hold_s ** (truth["N"] - bent["N"])
        return replace(part, truth=bent)

    def noise_free(self, hidden: Hidden = Hidden()) -> Array:  # noqa: B008 - it is frozen
        return np.concatenate([part.noise_free(own) for part, own in self._each_with(hidden)])

    def measured(self, hidden: Hidden, rng: np.random.Generator) -> list[Array]:
        """Readings with noise, of each test."""
        return [part.measured(own, rng) for part, own in self._each_with(hidden)]

    def whitened(self, dy: Array) -> Array:
        first = len(self.parts[0].plain)
        rows = (dy[:first], dy[first:])
        return np.concatenate([part.whitened(own) for part, own in zip(self.parts, rows, strict=True)])

    @property
    def moves(self) -> int:
        return len(PLAIN) + 1

    def moved(self, by: Array) -> Array:
        """The last two are the preloads."""
        common, preloads = by[: len(PLAIN) - 1], by[len(PLAIN) - 1 :]
        each = [np.append(common, preload) for preload in preloads]
        return np.concatenate([part.moved(own) for part, own in zip(self.parts, each, strict=True)])

    @cached_property
    def basis(self) -> Array:
        one, other = self.parts
        columns = []
        for name in PLAIN:
            of_one, of_other = (part.truth[name] * part.by(name) for part in self.parts)
            if name == "preload":  # of each test its own
                columns.append(np.append(one.by(name), 0.0 * of_other))
                columns.append(np.append(0.0 * of_one, other.by(name)))
            else:
                columns.append(np.append(of_one, of_other))
        return basis_of(np.stack([self.whitened(column) for column in columns], axis=1))

    def largest(self, name: str) -> float:
        return min(part.largest(name) for part in self.parts)

    def shown(self) -> list[str]:
        one, other = (part.shown() for part in self.parts)
        return list(dict.fromkeys([*one, *other, *OF_LENGTHS]))

    def forms(self, name: str, rng: np.random.Generator | None = None) -> Iterator[Hidden]:
        if name in OF_LENGTHS:
            yield from _of_lengths(name, rng)
            return
        for i, part in enumerate(self.parts):
            if name not in part.shown():
                continue
            for form in part.forms(name, rng):
                yield replace(form, shapes=form.shapes | {"test": float(i)}) if name in _OF_ONE_TEST else form
            if name not in _OF_ONE_TEST:
                return


def _of_lengths(name: str, rng: np.random.Generator | None) -> Iterator[Hidden]:
    """The forms of an effect that only two lengths show, or one of them drawn at random."""
    which = range(len(DEPENDENT)) if name == "length_dependence" else [0]
    every = [Hidden(name, float(sign), {"which": float(w)}) for sign in EVERY[name].signs for w in which]
    if rng is None:
        yield from every
    else:
        yield every[int(rng.integers(len(every)))]
