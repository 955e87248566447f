"""The wires of a robot: elastic law with its effects, and what creep needs, one value per leg and draw.

Arrays are batch-last: ``(w, n)`` or anything that broadcasts to it. Lengths in metres, tensions in newtons.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from wirebayes.numeric.typing import Floats, Indices
from wirebayes.wire import laws
from wirebayes.wire.away_from_bench import steady_hold
from wirebayes.wire.bent_strain import bent, strain_of
from wirebayes.wire.effect import Effect, HoldContext, Placed
from wirebayes.wire.fresh import FreshSample
from wirebayes.wire.inverse import inverse
from wirebayes.wire.model import Model

# nodes and weights exact for polynomials of degree 15; between slack and stretched the laws are smooth
_GAUSS = np.polynomial.legendre.leggauss(8)


@dataclass(frozen=True)
class Wires:
    """Elastic law, history and parameters of all legs.

    Attributes
    ----------
    law : {"hooke", "modified"}
    history : {"saturating", "additive"}
    theta : mapping of name to (w, n) or (1, n) array
        ``k1`` (N), ``B`` (mm N^-U at `length_mm`), ``U``, ``k2`` (s^-N), ``N`` and ``effect_name.parameter``.
    length_mm : (w, 1) array
        The zero-tension length that B was fitted at; creep is a strain of the whole wire.
    effects : tuple of Effect
        Material effects only.
    tension_ref_N : float
    """

    law: laws.ElasticLaw
    history: laws.History
    theta: Mapping[str, Floats]
    length_mm: Floats
    effects: tuple[Effect, ...] = ()
    tension_ref_N: float = 1.0

    @property
    def count(self) -> int:
        """How many draws there are."""
        return max(v.shape[-1] for v in self.theta.values())

    @property
    def elastic(self) -> laws.Hooke:
        """The elastic law of the wires without effects."""
        return laws.LAWS[self.law]

    @cached_property
    def placed(self) -> Placed:
        """The effects by place, with their amplitudes."""
        return Placed(self.effects, self.theta)

    def at(self, place: str) -> list[Effect]:
        """The effects at one place, in the order they compose."""
        return self.placed.at.get(place, [])

    def sample(self, leg: int) -> FreshSample:
        """A fresh sample of one leg's wire, with whatever depends on its length in the robot."""
        theta = {k: v[min(leg, len(v) - 1)] for k, v in self.theta.items()}
        references = np.ravel(self.tension_ref_N)  # a value a leg where lines differ
        model = Model(self.law, self.history, self.effects, float(references[min(leg, len(references) - 1)]))
        return FreshSample(theta, model, float(self.length_mm[min(leg, len(self.length_mm) - 1), 0]))

    def part(self, index: slice | Indices) -> "Wires":
        """The same wires for some of the draws."""
        theta = {k: v if v.shape[-1] == 1 else v[:, index] for k, v in self.theta.items()}
        return replace(self, theta=theta)


def hold_context(
    wires: Wires, hold: int = 0, clock_s: float = 0.0, tension_N: Floats | None = None, carried_mm: Floats | None = None
) -> HoldContext:
    """What an effect may look at: a robot's hold begins with a command and has no displacement.

    Parameters
    ----------
    wires : Wires
    hold : int
        Number of commands before this one.
    clock_s : float
        Time since the first command.
    tension_N : (w, n) array, optional
        When the hold begins; zero when left out.
    carried_mm : (w, n) array, optional
        Creep carried into the hold, at the tested length; zero when left out.

    Returns
    -------
    HoldContext
    """
    alike = np.ptp(wires.length_mm) == 0
    length = float(wires.length_mm.flat[0]) if alike else wires.length_mm
    return steady_hold(
        wires.theta,
        length,
        wires.tension_ref_N,
        law=wires.law,
        index=hold,
        start_s=clock_s,
        tension_N=tension_N,
        carried_mm=carried_mm,
    )


