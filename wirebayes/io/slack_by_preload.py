"""A stated preload under which the wire hangs slack in holds where it was read to pull."""

import numpy as np

from wirebayes.io.checked_test import CheckedTest
from wirebayes.io.zero_shifts import slack_below
from wirebayes.numeric.typing import Bools, Floats
from wirebayes.result_warnings import Notice
from wirebayes.sentences import short, some_of
from wirebayes.wire.protocol import Protocol


def slack_by_preload(protocol: Protocol, values: Floats, resolution: float, preload_mm: float | None) -> list[Notice]:
    """Holds in which a wire of a stated preload is not stretched, though it pulls.

    Parameters
    ----------
    values : (H, R) array
        What was read.
    resolution : float
        Of what was read, 0 where it is not stated.
    preload_mm : float or None
        The stretch at displacement zero; None where nobody states it.

    Returns
    -------
    list of Notice
        One, or none.
    """
    if preload_mm is None or not protocol.mask.any():
        return []
    readings = CheckedTest(protocol, values, resolution)
    wrong = _stretched_by_nothing(readings, preload_mm)
    if not wrong.any():
        return []
    numbers = [str(number) for number in readings.number[wrong]]
    first = int(np.flatnonzero(wrong)[0])
    if protocol.control == "force":
        displacement_mm, tension_N = float(readings.each[first].max()), float(readings.setting[first])
    else:
        displacement_mm, tension_N = float(readings.setting[first]), float(readings.each[first].min())
    text = (
        f"a stretch of {preload_mm:g} mm at displacement zero (preload_mm) leaves the wire slack in "
        f"hold{'s' * (len(numbers) > 1)} {some_of(numbers)}, but in hold {numbers[0]} it pulls with "
        f"{short(tension_N, 3)} N at {short(displacement_mm, 4)} mm: check the value and sign of preload_mm, or leave "
        "it out"
    )
    return [Notice("data", text)]


def _stretched_by_nothing(readings: CheckedTest, preload_mm: float) -> Bools:
    """The recorded holds in which every reading shows a pull, and displacement and preload together no stretch."""
    if readings.protocol.control == "force":
        return np.array([float(row.max()) + preload_mm <= 0.0 for row in readings.each])
    least = slack_below(readings)
    pulls = np.array([float(row.min()) > least for row in readings.each])
    return pulls & (readings.setting + preload_mm <= 0.0)
