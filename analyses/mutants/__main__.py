"""``python -m analyses.mutants --output out/mutants``: the share of small mistakes that the fast tests notice.

It measures which test runs which line, draws mutants of each module of `MODULES` at random, adds the twelve of
`mistakes.NAMED`, and tries each on the quickest tests that run its line, up to ``--budget`` seconds of them. Lines of
JSON in the output folder record every step; run again, it goes on from there, and tries a survivor again only when the
tests that reach it have changed. ``judged.toml`` holds what people said of survivors. A mutant runs in a copy of the
tree, in a process forked from one that has loaded the libraries, so it costs its tests and no more.
"""

import argparse
import hashlib
import json
import tempfile
import tomllib
from pathlib import Path

from analyses.mutants.mistakes import Mutant, mutants, named
from analyses.mutants.reach import measure, package_of
from analyses.mutants.tree import copy_of_the_checkout, preload, run

# What decides, by package.
MODULES = {
    "model": ["likelihoods", "problem", "build"],
    "inference": ["convergence", "importance", "sampler/burn_in", "sampler/ensemble", "sampler/kept", "sampler/moves",
                  "sampler/stop_rule"],
    "results": ["contraction", "identifiability", "outliers", "posterior_checks"],
    "prediction": ["held_out", "leave_one_hold_out", "left_out_density", "predictive", "table"],
    "comparison": ["candidates", "compare"],
    "discovery": ["global_test", "held_out", "model_space", "power", "refit", "settings", "shrinking", "stepwise",
                  "verdict"],
    "robot": ["mechanics/statics", "mechanics/tensions", "motion/forward", "motion/downhill",
              "pose/answer", "pose/controllers",
              "pose/stability", "proof/certificate", "proof/proofs", "proof/reach"],
}  # fmt: skip


def files(only: str) -> list[str]:
    """The modules whose path holds a word."""
    every = [f"wirebayes/{package}/{name}.py" for package, names in MODULES.items() for name in names]
    return [file for file in every if only in file]


def rows_of(record: Path) -> dict[str, dict]:
    """The record, the last line of each key."""
    return {row["key"]: row for row in map(json.loads, record.read_text().splitlines())} if record.exists() else {}


def judgement(row: dict, judged: dict[str, list[dict]]) -> tuple[str, str]:
    """What people said of a survivor: "equivalent" or "survives", and why; nothing if nobody has looked."""
    for word, cases in judged.items():
        for case in cases:
            same = all(case[name] == row[name] for name in ("file", "function", "what"))
            if same and case.get("statement", "") in row["statement"]:
                return word, case["why"]
    return "", ""


def table(rows: list[dict], judged: dict[str, list[dict]], of: int) -> list[str]:
    """A line for each package (of = 2 parts of the path) or module (of = 9): tried, killed, equivalent, score."""
    lines = [f"{'':34s} tried  killed  equivalent  survive  killed of the non-equivalent"]
    groups: dict[str, list[dict]] = {}
    for row in rows:
        groups.setdefault("/".join(row["file"].removesuffix(".py").split("/")[1:of]), []).append(row)
    for name, group in [*groups.items(), ("all", rows)]:
        survivors = [row for row in group if row["outcome"] == "survived"]
        equivalent = sum(judgement(row, judged)[0] == "equivalent" for row in survivors)
        killed, real = len(group) - len(survivors), len(group) - equivalent
        lines.append(f"{name:34s} {len(group):5d} {killed:7d} {equivalent:11d} {real - killed:8d} {killed / real:8.0%}")
    return lines


def tried(mutant: Mutant, tests: list[str], tree: Path, reached_s: float) -> dict:
    """A row of the record: what the tests say of a mutant."""
    outcome, took, by = run(tree, tests, 10 * reached_s + 30, mutant) if tests else ("passed", 0.0, "")
    return {
        "key": mutant.key,
        "file": mutant.file,
        "function": mutant.function,
        "line": mutant.line,
        "what": mutant.what,
        "outcome": {"passed": "survived", "failed": "killed", "hung": "killed by time"}[outcome],
        "s": round(took, 1),
        "tests": len(tests),
        "killed_by": by,
    }


def _hash(tree: Path, tests: list[str]) -> str:
    """Of the files of these tests."""
    files_of_tests = sorted({test.split("::")[0] for test in tests})
    return hashlib.sha256("".join((tree / name).read_text() for name in files_of_tests).encode()).hexdigest()[:16]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=Path("out/mutants"))
    parser.add_argument("--each", type=int, default=10, help="mutants of each module")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default="", help="modules whose path holds this, or 'named'")
    parser.add_argument("--budget", type=float, default=30.0, help="seconds of tests for a mutant")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    record = options.output / "mutants.jsonl"
    known, rows = rows_of(record), []
    todo = [] if options.only and options.only != "named" else named()
    for file in files(options.only):
        todo += mutants(file, options.each, options.seed)
    preload()
    with tempfile.TemporaryDirectory(prefix="mutants-") as scratch:
        tree = copy_of_the_checkout(Path(scratch))
        packages = sorted({package_of(mutant.file) for mutant in todo})
        reach = measure(tree, options.output / "reach.jsonl", packages)
        sound = set[str]()
        for mutant in todo:
            tests = reach.tests(mutant, options.budget)
            of_files = _hash(tree, tests)
            row = known.get(mutant.key)
            if row is None or (row["outcome"] == "survived" and row["of_files"] != of_files):
                row = tried(mutant, tests, tree, sum(reach.seconds[test] for test in tests)) | {"of_files": of_files}
                test = row["killed_by"]
                if test and test not in sound:
                    if run(tree, [test], 600)[0] != "passed":
                        raise SystemExit(f"{test} fails without any mutant")
                    sound.add(test)
                with record.open("a") as out:
                    out.write(json.dumps(row) + "\n")
                print(f"{row['outcome']:14s} {row['s']:6.1f} s {mutant.file}:{mutant.line} {mutant.what}", flush=True)
            rows.append(row | {"line": mutant.line, "statement": mutant.statement})
    judged = tomllib.loads((Path(__file__).parent / "judged.toml").read_text(encoding="utf-8"))
    print("\n".join([*table(rows, judged, 2), "", *table(rows, judged, 9), "", "Survivors:"]))
    for row in rows:
        if row["outcome"] == "survived":
            word, why = judgement(row, judged)
            print(f"  {row['file']}:{row['line']} {row['function']} {row['what']} ({word or 'not judged'}) {why}")


if __name__ == "__main__":
    main()
