"""Runs the studies whose figures README and docs quote, keeps their results, and writes the figures into the texts.

    python docs/measure.py [NAME ...]      (make figures; some hours of processor time, or NAMEs)
    python docs/measure.py --texts         only the texts, from the results that are there

Each file of ``docs/results`` holds the command, the commit, the date and what the command found. A test compares the
texts with them (`tests/test_docs.py`).
"""

import json
import re
import shutil
import subprocess
import sys
from collections import Counter
from datetime import UTC, datetime
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

DOCS = Path(__file__).parent
ROOT = DOCS.parent
RESULTS = DOCS / "results"
# what each study is called, with the file that it writes
STUDIES = {
    "any_scale": ("-m analyses.posterior.any_scale --rows {folder} --output {folder}/any_scale.json", "any_scale.json"),
    # 1d5.csv is a public file, named in the study's docstring; the others are data of tests
    "real_files": (
        "-m analyses.posterior.real_files --elastomer ../1d5.csv --output {folder}/real_files.json",
        "real_files.json",
    ),
    "weights": ("-m analyses.posterior.weights --rows {folder} --output {folder}/weights.json", "weights.json"),
    "clean_any_scale": (
        "-m analyses.discovery.clean_any_scale --rows {folder} --output {folder}/clean.json",
        "clean.json",
    ),
    "calibration": ("-m analyses.calibration --output {folder}", "calibration.json"),
    # ../before is a checkout of the commit before priors were free of scale
    "wires_before": (
        "-m analyses.posterior.wires_before --against ../before --seeds 20 --rows {folder} "
        "--output {folder}/wires.json",
        "wires.json",
    ),
    "coverage": ("-m analyses.posterior.coverage --wires 400 --output {folder}", "coverage.json"),
    "any_protocol": ("-m analyses.posterior.any_protocol --workers 2 --output {folder}", "any_protocol.json"),
    "robot_agreement": ("analyses/robots/agreement.py 10 --output {folder}/agreement.json", "agreement.json"),
    "robot_calibration": (
        "-m analyses.robots.whole_calibration coverage 200 --seed 4000 --output {folder}/it.json",
        "it.json",
    ),
    "robot_lengths_alone": (
        "-m analyses.robots.whole_calibration lengths 100 --seed 31 --output {folder}/it.json",
        "it.json",
    ),
    "discover_clean": (
        "-m analyses.hidden_effects --size small --answer api --simulations 199 --kinds clean --clean 1200 --seed 5010 "
        "--output {folder}",
        "scores.json",
    ),
    "robot_exact_geometry": (
        "-m analyses.robots.whole_calibration exact 200 --seed 3601 --output {folder}/it.json",
        "it.json",
    ),
    "discover_hidden": (
        "-m analyses.hidden_effects --size small --answer api --simulations 199 --judge-draws 40 --kinds single "
        "without foreign two three mixed periodic --seed 5006 5007 5008 5011 --protocols paper unloading "
        "uneven dense temperature slack --output {folder}",
        "scores.json",
    ),
    # on a machine that does nothing else
    "seconds": ("-m analyses.speed.seconds_of_a_fit --repeats 3 --output {folder}/seconds.json", "seconds.json"),
    "real_wires": ("analyses/discovery/real_wires.py --together --output {folder}/wires.json", "wires.json"),
}
REDUCED = {  # of results that hold every file's answer
    "discover_clean": lambda scores: _clean_in_short(scores),
    "discover_hidden": lambda scores: _hidden_in_short(scores),
}
_BLOCK = re.compile(r"(<!-- measured -->\n).*?(<!-- end -->)", re.DOTALL)


def measure(name: str) -> None:
    """Run a study and keep its result.

    Parameters
    ----------
    name : str
        A key of ``STUDIES``.
    """
    command, file = STUDIES[name]
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], cwd=ROOT, capture_output=True, text=True).stdout
    with TemporaryDirectory() as folder:
        subprocess.run([sys.executable, *command.format(folder=folder).split()], cwd=ROOT, check=True)
        result = json.loads((Path(folder) / file).read_text(encoding="utf-8"))
        for picture in Path(folder).glob("*.png"):
            shutil.copy(picture, DOCS / "images" / f"{name}.png")
    if name in REDUCED:
        result = REDUCED[name](result)
    kept = {
        "command": "python " + re.sub(r" --(rows|output) \S+", "", command),
        "commit": commit.strip(),
        "date": datetime.now(UTC).date().isoformat(),
        "result": result,
    }
    RESULTS.mkdir(exist_ok=True)
    (RESULTS / f"{name}.json").write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")


