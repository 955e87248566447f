"""Small mistakes in a module: all that can be made, a repeatable draw of them, and twelve by name.

Comparisons turn around or change their strictness, operators swap, ``and`` becomes ``or``, ``not`` and signs are
dropped, numbers change, a function returns None. Annotations, decorators, messages, what is raised and ``strict`` of
`zip` decide nothing and are passed by.
"""

import ast
import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]

COMPARED: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.GtE,
    ast.LtE: ast.Gt,
    ast.Gt: ast.LtE,
    ast.GtE: ast.Lt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
}
# A bound that is held or not: the mistake that only a test at the threshold finds.
STRICT: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
}
COMPUTED: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.Pow: ast.Mult,
}


_SMALL = 10  # one more of a thousand steps or draws decides nothing


@dataclass(frozen=True)
class Mutant:
    """One mistake: where, what it reads, the whole text of the module with it, and the lines that run it."""

    file: str
    function: str
    line: int
    statement: str
    what: str
    text: str
    reached_by: tuple[tuple[str, int], ...]
    """(file, line): a test that runs any of them may notice."""

    @property
    def key(self) -> str:
        return hashlib.sha256("\x1f".join([self.file, self.text]).encode()).hexdigest()[:16]


@dataclass(frozen=True)
class _Site:
    """A place for a mistake: the node, its number among the nodes of the tree, and what holds it."""

    at: int
    node: ast.AST
    changed: ast.AST
    word: str
    inside: tuple[ast.AST, ...]


def _changes(node: ast.AST) -> Iterator[tuple[str, ast.AST]]:
    """Every mistake that can be made at a node, with a word for it."""
    if isinstance(node, ast.Compare):
        for table, word in ((COMPARED, "turned"), (STRICT, "strictness")):
            for i, operator in enumerate(node.ops):
                if type(operator) in table:
                    ops = [*node.ops[:i], table[type(operator)](), *node.ops[i + 1 :]]
                    yield word, ast.Compare(node.left, ops, node.comparators)
    elif isinstance(node, ast.BinOp) and type(node.op) in COMPUTED:
        yield "operator", ast.BinOp(node.left, COMPUTED[type(node.op)](), node.right)
    elif isinstance(node, ast.BoolOp):
        yield "and/or", ast.BoolOp(ast.Or() if isinstance(node.op, ast.And) else ast.And(), node.values)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not | ast.USub):
        yield "dropped", node.operand
    elif isinstance(node, ast.Constant) and isinstance(node.value, bool):
        yield "constant", ast.Constant(not node.value)
    elif isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        yield "constant", ast.Constant(_other(node.value))
    elif isinstance(node, ast.Return) and node.value is not None and ast.unparse(node.value) != "None":
        yield "return None", ast.Return(ast.Constant(None))


def _other(number: float) -> float:
    """The next one to a small whole number, twice any other."""
    return number + 1 if isinstance(number, int) and number < _SMALL else 2 * number or 1.0


def _children(node: ast.AST) -> Iterator[ast.AST]:
    """What may hold a mistake."""
    if isinstance(node, ast.JoinedStr | ast.Raise | ast.Import | ast.ImportFrom | ast.arg):
        return
    if isinstance(node, ast.AnnAssign):
        yield from [node.value] if node.value is not None else []
    elif isinstance(node, ast.FunctionDef | ast.ClassDef):
        if isinstance(node, ast.FunctionDef):
            yield from [*node.args.defaults, *(default for default in node.args.kw_defaults if default is not None)]
        yield from node.body
    elif isinstance(node, ast.keyword):
        yield from [] if node.arg == "strict" else [node.value]
    else:
        yield from ast.iter_child_nodes(node)


def _sites(node: ast.AST, number: Iterator[int], inside: tuple[ast.AST, ...] = ()) -> Iterator[_Site]:
    for word, changed in _changes(node):
        yield _Site(next(number), node, changed, word, inside)
    for child in _children(node):
        yield from _sites(child, number, (*inside, node))


class _Swap(ast.NodeTransformer):
    def __init__(self, old: ast.AST, new: ast.AST) -> None:
        self.old, self.new = old, new

    def visit(self, node: ast.AST) -> ast.AST:
        return ast.copy_location(self.new, node) if node is self.old else self.generic_visit(node)


