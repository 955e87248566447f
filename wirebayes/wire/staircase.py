"""Readings of one wire through a sequence of holds, batched over parameter sets.

Arrays end in the batch axis: readings are ``(H, R, n)``, one row of memory per reading, because long inner loops are
what numpy is fast at.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from wirebayes.numeric.typing import Array
from wirebayes.wire import compiled, laws
from wirebayes.wire.control import SETTINGS
from wirebayes.wire.creep import Creep
from wirebayes.wire.effect import Clock, HoldContext, Placed
from wirebayes.wire.elastic_with_effects import Elastic
from wirebayes.wire.model import PLAIN, Model
from wirebayes.wire.protocol import Protocol

if TYPE_CHECKING:
    from wirebayes.wire._kernel import Staircases

Theta = Mapping[str, Array]
_NONE: Array = np.zeros((1, 1))  # stands in for what the hold has not computed yet
_STEP = 1e-30  # a complex step has no truncation error, so it may be this small


@dataclass(frozen=True)
class Linearised:
    """A staircase and its first derivatives, all at setting error zero.

    Attributes
    ----------
    reading : (H, R, n)
        N, or mm where the tension is set.
    by_setting, by_creep : (H, R, n)
        Derivative of a hold's readings by its own setting error and by the creep carried into it.
    carry_by_setting, carry_by_creep : (H, n)
        Derivative of the creep carried out, by the same two.
    creep : (H + 1, n)
        Creep elongation carried into each hold, and out of the last.
    """

    reading: Array
    by_setting: Array
    by_creep: Array
    carry_by_setting: Array
    carry_by_creep: Array
    creep: Array


class Sloped(NamedTuple):
    """Values of a hold, and their derivatives by its own setting error and by the creep carried into it."""

    value: Array
    by_setting: Array
    by_creep: Array


def simulate(protocol: Protocol, theta: Theta, model: Model = PLAIN, setting_error: Array | None = None) -> Array:
    """Noise-free readings, the setting errors entering exactly.

    Parameters
    ----------
    theta : mapping of name to (n,) array
        ``k1 B U k2 N preload`` and ``effect_name.parameter`` of every effect of the model.
    setting_error : (H, n) array, optional
        Of each hold, in the unit of what is set; zero when left out. May be complex (derivatives).

    Returns
    -------
    (H, R, n) array
        N, or mm where the tension is set.
    """
    n = np.shape(theta["k1"])[0]
    exact = np.zeros((len(protocol.setting), 1))
    if setting_error is not None:
        exact = np.asarray(setting_error)
    call = None if np.iscomplexobj(exact) else compiled.call(protocol, theta, model)
    if call is not None:
        return compiled.kernel.simulate(*call, exact.astype(float))
    walk = Walk(protocol, theta, model)
    creep, beside = walk.begin(n)
    readings = []
    for j, setting in enumerate(protocol.setting[:, None] + exact):
        row, creep, beside = walk.hold(j, setting, creep, beside)
        readings.append(row)
    return np.array(readings)


def simulate_alone(protocol: Protocol, theta: Theta, model: Model = PLAIN) -> list[Array]:
    """Noise-free readings (R, n) of each hold as if there had been none before it.

    Parameters
    ----------
    protocol, theta, model
        As for `simulate`.
    """
    uncrept = np.zeros(len(theta["B"]))
    call = compiled.call(protocol, theta, model)
    if call is not None:
        return list(compiled.kernel.simulate(*call, np.zeros((len(protocol.setting), 1)), True))
    walk = Walk(protocol, theta, model)
    out = []
    for j, setting in enumerate(protocol.setting):
        walk.past = []
        readings, _, _ = walk.hold(j, uncrept + setting, uncrept, {})
        out.append(readings)
    return out


def linearise(protocol: Protocol, theta: Theta, model: Model = PLAIN) -> Linearised:
    """Readings with their derivatives by setting error and carried creep.

    Of a step test without effects the derivatives are in closed form; others come from a complex step through the same
    code that computes the readings. What effects carry beside the creep is held at its nominal value in them.

    Parameters
    ----------
    theta : mapping of name to (n,) array
        ``k1 B U k2 N preload`` and ``effect_name.parameter`` of every effect of the model.
    """
    call = compiled.call(protocol, theta, model)
    if call is not None:
        return Linearised(*compiled.kernel.linearise(*call))
    by_hand = not model.effects and protocol.control == "displacement"
    return _by_closed_form(protocol, theta, model) if by_hand else _by_complex_steps(protocol, theta, model)


def _nothing(protocol: Protocol, n: int) -> Linearised:
    """Arrays of n columns to be filled, without creep at the start."""
    holds, width = protocol.time_s.shape
    reading, by_setting, by_creep = (np.empty((holds, width, n)) for _ in range(3))
    carry_by_setting, carry_by_creep = np.empty((holds, n)), np.empty((holds, n))
    return Linearised(reading, by_setting, by_creep, carry_by_setting, carry_by_creep, np.zeros((holds + 1, n)))


def _by_closed_form(protocol: Protocol, theta: Theta, model: Model) -> Linearised:
    walk = Walk(protocol, theta, model)
    out = _nothing(protocol, np.shape(theta["k1"])[0])
    for j, setting in enumerate(protocol.setting):
        reading, carried = walk.closed_form(j, walk.base + setting, out.creep[j])
        out.reading[j], out.by_setting[j], out.by_creep[j] = reading
        out.creep[j + 1], out.carry_by_setting[j], out.carry_by_creep[j] = carried
    return out


def _by_complex_steps(protocol: Protocol, theta: Theta, model: Model) -> Linearised:
    """Both complex steps in one pass: the first n columns take that of the setting error, the others the creep's."""
    n = np.shape(theta["k1"])[0]
    twice = {name: np.tile(value, 2) for name, value in theta.items()}
    walk = Walk(protocol, twice, model)
    out = _nothing(protocol, n)
    setting_step, creep_step = 1j * np.repeat([[_STEP, 0.0], [0.0, _STEP]], n, axis=1)
    carried, beside = walk.begin(2 * n)
    out.creep[0] = carried[:n]
    for j, setting in enumerate(protocol.setting):
        creep = np.tile(out.creep[j], 2) + creep_step
        reading, carried, beside = walk.hold(j, setting + setting_step, creep, beside)
        out.reading[j], out.by_setting[j], out.by_creep[j] = _parted(reading)
        out.creep[j + 1], out.carry_by_setting[j], out.carry_by_creep[j] = _parted(carried)
        walk.past = [(start_s, goal.real, k2.real) for start_s, goal, k2 in walk.past]
        beside = {key: value.real for key, value in beside.items()}
    return out


