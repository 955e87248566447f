"""Sphinx: prose by hand, reference from docstrings, the table of mistakes by running the reader."""

import inspect
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from contextlib import redirect_stdout
from io import StringIO

from malformed import CASES, message, write

import wirebayes
from wirebayes import __version__
from wirebayes.cli import COMMANDS, main
from wirebayes.effects import CATALOGUE

project = "wirebayes"
author = "The wirebayes developers"
copyright = "2026, the wirebayes developers"
version = release = __version__
extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "fold",
    "mathml",
]
exclude_patterns = ["_build", "generated"]
templates_path = ["_templates"]
highlight_language = "text"  # what stands in a plain block is a command or a file
html_math_renderer = "mathml"
html_theme = "furo"
html_title = "wirebayes"
html_static_path = ["_static"]
html_css_files = ["custom.css"]
copybutton_prompt_text = ">>> |\\$ "
copybutton_prompt_is_regexp = True
# classes that have a page of their own as public names are not repeated on the pages of their modules
_CLASSES = [name for name in wirebayes.__all__ if inspect.isclass(getattr(wirebayes, name))]
autosummary_context = {"public_classes": ", ".join(_CLASSES)}
suppress_warnings = ["ref.python"]  # an attribute's name that two classes have leads to the first
autodoc_member_order = "bysource"
autodoc_typehints = "none"
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True


def _table_of_mistakes(_app: object) -> None:
    lines = [".. list-table::", "   :header-rows: 1", "   :widths: 30 70", "", "   * - mistake", "     - what is said"]
    for case in CASES:
        with tempfile.TemporaryDirectory() as folder:
            lines += [f"   * - {case.mistake}", f"     - ``{message(write(case, Path(folder)))}``"]
    target = Path(__file__).parent / "generated" / "malformed.rst"
    target.parent.mkdir(exist_ok=True)
    target.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _table_of_effects(_app: object) -> None:
    lines = [".. list-table::", "   :header-rows: 1", "   :widths: 22 12 16 50", ""]
    lines += ["   * - name", "     - belongs to", "     - amplitude", "     - what it says"]
    for name, kind in CATALOGUE.items():
        amplitude = kind.amplitudes[0]
        lines += [f"   * - ``{name}``", f"     - {kind.scope}"]
        lines += [f"     - ``{amplitude.name}`` ({amplitude.unit})", f"     - {kind.sentence}"]
    target = Path(__file__).parent / "generated" / "effects.rst"
    target.parent.mkdir(exist_ok=True)
    target.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _pages_of_commands(_app: object) -> None:
    """A page for every command, with its help as a terminal of 80 columns shows it."""
    folder = Path(__file__).parent / "commands"
    folder.mkdir(exist_ok=True)
    for name, command in COMMANDS.items():
        with redirect_stdout(StringIO()) as said:
            main([name, "--help"])
        shown = "\n".join(f"   {line}".rstrip() for line in said.getvalue().splitlines())
        page = (
            f"{name}\n{'=' * len(name)}\n\n{command.summary}\n\n.. code-block:: text\n   :class: columns\n\n{shown}\n"
        )
        (folder / f"{name}.rst").write_text(page, encoding="utf-8")


def _table_of_commands(_app: object) -> None:
    """What each command does, in the order in which ``wirebayes --help`` lists them."""
    lines = [".. list-table::", "   :widths: 18 82", ""]
    for name, command in COMMANDS.items():
        lines += [f"   * - :doc:`{name} <commands/{name}>`", f"     - {command.summary}"]
    target = Path(__file__).parent / "generated" / "commands.rst"
    target.parent.mkdir(exist_ok=True)
    target.write_text("\n".join(lines) + "\n", encoding="utf-8")


def setup(app: object) -> None:
    """Called by Sphinx."""
    app.connect("builder-inited", _table_of_mistakes)  # type: ignore[attr-defined]
    app.connect("builder-inited", _table_of_effects)  # type: ignore[attr-defined]
    app.connect("builder-inited", _table_of_commands)  # type: ignore[attr-defined]
    app.connect("builder-inited", _pages_of_commands, priority=100)  # type: ignore[attr-defined]
