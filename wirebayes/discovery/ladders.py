"""Paths along which amplitudes are raised: where each begins, its rungs, and its starts."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wirebayes.discovery.probes import Probe, forms
from wirebayes.discovery.scans import Scan
from wirebayes.discovery.screening import Candidate
from wirebayes.inference.laplace_fit import LaplaceFit
from wirebayes.numeric.typing import Array
from wirebayes.wire.effect import Effect, EventEffect

FIRST, LAST = 1.5, 24.0  # δ of the rungs


_RAW = 10.0  # δ of the first one before the parameters take their part, if that is less


_APART, _MOST = 2.0, 8  # largest ratio of neighbours, unless they would be more than that many


_MIDDLE = 6.0  # δ for which a one-sided form is tried


@dataclass(frozen=True)
class AmplitudePath:
    """A form of an effect and the amplitudes it is led through, from several starts at once.

    Attributes
    ----------
    probes : tuple of Probe
        One for each start: they differ in their shape constants.
    amplitudes : (rungs, starts) array
        Signed distances from neutral, growing in size.
    candidates : tuple of Candidate
        Of this form, on the blocks where it may act.
    """

    probes: tuple[Probe, ...]
    amplitudes: Array
    candidates: tuple[Candidate, ...]

    @property
    def effect(self) -> Effect:
        return self.probes[0].effect

    @property
    def blocks(self) -> set[int]:
        return {b for c in self.candidates for b in c.blocks}


def ladders(
    blocks: Sequence[LaplaceFit], trials: Sequence[Probe], candidates: Sequence[Candidate], data: Sequence[Scan]
) -> list[AmplitudePath]:
    """Ladders of amplitudes for each form that lasts: a start for each trial of its shape constants and each sign.

    There are none for events: they move the level of their hold, which the linear scan sees.

    Parameters
    ----------
    blocks : sequence of LaplaceFit
        The plain fits, one a material.
    trials : sequence of Probe
        Every form at the amplitudes of the linear scan.
    candidates : sequence of Candidate
        Which probe may act on which blocks.
    data : sequence of Scan
        The linear scan of each block's readings; it gives the size that one unit of amplitude has in them.

    Returns
    -------
    list of AmplitudePath
    """
    out = []
    for shapes in _lasting_forms(trials):
        first = shapes[0][0]
        here = tuple(c for c in candidates if c.probe == first)
        on = sorted({b for c in here for b in c.blocks})
        own_blocks = [blocks[b] for b in on]
        own_data = [data[b] for b in on]
        starts: list[_LadderEnds] = []
        for numbers in shapes:
            strength = {k: _strength(k, own_data) for k in numbers}
            visible = [k for k in numbers if strength[k] > 0]
            if visible:
                # Of a one-sided form the probe that lies in the middle of the ladder.
                k = min(visible, key=lambda k: _off_middle(strength[k], trials[k]))
                starts += _both_signs(trials[k], strength[k], own_blocks)
        if starts:
            probes = tuple(s.probe for s in starts)
            rungs = _rungs(starts)
            out.append(AmplitudePath(probes, rungs, here))
    return out


def _off_middle(strength: float, probe: Probe) -> float:
    """Distance of a probe's step from the middle of the ladder, as a logarithm."""
    return float(abs(np.log(strength * probe.step / _MIDDLE)))


def _strength(k: int, data: Sequence[Scan]) -> float:
    """δ of one unit of a probe's amplitude in the readings of some blocks."""
    square = sum(scan.norm[0, k] ** 2 for scan in data)
    return float(np.sqrt(square))


def _lasting_forms(trials: Sequence[Probe]) -> list[list[list[int]]]:
    """Numbers of the probes of each form that lasts, by their shape constants."""
    alike: dict[str, dict[tuple[float, ...], list[int]]] = {}
    for k, probe in enumerate(trials):
        if not isinstance(probe.effect, EventEffect):
            shape = tuple(probe.own[name] for name in probe.effect.shape_columns)
            alike.setdefault(probe.effect.key, {}).setdefault(shape, []).append(k)
    return [list(shapes.values()) for shapes in alike.values()]


@dataclass(frozen=True)
class _LadderEnds:
    """The first and the last amplitude of a start, signed."""

    probe: Probe
    first: float
    last: float


def _both_signs(probe: Probe, strength: float, blocks: Sequence[LaplaceFit]) -> list[_LadderEnds]:
    """Ladders upwards and, unless the form is one-sided, downwards; δ of one unit of amplitude is its strength."""
    raw = float(np.sqrt(sum(_raw(block, probe) for block in blocks)))
    first = min(FIRST / strength, _RAW / raw)
    last = LAST / strength
    return [_LadderEnds(probe, sign * first, sign * last) for sign in ((1,) if probe.one_sided else (1, -1))]


def _rungs(starts: Sequence[_LadderEnds]) -> Array:
    """(rungs, starts) amplitudes; as many for all as the widest ladder needs."""
    first = [s.first for s in starts]
    last = [s.last for s in starts]
    widest = float(np.max(np.divide(last, first)))
    count = min(1 + int(np.ceil(np.log(widest) / np.log(_APART))), _MOST)
    return np.geomspace(first, last, count)


def _raw(block: LaplaceFit, probe: Probe) -> float:
    """Squared length of a unit of the effect in the readings, in standard deviations of one."""
    shapes = forms(block.target, block.z, [probe])
    theta = block.theta
    total = 0.0
    for sample, shape in zip(block.target.problem.samples, shapes, strict=True):
        own = block.target.problem.parameters(theta, sample)
        variance = sample.variance(own)
        total += float((shape[sample.protocol.mask] ** 2).sum() / variance[0])
    return total
