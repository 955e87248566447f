"""The unused holds predicted from the first ones, and how far the measurement lies from the prediction."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator

from wirebayes.io.experiment import Experiment
from wirebayes.model.single_holds import hold_courses
from wirebayes.numeric.means import root_mean_square
from wirebayes.numeric.typing import Array, Ints
from wirebayes.paper.least_squares import at
from wirebayes.prediction.predictive import PredictionRequest, draw_predictive
from wirebayes.results.read_back import Stored
from wirebayes.wire.model import Model
from wirebayes.wire.protocol import Protocol

_DRAWS = 2000  # a 5 % quantile is then one between 4 % and 6 %


@dataclass(frozen=True)
class Forecast:
    """Predicted and measured readings of the holds that were not trained on.

    Attributes
    ----------
    hold : (m,) int array
        Hold number of each reading.
    time_s, measured_N : (m,) arrays
    drawn_N : (m, n) array
        Predictive draws: parameter, setting, sensor and rounding error.
    """

    hold: Ints
    time_s: Array
    measured_N: Array
    drawn_N: Array

    @property
    def band_N(self) -> Array:
        """(3, m) 5 %, 50 % and 95 % quantiles."""
        return np.quantile(self.drawn_N, [0.05, 0.5, 0.95], axis=1)

    @property
    def rms_N(self) -> float:
        """Root mean square of measured minus median prediction."""
        return root_mean_square(self.measured_N - self.band_N[1])

    @property
    def coverage(self) -> float:
        """Share of readings inside the 90 % band."""
        low, _, high = self.band_N
        return float(np.mean((self.measured_N >= low) & (self.measured_N <= high)))


def forecast_held_out(stored: Stored, experiment: Experiment, rng: Generator) -> Forecast:
    """Predict what `stored`, trained on the first holds of an experiment, has not seen.

    As a chain the training readings fix the creep carried in, the displacements say the rest; hold by hold each hold
    is given its own first reading, which is then not predicted.

    Parameters
    ----------
    stored : Stored
        Posterior of the first holds.
    experiment : Experiment
        All holds.
    """
    protocol = experiment.protocol()
    measured = experiment.tension()
    trained = len(stored.sample.protocol.setting)
    unused = protocol.recorded.copy()
    unused[:trained] = False
    wanted = protocol.mask & unused[:, None]
    first = np.full(len(measured), np.nan)
    if stored.likelihood == "hold":
        first = measured[:, 0]
        trained = 0
        wanted[:, 0] = False
    request = PredictionRequest(protocol, trained, unused, first)
    drawn = draw_predictive(stored.problem, some(stored.theta), stored.sample, request, rng)
    number = np.broadcast_to(protocol.number[:, None], wanted.shape)
    return Forecast(number[wanted], protocol.time_s[wanted], measured[wanted], drawn[wanted])


def last_hold_course(stored: Stored, experiment: Experiment, time_s: Array, rng: Generator) -> Array:
    """Predicted readings of the last hold given its first reading, hold by hold.

    Parameters
    ----------
    stored : Stored
        Posterior that has not seen the hold.
    time_s : (t,) array
        Times since the hold began; they need not be those of the readings.

    Returns
    -------
    (t, n) array
        N.
    """
    protocol, first = _last_alone(experiment, time_s)
    request = PredictionRequest(protocol, 0, np.array([True]), first)
    drawn: Array = draw_predictive(stored.problem, some(stored.theta), stored.sample, request, rng)[0]
    return drawn


def published_course(published: dict[str, float], experiment: Experiment, time_s: Array) -> Array:
    """The paper's curve of the last hold.

    Parameters
    ----------
    published : dict of name to float
        A row of the paper's Table 4: ``k1 B U k2 N``.
    experiment : Experiment
        Its first reading of that hold fixes the stretched length.
    time_s : (t,) array

    Returns
    -------
    (t,) array
        N.
    """
    protocol, first = _last_alone(experiment, time_s)
    course = hold_courses(protocol, at(published), Model(), first[:, None])[0]
    assert course is not None
    tension: Array = course[0][:, 0]
    return tension


def some(theta: Array) -> Array:
    """At most a few thousand rows, evenly spread."""
    rows: Array = theta[np.linspace(0, len(theta) - 1, min(len(theta), _DRAWS)).astype(int)]
    return rows


def _last_alone(experiment: Experiment, time_s: Array) -> tuple[Protocol, Array]:
    """The last hold as a test of its own, predicted at other times, and its first reading."""
    hold = experiment.recorded_holds[-1]
    times = np.concatenate([[0.0], time_s[time_s > 0]])[None]
    one = replace(
        experiment.protocol(),
        setting=np.array([hold.setting]),
        time_s=times,
        mask=np.ones(times.shape, bool),
        duration_s=np.array([float(times[0, -1])]),
        number=np.array([hold.number or 0]),
        warming_K=None,
    )
    return one, hold.tension_N[:1]
