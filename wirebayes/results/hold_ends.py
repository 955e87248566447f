"""What it costs not to know when holds ended: to take a last reading for the end, or a long rest for part of a hold.

A hold ends when the next move begins. Where that was not recorded, the wire may have crept on unseen; where nothing was
read for long before it, the wire may have been let go. The posterior's mode is climbed to once more with longer holds,
or with holds that end where nothing more was read, and how far it moves is what the assumption may cost. Of k2 it is
said of k2 t^N early in a hold: how far the rate after one second moves depends on what is called a second.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from wirebayes.inference.climb import climb
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.io.unread_ends import unread_s
from wirebayes.json_files.hold_ends import HoldEnds, MovedByHoldEnds
from wirebayes.model.column_units import parameter_of, unit_of_column, units_ratio
from wirebayes.model.linear_amplitudes import integrated
from wirebayes.model.problem import Problem
from wirebayes.model.sample import Sample
from wirebayes.model.scales import NATURAL, Units
from wirebayes.numeric.typing import Array
from wirebayes.result_warnings import Notice
from wirebayes.sentences import holds_in_words, lasting, listed, number, short, unit_text
from wirebayes.wire.protocol import Protocol

COVERED = 0.9  # of each hold, by its readings: a tenth is a rest of 13 s after two minutes, as moving by hand takes
SHIFTED = 0.5  # standard deviations from which a shift is worth a word: 90 % intervals then hold the truth in 86 %
MATTERS = 1.0  # standard deviations from which it is worth a warning: they then hold it in 74 %
PRACTICAL = 0.02  # of k1 or k2: less is little beside what one sample of a line differs from another
EARLY = 0.01  # of a typical hold: about the second after which k2 is the rate, in holds of two minutes
_POSITIVE = ("k1", "k2")  # the parameters of the wire that unseen creep distorts
_LONGER = "each hold is taken to end with its last reading: had a tenth of each passed after it,"
_RECORD = "a row without a reading says when a hold ended"
_LET_GO = "if it did not stay so, say what it did with unrecorded_holds"


def are_recorded(protocol: Protocol) -> bool:
    """Whether a hold that another one follows is known to have lasted beyond its last reading, or none follows one."""
    followed = protocol.recorded[:-1]
    went_on = (protocol.end > protocol.last_reading)[:-1]
    return not followed.any() or bool(went_on.any())


def cost(problem: Problem, best: Array, draws: Array) -> HoldEnds | None:
    """How far parameters would move if a tenth of each hold had passed after its last reading.

    Parameters
    ----------
    problem : Problem
        In whatever units.
    best : (d,) array
        Parameters near the mode, in those units: where both climbs begin.
    draws : (n, d) array
        Of the posterior, in those units: shifts are compared with their standard deviations.

    Returns
    -------
    dict or None
        None where the ends of holds are recorded, or do not matter.
    """
    if problem.likelihood != "chain":
        return None
    samples = list(problem.samples)
    recorded = [are_recorded(sample.protocol) for sample in samples]
    if not all(recorded):
        for i, is_recorded in enumerate(recorded):
            if not is_recorded:
                samples[i] = _longer(samples[i])
        covered = COVERED
        supposed = _LONGER
        advice = _RECORD
    elif any(unread_after_s(sample.protocol).any() for sample in samples):
        samples = [_shorter(sample) for sample in samples]
        covered = 1.0
        supposed = _rests(problem.samples)
        advice = _LET_GO
    else:
        return None
    otherwise = replace(problem, samples=tuple(samples))
    own = problem.in_units(problem.own_units)
    early = _early(problem)
    before, after = own.theta_in(early, np.array(_modes(problem, otherwise, best)))
    spread = problem.theta_in(early, draws).std(axis=0, ddof=1)
    moved = _moved(problem, early, before, after, spread)
    sentence = hold_ends_sentence(moved, supposed, advice)
    return {"covered": covered, "moved": moved, "sentence": sentence}


def _early(problem: Problem) -> Units:
    """Units of the test in which k2 is the rate early in a hold."""
    typical = NATURAL if problem.scales is None else problem.scales.units
    return replace(typical, time_s=EARLY * typical.time_s)


def _moved(problem: Problem, units: Units, before: Array, after: Array, spread: Array) -> dict[str, MovedByHoldEnds]:
    """How far each told parameter moves, from (d,) values and standard deviations in the units of `_early`."""
    moved: dict[str, MovedByHoldEnds] = {}
    for i, name in enumerate(problem.names):
        parameter = parameter_of(name)
        if not _is_told(name):
            continue
        shift = float(after[i] - before[i])
        sd = max(float(spread[i]), np.finfo(float).tiny)
        move: MovedByHoldEnds = {
            "quantity": name,
            "shift": shift,
            "sd_share": abs(shift) / sd,
            "relative": abs(shift) / float(before[i]) if parameter in _POSITIVE else None,
            "unit": "1",
        }
        if parameter == "k2":
            move["quantity"] = f"{name} t^N after {short(units.time_s, 3)} s"
        else:
            move["unit"] = unit_of_column(name, problem.samples)
            move["shift"] *= units_ratio(move["unit"], units, problem.units)
        moved[name] = move
    return moved


def hold_ends_notice(ends: HoldEnds | None) -> list[Notice]:
    """A warning where something would move far, in standard deviations and as a share of itself."""
    if ends is None or not any(_matters(move) for move in ends["moved"].values()):
        return []
    return [Notice("hold-ends", ends["sentence"])]


def _matters(move: MovedByHoldEnds) -> bool:
    """Whether a shift is both beyond the errors and one that changes what is built on the value."""
    relative = move["relative"]
    return move["sd_share"] >= MATTERS and (relative is None or relative >= PRACTICAL)


def unread_after_s(protocol: Protocol) -> Array:
    """(H,) s for which each hold went on unread, as a rest would; 0 where it did not, and of the last one.

    Parameters
    ----------
    protocol : Protocol
    """
    unread = np.zeros(len(protocol.duration_s))
    for hold, mask in enumerate(protocol.mask[:-1]):
        if mask.any():
            times = protocol.time_s[hold][mask]
            unread[hold] = unread_s(times, float(protocol.duration_s[hold]))
    return unread


def _rests(samples: Sequence[Sample]) -> str:
    """What is supposed of holds that went on unread."""
    each = []
    for sample in samples:
        unread = unread_after_s(sample.protocol)
        numbers = sample.protocol.number[unread > 0.0]
        if len(numbers):
            of = f" of {sample.name}" if len(samples) > 1 else ""
            longest = lasting(float(unread.max()))
            each.append(f"{holds_in_words(numbers)}{of} (up to {longest})")
    return (
        f"{listed(each)} went on long after the last reading, and what was set is taken to have stayed until the next "
        "move: had nothing followed that reading,"
    )


def _is_told(column: str) -> bool:
    """The stiffness, which unseen creep distorts most, the creep rate, and amplitudes of effects that have a meaning.

    Of twelve simulated tests with a rest of a fifth to all of a hold before each move, k1 was 4 to 34 standard
    deviations off in ten, k2 in one.
    """
    if parameter_of(column) in _POSITIVE:
        return True
    return "." in column and not column.startswith("discrepancy.")


def hold_ends_sentence(moved: dict[str, MovedByHoldEnds], supposed: str = _LONGER, advice: str = _RECORD) -> str:
    """What the assumption may cost, in words.

    Parameters
    ----------
    moved : dict
        Of each parameter: its shift, and that in standard deviations.
    supposed, advice : str
        What is taken for granted and what else may have been, and what to write where it was otherwise.
    """
    far = [move for move in moved.values() if move["sd_share"] >= SHIFTED]
    if not far:
        quantities = [move["quantity"] for move in moved.values()]
        return f"{supposed} {listed(quantities, 'or')} would move by less than {SHIFTED:g} standard deviations"
    each = []
    for move in far:
        way = "lower" if move["shift"] < 0 else "higher"
        size = f"{number(abs(move['shift']))} {unit_text(move['unit'])}".strip()
        each.append(f"{move['quantity']} would be {way} by {size} ({move['sd_share']:.1f} of its standard deviation)")
    return f"{supposed} {listed(each)}; {advice}"


def _longer(sample: Sample) -> Sample:
    """The same readings in holds of which they cover a part."""
    times = np.where(sample.protocol.recorded, 1.0 / COVERED, 1.0)
    protocol = replace(sample.protocol, duration_s=sample.protocol.duration_s * times)
    more = protocol.mask.shape[1] - sample.protocol.mask.shape[1]  # a column for the ends, where there was none
    readings = np.pad(sample.readings, [(0, 0), (0, more), (0, 0)])
    return replace(sample, protocol=protocol, readings=readings)


def _shorter(sample: Sample) -> Sample:
    """The same readings in holds that end with their last readings where they went on unread."""
    protocol = sample.protocol
    holds = np.arange(len(protocol.duration_s))
    last_s = protocol.time_s[holds, protocol.last_reading]
    went_on = unread_after_s(protocol) > 0.0
    ended = np.where(went_on, last_s, protocol.duration_s)
    return replace(sample, protocol=replace(protocol, duration_s=ended))


def _modes(problem: Problem, longer: Problem, best: Array) -> tuple[Array, Array]:
    """(d,) parameters in the test's own units at the modes of both problems; what is integrated out stays."""
    own = problem.in_units(problem.own_units)
    target = _density(problem, own)
    other = _density(longer, own)
    coordinates = target.coordinates
    other.coordinates.steps = coordinates.steps  # so that both modes are of one density
    columns = [problem.names.index(name) for name in target.problem.names]
    theta = problem.theta_in(own.units, best[None])
    start = coordinates.to_sampled(theta[:, columns])
    ends = []
    for each in (target, other):
        density, residuals = each.rowwise()
        found = climb(density, start, residuals, curvature_at_end=False)
        there = theta.copy()
        there[:, columns] = each.coordinates.to_natural(found.z)
        ends.append(there[0])
    return ends[0], ends[1]


def _density(problem: Problem, own: Problem) -> LogPosterior:
    """The density of a problem in the units of another, without what can be integrated out."""
    return LogPosterior(integrated(problem.in_units(own.units)))
