"""Mutation testing of what decides: small mistakes put into a module, each of which its fast tests must notice.

``python -m analyses.mutants --output out/mutants`` samples mutants of each module of `MODULES` at random and tries the
twelve mistakes of `NAMED`. It writes a line of JSON for each into ``mutants.jsonl``, goes on from there when it is run
again, and ends with the share killed and the survivors. A mutant runs in a copy of the tree, in a process of its own
that is forked from one which has loaded the libraries, so a mutant costs its tests and no more.
"""

import argparse
import ast
import hashlib
import json
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from importlib import import_module
from pathlib import Path

ROOT = Path(__file__).parents[1]
PATIENCE_S = 240  # beyond it a mutant counts as killed: its tests take a tenth
FAST = "not slow and not browser"
SAMPLER = ["tests/inference/sampler/test_stop_rule.py", "tests/inference/sampler/test_moves.py"]
PROPOSAL = "tests/inference/sampler/test_proposal.py"
THRESHOLDS = "tests/discovery/test_thresholds.py"
SPACE = ["tests/discovery/test_model_space.py", "tests/discovery/test_verdict.py", THRESHOLDS]
MODULES = {
    "wirebayes/model/likelihoods.py": ["tests/model"],
    "wirebayes/inference/convergence.py": SAMPLER,
    "wirebayes/inference/sampler/kept.py": SAMPLER,
    "wirebayes/inference/sampler/moves.py": ["tests/inference/sampler/test_moves.py", PROPOSAL],
    "wirebayes/comparison/compare.py": ["tests/comparison"],
    "wirebayes/discovery/verdict.py": SPACE,
    "wirebayes/discovery/model_space.py": SPACE,
    "wirebayes/discovery/global_test.py": [THRESHOLDS, "tests/discovery/test_model_check.py"],
    "wirebayes/prediction/held_out.py": ["tests/prediction/test_held_out.py"],
    "wirebayes/robot/pose/answer.py": ["tests/robot/test_answer.py"],
    "wirebayes/robot/pose/controllers.py": ["tests/robot/test_answer.py"],
}


@dataclass(frozen=True)
class Mutant:
    """One mistake: where, what it reads, and the whole text of the module with it."""

    file: str
    line: int
    what: str
    text: str
    tests: tuple[str, ...]

    @property
    def key(self) -> str:
        return hashlib.sha256("\x1f".join([self.file, self.text, *self.tests]).encode()).hexdigest()[:16]


COMPARED: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.GtE, ast.LtE: ast.Gt, ast.Gt: ast.LtE, ast.GtE: ast.Lt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In,
}  # fmt: skip
COMPUTED: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult,
}  # fmt: skip


def _changes(node: ast.AST) -> Iterator[tuple[str, ast.AST]]:
    """Every mistake that can be made at a node, with a word for it."""
    if isinstance(node, ast.Compare):
        for i, operator in enumerate(node.ops):
            other = COMPARED[type(operator)]()
            yield "comparison", ast.Compare(node.left, [*node.ops[:i], other, *node.ops[i + 1 :]], node.comparators)
    elif isinstance(node, ast.BinOp) and type(node.op) in COMPUTED:
        yield "operator", ast.BinOp(node.left, COMPUTED[type(node.op)](), node.right)
    elif isinstance(node, ast.BoolOp):
        yield "and/or", ast.BoolOp(ast.Or() if isinstance(node.op, ast.And) else ast.And(), node.values)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not | ast.USub):
        yield "not or sign dropped", node.operand
    elif isinstance(node, ast.Constant) and isinstance(node.value, bool):
        yield "constant", ast.Constant(not node.value)
    elif isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        yield "constant", ast.Constant(node.value + 1 if isinstance(node.value, int) else node.value * 2 or 1.0)
    elif isinstance(node, ast.Return) and node.value is not None:
        yield "return None", ast.Return(ast.Constant(None))