def texts() -> dict[Path, str]:
    """Every text that quotes a figure of ``docs/results``, as it has to be."""
    kept = {name: json.loads((RESULTS / f"{name}.json").read_text(encoding="utf-8")) for name in STUDIES}
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    return {
        ROOT / "README.md": _BLOCK.sub(lambda block: block[1] + _four_figures(kept) + block[2], readme),
        DOCS / "trust-claims.inc": _claims(kept),
        DOCS / "any-scale.inc": _any_scale(kept["any_scale"]),
        DOCS / "real-files.inc": _real_files(kept["real_files"]),
        DOCS / "weights.inc": _weights(kept["weights"]),
        DOCS / "clean-any-scale.inc": _clean_any_scale(kept["clean_any_scale"]),
        DOCS / "calibration.inc": _calibration(kept["calibration"]),
        DOCS / "wires-before.inc": _wires_before(kept["wires_before"]),
        DOCS / "coverage.inc": _coverage(kept["coverage"]),
        DOCS / "any-protocol.inc": _any_protocol(kept["any_protocol"]),
        DOCS / "robot-calibration.inc": _robot_calibration(kept["robot_calibration"])
        + _lengths_alone(kept["robot_lengths_alone"])
        + _exact_geometry(kept["robot_exact_geometry"]),
        DOCS / "real-wires.inc": _real_wires(kept["real_wires"]),
        DOCS / "discover-clean-said.inc": _clean(kept["discover_clean"]),
        DOCS / "seconds.inc": _seconds(kept["seconds"]),
        DOCS / "discover-hidden-said.inc": _hidden(kept["discover_hidden"]),
    }


def _version_of(kept: dict[str, Any]) -> str:
    """Which commit found a result, and when."""
    return f"Commit {kept['commit']}, {kept['date']}"


def _run_of(kept: dict[str, Any]) -> str:
    """The command behind a result, with commit and date, as a sentence begins with it."""
    return f"``{kept['command']}`` (commit {kept['commit']}, {kept['date']})"


def _head(*names: str) -> list[str]:
    """The lines that a table begins with."""
    return [".. list-table::", "   :header-rows: 1", "", *_row(*names)]


def _row(first: Any, *others: Any) -> list[str]:
    """The lines of a table's row."""
    return [f"   * - {first}", *(f"     - {cell}" for cell in others)]


_OF_NO_GROUP = "an accepted name that is of no hidden effect's group"


