"""Studies of what `discover` finds and names."""

from collections import Counter
from statistics import median
from textwrap import fill
from typing import Any

from figure_texts.tables import run_of, table_head, table_row, version_of


def false_alarms_at_any_scale(kept: dict[str, Any]) -> str:
    """A paragraph and a table on false alarms of tests of any scale."""
    found = kept["result"]
    kinds = {"all": "all tests", "steps": "steps", "weights": "weights", "rests": "with recorded rests"}
    verdicts = ", ".join(f"*{verdict}* {count}" for verdict, count in found["verdicts"].items()) or "none"
    named = ", ".join(f"{name.replace('_', ' ')} {count}" for name, count in found["named"].items())
    searched, alpha = found["searched"], 100 * found["alpha"]
    names = f"names accepted: {named}" if named else "no name was accepted"
    lines = [
        f"{run_of(kept)}, at a level of {alpha:.0f} %. Where the check failed,",
        f"``discover`` said: {verdicts}; {names}. In {searched['same_p']} of {searched['tests']} tests that",
        "were given to both, the two found the same p. If p is uniform, values as uneven have a probability of",
        f"{found['uniform_p']:.2f} (Kolmogorov-Smirnov).",
        "",
        *table_head(
            "tests",
            "number",
            "the check fails, % [90 % interval]",
            "upper bound, 95 %",
            "``discover`` finds something missing, %",
            "upper bound, 95 %",
        ),
    ]
    for kind, words in kinds.items():
        alarms = found[kind]
        rates = [cell for of in ("check", "discover") for cell in _rate(alarms[of])]
        lines += table_row(words, alarms["tests"], *rates)
    return "\n".join(lines) + "\n"


def p_under_weights(kept: dict[str, Any]) -> str:
    """A sentence on the p of clean tests under weights, by simulations at the fit and at the truth."""
    found = kept["result"]
    level = f"{found['alpha']:g}"
    at_fit, at_truth = (f"{found[by][level]['k']} ({_share(found[by][level])} %)" for by in ("fit", "truth"))
    said = (
        f"{run_of(kept)}: of {found['tests']} tests, {at_fit} have a p of at most {level} by simulations at the fit, "
        f"as the check makes them, and {at_truth} by simulations at the truth, with which p is uniform."
    )
    return fill(said, 110, break_on_hyphens=False) + "\n"


def bands_of_the_unknown(kept: dict[str, Any]) -> str:
    """A sentence and a table on later readings in the bands of the plain model, and with the smooth discrepancy."""
    found = kept["result"]
    words = {
        "all": "all",
        "missed": f"of all, where the plain model's bands hold less than {100 * found['missed_below']:.0f} %",
    }
    said = (
        f"{run_of(kept)}. Shares are means over files, with 90 % intervals; errors are relative to the plain model's."
    )
    lines = [fill(said, 110, break_on_hyphens=False), ""]
    lines += table_head(
        "protocol",
        "files",
        "readings in the plain model's bands, %",
        "in those with the discrepancy, %",
        "its error, median [10 %, 90 %]",
    )
    for name, group in found["groups"].items():
        if group is None:
            continue
        inside = [_percent(group["inside"][model]) for model in ("plain", "smooth")]
        ratio = group["error_ratio"]
        error = f"{ratio['median']:.2f} [{ratio['q10']:.2f}, {ratio['q90']:.2f}]"
        lines += table_row(words.get(name, name), str(group["files"]), *inside, error)
    return "\n".join(lines) + "\n"


def _percent(mean: dict[str, float]) -> str:
    """A mean share with its interval, in per cent."""
    return f"{100 * mean['value']:.0f} [{100 * mean['low']:.0f}, {100 * mean['high']:.0f}]"


