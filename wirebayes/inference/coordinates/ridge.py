"""What the measured tensions say about the curved ridge in the creep parameters of one material."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from wirebayes.inference.coordinates.columns import ONE_SD, ColumnMap
from wirebayes.inference.coordinates.power_of_tension import suiting_powers
from wirebayes.inference.coordinates.shares import Elongation
from wirebayes.model.problem import Problem
from wirebayes.model.sample import MATERIAL, Sample
from wirebayes.numeric.typing import Array, Ints
from wirebayes.wire import compiled
from wirebayes.wire.effect import Effect, HoldContext, Placed


@dataclass(frozen=True)
class Ridge:
    """Columns of one material's parameters (or fixed values), which of them are shifted, and what shifts them.

    `effects` are those on the amount of creep, and `holds` what they see of the test, tensions as measured. `powers`
    are log hazards and the log U that suits the losses best at each of them. `fixture` is the column of a compliance in
    series with the wire, and `beside` what creeps beside the creep. `elongations` where these are read, not tensions.

    Of the distinct `times_s`, holds end at `which_end`; `between` are pairs of them, of a first and a last reading, and
    `which_pair` is that of each hold.
    """

    where: dict[str, int]
    fixed: dict[str, float]
    shifted: frozenset[str]
    log_tension: Array
    log_step: float
    times_s: Array
    which_end: Ints
    between: Ints
    which_pair: Ints
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

    def log_hazard(self, theta: Array) -> Array:
        """(n,) log hazard at half a typical hold, less log k2, at natural parameters (n, d)."""
        return self.get(theta, "N") * self.log_half_hold

    def log_power(self, z: Array) -> Array:
        """(n,) log U that suits the measured losses best at the hazards of sampled coordinates (n, d)."""
        return np.interp(z[:, self.where["k2"]], *self.powers)

    def log_stiffness(self, theta: Array) -> Array:
        """(n,) log of what is read per elongation: N/mm of the wire with its fixture, 1 where elongations are read."""
        if self.elongations:
            return np.zeros(len(theta))
        stiffness = np.log(self.get(theta, "k1")) - self.log_length
        if self.fixture is None:
            return stiffness
        return np.asarray(stiffness - np.logaddexp(0.0, np.log(theta[:, self.fixture]) + stiffness))

    def reached(self, theta: Array, time_s: Array | float) -> Array:
        """The share of its creep that a hold has reached after a time, (n,) or (T, n) for times (T, 1)."""
        return -np.expm1(-self.get(theta, "k2") * time_s ** self.get(theta, "N"))

    @property
    def end_s(self) -> Array:
        """(H,) how long the holds last, s."""
        return self.times_s[self.which_end]

    def softened(self, theta: Array, z: Array) -> Array:
        """(n,) by how much the log stiffness is less after the creep.

        Parameters
        ----------
        theta, z : (n, d) arrays
            Natural parameters, of which k1 and B are not looked at, and sampled coordinates.
        """
        log_gained = z[:, self.where["B"]] + self.log_unseen(theta)
        return np.logaddexp(0.0, log_gained - self.log_step)

    def log_amount(self, theta: Array, z: Array) -> Array:
        """(n,) log B as sampled, times what is read per elongation; with all that creeps beside the creep.

        Parameters
        ----------
        theta, z : (n, d) arrays
            Natural parameters, of which k1 and B are not looked at, and sampled coordinates.
        """
        return np.asarray(z[:, self.where["B"]] - self.log_creep(theta))

    def log_creep(self, theta: Array) -> Array:
        """(n,) log G: root mean square of the elongation that a hold shows, for B = 1, at natural parameters (n, d)."""
        _, shown = self._squares(theta)
        # the floor keeps the logarithm finite
        return self.get(theta, "U") * self._tensions[0] + 0.5 * np.log(np.maximum(shown, _NOTHING))

    def log_unseen(self, theta: Array) -> Array | float:
        """(n,) log of the elongation gained in a hold over what it shows, both root mean squares."""
        if self._all_is_seen:
            return 0.0
        gained, shown = self._squares(theta)
        return np.asarray(0.5 * (np.log(np.maximum(gained, _NOTHING)) - np.log(np.maximum(shown, _NOTHING))))

    def log_total(self, theta: Array, holds: int) -> Array:
        """(n,) log of the elongation gained in the first holds together over the root mean square that a hold shows."""
        gained, shown = self._gained(self._drive(theta), *self._shares(theta), theta)
        total = gained[:holds].sum(axis=0)
        square = (shown**2).mean(axis=0)
        return np.asarray(np.log(np.maximum(total, 1e-150)) - 0.5 * np.log(np.maximum(square, _NOTHING)))

    @cached_property
    def _all_is_seen(self) -> bool:
        """Whether readings begin and end with the holds."""
        first, last = self.between[self.which_pair].T
        return bool((self.times_s[first] == 0.0).all() and (last == self.which_end).all())

    def _drive(self, theta: Array) -> Array:
        """What the creep of each hold aims at beside that at the mean tension."""
        return np.exp(self.get(theta, "U") * self._tensions[1])

    def _shares(self, theta: Array) -> tuple[Array, Array]:
        """The shares of it that are reached at each of the times, and seen between each pair of them."""
        reached = self.reached(theta, self.times_s[:, None])
        first, last = self.between.T
        return reached, reached[last] - (1.0 - _COUNTED) * reached[first]

    def _squares(self, theta: Array) -> tuple[Array, Array]:
        """(n,) mean squares of the elongation gained in a hold, and of what it shows; B and mean tension are one."""
        driven = self._drive(theta), *self._shares(theta)
        if compiled.kernel is not None and not self.effects:
            # of parameters that are fixed there is one column
            drive, reached, seen = (a if a.shape[1] == len(theta) else np.repeat(a, len(theta), axis=1) for a in driven)
            holds = self.which_end, self.which_pair, self.kept
            gained, shown = compiled.kernel.squares_gained(drive, reached, seen, *holds)
        else:
            gained, shown = ((part**2).sum(axis=0) for part in self._gained(*driven, theta))
        return gained / len(self.which_end), shown / len(self.which_end)

    def _gained(self, drive: Array, reached: Array, seen: Array, theta: Array) -> tuple[Array, Array]:
        """(H, n) elongation gained in each hold, and what it shows: `compiled.kernel.squares_gained` sums the squares.

        Effects on the amount of creep are included here.
        """
        carried = 0.0 * reached[0]
        every_gained = []
        every_shown = []
        amplitudes: dict[str, Array] = {}
        for effect in self.effects:
            amplitudes |= {column: self.get(theta, column) for column in effect.columns()}
        effects = Placed(self.effects, amplitudes)
        for j, (end, pair) in enumerate(zip(self.which_end, self.which_pair, strict=True)):
            amount = drive[j] - self.kept * carried
            if self.effects:
                hold = self.holds[j].carrying(carried[None])
                amount = effects.change("amount", amount[None], hold)[0]
            gained = amount * reached[end]
            carried = carried + gained
            every_gained.append(gained)
            every_shown.append(amount * seen[pair])
        gained = np.array(np.broadcast_arrays(*every_gained))
        shown = np.array(np.broadcast_arrays(*every_shown))
        return gained, shown


_NOTHING = 1e-300  # of a square whose logarithm has to be finite
# share of what is gained before a first reading that counts as shown, so that creep which is over by then has a size
_COUNTED = 0.05


def ridges_of(problem: Problem, columns: ColumnMap) -> list[Ridge]:
    """The ridges of a problem's materials; a column that several samples share follows the first of them.

    Parameters
    ----------
    columns : ColumnMap
        How each parameter is measured by itself.
    """
    found: list[Ridge] = []
    taken: set[int] = set()
    for sample in problem.samples:
        where, fixed = _parameters(problem, sample, columns)
        known = len(where) + len(fixed)
        if known < len(MATERIAL):
            continue  # a user's prior that allows negative values: leave this material's columns as they are
        free = {name for name, column in where.items() if column not in taken}
        shifted = _shifted(problem, sample, free)
        if not shifted:
            continue
        taken |= {where[name] for name in shifted}
        ridge = _ridge(problem, sample, where, fixed, shifted)
        owned = [column for each in found for column in each.shares]
        found.append(_with_shares(ridge, problem, sample, columns, owned))
    return found


def for_sample(ridge: Ridge, problem: Problem, sample: Sample) -> Ridge:
    """The ridge of a material as one of its samples has it: its holds and tensions.

    Parameters
    ----------
    ridge : Ridge
    problem : Problem
    sample : Sample
        Of the same material.
    """
    if sample is problem.samples[0]:
        return ridge
    return _ridge(problem, sample, dict(ridge.where), dict(ridge.fixed), ridge.shifted - {"U"})


def _parameters(problem: Problem, sample: Sample, columns: ColumnMap) -> tuple[dict[str, int], dict[str, float]]:
    """Columns of a sample's positive creep parameters, and what others are fixed at."""
    names, mark = problem.names, _mark(problem, sample.material)
    own = {name: f"{name}[{sample.name}]" for name in MATERIAL}
    called = {name: own[name] if own[name] in names else f"{name}{mark}" for name in MATERIAL}
    fixed = {name: problem.prior.fixed[c] for name, c in called.items() if c in problem.prior.fixed}
    if "k1" not in sample.parameters(problem.likelihood):
        fixed["k1"] = 1.0  # no reading depends on it
    where = {name: names.index(c) for name, c in called.items() if c in names}
    return {name: column for name, column in where.items() if columns.positive[column]}, fixed


