"""The resume file: plain values as JSON and named arrays in one zip archive, whose content is never executed.

``state.json`` holds the number of the format, the fit to which the file belongs, the plain values and the names of the
arrays; it is read and checked before any array. Arrays are ``.npy`` files beside it, as in numpy's ``.npz``; nested
names are joined by dots.
"""

import json
import zipfile
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from wirebayes.errors import InputError
from wirebayes.io.run_folder import differences, stored_results, write_bytes
from wirebayes.json_files.plain import plain

FORMAT = 6  # raise it whenever what is stored changes its meaning
_VALUES = "state.json"
INSTEAD = "remove this file to restart the fit"


def write_checkpoint(path: Path, fit: Mapping[str, Any], values: Mapping[str, Any], arrays: Mapping[str, Any]) -> None:
    """Write the file whole, or leave the one that is there.

    Parameters
    ----------
    fit : mapping
        What distinguishes this fit from others.
    values : mapping
        Of JSON's own types.
    arrays : mapping
        Of arrays, or of such mappings; None is left out.
    """
    content = BytesIO()
    flat = _flat(arrays)
    state = {"format": FORMAT, "fit": plain(fit), "values": values, "arrays": sorted(flat)}
    with zipfile.ZipFile(content, "w") as archive:
        archive.writestr(_VALUES, json.dumps(state))
        for name, array in flat.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as stream:
                np.lib.format.write_array(stream, np.asarray(array), allow_pickle=False)
    write_bytes(path, content.getvalue())


def read_checkpoint(path: Path, fit: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]] | None:
    """The values and the nested arrays of a file; None where there is no file.

    Raises
    ------
    InputError
        The file is damaged, of another format, or of another fit.
    """
    if not path.exists():
        return None
    with stored_results(path, INSTEAD):
        with zipfile.ZipFile(path) as archive:
            stored = json.loads(archive.read(_VALUES))
        found = stored["format"]
        if found != FORMAT:
            raise InputError(f"{path}: found format {found}, expected {FORMAT}; {INSTEAD}")
        different = differences(stored["fit"], plain(fit))
        if different:
            raise InputError(f"{path}: belongs to another fit: {different[0]}; {INSTEAD}")
        with np.load(path, allow_pickle=False) as loaded:
            # an archive whose directory was damaged may seem to hold fewer
            arrays = {name: loaded[name] for name in stored["arrays"]}
        return stored["values"], _nested(arrays)


def _flat(arrays: Mapping[str, Any]) -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name, value in arrays.items():
        if isinstance(value, Mapping):
            flat |= {f"{name}.{inner}": array for inner, array in _flat(value).items()}
        elif value is not None:
            flat[name] = value
    return flat


def _nested(flat: Mapping[str, Any]) -> dict[str, Any]:
    nested: dict[str, Any] = {}
    for name, array in flat.items():
        *path, last = name.split(".")
        here = nested
        for part in path:
            here = here.setdefault(part, {})
        here[last] = array
    return nested