def hidden_effects_at_any_scale(kept: dict[str, Any]) -> str:
    """A paragraph and a table on hidden effects in tests of any scale."""
    found = kept["result"]
    words = {"all": "all tests", "rests": "with recorded rests"}
    rows = {words.get(kind, kind): rates for kind, rates in found["kinds"].items()}
    rows |= {f"δ = {delta}": rates for delta, rates in found["by_delta"].items()}
    missed = ", ".join(f"{name.replace('_', ' ')} {count}" for name, count in found["missed"].items())
    wrong = "; ".join(f"{_spoken(names)} for {effect.replace('_', ' ')}" for effect, names in found["misnamed"])
    said = f"{run_of(kept)}. Not detected: {missed or 'none'}. Named wrongly: {wrong or 'none'}."
    lines = [fill(said, 110), ""]
    lines += table_head(
        "tests",
        "number",
        "detected, % [90 % interval]",
        "of these: the most probable answer is right, %",
        "of these: a right name is given, %",
        "a wrong name is given, %",
    )
    for kind, rates in rows.items():
        cells = [_share(rates[of]) for of in ("detected", "best", "named", "wrong")]
        lines += table_row(kind, rates["tests"], *cells)
    return "\n".join(lines) + "\n"


def _share(rate: dict[str, float] | None) -> str:
    """A share with its interval, %; a dash where there are no cases."""
    if rate is None:
        return "–"
    value, low, high = (100 * rate[key] for key in ("value", "low", "high"))
    return f"{value:.0f} [{low:.0f}, {high:.0f}]"


def _rate(rate: dict[str, float]) -> list[str]:
    """A share with its interval, and its upper bound, %."""
    value, low, high, upper = (100 * rate[key] for key in ("value", "low", "high", "upper_95"))
    return [f"{value:.1f} [{low:.1f}, {high:.1f}]", f"{upper:.1f} %"]


def alarms_in_short(scores: dict[str, Any]) -> dict[str, Any]:
    """Of answers to files without an effect: alarms by protocol, their verdicts and names, and the time."""
    rows = scores["api"]["rows"]
    alarms = [row for row in rows if row["any_alarm"]]
    protocols = sorted({row["protocol"] for row in rows})
    return {
        "files": len(rows),
        "alarms": len(alarms),
        "by_protocol": {p: sum(row["protocol"] == p for row in alarms) for p in protocols},
        "files_a_protocol": len(rows) // len(protocols),
        "verdicts": dict(Counter(row["verdict"] for row in alarms).most_common()),
        "named": [[row["protocol"], row["accepted"]] for row in alarms if row["verdict"] == "named"],
        "median_seconds": median(row["seconds"] for row in rows),
    }


def false_alarms(kept: dict[str, Any]) -> str:
    """A paragraph on which files without an effect raise an alarm, and what is then said."""
    found = kept["result"]
    counts = found["by_protocol"]
    most = max(counts, key=counts.__getitem__)
    others = [count for protocol, count in counts.items() if protocol != most]
    verdicts = ", ".join(f"*{verdict}* in {count}" for verdict, count in found["verdicts"].items())
    names = "; ".join(
        f"{' and '.join(accepted).replace('_', ' ')} in a file of the protocol *{protocol.replace('_', ' ')}*"
        for protocol, accepted in found["named"]
    )
    return (
        f"By protocol {min(others)} to {max(others)} of {found['files_a_protocol']} files raise an alarm, with "
        f"*{most.replace('_', ' ')}* {counts[most]}. Of the {found['alarms']} alarms the verdict is {verdicts}. "
        f"Named: {names or 'nothing'}. A file takes {found['median_seconds']:.1f} s (median). {version_of(kept)}.\n"
    )


def hidden_in_short(scores: dict[str, Any]) -> dict[str, Any]:
    """How many files with hidden effects were answered, and how long one takes."""
    rows = scores["api"]["rows"]
    return {"files": len(rows), "median_seconds": median(row["seconds"] for row in rows)}


def hidden_effects(kept: dict[str, Any]) -> str:
    """Two sentences on the files that the table is of."""
    found = kept["result"]
    return (
        f"{found['files']} files of one test each, their truth sealed until all had been answered; a file takes "
        f"{found['median_seconds']:.1f} s (median). {version_of(kept)}.\n"
    )


