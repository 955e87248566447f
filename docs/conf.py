"""Sphinx: prose by hand, reference from docstrings, the table of mistakes by running the reader."""

import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from malformed import CASES, message, write

from wirebayes import __version__
from wirebayes.effects import CATALOGUE

project = "wirebayes"
author = "The wirebayes developers"
copyright = "2026, the wirebayes developers"
version = release = __version__
extensions = ["sphinx.ext.autodoc", "sphinx.ext.napoleon", "mathml"]
exclude_patterns = ["_build", "generated"]
highlight_language = "text"  # what stands in a plain block is a command or a file
html_math_renderer = "mathml"
html_theme = "alabaster"
html_static_path = ["_static"]  # the theme looks there for custom.css
html_theme_options = {
    "description": "A Bayesian toolkit for wires that creep",
    "page_width": "1080px",
    "show_powered_by": False,
}
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


def setup(app: object) -> None:
    """Called by Sphinx."""
    app.connect("builder-inited", _table_of_mistakes)  # type: ignore[attr-defined]
    app.connect("builder-inited", _table_of_effects)  # type: ignore[attr-defined]
