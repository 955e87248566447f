"""The coordinates that are sampled: what the data determine, so that the curved ridge in (B, k2, N) is nearly straight.

First each parameter by itself (`wirebayes.inference.coordinates.columns`): positive parameters become logarithms; a
setting error, which is at most half a step, the log odds of that; amplitudes whose prior ends at an edge (half-normal
and uniform priors) become what is standard normal under their prior, so that no proposal leaves the support; others are
measured in standard deviations of their prior. Then, one after the other (`wirebayes.inference.coordinates.steps`):

- ``Loss``: log B becomes the log tension lost between the first and the last reading of a hold, root mean square over
  the holds of the test, with the first readings taken as the tensions that drive the creep: ``log B + log G(U, k2, N) +
  log(k1 / L0)``. With the tensions given, the creep is linear in B, so G does not depend on B and takes one pass along
  the holds. Effects on the amount of creep belong to G. Under weights, elongations are read, and this is the elongation
  gained: without ``log(k1 / L0)``. What creeps beside the creep in proportion to a sampled amplitude belongs to the
  tension lost, and these amplitudes become their shares of it (`wirebayes.inference.coordinates.shares`);
- ``SoftenedStiffness``: log k1 becomes the log stiffness of the wire after its creep: ``log k1 - log(1 + k1 a / L0)``,
  with a slope a of the elongation by creep over the tensions that holds were last read at
  (`wirebayes.inference.coordinates.last_readings`); where these are all alike, of the tension lost in a hold over the
  root mean square of the steps between first readings. Where all creep is over before it is read, the readings see this
  stiffness alone; where there is little, it is k1. Where a fixture's compliance is sampled, k1 is in all this the
  stiffness of the wire with its fixture, and the compliance becomes its share;
- ``AddedCompliance``: the same under weights, where elongations are sampled and compliances add up;
- ``MeanElongation``: the preload becomes what the mean elongation at last readings leaves of it, which asks for k1 and
  comes first;
- ``Level``: in a test of one displacement, k1 and B become what its tensions say beside the preload
  (`wirebayes.inference.coordinates.tension_level`);
- ``WeightLevel``: in a test of one weight, the preload and B become what its displacements say beside k1
  (`wirebayes.inference.coordinates.displacement_level`);
- ``Stretched`` and ``StretchLevel``: in several tests at one displacement each, every preload becomes its error, and B
  what the true stretches lose (`wirebayes.inference.coordinates.first_stretch`). Both ask for k1;
- ``Hazard``: log k2 becomes the log hazard at half a typical hold, ``log k2 + N log t``;
- ``Power``: log U becomes its distance from the power of tension that suits the measured losses best at this hazard
  (`wirebayes.inference.coordinates.power_of_tension`);
- ``Preload``: the preload becomes what is wide where the first hold hardly creeps
  (`wirebayes.inference.coordinates.slack_edge`). Where a threshold of creep places it, it asks for k1 and comes first;
- ``Straightened``: beside a toe, the preload becomes what is left of it once the toe is straight.

The map is triangular: to natural parameters the steps go backwards, so that each finds the parameters that it asks for.
Those but of preloads, shares and the added compliance have unit Jacobian. The proposal learns the remaining curvature
and funnels (`wirebayes.inference.sampler.transport_map`), for which the columns are ordered: errors before what they
widen, the shape of the creep before its amount and the stiffness. Climbs and the normal approximations that the search
for effects compares are made in the same coordinates: beside an edge of the prior, or where a wire is nearly slack,
others would end at a wall.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from wirebayes.inference.coordinates.columns import ColumnMap, columns_of
from wirebayes.inference.coordinates.common_error import common_error
from wirebayes.inference.coordinates.displacement_level import DisplacementLevel, displacement_levels
from wirebayes.inference.coordinates.find_ridges import ridges_of
from wirebayes.inference.coordinates.first_stretch import FirstStretch, first_stretches
from wirebayes.inference.coordinates.last_readings import LastReadings, last_readings
from wirebayes.inference.coordinates.prior_density import PriorDensity
from wirebayes.inference.coordinates.ridge import Ridge
from wirebayes.inference.coordinates.slack_edge import SlackEdge, slack_edge
from wirebayes.inference.coordinates.steps import (
    AddedCompliance,
    Hazard,
    Level,
    Loss,
    MeanElongation,
    Power,
    Preload,
    SoftenedStiffness,
    Step,
    Straightened,
    Stretched,
    StretchLevel,
    WeightLevel,
)
from wirebayes.inference.coordinates.tension_level import TensionLevel, tension_level
from wirebayes.model.column_units import parameter_of
from wirebayes.model.problem import Problem
from wirebayes.model.sample import NOISES
from wirebayes.numeric.typing import Array

LevelStep = Level | WeightLevel | StretchLevel
_FIRST = ("setting_sd", "sensor_sd", "U", "k2", "N")
_LAST = ("k1", "B")


@dataclass(frozen=True)
class Noises:
    """Columns of a sample's two noises, and the logarithm of setting error over sensor noise under the prior.

    Attributes
    ----------
    sensor, setting : int
    middle, spread : float
        Of the logarithm of the ratio of the standard deviations, mm/N.
    """

    sensor: int
    setting: int
    middle: float
    spread: float


class Transformation:
    """The map between natural parameters ``(n, d)`` and sampled ones ``(n, d)``.

    Parameters
    ----------
    problem : Problem

    Attributes
    ----------
    columns : ColumnMap
        Each parameter by itself.
    steps : list of Step
        What follows, in this order.
    shares : list of int
        Columns of amounts that are sampled by their shares in a sum.
    noises : tuple of Noises
        Of every sample of which neither noise is fixed.
    sensor_columns, setting_columns : lists of int
        Of the standard deviations that are not fixed.
    """

    def __init__(self, problem: Problem) -> None:
        names = problem.names
        self.problem = problem
        self.columns = columns_of(problem)
        self.log_columns = self.columns.positive
        self.scale = self.columns.scale
        self.noises = _noises(problem, self.columns)
        self.sensor_columns = _positive("sensor_sd", names, self.columns)
        self.setting_columns = _positive("setting_sd", names, self.columns)
        self.order = np.array(sorted(range(len(names)), key=lambda i: _rank(names[i])))
        slack = _slack_edges(problem, self.columns)
        self.ridges, levels = _ridges_and_levels(problem, self.columns, slack)
        lasts = [[] for _ in self.ridges] if levels else _last_readings(problem, self.ridges)
        means = _mean_elongations(problem, lasts, self.columns)
        of_levels = {column for step in levels if not isinstance(step, Level) for column in step.preloads}
        edges = [Preload(edge, self.scale[edge.preload]) for edge in slack if edge.preload not in of_levels]
        toes = _toes(problem, self.columns) if not of_levels else []
        self.steps = [*_steps(self.ridges, lasts, levels, means, edges), *toes]
        self.shares = [column for ridge in self.ridges for column in ridge.shares]
        preloads = of_levels | {step.preload for step in means} | {step.preload for step in toes}
        preloads |= {step.edge.preload for step in edges}
        self._own_scale = [*self.shares, *sorted(preloads)]
        self._prior = PriorDensity.of(problem.prior, self.columns, self.shares)

    @property
    def kinds_of_creep(self) -> list[list[int]]:
        """Columns that say how fast each material creeps, its hazard at half a hold; and its power of tension."""
        rates = [ridge.where["k2"] for ridge in self.ridges if "k2" in ridge.shifted]
        powers = [ridge.where["U"] for ridge in self.ridges if "U" in ridge.where]
        return [columns for columns in (rates, powers) if columns]

    def to_sampled(self, theta: Array) -> Array:
        """Sampled coordinates of natural parameters."""
        z = self.columns.to_sampled(theta)
        with np.errstate(all="ignore"):
            for step in self.steps:
                step.to_sampled(z, theta)
        return z

    def to_natural(self, z: Array) -> Array:
        """Natural parameters of sampled coordinates."""
        z = z.copy()
        with np.errstate(all="ignore"):
            theta = self.columns.to_natural(z)
            for step in reversed(self.steps):
                step.to_natural(theta, z)
        return theta

    def log_prior(self, theta: Array, z: Array, residuals: Array) -> Array:
        """(n,) log prior density of the coordinates.

        Parameters
        ----------
        theta, z : (n, d) arrays
            Natural parameters and their coordinates.
        residuals : (d, n) array
            Their `prior_residuals`.
        """
        total = self._prior(theta, residuals)
        for step in self.steps:
            total = total + step.log_jacobian(theta, z)
        return total

    def prior_residuals(self, theta: Array, z: Array) -> Array:
        """(d, n) distances from the middle of the prior in its standard deviations, but for a constant each.

        Parameters
        ----------
        theta, z : (n, d) arrays
            Natural parameters and their coordinates.
        """
        prior = self.problem.prior
        columns = self.columns
        spread = columns.log_spread
        # other coordinates than logarithms have a standard deviation of one already
        out = z.copy()
        out[:, self.log_columns] = columns.logarithms(theta)
        out /= spread
        for name in prior.powers.keys() & prior.distributions.keys():
            i = self.problem.names.index(name)
            log_factor = prior.log_factor(name, theta)
            out[:, i] += log_factor / spread[i]
        for i in self._own_scale:
            out[:, i] = columns.coordinate(theta, i)
        return out.T


def _steps(
    ridges: Sequence[Ridge],
    lasts: Sequence[Sequence[LastReadings]],
    levels: Sequence[LevelStep],
    means: Sequence[MeanElongation],
    preloads: Sequence[Preload],
) -> list[Step]:
    """The steps, each kind for all materials: what one asks for may be a column that an earlier material owns.

    Parameters
    ----------
    ridges : sequence of Ridge
    lasts : sequence of sequences of LastReadings
        Of each ridge.
    levels, means, preloads : sequences of Step
        Of tests of one setting, of others, and where preloads lie near an edge.
    """
    beside = {step.preload for step in means}
    before = [step for step in preloads if step.edge.threshold != 0.0 or step.edge.preload in beside]
    after = [step for step in preloads if step not in before]
    level = _read_beside(levels)
    of_stretches = [step for step in levels if isinstance(step, StretchLevel)]
    of_holds = [step for step in levels if not isinstance(step, StretchLevel)]
    steps: list[Step] = [*before, *means]
    for step in of_stretches:
        steps += [Stretched(each, step.scale[each.preload]) for each in step.levels]
    steps += [Loss(ridge, level) for ridge in ridges if "B" in ridge.shifted]
    steps += of_stretches
    for ridge, own in zip(ridges, lasts, strict=True):
        crept = _after_creep(ridge, own) if "k1" in ridge.shifted else None
        if crept is not None:
            steps.append(crept)
    steps += of_holds
    steps += [Hazard(ridge) for ridge in ridges if "k2" in ridge.shifted]
    steps += [Power(ridge) for ridge in ridges if "U" in ridge.shifted]
    return steps + list(after)


def _ridges_and_levels(
    problem: Problem, columns: ColumnMap, slack: list[SlackEdge]
) -> tuple[list[Ridge], list[LevelStep]]:
    """The ridges of all materials, and the coordinates of tests at one setting each, if they are."""
    ridges = ridges_of(problem, columns)
    if not _is_usual(problem, columns, ridges):
        return ridges, []
    ridge, levels = _of_one_setting(problem, ridges[0], slack, columns.scale)
    return [ridge], levels


def _of_one_setting(
    problem: Problem, ridge: Ridge, slack: list[SlackEdge], scale: Array
) -> tuple[Ridge, list[LevelStep]]:
    """Coordinates of tests at one setting each, if they are, and the ridge of their material beside these.

    Parameters
    ----------
    problem : Problem
        Of one material.
    ridge : Ridge
    slack : list of SlackEdge
        Coordinates of preloads that there may be instead.
    scale : (d,) array
        Of each parameter by itself.
    """
    if (tension := tension_level(problem, slack)) is not None:
        beside = replace(ridge, log_step=np.inf)  # the level says what k1 is beside the creep
        return beside, [Level(beside, tension)]
    if weights := displacement_levels(problem, ridge):
        beside = replace(ridge, shifted=ridge.shifted - {"k1"})  # one weight tells no stiffness
        return beside, [WeightLevel(beside, tuple(weights), common_error(problem), scale)]
    if stretches := first_stretches(problem, ridge, slack):
        return ridge, [StretchLevel(ridge, tuple(stretches), scale)]
    return ridge, []


def _after_creep(ridge: Ridge, lasts: Sequence[LastReadings]) -> Step | None:
    """The coordinate of the stiffness of a wire that has crept, by the test whose tensions differ most."""
    widest = max(lasts, key=lambda last: last.spread, default=None)
    if widest is None or widest.spread == 0.0:
        return None if ridge.elongations else SoftenedStiffness(ridge)
    return AddedCompliance(ridge, widest) if ridge.elongations else SoftenedStiffness(ridge, widest)


def _last_readings(problem: Problem, ridges: Sequence[Ridge]) -> list[list[LastReadings]]:
    """The last readings of the tests of each ridge that samples k1, where some tests do not show how holds begin."""
    if problem.likelihood != "chain":  # hold by hold there is no preload, and under weights no k1
        return [[] for _ in ridges]
    out = []
    for ridge in ridges:
        k1 = ridge.where["k1"] if "k1" in ridge.shifted else None
        own = [last_readings(ridge, problem, s) for s in problem.samples if problem.place("k1", s) == k1]
        read = [last for last in own if last.read.any()]
        out.append(read if any(last.without_begin for last in read) else [])
    return out


def _mean_elongations(
    problem: Problem, lasts: Sequence[Sequence[LastReadings]], columns: ColumnMap
) -> list[MeanElongation]:
    """The coordinates of preloads that are open, where creep before a first reading may stand for preload."""
    out = []
    for last in (last for of_ridge in lasts for last in of_ridge):
        preload = problem.place("preload", last.sample)
        if isinstance(preload, int) and columns.is_linear(preload) and last.without_begin:
            out.append(MeanElongation(last, preload, float(columns.scale[preload])))
    return out


def _read_beside(
    levels: Sequence[LevelStep],
) -> TensionLevel | DisplacementLevel | FirstStretch | None:
    """What tests of one setting show over what the ridge says: the first of them stands for all."""
    for step in levels:
        return step.level if isinstance(step, Level) else step.levels[0]
    return None


def _slack_edges(problem: Problem, columns: ColumnMap) -> list[SlackEdge]:
    """Coordinates of the samples' preloads, where these have none of their own already."""
    found = [slack_edge(problem, sample) for sample in problem.samples]
    return [edge for edge in found if edge is not None and columns.is_linear(edge.preload)]


