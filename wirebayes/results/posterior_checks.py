"""Posteriors that no sound test gives: checks after a fit, each a sentence with what to change.

Before the fit `wirebayes.io.data_checks` looks at the readings alone.
"""

from collections.abc import Iterable, Mapping

import numpy as np

from wirebayes.effects.unknown import Discrepancy
from wirebayes.inference.fit import Fit
from wirebayes.io import data_checks
from wirebayes.io.checked_test import CheckedTest
from wirebayes.io.slack_by_preload import slack_by_preload
from wirebayes.io.zero_shifts import slack_below
from wirebayes.model.build import FINEST
from wirebayes.model.problem import Problem
from wirebayes.model.sample import LENGTH_EXPONENT, Sample
from wirebayes.numeric.typing import Floats
from wirebayes.result_warnings import Notice
from wirebayes.results.prior_influence import leaning
from wirebayes.sentences import short, some_of
from wirebayes.wire.control import READ_UNIT, SET_UNIT
from wirebayes.wire.staircase import linearise

LOOSE_STEPS = 0.25  # setting error over the typical step: its prior has 1 % beyond, and nobody sets so carelessly
NOISY = 0.25  # sensor error over the range of the tensions: half their spread is noise
QUIET = 2 * FINEST  # sensor and rounding error over the largest tension: finer than a load cell resolves
FAR_OUT = 3.7  # standard deviations from the middle of k1's prior: one line in five thousand, a factor of 260 off
# decades of time between a tenth of the creep and nine tenths: from a second to three hours, which no hold shows
ENDLESS = 4.0
_FEW = 500  # draws are enough for a share of them
_TENTH, _NINE_TENTHS = np.log(10.0 / 9.0), np.log(10.0)  # of the creep is reached at this hazard k2 t^N
_CENTURY_S = 100 * 365.25 * 86400  # beyond it seconds say nothing
_DECADES_TIMES_N = float(np.log10(_NINE_TENTHS / _TENTH))
NEAR, OFTEN = 2.0, 0.1  # setting errors from slack, and the share of draws in which a taut hold comes so near it
APART = 0.01  # share of the draws of an exponent of the length that lie on both sides of what a strain has, together
LEAST_SHRINKAGE = 0.1  # share by which the widest-moved parameter's interval shrank; below it the prior is returned


def posterior_warnings(fit: Fit, sample: Sample) -> list[Notice]:
    """What is suspicious about the readings of one sample and about what was fitted to them.

    Parameters
    ----------
    sample : Sample
        One of the fit's.

    Returns
    -------
    list of Notice
        What, where, what to change.
    """
    problem = fit.problem
    own = problem.parameters(fit.flat, sample)
    drawn = problem.prior.rvs(4000, np.random.default_rng(0))
    prior = problem.parameters(drawn, sample)
    of_prior = leaning(problem.prior, fit.flat, _columns_of(problem, sample))
    return [*_of_readings(problem, sample), *of_posterior(own, prior, sample), *of_prior]


def _of_readings(problem: Problem, sample: Sample) -> list[Notice]:
    """What is suspicious about the readings of one sample, given what is stated of its preload and stiffness."""
    protocol = sample.protocol
    readings = sample.readings[..., 0]
    found = data_checks.warnings(protocol, readings, sample.resolution)
    if problem.likelihood != "chain":
        return found
    preload_mm = problem.prior.fixed.get(problem.column("preload", sample))
    of_preload = slack_by_preload(protocol, readings, sample.resolution, preload_mm)
    stated = {name for name in ("k1", "preload") if problem.column(name, sample) in problem.stated}
    return [*of_preload, *found, *data_checks.one_setting(protocol, stated)]


def copied_samples(samples: Iterable[Sample]) -> dict[str, list[Notice]]:
    """What is said of each of several samples, by name, that has the readings of an earlier one."""
    tests = {}
    for sample in samples:
        tests[sample.name] = CheckedTest(sample.protocol, sample.readings[..., 0], sample.resolution)
    return data_checks.copied_tests(tests)