class _At(ast.NodeTransformer):
    """Replaces the node with a number; text, types and docstrings are passed by."""

    def __init__(self, wanted: int = -1) -> None:
        self.wanted, self.sites, self.count = wanted, list[tuple[int, str, str]](), 0

    def visit(self, node: ast.AST) -> ast.AST:
        if isinstance(node, ast.JoinedStr | ast.Raise | ast.Import | ast.ImportFrom):
            return node
        if isinstance(node, ast.arg):
            return node
        if isinstance(node, ast.AnnAssign):
            if node.value is not None:
                node.value = self.visit(node.value)  # type: ignore[assignment]
            return node
        if isinstance(node, ast.FunctionDef):
            node.body = [self.visit(each) for each in node.body]  # type: ignore[misc]
            return node
        for word, changed in _changes(node):
            if self.count == self.wanted:
                self.count += 1
                return ast.copy_location(changed, node)
            self.sites.append((getattr(node, "lineno", 0), word, ast.unparse(node)))
            self.count += 1
        return self.generic_visit(node)


def mutants(file: str, tests: list[str], number: int, seed: int) -> list[Mutant]:
    """So many mutants of a module, drawn at random."""
    source = (ROOT / file).read_text(encoding="utf-8")
    every = _At()
    every.visit(ast.parse(source))
    chosen = random.Random(f"{seed} {file}").sample(range(every.count), min(number, every.count))
    out = []
    for at in sorted(chosen):
        tree = _At(at).visit(ast.parse(source))
        line, word, before = every.sites[at]
        text = ast.unparse(ast.fix_missing_locations(tree))
        out.append(Mutant(file, line, f"{word}: {' '.join(before.split())[:90]}", text, tuple(tests)))
    return out


DISCOVERY, MODEL, PROBLEM = "wirebayes/discovery/", "wirebayes/model/", ["tests/model/test_problem.py"]
# The twelve mistakes that the fast tests once did not notice.
NAMED = [
    (DISCOVERY + "settings.py", "ALPHA = 0.04 ", "ALPHA = 0.10 ", [THRESHOLDS]),
    (DISCOVERY + "refit.py", "LARGEST if one_sided else 2.0 * LARGEST", "2.0 * LARGEST if one_sided else LARGEST",
     [THRESHOLDS]),
    (DISCOVERY + "settings.py", "UNKNOWN_WEIGHT = 1.0 ", "UNKNOWN_WEIGHT = 0.1 ",
     ["tests/discovery/test_model_space.py"]),
    ("wirebayes/inference/sampler/kept.py", " and (found.r_hat <= policy.r_hat).all()", "", SAMPLER),
    ("wirebayes/inference/sampler/kept.py", "if long_enough and ", "if ", SAMPLER),
    ("wirebayes/prediction/table.py", "[0.05, 0.5, 0.95]", "[0.10, 0.5, 0.95]", ["tests/prediction/test_table.py"]),
    (DISCOVERY + "held_out.py", "[0.05, 0.95]", "[0.1, 0.9]", [THRESHOLDS]),
    (DISCOVERY + "power.py", "> threshold) >= 0.8)", "> threshold) >= 0.5)", [THRESHOLDS]),
    (DISCOVERY + "held_out.py", "    log_weight = np.minimum(log_weight, ceiling)\n", "",
     [THRESHOLDS]),
    (MODEL + "likelihoods.py", " + resolution_N * resolution_N / 12.0", "", PROBLEM),
    (MODEL + "problem.py", "return out if ratio == 1.0 else", "return out if True else", PROBLEM),
    ("wirebayes/inference/sampler/moves.py", "scale = 2.38 /", "scale = 0.238 /", SAMPLER),
]  # fmt: skip


def named() -> list[Mutant]:
    """The twelve."""
    out = []
    for file, old, new, tests in NAMED:
        source = (ROOT / file).read_text(encoding="utf-8")
        if source.count(old) != 1:
            raise SystemExit(f"{file}: found {old!r} {source.count(old)} times, expected it once")
        line = source[: source.index(old)].count("\n") + 1
        out.append(
            Mutant(
                file,
                line,
                f"named: {old.strip()} -> {new.strip() or 'nothing'}",
                source.replace(old, new),
                tuple(tests),
            )
        )
    return out


def preload() -> None:
    """What every test imports and no mutant changes."""
    for name in ("arviz_base", "arviz_stats", "emcee", "matplotlib.figure", "pytest", "scipy.optimize",
                 "scipy.stats", "typer", "xarray"):  # fmt: skip
        import_module(name)


