"""What the measured tensions say about the curved ridge in the creep parameters of one material."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from wirebayes.inference.coordinates.shares import Elongation
from wirebayes.numeric.typing import Array, Ints
from wirebayes.wire import compiled
from wirebayes.wire.effect import Effect, HoldContext, Placed


@dataclass(frozen=True)
class Ridge:
    """One material's parameters, and what of its test shifts their coordinates.

    Attributes
    ----------
    where : dict of str to int
        Columns of the material's parameters that are sampled.
    fixed : dict of str to float
        Values of the others.
    shifted : frozenset of str
        Parameters that have another coordinate than their logarithm.
    log_tension : (H,) array
        Logarithm of the tension that drives the creep of each hold, as measured.
    log_step : float
        Logarithm of the root mean square of the steps of that tension.
    times_s : (t,) array
        The distinct times at which holds end, or have their first or last reading.
    which_end : (H,) array of int
        Which of the times is the end of each hold.
    between : (k, 2) array of int
        The distinct pairs of a first and a last reading.
    which_pair : (H,) array of int
        Which of the pairs is that of each hold.
    kept : float
        Share of the creep that is carried into the next hold: 1, or 0 where every hold creeps anew.
    hold_s : float
        How long a typical hold lasts.
    log_length : float
        Logarithm of the length, mm, that the creep belongs to.
    effects : tuple of Effect
        Those on the amount of creep.
    holds : tuple of HoldContext
        What these effects see of each hold, tensions as measured.
    powers : (m,), (m,) arrays
        Log hazards, and the log U that suits the losses best at each of them.
    fixture : int or None
        Column of a compliance in series with the wire.
    beside : tuple of Elongation
        What creeps beside the creep.
    elongations : bool
        Whether elongations are read, not tensions.
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
        return stiffness - np.logaddexp(0.0, np.log(theta[:, self.fixture]) + stiffness)

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
        return z[:, self.where["B"]] - self.log_creep(theta)

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
        return 0.5 * (np.log(np.maximum(gained, _NOTHING)) - np.log(np.maximum(shown, _NOTHING)))

    def log_total(self, theta: Array, holds: int) -> Array:
        """(n,) log of the elongation gained in the first holds together over the root mean square that a hold shows."""
        gained, shown = self._gained(self._drive(theta), *self._shares(theta), theta)
        total = gained[:holds].sum(axis=0)
        square = (shown**2).mean(axis=0)
        return np.log(np.maximum(total, 1e-150)) - 0.5 * np.log(np.maximum(square, _NOTHING))

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
        n = len(theta)
        holds = len(self.which_end)
        driven = self._drive(theta), *self._shares(theta)
        if compiled.kernel is not None and not self.effects:
            # of parameters that are fixed there is one column
            drive, reached, seen = (part if part.shape[1] == n else np.repeat(part, n, axis=1) for part in driven)
            holds_of = self.which_end, self.which_pair, self.kept
            gained, shown = compiled.kernel.squares_gained(drive, reached, seen, *holds_of)
        else:
            gained, shown = ((part**2).sum(axis=0) for part in self._gained(*driven, theta))
        return gained / holds, shown / holds

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