def _parted(both: Array) -> Sloped:
    """Values (..., n) of both complex steps (..., 2 n), and what the steps make of them."""
    _, value = np.split(both.real, 2, axis=-1)
    by_setting, by_creep = np.split(both.imag / _STEP, 2, axis=-1)
    return Sloped(value, by_setting, by_creep)


def streamed(protocol: Protocol, theta: Theta, model: Model = PLAIN) -> "Linearised | Staircases":
    """A staircase for one filter alone: compiled, it is filtered as it is computed, and never written to memory.

    Parameters
    ----------
    protocol, theta, model
        As for `linearise`.

    Returns
    -------
    Linearised or Staircases
        The latter where the model is compiled.
    """
    call = compiled.call(protocol, theta, model)
    return linearise(protocol, theta, model) if call is None else compiled.kernel.Computed(*call)


class Walk:
    """One pass along the holds: what all holds share is computed once here."""

    def __init__(self, protocol: Protocol, theta: Theta, model: Model) -> None:
        self.protocol = protocol
        self.model = model
        self.past: list[Clock] = []
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
        times = hold.time_s
        warming = hold.warming_K
        hold.time_s = wait_s
        hold.warming_K = warming[:1]
        amount = self.creep.amount(hold.initial_tension, hold)
        hold.grown = hold.carried + amount * laws.creep_fraction(wait_s, self.k2, self.N)
        self.past.append((hold.start_s, hold.carried + amount, self.k2))
        beside = self.creep.beside(beside, hold)
        self.past[:] = [(start_s - wait_s, goal, k2) for start_s, goal, k2 in self.past]
        hold.time_s = times
        hold.warming_K = warming
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
        times, warming = hold.time_s, hold.warming_K
        hold.time_s, hold.warming_K = times[:1], warming[:1]
        first = self.bench.tension(held, elongation, hold)
        hold.time_s, hold.warming_K = times, warming
        return first

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
        )
