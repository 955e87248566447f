"""Effects on the creep within and between holds."""

from collections.abc import Sequence

import numpy as np

from wirebayes.numeric.distributions import HalfNormal, LogNormal, Normal, Uniform
from wirebayes.numeric.typing import Array
from wirebayes.wire.effect import Amplitude, Effect, HoldContext, Own
from wirebayes.wire.laws import creep_fraction
from wirebayes.wire.protocol import Protocol


class PermanentCreep(Effect):
    """a_j = B τ^U - (1 - ψ) e_j; ψ = 1 is the additive chain.

    Creep that heads for the tension as it falls (a standard linear solid: U = N = 1) is the same in a test by steps,
    with ψ the share of the tension that relaxes.
    """

    name = "permanent_creep"
    pattern = "creep from hold to hold"
    place = "amount"
    formula = "permanent"
    scope = "material"
    # a share: nothing is known of it but that
    amplitudes = (Amplitude("psi", "-", 0.0, Uniform(0.0, 1.0)),)
    sentence = (
        "A part of the creep is permanent: later holds creep as if it had not occurred. Creep that heads for the "
        "tension as it falls within a hold looks the same, unless the wire hangs under weights."
    )
    shows = "between holds, unloading"

    def apply(self, value: Array, own: Own, hold: HoldContext) -> Array:
        return value + own["psi"] * hold.carried


class Superposition(Effect):
    """Creep (1 - ω) r + ω s: r is the chain whose clocks restart, s what the clocks of all holds add up to.

    s(t) is the sum over holds i of (E_i - E_{i-1}) (1 - exp(-k2 (t - t_i)^N)), E_i the creep that hold i heads for:
    each change of the load creeps on by its own clock, as Boltzmann's principle has it. In the additive history nothing
    is headed for.
    """

    name = "superposition"
    pattern = "creep from hold to hold"
    place = "elongation"
    formula = "superposition"
    scope = "material"
    needs_saturation = True
    # a share: nothing is known of it but that
    amplitudes = (Amplitude("omega", "-", 0.0, Uniform(0.0, 1.0)),)
    sentence = "The creep of earlier holds continues on its own time scale after the next hold has begun."
    shows = "grows with hold number, slow inside holds"

    def apply(self, value: Array, own: Own, hold: HoldContext) -> Array:
        exponent, superposed = hold.theta["N"], 0.0 * hold.grown
        before = np.zeros((1, 1))
        for start_s, goal, k2 in hold.past:
            reached = creep_fraction(hold.start_s - start_s + hold.time_s, k2, exponent)
            superposed = superposed + (goal - before) * reached
            before = goal
        return own["omega"] * (superposed - hold.grown)


class SecondRelaxation(Effect):
    """A second creep mode towards A τ_j(0), time constant T2."""

    name = "second_relaxation"
    pattern = "course of a hold"
    place = "elongation"
    formula = "second_mode"
    scope = "material"
    amplitudes = (
        # at the typical tension some tenths of a step, in a quarter of a hold within a factor of three
        Amplitude("A", "mm/N", 0.0, HalfNormal(0.4), is_elongation=True),
        Amplitude("T2", "s", 0.25, LogNormal(1.2, 0.25), is_shape=True),
    )
    sentence = "The wire creeps in two modes, one with a time constant of its own."
    shows = "shape within the hold"

    def apply(self, value: Array, own: Own, hold: HoldContext) -> Array:
        return value + (own["A"] * hold.initial_tension - value) * -np.expm1(-hold.time_s / own["T2"])


class SteadyCreep(Effect):
    """An elongation a τ_j(0) t beside the creep, without a plateau."""

    name = "steady_creep"
    pattern = "course of a hold"
    place = "elongation"
    formula = "flow"
    scope = "material"
    # at the typical tension up to half a step a hold: more would be the larger part of the creep
    amplitudes = (Amplitude("a", "mm/(N s)", 0.0, HalfNormal(0.5), is_elongation=True),)
    sentence = "The wire also flows steadily under tension and never settles."
    shows = "tail of the hold"

    def apply(self, value: Array, own: Own, hold: HoldContext) -> Array:
        return value + own["a"] * hold.initial_tension * hold.time_s

    @classmethod
    def variants(cls, protocols: Sequence[Protocol]) -> list[Effect]:
        return [SteadyCreep(), SteadyCreepCarried()]


