"""A verdict in words, and what an effect is."""

from wirebayes.effects import CATALOGUE
from wirebayes.json_files.discovery import ExperimentFindings

_NAMED = {
    "nothing-missing": "nothing is missing that these readings can show",
    "unknown": "something is missing that no effect in the catalogue explains",
}
# with fewer than three holds, where no effect of the catalogue can be established or ruled out
_FEW_HOLDS = {"nothing-missing": "nothing stands out", "unknown": "something is missing; so few holds do not say what"}


def verdict_in_words(report: ExperimentFindings) -> str | None:
    """Of a verdict without names; None for the others."""
    few = any(warning["kind"] == "few-holds" for warning in report.get("warnings", []))
    words = _FEW_HOLDS if few else _NAMED
    return words.get(report["verdict"])


def what_it_is(effect: str) -> str:
    """An effect of the catalogue as the part of a sentence; empty for a user's own."""
    kind = CATALOGUE.get(effect.partition("@")[0])
    if kind is None:
        return ""
    first = kind.sentence.split(". ")[0].rstrip(".")
    return first[:1].lower() + first[1:]
