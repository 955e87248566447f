"""What a search has found in a file, and the models of it that are sampled."""

from dataclasses import dataclass, replace

from wirebayes.discovery import shrinking
from wirebayes.discovery.alternatives import Alternative
from wirebayes.inference.laplace_fit import LaplaceFit
from wirebayes.io.experiment import Experiment
from wirebayes.json_files.discovery import DiscoveryJson
from wirebayes.wire.effect import Effect


@dataclass(frozen=True)
class Concluded:
    """The models that were found for a file, for each material.

    Attributes
    ----------
    final : tuple of LaplaceFit
        The samples of each material, gross errors struck out, with the effects that were accepted.
    remains : tuple of bool
        Whether something unknown remains beside these.
    undecided : tuple of list of Alternative
        The models that the readings leave undecided, the final one first; empty where nothing is.
    """

    final: tuple[LaplaceFit, ...]
    remains: tuple[bool, ...]
    undecided: tuple[list[Alternative], ...]


@dataclass(frozen=True)
class Investigation(Concluded):
    """What was found in a file.

    Attributes
    ----------
    report : dict
        The content of ``discovery.json``.
    """

    report: DiscoveryJson


@dataclass(frozen=True)
class JointModel:
    """What is sampled at once.

    Attributes
    ----------
    experiments : tuple of Experiment
    effects : tuple of Effect
    near : dict, optional
        Where the best parameters are, if known.
    share : float
        Of the draws of an answer, that come from this model.
    """

    experiments: tuple[Experiment, ...]
    effects: tuple[Effect, ...] = ()
    near: dict[str, float] | None = None
    share: float = 1.0


def final_models(findings: Concluded) -> list[JointModel]:
    """The final model of every experiment.

    Samples of one material share what they are, and the amplitude of what was added. Where nothing was, each stands for
    itself; where something unknown remains, with the flexible discrepancy beside what was added.
    """
    out = []
    for block, remains in zip(findings.final, findings.remains, strict=True):
        out += _sampled(block, remains)
    return out


def alternative_models(findings: Concluded) -> list[list[JointModel]]:
    """The other models that stay undecided beside the final ones, each as what is sampled for it."""
    out = []
    for others in findings.undecided:
        for other in others[1:]:
            models = _sampled(other.block, other.remains)
            out.append([replace(model, share=other.probability) for model in models])
    return out


def _sampled(block: LaplaceFit, remains: bool) -> list[JointModel]:
    """What is sampled for a block, with a smooth discrepancy beside its effects where something remains."""
    if block.effects and not remains:
        return [JointModel(block.experiments, block.effects, block.best)]
    out = []
    for e in block.experiments:
        own = shrinking.acting_alone(block.effects, e)
        smooth = (shrinking.discrepancy(e, shrinking.residual_rms(block, e.name)),) if remains else ()
        out.append(JointModel((e,), (*own, *smooth), block.parameters(e.name)))
    return out
