"""What other samplers made of the posteriors that wirebayes samples."""

from collections.abc import Iterable
from math import exp, sqrt
from statistics import median
from typing import Any

from figure_texts.tables import run_of, table_head, table_row, three_digits

BY_CHANCE = 5.0  # standard errors by which means of right samplers may differ


def samplers_in_short(found: dict[str, Any]) -> dict[str, Any]:
    """Of every sampler of the same posteriors: its rates, those of wirebayes over them, and whether it is right."""
    cases = {}
    for case in found["cases"]:
        beside = zip(case["peers"].items(), case["ours"], strict=True)
        cases[case["case"]] = {
            "log_density_difference": case["log_density_difference"],
            "per_cpu_s": median(run["all_costs_per_cpu_s"] for run in case["ours"]),
            "sampling_per_cpu_s": median(run["sampling_per_cpu_s"] for run in case["ours"]),
            "converged": sum(run["converged"] for run in case["ours"]),
            "runs": len(case["ours"]),
            "peers": {name: _peer_in_short(peer, ours) for (name, peer), ours in beside},
        }
    return {"minutes": found["minutes"], "wanted_ess": found["wanted_ess"], "cases": cases}


def _peer_in_short(peer: dict[str, Any], ours: dict[str, Any]) -> dict[str, Any]:
    """What a table says of a peer: the run of wirebayes beside it is that with which its means are compared."""
    if "why" in peer:
        return {"converged": False, "why": peer["why"]}
    standard_error = sqrt(1.0 / peer["ess_of_means"] + 1.0 / ours["ess_of_means"])
    return {
        "converged": peer["converged"],
        "divergences": peer["divergences"],
        "r_hat": peer["r_hat"],
        "ess": peer["ess"],
        "per_cpu_s": peer["all_costs_per_cpu_s"],
        "sampling_per_cpu_s": peer["sampling_per_cpu_s"],
        "ratio": peer.get("ratio_all_costs_cpu"),
        "sampling_ratio": peer.get("ratio_sampling_cpu"),
        "mean_in_sd": peer["agreement"]["mean_in_sd"],
        "log_sd": peer["agreement"]["log_sd"],
        "standard_errors": peer["agreement"]["mean_in_sd"] / standard_error,
    }


def against_other_samplers(kept: dict[str, Any]) -> str:
    """A table of effective draws a second, a row for each sampler and a column for each posterior."""
    cases = kept["result"]["cases"]
    right, off, others = _peers_by_answer(cases)
    peers = len(right) + len(off) + len(others)
    runs, converged = (sum(case[of] for case in cases.values()) for of in ("runs", "converged"))
    (least, most), (least_after, most_after) = (_span(right.values(), of) for of in ("ratio", "sampling_ratio"))
    lines = [
        f"{run_of(kept)}: {converged} of {runs} runs of wirebayes converged, and {len(right)} of {peers} of its",
        f"peers, to the same means. Beside these wirebayes made {least} to {most} times as many effective draws with",
        f"all costs counted, {least_after} to {most_after} times after burn-in.",
        "",
        *table_head("sampler", *cases),
        *table_row("wirebayes (median)", *(three_digits(case["per_cpu_s"]) for case in cases.values())),
    ]
    for name in next(iter(cases.values()))["peers"]:
        lines += table_row(name, *(_cell(case["peers"][name]) for case in cases.values()))
    return "\n".join(lines) + "\n"


def other_samplers_agree(kept: dict[str, Any]) -> str:
    """A paragraph on how far draws of other samplers lie from ours."""
    cases = kept["result"]["cases"]
    right, off, _ = _peers_by_answer(cases)
    density = max(case["log_density_difference"] for case in cases.values())
    mean, log_sd, errors = (
        max(peer[of] for peer in right.values()) for of in ("mean_in_sd", "log_sd", "standard_errors")
    )
    lines = [
        f"{run_of(kept)}: the log densities differ by at most {density:.0e}. Of {len(right) + len(off)} runs of other",
        f"samplers that converged {len(right)} agree with ours: means within {mean:.3f} posterior standard deviations",
        f"or {errors:.1f} standard errors of both, the logarithms of the standard deviations within {log_sd:.3f}.",
    ]
    for (sampler, case), peer in off.items():
        lines.append(f"{sampler}, is off by {peer['mean_in_sd']:.2f} standard deviations on {case}.")
    return "\n".join(lines) + "\n"


Peers = dict[tuple[str, str], dict[str, Any]]  # by sampler and case


def _peers_by_answer(cases: dict[str, Any]) -> tuple[Peers, Peers, Peers]:
    """Those that are right, those that converged and are off, and the others."""
    every = {(name, case): peer for case, found in cases.items() for name, peer in found["peers"].items()}
    converged = {of: peer for of, peer in every.items() if peer["converged"]}
    off = {of: peer for of, peer in converged.items() if _is_off(peer)}
    right = {of: peer for of, peer in converged.items() if of not in off}
    return right, off, {of: peer for of, peer in every.items() if of not in converged}


def _span(peers: Iterable[dict[str, Any]], of: str) -> tuple[str, str]:
    ratios = [peer[of] for peer in peers]
    return three_digits(min(ratios)), three_digits(max(ratios))


def _is_off(peer: dict[str, Any]) -> bool:
    return peer["standard_errors"] > BY_CHANCE


def _cell(peer: dict[str, Any]) -> str:
    """A peer's rate and the ratios of ours to its own, or why it has none."""
    if "why" in peer:
        return "! not run"
    if peer["divergences"]:
        return f"! {peer['divergences']:,} divergences"
    if not peer["converged"]:
        return f"! R-hat {peer['r_hat']:.3f}, {three_digits(peer['ess'])} draws"
    ratios = f"{three_digits(peer['ratio'])}; {three_digits(peer['sampling_ratio'])}"
    spread = exp(peer["log_sd"])
    off = f", off by {peer['mean_in_sd']:.2f} sd, a spread by a factor of {spread:.1f}" if _is_off(peer) else ""
    return f"{three_digits(peer['per_cpu_s'])} ({ratios}){off}"
