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
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

DOCS = Path(__file__).parent
ROOT = DOCS.parent
sys.path.insert(0, str(DOCS))

from figure_texts import claims, discovery, intervals, robots, samplers, speed  # noqa: E402

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
    "null_under_weights": (
        "-m analyses.discovery.null_under_weights --tests 200 --rows {folder} --output {folder}/null.json",
        "null.json",
    ),
    "unknown_bands": (
        "-m analyses.discovery.unknown_bands --files 120 --rows {folder} --output {folder}/bands.json",
        "bands.json",
    ),
    "hidden_any_scale": (
        "-m analyses.discovery.hidden_any_scale --tests 30 --rows {folder} --output {folder}/hidden.json",
        "hidden.json",
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
    "evidence": ("-m analyses.discovery.evidence --seed 6100 --output {folder}", "evidence.json"),
    "robot_exact_geometry": (
        "-m analyses.robots.whole_calibration exact 200 --seed 3601 --output {folder}/it.json",
        "it.json",
    ),
    "discover_hidden": (
        "-m analyses.hidden_effects --size small --answer api --simulations 199 --judge-draws 40 --kinds single "
        "without foreign two three mixed periodic --seed 7406 7407 7408 7411 --protocols paper unloading "
        "uneven dense temperature slack --output {folder}",
        "scores.json",
    ),
    # on a machine that does nothing else
    "seconds": ("-m analyses.speed.seconds_of_a_fit --repeats 3 --output {folder}/seconds.json", "seconds.json"),
    "cost": ("-m analyses.benchmarks.cost --output {folder}", "cost.json"),
    # by a Python that has the extra "benchmark"
    "samplers": (
        "-m analyses.benchmarks --minutes 0.8 --likelihoods chain --peers NumPyro compiled ChEES emcee "
        "--output {folder}",
        "samplers.json",
    ),
    "real_wires": ("analyses/discovery/real_wires.py --together --output {folder}/wires.json", "wires.json"),
    "first_holds": (
        "-m analyses.discovery.first_holds --wire kite-1.5m --holds 5 6 --output {folder}/holds.json",
        "holds.json",
    ),
}
REDUCED = {  # of results that hold every file's answer
    "discover_clean": discovery.alarms_in_short,
    "discover_hidden": discovery.hidden_in_short,
    "evidence": discovery.evidence_in_short,
    "cost": speed.cost_in_short,
    "samplers": samplers.samplers_in_short,
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
    keep(name, result, commit.strip())


def keep(name: str, result: Any, commit: str) -> None:
    """Write what a study found into ``docs/results``.

    Parameters
    ----------
    name : str
        A key of ``STUDIES``.
    result : dict
        Content of the file that the study wrote.
    commit : str
        What found it.
    """
    command, _ = STUDIES[name]
    if name in REDUCED:
        result = REDUCED[name](result)
    kept = {
        "command": "python " + re.sub(r" --(rows|output) \S+", "", command),
        "commit": commit,
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
        ROOT / "README.md": _BLOCK.sub(lambda block: block[1] + claims.readme_figures(kept) + block[2], readme),
        DOCS / "trust-claims.inc": claims.table_of_claims(kept),
        DOCS / "any-scale.inc": intervals.intervals_at_any_scale(kept["any_scale"]),
        DOCS / "real-files.inc": intervals.public_recordings(kept["real_files"]),
        DOCS / "weights.inc": intervals.steps_and_weights(kept["weights"]),
        DOCS / "clean-any-scale.inc": discovery.false_alarms_at_any_scale(kept["clean_any_scale"]),
        DOCS / "null-under-weights.inc": discovery.p_under_weights(kept["null_under_weights"]),
        DOCS / "unknown-bands.inc": discovery.bands_of_the_unknown(kept["unknown_bands"]),
        DOCS / "hidden-any-scale.inc": discovery.hidden_effects_at_any_scale(kept["hidden_any_scale"]),
        DOCS / "calibration.inc": intervals.ranks(kept["calibration"]),
        DOCS / "wires-before.inc": intervals.wires_before(kept["wires_before"]),
        DOCS / "coverage.inc": intervals.intervals_and_bands(kept["coverage"]),
        DOCS / "any-protocol.inc": intervals.intervals_whatever_the_protocol(kept["any_protocol"]),
        DOCS / "robot-calibration.inc": robots.calibrated_robots(kept["robot_calibration"])
        + robots.anchors_from_lengths_alone(kept["robot_lengths_alone"])
        + robots.anchors_held_exact(kept["robot_exact_geometry"]),
        DOCS / "real-wires.inc": discovery.papers_wires(kept["real_wires"]),
        DOCS / "first-holds.inc": discovery.evidence_of_first_holds(kept["first_holds"]),
        DOCS / "evidence.inc": discovery.evidence_of_refits(kept["evidence"]),
        DOCS / "discover-answer.inc": claims.answer_of_discover(),
        DOCS / "discover-clean-said.inc": discovery.false_alarms(kept["discover_clean"]),
        DOCS / "draws.inc": speed.draws_an_evaluation(kept["cost"]),
        DOCS / "evaluation-cost.inc": speed.cost_of_an_evaluation(kept["cost"]),
        DOCS / "samplers.inc": samplers.against_other_samplers(kept["samplers"]),
        DOCS / "samplers-agree.inc": samplers.other_samplers_agree(kept["samplers"]),
        DOCS / "seconds.inc": speed.seconds_of_commands(kept["seconds"]),
        DOCS / "discover-hidden-said.inc": discovery.hidden_effects(kept["discover_hidden"]),
    }


if __name__ == "__main__":
    if sys.argv[1:] != ["--texts"]:
        for chosen in sys.argv[1:] or STUDIES:
            measure(chosen)
    for path, text in texts().items():
        path.write_text(text, encoding="utf-8")
