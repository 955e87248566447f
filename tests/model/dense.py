"""The likelihood as one dense normal, every reading differentiated by every setting error through all holds."""

import numpy as np
from scipy import stats

from wirebayes.wire.staircase import simulate


def columns(theta):
    return {name: np.array([float(value)]) for name, value in theta.items()}


def jacobian(protocol, theta, model):
    """(H, R) readings and (H, R, H) derivatives by a complex step through everything that follows a setting error."""
    holds, step = len(protocol.setting), 1e-30
    clean = simulate(protocol, columns(theta), model)[..., 0]
    out = np.zeros((*clean.shape, holds))
    for j in range(holds):
        setting = np.zeros((holds, 1), complex)
        setting[j] = 1j * step
        out[..., j] = simulate(protocol, columns(theta), model, setting)[..., 0].imag / step
    return clean, out


def normal(protocol, theta, model, readings, resolution=0.0):
    """Residuals (m,), covariance (m, m), and the hold of each reading (m,)."""
    clean, jac = jacobian(protocol, theta, model)
    mask = protocol.mask
    r, k = (readings - clean)[mask], jac[mask] * theta["setting_sd"]
    variance = theta["sensor_sd"] ** 2 + resolution**2 / 12.0
    hold = np.broadcast_to(np.arange(mask.shape[0])[:, None], mask.shape)[mask]
    return r, variance * np.eye(len(r)) + k @ k.T, hold


def log_density(r, covariance):
    return float(stats.multivariate_normal(np.zeros(len(r)), covariance, allow_singular=False).logpdf(r))


def conditional(r, covariance, own):
    """log p(r[own] | the others)."""
    rest = ~own
    return log_density(r, covariance) - (log_density(r[rest], covariance[np.ix_(rest, rest)]) if rest.any() else 0.0)


def given(covariance, past):
    """What others are expected to be by unit of what is known, (others, past), and the covariance that is left."""
    gain = covariance[np.ix_(~past, past)] @ np.linalg.inv(covariance[np.ix_(past, past)])
    return gain, covariance[np.ix_(~past, ~past)] - gain @ covariance[np.ix_(past, ~past)]


def information(normal_at, d, step=1e-5):
    """(d, d) expected information of d parameters; `normal_at` moves (d,) gives residuals and covariance there."""
    moves = step * np.eye(d)
    pairs = [(normal_at(move), normal_at(-move)) for move in moves]
    slopes = [[(one - other) / (2.0 * step) for one, other in zip(*pair, strict=True)] for pair in pairs]
    inverse = np.linalg.inv(normal_at(np.zeros(d))[1])
    return np.array(
        [[r @ inverse @ other + 0.5 * np.trace(inverse @ v @ inverse @ w) for other, w in slopes] for r, v in slopes]
    )


def relative_spectrum(found, expected):
    """Eigenvalues of one positive matrix in units of another."""
    root = np.linalg.cholesky(expected)
    return np.linalg.eigvalsh(np.linalg.solve(root, np.linalg.solve(root, found).T))
