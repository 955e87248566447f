"""What loggers, programs and people write: names with runs, units in columns of their own, JSON, primes, inches."""

import json

import pytest

from tests.io.bench_files import convert
from wirebayes.errors import InputError
from wirebayes.io.bench.about import About
from wirebayes.io.bench.header import name_and_unit
from wirebayes.io.bench.quantities import quantity_unit
from wirebayes.io.bench.undecided import Choices, Undecided

ABOUT = About("wire", "line", 1000.0)
READINGS = [(x, t, 3.0 * x - t / 100.0) for x in (1.0, 2.0) for t in (0.0, 30.0, 120.0)]


def read(tmp_path, text, **choices):
    path = tmp_path / "raw.csv"
    path.write_text(text)
    return convert(path, ABOUT, Choices(**choices))


def of_readings(made):
    return [tuple(row[1:4]) for row in made.rows]


@pytest.mark.parametrize(
    ("header", "role", "name", "unit"),
    [
        ("Force (N) Run #1", "tension", "Force Run #1", "N"),
        ("Force, N (LGR S/N: 1023, SEN S/N: 77)", "tension", "Force (LGR S/N: 1023, SEN S/N: 77)", "N"),
        ("F.N", "tension", "F", "N"),
        ("t.s", "time", "t", "s"),
        ("Force No.2", "tension", "Force No.2", None),
        ("Force (N)/Area (mm2)", "tension", "Force (N)/Area (mm2)", None),  # a stress
        ("(N) alone", "tension", "(N) alone", None),  # a unit is no name
    ],
)
def test_units_amid_a_name_are_found(header, role, name, unit):
    found = name_and_unit(header, role)
    assert (found[0], found[1].text if found[1] else None) == (name, unit)


@pytest.mark.parametrize(
    "header",
    [
        '"#","Displacement, mm (LGR S/N: 1)","Time, s","Force, N (LGR S/N: 1)"',
        '"","x.mm","t.s","F.N"',
        "Reading,Elong. (mm) Run #1,Time (s) Run #1,Force (N) Run #1",
    ],
)
def test_names_of_loggers_and_programs(tmp_path, header):
    rows = [f"{i},{x},{t},{f:.2f}" for i, (x, t, f) in enumerate(READINGS, start=1)]
    assert of_readings(read(tmp_path, "\n".join([header, *rows]))) == [pytest.approx(r) for r in READINGS]


@pytest.mark.parametrize("header", ["x (mm);t (s);Force;Unit", "x (mm);t (s);Force;", "x (mm);t (s);Force;Einheit"])
def test_a_unit_in_a_column_of_its_own_is_that_of_the_column_before(tmp_path, header):
    rows = [f"{x};{t};{f / 1000:.5f};kN" for x, t, f in READINGS]
    assert of_readings(read(tmp_path, "\n".join([header, *rows]))) == [pytest.approx(r) for r in READINGS]


def test_a_column_that_is_no_unit_leaves_the_question(tmp_path):
    rows = [f"{x};{t};{f:.5f};N" for x, t, f in READINGS]
    with pytest.raises(Undecided, match=r"column 3 \(Force\): found no unit"):
        read(tmp_path, "\n".join(["x (mm);t (s);Force;Mode", *rows]))
    with pytest.raises(Undecided, match=r"column 3 \(Force\): found no unit"):
        read(tmp_path, "\n".join(["x (mm);t (s);Force;Unit", *rows]).replace("N", "kN", 1).replace("N", "kN", 2))


RECORDS = [{"t_s": t, "wire": {"position_mm": x, "force_N": f}, "ok": None} for x, t, f in READINGS]
LISTS = {"x_mm": [r[0] for r in READINGS], "t_s": [r[1] for r in READINGS], "force_N": [r[2] for r in READINGS]}


@pytest.mark.parametrize(
    "text",
    ["\n".join(map(json.dumps, RECORDS)), json.dumps(RECORDS), json.dumps(RECORDS, indent=2), json.dumps(LISTS)],
)
def test_records_in_json_are_rows(tmp_path, text):
    made = read(tmp_path, text)
    assert of_readings(made) == [pytest.approx(r) for r in READINGS]
    assert made.notes[0].startswith("records in JSON")


