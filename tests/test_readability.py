"""A newcomer can read the code: parameters are explained, constants have a reason, functions are loose.

Read from the source alone; nothing of the package is imported.
"""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from analyses.project.density import Body, functions_of, local_names, nodes
from analyses.project.measures import LONG_FILE, homonyms, trees

ROOT = Path(__file__).parent.parent

# What click shows as help documents the commands.
CLI = ROOT / "wirebayes" / "cli"
MANY_PARAMETERS = 3
MOST_NODES = 500  # of syntax, without the docstring: about fifty loose lines
MOST_NAMES = 20  # assigned in a function: more is not kept in mind

# A name that says all there is: a unit in seconds, or a constant of mathematics.
NEEDS_NO_REASON = re.compile(r"_?(MINUTE|HOUR|DAY|YEAR)(_S)?|_?(HALF_)?LOG_2PI")


Trees = dict[Path, ast.Module]
Classes = dict[str, list[ast.ClassDef]]


# Only while the tests of this file run: every process collects it, and a million nodes slow each one down.
@pytest.fixture(scope="module")
def sources() -> dict[Path, str]:
    return {path: path.read_text() for path in sorted((ROOT / "wirebayes").rglob("*.py"))}


@pytest.fixture(scope="module")
def written(sources) -> Trees:
    return {path: ast.parse(source) for path, source in sources.items()}


@pytest.fixture(scope="module")
def bare() -> Trees:
    """Without docstrings."""
    return trees(ROOT)


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


def overrides_an_explained_method(method: ast.FunctionDef, owner: ast.ClassDef, classes: Classes) -> bool:
    for base in (base.id for base in owner.bases if isinstance(base, ast.Name)):
        for parent in classes.get(base, ()):
            same = [m for m in parent.body if isinstance(m, ast.FunctionDef) and m.name == method.name]
            if any(map(explains_parameters, same)) or overrides_an_explained_method(method, parent, classes):
                return True
    return False


def classes_of(written: Trees) -> Classes:
    """By name: the classes of all files that are called so."""
    found: Classes = {}
    for tree in written.values():
        for node in tree.body:
            if isinstance(node, ast.ClassDef):
                found.setdefault(node.name, []).append(node)
    return found


def unexplained(written: Trees) -> list[str]:
    classes = classes_of(written)
    return [
        f"{path.relative_to(ROOT)}:{function.lineno} {function.name}"
        for path, tree in written.items()
        if CLI not in path.parents
        for function, owner in functions(tree)
        if not function.name.startswith("_")
        and not (owner is not None and owner.name.startswith("_"))
        and len(parameters(function)) >= MANY_PARAMETERS
        and not explains_parameters(function)
        and not (owner is not None and overrides_an_explained_method(function, owner, classes))
    ]


def test_public_functions_with_several_parameters_explain_them(written):
    assert unexplained(written) == []


def holds_a_number(value: ast.expr) -> bool:
    numbers = (node.value for node in ast.walk(value) if isinstance(node, ast.Constant))
    return any(isinstance(number, int | float) and not isinstance(number, bool) for number in numbers)


def has_a_reason(assignment: ast.stmt, lines: list[str]) -> bool:
    """A comment on one of its lines, or above it or the block of constants it belongs to."""
    if any("#" in line for line in lines[assignment.lineno - 1 : assignment.end_lineno]):
        return True
    return assignment.lineno > 1 and lines[assignment.lineno - 2].lstrip().startswith("#")


def constants_without_a_reason(written: Trees, sources: dict[Path, str]) -> list[str]:
    found = []
    for path, tree in written.items():
        lines = sources[path].splitlines()
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


def test_no_file_is_long(sources):
    lengths = {str(path.relative_to(ROOT)): source.count("\n") for path, source in sources.items()}
    assert {path: lines for path, lines in lengths.items() if lines > LONG_FILE} == {}


def test_constants_have_a_reason(written, sources):
    assert constants_without_a_reason(written, sources) == []


def test_no_function_returns_a_bare_tuple_of_more_than_three(written):
    """Four values that travel together get a named dataclass."""
    found = []
    for path, tree in written.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef) and isinstance(node.returns, ast.Subscript):
                kind, inside = node.returns.value, node.returns.slice
                if getattr(kind, "id", "") == "tuple" and isinstance(inside, ast.Tuple) and len(inside.elts) > 3:
                    found.append(f"{path.relative_to(ROOT)}:{node.lineno} {node.name}")
    assert found == []


def sizes(bare: Trees) -> dict[str, tuple[int, int]]:
    """Syntax nodes and local names of every function and method by its place; what is nested in one counts to it."""
    found = {}
    for path, tree in bare.items():
        for function, owner in functions(tree):
            place = f"{path}:{owner.name + '.' if owner else ''}{function.name}"
            found[place] = nodes(function), len(local_names(function))
    return found


def is_dense(nodes: int, names: int) -> bool:
    return nodes > MOST_NODES or names > MOST_NAMES


def test_no_function_is_dense(bare):
    assert [place for place, size in sizes(bare).items() if is_dense(*size)] == [], "split it, or give it fewer names"


def test_what_is_dense_is_found():
    names = "\n".join(f"    a{i} = {i}" for i in range(MOST_NAMES + 1))
    source = f"def many():\n{names}\n\n\ndef packed():\n    return [{'1, ' * (MOST_NODES + 1)}]\n"
    many, packed = (function for function, _ in functions(ast.parse(source)))
    assert is_dense(nodes(many), len(local_names(many)))
    assert len(local_names(packed)) == 0
    assert is_dense(nodes(packed), 0)


def test_a_body_has_neither_signature_nor_annotations_comments_or_blank_lines():
    plain = "def f(a):\n    b = a\n    return b"
    dressed = "def f(a: dict[str, int]) -> int:\n    b: int = a\n\n    # why\n    return b"
    bodies = [Body.of(function) for text in (plain, dressed) for function in functions_of([ast.parse(text)])]
    assert [(body.lines, body.statements, body.names) for body in bodies] == [(2, 2, 1)] * 2
    assert bodies[0].nodes == bodies[1].nodes == 8


def test_no_public_name_stands_for_two_things(bare):
    assert homonyms(bare) == {}, "give each a name of its own, or an underscore where one file alone uses it"


def test_a_name_in_two_files_is_found():
    one, two = ast.parse("def page(): ...\n\nclass Hold: ..."), ast.parse("def page(): ...\n\ndef _hold(): ...")
    assert homonyms({Path("a.py"): one, Path("b.py"): two}) == {"page": ["a.py", "b.py"]}


def test_the_files_that_contributing_names_are_there():
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    named = re.findall(r"`((?:[a-z_]+/)+[a-z_]+\.(?:pyx?|toml|txt|rst))`", text)
    assert len(named) > 30
    assert [name for name in named if not ((ROOT / name).is_file() or (ROOT / "wirebayes" / name).is_file())] == []
