"""What to measure next: the plan in which two explanations differ most, or one effect or the remainder stands out."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wirebayes.discovery.linear_scan import expand
from wirebayes.discovery.noise_integral import projected
from wirebayes.discovery.probes import Probe
from wirebayes.inference.laplace_fit import LaplaceFit
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.model.problem import Problem, with_protocols
from wirebayes.model.sample import LENGTH_EXPONENT, Sample
from wirebayes.model.scales import NATURAL, Units
from wirebayes.numeric.typing import Array
from wirebayes.sentences import short, spoken, to_be_held
from wirebayes.wire.control import SET_UNIT
from wirebayes.wire.protocol import Control, Protocol

_WORTH = 1.1  # times as far apart as now, for a measurement to be proposed
_RATIO_LIMIT = 1e3  # times: beyond, what it is compared with is nothing, or rounding
_TRIED = "unloading, longer holds, finer steps, another length"


@dataclass(frozen=True)
class MeasurementPlan:
    """A measurement one could make next: in words, and as holds, each read at the same times.

    Attributes
    ----------
    words : str
    setting : (H,) array
        One a hold: displacements, or weights.
    times_s : (R,) array
    length_mm : float
    control : {"displacement", "force"}
    """

    words: str
    setting: Array
    times_s: Array
    length_mm: float
    control: Control

    @property
    def protocol(self) -> Protocol:
        """Its holds."""
        return _holds(self.setting, self.times_s, self.length_mm, self.control)


_SETTINGS = {"displacement": "displacements", "force": "weights"}


def other_measurements(
    protocol: Protocol, alone: bool, units: Units = NATURAL, settings: str = ""
) -> list[MeasurementPlan]:
    """What could be done with a sample instead.

    Parameters
    ----------
    protocol : Protocol
        What was done with it.
    alone : bool
        Whether there is no other sample, whose displacements would differ.
    units : Units
        In which the protocol is written; words are in mm or N, and s.
    settings : str
        What is set in all the samples; displacements or weights, as in this one, when left out.
    """
    settings = settings or _SETTINGS[protocol.control]
    span = f"each sample's {settings}"
    last = ", of every sample"
    if alone:
        span, last = _ends_in_words(protocol, units)
    x = protocol.setting[protocol.recorded]
    times = _longest_series(protocol)
    last_time = times[-1]
    long = LONGER * (last_time or protocol.duration_s.max() or 1.0)
    spread = np.geomspace(long / 300.0, long, 24)
    log_times = np.concatenate([[0.0], spread])
    held = f"each held {to_be_held(units.time_s * last_time)}"
    dense = f"{to_be_held(units.time_s * long)} with 25 readings spaced evenly in the logarithm of time"
    back = x[-2::-1] if len(x) > 1 else x
    there_and_back = np.concatenate([x, back])
    on_way_back = f"unload the wire after the last hold: the same {settings} back{last}"
    both_ways = f"load and unload over {span}"
    if (np.diff(x) < 0.0).any():  # the test has a way back already
        on_way_back = f"after the last hold, go through the same {settings} again in reverse order"
        both_ways = f"go through the same {settings} and then through them in reverse order"
    halved, finer = _halved(x, span, held)

    def plan(words: str, holds: Array, moments: Array) -> MeasurementPlan:
        return MeasurementPlan(words, holds, moments, protocol.length_mm, protocol.control)

    return [
        plan(
            f"{on_way_back}, {held}",
            there_and_back,
            times,
        ),
        plan(f"hold each of the {settings} {span} for {dense}", x, log_times),
        plan(f"{both_ways}, each hold {dense}", there_and_back, log_times),
        plan(finer, halved, times),
    ]


def _ends_in_words(protocol: Protocol, units: Units) -> tuple[str, str]:
    """What is set from the least to the largest, and the way back."""
    unit = SET_UNIT[protocol.control]
    set_in_test = units.of(unit) * protocol.setting[protocol.recorded]
    low = short(set_in_test.min())
    high = short(set_in_test.max())
    span = low if low == high else f"{low} to {high}"
    return f"{span} {unit}", f" from {high} to {low} {unit}"


def _halved(x: Array, span: str, held: str) -> tuple[Array, str]:
    """Settings with steps half as large, in words too; of a single hold, which has no step, the way to it."""
    if len(x) == 1:
        return x * np.linspace(0.25, 1.0, 4), f"go to {span} in four steps, {held}"
    halved = np.repeat(x, 2)[:-1]
    halved[1::2] += 0.5 * np.diff(x)
    return halved, f"take twice as many, half as large steps over {span}"


LONGER = 5.0  # times the longest series: holds in which slow and fast creep part


def _longest_series(protocol: Protocol) -> Array:
    """Reading times of the hold with most readings."""
    counts = protocol.mask.sum(axis=1)
    return protocol.time_s[int(np.argmax(counts))][: int(counts.max())]


def _holds(setting: Array, times: Array, length_mm: float, control: Control) -> Protocol:
    """Holds at these displacements or weights, each read at these times."""
    h = len(setting)
    time = np.tile(times, (h, 1))
    duration = np.full(h, times[-1])
    number = np.arange(1, h + 1)
    return Protocol(length_mm, setting, time, np.ones(time.shape, bool), duration, number, control=control)


def _another_length(problem: Problem) -> tuple[str, Problem]:
    """The test repeated, beside what there is, on a sample twice as long as the longest, whose preload it shares."""
    samples = problem.samples
    longest = max(samples, key=lambda s: s.protocol.length_mm)
    more = _twice_as_long(longest)
    prior = problem.prior
    if LENGTH_EXPONENT not in prior.names:
        fixed = {LENGTH_EXPONENT: 1.0} | prior.fixed
        prior = replace(prior, fixed=fixed)
    lengths = {s.protocol.length_mm for s in samples}
    which = "a second" if len(lengths) == 1 else "another"
    protocol = more.protocol
    length = problem.units.length_mm * protocol.length_mm
    alike = "the same weights" if protocol.control == "force" else "steps scaled alike"
    words = f"repeat the test at {which} length, {length:g} mm, with {alike}"
    with_it = replace(problem, samples=(*samples, more), prior=prior)
    return words, with_it


def _twice_as_long(sample: Sample) -> Sample:
    """A sample of twice the length, not yet read: it takes twice the displacements; weights stay."""
    p = sample.protocol
    stretch = 1.0 if p.control == "force" else 2.0
    settings = stretch * p.setting[p.recorded]
    protocol = _holds(settings, _longest_series(p), 2.0 * p.length_mm, p.control)
    unread = np.zeros((*protocol.time_s.shape, 1))
    model = replace(sample.model, length_ref_mm=sample.length_ref_mm)
    return replace(sample, protocol=protocol, readings=unread, model=model)


def next_measurement(block: LaplaceFit, pair: tuple[Probe, Probe] | None, weakest: Probe | None) -> str:
    """The plan that best distinguishes two candidates, or best shows one effect, by projected signatures.

    Parameters
    ----------
    block : LaplaceFit
        The fit whose test would be followed by another.
    pair : (Probe, Probe) or None
        Candidates to distinguish.
    weakest : Probe or None
        Without a pair: the effect to reveal.

    Returns
    -------
    str
        A sentence, also where no plan helps.
    """
    if pair:
        trials = list(pair)
    elif weakest:
        trials = [weakest]
    else:
        return "No candidate remains; repeating the same holds would narrow the parameters."

    def separation(target: LogPosterior) -> float:
        return _separation(target, block, trials)

    words, ratio = _best_plan(block, separation)
    names = " from ".join(spoken(t.effect.name) for t in trials)
    if ratio < _WORTH:
        aim = f"distinguish {names}; measure one of them" if pair else f"reveal a smaller {names}; measure it"
        return f"None of the tests considered ({_TRIED}) would {aim} independently."
    known = ratio < _RATIO_LIMIT
    if pair:
        gain = f" {ratio:.1f} times as much as now" if known else "; at present they do not"
        return f"To distinguish {names}: {words}. Their traces in the readings would then differ{gain}."
    if not known:
        return f"To detect {names}, which this test does not show: {words}."
    return (
        f"To detect a smaller {names}: {words}. Its trace in the readings would be {ratio:.1f} times as large as now."
    )


def next_for_remainder(block: LaplaceFit) -> str:
    """The plan in which a smooth remainder of the same size would stand out most."""
    words, ratio = _best_plan(block, lambda target: _remainder_seen(target, block))
    if ratio < _WORTH:
        return f"None of the tests considered ({_TRIED}) would show more of what remains; repeat this one."
    gain = f" It would stand out {ratio:.1f} times as much as now." if ratio < _RATIO_LIMIT else ""
    return f"To learn more of what remains: {words}.{gain}"


def _best_plan(block: LaplaceFit, value: Callable[[LogPosterior], float]) -> tuple[str, float]:
    """Words of the plan with the largest value, and that value over the present test's."""
    here = value(block.target)
    ranked = []
    for words, other in _planned(block.target.problem):
        target = replace_problem(block.target, other)
        ranked.append((value(target), words))
    best, words = max(ranked)
    return words, best / here if here > 0 else np.inf