class SteadyCreepCarried(Effect):
    """The same flow as a part of the carried creep: what has flowed counts towards the next hold's total."""

    name = "steady_creep"
    pattern = "course of a hold"
    place = "creep"
    formula = "flow_carried"
    scope = "material"
    amplitudes = SteadyCreep.amplitudes
    sentence = "The wire also flows steadily under tension; on unloading it recovers that flow."
    shows = "tail of the hold; recovered on unloading"

    @property
    def key(self) -> str:
        return f"{self.name}@carried"

    def apply(self, value: Array, own: Own, hold: HoldContext) -> Array:
        return value + own["a"] * hold.initial_tension * hold.time_s


class TensionDependentRate(Effect):
    """k2 (τ_j(0) / τref)^m; a wire below a hundredth of τref, or slack, counts as at a hundredth."""

    name = "tension_dependent_rate"
    pattern = "creep from hold to hold"
    place = "rate"
    formula = "rate_power"
    scope = "material"
    # at ten times the tension the creep is three times as fast or as slow
    amplitudes = (Amplitude("m", "-", 0.0, Normal(0.0, 0.5)),)
    sentence = "The creep runs faster or slower at higher tension."
    shows = "hold shape changes with tension"

    def apply(self, value: Array, own: Own, hold: HoldContext) -> Array:
        ratio = hold.initial_tension / hold.tension_ref_N
        return value * np.power(np.where(ratio.real > 0.01, ratio, 0.01), own["m"])


class Ageing(Effect):
    """a_j (1 + j)^(-a), j the number of earlier holds."""

    name = "ageing"
    pattern = "creep from hold to hold"
    place = "amount"
    formula = "ageing"
    scope = "material"
    # the tenth hold creeps a third as much as the first, or three times as much
    amplitudes = (Amplitude("a", "-", 0.0, Normal(0.0, 0.5)),)
    sentence = "Each hold relaxes less than the one before, whatever its tension."
    sentence_of_weights = "Each hold creeps less than the one before, whatever its weight."
    shows = "relaxation amplitude by order, not displacement"

    def apply(self, value: Array, own: Own, hold: HoldContext) -> Array:
        return value * (1.0 + hold.index) ** -own["a"]


class CreepThreshold(Effect):
    """Creep is driven by max(τ - τc, 0)."""

    name = "creep_threshold"
    pattern = "creep from hold to hold"
    place = "drive"
    formula = "threshold"
    no_creep_below = "creep_threshold.tau_c"
    scope = "material"
    # half the typical tension: a wire that creeps only beyond it hardly creeps in such a test
    amplitudes = (Amplitude("tau_c", "N", 0.0, HalfNormal(0.5)),)
    sentence = "Below a threshold tension the wire does not creep."
    shows = "no relaxation in the first holds"

    def apply(self, value: Array, own: Own, hold: HoldContext) -> Array:
        return np.where((value - own["tau_c"]).real > 0, value - own["tau_c"], 0.0)


class PriorCreep(Effect):
    """T_0 seconds at displacement zero before the first hold: some of the creep is spent already.

    Under weights a wire hangs unloaded before its first one; in the additive history later creep does not know of it.
    """

    name = "prior_creep"
    pattern = "creep from hold to hold"
    place = "before"
    formula = "before"
    scope = "event"
    needs_saturation = True
    # from the minutes of adjusting a sample to an hour or so under its preload, in holds of some minutes
    amplitudes = (Amplitude("T_0", "s", 0.0, HalfNormal(20.0), of_each_test=True),)
    sentence = "The wire had been under its preload for some time before the first hold."
    shows = "first holds relax less"

    def apply(self, value: Array, own: Own, hold: HoldContext) -> Array:
        return value + own["T_0"]

    @classmethod
    def variants(cls, protocols: Sequence[Protocol]) -> list[Effect]:
        return [cls()] if any(p.control == "displacement" for p in protocols) else []
