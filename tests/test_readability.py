"""A newcomer can read the code: parameters are explained, constants have a reason, functions stay short.

Read from the source alone; nothing is imported.
"""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parent.parent
SOURCES = {path: path.read_text() for path in sorted((ROOT / "wirebayes").rglob("*.py"))}
TREES = {path: ast.parse(source) for path, source in SOURCES.items()}

# What click shows as help documents the commands.
CLI = ROOT / "wirebayes" / "cli"
MANY_PARAMETERS = 3
LONGEST_FUNCTION = 75  # lines without the docstring
MOST_LOCAL_NAMES = 33

# A name that says all there is: a unit in seconds, or a constant of mathematics.
NEEDS_NO_REASON = re.compile(r"_?(MINUTE|HOUR|DAY|YEAR)(_S)?|_?(HALF_)?LOG_2PI")


def functions(tree: ast.Module) -> Iterator[tuple[ast.FunctionDef, ast.ClassDef | None]]:
    """Functions of a module and methods of its classes; what is nested in a function is its own business."""
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            yield node, None
        elif isinstance(node, ast.ClassDef):
            for method in node.body:
                if isinstance(method, ast.FunctionDef):
                    yield method, node


def parameters(function: ast.FunctionDef) -> list[str]:
    own = function.args.posonlyargs + function.args.args + function.args.kwonlyargs
    return [argument.arg for argument in own if argument.arg not in ("self", "cls")]


def explains_parameters(function: ast.FunctionDef) -> bool:
    return "Parameters\n----------\n" in (ast.get_docstring(function) or "")


def overrides_an_explained_method(method: ast.FunctionDef, owner: ast.ClassDef) -> bool:
    for base in (base.id for base in owner.bases if isinstance(base, ast.Name)):
        for parent in CLASSES.get(base, ()):
            same = [m for m in parent.body if isinstance(m, ast.FunctionDef) and m.name == method.name]
            if any(map(explains_parameters, same)) or overrides_an_explained_method(method, parent):
                return True
    return False


CLASSES: dict[str, list[ast.ClassDef]] = {}
for _tree in TREES.values():
    for _node in _tree.body:
        if isinstance(_node, ast.ClassDef):
            CLASSES.setdefault(_node.name, []).append(_node)


def unexplained() -> list[str]:
    return [
        f"{path.relative_to(ROOT)}:{function.lineno} {function.name}"
        for path, tree in TREES.items()
        if CLI not in path.parents
        for function, owner in functions(tree)
        if not function.name.startswith("_")
        and len(parameters(function)) >= MANY_PARAMETERS
        and not explains_parameters(function)
        and not (owner is not None and overrides_an_explained_method(function, owner))
    ]


def test_public_functions_with_several_parameters_explain_them():
    assert unexplained() == []


def holds_a_number(value: ast.expr) -> bool:
    numbers = (node.value for node in ast.walk(value) if isinstance(node, ast.Constant))
    return any(isinstance(number, int | float) and not isinstance(number, bool) for number in numbers)


def has_a_reason(assignment: ast.stmt, lines: list[str]) -> bool:
    """A comment on one of its lines, or above it or the block of constants it belongs to."""
    if any("#" in line for line in lines[assignment.lineno - 1 : assignment.end_lineno]):
        return True
    return assignment.lineno > 1 and lines[assignment.lineno - 2].lstrip().startswith("#")


def constants_without_a_reason() -> list[str]:
    found = []
    for path, tree in TREES.items():
        lines = SOURCES[path].splitlines()
        for node in tree.body:
            if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
                continue
            target = node.targets[0] if isinstance(node, ast.Assign) else node.target
            if (
                isinstance(target, ast.Name)
                and re.fullmatch(r"_?[A-Z][A-Z0-9_]*", target.id)
                and not NEEDS_NO_REASON.fullmatch(target.id)
                and holds_a_number(node.value)
                and not has_a_reason(node, lines)
            ):
                found.append(f"{path.relative_to(ROOT)}:{node.lineno} {target.id}")
    return found


def test_constants_have_a_reason():
    assert constants_without_a_reason() == []


def test_no_function_returns_a_bare_tuple_of_more_than_three():
    """Four values that travel together get a named dataclass."""
    found = []
    for path, tree in TREES.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef) and isinstance(node.returns, ast.Subscript):
                kind, inside = node.returns.value, node.returns.slice
                if getattr(kind, "id", "") == "tuple" and isinstance(inside, ast.Tuple) and len(inside.elts) > 3:
                    found.append(f"{path.relative_to(ROOT)}:{node.lineno} {node.name}")
    assert found == []


def sizes() -> list[tuple[int, int, str]]:
    """Lines without the docstring, local names, and the place of every function."""
    found = []
    for path, tree in TREES.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef):
                doc = ast.get_docstring(node)
                lines = node.end_lineno - node.lineno + 1 - (len(doc.splitlines()) + 1 if doc else 0)
                stored = {n.id for n in ast.walk(node) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
                found.append((lines, len(stored), f"{path.relative_to(ROOT)}:{node.lineno} {node.name}"))
    return found


def test_functions_are_no_longer_than_now():
    lines, _, where = max(sizes())
    assert lines <= LONGEST_FUNCTION, f"{where} has {lines} lines: split it"


def test_functions_have_no_more_local_names_than_now():
    _, names, where = max(sizes(), key=lambda size: size[1])
    assert names <= MOST_LOCAL_NAMES, f"{where} has {names} local names: split it"
