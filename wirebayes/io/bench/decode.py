"""Bytes of a text file as text: UTF-8, UTF-16 and UTF-32 with and without a mark, else Western European."""

import codecs
from pathlib import Path

from wirebayes.errors import InputError
from wirebayes.user_files import read_bytes

_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF32_LE, "utf-32"), (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"),
)  # fmt: skip
_NUL_SHARE = 0.2  # of the bytes: UTF-16 of digits has a half, text none


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


def decode(path: Path, raw: bytes) -> str:
    """The text of a file whatever its encoding.

    Raises
    ------
    InputError
        It is no text.
    """
    encoding = next((name for mark, name in _MARKS if raw.startswith(mark)), None) or _unmarked(raw)
    try:
        text = raw.decode(encoding)
    except UnicodeDecodeError as error:
        line = raw[: error.start].count(b"\n") + 1
        found = f"found a byte that is no {encoding.removesuffix('-sig').upper()}"
        raise InputError(f"{path}, line {line}: {found}, expected a text file") from None
    if "\0" in text:
        line = text[: text.index("\0")].count("\n") + 1
        raise InputError(f"{path}, line {line}: found binary data, expected text (CSV) or a workbook (xlsx)")
    return text


def _unmarked(raw: bytes) -> str:
    start = raw[:4096]
    if start.count(0) > _NUL_SHARE * len(start):
        return "utf-16-le" if start[1::2].count(0) > start[::2].count(0) else "utf-16-be"
    try:
        raw.decode("utf-8")
    except UnicodeDecodeError:
        return "latin-1" if any(0x80 <= byte < 0xA0 for byte in raw) and _undefined(raw) else "cp1252"
    return "utf-8"


def _undefined(raw: bytes) -> bool:
    """Bytes that the Windows page leaves out."""
    return any(byte in (0x81, 0x8D, 0x8F, 0x90, 0x9D) for byte in raw)
