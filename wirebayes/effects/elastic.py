"""Effects on the elastic side: strain, zero-tension length, stiffness of the fixture, length of the sample."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wirebayes.numeric.distributions import HalfNormal, Normal, TruncatedNormal
from wirebayes.numeric.means import geometric_mean
from wirebayes.numeric.typing import Array
from wirebayes.wire.effect import Amplitude, Effect, HoldContext, Own, Typical
from wirebayes.wire.protocol import Protocol

_DEPENDENT = ("k1", "B", "U", "N")  # parameters that may depend on the length
_OF_EXPONENT = {"U": "B", "N": "k2"}  # the parameter whose unit depends on an exponent
_BENT = 0.25  # share by which the tension is larger or smaller where a wire is stretched most


@dataclass(frozen=True)
class StrainStiffening(Effect):
    """τ = k1 s (1 + c s).

    Attributes
    ----------
    most : float
        The largest strain of the tests that it is looked for in, which its prior refers to: a rubber band is stretched
        by its length and a steel rope by a thousandth of it.
    """

    most: float = 0.01

    name = "strain_stiffening"
    pattern = "elastic curve"
    place = "strain"
    formula = "stiffening"
    scope = "material"
    amplitudes = (Amplitude("c", "-", 0.0, Normal(0.0, _BENT / most)),)
    sentence = "The wire becomes stiffer (or softer) the more it is strained."
    shows = "curved in displacement, constant within a hold"

    def apply(self, value: Array, own: Own, hold: HoldContext) -> Array:
        return value * (1.0 + own["c"] * value)

    def __post_init__(self) -> None:
        (amplitude,) = type(self).amplitudes
        own = replace(amplitude, prior=Normal(0.0, _BENT / self.most))
        object.__setattr__(self, "amplitudes", (own,))

    def on(self, protocols: Sequence[Protocol], range_mm: float) -> Effect:
        if not protocols:
            return self
        length_mm = geometric_mean(p.length_mm for p in protocols)
        return StrainStiffening(range_mm / length_mm).under(self.control)


class Toe(Effect):
    """The ends straighten first: of a stretch x, x - w (1 - exp(-x / w)) pulls.

    A length of the ends and knots, the same for every sample of a line however long. The inverse is by Lambert's W:
    x = y + w (1 + W(-exp(-1 - y / w))) for what pulls, y.
    """

    name = "toe"
    pattern = "elastic curve"
    place = "strain"
    formula = "toe"
    straightens = "toe.w"
    scope = "material"
    # a few steps of a test are enough to straighten ends and knots; as much as that is seen on short samples of rope
    amplitudes = (Amplitude("w", "mm", 0.0, HalfNormal(2.0)),)
    sentence = "At low tension the ends are still straightening out and the line pulls less than its stiffness implies."
    shows = "deficit at low tension only"

    def apply(self, value: Array, own: Own, hold: HoldContext) -> Array:
        strained = hold.zero_mm if hold.law == "hooke" else hold.zero_mm / (1.0 - value)
        return value - own["w"] * _straightened(value * strained, own["w"]) / strained

    @classmethod
    def variants(cls, protocols: Sequence[Protocol]) -> list[Effect]:
        """As a strain only where two lengths could say so: at one length it is the same."""
        return [Toe(), ToeOfStrain()] if _two_lengths(protocols) else [Toe()]


class ToeOfStrain(Effect):
    """The same as a strain: the whole line straightens, s -> s - c (1 - exp(-s / c)) with c = w / L0."""

    name = "toe"
    pattern = "elastic curve"
    place = "strain"
    formula = "toe_of_strain"
    scope = "material"
    amplitudes = (replace(Toe.amplitudes[0], is_elongation=True),)
    sentence = (
        "At low tension the line is still straightening out, all along, and pulls less than its stiffness implies."
    )
    shows = "deficit at low tension only, in proportion to the length"

    @property
    def key(self) -> str:
        return f"{self.name}@strain"

    def apply(self, value: Array, own: Own, hold: HoldContext) -> Array:
        return value - own["w"] * _straightened(value * hold.length_mm, own["w"]) / hold.length_mm


def _straightened(stretch_mm: Array, width_mm: Array) -> Array:
    """Share of its width that a toe has straightened by at a stretch."""
    bent = (width_mm.real > 0) & (stretch_mm.real > 0)
    ratio = np.where(bent, stretch_mm, 0.0) / np.where(bent, width_mm, 1.0)
    share = -np.expm1(-ratio.real)
    # the derivative written out: a complex exponential costs ten real ones
    return share + 1j * ratio.imag * (1.0 - share) if np.iscomplexobj(ratio) else share


class PowerStrain(Effect):
    """τ = k1 s^(1 + p), strain s in units of the typical one, τref / k1: so k1 stays the stiffness at τref."""

    name = "power_strain"
    pattern = "elastic curve"
    place = "strain"
    formula = "power"
    scope = "material"
    # tendons and braids follow powers of 1.2 to 2, plastics below their yield nearly 1, rubber less; at p = -1 the
    # tension would not depend on the strain
    amplitudes = (Amplitude("p", "-", 0.0, TruncatedNormal(-3.0, 0.0, 0.3)),)
    sentence = "The tension follows a power of the strain."
    shows = "curved in displacement, most at low tension; constant within a hold"

    def apply(self, value: Array, own: Own, hold: HoldContext) -> Array:
        stretched = value.real > 0
        typical = hold.tension_ref_N / hold.theta["k1"]
        return value * np.power(np.where(stretched, value / typical, 1.0), own["p"])


class FixtureCompliance(Effect):
    """S - τ c: the frame or the sensor gives way in proportion to the tension."""

    name = "fixture_compliance"
    pattern = "length of the sample"
    place = "strain"
    formula = "series"
    scope = "instrument"
    in_series = True
    # at the typical tension the fixture gives way by most of a step
    amplitudes = (Amplitude("c", "mm/N", 0.0, HalfNormal(0.8)),)
    sentence = "The test bench itself deforms under the tension."
    shows = "k1 differs by length; needs two lengths of one line"

    def apply(self, value: Array, own: Own, hold: HoldContext) -> Array:
        # A spring of compliance c in series with the wire, solved for the tension.
        return value / (1.0 + own["c"] * hold.theta["k1"] / hold.length_mm)

    @classmethod
    def variants(cls, protocols: Sequence[Protocol]) -> list[Effect]:
        return [cls()] if _two_lengths(protocols) else []


class ThermalExpansion(Effect):
    """ℓ (1 + α (T - T_first)), with the logged temperature."""

    name = "thermal_expansion"
    pattern = "slow drift"
    place = "zero_length"
    formula = "thermal"
    scope = "material"
    # plastics expand by about a ten-thousandth a kelvin, drawn fibres less or the other way
    amplitudes = (Amplitude("alpha", "1/K", 0.0, Normal(0.0, 1e-4)),)
    sentence = "The wire grows or shrinks with the logged temperature."
    shows = "follows the logged temperature"

    def apply(self, value: Array, own: Own, hold: HoldContext) -> Array:
        return value * (1.0 + own["alpha"] * hold.warming_K)

    @classmethod
    def variants(cls, protocols: Sequence[Protocol]) -> list[Effect]:
        logged = [p for p in protocols if p.warming_K is not None and np.ptp(p.warming_K[p.mask]) > 0]
        return [cls()] if logged else []


@dataclass(frozen=True)
class LengthDependence(Effect):
    """One of k1, B, U, N grows as L0^p beyond what the plain model says (B as L0, the others not at all).

    Where U grows, B follows, so that the creep B τ^U at the typical tension of the tests stays as it is; where N grows,
    k2 follows, so that the hazard k2 t^N after a typical hold does. Which of U and N is meant thus depends on no unit.
    """

    which: str = "k1"
    name = "length_dependence"
    pattern = "length of the sample"
    place = "sample"
    scope = "material"
    compares_lengths = True
    # either way about in proportion to the length
    amplitudes = (Amplitude("p", "-", 0.0, Normal(0.0, 1.0)),)
    sentence = "A parameter changes with the length of the sample more than the plain model assumes."
    shows = "differs between lengths only"

    @property
    def key(self) -> str:
        return f"{self.name}@{self.which}"

    @property
    def formula(self) -> str:  # type: ignore[override]
        return f"{self.which}_of_length"

    def formula_constant(self, typical: Typical) -> float:
        return float(np.log(self._measured_at(typical)))

    def apply(self, value: Any, own: Own, hold: HoldContext) -> Any:
        before = value[self.which]
        after = before * (hold.length_mm / hold.length_ref_mm) ** own["p"]
        changed = value | {self.which: after}
        if self.which in _OF_EXPONENT:
            coefficient = _OF_EXPONENT[self.which]
            changed[coefficient] = value[coefficient] * self._measured_at(hold.typical) ** (before - after)
        return changed

    def _measured_at(self, typical: Typical) -> Any:
        """Where the creep does not depend on the length: the tension of U, the time of N."""
        return {"U": typical.tension_N, "N": typical.hold_s}.get(self.which, 1.0)

    @classmethod
    def variants(cls, protocols: Sequence[Protocol]) -> list[Effect]:
        return [cls(which) for which in _DEPENDENT] if _two_lengths(protocols) else []


def _two_lengths(protocols: Sequence[Protocol]) -> bool:
    return len({p.length_mm for p in protocols}) > 1
