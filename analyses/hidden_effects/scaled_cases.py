"""One test at any scale and what an effect does to it, and names that look alike. Nothing of the package is used."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
from scipy.linalg import solve_triangular

from .rig import Array
from .scaled_law import Hidden, ScaledTest, readings
from .scaled_sizes import PLAIN, Signatures, basis_of

SAME_GROUP = 0.95  # |cos| of two projected signatures, from which the names count as one
# what is known of a line before its test, as docs say of the default priors: standard deviations of logarithms, and of
# the preload in stretches
KNOWN = {"k1": 1.5, "B": 1.5, "U": 0.7, "k2": 1.5, "N": 0.45, "preload": 0.3}
_DIFFERENCE = 1e-4
_NEARLY = 0.15  # relative error of a size that is only compared by its direction


@dataclass(frozen=True)
class Kind:
    """An effect that can be hidden.

    Attributes
    ----------
    signs : tuple of int
    largest : float
        Largest sensible amplitude, in typical moves, typical readings or holds.
    unit : str
        Which of these it is in; empty for a share or a power.
    """

    signs: tuple[int, ...]
    largest: float
    unit: str = ""


_BOTH, _UP = (1, -1), (1,)
KINDS = {
    "strain_stiffening": Kind(_BOTH, 0.45, "1/strain"),
    "toe": Kind(_UP, 4.0, "move"),
    "power_strain": Kind(_BOTH, 0.7),
    "permanent_creep": Kind(_UP, 1.0),
    "superposition": Kind(_UP, 1.0),
    "prior_creep": Kind(_UP, 40.0, "hold"),
    "second_relaxation": Kind(_UP, 1.0, "move/tension"),
    "steady_creep": Kind(_UP, 1.0, "move/tension/hold"),
    "tension_dependent_rate": Kind(_BOTH, 1.5),
    "ageing": Kind(_BOTH, 1.2),
    "creep_threshold": Kind(_UP, 1.2, "tension"),
    "reading_delay": Kind(_UP, 0.9, "gap"),
    "late_clock": Kind(_UP, 0.15, "hold"),
    "screw_error": Kind(_UP, 0.2, "move"),
    "grip_slip": Kind(_BOTH, 1.0, "move"),
    "unrecorded_hold": Kind(_UP, 8.0, "hold"),
    "sensor_drift": Kind(_BOTH, 0.3, "reading/hold"),
    "sensor_nonlinearity": Kind(_BOTH, 0.25, "1/reading"),
    "thermal_expansion": Kind(_BOTH, 4e-4),
    "lost_motion": Kind(_UP, 0.4, "move"),
    "guide_friction": Kind(_BOTH, 0.2),
    "clamp_transient": Kind(_BOTH, 0.2),
}
# what only two lengths of a line show
OF_LENGTHS = {"fixture_compliance": Kind(_UP, 1.0, "compliance"), "length_dependence": Kind(_BOTH, 1.0)}
# in no catalogue
FOREIGN = {
    "yield": Kind(_UP, 0.7),
    "hold_softening": Kind(_UP, 0.5, "1/test"),
    "log_creep": Kind(_UP, 1.0),
    "exponent_by_tension": Kind(_BOTH, 0.3),
    "worn_thread": Kind(_UP, 0.5, "move"),
    "gain_step": Kind(_BOTH, 0.3),
    "zero_step": Kind(_BOTH, 0.3, "reading"),
    "wave": Kind(_UP, 0.2, "reading"),
    "passing_draught": Kind(_BOTH, 0.2, "reading"),
}
EVERY = KINDS | OF_LENGTHS | FOREIGN
UNKNOWN = "unknown"  # what is said of an effect that is in no catalogue


@dataclass(frozen=True)
class ScaledCase(Signatures):
    """A test of a line, its truth and noise.

    Attributes
    ----------
    test : ScaledTest
    truth : dict
        ``k1 B U k2 N preload``.
    sensor_sd, setting_sd, resolution : float
        In the units of what is read and of what is set.
    about : dict
        What kind of test it is.
    """

    test: ScaledTest
    truth: dict[str, float]
    sensor_sd: float
    setting_sd: float
    resolution: float
    about: dict[str, Any]

    def noise_free(self, hidden: Hidden = Hidden()) -> Array:  # noqa: B008 - it is frozen
        """Readings without noise."""
        return readings(self.test, self.truth, hidden, np.zeros(len(self.test.settings)))

    def measured(self, hidden: Hidden, rng: np.random.Generator) -> Array:
        """Readings with noise."""
        errors = self.setting_sd * rng.standard_normal(len(self.test.settings))
        y = readings(self.test, self.truth, hidden, errors)
        y = y + self.sensor_sd * rng.standard_normal(len(y))
        return np.round(y / self.resolution) * self.resolution if self.resolution else y

    @cached_property
    def _factor(self) -> Array:
        """Cholesky factor of the covariance."""
        by_error = np.stack([self._by_error(j) for j in range(len(self.test.settings))], axis=1)
        variance = self.sensor_sd**2 + self.resolution**2 / 12.0
        v = variance * np.eye(len(by_error)) + self.setting_sd**2 * by_error @ by_error.T
        return np.asarray(np.linalg.cholesky(v), np.float64)

    @cached_property
    def basis(self) -> Array:
        return basis_of(np.stack([self.whitened(self.by(name)) for name in PLAIN], axis=1))

    def _by_error(self, j: int) -> Array:
        step = _DIFFERENCE * float(np.abs(self.test.settings).mean())
        up = step * np.eye(len(self.test.settings))[j]
        above, below = (readings(self.test, self.truth, Hidden(), errors) for errors in (up, -up))
        return np.asarray((above - below) / (2.0 * step))

    def by(self, name: str) -> Array:
        """Readings by one parameter."""
        step = _DIFFERENCE * (self.about["stretch_mm"] if name == "preload" else self.truth[name])
        up, down = (replace(self, truth=self.truth | {name: self.truth[name] + d}) for d in (step, -step))
        return (up.plain - down.plain) / (2.0 * step)

    def moved(self, by: Array) -> Array:
        return self.with_parameters(dict(zip(PLAIN, by, strict=True))).plain

    def with_parameters(self, by: dict[str, float]) -> ScaledCase:
        """The same test of a line whose parameters differ by so many of `KNOWN`."""
        far = {name: KNOWN[name] * value for name, value in by.items()}
        truth = self.truth | {name: self.truth[name] * float(np.exp(far[name])) for name in ("k1", "B", "U", "k2", "N")}
        # what is known of creep is that of the typical tension, and of its rate that of a hold
        truth["B"] *= self.test.tension_ref_N ** (self.truth["U"] - truth["U"])
        truth["k2"] *= float(np.median(self.test.durations_s)) ** (self.truth["N"] - truth["N"])
        truth["preload"] = self.truth["preload"] + far["preload"] * self.about["stretch_mm"]
        return replace(self, truth=truth)

    def whitened(self, dy: Array) -> Array:
        return np.asarray(solve_triangular(self._factor, dy, lower=True, check_finite=False))

    def largest(self, name: str) -> float:
        test, kind = self.test, EVERY[name]
        moves = np.abs(np.diff(test.settings, prepend=0.0))
        hold_s = float(np.median(test.durations_s))
        move = float(np.median(moves[moves > 0]))
        if test.weights:
            move *= test.length_mm / self.truth["k1"]
        tension = test.tension_ref_N
        units = {
            "": 1.0,
            "1/strain": self.truth["k1"] / tension,
            "move": move,
            "hold": hold_s,
            "move/tension": move / tension,
            "move/tension/hold": move / tension / hold_s,
            "tension": tension,
            "gap": min(float(t[1] - t[0]) for t in test.times_s),
            "reading/hold": float(np.median(np.abs(self.plain))) / hold_s,
            "1/reading": 1.0 / float(np.abs(self.plain).max()),
            "reading": float(np.median(np.abs(self.plain))),
            "compliance": test.length_mm / self.truth["k1"],
            "1/test": 1.0 / len(test.settings),
        }
        return kind.largest * units[kind.unit]

    def shown(self) -> list[str]:
        back = bool(np.any(np.diff(self.test.settings) < 0))
        out = []
        for name in KINDS:
            if name in ("lost_motion", "guide_friction") and not back:
                continue
            if name in ("screw_error", "prior_creep") and self.test.weights:
                continue
            if name == "screw_error" and (len(self.test.settings) < 7 or back):
                continue
            if name == "thermal_expansion" and self.test.warming_K is None:
                continue
            out.append(name)
        return out

    def foreign(self) -> list[str]:
        """Effects in no catalogue that such a test could show; under weights a step of the gauge's zero is a slip."""
        return [name for name in FOREIGN if not (self.test.weights and name in ("worn_thread", "zero_step"))]

    def forms(self, name: str, rng: np.random.Generator | None = None) -> Iterator[Hidden]:
        axes = self._axes(name, rng)
        signs = EVERY[name].signs if rng is None else (int(rng.choice(EVERY[name].signs)),)
        for sign, *values in product(signs, *axes.values()):
            yield Hidden(name, float(sign), dict(zip(axes, values, strict=True)))

    def _axes(self, name: str, rng: np.random.Generator | None) -> dict[str, list[float]]:
        test, hold_s = self.test, float(np.median(self.test.durations_s))
        if name in FOREIGN:
            return self._foreign_axes(name, rng)
        if name in ("grip_slip", "unrecorded_hold"):
            return {"hold": _chosen(np.arange(2.0, len(test.settings) - 1), rng)}
        if name == "second_relaxation":
            return {"time_s": _between(0.06 * hold_s, 1.5 * hold_s, rng)}
        if name == "clamp_transient":
            return {"time_s": _between(0.02 * hold_s, 0.4 * hold_s, rng)}
        if name == "steady_creep":
            return {"carried": _chosen(np.array([0.0, 1.0]), rng)}
        if name == "screw_error":
            step = float(np.median(np.diff(test.settings)))
            longest = 0.5 * float(test.settings.max())
            return {
                "period": _between(2.0 * step, longest, rng, 8),
                "phase": _chosen(np.arange(0.3, 6.2, 1.0), rng),
            }
        return {}

    def _foreign_axes(self, name: str, rng: np.random.Generator | None) -> dict[str, list[float]]:
        test, hold_s = self.test, float(np.median(self.test.durations_s))
        most, whole_s = float(test.settings.max()), float(test.durations_s.sum())
        if name in ("gain_step", "zero_step"):
            return {"hold": _chosen(np.arange(2.0, len(test.settings) - 1), rng)}
        if name == "yield":
            strain = most / (self.truth["k1"] if test.weights else test.length_mm)
            return {"strain": _between(0.35 * strain, 0.65 * strain, rng)}
        if name == "log_creep":
            return {"onset_s": _between(0.01 * hold_s, 0.25 * hold_s, rng), "long_s": [2.5 * hold_s]}
        if name == "worn_thread":
            step = float(np.median(np.abs(np.diff(test.settings))))
            return {
                "centre": _between(0.3 * most, 0.7 * most, rng),
                "width": _between(0.5 * step, 1.2 * step, rng),
            }
        if name == "wave":
            return {
                "period_s": _between(1.4 * hold_s, 7.0 * hold_s, rng),
                "phase": _chosen(np.arange(0.3, 6.2, 1.0), rng),
            }
        if name == "passing_draught":
            return {
                "centre": _between(0.2 * whole_s, 0.8 * whole_s, rng),
                "width": _between(0.3 * hold_s, 1.2 * hold_s, rng),
            }
        return {}


def _chosen(values: Array, rng: np.random.Generator | None) -> list[float]:
    return [float(v) for v in values] if rng is None else [float(rng.choice(values))]


def _between(low: float, high: float, rng: np.random.Generator | None, count: int = 4) -> list[float]:
    shares = (np.arange(count) + 0.5) / count if rng is None else rng.uniform(size=1)
    return [float(low * (high / low) ** share) for share in shares]


def group(case: Signatures, hidden: Hidden, delta: float) -> dict[str, float]:
    """Names that look like the effect in this test, each with the largest |cos| to it.

    Of one in no catalogue that is what has no name, and the names that look like it.
    """
    own = case.signature(hidden)
    alike = {UNKNOWN if hidden.name in FOREIGN else hidden.name: 1.0}
    for name in case.shown():
        if name == hidden.name:
            continue
        forms = [case.of_delta(form, delta, _NEARLY) for form in case.forms(name)]
        signatures = [case.signature(form) for form in forms if form is not None]
        cosines = [abs(float(own @ s)) / float(np.linalg.norm(own) * np.linalg.norm(s)) for s in signatures]
        if cosines and max(cosines) > SAME_GROUP:
            alike[name] = max(cosines)
    return alike
