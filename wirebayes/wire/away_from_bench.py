"""A wire away from the bench: the hold that its effects see."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from wirebayes.numeric.typing import Array
from wirebayes.wire.effect import ONE_NEWTON_AND_SECOND, HoldContext, Typical
from wirebayes.wire.laws import ElasticLaw


def steady_hold(
    theta: Mapping[str, Array],
    length_mm: Any,
    tension_ref_N: float,
    *,
    law: ElasticLaw = "hooke",
    length_ref_mm: Any = None,
    typical: Typical = ONE_NEWTON_AND_SECOND,
    index: int = 0,
    start_s: float = 0.0,
    tension_N: Array | None = None,
    carried_mm: Array | None = None,
) -> HoldContext:
    """A hold away from the bench: no displacement, no temperature, no earlier holds unless `index` says so.

    Parameters
    ----------
    theta : mapping of name to array
        All parameters of the model.
    length_mm, length_ref_mm : float or array
        The reference is the length itself when left out.
    typical : Typical
        Of the tests that the parameters are known from.
    law : {"hooke", "modified"}
    index, start_s : int, float
        Number of earlier holds, and the time since the first of them began.
    tension_N, carried_mm : array, optional
        When the hold begins; zero when left out.
    """
    zero = np.zeros((1, 1))
    return HoldContext(
        index=index,
        recorded=True,
        order=float(index),
        setting=0.0,
        displacement_mm=0.0,
        direction=1,
        first_direction=1,
        start_s=start_s,
        duration_s=0.0,
        time_s=zero,
        warming_K=zero,
        length_mm=length_mm,
        length_ref_mm=length_mm if length_ref_mm is None else length_ref_mm,
        tension_ref_N=tension_ref_N,
        theta=dict(theta),
        initial_tension=zero if tension_N is None else tension_N,
        carried=zero if carried_mm is None else carried_mm,
        zero_mm=np.full((1, 1), 1.0) * length_mm,
        law=law,
        typical=typical,
    )
