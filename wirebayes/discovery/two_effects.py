"""Two effects together, linearised: what shows beside another effect, and by itself does not.

The parameters may bend to absorb most of two effects where they cannot absorb what is left of either once the other is
there; a setting error takes the place of a slip only until the elastic curve has its form.
"""

from typing import NamedTuple

import numpy as np

from wirebayes.discovery.noise_integral import Expansion, Projected, has_tangent, project, with_each_signature
from wirebayes.numeric.log_sum import log_sum, or_impossible
from wirebayes.numeric.typing import Array, Ints

# effects that are tried beside every other one; those of a pair that shows are hardly ever all farther down
FIRST = 6
# of two signatures, of what is left of the second beside the first: with less they are one direction
LEAST_LEFT = 1e-4


def log_bayes_of_two(x: Expansion, found: Projected, single: Array, plain: Array) -> Array:
    """(n,) log Bayes factor of two effects, summed over pairs; the forms of an effect share its weight.

    One of the two is among the `FIRST` that explain most alone, in its best form. Amplitudes are at their best: what
    their prior takes, and how many pairs there are, is the same for the readings and for all simulations, and left out.

    Parameters
    ----------
    x : Expansion
    found : Projected
        Its inner products.
    single : (n, m) array
        Log evidence of each signature alone.
    plain : (n,) array
        Log evidence of none.
    """
    groups = _forms_of_each(x)
    if len(groups) < 2:
        return np.full(len(single), -np.inf)
    value = _log_evidence(x, found, _leading(single, groups), groups)
    return log_sum(value.reshape(len(value), -1), axis=1) - plain


def log_bayes_of_each_pair(x: Expansion) -> Array:
    """(e, e) log Bayes factor of each effect, in its best form, with each other one in any; of the first row.

    As in `log_bayes_of_two`, for effects in the order of their numbers in `x.kinds`. Each effect alone, in any form, is
    on the diagonal.
    """
    groups = _forms_of_each(x)
    first_row = x.of(np.array([0]))
    if not has_tangent(first_row)[0]:
        return np.full((len(groups), len(groups)), -np.inf)
    found = project(first_row)
    _, by_ratio = with_each_signature(first_row, found)
    single = log_sum(by_ratio, axis=1)
    best = _best_forms(single, groups)
    [of_pairs] = _log_evidence(first_row, found, best, groups)
    of_singles = single[0] + _log_shares(x, groups)
    evidence = np.stack([log_sum(of_pairs[:, group], axis=1) for group in groups], axis=1)
    np.fill_diagonal(evidence, [log_sum(of_singles[group]) for group in groups])
    [none] = _log_evidence_of_none(first_row, found)
    return evidence - none


def _log_evidence_of_none(x: Expansion, found: Projected) -> Array:
    """(n,) without any effect."""
    left = np.maximum(found.rss, x.least[:, None])
    by_ratio = found.shared - 0.5 * x.degrees * np.log(left)
    return log_sum(by_ratio, axis=1)


def _forms_of_each(x: Expansion) -> list[Ints]:
    """The numbers of the signatures of each effect."""
    return [np.flatnonzero(x.kinds == kind) for kind in np.unique(x.kinds[x.kinds >= 0])]


def _log_evidence(x: Expansion, found: Projected, first: Ints, groups: list[Ints]) -> Array:
    """(n, j, m) of some signatures (n, j) with each one of another effect; forms share the weight of their effect."""
    unexplained = found.rss[:, :, None, None] - _explained(x, found, first)
    left = np.maximum(unexplained, x.least[:, None, None, None])
    shared = found.shared[:, :, None, None]
    with np.errstate(invalid="ignore"):  # what explains nothing, with as many readings as parameters
        evidence = log_sum(shared - 0.5 * x.degrees * np.log(left), axis=1)
    # with no more readings than parameters, what explains nothing has no finite evidence
    evidence = or_impossible(evidence)
    prior = _log_shares(x, groups)
    prior_of_first = prior[first][:, :, None]
    kind_of_first = x.kinds[first][:, :, None]
    value = evidence + prior_of_first + prior
    return np.where(kind_of_first != x.kinds, value, -np.inf)


def _log_shares(x: Expansion, groups: list[Ints]) -> Array:
    """(m,) log prior of each signature among those of its effect; twice as dense where it has one sign."""
    prior = np.full(len(x.kinds), -np.inf)
    for group in groups:
        prior[group] = np.where(x.one_sided[group], np.log(2.0), 0.0) - np.log(len(group))
    return prior


def _best_forms(single: Array, groups: list[Ints]) -> Ints:
    """(n, e) the signature of each effect that explains most."""
    return np.stack([group[np.argmax(single[:, group], axis=1)] for group in groups], axis=1)


def _leading(single: Array, groups: list[Ints]) -> Ints:
    """(n, j) the best signatures of the effects that explain most."""
    best = _best_forms(single, groups)
    order = np.argsort(-np.take_along_axis(single, best, axis=1), axis=1, kind="stable")
    return np.take_along_axis(best, order[:, :FIRST], axis=1)


def _explained(x: Expansion, found: Projected, first: Ints) -> Array:
    """(n, k, j, m) of the sum of squares by some signatures with each one; -inf where an amplitude has no meaning."""
    each = _Signatures(found.along[:, :, None, :], found.divisor[:, :, None, :])
    leading = _Signatures.chosen(found, first)
    cross = found.form.of(first).products(found.form, found.shrink)
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        determinant = leading.square * each.square - cross**2
        of_leading = leading.beside(each, cross) / determinant
        of_each = each.beside(leading, cross) / determinant
        explained = of_leading * leading.along + of_each * each.along
        are_two = determinant > LEAST_LEFT * leading.square * each.square
    possible = are_two & np.isfinite(explained)
    either_sign = ~x.one_sided
    possible &= (of_leading >= 0.0) | either_sign[first][:, None, :, None]
    possible &= (of_each >= 0.0) | either_sign
    return np.where(possible, explained, -np.inf)


class _Signatures(NamedTuple):
    """What the readings have along signatures, and the squares of these; arrays that broadcast with one another's."""

    along: Array
    square: Array

    @classmethod
    def chosen(cls, found: Projected, numbers: Ints) -> "_Signatures":
        """Signatures with the numbers (n, j), as (n, k, j, 1)."""
        at = numbers[:, None]
        along = np.take_along_axis(found.along, at, axis=2)
        square = np.take_along_axis(found.divisor, at, axis=2)
        return cls(along[..., None], square[..., None])

    def beside(self, other: "_Signatures", cross: Array) -> Array:
        """Best amplitudes with the others at their best, times the determinant of their products.

        Of these `cross` are those of one with the other.
        """
        return other.square * self.along - cross * other.along
