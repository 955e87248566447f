"""Columns that are not read: they are named. What a specimen is called."""

import re
from collections.abc import Sequence

from wirebayes.io.bench.columns import Column
from wirebayes.io.bench.header import is_copy
from wirebayes.io.bench.table import RawTable
from wirebayes.io.bench.words import plain_letters
from wirebayes.sentences import listed

# What a specimen is called, in the languages of the columns, without accents.
_SPECIMEN = (
    "specimen", "sample", "probe", "prufling", "muster", "eprouvette", "echantillon", "probeta", "muestra", "provino",
    "campione", "amostra", "provete", "proefstuk", "monster", "wire", "draht", "draad", "filo", "hilo",
    "prov", "vzorek", "minta", "numune", "δοκιμιο", "δειγμα",
    "試料", "試験片", "试样",
)  # fmt: skip
_TITLE = re.compile(
    r"(?P<word>[^\W\d_]+)\s*(?:no\.?|nr\.?|n°|#|id|name)?\s*(?:[:=]\s*(?P<name>\S.{0,40})|(?P<number>[\w.-]{1,20}))",
    re.I,
)
_PREFIX = 5  # letters of a word that may begin another one, as in Probennummer or SampleID


def unread(table: RawTable, columns: Sequence[Column]) -> list[str]:
    """Name the columns that are not read, in a sentence; none where everything is read.

    Parameters
    ----------
    table : RawTable
    columns : sequence of Column
        Those that are read.
    """
    read = {column.index for column in columns}
    left = [i for i, name in enumerate(table.header) if name and i not in read and any(table.column(i))]
    names = [repr(table.header[i]) + _same_as(table, i, columns) for i in left]
    return [f"not read: {listed(names)}"] if left else []


def _same_as(table: RawTable, index: int, columns: Sequence[Column]) -> str:
    """Which of the columns that are read a column repeats."""
    copied = next((c for c in columns if is_copy(table, index, c.index)), None)
    return f" (the same numbers as {copied.header!r})" if copied else ""


def speaks_of_specimens(text: str) -> bool:
    """Whether a text holds a word for a specimen."""
    words = re.findall(r"[^\W\d_]+", plain_letters(text))
    return any(w == known or (len(known) >= _PREFIX and w.startswith(known)) for w in words for known in _SPECIMEN)


def names_a_specimen(line: str) -> str:
    """The name or number of a specimen in a line that holds nothing else: ``Specimen no. 3``; empty in others."""
    found = _TITLE.fullmatch(line)
    if found is None or plain_letters(found["word"]) not in _SPECIMEN:
        return ""
    return found["number"] or found["name"]
