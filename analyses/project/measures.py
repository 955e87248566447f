"""How heavy the code is to read: its density, circles of files, homonyms, and the files that a command walks through.

    python -m analyses.project.measures [CHECKOUT] [--static]

Density is counted in syntax nodes, which wrapping a packed expression over more lines does not change; docstrings do
not count. A function counts from `LONG_ENOUGH` lines on. A table sets bodies without signatures and annotations, which
are nodes but hardly lines, beside those of libraries that many people read (`analyses/project/density.py`).

The walk follows one process through small runs of fit, discover and pose with the package of the checkout: which
functions are called, in which files, and how often the next function that is called for the first time stands in
another file than the one before.
"""

import argparse
import ast
import json
import os
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

from analyses.project.density import (
    LONG_ENOUGH,
    beside_peers,
    code_lines,
    functions_of,
    local_names,
    nodes,
    parsed,
    sources,
    statements,
)

HERE = Path(__file__).parents[2]
LONG_FILE = 400  # lines: more than one idea, by experience with this code
PAPER = "data/paper/experiments.toml"
WIRE = "roc-line-1m"
ALL = Path("wirebayes/__init__.py")


def trees(root: Path) -> dict[Path, ast.Module]:
    """The syntax of every file of the package, without docstrings."""
    return {path.relative_to(root): parsed(path) for path in sources(root / "wirebayes")}


def module_name(path: Path) -> str:
    parts = path.with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imported(tree: ast.Module, known: dict[str, Path]) -> set[Path]:
    """Files of the package that a file imports, also inside functions; of a name in a module, that module."""
    found = set()
    for node in ast.walk(tree):
        names: list[str] = []
        if isinstance(node, ast.ImportFrom) and node.module:
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        elif isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        for name in names:
            while name and name not in known:  # a name in a module, or the compiled kernel in its package
                name = name.rpartition(".")[0]
            if name:
                found.add(known[name])
    return found


def circles(uses: dict[Path, set[Path]]) -> list[list[Path]]:
    """Groups of files that reach one another through their imports."""

    def reached(start: Path) -> set[Path]:
        seen: set[Path] = set()
        todo = list(uses[start])
        while todo:
            file = todo.pop()
            if file not in seen:
                seen.add(file)
                todo += uses[file]
        return seen

    reach = {file: reached(file) for file in uses}
    groups = {frozenset(other for other in reach[file] if file in reach[other]) for file in uses if file in reach[file]}
    return sorted(sorted(group) for group in groups)


def homonyms(files: dict[Path, ast.Module]) -> dict[str, list[str]]:
    """Public functions and classes whose name stands in several files."""
    places = defaultdict(list)
    for path, tree in files.items():
        for node in tree.body:
            if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
                places[node.name].append(str(path))
    return {name: where for name, where in sorted(places.items()) if len(where) > 1}


def on_paper(root: Path) -> dict[str, Any]:
    """What the source shows without running."""
    files = trees(root)
    texts = {path: (root / path).read_text(encoding="utf-8") for path in files}
    known = {module_name(path): path for path in files}
    uses = {path: imported(tree, known) for path, tree in files.items()}
    kept = [function for function in functions_of(files.values()) if code_lines(function) >= LONG_ENOUGH]
    long_files = {str(path): n for path, text in texts.items() if (n := len(text.splitlines())) > LONG_FILE}
    return {
        "files": len(files),
        "lines": sum(len(text.splitlines()) for text in texts.values()),
        "nodes": sum(map(nodes, files.values())),
        "functions of 12 lines or more": len(kept),
        "nodes a line, median": round(median(nodes(f) / code_lines(f) for f in kept), 1),
        "nodes a statement, median": round(median(nodes(f) / statements(f) for f in kept), 1),
        "names a function, median": median(len(local_names(f)) for f in kept),
        "functions of more than 500 nodes": sum(nodes(f) > 500 for f in kept),
        "functions of more than 20 names": sum(len(local_names(f)) > 20 for f in kept),
        "circles": [[str(path) for path in group] for group in circles(uses)],
        "circles that do not pass through wirebayes/__init__.py": [
            [str(path) for path in group] for group in circles({file: uses[file] - {ALL} for file in uses})
        ],
        "fmt: skip": sum(text.count("# fmt: skip") for text in texts.values()),
        "files over 400 lines": long_files,
        "public names twice": homonyms(files),
        "bodies": beside_peers(root),
    }


