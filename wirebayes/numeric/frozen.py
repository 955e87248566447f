"""Arrays that nobody changes."""

from collections.abc import Sequence

import numpy as np

from wirebayes.numeric.typing import Floats


def frozen(values: Sequence[float] | Floats) -> Floats:
    """A read-only array, so that what was measured stays what was measured."""
    array = np.array(values, dtype=float)
    array.flags.writeable = False
    return array
