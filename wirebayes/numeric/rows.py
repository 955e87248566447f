"""Rows of arrays, picked."""

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from wirebayes.numeric.typing import Array, Bools

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Record = TypeVar("Record", bound="DataclassInstance")


def chosen_rows(first: Bools, one: Array, other: Array | float) -> Array:
    """The rows of one array or of another.

    Parameters
    ----------
    first : (n,) bool array
        True where the row is of `one`.
    one : (n, ...) array
    other : (n, ...) array or float
    """
    return np.where(first.reshape(-1, *[1] * (one.ndim - 1)), one, other)


def pair_at(pair: tuple[Array, Array], rows: Any) -> tuple[Array, Array]:
    """Some rows of both arrays ``(n, ...)`` of a pair, by number or mask."""
    one, other = pair
    return one[rows], other[rows]


def rows_of(record: Record, rows: Any) -> Record:
    """A dataclass of arrays ``(n, ...)`` with some rows of each, by number or mask."""
    return replace(record, **{f.name: getattr(record, f.name)[rows] for f in fields(record)})


def put_rows(out: Record, rows: Any, found: Record) -> None:
    """Put the rows of a dataclass of arrays ``(k, ...)`` in place of others, by number or mask.

    Parameters
    ----------
    out : dataclass of arrays
        Changed in place.
    rows : (k,) int array, or mask
        Where they are put.
    found : dataclass of the same kind
    """
    for f in fields(out):
        getattr(out, f.name)[rows] = getattr(found, f.name)


def joined_rows(records: Sequence[Record], axis: int = 0) -> Record:
    """Dataclasses of arrays ``(n, ...)`` one after the other, or along another axis."""
    first = records[0]
    joined = {f.name: np.concatenate([getattr(r, f.name) for r in records], axis) for f in fields(first)}
    return replace(first, **joined)


def last_axis_of(record: Record, columns: Any) -> Record:
    """A dataclass of arrays ``(..., n)`` with some columns of each, by number or mask; what has a `part` is asked."""
    values = {f.name: getattr(record, f.name) for f in fields(record)}
    parts = {name: v[..., columns] if isinstance(v, np.ndarray) else v.part(columns) for name, v in values.items()}
    return replace(record, **parts)
