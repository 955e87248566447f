"""Which share of the lines of each part of the package the tests have run, by the file of `make coverage`.

python -m analyses.project.lines_run
"""

from collections import Counter
from pathlib import Path

import coverage

import wirebayes

HOME = Path(wirebayes.__file__).parent


def shares(data: coverage.Coverage) -> dict[str, tuple[int, int]]:
    """Lines run and lines in all of each package; a module of its own beside the packages counts to ``wirebayes``."""
    run: Counter[str] = Counter()
    whole: Counter[str] = Counter()
    for file in sorted(HOME.rglob("*.py")):
        parts = file.relative_to(HOME).parts
        package = f"wirebayes.{parts[0]}" if len(parts) > 1 else "wirebayes"
        _, statements, _, missing, _ = data.analysis2(str(file))
        run[package] += len(statements) - len(missing)
        whole[package] += len(statements)
    return {package: (run[package], whole[package]) for package in sorted(whole)}


def table(found: dict[str, tuple[int, int]]) -> str:
    """A line for each package, then all of them together."""
    rows = {**found, "all": (sum(run for run, _ in found.values()), sum(whole for _, whole in found.values()))}
    return "\n".join(
        f"{package:22} {100 * run / max(whole, 1):5.1f} % of {whole:6,} lines" for package, (run, whole) in rows.items()
    )


def main() -> None:
    data = coverage.Coverage()
    data.load()
    print("Lines of the package that these tests run (subprocesses are not counted):")
    print(table(shares(data)))


if __name__ == "__main__":
    main()
