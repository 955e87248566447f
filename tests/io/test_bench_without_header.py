"""Numbers without a header, which a user names by the numbers of columns, and lines that name each value."""

import pytest

from tests.io.bench_files import convert
from wirebayes.errors import InputError
from wirebayes.io.bench.about import About
from wirebayes.io.bench.undecided import Choices, Undecided

ABOUT = About("wire", "line", 1000.0)
ROWS = [(t, x, 5.0 * x - t / 100) for x in (1.0, 2.0, 3.0) for t in (0, 10, 30)]
SAID = ("1=time [s]", "2=displacement [mm]", "3=tension [N]")


def read(tmp_path, text, **choices):
    path = tmp_path / "raw.txt"
    path.write_text(text, encoding="utf-8")
    return convert(path, ABOUT, Choices(**choices))


def assert_is_the_test(made):
    times, places, tensions = zip(*ROWS, strict=True)
    assert [row[1:4] for row in made.rows] == [
        [x, t, pytest.approx(y)] for t, x, y in zip(times, places, tensions, strict=True)
    ]


@pytest.mark.parametrize("above", ["", "# a rope, 6 mm\n", "Test 7 of Monday\nby hand\n"])
@pytest.mark.parametrize("sign", [",", ";", "\t", " "])
def test_columns_without_a_header_are_called_by_their_numbers(tmp_path, above, sign):
    text = above + "\n".join(sign.join(f"{value:.2f}" for value in row) for row in ROWS)
    first = above.count("\n") + 1
    with pytest.raises(Undecided) as error:
        read(tmp_path, text)
    assert f"raw.txt, line {first}: found numbers without a header" in str(error.value)
    assert 'among 1 (0.00), 2 (1.00), 3 (5.00), expected one of each; say which with --map "N=disp' in str(error.value)
    made = read(tmp_path, text, mapping=SAID)
    assert_is_the_test(made)
    assert "no header" in made.notes[0]


def test_a_header_of_too_few_names_is_still_one(tmp_path):
    with pytest.raises(InputError, match="line 2, column 3: found 3 cells, expected 2 as in the header of line 1"):
        read(tmp_path, "Time [s],Force [N]\n" + "\n".join("{},{},{}".format(*row) for row in ROWS))


@pytest.mark.parametrize(
    "line",
    ["Time={} s Displacement={} mm Force={:.2f} N", "Time: {} s, Displacement: {} mm, Force: {:.2f} N",
     "Time = {}s | Displacement = {}mm | Force = {:.2f}N", "Force={2:.2f}N;Displacement={1}mm;Time={0}s;"],
)  # fmt: skip
def test_lines_that_name_each_value_are_columns(tmp_path, line):
    lines = [line.format(*row) for row in ROWS]
    assert_is_the_test(read(tmp_path, "Scale ready\n" + "\n".join(lines)))


def test_keys_without_units_are_mapped_and_commas_may_be_decimal(tmp_path):
    lines = [f"t={t} x={x} F={y:.2f}".replace(".", ",") for t, x, y in ROWS]
    assert_is_the_test(read(tmp_path, "\n".join(lines), mapping=("t=time [s]", "x=displacement [mm]", "F=tension [N]")))
    with pytest.raises(Undecided, match="among t, x, F"):
        read(tmp_path, "\n".join(lines))


def test_a_value_that_is_not_there_is_an_empty_cell_and_another_unit_is_refused(tmp_path):
    lines = [f"Time={t} s Displacement={x} mm Force={y:.2f} N" for t, x, y in ROWS]
    lines[4] = "Time=10 s Displacement=2.0 mm"
    with pytest.raises(InputError, match=r"line 5, column 3 \(Force \[N\]\): found an empty cell"):
        read(tmp_path, "\n".join(lines))
    lines[4] = "Time=10 s Displacement=2.0 mm Force=0.01 kN"
    with pytest.raises(InputError, match="line 5: found Force in kN, expected N as before"):
        read(tmp_path, "\n".join(lines))
    two = [f"Note: no. {i}" for i in range(9)] + lines[:3]
    with pytest.raises(InputError, match="found no columns of numbers"):
        read(tmp_path, "\n".join(two))
