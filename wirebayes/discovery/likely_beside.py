"""What is likely missing beside what was named, and not established: the final model does without it."""

from wirebayes.discovery.settings import REMAINS
from wirebayes.json_files.discovery import SharedFindings
from wirebayes.result_warnings import Notice

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
