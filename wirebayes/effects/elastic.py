"""Effects on the elastic side: strain, zero-tension length, stiffness of the fixture, length of the sample."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from wirebayes.wire.effect import Amplitude, Effect, HoldContext
from wirebayes.wire.protocol import Protocol

Own = dict[str, NDArray[Any]]
_DEPENDENT = ("k1", "B", "U", "N")  # parameters that may depend on the length; compiled code counts them in this order


class StrainStiffening(Effect):
    """τ = k1 s (1 + c s)."""

    name = "strain_stiffening"
    place = "strain"
    formula = "stiffening"
    scope = "material"
    amplitudes = (Amplitude("c", "-", 0.0, stats.norm(0.0, 20.0)),)
    sentence = "The wire becomes stiffer (or softer) the more it is strained."
    shows = "curved in displacement, constant within a hold"

    def apply(self, value: NDArray[Any], own: Own, hold: HoldContext) -> NDArray[Any]:
        return value * (1.0 + own["c"] * value)


class Toe(Effect):
    """s -> s - c (1 - exp(-s / c)): the line straightens before it pulls."""

    name = "toe"
    place = "strain"
    formula = "toe"
    scope = "material"
    amplitudes = (Amplitude("c", "-", 0.0, stats.halfnorm(0.0, 0.002)),)
    sentence = "At low tension the line is still straightening out and pulls less than its stiffness implies."
    shows = "deficit at low tension only"

    def apply(self, value: NDArray[Any], own: Own, hold: HoldContext) -> NDArray[Any]:
        width = own["c"]
        safe = np.where(width > 0, width, 1.0)
        straight = np.where(width > 0, -np.expm1(-np.maximum(value.real, 0.0) / safe), 0.0)
        shortened = value.real - width * straight
        if not np.iscomplexobj(value):
            return shortened
        # The derivative written out: a complex exponential costs ten real ones.
        return shortened + 1j * value.imag * np.where(width > 0, straight, 1.0)


class FixtureCompliance(Effect):
    """S - τ c: the frame or the sensor gives way in proportion to the tension."""

    name = "fixture_compliance"
    place = "strain"
    formula = "series"
    scope = "instrument"
    in_series = True
    amplitudes = (Amplitude("c", "mm/N", 0.0, stats.halfnorm(0.0, 0.2)),)
    sentence = "The test bench itself deforms under the tension."
    shows = "k1 differs by length; needs two lengths of one line"

    def apply(self, value: NDArray[Any], own: Own, hold: HoldContext) -> NDArray[Any]:
        # A spring of compliance c in series with the wire, solved for the tension.
        return value / (1.0 + own["c"] * hold.theta["k1"] / hold.length_mm)

    @classmethod
    def variants(cls, protocols: Sequence[Protocol]) -> list[Effect]:
        return [cls()] if _two_lengths(protocols) else []


class ThermalExpansion(Effect):
    """ℓ (1 + α (T - T_first)), with the logged temperature."""

    name = "thermal_expansion"
    place = "zero_length"
    formula = "thermal"
    scope = "material"
    amplitudes = (Amplitude("alpha", "1/K", 0.0, stats.norm(0.0, 1e-4)),)
    sentence = "The wire grows or shrinks with the logged temperature."
    shows = "follows the logged temperature"

    def apply(self, value: NDArray[Any], own: Own, hold: HoldContext) -> NDArray[Any]:
        return value * (1.0 + own["alpha"] * hold.warming_K)

    @classmethod
    def variants(cls, protocols: Sequence[Protocol]) -> list[Effect]:
        logged = [p for p in protocols if p.warming_K is not None and np.ptp(p.warming_K[p.mask]) > 0]
        return [cls()] if logged else []


@dataclass(frozen=True)
class LengthDependence(Effect):
    """One of k1, B, U, N grows as L0^p beyond what the plain model says (B as L0, the others not at all)."""

    which: str = "k1"
    name = "length_dependence"
    place = "sample"
    formula = "length_power"
    scope = "material"
    compares_lengths = True
    amplitudes = (Amplitude("p", "-", 0.0, stats.norm(0.0, 1.0)),)
    sentence = "A parameter changes with the length of the sample more than the plain model assumes."
    shows = "differs between lengths only"

    @property
    def key(self) -> str:
        return f"{self.name}@{self.which}"

    @property
    def formula_constant(self) -> float:
        return float(_DEPENDENT.index(self.which))

    def apply(self, value: Any, own: Own, hold: HoldContext) -> Any:
        return value | {self.which: value[self.which] * (hold.length_mm / hold.length_ref_mm) ** own["p"]}

    @classmethod
    def variants(cls, protocols: Sequence[Protocol]) -> list[Effect]:
        return [cls(which) for which in _DEPENDENT] if _two_lengths(protocols) else []


def _two_lengths(protocols: Sequence[Protocol]) -> bool:
    return len({p.length_mm for p in protocols}) > 1