def _mark(problem: Problem, material: str) -> str:
    marked = f"k1[{material}]"
    return f"[{material}]" if marked in problem.names or marked in problem.prior.fixed else ""


def _shifted(problem: Problem, sample: Sample, free: set[str]) -> frozenset[str]:
    """Those of the free parameters that have another coordinate than their logarithm."""
    shifted = {"k2", "U", "B", "k1"} & free
    if "B" not in shifted:
        shifted -= {"k1"}  # what is gained in a hold is not known
    if "k2" not in shifted or sample.model.history != "saturating" or problem.likelihood != "chain":
        shifted -= {"U"}  # every hold creeps anew, or the rate of the creep is not sampled here
    return frozenset(shifted)


def _ridge(
    problem: Problem,
    sample: Sample,
    where: dict[str, int],
    fixed: dict[str, float],
    shifted: frozenset[str],
) -> Ridge:
    effects = tuple(e for e in sample.model.at("amount") if e.has_formula)  # others may ask for B
    for column in (c for e in effects for c in e.columns()):
        name = problem.column(column, sample)
        if name in problem.names:
            where[column] = problem.names.index(name)
        else:
            fixed[column] = problem.prior.fixed[name]
    tension = _driving(sample)
    hold_s, duration = sample.typical_hold_s, sample.protocol.duration_s
    durations = np.where(duration > 0, duration, hold_s)
    first_and_last = _seen(sample, durations)
    times, which = np.unique([*first_and_last, durations], return_inverse=True)
    first, last, end = which.reshape(3, -1)
    pairs = np.column_stack([first, last])
    between, which_pair = np.unique(pairs, axis=0, return_inverse=True)
    powers = np.zeros(1), np.zeros(1)  # U is sampled as it is
    if "U" in shifted:
        powers = _powers(problem, sample, np.log(tension), durations / (0.5 * hold_s))
    return Ridge(
        where,
        fixed,
        shifted,
        log_tension=np.log(tension),
        log_step=0.5 * float(np.log(np.mean(np.diff(tension, prepend=0.0) ** 2))),
        times_s=times,
        which_end=end,
        between=between,
        which_pair=which_pair.reshape(-1),
        kept=1.0 if sample.model.history == "saturating" and problem.likelihood == "chain" else 0.0,
        hold_s=hold_s,
        log_length=float(np.log(sample.length_ref_mm)),
        effects=effects,
        holds=_holds(sample, tension),
        powers=powers,
        elongations=sample.protocol.control == "force",
    )


