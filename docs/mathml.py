"""Formulas as MathML, which browsers set themselves: the pages need nothing from outside and no TeX."""

import re
from typing import Any

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml

_TAG = re.compile(r"\\tag\{([^}]*)\}")


def inline(self: Any, node: nodes.math) -> None:
    """A formula within a line."""
    self.body.append(str(tex2mathml(node.astext())))
    raise nodes.SkipNode


def block(self: Any, node: nodes.math_block) -> None:
    """A formula of its own, with its number at the right."""
    text = node.astext()
    number = _TAG.search(text)
    formula = tex2mathml(_TAG.sub("", text), as_block=True)
    label = f'<span class="eqno">({number[1]})</span>' if number else ""
    self.body.append(f'<div class="math">{label}{formula}</div>\n')
    raise nodes.SkipNode


def setup(app: Any) -> dict[str, bool]:
    """Called by Sphinx."""
    app.add_html_math_renderer("mathml", (inline, None), (block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
