"""Creep of a robot's wires through one hold: the bench's law, each wire under its own tension.

Elongations are kept in millimetres of the tested sample, so that bench and robot share every formula; a wire's
zero-tension length is its length before creep times one plus that elongation over the sample's length.
"""

from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics.wires import Wires, hold_context
from wirebayes.wire.creep import Creep

Follow = Literal["current", "start"]


@dataclass(frozen=True)
class CreepState:
    """What wires carry from hold to hold.

    Attributes
    ----------
    creep_mm : (w, n) array
        Elongation of the tested length by creep, eq (5).
    beside_mm : mapping of effect key to (w, n) array
        Elongations that effects carry beside it.
    holds : int
        Holds so far.
    clock_s : float
        Time since the first hold began.
    past : tuple of (start_s, goal, k2)
        The clocks of earlier holds, for effects that remember them.
    elongation_mm : (w, n) array or float
        All that the zero-tension length of the tested sample has grown by.
    """

    creep_mm: Floats
    beside_mm: Mapping[str, Floats]
    holds: int = 0
    clock_s: float = 0.0
    past: tuple[tuple[float, Floats, Floats], ...] = ()
    elongation_mm: Floats | float = 0.0

    def strain(self, wires: Wires) -> Floats:
        """Creep as a strain of the whole wire, (w, n)."""
        return (self.elongation_mm + np.zeros_like(self.creep_mm)) / wires.length_mm


def fresh(legs: int, draws: int) -> CreepState:
    """Wires that were never loaded."""
    return CreepState(np.zeros((legs, draws)), {})


class HoldCreep:
    """Creep within one hold: its clock starts with the commanded length, its amount follows the tension.

    Parameters
    ----------
    wires : Wires
    carried : CreepState
    tension_N : (w, n) array
        When the hold begins.
    follow : {"current", "start"}
        "current": the amount still to come follows the tension as it changes. "start": it is fixed by the tension at
        the beginning, as in the bench's law; the two agree while the tension does not change.
    """

    def __init__(self, wires: Wires, carried: CreepState, tension_N: Floats, follow: Follow = "current") -> None:
        self.wires, self.carried, self.follow = wires, carried, follow
        self.hold = hold_context(wires, carried.holds, carried.clock_s, tension_N, carried.creep_mm)
        self.law = Creep(wires.placed, wires.theta, wires.history)
        self.k2 = self.law.rate(self.hold)
        self.amount = self.law.amount(tension_N, self.hold)
        self.grown = np.zeros_like(carried.creep_mm)
        self.time_s = 0.0
        self.reached, self.counted = np.zeros((1, 1)), np.zeros((1, 1))  # share of the creep, and its own clock
        self.before: tuple[Floats, Floats] | None = None  # tension and progress of the step before

    def onward(self, time_s: float, slope: Floats | None) -> "HoldCreep":
        """The hold at a later time while the amount goes on with a slope by creep's own clock; None: it stays."""
        change = np.zeros(1) if slope is None else slope
        return self.toward(time_s, self.amount + change * self.progress(time_s))

    def toward(self, time_s: float, amount: Floats) -> "HoldCreep":
        """The hold at a later time while the amount changes in a straight line, by creep's own clock (`progress`).

        Parameters
        ----------
        time_s : float
        amount : (w, n) array
            At that time.
        """
        done = self.progress(time_s)
        out = copy(self)
        out.reached, out.counted = self.law.fraction(self.k2, self.hold), self.law.clock(self.hold)
        out.time_s = time_s
        if self.follow == "start":
            out.grown = self.amount * out.reached
            return out
        out.grown = self._grown(amount, done)
        out.amount = amount
        return out

    def _grown(self, amount: Floats, done: Floats) -> Floats:
        """What has grown when the amount has come to a value in a straight line and the clock has gone so far."""
        if self._open_ended:
            return self.grown + 0.5 * (self.amount + amount) * done
        share = -np.expm1(-done)
        lag = np.where(done > 1e-5, 1.0 - share / np.maximum(done, 1e-300), 0.5 * done)
        return self.grown + (self.amount - self.grown) * share + (amount - self.amount) * lag

    @property
    def _open_ended(self) -> bool:
        """Whether a time law without a plateau applies: what each step adds is that step's share of the amount."""
        return "fraction" in self.law.effects.at

    def progress(self, time_s: float) -> Floats:
        """What creep's own clock counts from now to a later time: growth of ``k2 t^N``, or of the share reached."""
        self._look(time_s)
        if self._open_ended:
            return self.law.fraction(self.k2, self.hold) - self.reached
        return self._passed(self.law.clock(self.hold))

    def _passed(self, clock: Floats) -> Floats:
        """How much ``k2 t^N`` has grown since the last step."""
        N = self.law.N
        return self.k2 * (np.power(clock, N) - np.power(self.counted, N))

    def amount_at(self, tension_N: Floats) -> Floats:
        """Creep that the hold still has to come, if the tension stayed, (w, n) mm of the tested length."""
        self._look(self.time_s)
        return self.law.amount(tension_N, self.hold) if self.follow == "current" else self.amount

    def _look(self, time_s: float) -> None:
        self.hold.time_s, self.hold.duration_s = np.full((1, 1), time_s), time_s

    def advance(self, time_s: float, tension_N: Floats) -> CreepState:
        """Creep to a later time of the hold; `tension_N` ended the last step and is followed onward."""
        self.time_s = time_s
        self._look(time_s)
        reached = self.law.fraction(self.k2, self.hold)
        clock = self.law.clock(self.hold)
        if self.follow == "start":
            self.grown = self.amount * reached
        else:
            self._grow(reached - self.reached, clock, tension_N)
        self.reached, self.counted = reached, clock
        return self.state()

    def _grow(self, progress: Floats, clock: Floats, tension_N: Floats) -> None:
        """Creep of a step to creep's own `clock`, in which its share grows by `progress`."""
        self.amount = self.law.amount(self._onward(progress, tension_N), self.hold)
        if self._open_ended:
            self.grown = self.grown + self.amount * progress
            return
        # The share of what is left: composes to eq (5) exactly when the tension stays.
        share = -np.expm1(-self._passed(clock))
        self.grown = self.grown + (self.amount - self.grown) * share

    def state(self) -> CreepState:
        """What the wires carry now."""
        hold, law, carried = self.hold, self.law, self.carried
        self._look(self.time_s)
        amount = carried.creep_mm + self.amount
        grown = carried.creep_mm + self.grown
        past = (*carried.past, (carried.clock_s, amount, self.k2))
        hold.past = list(past)
        creep = law.creep(grown, hold)
        hold.grown = creep
        beside = law.beside(carried.beside_mm, hold)
        elongation = law.elongation(creep, beside, hold)
        return CreepState(creep, beside, carried.holds + 1, carried.clock_s + self.time_s, past, elongation)

    def _onward(self, progress: Floats, tension_N: Floats) -> Floats:
        """Tension half-way through the step: it goes on as over the step before, per share of creep done.

        Second order in the step, without solving the robot twice.
        """
        ahead = tension_N
        if self.before is not None:
            last, done = self.before
            lead = 0.5 * progress / np.maximum(done, 1e-300)
            change = np.minimum(lead, 2.0) * (tension_N - last)
            ahead = np.maximum(tension_N + change, 0.0)
        self.before = tension_N, progress
        return ahead


def without_creep(wires: Wires) -> Wires:
    """The same wires under Hooke's law alone."""
    theta = dict(wires.theta) | {"B": np.zeros_like(wires.theta["B"])}
    kept = tuple(e for e in wires.effects if e.place == "strain")
    return replace(wires, theta=theta, effects=kept)
