"""Gross errors: a reading may be wrong by far more than the sensor's error (a slip of the pen, a touched bench).

Each reading is contaminated with probability ``gross_share``; then its error is as large as the tensions themselves. A
contaminated hold cannot be told reading by reading, because the hold's setting error moves them all: so every pattern
of contaminated readings, up to two in a hold, gets its own Gaussian, in which setting error and carried creep are
integrated exactly, and the patterns are summed. What a hold leaves to the next is the mean and variance of the sum.
"""

from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from scipy.special import logsumexp

from wirebayes.errors import InputError
from wirebayes.model.likelihoods import Filtered
from wirebayes.model.prior import Prior
from wirebayes.model.problem import Problem, Sample
from wirebayes.wire.staircase import Linearised

Array = NDArray[Any]
SHARE = "gross_share"
MOST = 2
_LOG_2PI = float(np.log(2.0 * np.pi))


@dataclass(frozen=True)
class GrossProblem(Problem):
    """A chain problem with one more parameter a sample, ``gross_share``; make it with `with_gross_errors`."""

    def parameters(self, theta: Array, sample: Sample) -> dict[str, Array]:
        """As `Problem.parameters`, with the sample's share of contaminated readings."""
        own = super().parameters(theta, sample)
        name = f"{SHARE}[{sample.name}]" if len(self.samples) > 1 else SHARE
        return own | {SHARE: np.ascontiguousarray(theta[:, self.names.index(name)])}

    def hold_log_likelihood(self, theta: Array, readings: Any = None) -> list[Array]:
        """As `Problem.hold_log_likelihood`, each hold's summed over the patterns of contaminated readings."""
        out = []
        for i, sample in enumerate(self.samples):
            own = self.parameters(theta, sample)
            line, variance, setting_sd = self.linearised(theta, sample)
            y = sample.readings if readings is None else readings[i]
            wide = np.full_like(variance, gross_sd_N(sample) ** 2)
            out.append(chain(line, y, sample.protocol.mask, variance, setting_sd, own[SHARE], wide).log_likelihood)
        return out

    def leave_one_hold_out(self, theta: Array) -> list[Array]:
        """Not known for contaminated readings."""
        raise NotImplementedError("leaving a hold out is not defined with gross errors: refit without the hold")


def with_gross_errors(problem: Problem, share: Any = None) -> GrossProblem:
    """The same problem with contaminated readings.

    Parameters
    ----------
    problem : Problem
        With the chain likelihood.
    share : scipy frozen distribution, optional
        Prior of the share of contaminated readings; Beta(1, 30) when not given, which expects one in thirty.

    Raises
    ------
    InputError
        For the likelihood hold by hold, which takes each first reading at its word.
    """
    if problem.likelihood != "chain":
        raise InputError("gross errors: hold by hold takes each first reading at its word; use the chain likelihood")
    names = [f"{SHARE}[{s.name}]" for s in problem.samples] if len(problem.samples) > 1 else [SHARE]
    share = stats.beta(1.0, 30.0) if share is None else share
    distributions = problem.prior.distributions | dict.fromkeys(names, share)
    prior = Prior(distributions, problem.prior.fixed, problem.prior.logarithmic)
    return GrossProblem(problem.samples, prior, problem.likelihood)


def gross_sd_N(sample: Sample) -> float:
    """Size of a gross error: the geometric mean of the sample's tensions."""
    return sample.model.tension_ref_N


def patterns(readings: int, most: int = MOST) -> NDArray[np.bool_]:
    """(K, R) every choice of up to `most` contaminated readings, none first."""
    chosen = [c for k in range(min(most, readings) + 1) for c in combinations(range(readings), k)]
    out = np.zeros((len(chosen), readings), bool)
    for row, c in zip(out, chosen, strict=True):
        row[list(c)] = True
    return out


