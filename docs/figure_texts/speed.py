"""Studies of what commands and samplers cost."""

from statistics import median
from typing import Any

from figure_texts.tables import run_of, table_head, table_row, three_digits


def seconds_of_commands(kept: dict[str, Any]) -> str:
    """Sentences on whole commands, and a table of the phases of a fit."""
    found = kept["result"]

    def said(command: str) -> str:
        *first, last = [f"{seconds:.1f}" for seconds in found["whole"][command].values()]
        return f"{', '.join(first)} and {last} s"

    lines = [
        f"{run_of(kept)}, the least of {found['runs']} runs each: on two cores a whole ``fit`` of the paper's wires "
        f"takes {said('fit')} by the clock, and a whole ``discover`` {said('discover')}. What each second of the "
        f"``fit`` of {found['wire']} is:",
        "",
    ]
    lines += table_head("phase", "from, s", "to, s")
    for phase, (begin, end) in found["phases"].items():
        lines += table_row(phase, f"{max(begin, 0.0):.2f}", f"{end:.2f}")
    return "\n".join(lines) + "\n"


_GROWTHS = ("readings", "holds", "experiments")  # what the cost of an evaluation grows with
_DRAWS = {
    "ess_per_kept_evaluation": "after burn-in",
    "ess_per_evaluation": "all counted",
    "ess_of_means_per_kept_evaluation": "means, after burn-in",
    "ess_of_means_per_evaluation": "means, all counted",
}


def cost_in_short(found: dict[str, Any]) -> dict[str, Any]:
    """Of the costs of evaluations and draws: what the texts say."""
    first_and_last, peaks = {}, []
    for of in _GROWTHS:
        rows = found[of]
        first_and_last[of] = [[row["size"], row["us"]] for row in (rows[0], rows[-1])]
        peaks += [row["peak_bytes"] for row in rows]
    draws = {}
    for case, by_key in found["draws"].items():
        draws[case] = {key: [min(of), median(of), max(of)] for key, of in by_key.items()}
    with_effects = {}
    for wire, by_effect in found["with_effects"].items():
        an_evaluation = [ess for ess, _ in by_effect.values()]
        with_effects[wire] = {"median": median(an_evaluation), "least": min(an_evaluation)}
    return {
        "first_and_last": first_and_last,
        "most_megabytes": max(peaks) / 1e6,
        "effects": found["effects"],
        "against_numpy": found["against_numpy"],
        "share": found["share"],
        "draws": draws,
        "with_effects": with_effects,
    }


def draws_an_evaluation(kept: dict[str, Any]) -> str:
    """A table of effective draws an evaluation of the paper's wires, and a sentence on models with an effect."""
    found = kept["result"]
    lines = [
        f"{run_of(kept)}, twenty seeds, smallest, median and largest:",
        "",
        *table_head("posterior", *_DRAWS.values()),
    ]
    for case, by_key in found["draws"].items():
        cells = []
        for key in _DRAWS:
            least, middle, most = by_key[key]
            cells.append(f"{least:.2f}, {middle:.2f}, {most:.2f}")
        lines += table_row(case, *cells)
    each = found["with_effects"].values()
    medians, least = (", ".join(f"{wire[of]:.2g}" for wire in each) for of in ("median", "least"))
    lines += [
        "",
        f"With single effects it is, all counted, {medians} in the median of the catalogue on the four wires, and",
        f"{least} at least (one seed).",
    ]
    return "\n".join(lines) + "\n"


def cost_of_an_evaluation(kept: dict[str, Any]) -> str:
    """A paragraph on microseconds, and a table of numpy's time over that of compiled code."""
    found = kept["result"]
    ends = found["first_and_last"]
    readings, holds, experiments = (
        " and ".join(f"{three_digits(us)} µs for {size}" for size, us in ends[of]) for of in _GROWTHS
    )
    ratios = {name.replace("_", " "): ratio for name, ratio in found["effects"].items() if name != "none"}
    dearest = sorted(ratios, key=ratios.__getitem__, reverse=True)[:3]
    said = ", ".join(f"{name} {ratios[name]:.1f}" for name in dearest)
    shares = "; ".join(
        f"{likelihood}: {100 * share['likelihood']:.0f} % likelihood, "
        f"{100 * share['coordinates_and_prior']:.0f} % coordinates and prior, {100 * share['sampler']:.0f} % the rest"
        for likelihood, share in found["share"].items()
    )
    batches = ("64", "256", "1,024")
    lines = [
        f"{run_of(kept)}: of 12 holds an evaluation takes {readings} readings a hold; of 5 readings a hold",
        f"{holds} holds; of 12 holds of 5 readings {experiments} experiments. The largest batch takes",
        f"{found['most_megabytes']:.0f} MB. Of the effects the dearest take so many times as long as none: {said}; the",
        f"median is {median(ratios.values()):.1f}. Where the time of a fit goes ({shares}).",
        "",
        "Where nothing was compiled, or for an effect of your own, numpy takes so many times as long:",
        "",
        *table_head("model", *(f"batch of {size}" for size in batches)),
    ]
    for name, each in found["against_numpy"].items():
        lines += table_row("plain" if name == "none" else name, *(f"{ratio:.1f}" for ratio in each))
    return "\n".join(lines) + "\n"