def tried(mutant: Mutant | None, tree: Path, tests: tuple[str, ...]) -> tuple[str, float]:
    """Run tests on a tree with a mutant, or as it is."""
    original = None
    if mutant is not None:
        original = (tree / mutant.file).read_text(encoding="utf-8")
        (tree / mutant.file).write_text(mutant.text, encoding="utf-8")
    began = time.monotonic()
    try:
        child = os.fork()
        if not child:
            _run(tree, tests)
        while time.monotonic() - began < PATIENCE_S:
            done, status = os.waitpid(child, os.WNOHANG)
            if done:
                code = os.waitstatus_to_exitcode(status)
                return ("survived" if code == 0 else "killed"), time.monotonic() - began
            time.sleep(0.05)
        os.killpg(child, signal.SIGKILL)
        os.waitpid(child, 0)
        return "killed by time", time.monotonic() - began
    finally:
        if mutant is not None and original is not None:
            (tree / mutant.file).write_text(original, encoding="utf-8")


def _run(tree: Path, tests: tuple[str, ...]) -> None:
    """In the child: pytest on the tree, quietly, and out."""
    os.setpgid(0, 0)
    os.chdir(tree)
    sys.path[:] = [str(tree), *(path for path in sys.path if Path(path or ".").resolve() != ROOT)]
    sys.dont_write_bytecode = True
    quiet = os.open(os.devnull, os.O_WRONLY)
    os.dup2(quiet, 1)
    os.dup2(quiet, 2)
    import pytest

    arguments = ["-x", "-q", "-m", FAST, "-p", "no:cacheprovider", "-p", "no:faulthandler", *tests]
    arguments += ["-W", "ignore::pytest.PytestAssertRewriteWarning"]  # of what was loaded before
    os._exit(int(pytest.main(arguments)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=Path("out/mutants"))
    parser.add_argument("--each", type=int, default=15, help="mutants of each module")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default="", help="modules whose name holds this, or 'named'")
    asked = parser.parse_args()
    asked.output.mkdir(parents=True, exist_ok=True)
    record = asked.output / "mutants.jsonl"
    known = {row["key"]: row for row in map(json.loads, record.read_text().splitlines())} if record.exists() else {}
    todo = [] if asked.only and asked.only != "named" else named()
    for file, tests in MODULES.items():
        if asked.only in file:
            todo += mutants(file, tests, asked.each, asked.seed)
    preload()
    with tempfile.TemporaryDirectory(prefix="mutants-") as scratch:
        tree = Path(scratch) / "tree"
        left_out = shutil.ignore_patterns(".git", ".venv*", "out", "build", "__pycache__", "*.egg-info")
        shutil.copytree(ROOT, tree, ignore=left_out, symlinks=True)
        rows, sound = [], set[tuple[str, ...]]()
        for mutant in todo:
            if mutant.key not in known:
                if mutant.tests not in sound:
                    outcome, took = tried(None, tree, mutant.tests)
                    if outcome != "survived":
                        raise SystemExit(f"{', '.join(mutant.tests)} fail without any mutant")
                    print(f"{took:6.1f} s without a mutant: {', '.join(mutant.tests)}", flush=True)
                    sound.add(mutant.tests)
                outcome, took = tried(mutant, tree, mutant.tests)
                row = {"key": mutant.key, "outcome": outcome, "s": round(took, 1)}
                row |= {k: v for k, v in asdict(mutant).items() if k in ("file", "line", "what")}
                with record.open("a") as file:
                    file.write(json.dumps(row) + "\n")
                known[mutant.key] = row
                print(f"{outcome:14s} {took:6.1f} s {mutant.file}:{mutant.line} {mutant.what}", flush=True)
            rows.append(known[mutant.key])
    survivors = [row for row in rows if row["outcome"] == "survived"]
    print(f"{len(rows) - len(survivors)} of {len(rows)} killed; survivors:")
    for row in survivors:
        print(f"  {row['file']}:{row['line']} {row['what']}")


if __name__ == "__main__":
    main()
