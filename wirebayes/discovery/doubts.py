"""What a search says against its own final model: what is likely and not established, or samples that differ."""

from collections.abc import Sequence

from wirebayes.discovery.apart import APART, REFITTED
from wirebayes.discovery.settings import REMAINS
from wirebayes.json_files.discovery import SharedFindings
from wirebayes.result_warnings import Notice
from wirebayes.sentences import p_in_words

_LACKING = ("named", "ambiguous")  # of the other verdicts the final model has a discrepancy, or nothing is missing


def likely_beside(found: SharedFindings) -> list[Notice]:
    """A notice of families that are more likely missing than not, and of what no effect explains.

    Where a drift of the sensor beside a toe was missing with 73 %, the toe was named, and a final model without the
    drift gave a creep rate 17 standard deviations off.

    Parameters
    ----------
    found : dict
        Of one experiment, as in ``discovery.json``.
    """
    if found["verdict"] not in _LACKING:
        return []
    inside = {*found["accepted"], *found["set"]}
    said = []
    for family in found["families"]:
        if family["inclusion"] > REMAINS and not family["established"] and inside.isdisjoint(family["members"]):
            said.append(family["sentence"])
    remains = found["remainder"]["probability"]
    if remains > REMAINS:
        said.append(f"something that no effect explains remains, {100 * remains:.0f} %")
    if not said:
        return []
    text = (
        f"likely missing too, but not established: {'; '.join(said)}; the final model does without, so that its "
        "intervals and predictions can be wrong by more than they say"
    )
    return [Notice("incomplete", text)]


def samples_differ(p: float | None, samples: Sequence[str]) -> list[Notice]:
    """A notice that samples differ which a search takes to be alike.

    Four plain specimens whose stiffness differed by 4 % were told that something unknown is missing.

    Parameters
    ----------
    p : float or None
        Probability of samples that seem to differ as much, were they alike; None of a single one.
    samples : sequence of str
        Those of one material.
    """
    if p is None or p > APART:
        return []
    text = (
        f"the {len(samples)} samples differ ({p_in_words(p, REFITTED)}), and the search takes k1, B, U, k2 and N to "
        "be those of one line in all of them: what it finds may be their difference, and intervals and predictions can "
        f"be wrong by more than they say; search each by itself (--experiment {samples[0]})"
    )
    return [Notice("incomplete", text)]