def _holds(sample: Sample, tension: Array) -> tuple[HoldContext, ...]:
    """What effects see of the holds, which begin at these tensions (H,)."""
    length, reference = sample.length_ref_mm, sample.model.tension_ref_N
    return tuple(
        HoldContext(
            **hold, length_ref_mm=length, tension_ref_N=reference, theta={}, initial_tension=np.full((1, 1), first)
        )
        for hold, first in zip(sample.protocol.holds, tension, strict=True)
    )


def _seen(sample: Sample, durations: Array) -> tuple[Array, Array]:
    """(H,) when the first and last reading of each hold were taken; its beginning and end where there are no two."""
    protocol = sample.protocol
    first, last = protocol.time_s[:, 0], protocol.time_s[np.arange(len(durations)), protocol.last_reading]
    several = protocol.mask.sum(axis=1) > 1
    return np.where(several, first, 0.0), np.where(several, last, durations)


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
    low, middle, high = np.log(problem.prior.distributions[power].ppf([ONE_SD[0], 0.5, ONE_SD[1]]))
    fixed = problem.prior.fixed
    N = fixed[exponent] if exponent in fixed else problem.prior.distributions[exponent].median()
    return suiting_powers(lost, log_tension, relative_s, float(N), float(middle), 0.5 * float(high - low))


def _with_shares(ridge: Ridge, problem: Problem, sample: Sample, columns: ColumnMap, owned: Collection[int]) -> Ridge:
    """The ridge with what is to be sampled by its share: amounts that are half-normal under the prior.

    Of these any sum and any share is possible. What other ridges own stays there.
    """
    for effect in sample.model.effects:
        names = [problem.column(column, sample) for column in effect.columns()]
        if not names or names[0] not in problem.names:
            continue
        amount = problem.names.index(names[0])
        if amount in owned or amount in ridge.shares:
            continue
        edge = columns.edges.get(amount)
        if edge is None or edge.ends:
            continue
        shifted = ridge.shifted
        if effect.in_series and "k1" in shifted and not ridge.elongations:
            ridge = replace(ridge, fixture=amount)
        elif effect.amplitudes[0].is_elongation and effect.place != "strain" and "B" in shifted:
            elongation = _elongation(ridge, problem, effect, names)
            beside = (*ridge.beside, elongation)
            ridge = replace(ridge, beside=beside)
    return ridge


def _elongation(ridge: Ridge, problem: Problem, effect: Effect, names: list[str]) -> Elongation:
    """What an effect with amplitudes of these names adds to the creep of a ridge."""
    columns = [problem.names.index(n) if n in problem.names else problem.prior.fixed[n] for n in names]
    others = {a.name: column for a, column in zip(effect.amplitudes[1:], columns[1:], strict=True)}
    ends = tuple(
        replace(hold, time_s=ridge.times_s[time].reshape(1, 1))
        for hold, time in zip(ridge.holds, ridge.which_end, strict=True)
    )
    return Elongation(problem.names.index(names[0]), effect, others, ends, ridge.kept)