def _toes(problem: Problem, columns: ColumnMap) -> list[Straightened]:
    """The samples whose preload and whose toe are both open."""
    if problem.likelihood != "chain":
        return []
    names = problem.names
    out = []
    for sample in problem.samples:
        preload = problem.column("preload", sample)
        if preload not in names or not columns.is_linear(names.index(preload)):
            continue
        at = names.index(preload)
        toes = [problem.column(e.straightens, sample) for e in sample.model.effects if e.straightens]
        out += [Straightened(at, names.index(toe), float(columns.scale[at])) for toe in toes if toe in names]
    return out


def _is_usual(problem: Problem, columns: ColumnMap, ridges: Sequence[Ridge]) -> bool:
    """Whether stiffness, preloads and creep of a problem of one material have the usual coordinates."""
    if problem.likelihood != "chain" or len(ridges) != 1 or "B" not in ridges[0].shifted:
        return False
    names = problem.names
    for sample in problem.samples:
        k1, preload = (problem.column(name, sample) for name in ("k1", "preload"))
        if k1 not in names or not columns.positive[names.index(k1)]:
            return False
        if preload in names and not columns.is_linear(names.index(preload)):
            return False
    return True


def _noises(problem: Problem, columns: ColumnMap) -> tuple[Noises, ...]:
    """The pair of noises of every sample that has neither fixed; holds by themselves have no setting errors."""
    if problem.likelihood != "chain":
        return ()
    out = []
    for sample in problem.samples:
        names = [problem.column(name, sample) for name in NOISES]
        if not set(names) <= set(problem.names):
            continue
        pair = [problem.names.index(name) for name in names]
        if not columns.positive[pair].all():
            continue
        log_medians = [np.log(problem.prior.distributions[name].median()) for name in names]
        middle = np.diff(log_medians)[0]
        spread = np.hypot(*columns.log_spread[pair])
        sensor, setting = pair
        out.append(Noises(sensor, setting, float(middle), float(spread)))
    return tuple(out)


def _positive(kind: str, names: Sequence[str], columns: ColumnMap) -> list[int]:
    """Columns of a positive parameter, of every sample that has its own."""
    return [i for i, name in enumerate(names) if columns.positive[i] and parameter_of(name) == kind]


def _rank(name: str) -> int:
    kind = parameter_of(name)
    return _FIRST.index(kind) - len(_FIRST) if kind in _FIRST else int(kind in _LAST)