def uses(name: str) -> list[tuple[str, int]]:
    """(file, line) of every use of a name or an attribute in the package."""
    found = []
    for path in sorted((ROOT / "wirebayes").rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        if name in text:
            file = str(path.relative_to(ROOT))
            for node in ast.walk(ast.parse(text)):
                if (isinstance(node, ast.Name) and node.id == name) or (
                    isinstance(node, ast.Attribute) and node.attr == name
                ):
                    found.append((file, node.lineno))
    return found


def _span(file: str, first: ast.stmt | ast.expr, last: ast.stmt | ast.expr) -> list[tuple[str, int]]:
    return [(file, line) for line in range(first.lineno, (last.end_lineno or last.lineno) + 1)]


def _reached_by(file: str, site: _Site) -> list[tuple[str, int]]:
    """The lines that run a mistake; what runs on import counts where its name is used."""
    functions = [node for node in site.inside if isinstance(node, ast.FunctionDef)]
    chain = (*site.inside, site.node)
    if functions and any(node in chain for node in functions[-1].body):
        statement = [node for node in chain if isinstance(node, ast.stmt)][-1]
        node = site.node
        return [(file, statement.lineno), *(_span(file, node, node) if isinstance(node, ast.expr | ast.stmt) else [])]
    if functions:
        return _span(file, functions[-1].body[0], functions[-1].body[-1])
    targets = [
        target
        for node in chain
        if isinstance(node, ast.AnnAssign | ast.Assign)
        for target in ([node.target] if isinstance(node, ast.AnnAssign) else node.targets)
    ]
    names = [node.id for target in targets for node in ast.walk(target) if isinstance(node, ast.Name)]
    return [line for name in names for line in uses(name)]


def mutants(file: str, number: int, seed: int) -> list[Mutant]:
    """So many mutants of a module, drawn at random; a change elsewhere in the module draws the same ones again."""
    source = (ROOT / file).read_text(encoding="utf-8")
    drawn = []
    for site in _sites(ast.parse(source), iter(range(10**6))):
        named = [node.name for node in site.inside if isinstance(node, ast.FunctionDef | ast.ClassDef)]
        before, after = (" ".join(ast.unparse(node).split()) for node in (site.node, site.changed))
        holder = [node for node in (*site.inside, site.node) if isinstance(node, ast.stmt)][-1]
        words = [str(seed), file, ".".join(named), before, after, ast.unparse(holder)]
        rank = hashlib.sha256("\x1f".join(words).encode()).hexdigest()
        statement = " ".join(ast.unparse(holder).split())
        drawn.append((rank, site.at, ".".join(named), statement, f"{site.word}: {before} -> {after}"))
    out = []
    for _, at, function, statement, what in sorted(drawn)[:number]:
        tree = ast.parse(source)
        site = next(site for site in _sites(tree, iter(range(10**6))) if site.at == at)
        line = getattr(site.node, "lineno", 0)
        reached = tuple(_reached_by(file, site))
        text = ast.unparse(ast.fix_missing_locations(_Swap(site.node, site.changed).visit(tree)))
        out.append(Mutant(file, function, line, statement, what, text, reached))
    return sorted(out, key=lambda mutant: mutant.line)


DISCOVERY, MODEL, SAMPLER = "wirebayes/discovery/", "wirebayes/model/", "wirebayes/inference/sampler/"
# The twelve mistakes that the fast tests once did not notice.
NAMED = [
    (DISCOVERY + "settings.py", "ALPHA = 0.04 ", "ALPHA = 0.10 "),
    (DISCOVERY + "refit.py", "LARGEST if one_sided else 2.0 * LARGEST", "2.0 * LARGEST if one_sided else LARGEST"),
    (DISCOVERY + "settings.py", "UNKNOWN_WEIGHT = 1.0 ", "UNKNOWN_WEIGHT = 0.1 "),
    (SAMPLER + "stop_rule.py", " and (found.r_hat <= policy.r_hat).all()", ""),
    (SAMPLER + "stop_rule.py", "if long_enough and ", "if "),
    ("wirebayes/prediction/table.py", "[0.05, 0.5, 0.95]", "[0.10, 0.5, 0.95]"),
    (DISCOVERY + "held_out.py", "[0.05, 0.95]", "[0.1, 0.9]"),
    (DISCOVERY + "power.py", "> threshold) >= 0.8)", "> threshold) >= 0.5)"),
    (DISCOVERY + "held_out.py", "    log_weight = np.minimum(log_weight, ceiling)\n", ""),
    (MODEL + "likelihoods.py", " + resolution * resolution / 12.0", ""),
    (MODEL + "problem.py", "if ratio == 1.0:", "if True:"),
    (SAMPLER + "moves.py", "usual = 2.38 /", "usual = 0.238 /"),
]


def named() -> list[Mutant]:
    """The twelve."""
    out = []
    for file, old, new in NAMED:
        source = (ROOT / file).read_text(encoding="utf-8")
        if source.count(old) != 1:
            raise SystemExit(f"{file}: found {old!r} {source.count(old)} times, expected it once")
        line = source[: source.index(old)].count("\n") + 1
        on_import = uses(old.split(" ")[0]) if old[0].isupper() and " = " in old else []
        what = f"named: {old.strip()} -> {new.strip() or 'nothing'}"
        out.append(Mutant(file, "", line, "", what, source.replace(old, new), ((file, line), *on_import)))
    return out
