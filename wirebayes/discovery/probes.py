"""Effects at finite amplitudes, and what each adds to the readings."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.numeric.typing import Array
from wirebayes.wire.effect import Effect
from wirebayes.wire.staircase import simulate


@dataclass(frozen=True)
class Probe:
    """An effect at a finite amplitude: what it would add to the readings is its signature.

    Attributes
    ----------
    effect : Effect
    own : dict
        Its amplitudes by column name, shape constants included.
    step : float
        The amplitude's distance from neutral, by which the signature is divided.
    one_sided : bool
        True where only amplitudes above neutral have a meaning.
    """

    effect: Effect
    own: dict[str, float]
    step: float
    one_sided: bool


def probes(effect: Effect) -> list[Probe]:
    """Amplitudes at which an effect is tried: one where its form is nearly linear, a ladder where it need not be."""
    column, amplitude = effect.columns()[0], effect.amplitudes[0]
    low, high = amplitude.prior.support()
    scale = float(amplitude.prior.std())
    one_sided = bool(low >= amplitude.neutral)
    steps = [0.1 * scale] if effect.nearly_linear or not one_sided else [0.03 * scale, 0.3 * scale, scale, 3.0 * scale]
    steps = [s for s in steps if amplitude.neutral + s <= high] or [0.5 * (high - amplitude.neutral)]
    return [
        Probe(effect, form | {column: amplitude.neutral + s}, s, one_sided)
        for form in effect.shapes_tried()
        for s in steps
    ]


def forms(target: LogPosterior, z: Array, trials: Sequence[Probe]) -> list[Array]:
    """Signatures of the probes: what each adds to the readings, per unit amplitude.

    Parameters
    ----------
    target : LogPosterior
        Of a block.
    z : (1, d) array
        Where it is evaluated, in the coordinates that are sampled.
    trials : sequence of Probe

    Returns
    -------
    list of (H, R, m) arrays
        One a sample, N; zero where the effect cannot be computed or belongs to another sample.
    """
    problem, theta = target.problem, target.coordinates.to_natural(z)
    alike: dict[str, list[int]] = {}
    for k, probe in enumerate(trials):
        alike.setdefault(probe.effect.key, []).append(k)
    out = []
    for sample in problem.samples:
        own = problem.parameters(theta, sample)
        shapes = np.zeros((*sample.protocol.time_s.shape, len(trials)))
        plain: Array | None = None
        for numbers in alike.values():
            effect = trials[numbers[0]].effect
            if not effect.acts_on(sample.name, sample.protocol.control):
                continue
            each = {name: np.repeat(value, len(numbers)) for name, value in own.items()}
            each |= {name: np.array([trials[k].own[name] for k in numbers]) for name in trials[numbers[0]].own}
            with np.errstate(all="ignore"):
                plain = simulate(sample.protocol, own, sample.model) if plain is None else plain
                effects = (*sample.model.effects, effect)
                added = simulate(sample.protocol, each, replace(sample.model, effects=effects)) - plain
            shapes[..., numbers] = np.where(np.isfinite(added), added, 0.0) / [trials[k].step for k in numbers]
        out.append(shapes)
    return out