def chain(
    line: Linearised,
    readings: Array,
    mask: NDArray[np.bool_],
    variance: Array,
    setting_sd: Array,
    share: Array,
    wide: Array,
) -> Filtered:
    """`noise.chain` with contaminated readings; `share` (n,) of them, whose variance is larger by `wide` (n,)."""
    holds, _, n = line.tension.shape
    out = np.zeros((holds, n))
    mean, var = np.zeros((holds + 1, n)), np.zeros((holds + 1, n))
    setting_var = setting_sd * setting_sd
    for j in range(holds):
        m, p = mean[j], var[j]
        a, c = line.carry_by_creep[j], line.carry_by_setting[j]
        if not mask[j].any():
            mean[j + 1], var[j + 1] = a * m, a * a * p + c * c * setting_var
            continue
        keep = mask[j]
        by_c, by_s = line.by_creep[j][keep], line.by_setting[j][keep]
        r = readings[j][keep] - line.tension[j][keep] - by_c * m
        log_weight, cc, cs, ss, cr, sr, rr = _sums(by_c, by_s, r, share, variance, wide)
        det = 1.0 + p * cc + setting_var * ss + p * setting_var * np.maximum(cc * ss - cs * cs, 0.0)
        v_cc = p * (1.0 + setting_var * ss) / det
        v_ss = setting_var * (1.0 + p * cc) / det
        v_cs = -p * setting_var * cs / det
        post_c, post_s = v_cc * cr + v_cs * sr, v_cs * cr + v_ss * sr
        # squares are never negative, however rounding treats their difference
        each = log_weight - 0.5 * (np.maximum(rr - cr * post_c - sr * post_s, 0.0) + np.log(det))
        out[j] = logsumexp(each, axis=0)
        weight = np.exp(each - out[j])
        carried = a * (m + post_c) + c * post_s
        mean[j + 1] = (weight * carried).sum(axis=0)
        within = a * a * v_cc + 2.0 * a * c * v_cs + c * c * v_ss
        var[j + 1] = (weight * (within + (carried - mean[j + 1]) ** 2)).sum(axis=0)
    return Filtered(out, mean, var)


def _sums(by_c: Array, by_s: Array, r: Array, share: Array, variance: Array, wide: Array) -> tuple[Array, ...]:
    """For every pattern (K, n): log of its probability and normalisation, and the weighted sums of products."""
    bad = patterns(len(r)).astype(float)
    count = bad.sum(axis=1)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        # a share of zero leaves the pattern without errors alone
        log_odds = np.log(share) - np.log1p(-share)
        probability = np.where(count > 0, count * log_odds, 0.0)
    probability = probability - logsumexp(probability, axis=0)
    good, poor = 1.0 / variance, 1.0 / (variance + wide)
    scale = count * np.log(variance + wide) + (len(r) - count) * np.log(variance) + len(r) * _LOG_2PI

    def total(x: Array) -> Array:
        among_bad = bad @ x
        return np.asarray(good * (x.sum(axis=0) - among_bad) + poor * among_bad)

    sums = [total(x) for x in (by_c * by_c, by_c * by_s, by_s * by_s, by_c * r, by_s * r, r * r)]
    return probability - 0.5 * scale, *sums


def suspects(problem: GrossProblem, theta: Array) -> list[Array]:
    """Per sample the (H, R) probability that each reading is contaminated, given the hold's readings and those before,
    averaged over the draws `theta` (n, d); zero where there is no reading."""
    out = []
    for sample in problem.samples:
        own = problem.parameters(theta, sample)
        line, variance, setting_sd = problem.linearised(theta, sample)
        wide = np.full_like(variance, gross_sd_N(sample) ** 2)
        mask, share = sample.protocol.mask, own[SHARE]
        filtered = chain(line, sample.readings, mask, variance, setting_sd, share, wide)
        probability = np.zeros(mask.shape)
        for j in np.flatnonzero(mask.any(axis=1)):
            keep = mask[j]
            by_c, by_s = line.by_creep[j][keep], line.by_setting[j][keep]
            r = sample.readings[j][keep] - line.tension[j][keep] - by_c * filtered.carried_mean[j]
            log_weight, cc, cs, ss, cr, sr, rr = _sums(by_c, by_s, r, share, variance, wide)
            p, q = filtered.carried_var[j], setting_sd**2
            det = 1.0 + p * cc + q * ss + p * q * np.maximum(cc * ss - cs * cs, 0.0)
            gain = (p * (1.0 + q * ss) * cr**2 - 2.0 * p * q * cs * cr * sr + q * (1.0 + p * cc) * sr**2) / det
            each = log_weight - 0.5 * (np.maximum(rr - gain, 0.0) + np.log(det))
            weight = np.exp(each - logsumexp(each, axis=0)).mean(axis=1)
            probability[j, keep] = weight @ patterns(int(keep.sum()))
        out.append(probability)
    return out
