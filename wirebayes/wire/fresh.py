"""A fresh sample under a constant tension: how far it creeps, how fast, and how stiff it is there.

Every material effect takes part, at whatever place of the model it acts. What belongs to a test and not to the wire
(instrument, environment and event effects) never does: a sensor's nonlinearity is not the wire's. Precisely:

- the sample was never loaded: no creep is carried in, there is no earlier hold, and the clock starts with the load;
- the tension is the one that drives the creep, from the start to the end;
- *creep* is the growth of the zero-tension length, effects at ``elongation`` and ``zero_length`` included; what an
  effect at ``strain`` adds, it adds at once: that is in the stiffness, not in the creep;
- the temperature is that of the test's first reading, and the length that of the sample.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wirebayes.numeric.typing import Array
from wirebayes.wire.away_from_bench import steady_hold
from wirebayes.wire.bent_strain import bent, strain_of
from wirebayes.wire.creep import Creep
from wirebayes.wire.effect import HoldContext, Placed
from wirebayes.wire.model import Model
from wirebayes.wire.walk import Theta

_LOG_TIMES = -50.0, 700.0  # logarithms of the times between which the median creep time is looked for
_HALVINGS = 44  # 750 over two to the 44th: ten digits of a time


@dataclass(frozen=True)
class FreshSample:
    """Draws of a wire that was never loaded.

    Attributes
    ----------
    theta : mapping of name to (n,) array
        ``k1 B U k2 N`` and ``effect_name.parameter`` of every material effect of the model.
    model : Model
    length_mm : float
        Zero-tension length of the sample, which `B` refers to.
    """

    theta: Theta
    model: Model
    length_mm: float

    def creep_mm(self, tension_N: float, times_s: Array) -> Array:
        """Creep elongation after times (t,) at a constant tension, ``(t, n)``; a time may be infinite."""
        return self._creep(tension_N, np.asarray(times_s, float)[:, None])

    def final_creep_mm(self, tension_N: float) -> Array:
        """Where the creep ends at a constant tension, ``(n,)``; infinite where it never does."""
        return self.creep_mm(tension_N, np.array([np.inf]))[0]

    def median_creep_time_s(self, tension_N: float) -> Array:
        """When half of the final creep is reached, ``(n,)``; NaN where there is no creep or it never ends."""
        final = self.final_creep_mm(tension_N)
        low, high = (np.full(final.shape, end) for end in _LOG_TIMES)
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            (reached,) = self._creep(tension_N, np.exp(middle)[None])
            early = reached < 0.5 * final
            low = np.where(early, middle, low)
            high = np.where(early, high, middle)
        ends = np.isfinite(final) & (final > 0)
        return np.where(ends, np.exp(high), np.nan)

    def stiffness_N(self, tension_N: float) -> Array:
        """Tangent stiffness at a tension, N per unit strain, ``(n,)``: zero-tension length times dτ/dS.

        k1 where the law is eq (1) and no effect bends the strain. NaN where the wire cannot carry the tension, and
        where nothing is known of k1.
        """
        effects, theta = self._wire
        if "k1" not in theta:
            return np.full(len(theta["B"]), np.nan)
        k1 = theta["k1"]
        hold = self._hold(tension_N, np.zeros((1, 1)))
        with np.errstate(all="ignore"):
            bent_strain = np.asarray(tension_N / k1)[None]
            strain = strain_of(effects, bent_strain, hold)
            _, slope = bent(effects, strain, hold)
            shrunk = 1.0 if self.model.law == "hooke" else np.square(1.0 - strain)
            return (k1 * slope * shrunk)[0]

    @cached_property
    def _wire(self) -> tuple[Placed, Theta]:
        """The material effects, and the parameters as they are at the sample's own length."""
        placed = Placed([e for e in self.model.effects if e.scope == "material"], self.theta)
        hold = self._context(self.theta)
        return placed, dict(placed.change("sample", hold.theta, hold))

    def _context(self, theta: Theta) -> HoldContext:
        model = self.model
        return steady_hold(
            theta,
            self.length_mm,
            model.tension_ref_N,
            law=model.law,
            length_ref_mm=model.length_ref_mm or self.length_mm,
            typical=model.typical,
        )

    def _hold(self, tension_N: float, time_s: Array) -> HoldContext:
        theta = self._wire[1]
        hold, shape = self._context(theta), (1, max(len(v) for v in theta.values()))
        hold.initial_tension, hold.carried = np.full(shape, float(tension_N)), np.zeros(shape)
        hold.time_s, hold.duration_s = time_s, float(np.max(time_s))
        hold.warming_K = np.zeros((len(time_s), 1))
        return hold

    def _creep(self, tension_N: float, time_s: Array) -> Array:
        """`creep_mm` at times ``(t, 1)``, or at one time of each draw ``(1, n)``."""
        effects, theta = self._wire
        law = Creep(effects, theta, self.model.history)
        hold = self._hold(tension_N, time_s)
        with np.errstate(all="ignore"):
            amount = law.amount(hold.initial_tension, hold)
            k2 = law.rate(hold)
            reached = amount * law.fraction(k2, hold)
            hold.grown = law.creep(reached, hold)
            hold.past = [(0.0, amount, k2)]
            beside = law.beside({}, hold)
            whole = law.elongation(hold.grown, beside, hold)
        draws = hold.carried.shape[1]
        return np.array(np.broadcast_to(whole, (len(time_s), draws)))
