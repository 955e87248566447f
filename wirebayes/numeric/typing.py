"""The types that many modules share."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]  # of numbers; sums of several kinds have no narrower type
Floats = NDArray[np.float64]
