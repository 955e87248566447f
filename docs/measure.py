"""Runs the studies whose figures README and docs quote, keeps their results, and writes the figures into the texts.

    python docs/measure.py [NAME ...]      (make figures; some hours of processor time, or NAMEs)
    python docs/measure.py --texts         only the texts, from the results that are there

Each file of ``docs/results`` holds the command, the commit, the date and what the command found. A test compares the
texts with them (`tests/test_docs.py`).
"""

import json
import re
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
    "real_files": ("-m analyses.posterior.real_files --output {folder}/real_files.json", "real_files.json"),
    "weights": ("-m analyses.posterior.weights --rows {folder} --output {folder}/weights.json", "weights.json"),
    "coverage": ("-m analyses.posterior.coverage --output {folder}", "coverage.json"),
    "robot_agreement": ("analyses/robots/agreement.py 10 --output {folder}/agreement.json", "agreement.json"),
    "robot_calibration": ("-m analyses.robots.whole_calibration coverage 120 --output {folder}/it.json", "it.json"),
    "robot_lengths_alone": ("-m analyses.robots.whole_calibration lengths 30 --output {folder}/it.json", "it.json"),
    "discover_clean": (
        "-m analyses.hidden_effects --size small --answer api --simulations 199 --kinds clean --clean 1200 --seed 5000 "
        "--output {folder}",
        "scores.json",
    ),
    "real_wires": ("analyses/discovery/real_wires.py --together --output {folder}/wires.json", "wires.json"),
}
REDUCED = {"discover_clean": lambda scores: _clean_in_short(scores)}  # of results that hold every file's answer
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
        DOCS / "any-scale.inc": _any_scale(kept["any_scale"]),
        DOCS / "real-files.inc": _real_files(kept["real_files"]),
        DOCS / "weights.inc": _weights(kept["weights"]),
        DOCS / "coverage.inc": _coverage(kept["coverage"]),
        DOCS / "robot-calibration.inc": _robot_calibration(kept["robot_calibration"], kept["robot_lengths_alone"]),
        DOCS / "real-wires.inc": _real_wires(kept["real_wires"]),
        DOCS / "discover-clean-said.inc": _clean(kept["discover_clean"]),
    }


def _four_figures(kept: dict[str, Any]) -> str:
    """The README's list."""
    coverage, robots = kept["coverage"]["result"], kept["robot_agreement"]["result"]
    inside, later = (100 * coverage[f"{of}_coverage"] for of in ("interval", "held_out"))
    wire = kept["real_wires"]["result"]["first holds to the rest"]["roc-line-1m"]
    table = (DOCS / "discover-clean.inc").read_text(encoding="utf-8")
    alarms = re.search(r"\* - false alarms on clean files\n.*\n\s+- (.*)", table)
    assert alarms is not None
    return (
        f"- [Intervals](docs/trust.rst) of 90 %: {inside:.0f} % of {coverage['intervals']} held the truth, on "
        f"{coverage['wires']} simulated\n  wires, and {later:.0f} % of later holds' readings lay in their bands.\n"
        f"- [False alarms](docs/discover-study.rst) on files without an effect, at a level of 4 %: {alarms[1]}.\n"
        "- [Real wires](docs/trust.rst): on holds that no model had seen, the error of the paper's thin line fell\n"
        f"  from {wire['plain_rmse_N']:.3f} to {wire['final_rmse_N']:.3f} N with what `discover` named.\n"
        f"- [Robots](docs/robot-study.rst): {robots['cases']} equilibria of drawn poses and wires agree with MuJoCo, "
        f"or with a\n  minimiser of the energy, within {robots['largest_m']:.0e} m.\n"
    )


def _any_scale(kept: dict[str, Any]) -> str:
    """A table of intervals from thread to mooring rope, under steps and under weights."""
    found = kept["result"]
    kinds = {"all": "all tests", "steps": "steps", "weights": "weights", "rests": "with recorded rests"}
    names = [name for name in found["all"] if name != "tests"]
    lines = [
        f"``{kept['command']}`` (commit {kept['commit']}, {kept['date']}); {found['not_converged']} of "
        f"{found['tests']} did not converge. Shares of 90 % intervals that hold the truth, in %:",
        "",
        ".. list-table::",
        "   :header-rows: 1",
        "",
        "   * - tests",
        "     - number",
        *(f"     - {name}" for name in names),
    ]
    for kind, words in kinds.items():
        lines += [f"   * - {words}", f"     - {found[kind]['tests']}"]
        lines += [f"     - {100 * found[kind][name]:.0f}" for name in names]
    return "\n".join(lines) + "\n"


def _real_files(kept: dict[str, Any]) -> str:
    """A paragraph on a tendon's relaxation."""
    found = kept["result"]
    plain, later = found["least_squares"], found["later"]
    each = ", ".join(
        f"{name} {low:.3g} to {high:.3g} (least squares {plain[name]:.3g})"
        for name, (low, _, high) in found["posterior"].items()
    )
    return (
        f"``{kept['command']}`` (commit {kept['commit']}, {kept['date']}) reads the relaxation of a tendon fascicle, a "
        f"public recording. Without a preload, 90 % intervals are {each}: least squares fits to "
        f"{1000 * plain['rms_N']:.1f} mN and says nothing of how little its numbers are worth. From the first minute, "
        f"{later['in_band_90']} of {later['readings']} later readings lie in their 90 % bands; rms "
        f"{1000 * later['posterior_rms_N']:.0f} mN, least squares {1000 * later['least_squares_rms_N']:.0f} mN.\n"
    )


