"""Predictions of a wire that is let back, by a fit that does not know, or was not shown, what it gives back then."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from wirebayes.result_warnings import Notice
from wirebayes.results.read_back import Stored


def let_back(rows: Sequence[Sequence[Any]], stored: Stored, *, fresh: bool) -> list[Notice]:
    """A warning where holds are predicted that are set lower than the ones before, which a fit cannot rely on.

    A fit hold by hold: of 24 simulated chains of holds, 90 % bands of such holds had 1 to 11 % of the readings, those
    of a fit as one history 81 to 92 %. A fit to a test that never lets the wire back: of 60 simulated wires that keep
    their creep then, 18 of 20 passed their check, and 90 % bands had 60 to 70 % of the readings.

    Parameters
    ----------
    rows : sequence of rows
        Of a table.
    stored : Stored
        A posterior behind it.
    fresh : bool
        Whether the rows are a fresh sample's whole history, before which nothing was tested.
    """
    falling = _falling(rows, stored, fresh=fresh)
    if not falling:
        return []
    lower = f"hold {falling[0]} is set lower than the one before, and"
    if stored.likelihood == "hold":
        text = (
            f"{lower} the fit takes each hold by itself: the creep that a wire gives back then, and what earlier holds "
            "leave to later ones, are not in the prediction, whose bands are wrong by more than they say; fit without "
            "--likelihood hold to predict it"
        )
        return [Notice("left-out", text)]
    if np.any(np.diff(stored.sample.protocol.setting) < 0):
        return []
    text = (
        f"{lower} in the test none was: that the wire gives creep back as it took it is the model's form, not what was "
        "read, and bands are too narrow where it does not; test it with holds that fall, too"
    )
    return [Notice("extrapolation", text)]


def _falling(rows: Sequence[Sequence[Any]], stored: Stored, *, fresh: bool) -> list[int]:
    """Numbers of the holds that are set lower than the ones before."""
    protocol = stored.sample.protocol
    settings: dict[int, float] = {}
    if not fresh:
        tested = zip(protocol.number.tolist(), protocol.setting.tolist(), strict=True)
        settings = {number: setting for number, setting in tested if number >= 0}  # those that were recorded
    asked = {int(row[1]): float(row[2]) for row in rows}
    in_order = sorted((settings | asked).items())
    return [hold for (_, before), (hold, setting) in pairwise(in_order) if hold in asked and setting < before]
