"""A search in which a wire comes to lie where it begins to pull goes on from there."""

from pathlib import Path

import numpy as np

import wirebayes as wb

TOWERS = Path(__file__).parent / "field" / "camera-slack"
# Of which the session was simulated by an integration that shares no code with the package; 20 mm is their deviation.
REFERENCE_MM = np.array([40.82, -51.11, 8.36, -11.36])


def test_a_wire_that_is_neither_taut_nor_slack_does_not_end_a_search():
    """Four wires above a camera, some slack in some holds: the first search ends 4 nats below, 4 sd from the truth."""
    found = wb.calibrate(
        TOWERS / "towers.toml", TOWERS / "session.csv", tension_sd=2.0, reference_sd=20.0, specimen_spread=0.0
    ).summary()
    assert found["usable"]
    reference = found["references_m"]
    off = (1e3 * np.array(reference["mean"]) - REFERENCE_MM) / (1e3 * np.array(reference["sd"]))
    assert np.abs(off).max() < 3.0
