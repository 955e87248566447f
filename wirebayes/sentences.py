"""Pieces of the sentences that people read on a terminal, on a page and in a message."""

from collections.abc import Callable, Sequence

from wirebayes.json_files.discovery import Answer


def listed(words: Sequence[str], last: str = "and") -> str:
    """Words as a sentence lists them."""
    if len(words) < 2:
        return words[0] if words else "nothing"
    return f"{', '.join(words[:-1])} {last} {words[-1]}"


def likely(found: Answer, spoken: Callable[[str], str] = str) -> str:
    """Names of the set among which the largest share lies, each with its probability; empty where there is no name.

    Parameters
    ----------
    found : dict
        Of one experiment, as in ``discovery.json``.
    spoken : function of str, optional
        How a name is written.
    """
    shares = [(name, found["probabilities"][name]) for name in found["set"] if name in found["probabilities"]]
    ranked = sorted(shares, key=lambda item: -item[1])
    if all(name == "unknown" for name, _ in ranked):
        return ""
    return listed([f"{'nothing known' if n == 'unknown' else spoken(n)} ({100 * p:.0f} %)" for n, p in ranked], "or")
