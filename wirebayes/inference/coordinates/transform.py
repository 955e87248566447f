"""The coordinates that are sampled: what the data determine, so that the curved ridge in (B, k2, N) is nearly straight.

Positive parameters become logarithms; a setting error, which is at most half a step, the log odds of that; amplitudes
whose prior ends at an edge (half-normal and uniform priors) become what is standard normal under their prior, so that
no proposal leaves the support; others are measured in standard deviations of their prior. Then, one after the other,


- log k2 becomes the log hazard at half a typical hold, ``log k2 + N log t``;
- log U becomes its distance from the power of tension that suits the measured losses best at this hazard
  (`wirebayes.inference.coordinates.power_of_tension`);
- log B becomes the log tension lost in a hold, root mean square over the holds of the test, with the first readings
  taken as the tensions that drive the creep: ``log B + log G(U, k2, N) + log(k1 / L0)``. With the tensions given, the
  creep is linear in B, so G does not depend on B and takes one pass along the holds. Effects on the amount of creep
  belong to G;
  Under weights, elongations are read, and this is the elongation gained in a hold: without ``log(k1 / L0)``;
- the preload becomes what is wide where the first hold hardly creeps (`wirebayes.inference.coordinates.slack_edge`);
- log k1 becomes the log stiffness of the wire after its creep: ``log k1 - log(1 + lost / step)``, with the tension lost
  in a hold over the root mean square of the steps between first readings. Where all creep is over before a first
  reading, the readings see this stiffness alone; where there is little, it is k1. Under weights it stays log k1;
- in a test of one hold, k1 and B become what its tensions say beside the preload
  (`wirebayes.inference.coordinates.tension_level`);
- where a fixture's compliance is sampled, k1 is in all this the stiffness of the wire with its fixture, and what creeps
  beside the creep in proportion to a sampled amplitude belongs to the tension lost in a hold; these compliances and
  amplitudes become their shares (`wirebayes.inference.coordinates.shares`).

The map is triangular, and its steps but those of the preload and of shares have unit Jacobian. Those of U, the preload
and shares are for proposals to draw from: Laplace approximations, as the search for effects compares them, do without.
The proposal learns the remaining curvature and funnels (`wirebayes.inference.sampler.transport_map`), for which the
columns are ordered: errors before what they widen, the shape of the creep before its amount and the stiffness.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wirebayes.inference.coordinates import shares
from wirebayes.inference.coordinates.edges import edge
from wirebayes.inference.coordinates.power_of_tension import suiting_powers
from wirebayes.inference.coordinates.shares import Elongation
from wirebayes.inference.coordinates.slack_edge import slack_edge
from wirebayes.inference.coordinates.tension_level import tension_level
from wirebayes.model.problem import MATERIAL, Problem, Sample
from wirebayes.numeric.typing import Array
from wirebayes.wire import compiled
from wirebayes.wire.effect import Effect, HoldContext, Placed

_FIRST = ("setting_sd", "sensor_sd", "U", "k2", "N")
_LAST = ("k1", "B")
_NONE = np.zeros(1), np.zeros(1)  # where U is sampled as it is
_ONE_SD = np.array([0.15865525393145707, 0.8413447460685429])  # shares of a normal below -1 and 1


@dataclass(frozen=True)
class _Ridge:
    """Columns of one material's parameters (or fixed values), which of them are shifted, and the map's constants.

    `effects` are those on the amount of creep, and `holds` what they see of the test, tensions as measured. `powers`
    are log hazards and the log U that suits the losses best at each of them. `fixture` is the column of a compliance in
    series with the wire, and `beside` what creeps beside the creep. `elongations` where these are read, not tensions.
    """

    where: dict[str, int]
    fixed: dict[str, float]
    shifted: frozenset[str]
    log_tension: Array
    log_step: float
    times_s: Array
    which_time: NDArray[np.int64]
    kept: float
    hold_s: float
    log_length: float
    effects: tuple[Effect, ...]
    holds: tuple[HoldContext, ...]
    powers: tuple[Array, Array]
    fixture: int | None = None
    beside: tuple[Elongation, ...] = ()
    elongations: bool = False

    @property
    def shares(self) -> list[int]:
        """Columns of what is sampled by its share."""
        return [*([] if self.fixture is None else [self.fixture]), *(each.column for each in self.beside)]

    def get(self, theta: Array, name: str) -> Any:
        """(n,) a parameter of the material, or the number that it is fixed at."""
        return theta[:, self.where[name]] if name in self.where else self.fixed[name]

    @cached_property
    def _tensions(self) -> tuple[float, Array]:
        """Mean of the log tensions, and how far each is from it, (H, 1)."""
        mean = float(self.log_tension.mean())
        return mean, (self.log_tension - mean)[:, None]

    @cached_property
    def log_half_hold(self) -> float:
        """Logarithm of half a typical hold, s."""
        return float(np.log(0.5 * self.hold_s))

    def log_power(self, z: Array) -> Array:
        """(n,) log U that suits the measured losses best at the hazards of sampled coordinates (n, d)."""
        return np.interp(z[:, self.where["k2"]], *self.powers)

    def log_stiffness(self, theta: Array) -> Array:
        """(n,) log of what is read per elongation: N/mm of the wire with its fixture, 1 where elongations are read."""
        if self.elongations:
            return np.zeros(len(theta))
        stiffness = np.log(self.get(theta, "k1")) - self.log_length
        if self.fixture is None:
            return np.asarray(stiffness)
        return np.asarray(stiffness - np.logaddexp(0.0, np.log(theta[:, self.fixture]) + stiffness))

    def softened(self, z: Array) -> Array:
        """(n,) by how much the log stiffness is less after the creep, at sampled coordinates (n, d)."""
        return np.asarray(np.logaddexp(0.0, z[:, self.where["B"]] - self.log_step))

    def log_creep(self, theta: Array) -> Array:
        """(n,) log G: root mean square of the elongation gained in a hold, for B = 1, at natural parameters (n, d)."""
        U, k2, N = (self.get(theta, name) for name in ("U", "k2", "N"))
        reached = -np.expm1(-k2 * self.times_s[:, None] ** N)
        mean, apart = self._tensions
        drive = np.exp(U * apart)
        if compiled.kernel is not None and not self.effects:
            # of parameters that are fixed there is one column
            every, share = (
                a if a.shape[1] == len(theta) else np.repeat(a, len(theta), axis=1) for a in (drive, reached)
            )
            square = compiled.kernel.square_gained(every, share, self.which_time, self.kept)
        else:
            square = self._square_gained(drive, reached, theta)
        # the floor keeps the logarithm finite
        return np.asarray(U * mean + 0.5 * np.log(np.maximum(square / len(self.which_time), 1e-300)))

    def _square_gained(self, drive: Array, reached: Array, theta: Array) -> Array:
        """What `compiled.kernel.square_gained` computes, by numpy; effects on the amount of creep included."""
        carried, square = 0.0 * reached[0], 0.0 * drive[0]
        effects = Placed(self.effects, {c: self.get(theta, c) for e in self.effects for c in e.columns()})
        for j, time in enumerate(self.which_time):
            amount = drive[j] - self.kept * carried
            if self.effects:
                amount = effects.change("amount", amount[None], self.holds[j].carrying(carried[None]))[0]
            gained = amount * reached[time]
            carried = carried + gained
            square = square + gained * gained
        return square


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
    for_draws : bool
        Whether U and the preload have coordinates in which proposals suit them better.

    Attributes
    ----------
    shares : list of int
        Columns of amounts that are sampled by their shares in a sum.
    noises : tuple of Noises
        Of every sample of which neither noise is fixed.
    sensor_columns, setting_columns : lists of int
        Of the standard deviations that are not fixed.
    """

    def __init__(self, problem: Problem, for_draws: bool = True) -> None:
        names = problem.names
        self.problem = problem
        self.log_columns = np.array([name in problem.prior.logarithmic for name in names])
        free = [(i, d) for i, d in enumerate(problem.prior.distributions.values()) if not self.log_columns[i]]
        self.edges = {i: found for i, d in free if (found := edge(d)) is not None}
        self.scale = np.ones(len(names))
        for i, distribution in free:
            if i not in self.edges:
                self.scale[i] = _spread(distribution)
        self._log_scale = np.log(self.scale).sum()
        ends = [float(d.support()[1]) for d in problem.prior.distributions.values()]
        self._most = np.where([d.dist.name == "logitnorm" for d in problem.prior.distributions.values()], ends, np.inf)
        slack = [slack_edge(problem, sample) for sample in problem.samples] if for_draws else []
        self.slack_edges = [s for s in slack if s and not self.log_columns[s.preload] and s.preload not in self.edges]
        level = tension_level(problem, self.slack_edges) if for_draws else None
        open_ = level is not None and self.log_columns[level.k1] and not self.log_columns[level.preload]
        self.level = level if open_ and level is not None and level.preload not in self.edges else None
        self.log_spread = np.ones(len(names))
        for i in np.flatnonzero(self.log_columns).tolist():
            low, high = problem.prior.distributions[names[i]].ppf(_ONE_SD)
            self.log_spread[i] = 0.5 * (_log_odds(high, self._most[i]) - _log_odds(low, self._most[i]))
        self.noises = _noises(problem, self.log_columns, self.log_spread)
        self.sensor_columns, self.setting_columns = (
            [i for i, name in enumerate(names) if name.split("[")[0] == of and self.log_columns[i]]
            for of in ("sensor_sd", "setting_sd")
        )
        self.order = np.array(sorted(range(len(names)), key=lambda i: _rank(names[i])))
        self.ridges: list[_Ridge] = []
        self.shares: list[int] = []
        shifted: set[str] = set()  # a column that several samples share follows the first of them
        for sample in problem.samples:
            mark = _mark(problem, sample.material)
            columns = {
                name: own if (own := f"{name}[{sample.name}]") in names else f"{name}{mark}" for name in MATERIAL
            }
            fixed = {name: problem.prior.fixed[c] for name, c in columns.items() if c in problem.prior.fixed}
            if "k1" not in sample.parameters(problem.likelihood):
                fixed["k1"] = 1.0  # no reading depends on it
            where = {
                name: names.index(c) for name, c in columns.items() if c in names and self.log_columns[names.index(c)]
            }
            if len(where) + len(fixed) < len(MATERIAL):
                continue  # a user's prior that allows negative values: leave this material's columns as they are
            moved = frozenset({"k2", "U", "B", "k1"} & {name for name in where if columns[name] not in shifted})
            if not for_draws:
                moved -= {"U"}
            if "B" not in moved or sample.protocol.control == "force":
                moved -= {"k1"}  # the tension lost in a hold is not known
            if "k2" not in moved or sample.model.history != "saturating" or problem.likelihood != "chain":
                moved -= {"U"}  # every hold creeps anew, or the rate of the creep is not sampled here
            shifted |= {columns[name] for name in moved}
            if moved:
                effects = tuple(e for e in sample.model.at("amount") if compiled.has_formula(e))  # others may ask for B
                for column in (c for e in effects for c in e.columns()):
                    name = problem.column(column, sample)
                    if name in names:
                        where[column] = names.index(name)
                    else:
                        fixed[column] = problem.prior.fixed[name]
                ridge = _ridge(where, fixed, moved, problem, sample, effects)
                if self.level is not None:
                    ridge = replace(ridge, log_step=self.level.log_last)
                self.ridges.append(self._with_shares(ridge, sample) if for_draws else ridge)
                self.shares += self.ridges[-1].shares

    @property
    def kinds_of_creep(self) -> list[list[int]]:
        """Columns that say how fast each material creeps, its hazard at half a hold; and its power of tension."""
        rates = [ridge.where["k2"] for ridge in self.ridges if "k2" in ridge.shifted]
        powers = [ridge.where["U"] for ridge in self.ridges if "U" in ridge.where]
        return [columns for columns in (rates, powers) if columns]

    def to_sampled(self, theta: Array) -> Array:
        """Sampled coordinates of natural parameters."""
        z = theta / self.scale
        z[:, self.log_columns] = self._logarithms(theta)
        for i, at in self.edges.items():
            z[:, i] = at.score(theta[:, i])
        for slack in self.slack_edges:
            z[:, slack.preload] = slack.score(theta) / self.scale[slack.preload]
        for ridge in self.ridges:
            if "k2" in ridge.shifted:
                z[:, ridge.where["k2"]] += self._hazard(theta, ridge)
            if "U" in ridge.shifted:
                z[:, ridge.where["U"]] -= ridge.log_power(z)
            with np.errstate(all="ignore"):
                if "B" in ridge.shifted:
                    self._add_losses(z, theta, ridge)
                if ridge.fixture is not None:
                    own = np.log(theta[:, ridge.fixture]) + np.log(ridge.get(theta, "k1")) - ridge.log_length
                    z[:, ridge.fixture] = shares.score(own, np.zeros_like(own))
                    z[:, ridge.where["k1"]] -= np.logaddexp(0.0, own)
                if "k1" in ridge.shifted:
                    z[:, ridge.where["k1"]] -= ridge.softened(z)
        if self.level is not None:
            z[:, self.level.k1] += self.level.stretch(theta)
        return z

    def to_natural(self, z: Array) -> Array:
        """Natural parameters of sampled coordinates."""
        theta = z * self.scale
        for i, at in self.edges.items():
            theta[:, i] = at.value(z[:, i])
        if self.level is not None:  # no coordinate of a preload depends on k1 there
            self._preloads(theta)
            z = z.copy()
            z[:, self.level.k1] -= self.level.stretch(theta)
        with np.errstate(all="ignore"):
            odds = np.exp(z[:, self.log_columns])
            theta[:, self.log_columns] = odds / (1.0 + odds / self._most[self.log_columns])
            for ridge in self.ridges:
                self._fill_ridge(theta, z, ridge)
            if self.level is None:
                self._preloads(theta)
        return theta

    def _fill_ridge(self, theta: Array, z: Array, ridge: _Ridge) -> None:
        """Natural parameters of a ridge, in the order in which one needs the other."""
        column = ridge.where
        if "k2" in ridge.shifted:
            theta[:, column["k2"]] = np.exp(z[:, column["k2"]] - self._hazard(theta, ridge))
        if "U" in ridge.shifted:
            theta[:, column["U"]] = np.exp(z[:, column["U"]] + ridge.log_power(z))
        if "k1" in ridge.shifted:
            self._fill_stiffness(theta, z, ridge)
        if "B" in ridge.shifted:
            self._fill_creep(theta, z, ridge)

    def _fill_stiffness(self, theta: Array, z: Array, ridge: _Ridge) -> None:
        """Stiffness, and the share of it that a fixture takes."""
        log_k1 = z[:, ridge.where["k1"]] + ridge.softened(z)
        if ridge.fixture is not None:
            share, rest = shares.log_shares(z[:, ridge.fixture])
            theta[:, ridge.fixture] = np.exp(share - log_k1 + ridge.log_length)
            log_k1 = log_k1 - rest
        theta[:, ridge.where["k1"]] = np.exp(log_k1)

    def _fill_creep(self, theta: Array, z: Array, ridge: _Ridge) -> None:
        """Creep by the tension that it loses, and what is beside it by its share of that."""
        lost, stiffness = z[:, ridge.where["B"]], ridge.log_stiffness(theta)
        for part in reversed(ridge.beside):
            share, rest = shares.log_shares(z[:, part.column])
            gained = part.log_gained(theta) + stiffness
            theta[:, part.column] = np.exp(lost + share - gained)
            lost = lost + rest
        driven = self._driven(theta, ridge)
        theta[:, ridge.where["B"]] = np.exp(lost - (ridge.log_creep(theta) + stiffness) - driven)

    def log_jacobian(self, theta: Array, z: Array) -> Array:
        """(n,) log |d natural / d sampled|.

        Parameters
        ----------
        theta, z : (n, d) arrays
            Natural parameters and their coordinates.
        """
        positive = theta[:, self.log_columns]
        total = (np.log(positive) + np.log1p(-positive / self._most[self.log_columns])).sum(axis=1) + self._log_scale
        for i, at in self.edges.items():
            total = total + (shares.log_slope(theta[:, i], z[:, i]) if i in self.shares else at.log_slope(theta[:, i]))
        for slack in self.slack_edges:
            total = total + slack.log_slope(theta)
        return np.asarray(total)

    def prior_residuals(self, theta: Array, z: Array) -> Array:
        """(d, n) distances from the middle of the prior in its standard deviations, but for a constant each.

        Parameters
        ----------
        theta, z : (n, d) arrays
            Natural parameters and their coordinates.
        """
        # other coordinates than logarithms have a standard deviation of one already
        out = z.copy()
        out[:, self.log_columns] = self._logarithms(theta)
        out /= self.log_spread
        for name in self.problem.prior.powers.keys() & self.problem.prior.distributions.keys():
            i = self.problem.names.index(name)
            out[:, i] += self.problem.prior.log_factor(name, theta) / self.log_spread[i]
        for i in self.shares:
            out[:, i] = self.edges[i].score(theta[:, i])
        for slack in self.slack_edges:
            out[:, slack.preload] = theta[:, slack.preload] / self.scale[slack.preload]
        return np.asarray(out.T)

    def _logarithms(self, theta: Array) -> Array:
        """(n, k) logarithms of the positive parameters, of those with a largest value the log odds of reaching it."""
        return _log_odds(theta[:, self.log_columns], self._most[self.log_columns])

    def _add_losses(self, z: Array, theta: Array, ridge: _Ridge) -> None:
        """Put the tension lost in a hold in place of B, and shares of it in place of what creeps beside the creep."""
        stiffness = ridge.log_stiffness(theta)
        lost = z[:, ridge.where["B"]] + (ridge.log_creep(theta) + stiffness) + self._driven(theta, ridge)
        for part in ridge.beside:
            own = np.log(theta[:, part.column]) + part.log_gained(theta) + stiffness
            z[:, part.column] = shares.score(own, lost)
            lost = np.logaddexp(lost, own)
        z[:, ridge.where["B"]] = lost

    def _preloads(self, theta: Array) -> None:
        """Put preloads in place of their scores."""
        for slack in self.slack_edges:
            theta[:, slack.preload] = slack.value(theta[:, slack.preload], theta)

    def _driven(self, theta: Array, ridge: _Ridge) -> Any:
        """(n,) log creep by which the tension at the beginning of the only hold drives more than its first reading."""
        return 0.0 if self.level is None else ridge.get(theta, "U") * self.level.driven(theta)

    def _hazard(self, theta: Array, ridge: _Ridge) -> Array:
        return np.asarray(ridge.get(theta, "N") * ridge.log_half_hold)

    def _with_shares(self, ridge: _Ridge, sample: Sample) -> _Ridge:
        """The ridge with what is to be sampled by its share: amounts that are half-normal under the prior.

        Of these any sum and any share is possible. What belongs to a ridge before stays there.
        """
        names, fixed = self.problem.names, self.problem.prior.fixed
        ends = tuple(
            replace(hold, time_s=ridge.times_s[time].reshape(1, 1))
            for hold, time in zip(ridge.holds, ridge.which_time, strict=True)
        )
        for effect in sample.model.effects:
            columns = [self.problem.column(column, sample) for column in effect.columns()]
            if not columns or columns[0] not in names or (amount := names.index(columns[0])) in self.shares:
                continue
            if amount not in self.edges or self.edges[amount].ends:
                continue
            if effect.in_series and "k1" in ridge.shifted:
                ridge = replace(ridge, fixture=amount)
            elif effect.amplitudes[0].is_elongation and effect.place != "strain" and "B" in ridge.shifted:
                others = {
                    a.name: names.index(c) if c in names else fixed[c]
                    for a, c in zip(effect.amplitudes[1:], columns[1:], strict=True)
                }
                part = Elongation(amount, effect, others, ends, ridge.kept)
                ridge = replace(ridge, beside=(*ridge.beside, part))
        return ridge


