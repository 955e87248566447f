"""One wire under steps or under weights with one hidden effect, at any scale: readings without noise.

Written from the formulas of the documentation alone, for one truth at a time; nothing of the package is used. Under
weights the same law is solved for the length, and effects act as the table of `docs/theory.rst` says. Effects that are
in no catalogue have a formula here only.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from scipy.optimize import brentq

from .rig import Array

STRAIN_BENT = ("strain_stiffening", "toe", "power_strain", "yield")


@dataclass(frozen=True)
class ScaledTest:
    """What was done to a wire.

    Attributes
    ----------
    weights : bool
        Whether weights (N) were set and displacements (mm) read; else displacements were set and tensions read.
    length_mm : float
    settings : (H,) array
    times_s : one (r,) array a hold
    durations_s : (H,) array
    warming_K : one (r,) array a hold, or None where no temperature was logged
    tension_ref_N : float
        To which powers of the tension refer.
    """

    weights: bool
    length_mm: float
    settings: Array
    times_s: tuple[Array, ...]
    durations_s: Array
    warming_K: tuple[Array, ...] | None
    tension_ref_N: float

    @property
    def directions(self) -> list[float]:
        """Sign of the last move, one a hold."""
        moves = [float(np.sign(b - a)) for a, b in pairwise([0.0, *self.settings])]
        for j, move in enumerate(moves):
            moves[j] = move or (moves[j - 1] if j else 1.0)
        return moves

    @property
    def starts_s(self) -> Array:
        """(H,) when each hold begins."""
        return np.concatenate([[0.0], np.cumsum(self.durations_s)[:-1]])


@dataclass(frozen=True)
class Hidden:
    """An effect at work.

    Attributes
    ----------
    name : str
    amplitude : float
        With its sign.
    shapes : dict
        Constants of its form; ``hold`` counts from 0.
    """

    name: str = ""
    amplitude: float = 0.0
    shapes: dict[str, float] = field(default_factory=dict)

    def of(self, name: str) -> float:
        """Its amplitude where it is the effect of that name, else nothing."""
        return self.amplitude if self.name == name else 0.0


@dataclass
class _Crept:
    """Creep carried along the holds, mm, and the clocks that superposition keeps."""

    main: float = 0.0
    second: float = 0.0
    flow: float = 0.0
    apart: float = 0.0
    goal: float = 0.0
    now_s: float = 0.0
    clocks: list[tuple[float, float]] = field(default_factory=list)  # when it began, what was added to the goal

    @property
    def total(self) -> float:
        return self.main + self.second + self.flow + self.apart


def readings(test: ScaledTest, truth: dict[str, float], hidden: Hidden, errors: Array) -> Array:
    """All readings of a test, hold after hold.

    Parameters
    ----------
    test : ScaledTest
    truth : dict
        ``k1 B U k2 N preload``.
    hidden : Hidden
    errors : (H,) array
        Of what was set.
    """
    return _Test(test, truth, hidden).readings(errors)


class _Test:
    def __init__(self, test: ScaledTest, truth: dict[str, float], hidden: Hidden) -> None:
        self.test, self.hidden = test, hidden
        self.k1, self.B, self.U, self.k2, self.N = (truth[name] for name in ("k1", "B", "U", "k2", "N"))
        self.base = test.length_mm + truth["preload"]

    def readings(self, errors: Array) -> Array:
        test, hidden = self.test, self.hidden
        crept = _Crept()
        if hidden.name == "prior_creep" and not test.weights:
            self._pass(crept, 0, self.base, np.array([hidden.amplitude]), hidden.amplitude)
        positions = self._positions(errors)
        shown: list[Array] = []
        for j, setting in enumerate(test.settings + errors):
            held = self._weight(j, setting) if test.weights else positions[j]
            if hidden.name == "unrecorded_hold" and j == int(hidden.shapes["hold"]):
                self._pass(crept, j, held, np.array([hidden.amplitude]), hidden.amplitude)
            times = test.times_s[j] + hidden.of("late_clock")
            if hidden.name == "reading_delay":
                times = times + hidden.amplitude * (np.arange(len(times)) == 0)
            end = float(test.durations_s[j] + hidden.of("late_clock"))
            natural = self._natural(j, self._pass(crept, j, held, times, end), self._warming(j))
            if test.weights:
                shown.append(self._stretched(j, held, natural) - self.base)
            else:
                tension = self._tension(j, held, natural)
                shown.append(tension * (1.0 + hidden.of("guide_friction") * test.directions[j]))
        if test.weights:
            shown = self._gauge_with_play(shown)
        return np.concatenate([self._instrument(j, y) for j, y in enumerate(shown)])

    def _warming(self, j: int, rows: slice = slice(None)) -> Array | None:
        """Of a hold, at all of its readings or some."""
        return None if self.test.warming_K is None else self.test.warming_K[j][rows]

    def _weight(self, j: int, weight: float) -> float:
        """What pulls the wire: a guide bears a part of the weight."""
        return float(weight / (1.0 + self.hidden.of("guide_friction") * self.test.directions[j]))

    def _positions(self, errors: Array) -> Array:
        """(H,) stretched lengths that the screw sets."""
        at, hidden = self.test.settings, self.hidden
        x = at + errors
        if hidden.name == "screw_error":
            turns = 2.0 * np.pi * at / hidden.shapes["period"] + hidden.shapes["phase"]
            x = x + hidden.amplitude * np.cos(turns)
        if hidden.name == "worn_thread":
            x = x + hidden.amplitude * _bump(at, hidden.shapes)
        if hidden.name == "lost_motion":
            carriage = x[0]
            for j in range(1, len(x)):
                carriage = x[j] = np.clip(carriage, x[j], x[j] + hidden.amplitude)
        return np.asarray(self.base + x)

    def _gauge_with_play(self, shown: list[Array]) -> list[Array]:
        """What a gauge with play shows: on the way up it follows, on the way down it stays behind."""
        play = self.hidden.of("lost_motion")
        if not play:
            return shown
        after, at = [], shown[0][0]
        for y in shown:
            moved = []
            for value in y:
                at = min(max(at, value), value + play)
                moved.append(at)
            after.append(np.array(moved))
        return after

    def _natural(self, j: int, creep: Array, warming_K: Array | None) -> Array:
        """Zero-tension length, mm."""
        hidden = self.hidden
        slipped = hidden.of("grip_slip") if j >= int(hidden.shapes.get("hold", 0.0)) else 0.0
        natural = self.test.length_mm + creep + slipped
        if hidden.name == "thermal_expansion" and warming_K is not None:
            natural = natural * (1.0 + hidden.amplitude * warming_K)
        return natural

    def _pulls(self, strain: Array, natural: Array) -> Array:
        """The part of a strain that pulls, times what stiffens: tension over k1."""
        s, hidden = np.maximum(strain, 0.0), self.hidden
        if hidden.name == "toe" and hidden.amplitude > 0:
            s = s - hidden.amplitude / natural * -np.expm1(-s * natural / hidden.amplitude)
        if hidden.name == "power_strain":
            typical = self.test.tension_ref_N / self.k1
            s = typical * (s / typical) ** (1.0 + hidden.amplitude)
        if hidden.name == "yield":
            s = s - hidden.amplitude * np.maximum(s - hidden.shapes["strain"], 0.0)
        return s * (1.0 + hidden.of("strain_stiffening") * s)

    def _stiffness(self, j: int) -> float:
        """k1, which falls from hold to hold where the wire softens."""
        return self.k1 * (1.0 - self.hidden.of("hold_softening") * j)

    def _tension(self, j: int, stretched: float, natural: Array) -> Array:
        """Tension of a stretched length; of S less c times the tension where the bench gives way, solved for it."""
        k1 = self._stiffness(j)
        pulled = k1 * self._pulls(stretched / natural - 1.0, natural)
        return np.maximum(pulled / (1.0 + self.hidden.of("fixture_compliance") * k1 / natural), 0.0)

    def _stretched(self, j: int, tension: float, natural: Array) -> Array:
        """Stretched length that carries a tension, and how far the bench gives way."""
        wanted = tension / self._stiffness(j)
        if self.hidden.name not in STRAIN_BENT:
            return natural * (1.0 + wanted) + self.hidden.of("fixture_compliance") * tension
        return np.array([length * (1.0 + self._strain_for(wanted, length)) for length in natural])

    def _strain_for(self, wanted: float, length: float) -> float:
        def missing(strain: float) -> float:
            return float(self._pulls(np.array(strain), np.array(length))) - wanted

        high = wanted
        for _ in range(60):
            if missing(high) > 0:
                return float(brentq(missing, 0.0, high, xtol=1e-14 * wanted + 1e-300, rtol=1e-14))
            high *= 1.3
        return float("nan")

    def _pass(self, crept: _Crept, j: int, held: float, times: Array, end: float) -> Array:
        """Let a hold pass; elongation by creep at its times."""
        hidden = self.hidden
        natural = self._natural(j, np.array([crept.total]), self._warming(j, slice(1)))
        tension = held if self.test.weights else float(self._tension(j, held, natural)[0])
        driving = max(tension - hidden.of("creep_threshold"), 0.0)
        goal = self.B * driving**self.U
        amount = (goal - (1.0 - hidden.of("permanent_creep")) * crept.main) * (1.0 + j) ** -hidden.of("ageing")
        rate = self.k2 * (max(tension / self.test.tension_ref_N, 0.01)) ** hidden.of("tension_dependent_rate")
        course = self._course(crept, tension, amount, goal, rate)
        crept.clocks.append((crept.now_s, goal - crept.goal))
        courses = course(np.append(times, end))
        crept.main, crept.second, crept.flow, crept.apart = (float(part[-1]) for part in courses)
        crept.goal, crept.now_s = goal, crept.now_s + end
        return np.sum(courses, axis=0)[:-1]

    def _course(
        self, crept: _Crept, tension: float, amount: float, goal: float, rate: float
    ) -> Callable[[Array], tuple[Array, Array, Array, Array]]:
        """The parts of the creep as functions of the time in a hold."""
        hidden, before = self.hidden, (crept.main, crept.second, crept.flow)
        ratio = float(np.clip(tension / self.test.tension_ref_N, 0.01, 100.0))
        exponent = self.N * float(np.clip(1.0 + hidden.of("exponent_by_tension") * np.log(ratio), 0.3, 2.0))
        clocks, begun = [*crept.clocks, (crept.now_s, goal - crept.goal)], crept.now_s

        def at(t: Array) -> tuple[Array, Array, Array, Array]:
            main, second, flow = (part + 0.0 * t for part in before)
            reached = -np.expm1(-rate * t**exponent)
            if hidden.name == "log_creep":
                onset_s, long_s = hidden.shapes["onset_s"], hidden.shapes["long_s"]
                reached = reached + hidden.amplitude * (np.log1p(t / onset_s) / np.log1p(long_s / onset_s) - reached)
            main = main + amount * reached
            flowed = hidden.of("steady_creep") * tension * t
            if hidden.shapes.get("carried"):
                main = main + flowed
            else:
                flow = flow + flowed
            if hidden.name == "second_relaxation":
                second = second + (hidden.amplitude * tension - second) * -np.expm1(-t / hidden.shapes["time_s"])
            apart = 0.0 * t
            if hidden.name == "superposition":
                ages = [(begun + t - start, more) for start, more in clocks]
                superposed = np.sum([more * -np.expm1(-self.k2 * age**self.N) for age, more in ages], axis=0)
                apart = hidden.amplitude * (superposed - main)
            return main, second, flow, apart

        return at

    def _instrument(self, j: int, y: Array) -> Array:
        """What is read of a hold."""
        hidden, times = self.hidden, self.test.times_s[j]
        if hidden.name == "clamp_transient":
            y = y * (1.0 + hidden.amplitude * np.exp(-times / hidden.shapes["time_s"]))
        y = y * (1.0 + hidden.of("sensor_nonlinearity") * y)
        clock_s = self.test.starts_s[j] + times
        if hidden.name in ("gain_step", "zero_step") and j >= int(hidden.shapes["hold"]):
            y = y * (1.0 + hidden.of("gain_step")) + hidden.of("zero_step")
        if hidden.name == "wave":
            y = y + hidden.amplitude * np.sin(
                2.0 * np.pi * clock_s / hidden.shapes["period_s"] + hidden.shapes["phase"]
            )
        if hidden.name == "passing_draught":
            y = y + hidden.amplitude * _bump(clock_s, hidden.shapes)
        return np.asarray(y + hidden.of("sensor_drift") * clock_s)


def _bump(at: Array, shapes: dict[str, float]) -> Array:
    """One at its centre, nothing far from it."""
    return np.asarray(np.exp(-0.5 * ((at - shapes["centre"]) / shapes["width"]) ** 2))
