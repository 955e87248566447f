"""The verdict on one material, a function of evidence values alone."""

from collections.abc import Mapping
from dataclasses import dataclass

from wirebayes.discovery.families import Family
from wirebayes.discovery.model_space import smallest_set
from wirebayes.discovery.settings import ALPHA, IN_FAMILY, IN_SET, INCLUSION, KEEP_ELPD, REMAINS
from wirebayes.json_files.discovery import Verdict


@dataclass(frozen=True)
class FamilyEvidence:
    """Effects that these tests cannot tell apart, and what speaks for any of them.

    Attributes
    ----------
    members : mapping of name to float
        Probability that each is missing, the most probable first.
    inclusion : float
        Probability that any of them is missing.
    gain : float or None
        What the mixture over them gains by leaving out one hold at a time, against the model without the family; None
        where it was not asked, or there are too few holds to ask.
    """

    members: Mapping[str, float]
    inclusion: float
    gain: float | None

    @property
    def is_established(self) -> bool:
        """Whether one of its members is missing beyond doubt, and predicts."""
        return self.inclusion >= INCLUSION and self.gain is not None and self.gain > KEEP_ELPD

    @property
    def name(self) -> str | None:
        """The member that holds nearly all of the family's probability; None where none does."""
        best = max(self.members, key=lambda name: self.members[name])
        return best if self.members[best] >= IN_FAMILY * self.inclusion else None


@dataclass(frozen=True)
class Evidence:
    """What decides the verdict on a material.

    Attributes
    ----------
    p : float
        Of the global test on the plain model.
    nothing : float
        Probability that nothing is missing in this material, where others of the file show something.
    families : tuple of FamilyEvidence
        Those of the best set in the order of acceptance, then the others.
    shares : mapping of name to float
        Probability of each name, and of *unknown*, to have the largest share of the disagreement.
    best_gain : float or None
        What the best name gains by leaving out one hold at a time.
    remainder : float
        Probability of something beyond the names.
    remainder_gain : float or None
        What a smooth discrepancy beside the established families gains; None where it was not asked.
    """

    p: float
    nothing: float
    families: tuple[FamilyEvidence, ...]
    shares: Mapping[str, float]
    best_gain: float | None
    remainder: float
    remainder_gain: float | None

    @property
    def established(self) -> list[FamilyEvidence]:
        """Families that are missing beyond doubt."""
        return [family for family in self.families if family.is_established]

    @property
    def remainder_counts(self) -> bool:
        """Whether something beyond the names is likely, and earns its place as a name has to."""
        gains = self.remainder_gain is not None and self.remainder_gain > KEEP_ELPD
        return self.remainder > REMAINS and gains


@dataclass(frozen=True)
class Judgement:
    """A verdict and between which names it is undecided: empty unless it is ambiguous or a family of it is."""

    verdict: Verdict
    undecided: Family = ()


def verdict_on(found: Evidence) -> Judgement:
    """The verdict; *unknown* is never said where a family is established.

    Parameters
    ----------
    found : Evidence

    Returns
    -------
    Judgement
    """
    if found.p > ALPHA:
        return Judgement("nothing-missing")
    if found.established:
        return _of_established(found)
    if found.nothing > 0.5:
        return Judgement("nothing-missing")
    if found.best_gain is None or not found.best_gain > KEEP_ELPD:
        return Judgement("unknown")
    names = {name: share for name, share in found.shares.items() if name != "unknown"}
    likely = tuple(smallest_set(names))
    if likely and found.shares.get("unknown", 0.0) <= 1.0 - IN_SET:
        return Judgement("ambiguous", likely)
    return Judgement("unknown")


def _of_established(found: Evidence) -> Judgement:
    """The verdict where at least one family is established."""
    unnamed = [family for family in found.established if family.name is None]
    undecided = tuple(unnamed[0].members) if unnamed else ()
    if found.remainder_counts:
        return Judgement("partial", undecided)
    return Judgement("ambiguous", undecided) if undecided else Judgement("named")