# Run in a process of its own with the package of the checkout: follows a command and prints its calls as JSON.
FOLLOW = """
import json, os, sys, threading
import wirebayes
home = os.path.dirname(wirebayes.__file__) + os.sep
order, seen = [], set()
def follow(frame, event, argument):
    code = frame.f_code
    if event == "call" and code not in seen:
        seen.add(code)
        if code.co_filename.startswith(home) and not code.co_name.startswith("<"):
            order.append((code.co_filename[len(home):], code.co_qualname))
from wirebayes.cli import main
sys.argv = ["wirebayes", *sys.argv[1:]]
threading.setprofile(follow)
sys.setprofile(follow)
try:
    main()
except SystemExit as end:
    assert not end.code, end.code
finally:
    sys.setprofile(None)
print(json.dumps(order))
"""


def walk(root: Path, arguments: list[str]) -> list[tuple[str, str]]:
    """File and name of every function of the package that a command calls, in the order of first calls."""
    environment = os.environ | {"PYTHONPATH": str(root), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    line = [sys.executable, "-c", FOLLOW, *arguments]
    done = subprocess.run(line, capture_output=True, text=True, check=True, env=environment, cwd=root)
    return [(file, name) for file, name in json.loads(done.stdout.splitlines()[-1])]


def walked(calls: list[tuple[str, str]]) -> dict[str, int]:
    changes = sum(before != after for (before, _), (after, _) in zip(calls, calls[1:], strict=False))
    return {"functions": len(calls), "files": len({file for file, _ in calls}), "changes of file": changes}


def walks(root: Path, folder: Path) -> dict[str, dict[str, int]]:
    """What fit, discover and pose walk through, with their pages."""
    fitted = folder / "fit" / WIRE
    commands = {
        "fit": ["fit", PAPER, "--experiment", WIRE, "--output", str(folder / "fit")],
        "discover": ["discover", PAPER, "--experiment", WIRE, "--output", str(folder / "discover")],
        "pose": ["pose", "linear-7", "--wires", str(fitted), "--draws", "20", "--output", str(folder / "pose")],
    }
    return {name: walked(walk(root, [*line, "--quiet"])) for name, line in commands.items()}


def text(found: dict[str, Any]) -> Iterator[str]:
    """A line for each measure; under lists how many there are, then each."""
    for name, value in found.items():
        if name == "bodies":
            yield from value
        elif name == "walks":
            yield from (f"{command}: {counts}" for command, counts in value.items())
        elif isinstance(value, dict):
            yield f"{name}: {len(value)}"
            yield from (f"    {key}: {entry}" for key, entry in value.items())
        elif isinstance(value, list):
            yield f"{name}: {len(value)}"
            yield from (f"    {len(group)} files: {', '.join(group)}" for group in value)
        else:
            yield f"{name}: {value:,}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("checkout", nargs="?", type=Path, default=HERE)
    parser.add_argument("--static", action="store_true", help="only what the source shows, without running commands")
    parser.add_argument("--json", action="store_true", help="print the measures as JSON")
    options = parser.parse_args()
    root = options.checkout.resolve()
    found = on_paper(root)
    if not options.static:
        with TemporaryDirectory() as folder:
            found["walks"] = walks(root, Path(folder))
    print(json.dumps(found, indent=1) if options.json else "\n".join(text(found)))


if __name__ == "__main__":
    main()
