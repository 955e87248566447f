"""Files damaged at random: bytes, words and numbers of a text, values of a JSON document, parts of a netCDF file."""

import copy
import json
import random
from pathlib import Path
from typing import Any

WILD_TEXT = [
    "", "nan", "NaN", "inf", "-inf", "-1", "0", "-0", "1e308", "-1e308", "1e-320", "1e400", "1_000", "1,5", "0x10", "٣",
    "1 2", "--1", "+", ".", "e5", "\x00", "\ud7ff", "\ufeff", "\u2028", "\x85", "\x0b", "\x1b[31m", '"', "'", "\r",
    "\n", "\t", ";", ",", "=", "]", "[", "{", "#", "true", "<script>alert(1)</script>", "&amp;", "../..", "/dev/zero",
    "9" * 400, "9" * 4000 + "x", "(" + " " * 2000 + "x", "1e30", "1e-400", "1,234", "1.234", "1:30", "99:99:99",
    "9" * 30 + ":00",    "2024-13-45", "2024-02-30 25:61:61", "1/2/3", "9" * 5000, "0x" + "f" * 5000, "é", "x" * 10_000,
]  # fmt: skip
WILD_JSON: list[Any] = [
    None, True, -1, 0, 1e308, -1e-320, 10**400, "", "x\ny", "<b>", "\x00", [], [None], {}, {"a": 1}, [[[]]],
]  # fmt: skip
FOREIGN = [b"", b"\x89HDF\r\n\x1a\n", b"PK\x03\x04", b"\xd0\xcf\x11\xe0", b"\xff\xfe\x00", b"\x00" * 100,
           b"[" * 100_000, b"{}", b"[]", b"0", b'"x"', b"null", b"\n\n\n", b",,,\n,,,\n", b"\xef\xbb\xbf"]  # fmt: skip
ENCODINGS = ["utf-16", "utf-16-le", "utf-32", "utf-8-sig", "latin-1", "cp1252", "utf-7", "cp037"]


def scrambled(rng: random.Random, content: bytes) -> bytes:
    """Bytes changed, cut off, repeated, or the whole of another file."""
    way = rng.randrange(6)
    at, end = sorted(rng.randrange(len(content) + 1) for _ in range(2))
    if way == 0:
        return content[:at]
    if way == 1:
        return content[:at] + content[end:]
    if way == 2:
        return content[:end] + content[at:]
    if way == 3:
        return rng.choice(FOREIGN)
    out = bytearray(content)
    for _ in range(rng.choice([1, 3, 30])):
        out[rng.randrange(len(out))] = rng.randrange(256)
    return bytes(out)


def words_changed(rng: random.Random, content: bytes) -> bytes:
    """A number or word of a text replaced by a wild one, or a line moved, doubled or dropped."""
    lines = content.decode("utf-8", "replace").splitlines(keepends=True)
    for _ in range(rng.choice([1, 1, 1, 3])):
        i = rng.randrange(len(lines))
        way = rng.randrange(5)
        if way == 0:
            lines.insert(rng.randrange(len(lines)), lines[i])
        elif way == 1 and len(lines) > 1:
            del lines[i]
        else:
            separator = rng.choice([",", ",", " ", "=", ";"])
            cells = lines[i].split(separator)
            cells[rng.randrange(len(cells))] = rng.choice([*WILD_TEXT, f"{rng.uniform(-10, 10):.3g}"])
            lines[i] = separator.join(cells)
    return "".join(lines).encode("utf-8", "surrogatepass")


def encoded(rng: random.Random, content: bytes) -> bytes:
    """The text in another encoding, with other line ends, or with more columns than anybody has."""
    text = content.decode("utf-8", "replace")
    way = rng.randrange(4)
    if way == 0:
        return text.replace("\n", rng.choice(["\r", "\r\n", "\n\n", "\x0b", "\u2028"])).encode()
    if way == 1:
        return text.replace(",", "," * rng.choice([2, 100, 10_000]), rng.choice([1, -1]))[:1_000_000].encode()
    return text.encode(rng.choice(ENCODINGS), "replace")


def text_changed(rng: random.Random, content: bytes) -> bytes:
    """Any of the above."""
    return rng.choice([scrambled, words_changed, words_changed, words_changed, encoded])(rng, content)


def json_changed(rng: random.Random, content: bytes) -> bytes:
    """A value anywhere in a JSON document replaced, dropped or renamed."""
    document = json.loads(content)
    for _ in range(rng.choice([1, 1, 2, 5])):
        here, places = document, []
        while isinstance(here, dict | list) and here:
            key = rng.choice(list(here) if isinstance(here, dict) else range(len(here)))
            places.append((here, key))
            here = here[key]
        if not places:
            break
        parent, key = rng.choice(places)
        way = rng.randrange(4)
        if way == 0:
            del parent[key]
        elif way == 1 and isinstance(parent, dict):
            parent[rng.choice(["", "name", "k1"])] = parent.pop(key)
        else:
            parent[key] = copy.deepcopy(rng.choice(WILD_JSON))  # a later change must not reach the list
    return json.dumps(document).encode()


def netcdf_changed(rng: random.Random, content: bytes, place: Path) -> bytes:
    """A group, variable or attribute of a posterior gone, renamed, or of another kind."""
    import h5py
    import numpy as np

    place.write_bytes(content)
    with h5py.File(place, "r+") as file:
        group = file[rng.choice(list(file))] if rng.random() < 0.8 else file
        names = list(group)
        way = rng.randrange(6)
        name = rng.choice(names)
        if way == 0:
            del group[name]
        elif way == 1:
            group.move(name, f"{name}-else")
        elif way in (2, 3) and isinstance(group[name], h5py.Dataset) and group[name].dtype.kind == "f":
            values = group[name][...]
            wild = rng.choice([np.nan, np.inf, -1.0, 0.0, 1e300, 1e-300, -1e29, 1e25])
            with np.errstate(over="ignore"):  # in single precision 1e300 is infinite
                if rng.random() < 0.5 or values.ndim == 0:
                    values[...] = wild
                else:
                    values.flat[rng.randrange(values.size)] = wild
            group[name][...] = values
        elif group.attrs:
            key = rng.choice(list(group.attrs))
            if way == 4:
                del group.attrs[key]
            else:
                group.attrs[key] = rng.choice(["", "[]", "[1]", '["x", "y"]', "nan", "{", 3.0, -1.0, "null"])
    return place.read_bytes()