def bent_strain(wires: Wires, strain: Floats, zero_m: Floats) -> tuple[Floats, Floats]:
    """Effective strain whose product with k1 is the tension, and its slope by the strain.

    Parameters
    ----------
    wires : Wires
    strain, zero_m : (w, n) arrays
        A toe is a length: the effective strain depends on the zero-tension length, too.
    """
    return bent(wires.placed, strain, _hold_at(wires, zero_m))


def _hold_at(wires: Wires, zero_m: Floats) -> HoldContext:
    """A hold in which the wires have these zero-tension lengths."""
    hold = hold_context(wires)
    hold.zero_mm = 1e3 * zero_m
    return hold


def tension(wires: Wires, stretched_m: Floats, zero_m: Floats) -> tuple[Floats, Floats]:
    """Tension and its slope by the stretched length, eqs (1), (3) or (6); both zero when slack.

    Parameters
    ----------
    wires : Wires
    stretched_m, zero_m : (w, n) arrays

    Returns
    -------
    tension_N, slope_N_m : (w, n) arrays
    """
    strain, slope = wires.elastic.strain(stretched_m, zero_m), wires.elastic.by_stretched(stretched_m, zero_m)
    k1 = wires.theta["k1"]
    if wires.at("strain"):
        strain, bend = bent_strain(wires, strain, zero_m)
        slope = slope * bend
    taut = strain > 0
    return k1 * np.where(taut, strain, 0.0), k1 * np.where(taut, slope, 0.0)


def energy(wires: Wires, stretched_m: Floats, zero_m: Floats) -> Floats:
    """Elastic energy, J: the integral of the tension from the zero-tension length; zero when slack.

    Parameters
    ----------
    wires : Wires
    stretched_m, zero_m : (w, n) arrays

    Returns
    -------
    (w, n) array
    """
    longer = np.maximum(stretched_m, zero_m)
    if wires.at("strain"):
        stretch = longer - zero_m
        total = np.zeros(np.broadcast_shapes(stretch.shape, zero_m.shape))
        for node, weight in zip(*_GAUSS, strict=True):
            total += 0.5 * weight * tension(wires, zero_m + stretch * (0.5 * (node + 1.0)), zero_m)[0]
        return total * stretch
    return wires.theta["k1"] * wires.elastic.energy(longer, zero_m)


def zero_tension_length(wires: Wires, stretched_m: Floats, tension_N: Floats) -> Floats:
    """Zero-tension length that gives a tension at a stretched length, m; NaN where the law cannot reach the tension.

    Parameters
    ----------
    wires : Wires
    stretched_m, tension_N : (w, n) arrays

    Returns
    -------
    (w, n) array
    """
    goal = tension_N / wires.theta["k1"]
    effective = goal + np.zeros(np.broadcast_shapes(goal.shape, stretched_m.shape))
    strain = effective
    if wires.at("strain"):
        hold = hold_context(wires)

        def bends(strain: Floats) -> Floats:
            hold.zero_mm = 1e3 * wires.elastic.zero_length(stretched_m, strain)
            return wires.placed.change("strain", strain, hold)

        strain = inverse(bends, effective)
    with np.errstate(invalid="ignore"):
        length = wires.elastic.zero_length(stretched_m, strain)
        return np.where(length > 0, length, np.nan)


def stretched_length(wires: Wires, zero_m: Floats, tension_N: Floats) -> Floats:
    """Stretched length at which a wire of a zero-tension length carries a tension, m.

    Parameters
    ----------
    wires : Wires
    zero_m, tension_N : (w, n) arrays

    Returns
    -------
    (w, n) array
        NaN where the law cannot reach the tension.
    """
    effective = tension_N / wires.theta["k1"] + 0.0 * zero_m
    if wires.at("strain"):
        effective = strain_of(wires.placed, effective, _hold_at(wires, zero_m))
    return wires.elastic.stretched(effective, zero_m)