def test_a_record_is_named_by_its_line(tmp_path):
    bad = [*RECORDS[:4], {"t_s": 30.0, "wire": {"position_mm": 2.0, "force_N": "open"}}, RECORDS[5]]
    with pytest.raises(ValueError, match=r"line 5, .*force_N\): found 'open'"):
        read(tmp_path, "\n".join(map(json.dumps, bad)))
    with pytest.raises(ValueError, match=r"line 34, .*force_N\): found 'open'"):
        read(tmp_path, json.dumps(bad, indent=2))


def test_a_length_is_counted_from_where_it_begins_to_pull(tmp_path):
    rows = [f"{1000 + x},{t},{f:.2f}" for x, t, f in READINGS]
    text = "\n".join(["Length (mm),Time (s),Force (N)", *rows])
    with pytest.raises(Undecided) as asked:
        read(tmp_path, text)
    assert asked.value.answers["--zero-mm 1000"] == "lengths of the wire"
    assert of_readings(read(tmp_path, text, zero_mm=1000.0)) == [pytest.approx(r) for r in READINGS]


def test_a_gauge_that_counts_down_under_weights_is_asked_about(tmp_path):
    rows = [f"{load},{t},{20 - load - t / 900:.3f}" for load in (1, 2, 3) for t in (0, 60, 300)]
    text = "\n".join(["Weight (kg),Time (s),Dial (mm)", *rows])
    with pytest.raises(Undecided, match="displacements that fall from 18.* to 16.* mm as the weights rise"):
        read(tmp_path, text)
    assert read(tmp_path, text, mapping=("Dial (mm)=displacement [-mm]",)).rows[0][1] == -19.0
    assert read(tmp_path, text, mapping=("Dial (mm)=displacement [mm]",)).rows[0][1] == 19.0
    longer = [f"{load},{t},{10 + load + 3 * i + t / 100:.3f}" for i, load in enumerate((3, 2, 1)) for t in (0, 60, 300)]
    assert read(tmp_path, "\n".join(["Weight (kg),Time (s),Dial (mm)", *longer])).rows  # creep is more than the steps


@pytest.mark.parametrize(
    "text",
    [
        "\n".join(f"  - {{time_s: {t}, displacement_mm: {x}, force_N: {f:.2f}}}" for x, t, f in READINGS),
        "\n".join(str({"time_s": t, "displacement_mm": x, "force_N": round(f, 2)}) for x, t, f in READINGS),
    ],
)
def test_lines_of_yaml_and_python_name_each_value(tmp_path, text):
    assert of_readings(read(tmp_path, text)) == [pytest.approx(r) for r in READINGS]


@pytest.mark.parametrize("sign", [",", ";"])
def test_lines_that_are_quoted_as_a_whole_are_lines(tmp_path, sign):
    rows = [["x (mm)", "t (s)", "F (N)"], *([f"{x}", f"{t}", f"{f:.2f}"] for x, t, f in READINGS)]
    text = "\n".join(f'"{sign.join(row)}"' for row in rows)
    assert of_readings(read(tmp_path, text)) == [pytest.approx(r) for r in READINGS]


def test_names_that_are_broken_in_two_lines_are_one_cell(tmp_path):
    rows = [f'{x},{t},{f:.2f},"a 5"" pin"' for x, t, f in READINGS]
    head = '"Displacement\n(mm)","Time\n(s)","Force\n(N)",Remark'
    text = "\n".join([head, *rows, "3,0,x,"])
    with pytest.raises(ValueError, match=r"line 11, column 3 \(Force \(N\)\): found 'x'"):
        read(tmp_path, text)
    assert of_readings(read(tmp_path, "\n".join([head, *rows]))) == [pytest.approx(r) for r in READINGS]


def test_an_inch_behind_a_number_breaks_no_line(tmp_path):
    rows = [f'{x},{t},{f:.2f},pin of 5"' for x, t, f in READINGS]
    assert len(of_readings(read(tmp_path, "\n".join(["x (mm),t (s),F (N),Remark", *rows])))) == 6


def test_full_width_letters_are_those_of_other_keyboards(tmp_path):
    wide = {ord(narrow): chr(ord(narrow) + 0xFEE0) for narrow in "0123456789.()-"}
    rows = [f"{x},{t},{f:.2f}".translate(wide) for x, t, f in READINGS]
    text = "\n".join(["変位（mm）,時間（s）,荷重（N）", *rows])
    assert of_readings(read(tmp_path, text)) == [pytest.approx(r) for r in READINGS]