def of_lengths(problem: Problem, theta: Floats) -> list[Notice]:
    """What one sample of each length cannot show: whether creep follows the length, or the samples differ.

    Parameters
    ----------
    theta : (n, d) array
        Draws of the posterior, in the problem's columns.
    """
    lengths = [sample.protocol.length_mm for sample in problem.samples]
    if LENGTH_EXPONENT not in problem.names or len(set(lengths)) < len(lengths):
        return []
    exponent = theta[:, problem.names.index(LENGTH_EXPONENT)]
    least, low, middle, high, most = np.quantile(exponent, [0.5 * APART, 0.05, 0.5, 0.95, 1.0 - 0.5 * APART])
    if least <= 1.0 <= most:
        return []
    times = (max(lengths) / min(lengths)) ** (middle - 1.0)
    power = f"{short(middle, 2)} [{short(low, 2)}, {short(high, 2)}]"
    return [
        Notice(
            "extrapolation",
            f"creep grows as the length to the power {power}, by one sample of each length: if instead the longest "
            f"sample creeps {short(times, 2)} times as much as the shortest at any length, the readings look the same, "
            "and creep computed for other lengths is wrong; test two samples of one length",
        )
    ]


def _columns_of(problem: Problem, sample: Sample) -> list[str]:
    """The columns of a sample of which somebody may know something to state."""
    control = sample.protocol.control
    is_first = sample is problem.samples[0]
    first_read_so = next(other for other in problem.samples if other.protocol.control == control)
    columns = []
    for name in problem.names:
        is_latent = name.startswith(f"{Discrepancy.name}.")  # values of a smooth curve
        is_open = not is_latent and name not in problem.told
        if is_open and _belongs(name, sample, shared=is_first, of_instrument=sample is first_read_so):
            columns.append(name)
    return columns


def _belongs(name: str, sample: Sample, *, shared: bool, of_instrument: bool) -> bool:
    """Whether a column is the sample's own, or one that it shares, which is said once."""
    mark = name.partition("[")[2].rstrip("]")
    if mark in ("", sample.material):
        return shared
    return mark == sample.name or (mark == sample.protocol.control and of_instrument)


def of_posterior(own: Mapping[str, Floats], prior: Mapping[str, Floats], sample: Sample) -> list[Notice]:
    """What is suspicious about the parameters of one sample.

    Parameters
    ----------
    own, prior : mapping of name to (n,) array
        Draws of its posterior and of its prior.
    """
    found = [
        ("slack", slackening(own, sample)),
        ("data", loose_steps(own, sample)),
        ("data", noise(own, sample)),
        ("prior", unlikely_stiffness(own, prior)),
        ("prior", endless(own, prior)),
        ("prior", unchanged_prior(own, prior)),
    ]
    return [Notice(kind, sentence) for kind, sentence in found if sentence]


def loose_steps(own: Mapping[str, Floats], sample: Sample) -> str:
    """A setting error of the size of the steps, which is what mixed or contradictory readings look like."""
    steps = np.abs(np.diff(sample.protocol.setting))
    if "setting_sd" not in own or not steps.any():
        return ""
    step = float(np.median(steps[steps > 0]))
    low = float(np.quantile(own["setting_sd"], 0.05))
    if low <= LOOSE_STEPS * step:
        return ""
    unit = SET_UNIT[sample.protocol.control]
    settings, read = ("weights", "displacements") if unit == "N" else ("displacements", "tensions")
    return (
        f"setting_sd is at least {short(low, 2)} {unit} while the test steps by {short(step, 3)} {unit}: the "
        f"{settings} do not explain the {read}; look for holds in the wrong order, rests that are not stated, "
        "readings of two wires mixed, or another unit"
    )


def slackening(own: Mapping[str, Floats], sample: Sample) -> str:
    """Holds that begin taut and that creep may leave slack: a setting error decides when, which no likelihood knows."""
    protocol = sample.protocol
    if "setting_sd" not in own or protocol.control == "force":
        return ""
    share = _share_that_slackens(own, sample)
    readings = sample.readings[..., 0]
    lowest = np.where(protocol.mask, readings, np.inf).min(axis=1)
    test = CheckedTest(protocol, readings, sample.resolution)
    near = (share > OFTEN) & (lowest > slack_below(test))
    if not near.any():
        return ""
    holds = some_of([str(number) for number in protocol.number[near]])
    plural = "s" if near.sum() > 1 else ""
    percent = 100 * share[near].max()
    return (
        f"in hold{plural} {holds} the wire begins taut and creeps to within {NEAR:g} setting errors of being slack "
        f"({percent:.0f} % of the draws): when it goes slack depends on that error, as the likelihood does not know, "
        "and intervals may be too narrow; test it where it stays taut"
    )


