"""What a page is made of: sections of text, tables and pictures."""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import quote

from wirebayes.json_files.plain import plain
from wirebayes.json_files.scene import SceneJson
from wirebayes.report.drawn import MEDIA_TYPES, embedded
from wirebayes.result_warnings import Notice, Warned, from_json
from wirebayes.sentences import number as number
from wirebayes.sentences import span as span
from wirebayes.sentences import unit_text as unit_text

Configuration = dict[str, Any]  # of a folder of results: what its command was given
_A_NUMBER = re.compile(r"[−<±]?\s?\d")
_SENTENCE = 36  # characters; no number with its interval is longer
_MOST_LINKS = 40  # of one kind; a list of more is a wall


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

    @property
    def names(self) -> frozenset[int]:
        """Columns of words, none of them a number: they begin at the left as well."""
        columns = set()
        for i, cells in enumerate(zip(*self.rows, strict=True)):
            if i and not any(_A_NUMBER.match(cell) for cell in cells):
                columns.add(i)
        return frozenset(columns)

    @property
    def prose(self) -> frozenset[int]:
        """Columns of sentences rather than numbers: they may break, and begin at the left."""
        columns = set()
        for row in self.rows:
            columns |= {i for i, cell in enumerate(row) if i and len(cell) > _SENTENCE}
        return frozenset(columns)


@dataclass(frozen=True)
class Picture:
    """A picture inside the page; a `wide` one is not shrunk to a phone but scrolls sideways."""

    source: str
    alt: str
    caption: str = ""
    wide: bool = False


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
class Notices:
    """Warnings, one a line, each with its kind."""

    notices: Sequence[Notice]
    kind: str = "notices"


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


@dataclass(frozen=True)
class Definitions:
    """Terms and what they mean, under a heading; formulas in MathML may stand above them."""

    heading: str
    terms: Sequence[tuple[str, str]]
    formulas: Sequence[str] = ()
    kind: str = "definitions"


@dataclass(frozen=True)
class Links:
    """Files beside the page and what each holds."""

    files: Sequence[tuple[str, str]]
    kind: str = "links"


@dataclass(frozen=True)
class View:
    """A robot in 3-D that can be turned; `scene` is what ``view.js`` draws."""

    scene: SceneJson
    alt: str
    caption: str = ""
    kind: str = "view"

    @property
    def data(self) -> str:
        """The scene as JSON that cannot end a script element."""
        return json.dumps(plain(self.scene), ensure_ascii=True, allow_nan=False).replace("<", "\\u003c")


Block = Table | Pictures | Text | Notices | Columns | Definitions | Links | View


def before_the_answer(warned: Warned) -> list[Block]:
    """Warnings that change what the answer is worth.

    Parameters
    ----------
    warned : dict
        A file of results, or a part of it, with its ``warnings``.
    """
    grave = [notice for notice in from_json(warned["warnings"]) if notice.first]
    return [Notices(grave)] if grave else []


def beside_the_answer(warned: Warned) -> list[Block]:
    """The other warnings.

    Parameters
    ----------
    warned : dict
        See `before_the_answer`.
    """
    light = [notice for notice in from_json(warned["warnings"]) if not notice.first]
    return [Notices(light)] if light else []


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

    @property
    def grave(self) -> Notices | None:
        """The warnings that stand before the answer: those that the first section begins with."""
        if not self.sections or not self.sections[0].blocks:
            return None
        first = self.sections[0].blocks[0]
        return first if isinstance(first, Notices) and first.notices[0].first else None


def pictures_in(folder: Path, captions: Mapping[str, str]) -> list[Picture]:
    """The pictures of a folder in the order of their captions, then others by their names.

    Parameters
    ----------
    captions : mapping of file name without ending to caption
    """
    files = {path.stem: path for path in sorted(folder.iterdir()) if path.suffix in MEDIA_TYPES}
    pictures = [captioned(files[name], captions[name]) for name in captions if name in files]
    others = [captioned(file, words(name)) for name, file in files.items() if name not in captions]
    return pictures + others


def captioned(file: Path, caption: str, wide: bool = False) -> Picture:
    """A picture file whose caption says what is to be seen.

    Parameters
    ----------
    wide : bool
        Whether it scrolls sideways on a phone.
    """
    return Picture(embedded(file), caption, caption, wide)


def picture_file(folder: Path, name: str) -> Path | None:
    """The file of a picture, or nothing where there is none."""
    for kind in MEDIA_TYPES:
        path = folder / f"{name}{kind}"
        if path.is_file():
            return path
    return None


def files_beside(folder: Path, contents: Sequence[tuple[str, str]], title: str = "Raw results") -> Section:
    """Links to those files of a folder that are there; a name may be a pattern.

    Parameters
    ----------
    contents : sequence of (name, what it holds)
    title : str
        Of the section.
    """
    found = []
    for name, holds in contents:
        for path in sorted(folder.glob(name))[:_MOST_LINKS]:
            file = path.relative_to(folder).as_posix()
            found.append((quote(file, errors="surrogateescape"), holds))
    return Section(title, [Links(found)])


def seed_of_page(configuration: Configuration) -> str:
    """The line at the foot of a page that says which seed its results had."""
    return f"Seed {configuration.get('seed')}."


# a number and its unit, an interval, a number and its error
_WHOLE = re.compile(r"(?<=\d) (?=[a-zA-Zµ°%]{1,3}\b|%|± )|(?<=±) | (?=… )|(?<=…) ")


def with_fixed_spaces(text: str) -> str:
    """A text whose lines break neither within an interval nor between a number and its unit."""
    return _WHOLE.sub("\u00a0", text)


def as_sentence(text: str) -> str:
    """A text as a sentence: its first letter large, unless a name and a colon begin it, and a full stop at its end."""
    begins_with_name = text.partition(" ")[0].endswith(":")
    first = text[:1] if begins_with_name else text[:1].upper()
    return f"{first}{text[1:].rstrip('.')}."


def words(name: str) -> str:
    """A file or key name as words."""
    text = name.replace("_", " ").replace("-", " ").strip()
    return text[:1].upper() + text[1:]
