"""Gross errors: single readings that no effect explains, excluded before the tests that follow."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from wirebayes.discovery.linear_scan import AddedColumns, expand, scan
from wirebayes.discovery.refit import occam
from wirebayes.inference.laplace_fit import LaplaceFit
from wirebayes.io.experiment import Experiment
from wirebayes.json_files.discovery import GrossError
from wirebayes.numeric.typing import Array
from wirebayes.result_warnings import Notice

MOST = 0.05  # share of readings that may be called gross errors


class SuspectReading(NamedTuple):
    """A reading that may be a gross error.

    Attributes
    ----------
    experiment : str
    hold : int
        Its number.
    place : int
        Of the reading among those of the hold that are left, from 0.
    log_bayes : float
    """

    experiment: str
    hold: int
    place: int
    log_bayes: float


def suspect(block: LaplaceFit, rival: float) -> SuspectReading | None:
    """The reading most likely to be a gross error, if any.

    `rival` is the log Bayes factor of the best effect; a gross error must beat it and chance by a clear margin.
    """
    samples = block.target.problem.samples
    cells = []
    for at, sample in enumerate(samples):
        cells += [(at, j, r) for j, r in np.argwhere(sample.protocol.mask)]
    columns = _one_reading_each(cells)
    x = expand(block.target, block.z, [], columns=columns)
    effects = scan(x).effects[0]
    best = int(np.argmax(effects))
    value = float(effects[best]) + occam(False) - np.log(len(cells))
    if value < max(3.0, rival + 2.0):
        return None
    at, j, r = cells[best]
    sample = samples[at]
    number = int(sample.protocol.number[j])
    return SuspectReading(sample.name, number, int(r), value)


def _one_reading_each(cells: Sequence[tuple[int, int, int]]) -> AddedColumns:
    """What makes the columns (see `expand`) that move one reading each: sample, row of the hold, reading."""

    def columns(at: int, tension: Array, slopes: Array) -> Array:
        out = np.zeros((*tension.shape, len(cells)))
        for i, (of_sample, j, r) in enumerate(cells):
            if of_sample == at:
                out[j, r, :, i] = 1.0
        return out

    return columns


def without(experiment: Experiment, hold: int, reading: int) -> Experiment:
    """The experiment with one reading struck out; the hold keeps its duration.

    Parameters
    ----------
    experiment : Experiment
    hold : int
        Its number in the readings' file.
    reading : int
        Position in the hold, from 0.

    Returns
    -------
    Experiment
    """
    holds = []
    for h in experiment.holds:
        if h.number == hold:
            h = h.of_readings(np.arange(len(h.time_s)) != reading)
        holds.append(h)
    return replace(experiment, holds=tuple(holds))


def place_in_file(left: int, struck: Sequence[int]) -> int:
    """Position of a reading in its hold as the file has it, from its position among those that are left.

    Parameters
    ----------
    left : int
    struck : sequence of int
        Positions, in the file, of the readings of the hold that were struck out before.
    """
    place = left
    for gone in sorted(struck):
        place += gone <= place
    return place


def in_words(error: GrossError) -> Notice:
    """The warning of a reading that was struck out.

    Parameters
    ----------
    error : dict
        As in ``discovery.json``.
    """
    which = f"reading {error['reading'] + 1} of hold {error['hold']}"
    return Notice("gross-error", f"{which} looks like a gross error and was set aside: correct or remove it")


def readings_of(experiments: Sequence[Experiment]) -> int:
    """Number of readings."""
    return sum(len(h.time_s) for e in experiments for h in e.holds)
