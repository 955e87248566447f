"""What is said of one material: the verdict, the effects that are accepted, and what remains."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from numpy.random import Generator

from wirebayes.discovery import shrinking
from wirebayes.discovery.fitted_sets import Accepted, Explored
from wirebayes.discovery.global_test import Gate
from wirebayes.discovery.held_out import LeftOut
from wirebayes.discovery.judgement import Evidence, Judgement, verdict_on
from wirebayes.discovery.model_space import smallest_set
from wirebayes.discovery.naming import Named
from wirebayes.discovery.settings import REMAINS
from wirebayes.discovery.verdict import accepted_effects, evidence
from wirebayes.inference.laplace_fit import LaplaceFit, fitted
from wirebayes.json_files.discovery import Disagreement, Remainder, Verdict
from wirebayes.processes.workers import ParallelMap

# of a material that the global test has cleared
_NO_REMAINDER: Remainder = {"probability": 0.0, "where": [], "p": None, "leave_one_hold_out": None}


_VISIBLE = 0.05  # p of a residual pattern that is reported of the remainder


@dataclass(frozen=True)
class MaterialAnswer:
    """What is said of one material.

    Attributes
    ----------
    judgement : Judgement
    accepted : list of Accepted
    stages : list of LaplaceFit
        Its block with the first accepted effect, the first two, and so on.
    found : Evidence or None
        None where only the global test was requested.
    remainder : dict
    """

    judgement: Judgement
    accepted: list[Accepted]
    stages: list[LaplaceFit]
    found: Evidence | None
    remainder: Remainder

    @property
    def verdict(self) -> Verdict:
        return self.judgement.verdict

    @property
    def remains(self) -> bool:
        """Whether the final model has a discrepancy."""
        return self.verdict in ("partial", "unknown")

    @property
    def shares(self) -> dict[str, float]:
        """Probability of each name, and of *unknown*, to have the largest share; empty where nothing is missing."""
        return {} if self.found is None or self.verdict == "nothing-missing" else dict(self.found.shares)

    @property
    def best(self) -> str | None:
        """The most probable, which need not be established: *unknown* may be the verdict beside a likely name."""
        return max(self.shares, key=lambda name: self.shares[name]) if self.shares else None

    @property
    def set(self) -> list[str]:
        if self.verdict == "ambiguous":
            return list(self.judgement.undecided)
        members = smallest_set(self.shares)
        return members if self.verdict != "unknown" or "unknown" in members else [*members, "unknown"]


def answer_material(
    gate: Gate,
    past: Named | None,
    i: int,
    where: list[Disagreement],
    left_out: LeftOut,
    rng: Generator,
    parallel_map: ParallelMap,
) -> MaterialAnswer:
    """The verdict on block `i`, and its fits with what was accepted.

    Parameters
    ----------
    gate : Gate
        What the global test has found.
    past : Named or None
        What was found past it; None where nothing is missing.
    i : int
        Number of the block among the materials.
    where : list of dict
        Residual patterns of the plain model.
    left_out : LeftOut
        Scores them.
    rng : numpy.random.Generator
    parallel_map : function
        The built-in `map`, or one over processes.
    """
    if past is None:
        return MaterialAnswer(Judgement("nothing-missing"), [], [], None, _NO_REMAINDER)
    decision = past.decision
    p = gate.test.p
    plain = gate.blocks[i]
    before = evidence(decision, p, i)
    accepted = accepted_effects(decision, before, i)
    stages = _stages(plain, accepted, past.explored, i, rng)
    gain = None
    if before.remainder > REMAINS:
        base = stages[-1] if before.established else plain
        gain = shrinking.discrepancy_gain(base, left_out, rng, parallel_map)
    found = replace(before, remainder_gain=gain)
    judgement = verdict_on(found)
    if judgement.verdict in ("nothing-missing", "unknown"):
        accepted = []
        stages = []
    # beside the effects where some are accepted, else what the plain model leaves over
    retest = decision.retest
    patterns = []
    if judgement.verdict == "unknown":
        patterns = where
    elif judgement.verdict == "partial" and retest is not None:
        patterns = retest.where[i]
    remainder: Remainder = {
        "probability": found.remainder,
        "where": [w["covariate"] for w in patterns if w["p"] <= _VISIBLE],
        "p": None if retest is None else retest.p,
        "leave_one_hold_out": gain,
    }
    return MaterialAnswer(judgement, accepted, stages, found, remainder)


def _stages(
    plain: LaplaceFit, accepted: Sequence[Accepted], explored: Explored, i: int, rng: Generator
) -> list[LaplaceFit]:
    """Block `i` with the first accepted effect, the first two, and so on; fitted here where the search has not."""
    stages: list[LaplaceFit] = []
    for k in range(len(accepted)):
        effects = tuple(a.effects[i] for a in accepted[: k + 1])
        ready = [s.blocks[i] for s in explored.fitted.values() if s.blocks[i].effects == effects]
        base = stages[-1] if stages else plain
        own = ready[0] if ready else fitted(base.experiments, effects, plain.spec, rng, scales=plain.scales)
        stages.append(own)
    return stages
