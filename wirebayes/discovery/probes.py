"""Effects at finite amplitudes, and what each adds to the readings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.model.sample import Sample
from wirebayes.numeric.any_distribution import finite_spread
from wirebayes.numeric.typing import Array
from wirebayes.wire.effect import Effect
from wirebayes.wire.model import Model
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
    column = effect.amplitude_column
    amplitude = effect.amplitudes[0]
    neutral = amplitude.neutral
    low, high = amplitude.prior.support()
    scale = finite_spread(amplitude.prior)
    one_sided = bool(low >= neutral)
    steps = [0.1 * scale]
    if one_sided and not effect.nearly_linear:
        steps = [0.03 * scale, 0.3 * scale, scale, 3.0 * scale]
    allowed = [s for s in steps if neutral + s <= high]
    if not allowed:
        allowed = [0.5 * (high - neutral)]
    out = []
    for form in effect.shapes_tried():
        for step in allowed:
            own = form | {column: neutral + step}
            out.append(Probe(effect, own, step, one_sided))
    return out


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
    problem = target.problem
    theta = target.coordinates.to_natural(z)
    alike: dict[str, list[int]] = {}
    for k, probe in enumerate(trials):
        numbers = alike.setdefault(probe.effect.key, [])
        numbers.append(k)
    out = []
    for sample in problem.samples:
        own = problem.parameters(theta, sample)
        protocol = sample.protocol
        shapes = np.zeros((*protocol.time_s.shape, len(trials)))
        plain: Array | None = None
        for numbers in alike.values():
            tried = [trials[k] for k in numbers]
            effect = tried[0].effect
            if not effect.acts_on(sample.name, protocol.control):
                continue
            if plain is None:
                plain = _simulated(sample, own, sample.model)
            added = _with_each(sample, own, tried) - plain
            added = np.where(np.isfinite(added), added, 0.0)
            steps = [probe.step for probe in tried]
            shapes[..., numbers] = added / steps
        out.append(shapes)
    return out


def _with_each(sample: Sample, own: Mapping[str, Array], tried: Sequence[Probe]) -> Array:
    """(H, R, k) tensions with each of some probes of one effect, at parameters (1,)."""
    parameters = {name: np.repeat(value, len(tried)) for name, value in own.items()}
    for name in tried[0].own:
        parameters[name] = np.array([probe.own[name] for probe in tried])
    effects = (*sample.model.effects, tried[0].effect)
    return _simulated(sample, parameters, replace(sample.model, effects=effects))


def _simulated(sample: Sample, own: dict[str, Array], model: Model) -> Array:
    """(H, R, k) tensions; no numbers where the model cannot be computed."""
    with np.errstate(all="ignore"):
        return simulate(sample.protocol, own, model)
