"""Linear algebra on stacks of matrices, with a result for every one of them: NaN where a matrix has none.

At the edge of a posterior a model overflows, a wire goes slack and derivatives vanish. numpy then raises for the whole
stack because of one matrix. Here the results of the others are unchanged to the last bit, and the caller sees which
have none.
"""

from collections.abc import Callable

import numpy as np

from wirebayes.numeric.typing import Array, Bools


def solve(matrices: Array, right: Array) -> Array:
    """Solutions ``(..., d, k)`` of ``(..., d, d)`` systems; NaN where a matrix is singular or not finite."""
    (out,) = _each(lambda a, b: (np.linalg.solve(a, b),), matrices, right)
    return out


def inv(matrices: Array) -> Array:
    """Inverses ``(..., d, d)``; NaN where a matrix is singular or not finite."""
    (out,) = _each(lambda a: (np.linalg.inv(a),), matrices)
    return out


def cholesky(matrices: Array) -> Array:
    """Lower Cholesky factors ``(..., d, d)``, read off the lower halves; NaN where a matrix is not positive."""
    (out,) = _each(lambda a: (np.linalg.cholesky(a),), matrices)
    return out


def eigh(matrices: Array) -> tuple[Array, Array]:
    """Eigenvalues ``(..., d)`` and vectors ``(..., d, d)`` of symmetric matrices; NaN where one is not finite."""
    values, vectors = _each(np.linalg.eigh, matrices)
    return values, vectors


def _each(function: Callable[..., tuple[Array, ...]], matrices: Array, *others: Array) -> tuple[Array, ...]:
    """Results of a numpy function for every matrix of the stack it can be computed for."""
    usable = np.asarray(np.isfinite(matrices).all(axis=(-2, -1)))
    matrices = _harmless(matrices, usable)
    try:
        out = tuple(function(matrices, *others))
    except np.linalg.LinAlgError:  # one of them at least: find out which
        usable = usable & _computable(function, matrices, *others)
        out = tuple(function(_harmless(matrices, usable), *others))
    if usable.all():
        return out
    return tuple(np.where(usable.reshape(*usable.shape, *[1] * (a.ndim - usable.ndim)), a, np.nan) for a in out)


def _harmless(matrices: Array, usable: Bools) -> Array:
    """The stack with the identity for each matrix that is of no use."""
    return matrices if usable.all() else np.where(usable[..., None, None], matrices, np.eye(matrices.shape[-1]))


def _computable(function: Callable[..., tuple[Array, ...]], matrices: Array, *others: Array) -> Bools:
    """Where a function can take the matrices of a stack, ``(...)``, found by trying ever smaller parts of the stack."""
    stack = matrices.shape[:-2]
    flat = matrices.reshape(-1, *matrices.shape[-2:])
    right = []
    for other in others:
        whole = np.broadcast_to(other, (*stack, *other.shape[-2:]))
        right.append(whole.reshape(-1, *other.shape[-2:]))
    computable = np.ones(len(flat), bool)
    parts = [(0, len(flat))]
    while parts:
        first, last = parts.pop()
        part = slice(first, last)
        try:
            function(flat[part], *(other[part] for other in right))
        except np.linalg.LinAlgError:
            if last - first == 1:
                computable[first] = False
            else:
                middle = (first + last) // 2
                parts.append((first, middle))
                parts.append((middle, last))
    return computable.reshape(stack)
