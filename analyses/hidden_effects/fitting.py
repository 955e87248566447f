"""Least squares with the judge's own model: the oracle, and what the baselines start from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from .catalogue import Candidate, effect, largest, members
from .delta import covariance
from .generator import simulate
from .rig import MATERIAL_PARAMETERS, Array, Mask, Rig

LOG_PRIOR_SD = 1.5  # of the positive parameters about the truth: keeps directions without data from running away
PRELOAD_PRIOR_SD = 2.0  # mm


@dataclass(frozen=True)
class Fit:
    """A fit to some of the readings.

    Attributes
    ----------
    theta : plain parameters, (d,).
    sizes : amplitudes of the candidates, (c,).
    prediction : mean of every reading given the readings fitted, (R,) in N: their errors are carried along.
    model : the model's own readings, (R,) in N.
    by_theta, by_eta : derivatives at the fit, (R, d) in scaled parameters and (R, H).
    v : covariance of all readings, (R, R).
    """

    theta: Array
    sizes: Array
    prediction: Array
    model: Array
    by_theta: Array
    by_eta: Array
    v: Array


def _unpack(rig: Rig, phi: Array, scales: Array) -> tuple[Array, Array]:
    n = len(rig.materials) * len(MATERIAL_PARAMETERS)
    d = len(rig.theta)
    theta = np.concatenate([np.exp(np.clip(phi[:, :n], -25, 25)), phi[:, n:d]], axis=1)
    return theta, phi[:, d:] * scales


def fit(
    rig: Rig,
    y: Array,
    keep: Mask,
    candidates: tuple[Candidate, ...] = (),
    sizes: Array | None = None,
    rounds: int = 8,
    size_prior_sd: float = 100.0,
) -> Fit:
    """Gauss-Newton with step halving, from the truth, under the true covariance of `rig`.

    Parameters
    ----------
    y : measured readings (N), (R,); keep : which of them may be used, boolean (R,).
    candidates : effects whose amplitudes are fitted too, started at `sizes` (c,).
    size_prior_sd : of an amplitude about its start, in units of it.
    """
    n, d, h = len(rig.materials) * len(MATERIAL_PARAMETERS), len(rig.theta), rig.n_holds
    scales = np.ones(len(candidates)) if sizes is None else np.maximum(np.asarray(sizes, dtype=float), 1e-12)
    phi = np.concatenate([np.log(rig.theta[:n]), rig.theta[n:], np.ones(len(candidates))])
    centre = phi.copy()
    sds = [np.full(n, LOG_PRIOR_SD), np.full(d - n, PRELOAD_PRIOR_SD), np.full(len(candidates), size_prior_sd)]
    weight = np.concatenate(sds) ** -2.0

    def run(rows: Array, eta: Array | None = None) -> Array:
        theta, size = _unpack(rig, rows, scales)
        active = [[(c, float(a)) for c, a in zip(candidates, line, strict=True)] for line in size]
        return simulate(rig, theta, members(rig, active) if candidates else None, eta)

    plain = simulate(rig)[0]
    caps = np.array([largest(rig, c, plain) for c in candidates]) / scales
    floors = np.array([-1.0 if len(effect(c.name).signs) > 1 else 0.0 for c in candidates]) * caps
    steps = np.full(len(phi), 1e-4)
    for _ in range(rounds):
        rows = np.tile(phi, (1 + 2 * (len(phi) + h), 1))
        eta = np.zeros((len(rows), h))
        for i in range(len(phi)):
            rows[1 + 2 * i, i] += steps[i]
            rows[2 + 2 * i, i] -= steps[i]
        for i in range(h):
            eta[1 + 2 * (len(phi) + i), i], eta[2 + 2 * (len(phi) + i), i] = 1e-3, -1e-3
        out = run(rows, eta)
        jacobian = (out[1::2] - out[2::2]).T / (2 * np.concatenate([steps, np.full(h, 1e-3)]))
        by_theta, by_eta = jacobian[:, : len(phi)], jacobian[:, len(phi) :]
        v = covariance(rig, by_eta)
        factor = cho_factor(v[np.ix_(keep, keep)], lower=True)
        residual = y[keep] - out[0][keep]
        a = by_theta[keep]
        hessian = a.T @ cho_solve(factor, a) + np.diag(weight)
        step = np.linalg.solve(hessian, a.T @ cho_solve(factor, residual) - weight * (phi - centre))
        step = step / max(1.0, float(np.max(np.abs(step))))
        trial = phi + 2.0 ** -np.arange(0, 8)[:, None] * step
        trial = np.concatenate([phi[None], trial])
        trial[:, d:] = np.clip(trial[:, d:], floors, caps)
        r = y[keep] - run(trial)[:, keep]
        objective = np.sum(r * cho_solve(factor, r.T).T, axis=1) + np.sum(weight * (trial - centre) ** 2, axis=1)
        best = int(np.nanargmin(objective))
        phi = trial[best]
        if best == 0 or objective[0] - objective[best] < 1e-3:
            break
    theta, size = _unpack(rig, phi[None], scales)
    model = run(phi[None])[0]
    errors = cho_solve(factor, y[keep] - model[keep])
    return Fit(theta[0], size[0], model + v[:, keep] @ errors * ~keep, model, by_theta, by_eta, v)


def delta_after_refit(rig: Rig, chol: Array, y: Array) -> float:
    """Like delta, but with the plain model refitted to the noise-free readings `y` (R,), not only linearly.

    Where it is far below delta, the plain model bends to take the effect in, and no program can find it at that delta.
    """
    best = fit(rig, y, np.ones(len(y), dtype=bool), rounds=25)
    return float(np.linalg.norm(solve_triangular(chol, y - best.model, lower=True)))


def held_out_mask(rig: Rig, holds: dict[str, list[int]]) -> Mask:
    """Which readings belong to the given hold numbers of the given benches, boolean (R,)."""
    parts = []
    for bench in rig.benches:
        numbers = np.array([hold.number for hold in bench.holds])[bench.hold_of_reading]
        parts.append(np.isin(numbers, holds.get(bench.name, [])))
    return np.concatenate(parts)


def last_third(rig: Rig) -> dict[str, list[int]]:
    """Numbers of the last third of the recorded holds of each bench, at least two."""
    result = {}
    for bench in rig.benches:
        numbers = [hold.number for hold in bench.holds if hold.times_s]
        result[bench.name] = numbers[-max(2, round(len(numbers) / 3)) :]
    return result


def rmse(y: Array, prediction: Array, mask: Mask) -> float:
    """Root mean square error (N) over the chosen readings."""
    return float(np.sqrt(np.mean((y[mask] - prediction[mask]) ** 2)))


def oracle(rig: Rig, y: Array, hidden: tuple[tuple[Candidate, float], ...], held: Mask, bench: str) -> dict[str, float]:
    """Held-out rmse (N) of plain and true form, fitted to the other readings, and the noise floor, on one bench."""
    names = np.concatenate([np.full(b.n_readings, b.name == bench) for b in rig.benches])
    chosen = held & names
    plain = fit(rig, y, ~held)
    result = {"plain": rmse(y, plain.prediction, chosen)}
    true = plain
    if hidden:
        sizes = np.array([a for _, a in hidden])
        # the oracle knows the order of the size too: where the rest does not show the effect, least squares runs wild
        true = fit(rig, y, ~held, tuple(c for c, _ in hidden), sizes, size_prior_sd=1.0)
    result["oracle"] = rmse(y, true.prediction, chosen)
    result["floor"] = float(np.sqrt(np.mean(np.diag(true.v)[chosen])))
    return result
