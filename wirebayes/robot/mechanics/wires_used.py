"""Which wires an answer is for, as its JSON and its sentences say it."""

from collections import Counter

import numpy as np

from wirebayes.json_files.pose import ModelShare, Specimens, WiresUsed
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.draws import CORE, UndecidedModels, WireDraws
from wirebayes.sentences import listed, short, spoken


def wires_summary(robot: Robot, line: WireDraws) -> WiresUsed:
    """The wires that an answer is for, as ``pose.json`` says it."""
    kept = line.material()
    used: WiresUsed = {
        "draws": line.count,
        "tested_length_mm": line.length_mm if line.name else None,
        "elastic_law": line.law,
        "history": line.history,
        "effects": [e.key for e in kept],
        "left_out": [e.key for e in line.effects if e not in kept],
        "legs": list(robot.wire),
        "lines": [name for name in line.each if name],
    }
    several = {name: _specimens(one) for name, one in line.each.items() if one.spread}
    if several:
        used["specimens"] = several
    undecided = {name: _shares_of(one.undecided) for name, one in line.each.items() if one.undecided}
    if undecided:
        used["undecided"] = undecided
    return used


def _shares_of(undecided: UndecidedModels) -> list[ModelShare]:
    """The models, those alike away from the bench as one, with their shares of the draws; the largest first."""
    of_draw = [undecided.models[model] for model in undecided.of_draw.tolist()]
    counted = Counter(of_draw).most_common()
    return [{"effects": list(effects), "share": count / len(of_draw)} for effects, count in counted]


def _specimens(line: WireDraws) -> Specimens:
    """How many were tested, and how much they differ."""
    spread = {name: np.quantile(draws, [0.05, 0.5, 0.95]).tolist() for name, draws in line.spread.items()}
    return {
        "tests": line.specimens,
        "spread": {name: {"q05": low, "q50": middle, "q95": high} for name, (low, middle, high) in spread.items()},
    }


def specimens_in_words(wires: WiresUsed) -> list[str]:
    """A sentence for each line whose spread was estimated, of `wires_summary`'s content.

    Parameters
    ----------
    wires : WiresUsed
        ``wires`` of ``pose.json``.
    """
    sentences = []
    for name, one in wires.get("specimens", {}).items():
        shares = []
        for parameter in CORE:
            low, middle, high = (100 * one["spread"][parameter][key] for key in ("q05", "q50", "q95"))
            shares.append(f"{parameter} by {short(middle, 2)} % ({short(low, 2)} to {short(high, 2)} %)")
        sentences.append(f"Specimens of {name} differ as estimated from {one['tests']} tests: {', '.join(shares)}.")
    return sentences


def undecided_in_words(wires: WiresUsed) -> list[str]:
    """A sentence for each line whose draws are of several models, of `wires_summary`'s content.

    Parameters
    ----------
    wires : WiresUsed
        ``wires`` of ``pose.json``.
    """
    sentences = []
    for models in wires.get("undecided", {}).values():
        if len(models) == 1:  # they differ in what the bench did
            continue
        parts = []
        for model in models:
            effects = " with ".join(spoken(effect) for effect in model["effects"]) or "none of them"
            parts.append(f"{effects} ({short(100 * model['share'], 2)} %)")
        sentences.append(f"The test leaves undecided which effects the wire has: draws are of {listed(parts)}.")
    return sentences