def _claims(kept: dict[str, Any]) -> str:
    """A table of what is claimed and what was found, with the study behind it."""
    found = {name: study["result"] for name, study in kept.items()}
    coverage, scales, clean = found["coverage"], found["any_scale"]["all"], found["clean_any_scale"]["all"]["check"]
    robots, agreement = found["robot_calibration"]["shares"]["all"], found["robot_agreement"]
    taut, slack = (found["any_protocol"]["shares"][group] for group in ("taut throughout", "slack in a hold"))
    every_scale = [share for name, share in scales.items() if name != "tests"]
    wires = found["real_wires"]["first holds to the rest"]
    errors = "; ".join(
        f"{name}: {wire['plain_rmse_N']:.3f} to {wire['final_rmse_N']:.3f} N" for name, wire in wires.items()
    )
    rows = [
        (
            "90 % intervals of parameters hold the truth",
            f"{_percent(coverage['interval_coverage'])} of {coverage['intervals']}, on {coverage['wires']} wires",
            "intervals-study",
        ),
        (
            "so they do at any scale, from thread to mooring rope",
            f"{_percent(min(every_scale))} to {_percent(max(every_scale))}, by parameter, of {scales['tests']} tests",
            "intervals-study",
        ),
        (
            "so they do whatever the protocol, as long as the wire stays taut",
            f"{_percent(taut['all'])}, of {taut['tests']} tests; {_percent(slack['all'])} where it is slack in a hold",
            "intervals-study",
        ),
        (
            "90 % bands hold the readings of later holds",
            f"{_percent(coverage['held_out_coverage'])} of {coverage['held_out_readings']}",
            "intervals-study",
        ),
        (
            "the check of a right model fails in 4 %",
            f"{100 * clean['value']:.1f} % [{100 * clean['low']:.1f}, {100 * clean['high']:.1f}] of {clean['n']} tests",
            "check-study",
        ),
        (
            "``discover`` names an effect of its catalogue, of δ = 10, rightly",
            f"{_share_in_table('discover-hidden.inc', 'top-ranked effect in the true group, δ = 10')} files in which "
            "it sees something",
            "discover-study",
        ),
        (
            "an accepted name is wrong in at most 10 %",
            f"{_share_in_table('discover-hidden.inc', _OF_NO_GROUP)} names",
            "discover-study",
        ),
        (
            "both of two effects at once are named",
            f"{_share_in_table('discover-hidden.inc', 'two effects: both accepted')} files; an ideal judge: "
            f"{_share_in_table('discover-hidden.inc', 'an ideal judge who has to estimate the noise: both')}",
            "discover-study",
        ),
        (
            "an effect in no catalogue is not given a name",
            f"{_share_in_table('discover-hidden.inc', 'effect in no catalogue: unknown or its group')} files",
            "discover-study",
        ),
        ("with what is named, the error on the paper's later holds falls", errors, "models-study"),
        (
            "a robot's poses agree with independent solvers",
            f"{agreement['cases']} equilibria within {agreement['largest_m']:.0e} m",
            "robot-study",
        ),
        (
            "90 % intervals of calibrated wire lengths hold the truth",
            f"{_percent(robots['lengths'])}, on {robots['robots']} drawn robots",
            "robot-study",
        ),
    ]
    lines = [".. list-table::", "   :header-rows: 1", "   :widths: 42 44 14", "", *_row("claim", "found", "study")]
    for claim, result, study in rows:
        lines += _row(claim, result, f":doc:`{study.removesuffix('-study')} <{study}>`")
    return "\n".join(lines) + "\n"


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"


def _share_in_table(file: str, row: str) -> str:
    """What a pooled table found, in the row of that name."""
    table = (DOCS / file).read_text(encoding="utf-8")
    found = re.search(rf"\* - {re.escape(row)}\n.*\n\s+- (.*)", table)
    assert found is not None, row
    return found[1].strip("*").replace("**", "")


def _four_figures(kept: dict[str, Any]) -> str:
    """The README's list."""
    coverage, robots = kept["coverage"]["result"], kept["robot_agreement"]["result"]
    inside, later = (100 * coverage[f"{of}_coverage"] for of in ("interval", "held_out"))
    wire = kept["real_wires"]["result"]["first holds to the rest"]["roc-line-1m"]
    alarms = _share_in_table("discover-clean.inc", "false alarms on clean files")
    wires = f"{coverage['intervals']} intervals of 90 % from {coverage['wires']} simulated wires"
    return (
        f"- [Intervals](docs/intervals-study.rst): of {wires}, {inside:.0f} % contain the truth;\n"
        f"  {later:.0f} % of the readings of later holds lie in their bands.\n"
        f"- [False alarms](docs/discover-study.rst): `discover` suspects an effect in {alarms} files that\n"
        "  have none; 4 % are intended.\n"
        "- [Real wires](docs/models-study.rst): what `discover` named lowers the error on held-out holds of the\n"
        f"  paper's thin line from {wire['plain_rmse_N']:.3f} to {wire['final_rmse_N']:.3f} N.\n"
        f"- [Robots](docs/robot-study.rst): {robots['cases']} random equilibria agree with MuJoCo, or a minimiser of\n"
        f"  the energy, within {robots['largest_m']:.0e} m.\n"
    )


def _any_scale(kept: dict[str, Any]) -> str:
    """A table of intervals from thread to mooring rope, under steps and under weights."""
    found = kept["result"]
    kinds = {"all": "all tests", "steps": "steps", "weights": "weights", "rests": "with recorded rests"}
    names = [name for name in found["all"] if name != "tests"]
    lines = [
        f"{_run_of(kept)}; {found['not_converged']} of "
        f"{found['tests']} did not converge. Shares of 90 % intervals that hold the truth, in %:",
        "",
        *_head("tests", "number", *names),
    ]
    for kind, words in kinds.items():
        lines += _row(words, found[kind]["tests"], *(f"{100 * found[kind][name]:.0f}" for name in names))
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


