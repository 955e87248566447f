"""What a search says against its own final model: what is likely and not established, or samples that differ."""

from collections.abc import Sequence

from wirebayes.discovery.apart import APART, REFITTED
from wirebayes.discovery.settings import REMAINS
from wirebayes.io.experiment import Experiment
from wirebayes.json_files.discovery import SharedFindings
from wirebayes.result_warnings import Notice
from wirebayes.sentences import listed, p_in_words, spoken
from wirebayes.wire.effect import Effect

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


def lengths_or_samples(effects: Sequence[Effect], experiments: Sequence[Experiment]) -> list[Notice]:
    """A notice of effects that only a comparison of lengths shows, where each length has one sample.

    Samples whose stiffness differed by 10 % were told of a bench that deforms, and those whose creep differed by 40 %
    of a creep that depends on the length.

    Parameters
    ----------
    effects : sequence of Effect
        Of the final model of one material, without those that tests of other materials show, too.
    experiments : sequence of Experiment
        Of that material.
    """
    lengths = [one.length_mm for one in experiments]
    if len(set(lengths)) < len(lengths):
        return []
    protocols = [one.protocol() for one in experiments]
    shown = []
    for effect in effects:
        shows_in_one = any(effect.variants([protocol]) for protocol in protocols)
        if not shows_in_one and effect.variants(protocols):
            shown.append(spoken(effect.name))
    if not shown:
        return []
    text = (
        f"{listed(shown)} can show only where samples of several lengths are compared, and each length has one sample: "
        "samples that by themselves differ in stiffness or creep look the same, and what is computed for other "
        "lengths can be wrong by more than it says; test two samples of one length"
    )
    return [Notice("incomplete", text)]
