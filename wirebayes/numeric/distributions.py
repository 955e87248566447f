"""Distributions of one number, for priors: those of `scipy.stats` that the catalogue uses, with the same verbs.

The import of `scipy.stats` takes longer than a search among all effects, and a call of its distributions longer than
their arithmetic. What these draw from a generator is what scipy draws, to the last bit. Users may give any frozen
distribution of scipy; `wirebayes.numeric.any_distribution.ours` turns it into one of these where it can.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.special import expit, log_ndtr, logit, ndtr, ndtri, ndtri_exp

from wirebayes.numeric.typing import Array, Function

_HALF_LOG_2PI = 0.5 * float(np.log(2.0 * np.pi))
ONE_SD = np.array([0.15865525393145707, 0.8413447460685429])  # shares of a normal below -1 and 1
_NODES, _WEIGHTS = np.polynomial.hermite_e.hermegauss(64)  # of means over a standard normal number


@dataclass(frozen=True)
class Distribution:
    """A distribution; each kind says how it is drawn, and what its density and quantiles are."""

    def log_density(self) -> Function:
        """A function of an array that returns its log density."""
        raise NotImplementedError

    def cdf(self, x: Any) -> Any:
        """Probability of a value below x."""
        raise NotImplementedError

    def ppf(self, q: Any) -> Any:
        """The value that lies above a share q of the others."""
        raise NotImplementedError

    def rvs(self, size: int | None = None, random_state: Any = None) -> Any:
        """Draws; `random_state` is a numpy Generator, or what makes one."""
        return self.ppf(np.random.default_rng(random_state).uniform(size=size))

    def support(self) -> tuple[float, float]:
        """Its ends."""
        raise NotImplementedError

    def mean(self) -> float:
        """Its mean."""
        raise NotImplementedError

    def std(self) -> float:
        """Its standard deviation."""
        raise NotImplementedError

    def scaled(self, factor: float) -> "Distribution":
        """The distribution of a number `factor` times as large, which is positive."""
        raise NotImplementedError

    def logpdf(self, x: Any) -> Any:
        """Log density."""
        return self.log_density()(np.asarray(x, float))

    def median(self) -> float:
        """What half of the values lie below."""
        return float(self.ppf(0.5))


@dataclass(frozen=True)
class Normal(Distribution):
    """Normal, by mean and standard deviation."""

    centre: float = 0.0
    sd: float = 1.0

    def log_density(self) -> Function:
        centre, sd = self.centre, self.sd
        constant = float(np.log(sd)) + _HALF_LOG_2PI
        return lambda x: -0.5 * ((x - centre) / sd) ** 2 - constant

    def cdf(self, x: Any) -> Any:
        return ndtr((x - self.centre) / self.sd)

    def ppf(self, q: Any) -> Any:
        return ndtri(q) * self.sd + self.centre

    def rvs(self, size: int | None = None, random_state: Any = None) -> Any:
        return np.random.default_rng(random_state).standard_normal(size) * self.sd + self.centre

    def support(self) -> tuple[float, float]:
        return -np.inf, np.inf

    def mean(self) -> float:
        return self.centre

    def std(self) -> float:
        return self.sd

    def scaled(self, factor: float) -> "Normal":
        return Normal(self.centre * factor, self.sd * factor)


@dataclass(frozen=True)
class HalfNormal(Distribution):
    """The upper half of a normal distribution about `least`."""

    sd: float
    least: float = 0.0

    def log_density(self) -> Function:
        least, sd = self.least, self.sd
        constant = 0.5 * float(np.log(2.0 / np.pi)) - float(np.log(sd))
        return lambda x: np.where(x >= least, constant - 0.5 * ((x - least) / sd) ** 2, -np.inf)

    def cdf(self, x: Any) -> Any:
        return np.maximum(2.0 * ndtr((x - self.least) / self.sd) - 1.0, 0.0)

    def ppf(self, q: Any) -> Any:
        return ndtri((1.0 + np.asarray(q)) / 2.0) * self.sd + self.least

    def rvs(self, size: int | None = None, random_state: Any = None) -> Any:
        return np.abs(np.random.default_rng(random_state).standard_normal(size=size)) * self.sd + self.least

    def support(self) -> tuple[float, float]:
        return self.least, np.inf

    def mean(self) -> float:
        return self.least + self.sd * float(np.sqrt(2.0 / np.pi))

    def std(self) -> float:
        return self.sd * float(np.sqrt(1.0 - 2.0 / np.pi))

    def scaled(self, factor: float) -> "HalfNormal":
        return HalfNormal(self.sd * factor, self.least * factor)


@dataclass(frozen=True)
class HalfCauchy(Distribution):
    """The upper half of a Cauchy distribution about zero: half lies below `scale`, and a tail reaches far beyond."""

    scale: float

    def log_density(self) -> Function:
        scale = self.scale
        constant = float(np.log(2.0 / np.pi)) - float(np.log(scale))
        return lambda x: np.where(x >= 0.0, constant - np.log1p((x / scale) ** 2), -np.inf)

    def cdf(self, x: Any) -> Any:
        return 2.0 / np.pi * np.arctan(np.maximum(x, 0.0) / self.scale)

    def ppf(self, q: Any) -> Any:
        q = np.asarray(q, float)
        return np.where(q < 1.0, np.tan(0.5 * np.pi * q) * self.scale, np.inf)

    def support(self) -> tuple[float, float]:
        return 0.0, np.inf

    def mean(self) -> float:
        return np.inf

    def std(self) -> float:
        return np.inf

    def scaled(self, factor: float) -> "HalfCauchy":
        return HalfCauchy(self.scale * factor)


@dataclass(frozen=True)
class TruncatedNormal(Distribution):
    """The part of a normal distribution that lies at `least_sd` standard deviations from its centre, or above."""

    least_sd: float
    centre: float
    sd: float

    def log_density(self) -> Function:
        centre, sd, least = self.centre, self.sd, self.support()[0]
        whole = float(np.log(sd)) + _HALF_LOG_2PI + float(log_ndtr(-self.least_sd))
        return lambda x: np.where(x >= least, -0.5 * ((x - centre) / sd) ** 2 - whole, -np.inf)

    def cdf(self, x: Any) -> Any:
        u = np.maximum((x - self.centre) / self.sd, self.least_sd)
        return -np.expm1(log_ndtr(-u) - log_ndtr(-self.least_sd))

    def ppf(self, q: Any) -> Any:
        q = np.asarray(q, float)
        with np.errstate(divide="ignore"):  # the ends
            if self.least_sd < 0:
                score = ndtri_exp(np.logaddexp(log_ndtr(self.least_sd), np.log(q) + log_ndtr(-self.least_sd)))
            else:
                score = -ndtri_exp(np.log1p(-q) + log_ndtr(-self.least_sd))
        score = np.where(q < 1.0, np.maximum(score, self.least_sd), np.inf)  # rounding may lead beyond
        return score * self.sd + self.centre

    def support(self) -> tuple[float, float]:
        return self.least_sd * self.sd + self.centre, np.inf

    def mean(self) -> float:
        return self.centre + self.sd * self._height

    def std(self) -> float:
        return self.sd * float(np.sqrt(1.0 + self._height * (self.least_sd - self._height)))

    @property
    def _height(self) -> float:
        """Density at the lower end, and the mean, where centre and standard deviation are 0 and 1."""
        return float(np.exp(-0.5 * self.least_sd**2 - _HALF_LOG_2PI - log_ndtr(-self.least_sd)))

    def scaled(self, factor: float) -> "TruncatedNormal":
        return TruncatedNormal(self.least_sd, self.centre * factor, self.sd * factor)


@dataclass(frozen=True)
class LogNormal(Distribution):
    """A positive number whose logarithm is normal, by the standard deviation of that and the median of the number."""

    sd_log: float
    middle: float

    def log_density(self) -> Function:
        return log_normal(self.sd_log, self.middle)

    def cdf(self, x: Any) -> Any:
        with np.errstate(divide="ignore"):  # zero
            return ndtr(np.log(np.maximum(x, 0.0) / self.middle) / self.sd_log)

    def ppf(self, q: Any) -> Any:
        return np.exp(self.sd_log * ndtri(q)) * self.middle

    def rvs(self, size: int | None = None, random_state: Any = None) -> Any:
        return np.exp(self.sd_log * np.random.default_rng(random_state).standard_normal(size)) * self.middle

    def support(self) -> tuple[float, float]:
        return 0.0, np.inf

    def mean(self) -> float:
        return self.middle * float(np.exp(0.5 * self.sd_log**2))

    def std(self) -> float:
        p = float(np.exp(self.sd_log**2))
        return self.middle * float(np.sqrt(p * (p - 1.0)))

    def scaled(self, factor: float) -> "LogNormal":
        return LogNormal(self.sd_log, self.middle * factor)


@dataclass(frozen=True)
class LogitNormal(Distribution):
    """A number up to `most` the logit of whose share of that is normal: log-normal where small, never above."""

    middle: float
    sd: float
    most: float = 1.0

    def log_density(self) -> Function:
        return _logit_normal(self.middle, self.sd, self.most)

    def cdf(self, x: Any) -> Any:
        return ndtr((logit(np.clip(x / self.most, 0.0, 1.0)) - self.middle) / self.sd)

    def ppf(self, q: Any) -> Any:
        return expit(self.middle + self.sd * ndtri(q)) * self.most

    def support(self) -> tuple[float, float]:
        return 0.0, self.most

    def mean(self) -> float:
        return self.most * float(np.average(self._shares, weights=_WEIGHTS))

    def std(self) -> float:
        away = self._shares - self.mean() / self.most
        return self.most * float(np.sqrt(np.average(away**2, weights=_WEIGHTS)))

    @property
    def _shares(self) -> Array:
        return np.asarray(expit(self.middle + self.sd * _NODES))

    def scaled(self, factor: float) -> "LogitNormal":
        return replace(self, most=self.most * factor)


@dataclass(frozen=True)
class Uniform(Distribution):
    """Uniform from `low` on, over `width`."""

    low: float
    width: float

    def log_density(self) -> Function:
        low, high, height = self.low, self.low + self.width, -np.log(self.width)
        return lambda x: np.where((x >= low) & (x <= high), height, -np.inf)

    def cdf(self, x: Any) -> Any:
        return np.clip((x - self.low) / self.width, 0.0, 1.0)

    def ppf(self, q: Any) -> Any:
        return np.asarray(q) * self.width + self.low

    def support(self) -> tuple[float, float]:
        return self.low, self.low + self.width

    def mean(self) -> float:
        return self.low + 0.5 * self.width

    def std(self) -> float:
        return self.width * float(np.sqrt(1.0 / 12.0))

    def scaled(self, factor: float) -> "Uniform":
        return Uniform(self.low * factor, self.width * factor)


@dataclass(frozen=True)
class LogUniform(Distribution):
    """A positive number whose logarithm is uniform."""

    low: float
    high: float

    def log_density(self) -> Function:
        low, high, constant = self.low, self.high, float(np.log(np.log(self.high / self.low)))

        def evaluate(x: Array) -> Array:
            inside = (x >= low) & (x <= high)
            return np.where(inside, -np.log(np.where(inside, x, low)) - constant, -np.inf)

        return evaluate

    def cdf(self, x: Any) -> Any:
        return np.log(np.clip(x, self.low, self.high) / self.low) / np.log(self.high / self.low)

    def ppf(self, q: Any) -> Any:
        low, high = np.log(self.low), np.log(self.high)
        return np.exp(low + np.asarray(q) * (high - low))

    def support(self) -> tuple[float, float]:
        return self.low, self.high

    def mean(self) -> float:
        return float((self.high - self.low) / np.log(self.high / self.low))

    def std(self) -> float:
        square = (self.high**2 - self.low**2) / (2.0 * np.log(self.high / self.low))
        return float(np.sqrt(square - self.mean() ** 2))

    def scaled(self, factor: float) -> "LogUniform":
        return LogUniform(self.low * factor, self.high * factor)


def log_normal(sd_log: Any, median: Any) -> Function:
    """The log density of a log-normal distribution, or of several, a column each."""
    middle = np.log(median)
    constant = np.log(sd_log) + _HALF_LOG_2PI

    def density(log_x: Array) -> Array:
        score = (log_x - middle) / sd_log
        return -0.5 * score**2 - log_x - constant

    def evaluate(x: Array) -> Array:
        inside = x > 0
        if inside.all():
            return density(np.log(x))
        log_x = np.log(np.where(inside, x, 1.0))
        return np.where(inside, density(log_x), -np.inf)

    return evaluate


def _logit_normal(middle: float, sd: float, most: float) -> Function:
    constant = float(np.log(sd)) + _HALF_LOG_2PI + float(np.log(most))

    def evaluate(x: Array) -> Array:
        share = x / most
        inside = (share > 0) & (share < 1)
        u = np.where(inside, share, 0.5)
        log_below, log_above = np.log(u), np.log1p(-u)
        score = (log_below - log_above - middle) / sd
        density = -0.5 * score**2 - log_below - log_above - constant
        return np.where(inside, density, -np.inf)

    return evaluate
