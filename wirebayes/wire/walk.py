"""A walk along the holds of a test, each computed from what the holds before it have left."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np

from wirebayes.numeric.typing import Array
from wirebayes.wire import laws
from wirebayes.wire.control import SETTINGS
from wirebayes.wire.creep import Creep
from wirebayes.wire.effect import Clock, HoldContext, Placed
from wirebayes.wire.elastic_with_effects import Elastic
from wirebayes.wire.model import Model
from wirebayes.wire.protocol import Protocol

Theta = Mapping[str, Array]
_NONE: Array = np.zeros((1, 1))  # stands in for what the hold has not computed yet
_STEP = 1e-30  # a complex step has no truncation error, so it may be this small


@contextmanager
def _at(hold: HoldContext, time_s: Array) -> Iterator[None]:
    """Effects see a single time of the hold, at its first temperature."""
    every_time, warming = hold.time_s, hold.warming_K
    hold.time_s, hold.warming_K = time_s, warming[:1]
    yield
    hold.time_s, hold.warming_K = every_time, warming


class Sloped(NamedTuple):
    """Values of a hold, and their derivatives by its own setting error and by the creep carried into it."""

    value: Array
    by_setting: Array
    by_creep: Array


class LinearHoldWalked(NamedTuple):
    """A hold with its derivatives: readings (R, n), the creep (n,) that it carries on, and the stretch when it begins.

    The stretch, mm, is that of the wire beyond its zero-tension length, (n,); where the tension is set it is empty.
    """

    readings: Sloped
    carried: Sloped
    stretch: Sloped


class Walk:
    """One pass along the holds: what all holds share is computed once here."""

    def __init__(self, protocol: Protocol, theta: Theta, model: Model) -> None:
        self.protocol = protocol
        self.model = model
        self.past: list[Clock] = []
        self.stretch: Array = np.zeros(0)  # mm, (n,), of the wire when the last hold began; negative where it was slack
        self.late: Any = 0.0
        effects = Placed(model.effects, theta)
        self.at = effects.at
        self.change = effects.change
        self.theta: dict[str, Array] = dict(theta)
        if "sample" in self.at:
            self.theta = self.change("sample", self.theta, self._context(0))
        if "time" in self.at:
            self.late = self.change("time", np.zeros((1, 1)), self._context(0))
        self.k1 = self.theta["k1"]
        self.B = self.theta["B"]
        self.U = self.theta["U"]
        self.k2 = self.theta["k2"]
        self.N = self.theta["N"]
        self.creep = Creep(effects, self.theta, model.history)
        self.kept = self.creep.kept
        self.base = protocol.length_mm + self.theta["preload"]
        elastic = Elastic(effects, self.k1, protocol.length_mm, model.law)
        self.bench = SETTINGS[protocol.control](effects, elastic, self.base)
        self.own_time = bool(self.at.keys() & {"rate", "clock", "fraction"})
        # Holds mostly share their reading times, so the exponentials are few.
        times, self.where = protocol.distinct_times
        self.fraction = laws.creep_fraction(times[:, None] + self.late, self.k2, self.N)

    def hold(
        self, j: int, setting: Array, creep: Array, beside: dict[str, Array]
    ) -> tuple[Array, Array, dict[str, Array]]:
        """One hold, effects included; real or complex.

        Parameters
        ----------
        j : int
            Its position among all holds. Holds are walked in order: effects may look at earlier ones.
        setting : (n,) or (1,) array
            Displacement, mm, or tension, N, with its error.
        creep : (n,) array
            Creep elongation carried in, mm.
        beside : dict of effect key to (1, n) array
            Elongations beside the creep carried in, mm; empty at the start.

        Returns
        -------
        readings : (R, n) array
            N, or mm where the tension is set.
        creep : (n,) array
        beside : dict of effect key to (1, n) array
            Both carried out.
        """
        hold = self._context(j)
        held = self.bench.held(setting, hold)
        hold.carried = creep[None]
        hold.initial_tension = self._first(held, sum(beside.values(), hold.carried), hold)
        if "wait" in self.at:
            wait_s = self.change("wait", np.zeros((1, 1)), hold)
            beside = self._wait(held, wait_s, beside, hold)
        if self.protocol.control == "displacement":
            self.stretch = (held - hold.zero_mm)[0]
        hold.grown = self._grown(j, hold)
        courses = self.creep.beside(beside, hold)
        total = sum(courses.values(), hold.grown)
        readings = self.bench.read(held, total, hold)
        end = self.protocol.end[j]
        beside = {key: course[end][None] for key, course in courses.items()}
        return readings, hold.grown[end], beside

    def _grown(self, j: int, hold: HoldContext) -> Array:
        """Creep elongation at the times of a hold, mm, which is then a part of the past."""
        amount = self.creep.amount(hold.initial_tension, hold)
        k2 = self.creep.rate(hold)
        fraction = self.creep.fraction(k2, hold) if self.own_time else self.fraction[self.where[j]]
        grown = self.creep.creep(hold.carried + amount * fraction, hold)
        self.past.append((hold.start_s, hold.carried + amount, k2))
        return grown

    def begin(self, n: int) -> tuple[Array, dict[str, Array]]:
        """What the wire brings into the first hold: its creep (n,), and elongations beside it by effect key."""
        if "before" not in self.at:
            return np.zeros(n), {}
        hold = self._context(0)
        hold.displacement_mm = 0.0
        hold.carried = np.zeros((1, n))
        held = self.bench.held(np.zeros(1), hold)
        hold.initial_tension = self._first(held, hold.carried, hold)
        before_s = self.change("before", np.zeros((1, 1)), hold)
        beside = self._wait(held, before_s, {}, hold)
        return np.array(np.broadcast_to(hold.carried[0], (n,))), beside

    def _wait(self, held: Array, wait_s: Array, beside: dict[str, Array], hold: HoldContext) -> dict[str, Array]:
        """Let time pass before a hold begins, as in a hold that nobody reads; what is then beside the creep."""
        if not np.any(wait_s):
            return beside
        with _at(hold, wait_s):
            amount = self.creep.amount(hold.initial_tension, hold)
            k2 = self.creep.rate(hold)
            fraction = self.creep.fraction_after(wait_s, k2, hold)
            hold.grown = self.creep.creep(hold.carried + amount * fraction, hold)
            self.past.append((hold.start_s, hold.carried + amount, k2))
            beside = self.creep.beside(beside, hold)
        self.past[:] = [(start_s - wait_s, goal, k2) for start_s, goal, k2 in self.past]
        hold.carried = hold.grown
        hold.initial_tension = self._first(held, sum(beside.values(), hold.carried), hold)
        return beside

    def fresh(self, j: int, setting: Array, rows: slice = slice(None)) -> tuple[Array, Array]:
        """Some readings of a hold without a past, and their derivatives by what is set.

        Parameters
        ----------
        j : int
            Position of the hold.
        setting : (n,) array
            Displacement, mm, or tension, N.
        rows : slice
            Which of its readings; all when left out.

        Returns
        -------
        reading, slope : (r, n) arrays
        """
        self.past = []
        uncrept = np.zeros(len(setting))
        if not self.model.effects and self.protocol.control == "displacement":
            reading, _ = self.closed_form(j, self.base + setting, uncrept, rows)
            return reading.value, reading.by_setting
        readings, _, _ = self.hold(j, setting + 1j * _STEP, uncrept, {})
        moved = readings[rows]
        return moved.real, moved.imag / _STEP

    def closed_form(self, j: int, stretched: Array, creep: Array, rows: slice = slice(None)) -> tuple[Sloped, Sloped]:
        """A hold without effects, eqs (4)-(6) differentiated by hand.

        Parameters
        ----------
        j : int
            Position of the hold.
        stretched : (n,) array
            Stretched length, mm.
        creep : (n,) array
            Creep elongation carried in, mm.
        rows : slice
            Which of its readings; all when left out.

        Returns
        -------
        readings : Sloped of (r, n) arrays
            N, and N/mm.
        carried : Sloped of (n,) arrays
            Creep carried out, mm.
        """
        zero = self.protocol.length_mm + creep
        amount = self._amount(stretched, zero, creep)
        fraction = self.fraction[self.where[j]]
        end = fraction[self.protocol.end[j]]
        carried = Sloped(creep + amount.value * end, amount.by_setting * end, 1.0 + amount.by_creep * end)
        return self._read(stretched, zero, amount, fraction[rows]), carried

    def _read(self, stretched: Array, zero: Array, amount: Sloped, fraction: Array) -> Sloped:
        """Readings (r, n) of a hold, N.

        Parameters
        ----------
        stretched, zero : (n,) arrays
            Stretched length, and zero-tension length when it begins, mm.
        amount : Sloped of (n,) arrays
            Creep still to come in the hold, mm.
        fraction : (r, n) array
            How much of it has come at each reading.
        """
        tension, by_stretched, by_zero = self._tension(stretched, zero + amount.value * fraction)
        stiff = np.where(tension > 0, self.k1, 0.0)
        by_setting = stiff * (by_stretched + by_zero * (amount.by_setting * fraction))
        by_creep = stiff * (by_zero * (1.0 + amount.by_creep * fraction))
        return Sloped(np.maximum(tension, 0.0), by_setting, by_creep)

    def _amount(self, stretched: Array, zero: Array, creep: Array) -> Sloped:
        """Creep still to come in a hold, mm; all (n,).

        Parameters
        ----------
        stretched, zero, creep : (n,) arrays
            Stretched and zero-tension length when it begins, and the creep carried in, mm.
        """
        first, by_stretched, by_zero = self._tension(stretched, zero)
        target, slope = self._target(first)
        return Sloped(target - self.kept * creep, slope * by_stretched, slope * by_zero - self.kept)

    def _target(self, tension: Array) -> tuple[Array, Array]:
        """Final creep (n,) at a tension, mm, and its derivative by the strain; zero when slack."""
        taut = tension > 0
        safe = np.where(taut, tension, 1.0)
        target = np.where(taut, self.B * np.power(safe, self.U), 0.0)
        return target, self.U * target / safe * self.k1

    def _tension(self, stretched: Array, zero: Array) -> tuple[Array, ...]:
        """Tension, N, and the slopes of strain by stretched and zero-tension length, 1/mm; (n,) or (r, n) arrays."""
        law = laws.LAWS[self.model.law]
        slopes = law.by_stretched(stretched, zero), law.by_zero(stretched, zero)
        return self.k1 * law.strain(stretched, zero), *slopes

    def _first(self, held: Array, elongation: Array, hold: HoldContext) -> Array:
        """Tension (1, n) when the hold begins: effects see its first time only."""
        with _at(hold, hold.time_s[:1]):
            return self.bench.tension(held, elongation, hold)

    def _context(self, j: int) -> HoldContext:
        length_ref_mm = self.model.length_ref_mm or self.protocol.length_mm
        of_hold = self.protocol.holds[j]
        if "time" in self.at:
            later = {"start_s": of_hold["start_s"] + j * self.late, "time_s": of_hold["time_s"] + self.late}
            of_hold = of_hold | later | {"duration_s": of_hold["duration_s"] + self.late}
        return HoldContext(
            **of_hold,
            length_ref_mm=length_ref_mm,
            tension_ref_N=self.model.tension_ref_N,
            theta=self.theta,
            initial_tension=_NONE,
            carried=_NONE,
            past=self.past,
            law=self.model.law,
            typical=self.model.typical,
        )


class ByHand(Walk):
    """A walk with derivatives in closed form, of a step test without effects; `brought` is the creep at its start."""

    def __init__(self, protocol: Protocol, theta: Theta, model: Model) -> None:
        super().__init__(protocol, theta, model)
        self.brought = np.zeros(np.shape(theta["k1"])[0])

    def linearised(self, j: int, setting: Array, creep: Array) -> LinearHoldWalked:
        """A hold of the walk.

        Parameters
        ----------
        j : int
            Position of the hold.
        setting : float or (n,) array
            Displacement, mm.
        creep : (n,) array
            Creep elongation carried in, mm.
        """
        stretched = self.base + setting
        readings, carried = self.closed_form(j, stretched, creep)
        one = np.ones(len(creep))
        return LinearHoldWalked(readings, carried, Sloped(stretched - (self.protocol.length_mm + creep), one, -one))

    elsewhere = linearised  # nothing is kept of a hold, so at another setting it is computed in the same way


class BySteps(Walk):
    """A walk with derivatives by complex steps, both in one pass; `brought` is the creep at its start.

    Of 2 n columns the first n take the step of the setting error, the others that of the creep.
    """

    def __init__(self, protocol: Protocol, theta: Theta, model: Model) -> None:
        super().__init__(protocol, {name: np.tile(value, 2) for name, value in theta.items()}, model)
        n = np.shape(theta["k1"])[0]
        self._setting_step, self._creep_step = 1j * np.repeat([[_STEP, 0.0], [0.0, _STEP]], n, axis=1)
        brought, self._beside = self.begin(2 * n)
        self._before = list(self.past), self._beside
        self.brought = brought[:n]

    def linearised(self, j: int, setting: Array, creep: Array) -> LinearHoldWalked:
        """A hold of the walk; holds are walked in order.

        Parameters
        ----------
        j : int
            Position of the hold.
        setting : float
            Displacement, mm, or tension, N.
        creep : (n,) array
            Creep elongation carried in, mm.
        """
        self._before = list(self.past), self._beside
        found, beside = self._stepped(j, setting, creep)
        self._beside = {key: value.real for key, value in beside.items()}
        self.past = [(start_s, goal.real, k2.real) for start_s, goal, k2 in self.past]
        return found

    def elsewhere(self, j: int, setting: Array, creep: Array) -> LinearHoldWalked:
        """The hold walked last at another setting, of which the walk takes no notice.

        Parameters
        ----------
        j, creep
            As for `linearised`.
        setting : (n,) array
        """
        after = self.past, self._beside
        past, self._beside = self._before
        self.past = list(past)
        found, _ = self._stepped(j, np.tile(setting, 2), creep)
        self.past, self._beside = after
        return found

    def _stepped(self, j: int, setting: Array, creep: Array) -> tuple[LinearHoldWalked, dict[str, Array]]:
        """A hold, and what it leaves beside the creep, with both steps."""
        carried_in = np.tile(creep, 2) + self._creep_step
        readings, carried, beside = self.hold(j, setting + self._setting_step, carried_in, self._beside)
        return LinearHoldWalked(_parted(readings), _parted(carried), _parted(self.stretch)), beside


def _parted(both: Array) -> Sloped:
    """Values (..., n) of both complex steps (..., 2 n), and what the steps make of them."""
    _, value = np.split(both.real, 2, axis=-1)
    by_setting, by_creep = np.split(both.imag / _STEP, 2, axis=-1)
    return Sloped(value, by_setting, by_creep)
