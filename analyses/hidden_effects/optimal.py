"""What the best possible judge could do on a case: groups, separability and the Bayes-optimal naming rate.

The ideal judge knows the noise, the true parameters and every effect's exact finite signature; it does not know the
effect, its sign, size, hold, wire or shape constants. Effects are equally likely, then their candidates, then log
delta.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.special import logsumexp

from .cases import TOGETHER, Case
from .catalogue import EFFECTS, Candidate, library, members
from .delta import Geometry, delta_curves, signature
from .fitting import delta_after_refit
from .generator import simulate
from .optimal_blind import answers
from .optimal_sets import DELTA_RANGE, SEPARABLE, Directions, left_over, optimal_mixed, optimal_names
from .rig import Array, Index, Mask

GROUP_COSINE = 0.95
ALPHA = 0.04


def nearest_direction(curve: Array, delta: float) -> Array:
    """Unit signature of a candidate at the amplitude whose delta is nearest, from its curve (points, R)."""
    size = np.linalg.norm(curve, axis=1)
    best = int(np.argmin(np.abs(np.log(np.maximum(size, 1e-12) / delta))))
    unit: Array = curve[best] / max(float(size[best]), 1e-12)
    return unit


def cosines(z: Array, candidates: list[Candidate], curves: Array) -> dict[str, float]:
    """Largest |cos| of the signature `z` (R,) with any candidate of each effect, by name."""
    delta = float(np.linalg.norm(z))
    found: dict[str, float] = {}
    for candidate, curve in zip(candidates, curves, strict=True):
        cosine = abs(float(nearest_direction(curve, delta) @ z)) / delta
        found[candidate.name] = max(found.get(candidate.name, 0.0), cosine)
    return found


_POINTS = 24  # finite sizes of each effect


def hypotheses(
    geo: Geometry, candidates: list[Candidate], sizes: Array, curves: Array
) -> tuple[Array, Array, list[str], Index]:
    """Points of the ideal judge's prior: finite effects whose delta is log-uniform, up to what the effect can reach.

    Parameters
    ----------
    sizes, curves : amplitudes (c, p) and signatures (c, p, R) of the candidates on a coarse grid.

    Returns
    -------
    signatures (k, R), log prior weights (k,), names in order, index of each point's name (k,).
    """
    rows: list[list[tuple[Candidate, float]]] = []
    for candidate, grid, curve in zip(candidates, sizes, curves, strict=True):
        height = np.linalg.norm(curve, axis=1)
        rising = int(np.argmax(height)) + 1  # beyond its largest delta a curve turns back: not needed
        top = min(DELTA_RANGE[1], float(height[rising - 1]))
        if top > DELTA_RANGE[0]:
            climb = np.maximum.accumulate(np.log(np.maximum(height[:rising], 1e-9)))
            wanted = np.linspace(np.log(DELTA_RANGE[0]), np.log(top), _POINTS)
            rows += [[(candidate, float(a))] for a in np.exp(np.interp(wanted, climb, np.log(grid[:rising])))]
    exact = signature(geo, rows).reshape(-1, _POINTS, curves.shape[2])
    between = 0.5 * (exact[:, 1:] + exact[:, :-1])  # closer together than the noise
    z = np.concatenate([exact, between], axis=1).reshape(-1, curves.shape[2])
    owners = [row[0][0].name for row in rows[::_POINTS]]
    names = list(dict.fromkeys(owners))
    owner = np.repeat([names.index(name) for name in owners], 2 * _POINTS - 1)
    weight = -np.log(np.bincount(owner)[owner])
    return z, weight, names, owner


def posterior(data: Array, points: Array, weight: Array, owner: Index, n_names: int) -> tuple[Array, Array]:
    """Log evidence of each effect against none, (m, names), and the largest likelihood ratio, (m,), of data (m, R)."""
    ratio = data @ points.T - 0.5 * np.sum(points**2, axis=1)
    evidence = np.stack([logsumexp(ratio[:, owner == i] + weight[owner == i], axis=1) for i in range(n_names)], axis=1)
    return evidence, 2 * ratio.max(axis=1)


def ninety_percent_sets(probability: Array) -> Mask:
    """Members of the smallest set holding 90 %, boolean (m, names)."""
    order = np.argsort(-probability, axis=1)
    sorted_p = np.take_along_axis(probability, order, axis=1)
    inside = np.cumsum(sorted_p, axis=1) - sorted_p < 0.9
    chosen = np.zeros_like(inside)
    np.put_along_axis(chosen, order, inside, axis=1)
    return chosen


def judge(case: Case, draws: int = 200) -> dict[str, Any]:
    """Group, separability and, for a catalogue effect, the ideal judge's rates on fresh noise, given its detection."""
    geo = case.geo
    result: dict[str, Any] = {"key": case.spec.key}
    share = [float(np.linalg.norm(geo.whiten(geo.floor)[0, part])) for part in case.rig.bench_slices]
    if case.hidden:
        candidates = library(case.rig, values=4)
        sizes, curves = delta_curves(geo, candidates)
        z = signature(geo, [list(case.hidden)])[0]
        hidden = simulate(case.rig, members=members(case.rig, [list(case.hidden)]))[0]
        result["delta_after_refit"] = delta_after_refit(case.rig, geo.chol, hidden)
        share = [float(np.linalg.norm(z[part])) for part in case.rig.bench_slices]
        parts = [signature(geo, [[one]])[0] for one in case.hidden]
        near = [cosines(part, candidates, curves) for part in parts]
        result["cosines"] = [{k: round(v, 4) for k, v in sorted(c.items(), key=lambda i: -i[1])} for c in near]
        result["groups"] = [
            sorted({name for name, c in each.items() if c > GROUP_COSINE} | {one[0].name})
            for each, one in zip(near, case.hidden, strict=True)
        ]
        others = [c for name, c in near[0].items() if name != case.hidden[0][0].name]
        worst = max(others, default=0.0)
        result["separable"] = bool(np.linalg.norm(z) * np.sqrt(max(1 - worst**2, 0.0)) > SEPARABLE)
    result["bench"] = case.rig.benches[int(np.argmax(share))].name
    if case.spec.kind in (*TOGETHER, "single", "without", "foreign") and case.hidden:
        result |= _with_directions(case, candidates, curves, result["groups"], draws)
    if case.spec.kind in ("single", "without") and case.hidden:
        result["optimal"] = _optimal(case, candidates, sizes, curves, set(result["groups"][0]), draws)
    return result


