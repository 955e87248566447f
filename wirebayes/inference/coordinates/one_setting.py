"""Which tests are of one displacement or of one weight."""

import numpy as np

from wirebayes.numeric.typing import Array

# Of settings that spread by .3 % the stiffness is as open as of equal ones: a third of the fits did not converge
# without the coordinates of one setting. From 15 % on these make no difference.
_ALIKE = 0.1


def is_one_setting(settings: Array) -> bool:
    """Whether positive settings (H,) are so much alike that the readings do not tell the stiffness apart."""
    return bool(np.ptp(settings) <= _ALIKE * settings.max())
