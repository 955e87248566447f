"""Studies of posteriors: their intervals, bands and ranks."""

from typing import Any

from figure_texts.tables import run_of, table_head, table_row, three_digits


def intervals_at_any_scale(kept: dict[str, Any]) -> str:
    """A table of intervals from thread to mooring rope, under steps and under weights."""
    found = kept["result"]
    kinds = {"all": "all tests", "steps": "steps", "weights": "weights", "rests": "with recorded rests"}
    names = [name for name in found["all"] if name != "tests"]
    lines = [
        f"{run_of(kept)}; {found['not_converged']} of "
        f"{found['tests']} did not converge. Shares of 90 % intervals that hold the truth, in %:",
        "",
        *table_head("tests", "number", *names),
    ]
    for kind, words in kinds.items():
        lines += table_row(words, found[kind]["tests"], *(f"{100 * found[kind][name]:.0f}" for name in names))
    return "\n".join(lines) + "\n"


_RECORDINGS = {
    "tendon": "the relaxation of a tendon fascicle, as ``import`` makes a hold of it: the hold begins in the middle of "
    "the ramp, and what followed the ramp by less than its time is left out",
    "tendon_by_hand": "the same relaxation as somebody wrote it down, from the end of the ramp and all of it",
    "pull": "a strip of VHB 4910 that is pulled at constant speed and never held, as a staircase of short holds with "
    "N = 1, U = 1 and no preload",
    "elastomer": "the relaxation of such a strip, which follows a power law",
}


_MODELS = {"preload_known": "without a preload", "preload_open": "with one", "linear": ""}


def public_recordings(kept: dict[str, Any]) -> str:
    """A paragraph on each public recording."""
    lines = [f"{run_of(kept)} reads public recordings."]
    for file, found in kept["result"].items():
        plain, later = found["least_squares"], found["later"]
        numbers = ", ".join(f"{name} {three_digits(plain[name])}" for name in ("k1", "k2", "N") if name in plain)
        fit, band, by_draws, by_plain = (
            _milli(value)
            for value in (plain["rms_N"], later["band_N"], later["posterior_rms_N"], later["least_squares_rms_N"])
        )
        intervals = "; ".join(_intervals(called, one) for called, one in found["posterior"].items())
        lines += [
            "",
            f"*{file.replace('_', ' ').capitalize()}*: {_RECORDINGS[file]}; {found['readings']} readings in "
            f"{found['duration_s']:.0f} s. Least squares, without a preload, find {numbers}, fit to {fit}, and do not "
            f"say what these are worth. 90 % intervals: {intervals}. From the first third of the time, "
            f"{later['in_band_90']} of {later['readings']} later readings lie in their 90 % bands, {band} wide on "
            f"average{_or_not(later)}; rms {by_draws}, least squares {by_plain}.",
        ]
    return "\n".join(lines) + "\n"


def _intervals(called: str, posterior: dict[str, Any]) -> str:
    """Of the parameters of a fit, with what is wrong with it."""
    names = [name for name in ("k1", "k2", "N") if name in posterior]
    ends = ((name, posterior[name][0], posterior[name][2]) for name in names)
    each = ", ".join(f"{name} {three_digits(low)} to {three_digits(high)}" for name, low, high in ends)
    p = f"model check p = {posterior['model_check']:.2g}"
    return " ".join(filter(None, [each, _MODELS[called], f"({p}{_or_not(posterior)})"]))


def _or_not(fit: dict[str, Any]) -> str:
    return "" if fit["converged"] else ", of a fit that did not converge"


def _milli(newtons: float) -> str:
    """Two digits, in mN."""
    return f"{float(f'{1000 * newtons:.2g}'):g} mN"


def steps_and_weights(kept: dict[str, Any]) -> str:
    """A paragraph on one wire under steps and under weights."""
    found = kept["result"]
    steps, weights, together = (found[kind] for kind in ("steps", "weights", "together"))
    inside = f"{steps['inside']}, {weights['inside']} and {together['inside']} of {found['pairs']}"
    widths = " and ".join(f"{kind['median_width']:.3f}" for kind in (steps, weights))
    return (
        f"{run_of(kept)} fits {found['pairs']} such lines under "
        f"steps, under weights, and both together: the 90 % interval of the creep after a hold at the typical "
        f"tension holds the truth in {inside}; its median width, in the logarithm, is {widths}, together "
        f"{together['median_width']:.3f}, and both together give the narrowest in {found['together_sharpest']}.\n"
    )


