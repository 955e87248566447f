"""Bytes of a text file as text: UTF-8, UTF-16 and UTF-32 with and without a mark, else the code page that makes sense.

A header of three short words among numbers is too little for the statistics of letters by which detectors decide, but
it has to hold words that name quantities: the first code page that yields most of them is the file's.
"""

import codecs
from collections.abc import Callable
from pathlib import Path

from wirebayes.errors import InputError
from wirebayes.strict.files import read_bytes

_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
_NUL_SHARE = 0.2  # of the bytes: UTF-16 of digits has a half, text none
# What benches write where it is no Unicode: Western Europe first, then East Asia, Cyrillic, Central Europe,
# Greece, Turkey.
_CODE_PAGES = (
    "cp1252", "latin-1", "gb18030", "cp932", "cp949", "big5", "cp1251", "koi8-r", "cp866", "cp1250", "cp1253", "cp1254",
)  # fmt: skip
UNICODE = ("utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32")  # beyond doubt: not worth a word
# what East Asian keyboards write, one for one: digits, letters, brackets and signs in full width
_FULL_WIDTH = {code: code - 0xFEE0 for code in range(0xFF01, 0xFF5F)}
_LINES = 200  # that may hold a preamble and the header


def read_raw(path: Path) -> bytes:
    """The bytes of a file.

    Raises
    ------
    InputError
        It is absent, empty or cannot be read.
    """
    raw = read_bytes(path)
    if not raw.strip():
        raise InputError(f"{path}, line 1: found an empty file, expected a header and readings")
    return raw


def decode(path: Path, raw: bytes, known_words: Callable[[str], int]) -> tuple[str, str]:
    """The text of a file whatever its encoding, and the name of its encoding.

    Parameters
    ----------
    path : Path
        Named in messages.
    known_words : function of a text that returns a number
        How many different words of it name a quantity.

    Raises
    ------
    InputError
        It is no text.
    """
    marked = next((name for mark, name in _MARKS if raw.startswith(mark)), None)
    encoding = marked or _unmarked(raw) or _code_page(raw, known_words)
    try:
        text = raw.decode(encoding)
    except UnicodeDecodeError as error:
        before = raw[: error.start]
        line = before.count(b"\n") + 1
        called = encoding.removesuffix("-sig").upper()
        raise InputError(f"{path}, line {line}: found a byte that is no {called}, expected a text file") from None
    before_binary, is_binary, _ = text.partition("\0")
    if is_binary:
        line = before_binary.count("\n") + 1
        raise InputError(f"{path}, line {line}: found binary data, expected text (CSV) or a workbook (xlsx)")
    return text.translate(_FULL_WIDTH), encoding


def _unmarked(raw: bytes) -> str | None:
    """UTF-8 or UTF-16 without a mark; None where it is neither."""
    start = raw[:4096]
    if start.count(0) > _NUL_SHARE * len(start):
        return "utf-16-le" if start[1::2].count(0) > start[::2].count(0) else "utf-16-be"
    return "utf-8" if _decoded(raw, "utf-8") is not None else None


def _code_page(raw: bytes, known_words: Callable[[str], int]) -> str:
    """The first code page of those whose text has most words that name quantities."""
    words = {}
    for page in _CODE_PAGES:
        text = _decoded(raw, page)
        if text is not None:
            words[page] = known_words("\n".join(text.splitlines()[:_LINES]))
    return max(words, key=lambda page: words[page])  # latin-1 decodes everything


def _decoded(raw: bytes, encoding: str) -> str | None:
    try:
        return raw.decode(encoding)
    except UnicodeDecodeError:
        return None
