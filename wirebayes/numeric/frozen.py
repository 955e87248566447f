"""Arrays that nobody changes."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray


def frozen(values: Sequence[float] | NDArray[np.float64]) -> NDArray[np.float64]:
    """A read-only array, so that what was measured stays what was measured."""
    array = np.array(values, dtype=float)
    array.flags.writeable = False
    return array