def _log_odds(value: Any, most: Any) -> Any:
    """``log(value / (1 - value / most))``: the logarithm of values far below the most."""
    with np.errstate(all="ignore"):  # what cannot be has no coordinate
        return np.log(value) - np.log1p(-value / most)


def _noises(problem: Problem, log_columns: NDArray[np.bool_], spread: Array) -> tuple[Noises, ...]:
    """Of every sample of which neither noise is fixed; holds by themselves have no setting errors."""
    out = []
    for sample in problem.samples if problem.likelihood == "chain" else ():
        names = [problem.column(name, sample) for name in ("sensor_sd", "setting_sd")]
        if all(name in problem.names and log_columns[problem.names.index(name)] for name in names):
            sensor, setting = (problem.names.index(name) for name in names)
            middle = np.diff([np.log(problem.prior.distributions[name].median()) for name in names])[0]
            out.append(Noises(sensor, setting, float(middle), float(np.hypot(spread[sensor], spread[setting]))))
    return tuple(out)


def _rank(name: str) -> int:
    kind = name.split("[")[0]
    return _FIRST.index(kind) - len(_FIRST) if kind in _FIRST else int(kind in _LAST)


def _ridge(
    where: dict[str, int],
    fixed: dict[str, float],
    shifted: frozenset[str],
    problem: Problem,
    sample: Sample,
    effects: tuple[Effect, ...],
) -> _Ridge:
    tension = _driving(sample)
    log_step = 0.5 * float(np.log(np.mean(np.diff(tension, prepend=0.0) ** 2)))
    hold_s = sample.typical_hold_s
    duration = sample.protocol.duration_s
    durations = np.where(duration > 0, duration, hold_s)
    times, which = np.unique(durations, return_inverse=True)
    kept = 1.0 if sample.model.history == "saturating" and problem.likelihood == "chain" else 0.0
    length = sample.model.length_ref_mm or sample.protocol.length_mm
    holds = tuple(
        HoldContext(**hold, length_ref_mm=length, tension_ref_N=sample.model.tension_ref_N, theta={},
                    initial_tension=np.full((1, 1), first))
        for hold, first in zip(sample.protocol.holds, tension, strict=True)
    )  # fmt: skip
    powers = _powers(problem, sample, np.log(tension), durations / (0.5 * hold_s)) if "U" in shifted else _NONE
    return _Ridge(
        where, fixed, shifted, np.log(tension), log_step, times, which, kept, hold_s, float(np.log(length)),
        effects, holds, powers, elongations=sample.protocol.control == "force",
    )  # fmt: skip


