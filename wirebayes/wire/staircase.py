"""Readings of one wire through a sequence of holds, batched over parameter sets.

Arrays end in the batch axis: readings are ``(H, R, n)``, one row of memory per reading, because long inner loops are
what numpy is fast at.
"""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from wirebayes.numeric.typing import Array
from wirebayes.wire import compiled
from wirebayes.wire.edges import EdgeOfHold, Edges, FirstReadings, edge_of_hold, edges_of, joined_edges
from wirebayes.wire.model import PLAIN, Model
from wirebayes.wire.protocol import Protocol
from wirebayes.wire.walk import ByHand, BySteps, LinearHoldWalked, Theta, Walk

if TYPE_CHECKING:
    from wirebayes.wire._kernel import Staircases


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
    edges : Edges or None
        Of holds whose setting error decides whether the wire is taut; None where there are none.
    """

    reading: Array
    by_setting: Array
    by_creep: Array
    carry_by_setting: Array
    carry_by_creep: Array
    creep: Array
    edges: Edges | None = None


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


def linearise(protocol: Protocol, theta: Theta, model: Model = PLAIN, read: FirstReadings | None = None) -> Linearised:
    """Readings with their derivatives by setting error and carried creep.

    Of a step test without effects the derivatives are in closed form; others come from a complex step through the same
    code that computes the readings. What effects carry beside the creep is held at its nominal value in them.

    Parameters
    ----------
    theta : mapping of name to (n,) array
        ``k1 B U k2 N preload`` and ``effect_name.parameter`` of every effect of the model; with ``setting_sd`` holds
        are looked at on both sides where such an error may leave the wire slack.
    read : FirstReadings, optional
        What such holds are then expanded about.
    """
    call = compiled.call(protocol, theta, model)
    if call is not None:
        parts, edges = compiled.kernel.linearise(*call, *compiled.at_slack(protocol, theta, read))
        line = Linearised(*parts)
        return line if edges is None else replace(line, edges=edges_of(*edges))
    by_hand = not model.effects and protocol.control == "displacement"
    kind = ByHand if by_hand else BySteps
    return _walked(kind(protocol, theta, model), read)


def _walked(walk: ByHand | BySteps, read: FirstReadings | None) -> Linearised:
    """One hold after another."""
    creep = walk.brought
    spread = walk.theta.get("setting_sd") if walk.protocol.control == "displacement" else None
    holds: list[LinearHoldWalked] = []
    edges: list[EdgeOfHold] = []
    for j, setting in enumerate(walk.protocol.setting):
        hold = walk.linearised(j, setting, creep)
        if spread is not None:
            edges.append(edge_of_hold(walk, j, creep, hold, np.abs(spread[: len(creep)]), read))
        creep = hold.carried.value
        holds.append(hold)
    reading, by_setting, by_creep = map(np.array, zip(*(hold.readings for hold in holds), strict=True))
    after, carry_by_setting, carry_by_creep = map(np.array, zip(*(hold.carried for hold in holds), strict=True))
    creeps = np.concatenate([walk.brought[None], after])
    return Linearised(reading, by_setting, by_creep, carry_by_setting, carry_by_creep, creeps, joined_edges(edges))


def streamed(
    protocol: Protocol, theta: Theta, model: Model = PLAIN, read: FirstReadings | None = None
) -> "Linearised | Staircases":
    """A staircase for one filter alone: compiled, it is filtered as it is computed, and never written to memory.

    Parameters
    ----------
    protocol, theta, model, read
        As for `linearise`.

    Returns
    -------
    Linearised or Staircases
        The latter where the model is compiled.
    """
    call = compiled.call(protocol, theta, model)
    if call is None:
        return linearise(protocol, theta, model, read)
    return compiled.kernel.Computed(*call, *compiled.at_slack(protocol, theta, read))
