"""What is right over what is possible, and families: rows of the table of targets.

Possible is what an ideal judge reaches who has to estimate the noise (`optimal_blind`), on the same files.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from .rates import Row, rate, share_of
from .rows import accepted_of_group, likely_of_group, unknown_or_its_group, visible_beside
from .target import Target, at_least, at_most, number

WANTED = 0.90  # of the judge's rate
DELTAS = (5.0, 10.0)


def shares(rows: list[Row]) -> Iterator[Target]:
    """Each rate over the judge's."""
    of = {kind: [r for r in rows if r["kind"] == kind] for kind in ("two", "periodic", "mixed", "without", "foreign")}
    for delta in DELTAS:
        seen = [r for r in rows if r["kind"] == "single" and r["delta"] == delta and r["detected"]]
        yield _share(f"one of the true group first, delta {delta:g}", seen, lambda r: r["right_group"], "named")
    for kind, label in (("two", "two effects"), ("periodic", "a periodic error and an elastic curve")):
        apart = [r for r in of[kind] if all(visible_beside(r))]
        yield _share(f"{label}: both accepted", apart, lambda r: all(accepted_of_group(r)), "all")
        yield _share(
            f"{label}: both accepted, where it is as sure", apart, lambda r: all(accepted_of_group(r)), "all_sure"
        )
        yield _share(f"{label}: both more likely than not", apart, lambda r: all(likely_of_group(r)), "all")
    known = [r for r in of["mixed"] if visible_beside(r)[0]]
    yield _share("beside a foreign effect: the known one accepted", known, lambda r: accepted_of_group(r)[0], "known")
    accepted = "beside a foreign effect: the known one accepted, where it is as sure"
    yield _share(accepted, known, lambda r: accepted_of_group(r)[0], "known_sure")
    likely = "beside a foreign effect: the known one more likely than not"
    yield _share(likely, known, lambda r: likely_of_group(r)[0], "known")
    yield _share("beside a foreign effect: a remainder is likely", of["mixed"], _remainder_is_likely, "remains")
    for kind, label in (("without", "effect removed"), ("foreign", "effect in no catalogue")):
        seen = [r for r in of[kind] if r["delta"] >= 8 and r["detected"]]
        yield _share(f"{label}: unknown or its group", seen, unknown_or_its_group, "right")


def _remainder_is_likely(row: Row) -> bool:
    return (row["remainder"] or 0.0) > 0.5


def _share(name: str, rows: list[Row], right: Callable[[Row], bool], key: str) -> Target:
    judged = [r for r in rows if key in r["blind"]]
    found = share_of([right(r) for r in judged], [r["blind"][key] for r in judged])
    return at_least(f"of the judge's rate: {name}", found, WANTED)


def families(rows: list[Row]) -> Iterator[Target]:
    """Whether the first family is right, how many members it has, and what is said beside an established one."""
    single = [r for r in rows if r["kind"] == "single" and r["detected"]]
    for delta in DELTAS:
        first = [(r["families"][0]["members"], r["effect"]) for r in single if r["delta"] == delta and r["families"]]
        held = rate(effect in members for members, effect in first)
        yield at_least(f"the first family holds the true effect, delta {delta:g}", held, 0.85)
        yield number(f"members of the first family, delta {delta:g}", [len(members) for members, _ in first])
    established = [r for r in rows if any(family["established"] for family in r["families"])]
    contradicted = rate(r["verdict"] == "unknown" for r in established)
    yield at_most("unknown, although a family is established", contradicted, 0.0)
    near = [r for r in single if r["effect"] == "superposition" and r["separable"]]
    yield at_least("superposition told apart from the name nearest to it", rate(r["right"] for r in near), 0.85)
    none = [r for r in rows if not any("screw_error" in group for group in r["groups"])]
    yield at_most("a screw error named where there is none", rate("screw_error" in r["accepted"] for r in none), 0.04)


def alarms_on_clean(rows: list[Row]) -> list[float]:
    """Final over plain error on the held-out holds of clean files that raise an alarm."""
    loud = [r["held_out"] for r in rows if r["kind"] == "clean" and r["any_alarm"] and r["held_out"]]
    return [float(np.sqrt(held["final"] / held["plain"])) for held in loud]
