"""A part of a page that is folded until a reader asks for it: long tables, and what was tried and given up.

.. fold:: Title

   Content.
"""

from html import escape
from typing import Any

from docutils import nodes
from sphinx.util.docutils import SphinxDirective


class Fold(SphinxDirective):
    """Content below a title that opens it; a browser's search opens it, too."""

    has_content = True
    required_arguments = 1
    final_argument_whitespace = True

    def run(self) -> list[nodes.Node]:
        """The content between the two ends of an element that folds."""
        title = escape(self.arguments[0])
        begin = nodes.raw("", f'<details class="fold"><summary>{title}</summary>', format="html")
        end = nodes.raw("", "</details>", format="html")
        return [begin, *self.parse_content_to_nodes(), end]


def setup(app: Any) -> dict[str, bool]:
    """Called by Sphinx."""
    app.add_directive("fold", Fold)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
