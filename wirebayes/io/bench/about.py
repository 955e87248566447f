"""What a user says of a sample, and the name that its experiment gets."""

from collections.abc import Sequence
from dataclasses import dataclass
from os.path import commonprefix
from pathlib import Path


@dataclass(frozen=True)
class About:
    """What a user says of the sample.

    Attributes
    ----------
    name : str
    material : str or None
        The name of each specimen when left out.
    length_mm : float
    area_mm2 : float or None
        Of its cross-section, where it is known: turns stresses into tensions.
    name_is_stated : bool
        Whether the name is the user's, and not the file's.
    """

    name: str
    material: str | None
    length_mm: float
    area_mm2: float | None = None
    name_is_stated: bool = False


def default_name(path: Path) -> str:
    """The name of an experiment from the name of its file: what a folder may be called."""
    return name_from(path.stem) or "experiment"


def name_from(text: str) -> str:
    """The letters, digits, points and dashes of a text, with dashes for what is between them; perhaps none."""
    return "".join(c if c.isascii() and (c.isalnum() or c in "._-") else "-" for c in text).strip("-.")


def common_name(paths: Sequence[Path]) -> str:
    """The name of a test whose holds stand in several files: what their names begin with, or the first of them."""
    stems = [path.stem for path in paths]
    return name_from(commonprefix(stems).rstrip("0123456789")) or default_name(paths[0])