def test_primes_are_minutes_and_seconds(tmp_path):
    cells = {0.0: "0", 30.0: "30''", 120.0: "2'"}
    rows = [f"{x};{cells[t]};{f:.2f}" for x, t, f in READINGS]
    assert of_readings(read(tmp_path, "\n".join(["x (mm);Time;F (N)", *rows]))) == [pytest.approx(r) for r in READINGS]


@pytest.mark.parametrize(("header", "mark"), [("Stretch (in)", ""), ("Stretch", " in")])
def test_rulers_in_inches_are_read_in_fractions(tmp_path, header, mark):
    cells = ["1 1/2", "1 5/8", "1-3/4", "3", "3 1/64", "3 1/32"]
    rows = [f"{10 + 10 * (i > 2)},{30 * i % 90},{cell}{mark}" for i, cell in enumerate(cells)]
    found = read(tmp_path, "\n".join([f"m (kg),t (min),{header}", *rows]), control="force")
    assert [row[1] for row in found.rows] == pytest.approx([25.4 * x for x in (1.5, 1.625, 1.75, 3, 3.015625, 3.03125)])


def test_a_fraction_of_millimetres_or_of_another_number_is_none(tmp_path):
    for header, cell in (("Stretch (mm)", "1 1/2"), ("Stretch (in)", "1 1/3")):
        rows = [f"{10 + 10 * (i > 2)},{30 * i % 90},{cell if i == 1 else i}" for i in range(6)]
        with pytest.raises(ValueError, match=f"line 3, .*found '{cell}', expected a number"):
            read(tmp_path, "\n".join([f"m (kg),t (min),{header}", *rows]), control="force")


def test_a_plus_before_displacements_alone_may_mean_changes(tmp_path):
    rows = [f"+{x},{t},{f:.2f}" for x, t, f in READINGS]
    text = "\n".join(["x (mm),t (s),F (N)", *rows])
    with pytest.raises(Undecided, match=r"column 1 \(x \(mm\)\): found \+1.0, with a sign as before a change"):
        read(tmp_path, text)
    signed = "\n".join(["x (mm),t (s),F (N)", *(row.replace(",", ",+") for row in rows)])
    printed = "\n".join(["x (mm),t (s),F (N)", *(f"+{x:07.3f},{t},{f:.2f}" for x, t, f in READINGS)])
    assert read(tmp_path, printed).rows[-1][1] == 2.0  # by an instrument
    for said in (read(tmp_path, text, mapping=("x (mm)=displacement [mm]",)), read(tmp_path, signed)):
        assert [row[1] for row in said.rows] == [1.0, 1.0, 1.0, 2.0, 2.0, 2.0]


def test_ten_grams_and_a_day_have_one_name():
    assert quantity_unit("dag", "tension").factor == pytest.approx(0.0980665)
    assert quantity_unit("dag", "time").factor == 86400.0


def test_a_letter_of_weights_is_read_where_no_other_column_is_a_force(tmp_path):
    rows = [f"{x},{t},{f:.2f},{20 + x}" for x, t, f in READINGS]
    for header in ("m (g)", "w (kg)", "P (N)"):
        assert of_readings(read(tmp_path, "\n".join([f"x (mm),t (s),F (N),{header}", *rows]))) == [
            pytest.approx(r) for r in READINGS
        ]
    assert of_readings(read(tmp_path, "\n".join(["x (mm),t (s),P (N),n", *rows]))) == [
        pytest.approx(r) for r in READINGS
    ]


def test_channels_that_are_read_in_turn_are_told_how_and_read(tmp_path):
    """A row has either a displacement or a force."""
    lines = []
    for hold in (1, 2, 3):
        for i in range(40):
            time = 40 * hold + i
            lines.append(f"{time},{hold:.3f}," if i % 2 == 0 else f"{time},,{5 * hold - 0.01 * i:.3f}")
    path = tmp_path / "raw.csv"
    path.write_text("\n".join(["Time (s),Displacement (mm),Force (N)", "39,,0.001", *lines]))
    with pytest.raises(
        InputError, match="line 2, column 2 .*: found an empty cell, .* leave all such rows out by --drop-br"
    ):
        convert(path, ABOUT, Choices())
    made = convert(path, ABOUT, Choices(drop_breaks=True))
    assert [hold.setting for hold in made.experiment.holds] == [1.0, 2.0, 3.0]
    assert made.experiment.holds[0].readings[0] == pytest.approx(4.99)
