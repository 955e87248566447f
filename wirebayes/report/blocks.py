"""What a page is made of: sections of text, tables and pictures, and how a picture travels inside the page."""

import base64
import io
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.figure import Figure

_KINDS = {".svg": "image/svg+xml", ".png": "image/png"}


@dataclass(frozen=True)
class Table:
    """A table; cells are text, numbers are formatted by whoever makes them.

    `words` gives cells a class by their text, so that a verdict can be seen at a glance.
    """

    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    caption: str = ""
    words: dict[str, str] = field(default_factory=dict)
    kind: str = "table"


@dataclass(frozen=True)
class Picture:
    """A picture inside the page."""

    source: str
    alt: str
    caption: str = ""


@dataclass(frozen=True)
class Pictures:
    """Pictures side by side where there is room, more of them where they are `small`."""

    pictures: Sequence[Picture]
    small: bool = False
    kind: str = "pictures"


@dataclass(frozen=True)
class Text:
    """A paragraph; `strong` makes it stand out."""

    text: str
    strong: bool = False
    kind: str = "text"


@dataclass(frozen=True)
class Points:
    """A list of sentences under a heading."""

    heading: str
    points: Sequence[str]


@dataclass(frozen=True)
class Columns:
    """Lists side by side: what a reader should take away within a minute."""

    columns: Sequence[Points]
    kind: str = "columns"


Block = Table | Pictures | Text | Columns


@dataclass(frozen=True)
class Section:
    """A heading and what stands below it; `folded` sections open on a click."""

    title: str
    blocks: Sequence[Block]
    folded: bool = False

    @property
    def anchor(self) -> str:
        """The heading as a link target."""
        return "".join(c if c.isalnum() else "-" for c in self.title.lower()).strip("-")


@dataclass(frozen=True)
class Page:
    """Title, one sentence, sections, and a line on how the page came about."""

    title: str
    lead: str
    sections: Sequence[Section]
    footer: str = ""


def embedded(path: Path) -> str:
    """A picture file as a data address."""
    return f"data:{_KINDS[path.suffix]};base64,{base64.b64encode(path.read_bytes()).decode('ascii')}"


def drawn(figure: Figure) -> str:
    """A figure as a data address."""
    return f"data:image/svg+xml;base64,{base64.b64encode(svg(figure)).decode('ascii')}"


def svg(figure: Figure) -> bytes:
    """A figure as SVG, the same bytes every time."""
    stream = io.BytesIO()
    with matplotlib.rc_context({"svg.hashsalt": "wirebayes", "svg.fonttype": "path"}):
        figure.savefig(stream, format="svg", dpi=160, metadata={"Date": None})
    return stream.getvalue()


def pictures_in(folder: Path) -> list[Picture]:
    """Every picture of a folder, its name as the words for those who cannot see it."""
    files = sorted(path for path in folder.iterdir() if path.suffix in _KINDS)
    return [Picture(embedded(path), words(path.stem), words(path.stem)) for path in files]


def words(name: str) -> str:
    """A file or key name as words."""
    text = name.replace("_", " ").replace("-", " ").strip()
    return text[:1].upper() + text[1:]


def unit_text(unit: str) -> str:
    """A unit as people write it; nothing for a pure number."""
    return "" if unit in ("1", "-") else unit.replace("^-U", "⁻ᵁ").replace("^-N", "⁻ᴺ")


def number(value: Any, digits: int = 3) -> str:
    """A number for people: significant digits, no exponent where none is needed; a dash for nothing."""
    if value is None or value != value:
        return "–"
    if isinstance(value, bool | str):
        return str(value)
    if isinstance(value, int):
        return f"{value:,}".replace(",", "\u202f").replace("-", "−")
    if value == 0:
        return "0"
    size = abs(value)
    if size >= 1e6 or size < 1e-4:
        mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
        return f"{mantissa}·10{''.join(_RAISED[c] for c in str(int(exponent)))}"
    decimals = max(0, digits - 1 - _order(value, digits))
    return f"{value:,.{decimals}f}".replace(",", "\u202f").replace("-", "−")


def _order(value: float, digits: int) -> int:
    """Power of ten of the rounded value."""
    return int(f"{abs(value):.{digits - 1}e}".split("e")[1])


def span(low: Any, high: Any, digits: int = 3) -> str:
    """An interval for people.

    Parameters
    ----------
    low, high : float
    digits : int
        Significant ones.

    Returns
    -------
    str
    """
    return f"{number(low, digits)} … {number(high, digits)}"


_RAISED = dict(zip("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻", strict=True))
