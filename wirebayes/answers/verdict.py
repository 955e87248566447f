"""A verdict without the names of effects, in words."""

from wirebayes.json_files.discovery import ExperimentFindings

_NAMED = {
    "nothing-missing": "nothing is missing",
    "unknown": "something is missing that no effect in the catalogue explains",
}
# with fewer than three holds, where no effect of the catalogue can be established or ruled out
_FEW_HOLDS = {"nothing-missing": "nothing stands out", "unknown": "something is missing; so few holds do not say what"}


def verdict_in_words(report: ExperimentFindings) -> str | None:
    """Of a verdict without names; None for the others."""
    few = any(warning["kind"] == "few-holds" for warning in report.get("warnings", []))
    return (_FEW_HOLDS if few else _NAMED).get(report["verdict"])