def _real_files(kept: dict[str, Any]) -> str:
    """A paragraph on each public recording."""
    lines = [f"{_run_of(kept)} reads public recordings."]
    for file, found in kept["result"].items():
        plain, later = found["least_squares"], found["later"]
        numbers = ", ".join(f"{name} {_three(plain[name])}" for name in ("k1", "k2", "N") if name in plain)
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
    each = ", ".join(f"{name} {_three(low)} to {_three(high)}" for name, low, high in ends)
    p = f"model check p = {posterior['model_check']:.2g}"
    return " ".join(filter(None, [each, _MODELS[called], f"({p}{_or_not(posterior)})"]))


def _or_not(fit: dict[str, Any]) -> str:
    return "" if fit["converged"] else ", of a fit that did not converge"


def _milli(newtons: float) -> str:
    """Two digits, in mN."""
    return f"{float(f'{1000 * newtons:.2g}'):g} mN"


def _weights(kept: dict[str, Any]) -> str:
    """A paragraph on one wire under steps and under weights."""
    found = kept["result"]
    steps, weights, together = (found[kind] for kind in ("steps", "weights", "together"))
    inside = f"{steps['inside']}, {weights['inside']} and {together['inside']} of {found['pairs']}"
    widths = " and ".join(f"{kind['median_width']:.3f}" for kind in (steps, weights))
    return (
        f"{_run_of(kept)} fits {found['pairs']} such lines under "
        f"steps, under weights, and both together: the 90 % interval of the creep after a hold at the typical "
        f"tension holds the truth in {inside}; its median width, in the logarithm, is {widths}, together "
        f"{together['median_width']:.3f}, and both together are the sharpest in {found['together_sharpest']}.\n"
    )


def _coverage(kept: dict[str, Any]) -> str:
    """A paragraph on intervals and bands."""
    found = kept["result"]
    each = ", ".join(f"{name} {100 * share:.0f} %" for name, share in found["by_parameter"].items())
    return (
        f"{_run_of(kept)} simulates {found['wires']} tests with varied "
        f"lengths, steps, directions and reading times. {100 * found['interval_coverage']:.1f} % of "
        f"{found['intervals']} intervals of 90 % contained the truth ({each}), and 90 % bands for the last third of "
        f"the holds contained {100 * found['held_out_coverage']:.1f} % of {found['held_out_readings']} readings. "
        f"{found['not_converged']} of {found['wires']} did not converge.\n"
    )


def _any_protocol(kept: dict[str, Any]) -> str:
    """A paragraph and a table of intervals by protocol, and by whether the wire went slack."""
    found = kept["result"]
    names = [name for name in found["shares"]["taut throughout"] if name != "tests"]
    lines = [
        f"{_run_of(kept)}; {found['not_converged']} of {found['tests']} did not converge; a fit takes",
        f"{found['median_evaluations']:.0f} evaluations in the median and {found['most_evaluations']} at most.",
        "Shares of 90 % intervals that hold the truth, in %:",
        "",
        *_head("tests", "number", *names),
    ]
    for group, shares in found["shares"].items():
        lines += _row(group, shares["tests"], *(f"{100 * shares[name]:.0f}" for name in names))
    return "\n".join(lines) + "\n"