def papers_wires(kept: dict[str, Any]) -> str:
    """A table of the paper's wires."""
    lines = [f"{run_of(kept)}:", ""]
    lines += table_head("wire", "verdict", "accepted", "rms of later holds, N", "in the 90 % band")
    for name, wire in kept["result"]["first holds to the rest"].items():
        rms = f"{wire['plain_rmse_N']:.3f} → {wire['final_rmse_N']:.3f}"
        inside = f"{100 * wire['plain_inside_90']:.0f} → {100 * wire['final_inside_90']:.0f} %"
        lines += table_row(name, wire["verdict"], _spoken(wire["accepted"]), rms, inside)
    for title, words in {"all holds": "All holds, each wire by itself", "all four": "The four judged together"}.items():
        lines += ["", f"{words}:", "", *table_head("wire", "verdict", "accepted", "families established", "remainder")]
        for name, wire in kept["result"][title].items():
            families = [f"{family['name']} ({family['inclusion']:.2f})" for family in wire["families"]]
            accepted, established = _spoken(wire["accepted"]), _spoken(families)
            lines += table_row(name, wire["verdict"], accepted, established, f"{wire['remainder']:.2f}")
    return "\n".join(lines) + "\n"


def evidence_of_first_holds(kept: dict[str, Any]) -> str:
    """A table of what a wire's first holds say: the name given, the error on later holds, evidence by integrals."""
    found = kept["result"]
    models = list(next(iter(found.values()))["log_evidence"])
    said = [_spoken([model]).replace("+", " and ") for model in models]
    lines = [f"{run_of(kept)}; log evidence is in nats, relative to the plain model:", ""]
    lines += table_head("first holds", "verdict", "accepted", "rms of later holds, N", *said)
    for holds, of_these in found.items():
        named = of_these["named"]
        rms = f"{named['plain_rmse_N']:.2f} → {named['final_rmse_N']:.2f}"
        evidence = [_signed(of_these["log_evidence"][model]) for model in models]
        lines += table_row(holds, named["verdict"], _spoken(named["accepted"]), rms, *evidence)
    return "\n".join(lines) + "\n"


def _signed(log_bayes: float | None) -> str:
    """A log Bayes factor, or that its integral cannot be trusted."""
    return "not known" if log_bayes is None else f"{log_bayes:+.1f}"


def _spoken(names: list[str]) -> str:
    """Names of effects as people say them."""
    return ", ".join(names).replace("_", " ") or "–"


def evidence_in_short(found: dict[str, Any]) -> dict[str, Any]:
    """The summary, and the refits that are a nat or more off."""
    off = [row for row in found["rows"] if abs(row["refit"] - row["draws"]) >= 1.0]
    summary = {key: value for key, value in found.items() if key != "rows"}
    return {**summary, "off": off}


def evidence_of_refits(kept: dict[str, Any]) -> str:
    """A paragraph on how near refits come to integrals by draws."""
    found = kept["result"]
    each = [_row_off(row) for row in found["off"]]
    ends = f"{found['q05']:+.2f} to {found['q95']:+.2f}"
    far = found["farther_than"]
    which = f": {'; '.join(each)}" if each else ""
    said = (
        f"Of {found['files']} files with one hidden effect, the log Bayes factor of its refit minus that of the "
        f"integrals is {found['median']:+.2f} in the median, and {ends} in nine of ten. It is off by more than three "
        f"in {far['3']}, by more than one in {far['1']}{which}."
    )
    return fill(f"{said} {run_of(kept)}.", 110) + "\n"


def _row_off(row: dict[str, Any]) -> str:
    """An effect, and what the refit and the draws say of it."""
    name = row["effect"].replace("_", " ")
    return f"{name} ({row['protocol']}) {row['refit']:.1f} for {row['draws']:.1f}"
