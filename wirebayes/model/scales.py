"""The scales of a test, and units made of them: so that no prior and no tolerance has a scale of its own.

A test of a thread and one of a mooring rope look alike when each is written in its own displacement step, its own
typical tension and its own hold duration. Problems are sampled and searched in these units; default priors are numbers
in them (`wirebayes.model.prior`). Natural units, mm, N and s, come back where results leave.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from wirebayes.io.experiment import Experiment
from wirebayes.numeric.means import geometric_mean

MOST_OF_SPAN = 10.0  # times what was seen: weights that hardly differ show little but creep, some tenth of the stretch
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
        Median move between holds that differ in what is set; of a single hold its displacement.
    range_mm : float
        From the least to the largest displacement, zero included. Under weights, where the zero of a gauge is
        arbitrary, from the wire without tension to the largest displacement, by proportion of the weights.
    tension_N : float
        Median of the positive tensions.
    hold_s : float
        Median duration of the recorded holds.
    step_N : float
        Median change of the tension between holds that differ, where it is set; of a single hold its tension. As many
        typical tensions as `step_mm` is ranges where it is read.
    zeros_mm : mapping of name to float
        Of each test under weights: what the gauge shows of the wire without tension, by proportion of the weights.
    """

    step_mm: float
    range_mm: float
    tension_N: float
    hold_s: float
    step_N: float
    zeros_mm: Mapping[str, float] = field(default_factory=dict)

    @property
    def units(self) -> Units:
        """Units in which this test's step, tension and hold are one."""
        return Units(self.step_mm, self.tension_N, self.hold_s)


def scales_of(experiments: Sequence[Experiment]) -> Scales:
    """The scales of one test, or the geometric means of several that are fitted together."""
    each = [_under_weights(e) if e.control == "force" else _under_steps(e) for e in experiments]

    def mean(name: str) -> float:
        return geometric_mean(getattr(one, name) for one in each)

    zeros = {name: zero for one in each for name, zero in one.zeros_mm.items()}
    return Scales(mean("step_mm"), mean("range_mm"), mean("tension_N"), mean("hold_s"), mean("step_N"), zeros)


def planned_scales(experiments: Sequence[Experiment], k1_N: float = TYPICAL_K1_N) -> Scales:
    """Scales of tests that nobody has read yet, on a wire of this stiffness.

    Where displacements are set, the tension is what half the range gives; where weights are, each stretches the wire as
    if it did not creep.

    Parameters
    ----------
    experiments : sequence of Experiment
        Their readings do not count.
    """
    found = scales_of([_stretched(e, k1_N) if e.control == "force" else e for e in experiments])
    if all(e.control == "force" for e in experiments):
        return found
    length_mm = geometric_mean(experiment.length_mm for experiment in experiments)
    tension = 0.5 * k1_N * found.range_mm / length_mm
    return replace(found, tension_N=tension, step_N=tension * found.step_mm / found.range_mm)


def _stretched(experiment: Experiment, k1_N: float) -> Experiment:
    """A test under weights with the readings of a wire that only stretches."""
    holds = [
        replace(hold, readings=np.full(hold.time_s.size, experiment.length_mm * hold.setting / k1_N))
        for hold in experiment.holds
    ]
    return replace(experiment, holds=tuple(holds))


def _under_steps(experiment: Experiment) -> Scales:
    settings = np.array([hold.setting for hold in experiment.holds])
    step = typical_step(settings) or _SMALLEST_STEP * experiment.length_mm
    highest = max(settings.max(), 0.0)
    lowest = min(settings.min(), 0.0)
    reach = float(highest - lowest) or step
    read = [hold.readings for hold in experiment.recorded_holds] or [np.zeros(1)]
    tension = typical_tension(np.concatenate(read))
    return Scales(step, reach, tension, _typical_hold(experiment), tension * step / reach)


def _under_weights(experiment: Experiment) -> Scales:
    """The same where tensions are set: nothing of it depends on where the gauge stands at zero."""
    recorded = experiment.recorded_holds
    weights = np.array([hold.setting for hold in recorded])
    first = np.array([hold.readings[0] for hold in recorded])
    reach = _reach_under_weights(experiment, weights)
    # a weight that stays on for several holds moves the wire between them by its creep alone
    moves = np.abs(np.diff(first))[np.diff(weights) != 0.0]
    moved = moves[moves > 0.0]
    step = float(np.median(moved)) if moved.size else reach
    lightest = int(weights.argmin())
    zero = float(first[lightest] - reach * weights[lightest] / float(weights.max()))
    settings = [hold.setting for hold in experiment.holds]
    hold_s = _typical_hold(experiment)
    return Scales(step, reach, typical_tension(settings), hold_s, typical_step(settings), {experiment.name: zero})


def _reach_under_weights(experiment: Experiment, weights: np.ndarray) -> float:
    """How far the heaviest weight stretches the wire, by what was seen between the lightest and it, mm."""
    read = np.concatenate([hold.readings for hold in experiment.recorded_holds])
    seen = float(np.ptp(read)) or _SMALLEST_STEP * experiment.length_mm
    span = float(np.ptp(weights))
    if not span:
        return MOST_OF_SPAN * seen
    return seen * min(MOST_OF_SPAN, float(weights.max()) / span)


def _typical_hold(experiment: Experiment) -> float:
    durations = np.array([hold.duration_s for hold in experiment.recorded_holds or experiment.holds])
    return float(np.median(durations)) or float(durations.max()) or 1.0


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
