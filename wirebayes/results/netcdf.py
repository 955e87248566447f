"""Named arrays in groups, to and from netCDF files that xarray and ArviZ open.

Both would do the same, but take a second to load, and most commands need neither.
"""

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import h5netcdf
import h5py
import numpy as np
from numpy.typing import NDArray


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
    values: NDArray[Any]


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

    def __getitem__(self, name: str) -> NDArray[Any]:
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
    with h5netcdf.File(stream, "w") as file:
        file.attrs.update(attributes)
        for name, group in groups.items():
            _write(file.create_group(name), group)
    return stream.getvalue()


def read_groups(path: Path, names: Sequence[str]) -> dict[str, Group]:
    """Some groups of a file that `content` made.

    Parameters
    ----------
    names : sequence of str
        Of the groups.
    """
    with h5netcdf.File(path, "r") as file:
        return {name: _read(file.groups[name]) for name in names}


def _write(node: Any, group: Group) -> None:
    node.attrs.update(group.attributes)
    both = group.coordinates | group.variables
    for variable in both.values():
        sizes = zip(variable.dims, variable.values.shape, strict=True)
        node.dimensions.update({dim: size for dim, size in sizes if dim not in node.dimensions})
    auxiliary = [name for name in group.coordinates if name not in node.dimensions]
    for name, variable in both.items():
        written = _write_variable(node, name, variable)
        if name in group.units:
            written.attrs["units"] = group.units[name]
        labelling = [other for other in auxiliary if set(group.coordinates[other].dims) <= set(variable.dims)]
        if labelling and name in group.variables:  # as the conventions for climate and forecast (CF) have it
            written.attrs["coordinates"] = " ".join(labelling)


def _write_variable(node: Any, name: str, variable: Variable) -> Any:
    values = variable.values
    is_text = values.dtype.kind in "UO"
    dtype = h5py.string_dtype() if is_text else values.dtype
    missing = np.nan if values.dtype.kind == "f" else None
    written = node.create_variable(name, variable.dims, dtype, fillvalue=missing)
    written[...] = values.astype(object) if is_text else values
    return written


def _read(node: Any) -> Group:
    both = {name: Variable(tuple(v.dimensions), _values(v)) for name, v in node.variables.items()}
    labels = {word for v in node.variables.values() for word in str(v.attrs.get("coordinates", "")).split()}
    labels |= set(node.dimensions)
    return Group(
        {name: v for name, v in both.items() if name not in labels},
        {name: v for name, v in both.items() if name in labels},
        {name: v.attrs["units"] for name, v in node.variables.items() if "units" in v.attrs},
        dict(node.attrs),
    )


def _values(variable: Any) -> NDArray[Any]:
    """The values in this machine's order of bytes; text as Python's own."""
    values = np.asarray(variable[...])
    if values.dtype.kind in "OSU":
        return np.array([t.decode() if isinstance(t, bytes) else t for t in values.ravel()]).reshape(values.shape)
    return values
