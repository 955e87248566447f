"""What an effect explains of the smooth remainder: its log Bayes factor with the remainder in the model, linearised."""

import numpy as np
from scipy.special import logsumexp

from wirebayes.discovery.linear_scan import ABSORBED, RATIOS, SIZES, Expansion
from wirebayes.discovery.tangent import damp
from wirebayes.numeric.linear_algebra import eigh, solve
from wirebayes.numeric.typing import Array


def beside_smooth(x: Expansion) -> Array:
    """(m,) log Bayes factor of each signature of the first row with the smooth remainder in the model.

    It is taken at the best amplitude, whose prior is not in it (`wirebayes.discovery.refit.occam`); sizes of the
    remainder and noise ratios are summed over as in `wirebayes.discovery.linear_scan.scan`.
    """
    p, m = x.parameters.shape[2], x.signatures.shape[2]
    columns = np.concatenate([x.parameters[0], x.signatures[0], x.residual[0][:, None], x.flexible[0]], axis=1)
    if not (np.abs(columns) < 1e100).all():
        return np.full(m, -np.inf)
    levels, whole = x.left[0].T @ columns, columns.T @ columns
    square = np.diagonal(whole)[p : p + m]
    least, degrees = float(x.least[0]), x.degrees
    without, beside = [], []
    for ratio in RATIOS:
        gram = whole - levels.T @ (damp(x.singular[0], ratio)[:, None] * levels)
        inner = gram[:p, :p] + x.prior_precision[0]
        side = gram[:p, p:].copy()
        side[:, m] += x.prior_gradient[0]
        solved = solve(inner[None], side[None])[0]
        if not np.isfinite(solved).all():
            continue
        left = gram[p:, p:] - side.T @ solved
        left[m, m] += float(x.prior_square[0])
        shared = -0.5 * (np.log1p(ratio * x.singular[0] ** 2).sum() + np.linalg.slogdet(inner)[1])
        values, vectors = (v[0] for v in eigh(left[m + 1 :, m + 1 :][None]))
        values = np.maximum(values, 0.0)
        turned = vectors.T @ left[m + 1 :, : m + 1]
        for size in SIZES:
            s2 = size**2 / max(float(values.sum()), 1e-300)
            taken = (s2 / (1.0 + s2 * values))[:, None] * turned
            rss = max(left[m, m] - turned[:, m] @ taken[:, m], least)
            b = left[:m, m] - turned[:, :m].T @ taken[:, m]
            c = np.diagonal(left)[:m] - (turned[:, :m] * taken[:, :m]).sum(axis=0)
            b = np.where(x.one_sided, np.maximum(b, 0.0), b)
            gain = np.where(c > ABSORBED * square, b**2 / np.where(c > 0, c, np.inf), 0.0)
            base = shared - 0.5 * np.log1p(s2 * values).sum()
            without.append(base - 0.5 * degrees * np.log(rss))
            beside.append(base - 0.5 * degrees * np.log(np.maximum(rss - gain, least)))
    if not without:
        return np.full(m, -np.inf)
    return np.asarray(logsumexp(beside, axis=0) - logsumexp(without))
