"""What it costs to take the last reading of a hold for its end, where a test does not say when its holds ended.

A hold ends when the next move begins. Where that was not recorded, the wire may have crept on unseen: the posterior's
mode is climbed to once more with longer holds, and how far it moves is what the assumption may cost.
"""

from dataclasses import replace

import numpy as np

from wirebayes.inference.climb import climb
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.json_files.hold_ends import HoldEnds, MovedByHoldEnds
from wirebayes.json_files.values import UNITS
from wirebayes.model.column_units import unit_of_column
from wirebayes.model.linear_amplitudes import integrated
from wirebayes.model.problem import Problem
from wirebayes.model.sample import Sample
from wirebayes.numeric.typing import Array
from wirebayes.sentences import listed, number, unit_text
from wirebayes.wire.protocol import Protocol

COVERED = 0.9  # of each hold, by its readings: a tenth is a rest of 13 s after two minutes, as moving by hand takes
SHIFTED = 0.5  # standard deviations from which a shift is worth a word: 90 % intervals then hold the truth in 86 %


def are_recorded(protocol: Protocol) -> bool:
    """Whether a hold that another one follows is known to have lasted beyond its last reading, or none follows one."""
    followed = protocol.recorded[:-1]
    went_on = (protocol.end > protocol.last_reading)[:-1]
    return not followed.any() or bool(went_on.any())


def cost(problem: Problem, best: Array, spread: Array) -> HoldEnds | None:
    """How far parameters would move if a tenth of each hold had passed after its last reading.

    Parameters
    ----------
    problem : Problem
        In whatever units.
    best : (d,) array
        Parameters near the mode, in those units: where both climbs begin.
    spread : (d,) array
        Standard deviations of the posterior, to which shifts are compared.

    Returns
    -------
    dict or None
        None where the ends of holds are recorded, or do not matter.
    """
    open_ = [not are_recorded(sample.protocol) for sample in problem.samples]
    if problem.likelihood != "chain" or not any(open_):
        return None
    samples = [_longer(sample) if is_open else sample for sample, is_open in zip(problem.samples, open_, strict=True)]
    before, after = _modes(problem, replace(problem, samples=tuple(samples)), best)
    moved: dict[str, MovedByHoldEnds] = {}
    for i, name in enumerate(problem.names):
        if not _is_told(name):
            continue
        shift = float(after[i] - before[i])
        share = abs(shift) / max(float(spread[i]), np.finfo(float).tiny)
        moved[name] = {"shift": shift, "sd_share": share, "unit": _unit(name, problem)}
    return {"covered": COVERED, "moved": moved, "sentence": hold_ends_sentence(moved)}


def _is_told(column: str) -> bool:
    """The creep rate, which unseen creep distorts most, and amplitudes of effects that have a meaning."""
    return column.split("[")[0] == "k2" or ("." in column and not column.startswith("discrepancy."))


def _unit(column: str, problem: Problem) -> str:
    return UNITS.get(column.split("[")[0]) or unit_of_column(column, problem.samples)


def hold_ends_sentence(moved: dict[str, MovedByHoldEnds]) -> str:
    """What the assumption may cost, in words.

    Parameters
    ----------
    moved : dict
        Of each parameter: its shift, and that in standard deviations.
    """
    begin = "each hold is taken to end with its last reading: had a tenth of each passed after it,"
    far = {name: move for name, move in moved.items() if move["sd_share"] >= SHIFTED}
    if not far:
        return f"{begin} {listed(list(moved), 'or')} would move by less than {SHIFTED:g} standard deviations"
    each = []
    for name, move in far.items():
        way = "lower" if move["shift"] < 0 else "higher"
        size = f"{number(abs(move['shift']))} {unit_text(move['unit'])}".strip()
        each.append(f"{name} would be {way} by {size} ({move['sd_share']:.1f} of its standard deviation)")
    return f"{begin} {listed(each)}; a row without a reading says when a hold ended"


def _longer(sample: Sample) -> Sample:
    """The same readings in holds of which they cover a part."""
    times = np.where(sample.protocol.recorded, 1.0 / COVERED, 1.0)
    protocol = replace(sample.protocol, duration_s=sample.protocol.duration_s * times)
    more = protocol.mask.shape[1] - sample.protocol.mask.shape[1]  # a column for the ends, where there was none
    return replace(sample, protocol=protocol, readings=np.pad(sample.readings, [(0, 0), (0, more), (0, 0)]))


def _modes(problem: Problem, longer: Problem, best: Array) -> tuple[Array, Array]:
    """(d,) parameters at the mode that is reached from these, of both problems; what is integrated out stays."""
    own = problem.in_units(problem.own_units)
    target, other = (LogPosterior(integrated(p.in_units(own.units)), for_draws=False) for p in (problem, longer))
    other.coordinates.steps = target.coordinates.steps  # so that both modes are of one density
    columns = [problem.names.index(name) for name in target.problem.names]
    start = target.coordinates.to_sampled(problem.theta_in(own.units, best[None])[:, columns])
    ends = []
    for each in (target, other):
        density, residuals = each.rowwise()
        found = climb(density, start, residuals, curvature_at_end=False).z
        theta = problem.theta_in(own.units, best[None])
        theta[:, columns] = each.coordinates.to_natural(found)
        ends.append(own.theta_in(problem.units, theta)[0])
    return ends[0], ends[1]
