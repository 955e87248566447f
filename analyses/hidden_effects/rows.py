"""What the scores need of one case: its truth, what was possible and what was said, in one row."""

from __future__ import annotations

from typing import Any

from .rates import Row

NOTHING = "nothing-missing"
CONDITIONAL = 8.0  # delta beside the other effects from which one is expected to be named
LIKELY = 0.5  # probability above which a family is more likely than not
VISIBLE = 0.8  # share of delta that must survive a refit of the plain model for a case to count as visible


def case_row(truth: dict[str, Any], judged: dict[str, Any], record: dict[str, Any]) -> Row:
    """What the scores need of one case; the experiment that shows the effect most speaks for the file."""
    answers = record["answer"]["experiments"]
    spoken = answers[judged["bench"]]
    names = [e["name"] for e in truth["effects"]]
    groups = judged.get("groups", [])
    best = spoken.get("best")
    detected = spoken["verdict"] != NOTHING
    chosen = best if detected else NOTHING
    amplitudes = spoken.get("amplitudes") or {}
    hold = truth["effects"][0]["hold"] if truth["effects"] else None
    found_hold = (amplitudes.get(names[0]) or {}).get("hold") if names else None
    return {
        "key": truth["key"],
        "kind": truth["kind"],
        "protocol": truth["protocol"],
        "delta": truth["delta"],
        "names": names,
        "effect": names[0] if names else None,
        "law": truth["law"],
        "detected": detected,
        "any_alarm": any(a["verdict"] != NOTHING for a in answers.values()),
        "innocent": [a["verdict"] != NOTHING for n, a in answers.items() if n not in _touched(truth)],
        "chosen": chosen,
        "right": bool(names) and chosen == names[0],
        "right_group": any(chosen in group for group in groups[:1]),
        "claimed_group": bool(names) and names[0] in (spoken.get("group") or []),
        "in_set": bool(names) and names[0] in (spoken.get("set") or []),
        "set_size": len(spoken.get("set") or []),
        "accepted": list(spoken.get("accepted") or []),
        "wires": _wires(truth, groups, answers),
        "groups": groups,
        "conditional": [e.get("conditional_delta") for e in truth["effects"]],
        "remains": spoken["verdict"] in ("partial", "unknown"),
        "verdict": spoken["verdict"],
        "remainder": (spoken.get("remainder") or {}).get("probability"),
        "inclusion": dict(spoken.get("inclusion") or {}),
        "families": [
            {key: family.get(key) for key in ("members", "inclusion", "established")}
            for family in spoken.get("families") or []
        ],
        "optimal_two": judged.get("optimal_two") or {},
        "optimal_three": judged.get("optimal_three") or {},
        "optimal_mixed": judged.get("optimal_mixed") or {},
        "left_over": judged.get("left_over") or {},
        "blind": judged.get("blind") or {},
        "right_hold": None if hold is None or found_hold is None else found_hold == hold,
        "separable": judged.get("separable"),
        "visible": not names or judged["delta_after_refit"] >= VISIBLE * truth["delta"],
        "left": judged["delta_after_refit"] if names else None,
        "optimal": judged.get("optimal") or {},
        "held_out": _held_out(judged, spoken),
        "seconds": record["seconds"],
    }


def _wires(truth: dict[str, Any], groups: list[list[str]], answers: dict[str, Any]) -> list[dict[str, bool]]:
    """What was said of each experiment of a file: whether it carries an effect, and was given one's name or another."""
    out = []
    for name, answer in answers.items():
        own = [g for e, g in zip(truth["effects"], groups, strict=False) if name in e["experiments"]]
        accepted = list(answer.get("accepted") or [])
        out.append(
            {
                "carries": bool(own),
                "detected": answer["verdict"] != NOTHING,
                "named": any(a in g for a in accepted for g in own),
                "false_name": any(not any(a in g for g in own) for a in accepted),
            }
        )
    return out


def _touched(truth: dict[str, Any]) -> set[str]:
    return {name for e in truth["effects"] for name in e["experiments"]} if truth["effects"] else set(truth["benches"])


def _held_out(judged: dict[str, Any], spoken: dict[str, Any]) -> dict[str, float] | None:
    """Held-out squared errors in units of the case's noise floor, so that no case with large tensions rules."""
    reference, given = judged.get("held_out"), spoken.get("held_out")
    if not reference or not given or not given.get("plain") or not given.get("final"):
        return None
    floor = reference["floor"] ** 2
    return {
        "plain": given["plain"]["rmse_N"] ** 2 / floor,
        "final": given["final"]["rmse_N"] ** 2 / floor,
        "judge_plain": reference["plain"] ** 2 / floor,
        "oracle": reference["oracle"] ** 2 / floor,
        "same_holds": float(list(given.get("holds", [])) == list(judged["held_out_holds"].get(judged["bench"], []))),
    }


def false_names(row: Row) -> list[str]:
    """Accepted names outside the group of everything that is hidden."""
    return [name for name in row["accepted"] if not any(name in group for group in row["groups"])]


def accepted_of_group(row: Row) -> list[bool]:
    """For each hidden effect whether it, or one whose signature is nearly the same, was accepted."""
    return [any(name in group for name in row["accepted"]) for group in row["groups"]]


def likely_of_group(row: Row) -> list[bool]:
    """For each hidden effect whether a family that is more likely than not has it, or one whose signature is the same.

    The families of the median probability model (Barbieri and Berger 2004): the judge's most probable set, of which he
    need not be sure, is compared with these.
    """
    likely = [family["members"] for family in row["families"] if family["inclusion"] > LIKELY]
    return [any(name in group for members in likely for name in members) for group in row["groups"]]


def unknown_or_its_group(row: Row) -> bool:
    """Whether an effect without a name was called unknown, or by a name whose signature is nearly the same.

    Called unknown it is by the verdict, or where *unknown* is more probable than any name.
    """
    return row["verdict"] == "unknown" or row["chosen"] == "unknown" or bool(row["right_group"])


def visible_beside(row: Row) -> list[bool]:
    """For each hidden effect whether enough of it is left beside the others for it to be named."""
    return [d is not None and d >= CONDITIONAL for d in row["conditional"]]
