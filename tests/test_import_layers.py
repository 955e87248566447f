"""One direction of dependence: a package imports only from packages of layers below its own."""

import ast
from functools import cache
from pathlib import Path

import wirebayes
from analyses.project import measures

ROOT = Path(wirebayes.__file__).parent
LAYERS: list[set[str]] = [
    {"_version", "errors", "progress", "result_warnings"},
    {"numeric"},
    {"json_files"},
    {"sentences"},
    {"strict", "processes"},
    {"wire"},
    {"io", "effects"},
    {"model"},
    {"simulation", "inference"},
    {"results"},
    {"prediction"},
    {"comparison", "discovery"},
    {"planning", "preloaded"},
    {"answers"},
    {"report"},
    {"paper"},
    {"views"},
    {"commands"},
    {"app"},
    {"cli"},
]
NEUTRAL = {"errors", "progress", "result_warnings", "json_files", "numeric", "sentences", "strict"}
ROBOT_MAY_USE = NEUTRAL | {"wire", "robot"}
MAY_USE_ROBOT = {"report", "paper", "views", "commands", "app", "cli", "__init__"}


@cache
def imports() -> set[tuple[str, str, str]]:
    """Importing package, imported package and file of every import within the project, also those inside functions."""
    found = set()
    for file in ROOT.rglob("*.py"):
        package = file.relative_to(ROOT).parts[0].removesuffix(".py")
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            names: list[str] = []
            if isinstance(node, ast.ImportFrom) and node.module:
                names = [f"{node.module}.{alias.name}" for alias in node.names]
            elif isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            for name in names:
                parts = name.split(".")
                if parts[0] == "wirebayes" and len(parts) > 1 and parts[1] != package:
                    found.add((package, parts[1], str(file.relative_to(ROOT))))
    return found


def test_imports_point_one_way() -> None:
    rank = {name: i for i, layer in enumerate(LAYERS) for name in layer}
    back = [
        f"{file} imports {imported}"
        for package, imported, file in sorted(imports())
        if package in rank and imported in rank and rank[imported] >= rank[package]
    ]
    assert not back


def test_the_robot_stands_on_the_wire_alone() -> None:
    crossing = [
        f"{file} imports {imported}"
        for package, imported, file in sorted(imports())
        if (package == "robot" and imported not in ROBOT_MAY_USE)
        or (imported == "robot" and package not in MAY_USE_ROBOT | {"robot"})
    ]
    assert not crossing


def test_every_package_has_a_layer() -> None:
    packages = {p.parent.name for p in ROOT.glob("*/__init__.py")}
    known = set().union(*LAYERS) | {"robot"}
    assert packages <= known


def test_the_app_is_a_room_of_its_own() -> None:
    assert {file for _, imported, file in imports() if imported == "app"} == {"cli/app.py"}


def test_no_files_import_one_another_in_a_circle():
    """Not within a package either."""
    files = measures.trees(ROOT.parent)
    known = {measures.module_name(path): path for path in files}
    assert measures.circles({path: measures.imported(tree, known) for path, tree in files.items()}) == []


def test_a_circle_is_found():
    a, b, c, d = map(Path, "abcd")
    assert measures.circles({a: {b}, b: {c}, c: {a}, d: {a}}) == [[a, b, c]]
    assert measures.circles({a: {b}, b: {c}, c: set(), d: {a}}) == []
