"""Named arrays in groups, to and from netCDF files that xarray and ArviZ open.

Both would do the same, but take a second to load, and most commands need neither. h5netcdf, which they open files with,
takes six times as long to write one as HDF5 itself, because it looks up each dimension again for each variable.

A netCDF file is one of HDF5 in which every dimension is a dataset, a "scale" that the axes of others are attached to:
the coordinate that labels it, or else an empty one whose name says that it is no variable.
"""

import io
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np

from wirebayes.numeric.typing import Array

_NO_VARIABLE = "This is a netCDF dimension but not a netCDF variable."  # words of the format


class Variable(NamedTuple):
    """An array whose axes have names.

    Attributes
    ----------
    dims : tuple of str
        One for each axis.
    values : array
        Floats, whole numbers or text.
    """

    dims: tuple[str, ...]
    values: Array


@dataclass
class Group:
    """Variables that share their dimensions.

    Attributes
    ----------
    variables : dict of name to Variable
    coordinates : dict of name to Variable
        What the dimensions count; one with the name of a dimension labels it.
    units : dict of name to str
        Of the variables.
    attributes : dict
        Text, numbers or lists of numbers.
    """

    variables: dict[str, Variable]
    coordinates: dict[str, Variable] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    attributes: dict[str, Any] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Array:
        """The values of a variable or coordinate."""
        return (self.variables if name in self.variables else self.coordinates)[name].values

    def __contains__(self, name: str) -> bool:
        return name in self.variables or name in self.coordinates


def content(groups: Mapping[str, Group], attributes: Mapping[str, Any]) -> bytes:
    """The content of a netCDF file, made in memory: HDF5 itself may end the process where a disk is full.

    Parameters
    ----------
    groups : mapping of name to Group
    attributes : mapping
        Of the file as a whole.
    """
    stream = io.BytesIO()
    numbers = count()
    with h5py.File(stream, "w", track_order=True) as file:
        _describe(file, attributes)
        for name, group in groups.items():
            _write(file.create_group(name, track_order=True), group, numbers)
    return stream.getvalue()


def read_groups(path: Path, names: Sequence[str]) -> dict[str, Group]:
    """Some groups of a file that `content` made.

    Parameters
    ----------
    names : sequence of str
        Of the groups.
    """
    with h5py.File(path, "r") as file:
        return {name: _read(file[name]) for name in names}


def _write(node: Any, group: Group, numbers: Iterator[int]) -> None:
    """Fill a group of HDF5; each dimension takes the next of the file's numbers."""
    _describe(node, group.attributes)
    every = group.coordinates | group.variables
    written = {name: _dataset(node, name, variable.values) for name, variable in every.items()}
    sizes = _sizes(every.values())
    _make_scales(node, written, sizes, numbers)
    labels = {name: set(variable.dims) for name, variable in group.coordinates.items() if name not in sizes}
    for name, variable in every.items():
        dataset = written[name]
        if name not in sizes:
            _attach_scales(node, dataset, variable)
        if name in group.units:
            dataset.attrs["units"] = group.units[name]
        if name in group.variables:
            _name_labels(dataset, variable, labels)


def _attach_scales(node: Any, dataset: Any, variable: Variable) -> None:
    """Join each axis of a dataset to the scale of its dimension."""
    for axis, dim in zip(dataset.dims, variable.dims, strict=True):
        axis.attach_scale(node[dim])


def _name_labels(dataset: Any, variable: Variable, labels: Mapping[str, set[str]]) -> None:
    """Say which coordinates that are no dimensions label a variable, as the conventions for climate and forecast do."""
    own = [other for other, dims in labels.items() if dims <= set(variable.dims)]
    if own:
        dataset.attrs["coordinates"] = " ".join(own)


def _sizes(variables: Iterable[Variable]) -> dict[str, int]:
    """The size of every dimension."""
    sizes = {}
    for variable in variables:
        for dim, size in zip(variable.dims, variable.values.shape, strict=True):
            sizes[dim] = size
    return sizes


def _make_scales(node: Any, written: Mapping[str, Any], sizes: Mapping[str, int], numbers: Iterator[int]) -> None:
    """Make a scale of the coordinate that labels a dimension, or an empty one."""
    for dim, size in sizes.items():
        if dim in written:
            scale = written[dim]
            name = dim
        else:
            scale = node.create_dataset(dim, (size,), ">f4", track_order=True)
            name = f"{_NO_VARIABLE}{size:10}"
        scale.make_scale(name)
        scale.attrs["_Netcdf4Dimid"] = np.int32(next(numbers))


def _dataset(node: Any, name: str, values: Array) -> Any:
    if values.dtype.kind in "UO":
        return node.create_dataset(name, data=values.astype(object), dtype=h5py.string_dtype(), track_order=True)
    if values.dtype.kind != "f":
        return node.create_dataset(name, data=values, track_order=True)
    dataset = node.create_dataset(name, data=values, fillvalue=np.nan, track_order=True)
    dataset.attrs["_FillValue"] = np.array([np.nan], values.dtype)
    return dataset


def _describe(node: Any, attributes: Mapping[str, Any]) -> None:
    """Attributes of a file or group; netCDF has lists of numbers only, with one entry or more."""
    for name, value in attributes.items():
        node.attrs[name] = value if isinstance(value, str) else np.atleast_1d(value)


def _read(node: Any) -> Group:
    found = Group({})
    for name, value in node.attrs.items():
        found.attributes[name] = _entry(value)
    stored = {name: dataset for name, dataset in node.items() if not _is_bare(dataset)}
    labels: set[str] = set()
    for dataset in stored.values():
        named = _entry(dataset.attrs.get("coordinates", ""))
        labels.update(_dims(dataset))
        labels.update(named.split())
    for name, dataset in stored.items():
        variable = Variable(_dims(dataset), _values(dataset))
        if name in labels:
            found.coordinates[name] = variable
        else:
            found.variables[name] = variable
        if "units" in dataset.attrs:
            found.units[name] = _entry(dataset.attrs["units"])
    return found


def _is_bare(dataset: Any) -> bool:
    """Whether a dataset stands for a dimension without labels."""
    return dataset.is_scale and h5py.h5ds.get_scale_name(dataset.id).startswith(_NO_VARIABLE.encode())


def _dims(dataset: Any) -> tuple[str, ...]:
    """Names of the axes: of the scales that are attached; a scale is attached to none, and labels its own."""
    scales = [dataset] if dataset.is_scale else [axis[0] for axis in dataset.dims]
    return tuple(scale.name.rpartition("/")[2] for scale in scales)


def _entry(value: Any) -> Any:
    """An attribute as it was given to `content`: a list of one entry is that entry."""
    is_one = np.size(value) == 1 and np.ndim(value) > 0
    entry = value[0] if is_one else value
    return entry.decode() if isinstance(entry, bytes) else entry


def _values(dataset: Any) -> Array:
    """The values in this machine's order of bytes; text as Python's own."""
    values = np.asarray(dataset[...])
    if values.dtype.kind not in "OSU":
        return values
    text = [entry.decode() if isinstance(entry, bytes) else entry for entry in values.ravel()]
    return np.array(text).reshape(values.shape)
