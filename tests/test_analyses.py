"""The index of the analyses: every study is in it with its question, and is cited by a page or run by a test."""

import ast
import re
import tomllib
from importlib import import_module
from pathlib import Path

import pytest

from analyses.speed.seconds_of_a_fit import PHASES

ROOT = Path(__file__).parents[1]
ANALYSES = ROOT / "analyses"
INDEX = (ANALYSES / "README.md").read_text(encoding="utf-8")
ROW = re.compile(r"^\| `(?P<name>[a-z_./]+)` \| (?P<question>.+?) \| (?P<pages>.*?) \|$", re.MULTILINE)
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").glob("*.rst"), *(ROOT / "docs").glob("*.inc")]
TEXTS = {path.name: path.read_text(encoding="utf-8") for path in PAGES}


def question(path: Path) -> str:
    """The first paragraph of its docstring, where a folder is a study that of its package."""
    source = path / "__init__.py" if path.is_dir() else path
    text = ast.get_docstring(ast.parse(source.read_text(encoding="utf-8"))) or ""
    return " ".join(text.split("\n\n")[0].split())


def studies() -> dict[str, Path]:
    """Every script by its name in the index; a folder that is a package is one study."""
    packages = {path.parent for path in ANALYSES.glob("*/__init__.py")}
    scripts = [path for path in ANALYSES.rglob("*.py") if path.parent not in packages]
    return {str(path.relative_to(ANALYSES)): path for path in sorted([*scripts, *packages])}


def cited(name: str) -> set[str]:
    """Pages that name a study by its path or as a module."""
    bare = name.removesuffix(".py")
    spoken = re.compile(rf"\banalyses[/.]{bare.replace('/', '[/.]')}\b")
    return {page for page, text in TEXTS.items() if spoken.search(text)}


def used(name: str) -> bool:
    """Whether a test, the Makefile or another study needs it."""
    bare = name.removesuffix(".py").replace("/", ".")
    folder, _, last = bare.rpartition(".")
    imported = re.compile(rf"\banalyses\.{bare}\b|from analyses{'.' if folder else ''}{folder} import .*\b{last}\b")
    files = [ROOT / "Makefile", *(ROOT / "tests").rglob("*.py"), *ANALYSES.rglob("*.py")]
    others = [path for path in files if path not in (ANALYSES / name, *(ANALYSES / name).glob("*"))]
    return any(imported.search(path.read_text(encoding="utf-8")) for path in others)


def test_the_index_has_every_study_once():
    listed = [row["name"] for row in ROW.finditer(INDEX)]
    assert sorted(listed) == sorted(studies())


@pytest.mark.parametrize("row", list(ROW.finditer(INDEX)), ids=lambda row: row["name"])
def test_a_study_has_its_question_and_its_pages(row: re.Match[str]):
    assert row["question"] == question(studies()[row["name"]])
    assert set(row["pages"].replace(",", " ").split()) == cited(row["name"])


@pytest.mark.parametrize("name", list(studies()))
def test_what_no_page_cites_and_nothing_runs_goes(name: str):
    assert cited(name) or used(name)


def test_the_phases_of_a_fit_are_functions_that_it_calls():
    missing = [place for *place, _ in PHASES if not callable(getattr(import_module(place[0]), place[1], None))]
    assert missing == []


def test_the_questions_of_a_newcomer_have_answers():
    asked = tomllib.loads((ANALYSES / "project" / "questions.toml").read_text(encoding="utf-8"))["question"]
    named = [name for entry in asked for name in [entry["file"], *entry.get("also", ())]]
    assert len(asked) == 10
    assert [name for name in named if not (ROOT / name).is_file()] == []