def _optimal(
    case: Case, candidates: list[Candidate], sizes: Array, curves: Array, group: set[str], draws: int
) -> dict[str, Any]:
    geo, rng = case.geo, np.random.default_rng(int(case.spec.key, 16))
    points, weight, names, owner = hypotheses(geo, candidates, sizes, curves)
    truth = case.hidden[0][0].name
    if truth not in names:
        return {}
    z = signature(geo, [list(case.hidden)])[0]
    noise = rng.normal(size=(2 * draws, len(z)))
    noise = noise - (noise @ geo.basis) @ geo.basis.T
    _, null = posterior(noise[:draws], points, weight, owner, len(names))
    evidence, statistic = posterior(z + noise[draws:], points, weight, owner, len(names))
    seen = statistic > np.quantile(null, 1 - ALPHA)
    if not seen.any():
        return {"power": 0.0}
    p = np.exp(evidence - logsumexp(evidence, axis=1, keepdims=True))[seen]
    best, sets = p.argmax(axis=1), ninety_percent_sets(p)
    target = names.index(truth)
    in_group = np.isin(best, [i for i, name in enumerate(names) if name in group])
    return {
        "power": float(seen.mean()),
        "top1": float(np.mean(best == target)),
        "group": float(np.mean(in_group)),
        "set_size": float(sets.sum(axis=1).mean()),
        "coverage": float(sets[:, target].mean()),
    }


def _with_directions(
    case: Case, candidates: list[Candidate], curves: Array, groups: list[list[str]], draws: int
) -> dict[str, Any]:
    """What judges can do who know the direction of every signature and no amplitude."""
    geo, rng = case.geo, np.random.default_rng(int(case.spec.key, 16))
    names = list(dict.fromkeys(c.name for c in candidates))
    directions = Directions(
        np.array([nearest_direction(curve, case.spec.delta) for curve in curves]),
        np.array([names.index(c.name) for c in candidates]),
        names,
    )
    z = signature(geo, [list(case.hidden)])[0]
    removed = case.spec.names if case.spec.kind == "without" else ()
    few = max(1, draws // 4)  # data sets for the judge who does not know the noise: a tenth of a second each
    known = directions.without(removed)
    said = answers(geo, known, z, rng, few)
    # Names follow a test that sees something: of the judge as of everybody, at the same level.
    seen = said.above(float(np.quantile(answers(geo, known, 0.0 * z, rng, few).odds, 1 - ALPHA)))
    if not seen.names:
        return {"blind": {}} if case.spec.kind not in TOGETHER else {"blind": dict.fromkeys(said.rates(groups), 0.0)}
    if case.spec.kind not in TOGETHER:  # compared where something was seen: small ones are easier to name there
        result: dict[str, Any] = {"blind": seen.rates(groups)}
    else:
        share = len(seen.names) / len(said.names)
        result = {"blind": {what: share * rate for what, rate in seen.rates(groups).items()}}
    if case.spec.kind == "single":
        return result
    if case.spec.kind in ("two", "three", "periodic"):
        number = "three" if case.spec.kind == "three" else "two"
        return result | {f"optimal_{number}": optimal_names(geo, directions, z, groups, rng, draws)}
    if case.spec.kind == "mixed":
        exact = directions
        for one in case.hidden:
            if one[0].name in EFFECTS:
                exact = exact.with_exact(one[0].name, signature(geo, [[one]])[0])
        mixed = optimal_mixed(geo, directions, z, groups[0], rng, draws)
        return result | {"optimal_mixed": mixed, "left_over": left_over(geo, exact, z, 3)}
    return result | {"left_over": left_over(geo, directions.without(removed), z, 2)}
