"""What a search says against its own final model: what is likely and not established, or samples that differ."""

from collections.abc import Sequence

from wirebayes.discovery.settings import REMAINS
from wirebayes.json_files.discovery import SharedFindings
from wirebayes.result_warnings import Notice

_UNNAMED = ("unknown", "partial")
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


def samples_may_differ(found: SharedFindings, samples: Sequence[str]) -> list[Notice]:
    """A notice that what has no name may be a difference between samples, which a search takes to be alike.

    Parameters
    ----------
    found : dict
        Of one experiment, as in ``discovery.json``.
    samples : sequence of str
        Those of its material.
    """
    if found["verdict"] not in _UNNAMED or len(samples) == 1:
        return []
    text = (
        f"what has no name may be that the {len(samples)} samples differ: k1, B, U, k2 and N are taken to be those of "
        f"one line in all of them; search each by itself (--experiment {samples[0]})"
    )
    return [Notice("left-out", text)]