def _clean_any_scale(kept: dict[str, Any]) -> str:
    """A paragraph and a table on false alarms of tests of any scale."""
    found = kept["result"]
    kinds = {"all": "all tests", "steps": "steps", "weights": "weights", "rests": "with recorded rests"}
    verdicts = ", ".join(f"*{verdict}* {count}" for verdict, count in found["verdicts"].items()) or "none"
    named = ", ".join(f"{name.replace('_', ' ')} {count}" for name, count in found["named"].items())
    searched, alpha = found["searched"], 100 * found["alpha"]
    names = f"names accepted: {named}" if named else "no name was accepted"
    lines = [
        f"{_run_of(kept)}, at a level of {alpha:.0f} %. Where the check failed,",
        f"``discover`` said: {verdicts}; {names}. In {searched['same_p']} of {searched['tests']} tests that both",
        "were asked, the two had the same p. If p is uniform, values as uneven have a probability of",
        f"{found['uniform_p']:.2f} (Kolmogorov-Smirnov).",
        "",
        *_head(
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
        lines += _row(words, alarms["tests"], *rates)
    return "\n".join(lines) + "\n"


def _rate(rate: dict[str, float]) -> list[str]:
    """A share with its interval, and its upper bound, %."""
    value, low, high, upper = (100 * rate[key] for key in ("value", "low", "high", "upper_95"))
    return [f"{value:.1f} [{low:.1f}, {high:.1f}]", f"{upper:.1f} %"]


def _calibration(kept: dict[str, Any]) -> str:
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
        f"{_run_of(kept)} takes {len(sound)} times {min(sound.values())} wires. {inside} inside a band that contains "
        f"all jointly with probability {joint:.0f} %; the most extreme is {worst} (tail probability {tail:.1g}; "
        f"the edge of the band is at {edge:.1g}). {stopped} of the {sum(sound.values())} fits did not converge; "
        "they are counted among the ranks all the same. Fits whose likelihood omits the setting error (the last panel) "
        f"are detected by {caught}.\n"
    )


def _wires_before(kept: dict[str, Any]) -> str:
    """Tables of the paper's wires by two commits, and which intervals differ."""
    found = kept["result"]
    ratio, fits_of_a_seed = found["after_over_before"], len(found["fits"])
    stopped = sum(map(len, found["not_converged"].values()))
    lines = [
        f"{_run_of(kept)} repeats the {fits_of_a_seed} fits of ``wirebayes reproduce`` by",
        f"commit {found['against']}, the last one before, and by this one, with {found['seeds']} seeds:",
        f"{stopped} of {2 * found['seeds'] * fits_of_a_seed} did not converge. Effective draws an evaluation are",
        f"{ratio['mean']:.2f} [{ratio['low']:.2f}, {ratio['high']:.2f}] times those before (mean of the fits, 95 %).",
        "Intervals of 90 % (seed 0), the upper line before, the lower one now; bold where the median moved by more",
        "than half a standard deviation, or the width by more than a factor of 1.5:",
    ]
    for likelihood, words in {"chain": "The chain", "hold": "Hold by hold"}.items():
        fits = {name: parameters for name, parameters in found["fits"].items() if f", {likelihood}, " in name}
        names = list(next(iter(fits.values())))
        lines += ["", f"{words}:", "", *_head("wire", *names)]
        for fit, parameters in fits.items():
            lines += _row(fit.replace(f", {likelihood}", ""), *(_before_and_after(parameters[name]) for name in names))
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


def _three(value: float) -> str:
    """Three digits, without an exponent where there are few zeros."""
    return f"{float(f'{value:.3g}'):g}"


_HELD = {"exit_points": "exit points", "references": "references", "lengths": "lengths", "poses": "poses"}


def _robot_calibration(kept: dict[str, Any]) -> str:
    """A table of intervals of drawn robots by what is known of the poses."""
    found = kept["result"]
    lines = [
        f"{_run_of(kept)} draws {found['robots']} robots of 2 to 9 wires",
        f"and takes {found['median_seconds_each']:.1f} s each at the median. Shares of 90 % intervals that hold",
        "the truth, and of calibrations that converge and are usable, in %:",
        "",
        *_head("poses", "robots", *_HELD.values(), "converged", "usable"),
    ]
    for mode in ("all", "poses known", "poses roughly known", "some poses", "poses unknown"):
        share = found["shares"][mode]
        lines += _row(mode, share["robots"], *(f"{100 * share[name]:.0f}" for name in (*_HELD, "converged", "usable")))
    return "\n".join(lines) + "\n\n"


def _lengths_alone(kept: dict[str, Any]) -> str:
    """Sentences on anchors from lengths alone."""
    blind = kept["result"]
    right, wrong = (
        f"{100 * share['share']:.0f} % [{100 * share['low']:.0f}, {100 * share['high']:.0f} %]"
        for share in (blind["found"], blind["silently_wrong"])
    )
    lines = [
        "Lengths alone, of 24 unknown poses, on four or five anchors that are 2 % of the span off, with unread",
        "tensions that the robot's file bounds at 0.3 of what the lines may bear:",
        f"{_run_of(kept)} finds {right} of {blind['robots']}",
        "calibrations usable with every coordinate within four standard errors (95 % interval),",
        f"{wrong} usable and wrong; the others are refused. Distances between anchors are then",
        f"{100 * blind['distance_error_over_before']:.0f} % as wrong as before, at the median.",
    ]
    return "\n".join(lines) + "\n"


def _clean_in_short(scores: dict[str, Any]) -> dict[str, Any]:
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


def _clean(kept: dict[str, Any]) -> str:
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
        f"Named: {names or 'nothing'}. A file takes {found['median_seconds']:.1f} s (median). {_version_of(kept)}.\n"
    )


