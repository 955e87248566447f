"""Every public name has an example, all examples run as shown, and all names stand in the reference."""

import doctest
import inspect
import re
import shutil
from pathlib import Path

import pytest

import wirebayes as wb
from wirebayes.cli import COMMANDS

DOCS = Path(__file__).parents[1] / "docs"
PAPER = DOCS.parent / "data" / "paper"
PUBLIC = [name for name in wb.__all__ if not name.startswith("_")]
FUNCTIONS = [name for name in PUBLIC if inspect.isfunction(getattr(wb, name))]
FLAGS = doctest.NORMALIZE_WHITESPACE


@pytest.fixture(scope="module")
def shared(tmp_path_factory):
    """A folder with the paper's files, and what the page "From Python" leaves there: names that later examples use."""
    folder = tmp_path_factory.mktemp("doctests")
    for file in [*PAPER.iterdir(), *(DOCS / "example").glob("*session.csv"), *(DOCS / "example").glob("desk_*.xml")]:
        shutil.copy(file, folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        page = doctest.DocTestParser().get_doctest(
            (DOCS / "python.rst").read_text(encoding="utf-8"), {}, "python.rst", str(DOCS / "python.rst"), 0
        )
        failed = ran(page)
        yield folder, page.globs, failed


def ran(examples: doctest.DocTest) -> list[str]:
    """What went otherwise than shown."""
    output: list[str] = []
    doctest.DocTestRunner(optionflags=FLAGS).run(examples, out=output.append, clear_globs=False)
    return output


def test_the_page_from_python_runs_as_shown(shared):
    assert not shared[2], "".join(shared[2])


CALLED_OTHERWISE = {
    "import": "import_bench",
    "init": "new_experiment",
    "simulate": "simulate_tests",
    "effects": "list_effects",
    "report": "write_report",
    "import-robot": "import_robot",
    "reproduce": "reproduce_paper",
}
MINUTES = {"reproduce"}  # shown on the page, too long to run
NOT_CALLED = {"app"}  # a page in a browser, which calls the others
MOST_LINES = 10


@pytest.mark.parametrize("command", [name for name in COMMANDS if name not in NOT_CALLED])
def test_the_page_does_what_a_command_does_in_ten_lines(command: str) -> None:
    function = f"wb.{CALLED_OTHERWISE.get(command, command)}("
    page = (DOCS / "python.rst").read_text(encoding="utf-8")
    examples = [e.source for e in doctest.DocTestParser().get_examples(page)]
    calls = [source for source in examples if function in source]
    assert function in page and (calls or command in MINUTES)
    assert all(len(source.splitlines()) <= MOST_LINES for source in calls)


@pytest.mark.parametrize("name", PUBLIC)
def test_the_examples_of_a_docstring_run_as_shown(name, shared):
    names = dict(shared[1]) | {"wb": wb}
    value = getattr(wb, name)
    (examples,) = doctest.DocTestFinder(recurse=False, exclude_empty=False).find(value, name, globs=names)
    assert examples.examples
    output = ran(examples)
    assert not output, "".join(output)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_public_function_is_documented_whole(name):
    text = inspect.getdoc(getattr(wb, name))
    parameters = inspect.signature(getattr(wb, name)).parameters
    for section in [*(["Parameters"] if parameters else []), "Returns", "Raises", "Examples"]:
        assert f"\n{section}\n{'-' * len(section)}\n" in text, f"{name} has no section {section}"
    listed = text.split("Parameters\n")[1].split("\nReturns\n")[0] if parameters else ""
    for parameter in parameters:
        assert re.search(rf"^(\w+, )*{parameter}\b", listed, re.MULTILINE), f"{name} does not explain {parameter}"


@pytest.mark.parametrize("name", PUBLIC)
def test_a_public_name_has_its_page_in_the_reference(name):
    reference = (DOCS / "reference.rst").read_text(encoding="utf-8")
    there = re.search(rf"^   wirebayes\.{name}$", reference, re.MULTILINE)
    assert there, f"{name} needs a line in docs/reference.rst"


def test_an_example_that_is_wrong_is_found():
    wrong = doctest.DocTestParser().get_doctest(">>> 1 + 1\n3\n", {}, "wrong", None, 0)
    assert ran(wrong)


def test_findings_and_their_posteriors_are_saved_and_loaded_again(shared, tmp_path):
    findings = shared[1]["findings"]
    again = wb.load(findings.save(tmp_path / "all"))
    assert again.report == findings.report
    assert (tmp_path / "all" / "discovery.json").read_bytes() == (findings.folder / "discovery.json").read_bytes()
    one = findings.final["wire"]
    alone = wb.load(one.save(tmp_path / "one"))
    assert sorted(path.name for path in (tmp_path / "one").iterdir()) == ["posterior.nc", "summary.json"]
    assert alone.summary() == one.summary() == again.final["wire"].summary()
    with pytest.raises(wb.InputError, match="expected a new or empty folder"):
        findings.plain["wire"].save(tmp_path)
    protocol = {"hold": [7], "displacement_mm": [7], "time_s": [0]}
    assert wb.predict(findings, protocol).equals(wb.predict(findings.folder, protocol))
    assert wb.predict(findings, protocol, model="plain").equals(wb.predict(findings.plain["wire"], protocol))


@pytest.mark.parametrize(
    "name", ["posterior", "findings", "many", "planned", "comparison", "stiffening", "held", "lengths", "exported"]
)
def test_a_result_shows_itself_in_a_line_and_in_a_table(name, shared):
    value = shared[1][name]
    assert repr(value).startswith(f"{type(value).__name__}(")
    assert len(repr(value)) < 120
    shown = value._repr_html_()
    assert "<table>" in shown
    assert shown.count("<tr>") >= 2
    assert isinstance(value.summary(), dict)
