"""Which fast tests run a line: measured once a test file, and again when it or a module that it runs has changed."""

import hashlib
import json
from collections.abc import Iterable
from pathlib import Path

from analyses.mutants.mistakes import Mutant
from analyses.mutants.tree import reach_of


def _files(package: str, names: str) -> list[str]:
    return [f"tests/{package}/test_{name}.py" for name in names.split()]


# Folders and files whose tests say what the modules of a package do. Others run them too, in whole fits and commands
# that take too long to be asked of every mutant.
TESTS = {
    "model": ["tests/model"],
    "inference": ["tests/inference/sampler", *_files("inference", "importance")],
    "results": _files("results", "contraction identifiability outliers posterior_checks"),
    "prediction": _files("prediction", "held_out leave_one_hold_out left_out_density pit_band predictive table"),
    "comparison": ["tests/comparison"],
    "discovery": _files(
        "discovery",
        "explore gate global_test held_out model_space name_evidence power refit "
        "sharing settings shrinking subsets thresholds verdict",
    ),
    "robot/mechanics": _files("robot", "statics tensions pulleys"),
    "robot/motion": _files("robot", "forward"),
    "robot/pose": _files("robot", "pose_reports answer controllers drums"),
    "robot/proof": _files("robot", "certificate proofs reach pulleys"),
}
_PATIENCE_CPU_S = 40.0  # a file that takes longer has no test for a mutant


class Reach:
    """Seconds of each test and, for each line of the package, the tests that run it."""

    def __init__(self, rows: Iterable[dict]) -> None:
        self.seconds: dict[str, float] = {}
        self.of_line: dict[tuple[str, int], set[str]] = {}
        for row in rows:
            self.seconds |= row["seconds"]
            for test, files in row["lines"].items():
                for file, lines in files.items():
                    for line in lines:
                        tests = row["seconds"] if test == "fixtures" else [test]
                        self.of_line.setdefault((file, line), set()).update(tests)

    def tests(self, mutant: Mutant, budget_s: float) -> list[str]:
        """The quickest tests that run a mutant, as far as the seconds last; by file, quick files first.

        What runs on import counts where it is used, and in the test file of the module's name.
        """
        able = set().union(*(self.of_line.get(line, set()) for line in mutant.reached_by))
        if not mutant.function:
            own = f"/test_{Path(mutant.file).stem}.py::"
            able |= {test for test in self.seconds if own in test}
        chosen, spent = [], 0.0
        for test in sorted(able, key=lambda test: (self.seconds[test], test)):
            spent += self.seconds[test]
            if spent > budget_s:
                break
            chosen.append(test)
        of_file: dict[str, float] = {}
        for test in chosen:
            of_file[test.split("::")[0]] = of_file.get(test.split("::")[0], 0.0) + self.seconds[test]
        return sorted(chosen, key=lambda test: (of_file[test.split("::")[0]], test.split("::")[0], self.seconds[test]))


def measure(tree: Path, record: Path, packages: Iterable[str]) -> Reach:
    """Take from the record what still holds, measure the rest, and keep it there."""
    known = {row["key"]: row for row in map(json.loads, record.read_text().splitlines())} if record.exists() else {}
    rows = []
    for file in test_files(tree, packages):
        key = f"{file} {_hash(tree / file)}"
        if key not in known or not _as_measured(tree, known[key]["modules"]):
            print(f"reach of {file}", flush=True)
            found = reach_of(tree, file, tree.parent / "reach.json", _PATIENCE_CPU_S)
            modules = sorted({name for files in found["lines"].values() for name in files})
            known[key] = {"key": key, "modules": {name: _hash(tree / name) for name in modules}} | found
            with record.open("a") as out:
                out.write(json.dumps(known[key]) + "\n")
        rows.append(known[key])
    return Reach(rows)


def _as_measured(tree: Path, modules: dict[str, str]) -> bool:
    return all(_hash(tree / name) == was for name, was in modules.items())


def _hash(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()[:16] if file.is_file() else ""


def package_of(file: str) -> str:
    """The package of a module that has tests of its own here."""
    parts = file.split("/")[1:]
    return next(name for name in ("/".join(parts[:n]) for n in (2, 1)) if name in TESTS)


def test_files(tree: Path, packages: Iterable[str]) -> list[str]:
    """Of some packages."""
    found = []
    for path in (tree / name for package in packages for name in TESTS[package]):
        found += sorted(path.rglob("test_*.py")) if path.is_dir() else [path]
    return [str(path.relative_to(tree)) for path in found]
