"""One experiment as the likelihood sees it, and the names of the plain model's parameters."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from wirebayes.model.hold_filter import Measured
from wirebayes.model.likelihoods import reading_variance
from wirebayes.numeric.typing import Array
from wirebayes.wire.effect import Effect
from wirebayes.wire.model import Model
from wirebayes.wire.protocol import Protocol

Likelihood = Literal["chain", "hold"]
MATERIAL = ("k1", "B", "U", "k2", "N")
NOISES = ("sensor_sd", "setting_sd")
SAMPLE = ("preload", *NOISES)
LENGTH_EXPONENT = "creep_length_exponent"


@dataclass(frozen=True)
class Sample:
    """One experiment made ready for the likelihood.

    Attributes
    ----------
    name, material : str
    protocol : Protocol
    readings : (H, R, 1) array
        N, or mm where the tension is set.
    resolution : float
        Step to which they were rounded, no finer than any instrument resolves.
    model : Model
        With the effects that act on this sample.
    """

    name: str
    material: str
    protocol: Protocol
    readings: Array
    resolution: float
    model: Model

    def parameters(self, likelihood: Likelihood) -> tuple[str, ...]:
        """The plain parameters that its readings depend on: hold by hold no preload, and under weights no k1."""
        if likelihood == "chain":
            return MATERIAL + SAMPLE
        wire = MATERIAL if self.protocol.control == "displacement" else MATERIAL[1:]
        return (*wire, "sensor_sd")

    def scored_readings(self, likelihood: Likelihood) -> Array:
        """(H,) of how many readings of each hold the likelihood is a density: hold by hold the first one is given."""
        taken = self.protocol.mask.sum(axis=1)
        if likelihood == "chain":
            return taken
        given = self.protocol.recorded
        if self.protocol.control == "displacement":
            given = given & (self.readings[:, 0, 0] > 0.0)  # a slack one says nothing of the length
        return np.where(given, taken - 1, 0)

    def variance(self, own: Mapping[str, Array]) -> Array:
        """(n,) variance of one reading, N² or mm², by the sample's own parameters."""
        return reading_variance(own["sensor_sd"], self.resolution)

    def measured(self, own: Mapping[str, Array], readings: Array | None = None) -> Measured:
        """Its readings, or those that stand in for them, and how they err by the sample's own parameters."""
        taken = self.readings if readings is None else readings
        return Measured(taken, self.protocol.mask, self.variance(own), own["setting_sd"])

    @property
    def length_ref_mm(self) -> float:
        """The length that the material's parameters refer to, mm."""
        return self.model.length_ref_mm or self.protocol.length_mm

    @property
    def length_ratio(self) -> float:
        return self.protocol.length_mm / self.length_ref_mm

    @property
    def typical_hold_s(self) -> float:
        """Median duration of the recorded holds (a second where all readings are at time zero)."""
        return float(np.median(self.protocol.duration_s[self.protocol.recorded])) or 1.0

    @property
    def tensions_N(self) -> Array:
        """Tensions that were read, or set while something was read."""
        if self.protocol.control == "force":
            return self.protocol.setting[self.protocol.recorded]
        return self.readings[..., 0][self.protocol.mask]

    @property
    def tested_tension_N(self) -> float:
        """The tension nearest to the reference, of those with which recorded holds begin.

        The reference, a geometric mean, may lie far from all that was tested. Where no hold begins under tension it
        stands in.
        """
        begun = self.protocol.setting if self.protocol.control == "force" else self.readings[:, 0, 0]
        tested = begun[self.protocol.recorded & (begun > 0.0)]
        reference = self.model.tension_ref_N
        return float(min(tested, key=lambda tension: abs(np.log(tension / reference)), default=reference))


def at_length(own: Mapping[str, Array], effects: Sequence[Effect], ratio: float, exponent: Any) -> dict[str, Array]:
    """Parameters of a sample of another length than the reference: whatever is an elongation of the wire has grown.

    The creep amount `B` grows as the ratio to the power `exponent`, an effect's elongation as the ratio itself.

    Parameters
    ----------
    own : mapping of name to (n,) array
        Parameters at the reference length.
    effects : sequence of Effect
        Those of the model; they say which of their amplitudes are elongations.
    ratio : float
        Length of the sample over the reference length.
    exponent : float or (n,) array
        1 where creep is a strain of the whole wire, 0 where it does not depend on the length.

    Returns
    -------
    dict of name to array
    """
    grown = [c for e in effects for c, a in zip(e.columns(), e.amplitudes, strict=True) if a.is_elongation]
    return {**own, "B": own["B"] * ratio**exponent, **{name: own[name] * ratio for name in grown}}
