"""Holds whose setting error decides whether the wire is taut: their readings are probable either way.

The readings of a wire are not linear in an error that may leave it slack. On either side of that edge they are nearly
so: the density of the readings is the sum of both sides', each times the probability of the error to lie there. What a
hold carries on is taken for normal, with the mean and the variance of both sides together (a Gaussian sum that is
collapsed after every hold).
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.special import log_ndtr

from wirebayes.model.hold_filter import HoldRead, Measured, ReadingNoise, carried_unread, filter_hold
from wirebayes.numeric.typing import Array, Bools
from wirebayes.wire.edges import Edges, Side
from wirebayes.wire.staircase import Linearised

_LEAST_VARIANCE = 1e-300  # mm², of a stretch: where none is left, the wire is on the side that its mean says


@dataclass(frozen=True)
class EitherSide:
    """What the readings of a hold say where the wire may be taut or slack.

    Attributes
    ----------
    as_it_is : HoldRead
        By the staircase itself: what counts far from the edge.
    near : (n,) bool array
    taut, slack : HoldRead
    log_taut, log_slack : (n,) arrays
        Log densities of the readings and of being on that side.
    """

    as_it_is: HoldRead
    near: Bools
    taut: HoldRead
    slack: HoldRead
    log_taut: Array
    log_slack: Array

    @property
    def log_density(self) -> Array:
        """(n,) of the readings."""
        return np.where(self.near, np.logaddexp(self.log_taut, self.log_slack), self.as_it_is.log_density)

    @property
    def taut_share(self) -> Array:
        """(n,) probability that the wire is taut."""
        return np.exp(self.log_taut - np.logaddexp(self.log_taut, self.log_slack))

    @property
    def mean(self) -> Array:
        """(n,) of the creep carried on."""
        mixed = self.slack.mean + self.taut_share * (self.taut.mean - self.slack.mean)
        return np.where(self.near, mixed, self.as_it_is.mean)

    @property
    def var(self) -> Array:
        """(n,) of the creep carried on."""
        share = self.taut_share
        within = share * self.taut.var + (1.0 - share) * self.slack.var
        between = share * (1.0 - share) * (self.taut.mean - self.slack.mean) ** 2
        return np.where(self.near, within + between, self.as_it_is.var)

    def residuals(self) -> list[Array]:
        """The residuals of the side that is more probable."""
        is_taut = self.log_taut > self.log_slack
        each = zip(self.as_it_is.residuals(), self.taut.residuals(), self.slack.residuals(), strict=True)
        return [np.where(self.near, np.where(is_taut, taut, slack), usual) for usual, taut, slack in each]


def read_hold(
    line: Linearised, j: int, measured: Measured, m: Array, p: Array, noise: ReadingNoise
) -> HoldRead | EitherSide:
    """Filter the readings of one hold, on both sides of an edge where there is one.

    Parameters
    ----------
    line, j, measured, m, p, noise
        As for `wirebayes.model.hold_filter.filter_hold`.
    """
    as_it_is = filter_hold(line, j, measured, m, p, noise)
    edges = line.edges
    if edges is None or not edges.near[j].any():
        return as_it_is
    taut = _filtered(edges.taut, j, measured, m, p, noise)
    slack = _filtered(edges.slack, j, measured, m, p, noise)
    before, after = _stretches(edges, j, m, p, noise, taut)
    log_taut = taut.log_density + log_ndtr(after.ratio)
    log_slack = slack.log_density + log_ndtr(-before.ratio)
    return EitherSide(as_it_is, edges.near[j], taut, slack, log_taut, log_slack)


def _filtered(side: Side, j: int, measured: Measured, m: Array, p: Array, noise: ReadingNoise) -> HoldRead:
    read = filter_hold(side, j, measured, m, p, noise)
    return read._replace(mean=read.mean + side.carry[j])


class _Stretch(NamedTuple):
    """Mean and variance (n,) of the stretch when a hold begins, mm."""

    mean: Array
    var: Array

    @property
    def ratio(self) -> Array:
        """Mean over standard deviation."""
        return self.mean / np.sqrt(np.maximum(self.var, _LEAST_VARIANCE))


def _stretches(
    edges: Edges, j: int, m: Array, p: Array, noise: ReadingNoise, taut: HoldRead
) -> tuple[_Stretch, _Stretch]:
    """How far the wire is stretched before a hold is read, and by its readings where the wire is taut."""
    by_setting = edges.stretch_by_setting[j]
    by_creep = edges.stretch_by_creep[j]
    q = noise.setting_var
    mean = edges.stretch[j] + by_creep * m
    before = _Stretch(mean, by_creep**2 * p + by_setting**2 * q)
    pull_c, pull_s = taut.pulls
    moved = by_creep * p * pull_c + by_setting * q * pull_s
    return before, _Stretch(mean + moved, taut.known.var_along(by_creep, by_setting))


def filter_holds(line: Linearised, measured: Measured) -> Iterator[tuple[Array, Array, HoldRead | EitherSide | None]]:
    """Mean and variance (n,) of the creep that each hold carries on, and what its readings say if it has any.

    Parameters
    ----------
    line : Linearised
    measured : Measured
    """
    noise = measured.noise
    mean = np.zeros(line.reading.shape[2])
    var = mean
    for j, taken in enumerate(measured.mask):
        read = None
        if taken.any():
            known_noise = noise.where_read(measured.first(j))
            read = read_hold(line, j, measured, mean, var, known_noise)
            mean = read.mean
            var = read.var
        else:
            mean, var = carried_unread(line, j, mean, var, noise)
        yield mean, var, read


def settled(line: Linearised, is_taut: Bools, measured: Measured) -> Linearised:
    """A staircase that has each hold that was read on the side of its edge where the readings are more probable.

    What the holds near an edge carry on moves those after them.

    Parameters
    ----------
    line : Linearised
        With edges.
    is_taut : (H, n) bool array
        Near an edge, whether that is the side of a taut wire.
    measured : Measured
    """
    assert line.edges is not None
    taut = line.edges.taut
    slack = line.edges.slack
    near = line.edges.near & ~np.isnan(measured.first_readings.value)

    def chosen(usual: Array, if_taut: Array, if_slack: Array) -> Array:
        shape = (len(near),) + (1,) * (usual.ndim - 2) + near.shape[1:]
        return np.where(near.reshape(shape), np.where(is_taut.reshape(shape), if_taut, if_slack), usual)

    reading = chosen(line.reading, taut.reading, slack.reading)
    by_setting = chosen(line.by_setting, taut.by_setting, slack.by_setting)
    by_creep = chosen(line.by_creep, taut.by_creep, slack.by_creep)
    carry_by_setting = chosen(line.carry_by_setting, taut.carry_by_setting, slack.carry_by_setting)
    carry_by_creep = chosen(line.carry_by_creep, taut.carry_by_creep, slack.carry_by_creep)
    carry = chosen(np.zeros(near.shape), taut.carry, slack.carry)
    moved = np.zeros(near.shape[1])
    for j in range(len(near)):
        reading[j] += by_creep[j] * moved
        moved = carry_by_creep[j] * moved + carry[j]
    return replace(
        line,
        reading=reading,
        by_setting=by_setting,
        by_creep=by_creep,
        carry_by_setting=carry_by_setting,
        carry_by_creep=carry_by_creep,
        edges=None,
    )