def _hidden_in_short(scores: dict[str, Any]) -> dict[str, Any]:
    """How many files with hidden effects were answered, and how long one takes."""
    rows = scores["api"]["rows"]
    return {"files": len(rows), "median_seconds": median(row["seconds"] for row in rows)}


def _hidden(kept: dict[str, Any]) -> str:
    """Two sentences on the files that the table is of."""
    found = kept["result"]
    return (
        f"{found['files']} files of one test each, their truth sealed until all had been answered; a file takes "
        f"{found['median_seconds']:.1f} s (median). {_version_of(kept)}.\n"
    )


def _seconds(kept: dict[str, Any]) -> str:
    """Sentences on whole commands, and a table of the phases of a fit."""
    found = kept["result"]

    def said(command: str) -> str:
        *first, last = [f"{seconds:.1f}" for seconds in found["whole"][command].values()]
        return f"{', '.join(first)} and {last} s"

    lines = [
        f"{_run_of(kept)}, the least of {found['runs']} runs each: on two cores a whole ``fit`` of the paper's wires "
        f"takes {said('fit')} by the clock, and a whole ``discover`` {said('discover')}. What each second of the "
        f"``fit`` of {found['wire']} is:",
        "",
    ]
    lines += _head("phase", "from, s", "to, s")
    for phase, (begin, end) in found["phases"].items():
        lines += _row(phase, f"{max(begin, 0.0):.2f}", f"{end:.2f}")
    return "\n".join(lines) + "\n"


def _exact_geometry(kept: dict[str, Any]) -> str:
    """A paragraph on what is said of anchors that are held exact, right ones and wrong ones."""
    found = kept["result"]

    def said(key: str) -> str:
        one = found[key]
        return f"{round(one['share'] * one['of'])} of {one['of']} [{100 * one['low']:.0f}, {100 * one['high']:.0f} %]"

    return (
        f"\nAnchors held exact: {_run_of(kept)},\n"
        f"{found['robots']} robots, joint values exact or of a stated error, anchors right or off by\n"
        "0.01 to 1 % of the span; 95 % intervals. Where all is right,\n"
        f"{said('usable_where_all_is_right')} calibrations are usable. Of wrong anchors that a\n"
        "chi-squared test of all readings, which knows every error, would see with 99 % power,\n"
        f"{said('not_usable_where_power_is_99_percent')} are not usable; where its power is less,\n"
        f"{said('not_usable_where_it_is_less')} are not.\n"
    )


def _real_wires(kept: dict[str, Any]) -> str:
    """A table of the paper's wires."""
    lines = [f"{_run_of(kept)}:", ""]
    lines += _head("wire", "verdict", "accepted", "rms of later holds, N", "in the 90 % band")
    for name, wire in kept["result"]["first holds to the rest"].items():
        rms = f"{wire['plain_rmse_N']:.3f} → {wire['final_rmse_N']:.3f}"
        inside = f"{100 * wire['plain_inside_90']:.0f} → {100 * wire['final_inside_90']:.0f} %"
        lines += _row(name, wire["verdict"], _spoken(wire["accepted"]), rms, inside)
    for title, words in {"all holds": "All holds, each wire by itself", "all four": "The four judged together"}.items():
        lines += ["", f"{words}:", "", *_head("wire", "verdict", "accepted", "families established", "remainder")]
        for name, wire in kept["result"][title].items():
            families = [f"{family['name']} ({family['inclusion']:.2f})" for family in wire["families"]]
            accepted, established = _spoken(wire["accepted"]), _spoken(families)
            lines += _row(name, wire["verdict"], accepted, established, f"{wire['remainder']:.2f}")
    return "\n".join(lines) + "\n"


def _spoken(names: list[str]) -> str:
    """Names of effects as people say them."""
    return ", ".join(names).replace("_", " ") or "–"


if __name__ == "__main__":
    if sys.argv[1:] != ["--texts"]:
        for chosen in sys.argv[1:] or STUDIES:
            measure(chosen)
    for path, text in texts().items():
        path.write_text(text, encoding="utf-8")
