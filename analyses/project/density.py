"""How dense functions are, as wholes and by their bodies alone, here and in libraries that many people read.

    python -m analyses.project.density [--densest N]

Syntax nodes do not change when a packed expression is wrapped over more lines; docstrings do not count. As a whole a
function is charged for its signature, whose annotations are many nodes in what counts as one line. Its body alone is
fairer: executable statements without annotations, over the lines on which a piece of them begins or ends; comments,
blank lines and docstrings are no lines.
"""

import argparse
import ast
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from statistics import median, quantiles

HERE = Path(__file__).parents[2]
LONG_ENOUGH = 12  # lines: shorter functions are read at a glance, whatever their density
# Packages that stand in the environment anyway, and are read by many: samplers, statistics, numerics.
PEERS = ("emcee", "arviz_stats", "arviz_base", "dynesty", "scipy.optimize", "scipy.stats", "numpy.linalg")


def sources(package: Path) -> list[Path]:
    """The files of a package, without its tests."""
    files = sorted(package.rglob("*.py"))
    return [file for file in files if "tests" not in file.relative_to(package).parts]


def parsed(file: Path) -> ast.Module:
    """The syntax of a file without its docstrings."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node) is not None:
            node.body = node.body[1:]
    return tree


def functions_of(trees: Iterable[ast.Module]) -> list[ast.FunctionDef]:
    return [node for tree in trees for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]


def nodes(tree: ast.AST) -> int:
    return sum(1 for _ in ast.walk(tree))


def code_lines(function: ast.FunctionDef) -> int:
    """Lines of a function from its first statement on, the signature counted as one."""
    if not function.body:
        return 1
    return 1 + (function.end_lineno or 0) - function.body[0].lineno + 1


def local_names(function: ast.AST) -> set[str]:
    return {n.id for n in ast.walk(function) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}


def statements(function: ast.AST) -> int:
    return sum(isinstance(node, ast.stmt) for node in ast.walk(function))


def executable(statement: ast.AST) -> Iterator[ast.AST]:
    """A statement and all that is part of it, but for annotations."""
    yield statement
    for field, value in ast.iter_fields(statement):
        if field in ("annotation", "returns"):
            continue
        for part in value if isinstance(value, list) else [value]:
            if isinstance(part, ast.AST):
                yield from executable(part)


@dataclass(frozen=True)
class Body:
    """The executable statements of one function.

    Attributes
    ----------
    nodes, lines, statements, names : int
    """

    nodes: int
    lines: int
    statements: int
    names: int

    @classmethod
    def of(cls, function: ast.FunctionDef) -> "Body":
        parts = [part for statement in function.body for part in executable(statement)]
        places = [part for part in parts if isinstance(part, ast.stmt | ast.expr)]
        begun, ended = {part.lineno for part in places}, {part.end_lineno for part in places}
        return cls(
            len(parts),
            len(begun | ended),
            sum(isinstance(part, ast.stmt) for part in parts),
            len({part.id for part in parts if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store)}),
        )


def long_bodies(functions: Iterable[ast.FunctionDef]) -> list[Body]:
    """The bodies of `LONG_ENOUGH` lines or more."""
    return [body for body in map(Body.of, functions) if body.lines >= LONG_ENOUGH]


def in_a_row(package: str, trees: Iterable[ast.Module]) -> list[str]:
    """What `HEAD` names, of the functions of a package: medians, but for the density of the densest tenth."""
    functions = functions_of(trees)
    bodies = long_bodies(functions)
    density = [body.nodes / body.lines for body in bodies]
    with_signature = [nodes(f) / code_lines(f) for f in functions if code_lines(f) >= LONG_ENOUGH]
    figures = [
        median(density),
        quantiles(density, n=10)[-1],
        median(body.nodes / body.statements for body in bodies),
        median(body.names for body in bodies),
        median(body.lines for body in bodies),
        median(with_signature),
    ]
    return [package, f"{len(bodies):,}", *(f"{figure:.1f}" for figure in figures)]


HEAD = [
    "long bodies of",
    "functions",
    "nodes a line",
    "densest tenth from",
    "nodes a statement",
    "names",
    "lines",
    "nodes a line as wholes",
]


def beside_peers(root: Path) -> list[str]:
    """Lines of a table: the package of a checkout, and below it those that stand in the environment."""
    packages = {"wirebayes": root / "wirebayes"}
    for name in PEERS:
        found = find_spec(name)
        if found is not None and found.submodule_search_locations:
            packages[name] = Path(found.submodule_search_locations[0])
    rows = [in_a_row(name, map(parsed, sources(package))) for name, package in packages.items()]
    return ["| " + " | ".join(row) + " |" for row in [HEAD, ["---"] * len(HEAD), *rows]]


def densest(root: Path, most: int) -> list[str]:
    """The long bodies with the most nodes a line, each with its place, its density and its local names."""
    found = []
    for file in sources(root / "wirebayes"):
        for function in functions_of([parsed(file)]):
            place = f"{file.relative_to(root)}:{function.lineno} {function.name}"
            found += [(body.nodes / body.lines, body.names, place) for body in long_bodies([function])]
    found.sort(reverse=True)
    return [f"{density:5.1f} {names:3} {place}" for density, names, place in found[:most]]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--densest", type=int, default=0, metavar="N", help="list so many functions too")
    options = parser.parse_args()
    print("\n".join([*beside_peers(HERE), *densest(HERE, options.densest)]))


if __name__ == "__main__":
    main()
