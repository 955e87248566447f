"""The types that many modules share."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]  # of numbers; sums of several kinds have no narrower type
Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Ints = NDArray[np.int64]
Indices = NDArray[np.intp]  # what numpy returns when it is asked where
Function = Callable[[Array], Array]
