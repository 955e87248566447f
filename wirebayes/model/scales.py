"""The scales of a test, and units made of them: so that no prior and no tolerance has a scale of its own.

A test of a thread and one of a mooring rope look alike when each is written in its own displacement step, its own
typical tension and its own hold duration. Problems are sampled and searched in these units; default priors are numbers
in them (`wirebayes.model.prior`). Natural units, mm, N and s, come back where results leave.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from wirebayes.io.experiment import Experiment
from wirebayes.means import geometric_mean

_SMALLEST_STEP = 1e-3  # of the length: stands in where a test has no displacement at all
TYPICAL_K1_N = 2000.0  # a light line, where nothing is said of a wire that is not tested yet
_DIMENSIONS = {"mm": "length_mm", "N": "tension_N", "s": "time_s"}
_TERM = re.compile("[A-Za-z]+")


@dataclass(frozen=True)
class Units:
    """What a number of one stands for.

    Attributes
    ----------
    length_mm, tension_N, time_s : float
    """

    length_mm: float = 1.0
    tension_N: float = 1.0
    time_s: float = 1.0

    def of(self, unit: str) -> float:
        """How much one of these is in a natural unit.

        Parameters
        ----------
        unit : str
            Of mm, N and s, such as ``mm/(N s)``, ``1/N`` or ``-``; whatever else is in it has no scale.
        """
        above, _, below = unit.partition("/")
        return self._product(above) / self._product(below)

    def _product(self, terms: str) -> float:
        out = 1.0
        for base in _TERM.findall(terms):
            if base in _DIMENSIONS:
                out *= getattr(self, _DIMENSIONS[base])
        return out


NATURAL = Units()


@dataclass(frozen=True)
class Scales:
    """How large things are in a test.

    Attributes
    ----------
    step_mm : float
        Median move between holds that differ; of a single hold its displacement.
    range_mm : float
        From the least to the largest displacement, zero included.
    tension_N : float
        Median of the positive tensions.
    hold_s : float
        Median duration of the recorded holds.
    step_N : float
        Median change of the tension between holds that differ, where it is set; of a single hold its tension. As many
        typical tensions as `step_mm` is ranges where it is read.
    """

    step_mm: float
    range_mm: float
    tension_N: float
    hold_s: float
    step_N: float

    @property
    def units(self) -> Units:
        """Units in which this test's step, tension and hold are one."""
        return Units(self.step_mm, self.tension_N, self.hold_s)


def scales_of(experiments: Sequence[Experiment]) -> Scales:
    """The scales of one test, or the geometric means of several that are fitted together."""
    each = [_scales(experiment) for experiment in experiments]
    return Scales(*(geometric_mean(getattr(s, field.name) for s in each) for field in fields(Scales)))


def planned_scales(experiments: Sequence[Experiment], k1_N: float = TYPICAL_K1_N) -> Scales:
    """Scales of tests that nobody has read yet: the tension is what half the range gives on a wire of this stiffness.

    Parameters
    ----------
    experiments : sequence of Experiment
        Their readings do not count.
    k1_N : float
    """
    found = scales_of(experiments)
    length_mm = geometric_mean(experiment.length_mm for experiment in experiments)
    tension = 0.5 * k1_N * found.range_mm / length_mm
    return replace(found, tension_N=tension, step_N=tension * found.step_mm / found.range_mm)


def _scales(experiment: Experiment) -> Scales:
    recorded = experiment.recorded_holds
    settings = np.array([hold.setting for hold in experiment.holds])
    readings = np.concatenate([hold.readings for hold in recorded]) if recorded else np.zeros(1)
    under_weights = experiment.control == "force"
    places = np.array([hold.readings[0] for hold in recorded]) if under_weights else settings
    step = typical_step(places) or _SMALLEST_STEP * experiment.length_mm
    moved = readings if under_weights else settings
    reach = float(max(moved.max(), 0.0) - min(moved.min(), 0.0)) or step
    tension = typical_tension(settings if under_weights else readings)
    step_N = typical_step(settings) if under_weights else tension * step / reach
    durations = np.array([hold.duration_s for hold in recorded or experiment.holds])
    hold_s = float(np.median(durations)) or float(durations.max()) or 1.0
    return Scales(step, reach, tension, hold_s, step_N)


def typical_step(settings: Sequence[float] | np.ndarray) -> float:
    """Median move between neighbours that differ; of what never moves, its own size, 0 at zero."""
    moves = np.abs(np.diff(settings))
    moved = moves[moves > 0]
    return float(np.median(moved)) if moved.size else float(np.abs(settings[0]))


def typical_tension(tensions: Sequence[float] | np.ndarray) -> float:
    """Median of the positive tensions, N; where there are none, the largest size, or 1."""
    values = np.asarray(tensions, float)
    positive = values[values > 0]
    if positive.size:
        return float(np.median(positive))
    return float(np.abs(values).max(initial=0.0)) or 1.0