def _driving(sample: Sample) -> Array:
    """(H,) tensions that drive the creep: as set, or the first readings."""
    if sample.protocol.control == "force":
        return sample.protocol.setting
    recorded = np.flatnonzero(sample.protocol.recorded)
    first = np.interp(np.arange(len(sample.readings)), recorded, sample.readings[recorded, 0, 0])
    # a slack wire drives no creep; a small share of the largest tension stands in for it
    return np.maximum(first, 0.02 * first.max()) if first.max() > 0 else np.ones_like(first)


def _powers(problem: Problem, sample: Sample, log_tension: Array, relative_s: Array) -> tuple[Array, Array]:
    """Log hazards and the log U that suits the losses of a sample's holds best at each of them."""
    readings, protocol = sample.readings[..., 0], sample.protocol
    last = readings[np.arange(len(readings)), protocol.last_reading]
    changed = last - readings[:, 0] if protocol.control == "force" else readings[:, 0] - last
    lost = np.where(protocol.mask.sum(axis=1) > 1, changed, np.nan)
    power, exponent = (problem.column(name, sample) for name in ("U", "N"))
    low, middle, high = np.log(problem.prior.distributions[power].ppf([_ONE_SD[0], 0.5, _ONE_SD[1]]))
    fixed = problem.prior.fixed
    N = fixed[exponent] if exponent in fixed else problem.prior.distributions[exponent].median()
    return suiting_powers(lost, log_tension, relative_s, float(N), float(middle), 0.5 * float(high - low))


def _spread(distribution: Any) -> float:
    sd = float(distribution.std())
    return sd if np.isfinite(sd) and sd > 0 else 1.0


def _mark(problem: Problem, material: str) -> str:
    marked = f"k1[{material}]"
    return f"[{material}]" if marked in problem.names or marked in problem.prior.fixed else ""