def intervals_and_bands(kept: dict[str, Any]) -> str:
    """A paragraph on intervals and bands."""
    found = kept["result"]
    each = ", ".join(f"{name} {100 * share:.0f} %" for name, share in found["by_parameter"].items())
    return (
        f"{run_of(kept)} simulates {found['wires']} tests with varied "
        f"lengths, steps, directions and reading times. {100 * found['interval_coverage']:.1f} % of "
        f"{found['intervals']} intervals of 90 % contained the truth ({each}), and 90 % bands for the last third of "
        f"the holds contained {100 * found['held_out_coverage']:.1f} % of {found['held_out_readings']} readings. "
        f"{found['not_converged']} of {found['wires']} did not converge.\n"
    )


def intervals_whatever_the_protocol(kept: dict[str, Any]) -> str:
    """A paragraph and a table of intervals by protocol, and by whether the wire went slack."""
    found = kept["result"]
    names = [name for name in found["shares"]["taut throughout"] if name != "tests"]
    lines = [
        f"{run_of(kept)}; {found['not_converged']} of {found['tests']} did not converge; a fit takes",
        f"{found['median_evaluations']:.0f} evaluations in the median and {found['most_evaluations']} at most.",
        "Shares of 90 % intervals that hold the truth, in %:",
        "",
        *table_head("tests", "number", *names),
    ]
    for group, shares in found["shares"].items():
        lines += table_row(group, shares["tests"], *(f"{100 * shares[name]:.0f}" for name in names))
    return "\n".join(lines) + "\n"


def ranks(kept: dict[str, Any]) -> str:
    """A paragraph on the ranks of truths."""
    found = kept["result"]
    worst = min(found["extremeness"], key=found["extremeness"].get)
    edge = max(found["threshold"].values())
    quantities = (
        f"{found['quantities']} quantities (every parameter and the joint log-likelihood, by protocol and likelihood)"
    )
    inside = (
        f"All {quantities} stay" if found["inside"] else f"Of {quantities} all but {', '.join(found['outside'])} stay"
    )
    sound = {name: count for name, count in found["data_sets"].items() if not name.endswith("broken")}
    stopped = sum(len(found["not_converged"][name]) for name in sound)
    caught = ", ".join(found["broken"]["outside"])
    tail, joint = found["extremeness"][worst], 100 * found["joint"]
    return (
        f"{run_of(kept)} takes {len(sound)} times {min(sound.values())} wires. {inside} inside a band that contains "
        f"all jointly with probability {joint:.0f} %; the most extreme is {worst} (tail probability {tail:.1g}; "
        f"the edge of the band is at {edge:.1g}). {stopped} of the {sum(sound.values())} fits did not converge; "
        "they are counted among the ranks all the same. Fits whose likelihood omits the setting error (the last panel) "
        f"are detected by {caught}.\n"
    )


def wires_before(kept: dict[str, Any]) -> str:
    """Tables of the paper's wires by two commits, and which intervals differ."""
    found = kept["result"]
    ratio, fits_of_a_seed = found["after_over_before"], len(found["fits"])
    stopped = sum(map(len, found["not_converged"].values()))
    lines = [
        f"{run_of(kept)} repeats the {fits_of_a_seed} fits of ``wirebayes reproduce`` by",
        f"commit {found['against']}, the last one before, and by this one, with {found['seeds']} seeds:",
        f"{stopped} of {2 * found['seeds'] * fits_of_a_seed} did not converge. Effective draws an evaluation are",
        f"{ratio['mean']:.2f} [{ratio['low']:.2f}, {ratio['high']:.2f}] times those before (mean of the fits, 95 %).",
        "Intervals of 90 % (seed 0), the upper line before, the lower one now; bold where the median moved by more",
        "than half a standard deviation, or the width by more than a factor of 1.5:",
    ]
    for likelihood, words in {"chain": "The chain", "hold": "Hold by hold"}.items():
        fits = {name: parameters for name, parameters in found["fits"].items() if f", {likelihood}, " in name}
        names = list(next(iter(fits.values())))
        lines += ["", f"{words}:", "", *table_head("wire", *names)]
        for fit, parameters in fits.items():
            lines += table_row(
                fit.replace(f", {likelihood}", ""), *(_before_and_after(parameters[name]) for name in names)
            )
    differing = {
        fit: [name for name, p in parameters.items() if p["differs"]] for fit, parameters in found["fits"].items()
    }
    told = [f"{fit} ({', '.join(names)})" for fit, names in differing.items() if names]
    same = len(differing) - len(told)
    lines += ["", f"Different: {'; '.join(told)}. In the other {same} fits nothing differs."]
    return "\n".join(lines) + "\n"


def _before_and_after(parameter: dict[str, Any]) -> str:
    """Two lines of a cell."""
    mark = "**" if parameter["differs"] else ""
    before, after = (f"{mark}{parameter[when]}{mark}" for when in ("before", "after"))
    return f"| {before}\n       | {after}"
