"""The compiled twin of the staircase and its filter: whether it was built, and what it is called with.

It computes models whose effects all have a formula in `wirebayes/wire/_kernel.pyx`; numpy computes the others, and
everything where no C compiler was at hand. Both agree to rounding. Which of the two computes depends on the model and
on the installation, never on the work, so the same seed gives the same bytes.
"""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from wirebayes.numeric.typing import Array, Ints
from wirebayes.wire.protocol import Protocol

if TYPE_CHECKING:
    from wirebayes.wire.edges import FirstReadings
    from wirebayes.wire.model import Model

try:
    from wirebayes.wire import _kernel
except ImportError:
    _kernel = None  # type: ignore[assignment]

kernel = _kernel  # None where it was not built

_PLAIN = ("k1", "B", "U", "k2", "N", "preload")


_NONE, _NOT_READ, _NO_COLUMN = np.empty(0), np.empty((0, 0)), np.empty(0, np.intp)


class Call(NamedTuple):
    """What the kernel's functions of a model are called with."""

    test: Any
    law: Any
    theta: Array


def call(protocol: Protocol, theta: Mapping[str, Array], model: "Model") -> Call | None:
    """What the kernel is called with, or None where numpy has to compute.

    Parameters
    ----------
    theta : mapping of name to (n,) array
    """
    if kernel is None or len(model.effects) > kernel.MOST_EFFECTS or model.compiled is None:
        return None
    columns, formulas = model.compiled
    rows = [theta[name] for name in (*_PLAIN, *columns)]
    if any(row.dtype.kind == "c" for row in rows):
        return None
    remembers = any(name == "superposition" for name, _, _ in formulas)
    test = protocol.flat_with_ages if remembers else protocol.flat
    return Call(kernel.Test(**test), _law_of(model, protocol.length_mm, formulas), _packed(rows))


class AtSlack(NamedTuple):
    """What the kernel is told of edges beyond which the wire is slack.

    The standard deviations (n,) of setting errors, mm, and the first reading (H, n) or (H, 1) of each hold, its column
    (H,), and the variance (n,) of a reading; all empty where they are not known, or where none can leave a wire slack.
    """

    spread: Array
    first: Array
    column: Ints
    variance: Array


def at_slack(protocol: Protocol, theta: Mapping[str, Array], read: "FirstReadings | None") -> AtSlack:
    """What the kernel is told of edges.

    Parameters
    ----------
    protocol : Protocol
    theta : mapping of name to (n,) array
    read : FirstReadings, optional
    """
    spread = _NONE
    if protocol.control == "displacement" and "setting_sd" in theta:
        spread = np.ascontiguousarray(theta["setting_sd"], float)
    if read is None or not len(spread):
        return AtSlack(spread, _NOT_READ, _NO_COLUMN, _NONE)
    variance = np.ascontiguousarray(np.broadcast_to(read.variance, spread.shape), float)
    return AtSlack(spread, np.asarray(read.value, float), read.column, variance)


def _packed(rows: Sequence[Array]) -> Array:
    """Parameters (n,) in one array."""
    packed = np.empty((len(rows), len(rows[0])))
    for i, row in enumerate(rows):
        packed[i] = row
    return packed


def _law_of(model: "Model", length_mm: float, formulas: tuple[tuple[str, int, float], ...]) -> Any:
    """The kernel's law of a model for a wire of this length, with its effects' formulas."""
    length_ref_mm = model.length_ref_mm or length_mm
    log_ratio = float(np.log(length_mm / length_ref_mm))
    kept = 1.0 if model.history == "saturating" else 0.0
    return _law(model.law == "modified", kept, model.tension_ref_N, log_ratio, formulas)


@lru_cache(maxsize=256)
def _law(
    modified: bool, kept: float, tension_ref_N: float, log_ratio: float, formulas: tuple[tuple[str, int, float], ...]
) -> Any:
    """The kernel's law, of which every evaluation of a model needs the same."""
    for name, _, _ in formulas:
        if name not in kernel.FORMULAS:
            raise LookupError(f"the compiled kernel has no formula {name!r}: build it again, as CONTRIBUTING says")
    return kernel.Law(modified, kept, tension_ref_N, log_ratio, formulas)
