"""XML of other programs, read strictly: every element knows its line, every complaint is one line."""

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.parsers import expat

import numpy as np

from wirebayes.errors import InputError
from wirebayes.numeric.typing import Floats
from wirebayes.strict.files import read_bytes


@dataclass
class Element:
    """An element of an XML file.

    Attributes
    ----------
    file, tag, line : str, str, int
        Where it stands.
    attributes : dict of str to str
    children : list of Element
    text : str
    """

    file: str
    tag: str
    line: int
    attributes: dict[str, str]
    children: list["Element"] = field(default_factory=list)
    text: str = ""

    def fail(self, found: str, expected: str) -> InputError:
        """An error about this element."""
        return InputError(f"{self.file}, line {self.line}: <{self.tag}>: found {found}, expected {expected}")

    def all(self, tag: str) -> list["Element"]:
        """Children of a tag."""
        return [child for child in self.children if child.tag == tag]

    def one(self, tag: str) -> "Element":
        """The only child of a tag."""
        found = self.all(tag)
        if len(found) != 1:
            raise self.fail(f"{len(found)} elements <{tag}>", "one")
        return found[0]

    def attribute(self, name: str) -> str:
        """An attribute that must be there."""
        if name not in self.attributes:
            raise self.fail(f"no attribute {name}", "one")
        return self.attributes[name]

    def number(self, name: str | None = None, default: float | None = None) -> float:
        """A finite number in an attribute, or in the text where none is named."""
        if name is not None and name not in self.attributes and default is not None:
            return default
        word = self.text if name is None else self.attribute(name)
        return _number(self, word, f"attribute {name}" if name else "text")

    def vector(self, count: int = 3) -> Floats:
        """Finite numbers in the text, with spaces between them."""
        words = self.text.split()
        if len(words) != count:
            raise self.fail(f"{self.text.strip()[:60]!r}", f"{count} numbers with spaces between them")
        return np.array([_number(self, word, "text") for word in words])

    def point(self) -> Floats:
        """Finite numbers in the attributes x, y and z."""
        return np.array([self.number(name) for name in "xyz"])


def _number(element: Element, word: str, where: str) -> float:
    try:
        value = float(word)
    except ValueError:
        value = math.nan
    if not abs(value) < 1e12:
        raise element.fail(f"{word.strip()[:60]!r} in its {where}", "a finite number")
    return value


def read_xml(path: Path) -> Element:
    """The root element of a file.

    Raises
    ------
    InputError
        The file cannot be read, is not well-formed XML, or defines entities.
    """
    raw, name = read_bytes(path), str(path)
    parser = expat.ParserCreate()
    root: list[Element] = []
    inside: list[Element] = []

    def start(tag: str, attributes: dict[str, str]) -> None:
        element = Element(name, tag, parser.CurrentLineNumber, attributes)
        (inside[-1].children if inside else root).append(element)
        if len(inside) > _DEEPEST:
            raise element.fail("elements nested too deeply", f"at most {_DEEPEST} levels")
        inside.append(element)

    def end(tag: str) -> None:
        inside.pop()

    def text(data: str) -> None:
        if inside:
            inside[-1].text += data

    def entity(*declared: Any) -> None:  # a few of them can unfold to any size
        raise InputError(f"{name}, line {parser.CurrentLineNumber}: found an entity, expected XML without entities")

    parser.StartElementHandler, parser.EndElementHandler, parser.CharacterDataHandler = start, end, text
    parser.EntityDeclHandler = entity
    try:
        parser.Parse(raw, True)
    except expat.ExpatError as error:
        message = expat.errors.messages[error.code]
        raise InputError(f"{name}, line {error.lineno}: found no well-formed XML ({message}), expected XML") from None
    except (ValueError, LookupError) as error:  # an encoding that is not known
        raise InputError(f"{name}: found no readable XML ({error}), expected XML") from None
    return root[0]


_DEEPEST = 100  # no robot's file is nested so deeply, and Python's stack is not exhausted
