"""Paths along which amplitudes are raised: where each begins, its rungs, and its starts."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wirebayes.discovery.probes import Probe, forms
from wirebayes.discovery.scans import Scan
from wirebayes.discovery.screening import Candidate
from wirebayes.inference.laplace_fit import LaplaceFit
from wirebayes.model import likelihoods
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
    alike: dict[str, dict[tuple[float, ...], list[int]]] = {}
    for k, probe in enumerate(trials):
        if not isinstance(probe.effect, EventEffect):
            shape = tuple(probe.own[name] for name in probe.effect.columns()[1:])
            alike.setdefault(probe.effect.key, {}).setdefault(shape, []).append(k)
    out = []
    for shapes in alike.values():
        every = [k for numbers in shapes.values() for k in numbers]
        here = tuple(c for c in candidates if c.probe == every[0])
        on = sorted({b for c in here for b in c.blocks})
        strength = {k: float(np.sqrt(sum(data[b].norm[0, k] ** 2 for b in on))) for k in every}
        starts: list[tuple[Probe, float, float]] = []
        for numbers in shapes.values():
            visible = [k for k in numbers if strength[k] > 0]
            if visible:
                # Of a one-sided form the probe that lies in the middle of the ladder.
                k = min(visible, key=lambda k: abs(np.log(strength[k] * trials[k].step / _MIDDLE)))
                raw = float(np.sqrt(sum(_raw(blocks[b], trials[k]) for b in on)))
                ends = min(FIRST / strength[k], _RAW / raw), LAST / strength[k]
                starts += [(trials[k], s * ends[0], s * ends[1]) for s in ((1,) if trials[k].one_sided else (1, -1))]
        if starts:
            probes, first, last = zip(*starts, strict=True)
            widest = float(np.max(np.divide(last, first)))
            rungs = min(1 + int(np.ceil(np.log(widest) / np.log(_APART))), _MOST)
            out.append(AmplitudePath(probes, np.geomspace(first, last, rungs), here))
    return out


def _raw(block: LaplaceFit, probe: Probe) -> float:
    """Squared length of a unit of the effect in the readings, in standard deviations of one."""
    shapes = forms(block.target, block.modes.z[:1], [probe])
    theta, total = block.target.coordinates.to_natural(block.modes.z[:1]), 0.0
    for sample, shape in zip(block.target.problem.samples, shapes, strict=True):
        own = block.target.problem.parameters(theta, sample)
        variance = likelihoods.reading_variance(own["sensor_sd"], sample.resolution)
        total += float((shape[sample.protocol.mask] ** 2).sum() / variance[0])
    return total
