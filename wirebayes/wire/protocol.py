"""What was done to a wire: the sequence of holds, padded to rectangular arrays."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Protocol:
    """Holds of one test, in order, unrecorded ones included.

    Ragged reading times are padded with zeros to ``R`` columns; `mask` tells real readings.

    Attributes
    ----------
    length_mm : float
        Zero-tension length of the sample before the test.
    displacement_mm : (H,) array
    time_s : (H, R) array
        Time of each reading since its hold began.
    mask : (H, R) bool array
        True where a reading was taken; a row of False is an unrecorded hold.
    duration_s : (H,) array
        How long each hold lasted.
    number : (H,) int array
        The hold numbers of the readings' file; -1 for an unrecorded hold.
    warming_K : (H, R) array or None
        Logged temperature minus the first logged reading.
    reference_C : float or None
        That first logged reading; None where no temperature was logged.
    """

    length_mm: float
    displacement_mm: Floats
    time_s: Floats
    mask: NDArray[np.bool_]
    duration_s: Floats
    number: NDArray[np.int64]
    warming_K: Floats | None = None
    reference_C: float | None = None

    @property
    def recorded(self) -> NDArray[np.bool_]:
        """(H,) True for holds with readings."""
        return np.asarray(self.mask.any(axis=1))

    @property
    def start_s(self) -> Floats:
        """(H,) elapsed time at which each hold begins; moves take none."""
        return np.concatenate([[0.0], np.cumsum(self.duration_s)[:-1]])
