"""A verdict in words, and what an effect is."""

from wirebayes.effects import CATALOGUE
from wirebayes.json_files.comparison import ComparedModel, ComparedModels, Difference
from wirebayes.json_files.discovery import AmplitudeEstimate, ExperimentFindings
from wirebayes.json_files.read_units import unit_read
from wirebayes.sentences import likely, short, spoken
from wirebayes.wire.protocol import Control

_NAMED = {
    "nothing-missing": "nothing is missing that these readings can show",
    "unknown": "something is missing that no effect in the catalogue explains",
}
# of names that are likely, none of which is established
UNSURE = "something is missing that has no established name"
# with fewer than three holds, where no effect of the catalogue can be established or ruled out
_FEW_HOLDS = {"nothing-missing": "nothing stands out", "unknown": "something is missing; so few holds do not say what"}


def verdict_in_words(report: ExperimentFindings) -> str | None:
    """The sentence for a verdict without names; None for the others."""
    few = any(warning["kind"] == "few-holds" for warning in report.get("warnings", []))
    if report["verdict"] == "unknown" and not few and likely(report):
        return UNSURE
    words = _FEW_HOLDS if few else _NAMED
    return words.get(report["verdict"])


def control_judged(report: ExperimentFindings) -> Control:
    """What was set in an experiment that was searched: what is read in mm is read under weights."""
    return "force" if unit_read(report["held_out"]["plain"]) == "mm" else "displacement"


def median_between(size: AmplitudeEstimate) -> tuple[float, float, float]:
    """The median of an effect's size, and the ends of its interval; the mean where an older file has no median.

    A size whose upper end the readings leave open has a mean far from where it probably lies.
    """
    return size.get("q50", size["mean"]), size["q05"], size["q95"]


def what_it_is(effect: str, control: Control = "displacement") -> str:
    """An effect of the catalogue as the part of a sentence; empty for a user's own."""
    kind = CATALOGUE.get(effect.partition("@")[0])
    if kind is None:
        return ""
    first = kind.sentence_under(control).split(". ")[0].rstrip(".")
    return first[:1].lower() + first[1:]


def models_ranked(table: ComparedModels) -> list[ComparedModel]:
    """The models that can be ranked, best first: those that are scored on the same readings."""
    rows = [row for row in table["models"] if row["failed"] is None]
    return [row for row in rows if row.get("scored") == rows[0].get("scored")]


def better_beside(table: ComparedModels) -> list[str]:
    """Sentences on models that cannot be ranked, and predict better where the same readings compare them."""
    names = [row["name"] for row in models_ranked(table)]
    out = []
    for row in table["models"]:
        gain = row.get("given_first_difference")
        known = gain is not None and gain["se"] is not None  # of one hold there is no error
        if row["name"] in names or not gain or not known:
            continue
        if gain["elpd"] > 0 and is_more_than_chance(gain):
            size = f"{short(gain['elpd'], 2)} ± {short(gain['se'], 2)}"
            out.append(
                f"{spoken(row['name'])} is scored on other readings and not ranked; given the first reading of each of "
                f"the last holds it predicts better than {spoken(table['base'])}, by {size} elpd"
            )
    return out


def lead_may_be_chance(table: ComparedModels) -> bool:
    """Whether the model that predicts best is ahead of the one that all are compared with by no more than chance."""
    best = next((row for row in table["models"] if row["failed"] is None), None)
    if best is None or best["name"] == table.get("base"):
        return False
    gain = best.get("difference")
    return gain is not None and not is_more_than_chance(gain)


def is_more_than_chance(gain: Difference) -> bool:
    """Whether a difference of elpd means anything."""
    from wirebayes.comparison.compare import meaningful  # loaded by now, and by no other command

    return meaningful(gain["elpd"], gain["se"])
