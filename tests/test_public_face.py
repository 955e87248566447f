"""`import wirebayes as wb`: light, complete, and without a name that two things share."""

import pkgutil
import subprocess
import sys

import numpy as np
import pytest

import wirebayes as wb
from wirebayes.io import paper

FUNCTIONS = {
    "read_experiments", "from_arrays", "fit", "compare", "discover", "predict", "simulate_tests", "load", "read_robot",
    "pose", "calibrate", "export", "list_effects", "write_report", "reproduce_paper",
}  # fmt: skip
HEAVY = ("numpy", "scipy", "xarray", "matplotlib", "emcee", "arviz", "arviz_base")


def test_the_import_loads_nothing_heavy():
    code = f"import sys, wirebayes; dir(wirebayes); print([m for m in {HEAVY} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_every_function_is_there_and_listed():
    assert FUNCTIONS <= set(wb.__all__) <= set(dir(wb))
    for name in wb.__all__:
        assert getattr(wb, name) is getattr(wb, name)
    with pytest.raises(AttributeError, match="no attribute 'fits'"):
        _ = wb.fits


def test_no_public_name_is_that_of_a_submodule():
    assert not {module.name for module in pkgutil.iter_modules(wb.__path__)} & set(wb.__all__)


def test_arrays_are_the_same_test_as_the_file():
    nylon = paper.experiments()[2]
    recorded = nylon.recorded_holds
    columns = {
        "hold": np.concatenate([np.full(h.time_s.size, h.number) for h in recorded]),
        "displacement_mm": np.concatenate([np.full(h.time_s.size, h.displacement_mm) for h in recorded]),
        "time_s": np.concatenate([h.time_s for h in recorded]),
        "tension_N": np.concatenate([h.tension_N for h in recorded]),
    }
    gaps = [
        {
            "before_hold": next(k.number for k in nylon.holds[i:] if k.recorded),
            "displacement_mm": h.displacement_mm,
            "duration_s": h.duration_s,
        }
        for i, h in enumerate(nylon.holds)
        if not h.recorded
    ]
    about = {"length_mm": nylon.length_mm, "name": nylon.name, "material": nylon.material,
             "resolution_N": nylon.resolution_N, "unrecorded_holds": gaps}  # fmt: skip
    one, other = wb.from_arrays(**columns, **about), wb.from_arrays(columns, **about)
    assert one.data_hash == other.data_hash == nylon.data_hash


GOOD = {
    "hold": [1, 1, 1, 2, 2],
    "displacement_mm": [1.0, 1.0, 1.0, 2.0, 2.0],
    "time_s": [0.0, 30.0, 60.0, 0.0, 30.0],
    "tension_N": [2.1, 1.9, 1.8, 2.5, 2.3],
}
ABOUT = {"length_mm": 1200.0, "name": "wire", "material": "line"}


@pytest.mark.parametrize(
    ("column", "values", "said"),
    [
        ("time_s", [0, 30, 30, 0, 30], r"row 2 .from 0., column time_s: found 30, expected a time after 30 s"),
        ("tension_N", [2, 1.9, np.nan, 2, 2], r"row 2 \(from 0\), column tension_N: found 'nan', expected a finite"),
        ("hold", [1, 1, 1, 2.5, 2], r"row 3 \(from 0\), column hold: found '2.5', expected a whole number"),
        ("hold", [2, 2, 2, 1, 1], r"row 3 \(from 0\), column hold: found 1, expected a hold number above 2"),
        ("displacement_mm", [1, 1, 2, 2, 2], r"row 2 .from 0., column displacement_mm: found 2, expected 1 as before"),
        ("tension_N", [2, 1, 1], "column tension_N: found 3 values, expected 5 as in hold"),
        ("temperature_C", [20, 20, -300, 20, 20], r"row 2 .from 0., column temperature_C: found -300, expected"),
    ],
)
def test_a_mistake_in_arrays_is_named_by_row_and_column(column, values, said):
    with pytest.raises(wb.InputError, match=f"^from_arrays, {said}"):
        wb.from_arrays(**GOOD | {column: values}, **ABOUT)


@pytest.mark.parametrize(
    ("about", "said"),
    [
        ({"length_mm": -1}, "argument length_mm: found -1, expected a length above 0 mm"),
        ({"name": "a b"}, "argument name: found 'a b', expected a name of letters"),
        ({"resolution_N": -0.1}, "argument resolution_N: found -0.1, expected a step above 0 N"),
        (
            {"unrecorded_holds": [{"before_hold": 9, "displacement_mm": 1, "duration_s": 3}]},
            r"argument unrecorded_holds\[0\].before_hold: found 9, expected a hold number from 0 to 2",
        ),
    ],
)
def test_a_wrong_argument_is_named(about, said):
    with pytest.raises(wb.InputError, match=f"^from_arrays, {said}"):
        wb.from_arrays(**GOOD, **ABOUT | about)


def test_a_table_without_a_column_is_refused():
    with pytest.raises(wb.InputError, match="found no column time_s, expected hold, displacement_mm, time_s"):
        wb.from_arrays({k: v for k, v in GOOD.items() if k != "time_s"}, **ABOUT)
    with pytest.raises(wb.InputError, match=r"found the column 'force', expected hold"):
        wb.from_arrays(GOOD | {"force": [1] * 5}, **ABOUT)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"elastic_law": "hook"}, "elastic_law: found 'hook'.* expected hooke or modified"),
        ({"seed": -1}, "seed: found -1, expected a whole number, 0 or more"),
        ({"train_holds": 2.5}, "train_holds: found 2.5, expected a whole number"),
        ({"effects": "nope"}, "effect nope: no such effect"),
        ({"experiment": "x"}, "found no experiment 'x'"),
    ],
)
def test_a_wrong_option_of_fit_is_named(options, said):
    with pytest.raises(wb.InputError, match=said):
        wb.fit(wb.from_arrays(**GOOD, **ABOUT), **options)