def _weights(kept: dict[str, Any]) -> str:
    """A paragraph on one wire under steps and under weights."""
    found = kept["result"]
    steps, weights, together = (found[kind] for kind in ("steps", "weights", "together"))
    inside = f"{steps['inside']}, {weights['inside']} and {together['inside']} of {found['pairs']}"
    widths = " and ".join(f"{kind['median_width']:.3f}" for kind in (steps, weights))
    return (
        f"``{kept['command']}`` (commit {kept['commit']}, {kept['date']}) fits {found['pairs']} such lines under "
        f"steps, under weights, and both together: the 90 % interval of the creep after a hold at the typical "
        f"tension holds the truth in {inside}; its median width, in the logarithm, is {widths}, together "
        f"{together['median_width']:.3f}, and both together are the sharpest in {found['together_sharpest']}.\n"
    )


def _coverage(kept: dict[str, Any]) -> str:
    """A paragraph on intervals and bands."""
    found = kept["result"]
    each = ", ".join(f"{name} {100 * share:.0f} %" for name, share in found["by_parameter"].items())
    return (
        f"``{kept['command']}`` (commit {kept['commit']}, {kept['date']}) simulates {found['wires']} tests with varied "
        f"lengths, steps, directions and reading times. {100 * found['interval_coverage']:.1f} % of "
        f"{found['intervals']} intervals of 90 % contained the truth ({each}), and 90 % bands for the last third of "
        f"the holds contained {100 * found['held_out_coverage']:.1f} % of {found['held_out_readings']} readings. "
        f"{found['not_converged']} of {found['wires']} did not converge.\n"
    )


def _robot_calibration(kept: dict[str, Any], alone: dict[str, Any]) -> str:
    """A table of intervals of drawn robots by what is known of the poses, and a sentence on lengths alone."""
    names = {"exit_points": "exit points", "references": "references", "lengths": "lengths", "poses": "poses"}
    found, blind = kept["result"], alone["result"]
    lines = [
        f"``{kept['command']}``",
        f"(commit {kept['commit']}, {kept['date']}) draws {found['robots']} robots of 2 to 9 wires",
        f"and takes {found['median_seconds_each']:.1f} s each at the median. Shares of 90 % intervals that hold",
        "the truth, and of calibrations that converge and are usable, in %:",
        "",
        ".. list-table::",
        "   :header-rows: 1",
        "",
        "   * - poses",
        "     - robots",
        *(f"     - {words}" for words in names.values()),
        "     - converged",
        "     - usable",
    ]
    for mode in ("all", "poses known", "poses roughly known", "some poses", "poses unknown"):
        share = found["shares"][mode]
        lines += [f"   * - {mode}", f"     - {share['robots']}"]
        lines += [f"     - {100 * share[name]:.0f}" for name in (*names, "converged", "usable")]
    right, wrong, error = (100 * blind[name] for name in ("found", "silently_wrong", "distance_error_over_before"))
    lines += [
        "",
        "Lengths alone, of 24 unknown poses, on four or five anchors that are 2 % of the span off, with unread",
        "tensions that the robot's file bounds at 0.3 of what the lines may bear",
        f"(``{alone['command']}``, commit {alone['commit']}, {alone['date']}): {right:.0f} % of {blind['robots']}",
        "calibrations are usable with every coordinate within four standard errors,",
        f"{wrong:.0f} % usable and wrong; the others are refused. Distances between anchors are then {error:.0f} %",
        "as wrong as before, at the median.",
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
        f"Named: {names or 'nothing'}. A file takes {found['median_seconds']:.1f} s (median). Commit {kept['commit']}, "
        f"{kept['date']}.\n"
    )


def _real_wires(kept: dict[str, Any]) -> str:
    """A table of the paper's wires."""
    lines = [f"``{kept['command']}`` (commit {kept['commit']}, {kept['date']}):", "", ".. list-table::"]
    lines += [
        "   :header-rows: 1",
        "",
        "   * - wire",
        "     - verdict",
        "     - accepted",
        "     - rms of later holds, N",
    ]
    lines += ["     - in the 90 % band"]
    for name, wire in kept["result"]["first holds to the rest"].items():
        lines += [f"   * - {name}", f"     - {wire['verdict']}"]
        lines += [f"     - {', '.join(wire['accepted']).replace('_', ' ') or '–'}"]
        lines += [f"     - {wire['plain_rmse_N']:.3f} → {wire['final_rmse_N']:.3f}"]
        lines += [f"     - {100 * wire['plain_inside_90']:.0f} → {100 * wire['final_inside_90']:.0f} %"]
    for title, words in {"all holds": "All holds, each wire by itself", "all four": "The four judged together"}.items():
        lines += ["", f"{words}:", "", ".. list-table::", "   :header-rows: 1", ""]
        lines += ["   * - wire", "     - verdict", "     - accepted", "     - families established", "     - remainder"]
        for name, wire in kept["result"][title].items():
            families = [f"{family['name']} ({family['inclusion']:.2f})" for family in wire["families"]]
            lines += [f"   * - {name}", f"     - {wire['verdict']}"]
            lines += [f"     - {', '.join(wire['accepted']).replace('_', ' ') or '–'}"]
            lines += [f"     - {', '.join(families).replace('_', ' ') or '–'}", f"     - {wire['remainder']:.2f}"]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    if sys.argv[1:] != ["--texts"]:
        for chosen in sys.argv[1:] or STUDIES:
            measure(chosen)
    for path, text in texts().items():
        path.write_text(text, encoding="utf-8")
