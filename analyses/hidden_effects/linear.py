"""A case linearised at its plain fit: what the baselines select from."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from .catalogue import Candidate, library
from .delta import Geometry, delta_curves
from .fitting import fit
from .rig import MATERIAL_PARAMETERS, Array, Mask, Rig, Wire

SETTING_GRID_MM = np.geomspace(0.001, 0.06, 8)


@dataclass(frozen=True)
class Linear:
    """A case linearised at its plain fit, restricted to the readings used, for each setting error of the grid.

    Attributes
    ----------
    residuals : whitened residuals, projected, (s, R).
    signatures : whitened unit-size signatures, projected, (s, c, R).
    penalty : log det V, (s,).
    candidates, sizes : library members and the amplitudes their signatures belong to.
    chol : Cholesky factors (s, R, R).
    basis : orthonormal parameter directions (s, R, r).
    """

    residuals: Array
    signatures: Array
    penalty: Array
    candidates: list[Candidate]
    sizes: Array
    chol: Array
    basis: Array


def sensor_variance(rig: Rig, y: Array) -> list[float]:
    """Reading variance (N^2) of each bench without a model: residuals about an own smooth curve in every hold."""
    found = []
    for bench, part in zip(rig.benches, rig.bench_slices, strict=True):
        total, freedom = 0.0, 0
        for j in range(len(bench.holds)):
            own = bench.hold_of_reading == j
            t, values = bench.reading_times_s[own], y[part][own]
            if len(t) < 4:
                continue
            columns = np.stack([np.ones(len(t)), np.log1p(t / 5), np.sqrt(t)], axis=1)
            rest = values - columns @ np.linalg.lstsq(columns, values, rcond=None)[0]
            total, freedom = total + float(rest @ rest), freedom + len(t) - 3
        floor = (bench.resolution_N or 1e-4) ** 2 / 12
        found.append(max(total / max(freedom, 1), floor))
    return found


def blind(rig: Rig, y: Array) -> Rig:
    """The rig with its noise replaced by estimates; the setting error starts in the middle of its grid."""
    variances = sensor_variance(rig, y)
    benches = [
        dataclasses.replace(b, sensor_sd=float(np.sqrt(v)), setting_sd=0.01, resolution_N=None)
        for b, v in zip(rig.benches, variances, strict=True)
    ]
    return dataclasses.replace(rig, benches=tuple(benches))


def linearise(rig: Rig, y: Array, keep: Mask) -> tuple[Linear, Rig]:
    """Residuals and library signatures at a plain fit, and the rig as fitted: twice, to weigh by the setting error."""
    guess = blind(rig, y)
    for _ in range(2):
        linear, guess, here = _linearise_once(rig, guess, y, keep)
    return linear, here


def _linearise_once(rig: Rig, guess: Rig, y: Array, keep: Mask) -> tuple[Linear, Rig, Rig]:
    plain = fit(guess, y, keep)
    wires, count = {}, len(MATERIAL_PARAMETERS)
    for i, material in enumerate(rig.materials):
        own = plain.theta[count * i : count * (i + 1)]
        wires[material] = Wire(**{k: float(v) for k, v in zip(MATERIAL_PARAMETERS, own, strict=True)})
    preloads = plain.theta[count * len(rig.materials) :]
    benches = [dataclasses.replace(b, preload_mm=float(p)) for b, p in zip(guess.benches, preloads, strict=True)]
    here = dataclasses.replace(guess, wires=wires, benches=tuple(benches))
    candidates = library(here)
    geo = Geometry(here, plain.model, np.eye(len(y)), np.zeros((len(y), 1)), np.ones(len(y)))
    sizes, curves = delta_curves(geo, candidates, grid=np.array([0.03]))
    sensor = np.concatenate([np.full(b.n_readings, b.sensor_sd**2) for b in guess.benches])[keep]
    residuals, signatures, penalty, chols, bases = [], [], [], [], []
    for setting in SETTING_GRID_MM:
        v = np.diag(sensor) + setting**2 * plain.by_eta[keep] @ plain.by_eta[keep].T
        chol = np.linalg.cholesky(v)
        basis, _ = np.linalg.qr(solve_triangular(chol, plain.by_theta[keep], lower=True))
        z = solve_triangular(chol, (y - plain.model)[keep], lower=True)
        lines = solve_triangular(chol, curves[:, 0][:, keep].T, lower=True).T
        residuals.append(z - basis @ (basis.T @ z))
        signatures.append(lines - (lines @ basis) @ basis.T)
        penalty.append(2 * np.log(np.diag(chol)).sum())
        chols.append(chol)
        bases.append(basis)
    stack = Linear(
        np.array(residuals),
        np.array(signatures),
        np.array(penalty),
        candidates,
        sizes[:, 0],
        np.array(chols),
        np.array(bases),
    )
    setting = float(SETTING_GRID_MM[np.argmin(np.sum(stack.residuals**2, axis=1) + stack.penalty)])
    return stack, _with_setting(guess, setting), _with_setting(here, setting)


def _with_setting(rig: Rig, setting_sd: float) -> Rig:
    benches = tuple(dataclasses.replace(b, setting_sd=setting_sd) for b in rig.benches)
    return dataclasses.replace(rig, benches=benches)


def linear_sizes(linear: Linear, chosen: list[int]) -> Array:
    """Amplitudes (c,) of the chosen candidates by linear least squares, kept on the candidates' own side of zero."""
    place = int(np.argmin(np.sum(linear.residuals**2, axis=1) + linear.penalty))
    factors = np.linalg.lstsq(linear.signatures[place][chosen].T, linear.residuals[place], rcond=None)[0]
    sizes: Array = np.clip(factors, 0.05, 20.0) * linear.sizes[chosen]
    return sizes
