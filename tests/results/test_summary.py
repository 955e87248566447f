"""What a summary says of draws."""

import numpy as np
import pytest

from wirebayes.results.summary import band


def test_a_band_of_times_that_are_all_but_endless_says_no_sd_and_warns_of_nothing():
    """A warning of numpy is an error in tests; on a terminal it stood between the answer and what to do next."""
    found = band(np.array([1.0e304, 1.1e304, 1.2e304]))
    assert found is not None and found["sd"] == np.inf
    assert found["q50"] == pytest.approx(1.1e304)
    assert band(np.array([1.0, np.inf])) is None