def _planned(problem: Problem) -> list[tuple[str, Problem]]:
    """The tests considered, in words and as a problem without readings."""
    planned = [_another_length(problem)]
    alone = len(problem.samples) == 1
    kinds = {_SETTINGS[s.protocol.control] for s in problem.samples}
    settings = " and ".join(sorted(kinds))
    each = [other_measurements(s.protocol, alone, problem.units, settings) for s in problem.samples]
    for plans in zip(*each, strict=True):
        protocols = [plan.protocol for plan in plans]
        empty = [np.zeros((*p.time_s.shape, 1)) for p in protocols]
        planned.append((plans[0].words, with_protocols(problem, protocols, empty)))
    return planned


def _remainder_seen(target: LogPosterior, block: LaplaceFit) -> float:
    """Typical length, in standard deviations of a reading, of a smooth remainder of one unit after projection."""
    x = expand(target, block.z, [])
    count = x.flexible.shape[2]
    smooth = replace(x, signatures=x.flexible, one_sided=np.zeros(count, bool), kinds=np.full(count, -1))
    return float(np.sqrt((projected(smooth, float(x.ratio[0])) ** 2).sum()))


def replace_problem(target: LogPosterior, problem: Any) -> LogPosterior:
    """A target on other holds whose coordinates mean the same."""
    out = LogPosterior(problem)
    out.coordinates.steps = target.coordinates.steps
    return out


def _separation(target: LogPosterior, block: LaplaceFit, trials: Sequence[Probe]) -> float:
    """Length of the first signature left when parameters, and the second where there is one, have taken their part."""
    x = expand(target, block.z, trials)
    p = projected(x, float(x.ratio[0]))
    first = p[:, 0]
    if p.shape[1] > 1 and (p[:, 1] ** 2).sum() > 0:
        second = p[:, 1] / np.sqrt((p[:, 1] ** 2).sum())
        first = first - second * (second @ first)
    return float(np.sqrt(first @ first))
