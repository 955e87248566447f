"""Keys of what is read carry its unit: ``rmse_N`` where tensions are read is ``rmse_mm`` where displacements are."""

from collections.abc import Mapping
from typing import Any, TypeVar

Content = TypeVar("Content")

_OF_READINGS = ("rmse", "observed", "mean", "sd", "quantiles", "floor", "residual_rms", "first", "last", "resolution")
_IN_N = {f"{name}_N": name for name in _OF_READINGS}


def in_unit(content: Content, unit: str) -> Content:
    """The same content with the unit of what was read in its keys, at every depth.

    Parameters
    ----------
    content : JSON value
        With keys in ``_N``.
    unit : {"N", "mm"}
    """
    if unit == "N":
        return content
    out: Any = content
    if isinstance(content, Mapping):
        out = {f"{_IN_N[key]}_{unit}" if key in _IN_N else key: in_unit(value, unit) for key, value in content.items()}
    elif isinstance(content, list | tuple):
        out = [in_unit(value, unit) for value in content]
    return out


def read_value(entry: Mapping[str, Any], name: str) -> Any:
    """What an entry holds under a name, whatever the unit of what was read."""
    return entry[f"{name}_{unit_read(entry, name)}"]


def error_grows(held: Mapping[str, Any]) -> bool:
    """Whether the final model predicts the holds left out with a larger error than the plain one."""
    plain, final = (read_value(held[model], "rmse") for model in ("plain", "final"))
    return plain is not None and final is not None and bool(final > plain)


def unit_read(entry: Mapping[str, Any], name: str = "rmse") -> str:
    """The unit of what was read, from an entry's own key."""
    return "mm" if f"{name}_mm" in entry else "N"