def _share_that_slackens(own: Mapping[str, Floats], sample: Sample) -> Floats:
    """(H,) share of the draws by which a hold begins taut and does not stay so, but for `NEAR` setting errors."""
    few = {name: draws[:: 1 + len(draws) // _FEW] for name, draws in own.items()}
    mask = sample.protocol.mask
    with np.errstate(all="ignore"):
        line = linearise(sample.protocol, few, sample.model)
        taut = line.reading > NEAR * few["setting_sd"] * line.by_setting
    first = np.argmax(mask, axis=1)
    begins = taut[np.arange(len(mask)), first]
    stays = (taut | ~mask[..., None]).all(axis=1)
    return (begins & ~stays).mean(axis=1)


def noise(own: Mapping[str, Floats], sample: Sample) -> str:
    """A sensor error as large as the signal, or none at all."""
    readings = sample.readings[..., 0][sample.protocol.mask]
    signal = float(np.ptp(readings))
    low, high = np.quantile(own["sensor_sd"], [0.05, 0.95])
    unit = READ_UNIT[sample.protocol.control]
    if signal > 0 and low > NOISY * signal:
        return (
            f"sensor_sd is at least {short(low, 2)} {unit} while the readings differ by {short(signal, 3)} {unit} in "
            "all: no wire of this model gives them; look for a misprint among them, mixed-up rows, or another unit"
        )
    largest = signal if unit == "mm" else np.abs(readings).max()  # where displacements begin means nothing
    if max(high, sample.resolution) < QUIET * largest:
        return (
            f"the readings carry no noise (sensor_sd below {short(high, 1)} {unit}): they were computed or smoothed, "
            f"and the intervals are far narrower than a bench's; state resolution_{unit}, and fit what the sensor wrote"
        )
    return ""


def unlikely_stiffness(own: Mapping[str, Floats], prior: Mapping[str, Floats]) -> str:
    """A stiffness that the prior all but excludes."""
    if "k1" not in own:
        return ""
    middle = float(np.median(own["k1"]))
    logs = np.log(prior["k1"])
    spread = float(logs.std())
    if not spread:
        return ""
    away = abs(np.log(middle) - np.median(logs))
    if away <= FAR_OUT * spread:
        return ""
    low, high = np.quantile(prior["k1"], [0.05, 0.95])
    return (
        f"k1 = {short(middle, 3)} N is far outside its prior ({short(low, 3)} to {short(high, 3)} N, from the "
        "tensions and strains of the test): check displacement_mm and length_mm, and whether the wire was taut; if "
        "they are right, give this wire a prior of its own ([prior.k1])"
    )


def endless(own: Mapping[str, Floats], prior: Mapping[str, Floats]) -> str:
    """Creep over more decades of time than a test can follow, as a power law or a logarithm of time asks for."""
    if "N" not in own or not np.ptp(prior["N"]):
        return ""
    exponent = float(np.median(own["N"]))
    if _DECADES_TIMES_N / exponent <= ENDLESS:
        return ""
    # in logarithms: at a small N the times themselves overflow
    begins, ends = (np.median(np.log(hazard / own["k2"]) / own["N"]) for hazard in (_TENTH, _NINE_TENTHS))
    return (
        "the readings want creep spread over many decades of time, as a power law or the logarithm of time has it: at "
        f"N = {exponent:.2g} a tenth is reached after {_time(begins)} and nine tenths after {_time(ends)}; "
        "shown is the stretched exponential nearest to it, good for the times that were read: the stiffness before the "
        "first reading, creep long after the last and final creep are extrapolated"
    )


def _time(log_s: float) -> str:
    """Seconds, by their logarithm, in words."""
    return "more than a century" if log_s > np.log(_CENTURY_S) else f"{short(float(np.exp(log_s)), 1)} s"


def unchanged_prior(own: Mapping[str, Floats], prior: Mapping[str, Floats]) -> str:
    """Readings that leave every interval as the prior has it."""
    moved = []
    for name, values in own.items():
        before = _width(prior[name])
        if name != "sensor_sd" and before > 0:
            moved.append(1.0 - _width(values) / before)
    if not moved or max(moved) > LEAST_SHRINKAGE:
        return ""
    return "the posterior is the prior: these readings say nothing of the wire; was it slack, or held at one place?"


def _width(values: Floats) -> float:
    """Length of the 90 % interval."""
    high, low = np.quantile(values, [0.95, 0.05])
    return float(high - low)
