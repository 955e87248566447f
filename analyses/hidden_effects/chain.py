"""One hold of creep: the state carried along the chain and how it grows."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .creep import radau, remaining
from .rig import Array, Index
from .state import Effects


@dataclass
class Carried:
    """Creep carried from hold to hold, each (n,), mm: `main`, the second mode, viscous flow; clocks still running.

    `apart` is by how much superposed creep differs from `main`, `goal` what the last hold was heading for.
    """

    main: Array
    second: Array
    viscous: Array
    apart: Array
    goal: Array
    clocks: list[tuple[Array, Array]] = field(default_factory=list)  # (what is left to add, age of the clock)

    @property
    def total(self) -> Array:
        """Elongation by creep (mm), shape (n,)."""
        return self.main + self.second + self.viscous + self.apart

    def rows(self, index: Index) -> Carried:
        """The chosen rows."""
        clocks = [(left[index], age[index]) for left, age in self.clocks]
        main, second, viscous = self.main[index], self.second[index], self.viscous[index]
        return Carried(main, second, viscous, self.apart[index], self.goal[index], clocks)


@dataclass(frozen=True)
class Material:
    """Material parameters of a batch on one bench, each (n,), and the reference tension (N)."""

    k1: Array
    B: Array
    U: Array
    k2: Array
    N: Array
    tau_ref: float

    def rows(self, index: Index) -> Material:
        """The chosen rows."""
        return Material(self.k1[index], self.B[index], self.U[index], self.k2[index], self.N[index], self.tau_ref)


def grow(m: Material, before: Carried, fx: Effects, order: int, tau0: Array, grid: Array) -> tuple[Array, Carried]:
    """Creep through one hold.

    Parameters
    ----------
    tau0 : tension at the start of the hold (N), shape (n,).
    order : how many holds came before.
    grid : nodes (s), shape (G,) or (n, G), from 0 to the end of the hold.

    Returns
    -------
    total creep elongation (mm) at the nodes, shape (n, G), and the state after the last node.
    """
    drive = np.maximum(tau0 - fx["creep_threshold"], 0.0) if fx.on("creep_threshold") else tau0
    gap = m.B * drive**m.U - before.main
    if fx.on("permanent_creep"):
        gap = gap + fx["permanent_creep"] * before.main
    if fx.on("ageing"):
        gap = gap * (1.0 + order) ** -fx["ageing"]
    rate, exponent = m.k2, m.N
    ratio = np.clip(tau0 / m.tau_ref, 1e-2, 1e2)
    if fx.on("tension_dependent_rate"):
        rate = rate * ratio ** fx["tension_dependent_rate"]
    if fx.on("exponent_by_tension"):
        exponent = exponent * np.clip(1 + fx["exponent_by_tension"] * np.log(ratio), 0.3, 2.0)
    left = remaining(grid, rate, exponent)
    time = np.atleast_2d(grid)
    done = 1 - left
    if fx.on("log_creep"):
        onset = fx.shape("log_creep.onset_s")[:, None]
        done = done + fx["log_creep"][:, None] * (np.log1p(time / onset) / np.log1p(300.0 / onset) - done)
    main = before.main[:, None] + gap[:, None] * done
    viscous = before.viscous[:, None]
    if fx.on("steady_creep"):
        flow = (fx["steady_creep"] * tau0)[:, None] * time
        own = fx.shape("steady_creep.variant")[:, None] == 0  # else the saturating law later counts the flow as creep
        viscous = viscous + np.where(own, flow, 0.0)
        main = main + np.where(own, 0.0, flow)
    second = before.second[:, None]
    if fx.on("second_relaxation"):
        aim = (fx["second_relaxation"] * tau0)[:, None]
        steps = radau(np.diff(time, axis=1) / fx.shape("second_relaxation.time_s")[:, None])
        fade = np.concatenate([np.ones((len(steps), 1)), np.cumprod(steps, axis=1)], axis=1)
        second = aim + (second - aim) * fade
    goal, clocks, apart = before.main + gap, [], np.zeros((len(gap), 1))
    if fx.on("superposition"):  # every change of the goal is approached by a clock of its own
        change = goal - before.goal
        missing = change[:, None] * left
        for owed, age in before.clocks:
            still = owed[:, None] * remaining(grid, m.k2, m.N, age)
            missing = missing + still
            clocks.append((still[:, -1], age + time[:, -1]))
        clocks.append((change * left[:, -1], np.broadcast_to(time[:, -1], change.shape)))
        apart = fx["superposition"][:, None] * (goal[:, None] - missing - main)
    total = main + second + viscous + apart
    ends = [np.broadcast_to(part, total.shape)[:, -1].copy() for part in (main, second, viscous, apart)]
    return total, Carried(ends[0], ends[1], ends[2], ends[3], goal, clocks)
