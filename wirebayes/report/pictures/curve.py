"""The curve that a posterior draws through its readings, hold after hold, and what it leaves over."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from wirebayes.model.sample import Sample
from wirebayes.numeric.typing import Floats
from wirebayes.prediction.predictive import PredictionRequest, chain_course
from wirebayes.report.figures import CHAIN, HALF_90, HOLD, INK, QUIET, apart, without_frame
from wirebayes.results.read_back import Stored
from wirebayes.wire.control import READ_UNIT
from wirebayes.wire.protocol import Protocol

DRAWS = 300  # a 5 % quantile is then one between 3 and 7 %, which no picture shows
_POINTS = 33  # of the curve within a hold
# of a hold, at which the curve is evaluated: dense where creep is fast, as the readings may be
_SHARES = np.linspace(0.0, 1.0, _POINTS) ** 3
_MARGIN = 0.1  # of a hold's place, left free at either side
_MOST_TICKS = 24  # hold numbers that an axis has room for
READ = {"displacement": "tension", "force": "displacement"}


@dataclass(frozen=True)
class Curve:
    """Readings as the model has them, given all readings, without sensor error.

    Attributes
    ----------
    place : (H, T) array
        Hold after hold, and within each from its beginning to its end: 0 to 1 in the first, 1 to 2 in the second.
    quantiles : (3, H, T) array
        5 %, 50 % and 95 %; N, or mm where the tension is set.
    at_readings : (H, R) array
        The median at every reading, 0 where there is none.
    noise : float
        Median standard deviation of the error of a reading.
    """

    place: Floats
    quantiles: Floats
    at_readings: Floats
    noise: float


def curve(stored: Stored) -> Curve:
    """The curve through the readings of a posterior whose holds are one chain.

    Parameters
    ----------
    stored : Stored
    """
    sample = stored.sample
    protocol = sample.protocol
    own = _some(stored)
    dense = _course(own, sample, _dense(protocol))
    quantiles = np.quantile(dense, [0.05, 0.5, 0.95], axis=2)[..., :_POINTS]
    course = _course(own, sample, protocol)
    at_readings = np.median(course, axis=2)
    inside = _MARGIN + (1.0 - 2.0 * _MARGIN) * _SHARES
    recorded = np.cumsum(protocol.recorded) - 1.0
    place = recorded[:, None] + inside
    rounding_sd = sample.resolution / np.sqrt(12.0)
    noise = np.hypot(own["sensor_sd"], rounding_sd)
    typical = float(np.median(noise))
    return Curve(place, quantiles, at_readings, typical)


def _some(stored: Stored) -> dict[str, Floats]:
    """Some of the stored draws."""
    draws = len(stored.theta)
    rows = np.linspace(0, draws - 1, min(draws, DRAWS)).astype(int)
    return {name: values[rows] for name, values in stored.draws.items()}


def _course(own: dict[str, Floats], sample: Sample, protocol: Protocol) -> Floats:
    """Readings (H, R, n) of a protocol, given all that was read."""
    holds = len(protocol.setting)
    no_hold = np.zeros(holds, bool)
    no_first = np.full(holds, np.nan)
    request = PredictionRequest(protocol, holds, no_hold, no_first)
    return chain_course(own, sample, request, np.random.default_rng(0))


def _dense(protocol: Protocol) -> Protocol:
    """The same holds, read so often that the curve is smooth; all of them recorded."""
    time_s = _SHARES * protocol.duration_s[:, None]
    everywhere = np.ones(time_s.shape, bool)
    warming = None if protocol.warming_K is None else _warming_at(time_s, protocol, protocol.warming_K)
    return replace(protocol, time_s=time_s, mask=everywhere, warming_K=warming)


def _warming_at(time_s: Floats, protocol: Protocol, warming_K: Floats) -> Floats:
    """Warming at times of each hold, between those at which it was read; none in a hold without readings."""
    warming = np.zeros(time_s.shape)
    for hold, read in enumerate(protocol.mask):
        if read.any():
            warming[hold] = np.interp(time_s[hold], protocol.time_s[hold][read], warming_K[hold][read])
    return warming


def through_the_readings(stored: Stored, title: str) -> Figure:
    """The readings with the curve through them above, what the curve leaves over below.

    Parameters
    ----------
    stored : Stored
    title : str
    """
    figure = Figure(figsize=(9.0, 5.4), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    found = curve(stored)
    draw_curve(above, stored, found, CHAIN, "the model, 90 % band")
    draw_readings(above, stored, found)
    _left_over(below, stored, found)
    name_holds(below, stored)
    control = stored.sample.protocol.control
    unit = READ_UNIT[control]
    above.set_ylabel(f"{READ[control]}, {unit}")
    below.set_ylabel(f"measured − model, {unit}")
    above.set_title(title, loc="left", fontsize=10.5, color=INK, y=1.0)
    above.legend(frameon=False, fontsize=8.5, loc="best")
    for axes in (above, below):
        without_frame(axes)
    return figure


def on_axes(stored: Stored, axes: Any) -> Any:
    """The readings with the curve through them, on axes of the user's.

    Parameters
    ----------
    axes : matplotlib.axes.Axes or None
        New ones when left out.

    Returns
    -------
    matplotlib.axes.Axes
    """
    if axes is None:
        import matplotlib.pyplot as plt  # only for users, who look at it on a screen

        axes = plt.subplots()[1]
    found = curve(stored)
    control = stored.sample.protocol.control
    draw_curve(axes, stored, found, CHAIN, "the model, 90 % band")
    draw_readings(axes, stored, found)
    name_holds(axes, stored)
    axes.set_ylabel(f"{READ[control]}, {READ_UNIT[control]}")
    axes.set_title(stored.sample.name)
    axes.legend(frameon=False)
    return axes


def both_on_axes(plain: Stored, final: Stored, axes: Any) -> Any:
    """The readings with the curves of two models through them, on axes of the user's.

    Parameters
    ----------
    plain, final : Stored
    axes : matplotlib.axes.Axes or None
        New ones when left out.

    Returns
    -------
    matplotlib.axes.Axes
    """
    axes = on_axes(final, axes)
    draw_curve(axes, plain, curve(plain), HOLD, "the plain model, 90 % band")
    axes.legend(frameon=False)
    return axes


def draw_curve(axes: Any, stored: Stored, found: Curve, colour: str, label: str) -> None:
    """The median and the band of every recorded hold.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    colour, label : str
    """
    recorded = stored.sample.protocol.recorded
    place = apart(found.place[recorded])
    low, middle, high = (apart(quantile[recorded]) for quantile in found.quantiles)
    axes.fill_between(place, low, high, color=colour, alpha=0.25, lw=0)
    axes.plot(place, middle, color=colour, lw=1.5, label=label)


def draw_readings(axes: Any, stored: Stored, found: Curve) -> None:
    """A dot for every reading, at its time within its hold.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    """
    x, (j, r) = _places(stored, found)
    axes.plot(x, stored.sample.readings[j, r, 0], "o", color=INK, ms=3, label="readings")


def _left_over(axes: Any, stored: Stored, found: Curve) -> None:
    x, (j, r) = _places(stored, found)
    left = stored.sample.readings[j, r, 0] - found.at_readings[j, r]
    width = HALF_90 * found.noise
    axes.axhspan(-width, width, color=CHAIN, alpha=0.15, lw=0)
    axes.axhline(0.0, color=QUIET, lw=0.8)
    axes.plot(x, left, "o", color=HOLD, ms=3)


def _places(stored: Stored, found: Curve) -> tuple[Floats, tuple[Any, Any]]:
    """Where each reading stands, and its row and column."""
    protocol = stored.sample.protocol
    j, r = np.nonzero(protocol.mask)
    share = protocol.time_s[j, r] / np.maximum(protocol.duration_s[j], 1e-9)
    first = found.place[j, 0]
    last = found.place[j, -1]
    return first + share * (last - first), (j, r)


def name_holds(axes: Any, stored: Stored) -> None:
    """Numbers of the recorded holds below the axis.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    """
    protocol = stored.sample.protocol
    numbers = protocol.number[protocol.recorded]
    step = -(-len(numbers) // _MOST_TICKS)
    middles = np.arange(0, len(numbers), step) + 0.5
    axes.set_xticks(middles, [str(number) for number in numbers[::step]])
    axes.set_xlim(0, len(numbers))
    axes.set_xlabel("hold; within each, time runs from its beginning to its end")
