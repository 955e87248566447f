"""Steps away from a saddle of the energy, where Newton's method would stay."""

import numpy as np

from wirebayes.numeric.batches import batch_first
from wirebayes.numeric.typing import Floats


def off_saddle(H: Floats, gradient: Floats, level: Floats, floor: Floats) -> Floats:
    """Newton's step with every curvature taken as positive: away from a saddle, twice as far each time.

    Shifting the whole Hessian until it is positive instead takes ever smaller steps the nearer the saddle is.

    Parameters
    ----------
    H : (d, d, n) array
        Only the upper triangle is read.
    gradient : (d, n) array
    level : (n,) array
        The stiffness if every wire were taut; less than its rounding is none.
    floor : (n,) array
        Force below which none can be trusted: it leads nowhere.

    Returns
    -------
    (d, n) array
        NaN where the stiffness has overflowed: no step from there is better.
    """
    finite = np.isfinite(H).all((0, 1))
    known = np.where(finite, H, 0.0)
    curvature, along = np.linalg.eigh(batch_first(known), UPLO="U")
    slope = np.einsum("nij,in->nj", along, gradient)
    slope = np.where(np.abs(slope) > floor[:, None], slope, 0.0)
    least = np.finfo(float).eps * level[:, None]
    stiffness = np.maximum(np.abs(curvature), least)
    step = -np.einsum("nij,nj->in", along, slope / stiffness)
    return np.where(finite, step, np.nan)
