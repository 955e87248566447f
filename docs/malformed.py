"""What each malformed input says: the table of the documentation, made by running the reader.

Every case changes the valid pair of files in ``example`` in one place.
"""

from pathlib import Path
from typing import NamedTuple

from wirebayes.errors import InputError
from wirebayes.io.experiment_file import read_experiments

EXAMPLE = Path(__file__).parent / "example"


class Case(NamedTuple):
    """`old` in ``my-wire.toml`` or ``my-wire.csv`` is replaced by `new`; None leaves the file out."""

    mistake: str
    file: str
    old: str
    new: str | None


CASES = [
    Case("A comma as the decimal sign", "my-wire.csv", "1,1,30,1.91", "1,1,30,1,91"),
    Case("Semicolons between the fields", "my-wire.csv", ",time_s,tension_N", ";time_s;tension_N"),
    Case("A column left out", "my-wire.csv", ",tension_N", ""),
    Case("A mistyped column", "my-wire.csv", "tension_N", "tensoin_N"),
    Case("A comment among the readings", "my-wire.csv", "1,1,30,1.91", "# the wire slipped here"),
    Case("Not a number", "my-wire.csv", "1,1,30,1.91", "1,1,30,1.9l"),
    Case("A reading that is missing", "my-wire.csv", "1,1,30,1.91", "1,1,30,nan"),
    Case("Time of day instead of time in the hold", "my-wire.csv", "1,1,60", "1,1,10"),
    Case("A time before the hold", "my-wire.csv", "2,2,0", "2,2,-5"),
    Case("A displacement that changes in a hold", "my-wire.csv", "2,2,45", "2,2.1,45"),
    Case("Tensions in another unit", "my-wire.csv", "tension_N", "tension_kgf"),
    Case("A number that no test gives", "my-wire.csv", "1,1,30,1.91", "1,1,30,1.91e30"),
    Case("Holds out of order", "my-wire.csv", "4,1.5,0", "2,1.5,0"),
    Case("A hold number with a decimal", "my-wire.csv", "4,1.5,0", "4.0,1.5,0"),
    Case("A displacement in the wrong unit", "my-wire.csv", "4,1.5,0", "4,-1500,0"),
    Case("No readings", "my-wire.toml", 'readings = "my-wire.csv"', 'readings = "wire.csv"'),
    Case("Readings outside the folder", "my-wire.toml", '"my-wire.csv"', '"../my-wire.csv"'),
    Case("A length with its unit", "my-wire.toml", "1200.0", '"1200 mm"'),
    Case("A length of nothing", "my-wire.toml", "1200.0", "0.0"),
    Case("A length in another unit", "my-wire.toml", "length_mm = 1200.0", "length_m = 1.2"),
    Case("A mistyped key", "my-wire.toml", "length_mm", "lenght_mm"),
    Case("A key left out", "my-wire.toml", 'material = "Dyneema 1 mm"\n', ""),
    Case("A name that is no file name", "my-wire.toml", '"my-wire"', '"my wire"'),
    Case("A single table", "my-wire.toml", "[[experiment]]", "[experiment]"),
    Case("A missing quote", "my-wire.toml", '"Dyneema 1 mm"', '"Dyneema 1 mm'),
    Case("An unrecorded hold after the last one", "my-wire.toml", "before_hold = 3", "before_hold = 9"),
    Case("A hold that lasts less than nothing", "my-wire.toml", "duration_s = 60.0", "duration_s = -60.0"),
    Case("No such file", "my-wire.toml", "", None),
]


def write(case: Case, folder: Path) -> Path:
    """The example with one mistake, in a folder; returns the path of its TOML."""
    for path in EXAMPLE.iterdir():
        text: str | None = path.read_text(encoding="utf-8")
        if path.name == case.file:
            assert text is not None
            assert case.old in text, case
            text = None if case.new is None else text.replace(case.old, case.new, 1)
        if text is not None:
            (folder / path.name).write_text(text, encoding="utf-8")
    return folder / "my-wire.toml"


def message(toml: Path) -> str:
    """What the reader says, with the folder left out."""
    try:
        read_experiments(toml)
    except InputError as error:
        return str(error).replace(f"{toml.parent}/", "")
    raise AssertionError(f"{toml} was accepted")
