"""Files of named arrays: what xarray finds in them, and what is read back."""

import h5py
import numpy as np
import pytest
import xarray as xr

from wirebayes.results.netcdf import Group, Variable, content, read_groups


@pytest.fixture
def group():
    readings = np.arange(6.0).reshape(2, 3)
    readings[1, 2] = np.nan
    return Group(
        {
            "tension_N": Variable(("hold", "time"), readings),
            "bench": Variable(("hold",), np.array(["Prüfstand 1", "α"])),
            "seeds": Variable(("draw",), np.array([3, 1, 4, 1])),
        },
        {
            "hold": Variable(("hold",), np.array([4, 7])),
            "experiment": Variable(("hold",), np.array(["roc", "kite"])),
        },
        {"tension_N": "N", "bench": "1"},
        {"converged": 1, "range": [0.5, 2.0], "words": "für ArviZ"},
    )


def test_xarray_finds_dimensions_labels_units_and_missing_values(group, tmp_path):
    path = tmp_path / "some.nc"
    path.write_bytes(content({"first": group, "second": group}, {"version": "1"}))
    with xr.open_datatree(path, engine="h5netcdf") as tree:
        assert tree.attrs == {"version": "1"} and set(tree.children) == {"first", "second"}
        found = tree["second"].to_dataset().load()
    wanted = xr.Dataset(
        {
            "tension_N": (("hold", "time"), group["tension_N"], {"units": "N"}),
            "bench": ("hold", group["bench"], {"units": "1"}),
            "seeds": ("draw", group["seeds"]),
        },
        {"hold": [4, 7], "experiment": ("hold", ["roc", "kite"])},
    )
    xr.testing.assert_equal(found, wanted)
    assert set(found.coords) == {"hold", "experiment"}
    assert found["seeds"].dtype == np.int64 and found["tension_N"].dtype == float
    assert {name: v.attrs.get("units") for name, v in found.data_vars.items()} == {
        "tension_N": "N",
        "bench": "1",
        "seeds": None,
    }
    assert found.attrs["words"] == "für ArviZ" and list(found.attrs["range"]) == [0.5, 2.0]


def test_dimensions_are_numbered_through_the_file(group, tmp_path):
    path = tmp_path / "some.nc"
    path.write_bytes(content({"first": group, "second": group}, {}))
    with h5py.File(path) as file:
        scales = [d for name in ("first", "second") for d in file[name].values() if d.is_scale]
        assert [d.name.rpartition("/")[2] for d in scales] == ["hold", "time", "draw"] * 2
        assert sorted(int(d.attrs["_Netcdf4Dimid"]) for d in scales) == list(range(6))


@pytest.mark.parametrize("writer", ["content", "xarray"])
def test_what_was_written_is_read_back_whoever_wrote_it(group, writer, tmp_path):
    path = tmp_path / "some.nc"
    path.write_bytes(content({"one": group}, {}))
    if writer == "xarray":
        with xr.open_datatree(path, engine="h5netcdf") as tree:
            tree.load()
        tree.to_netcdf(tmp_path / "again.nc", engine="h5netcdf")
        path = tmp_path / "again.nc"
    found = read_groups(path, ["one"])["one"]
    assert list(found.variables) == list(group.variables) and set(found.coordinates) == set(group.coordinates)
    for name in group.variables | group.coordinates:
        assert (found.variables | found.coordinates)[name].dims == (group.variables | group.coordinates)[name].dims
        same = np.testing.assert_array_equal
        same(found[name], group[name])
    assert found.units == group.units and "hold" in found and "nothing" not in found
    assert found.attributes["converged"] == 1 and found.attributes["words"] == "für ArviZ"


def test_a_group_that_is_not_there_is_an_error(group, tmp_path):
    path = tmp_path / "some.nc"
    path.write_bytes(content({"one": group}, {}))
    with pytest.raises(KeyError):
        read_groups(path, ["prior"])
