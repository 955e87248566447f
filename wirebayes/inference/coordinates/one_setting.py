"""Which tests are of one displacement or of one weight."""

import numpy as np

from wirebayes.model.sample import Sample
from wirebayes.numeric.typing import Array

# Of settings that spread by .3 % the stiffness is as open as of equal ones: a third of the fits did not converge
# without the coordinates of one setting. From 15 % on these make no difference.
_ALIKE = 0.1


def is_one_setting(settings: Array) -> bool:
    """Whether positive settings (H,) are so much alike that the readings do not tell the stiffness apart."""
    return bool(np.ptp(settings) <= _ALIKE * settings.max())


def is_one_displacement(sample: Sample) -> bool:
    """Whether a test's holds are at one displacement, taut and the first read, but for rests at zero or below."""
    protocol = sample.protocol
    pulled = protocol.setting > 0.0
    if protocol.control == "force" or not (pulled[0] and protocol.recorded[0]):
        return False
    read = sample.readings[..., 0][protocol.mask & pulled[:, None]]
    return is_one_setting(protocol.setting[pulled]) and bool(read[0] > 0.0 and read[-1] > 0.0)
