"""Specimens whose columns stand side by side, and tables with a column for each time or hold."""

import pytest

import wirebayes as wb
from wirebayes.errors import InputError
from wirebayes.io.bench.about import About
from wirebayes.io.bench.convert import convert
from wirebayes.io.bench.undecided import Choices, Undecided

ABOUT = About("bench", None, 1000.0)
TIMES = (0, 30, 60)


def readings(slope):
    """Displacement, time and tension of a test, in order."""
    return [(h, t, round(slope * h - t / 500, 3)) for h in (1, 2, 3, 4) for t in TIMES]


SOFT, STIFF = readings(1.0), readings(2.0)
COMMON = [f"{t},{x},{a},{x},{b}" for (x, t, a), (_, _, b) in zip(SOFT, STIFF, strict=True)]
APART = [f"{t},{x},{a},{t},{x},{b}" for (x, t, a), (_, _, b) in zip(SOFT, STIFF, strict=True)]
ONE_STROKE = [",".join(row.split(",")[i] for i in (0, 1, 2, 4)) for row in COMMON]
WITH_CLOCK = "Zeit [s],Weg 1 [mm],Kraft 1 [N],Weg 2 [mm],Kraft 2 [N]"


def read(folder, header, rows, **choices):
    path = folder / "bench.csv"
    path.write_text("\n".join([header, *rows]) + "\n")
    return convert(path, ABOUT, Choices(**choices))


def rows_of(made):
    return [tuple(row[1:]) for row in made.rows]


@pytest.mark.parametrize(
    ("header", "rows", "names"),
    [
        (WITH_CLOCK, COMMON, ["bench-1", "bench-2"]),
        ("Time,x1 (mm),F1 (N),x2 (mm),F2 (N)".replace("Time", "Time (s)"), COMMON, ["bench-1", "bench-2"]),
        ("Time (s),Displacement A (mm),Force A (N),Displacement B (mm),Force B (N)", COMMON, ["bench-A", "bench-B"]),
        ("t [s],Extension (mm),Load (N),Extension (mm).1,Load (N).1", COMMON, ["bench-1", "bench-2"]),
        ("t [s],Extension (mm),Load (N),Extension 2 (mm),Load 2 (N)", COMMON, ["bench-1", "bench-2"]),
        ("Time (s),Stroke (mm),Force (N),Time (s),Stroke (mm),Force (N)", APART, ["bench-1", "bench-2"]),
        ("Probe 1,,,Probe 2,,\nZeit,Weg,Kraft,Zeit,Weg,Kraft\ns,mm,N,s,mm,N", APART, ["Probe-1", "Probe-2"]),
        (
            "red,red,red,blue,blue,blue\nTime [s],Extension [mm],Load [N],Time [s],Extension [mm],Load [N]",
            APART,
            ["red", "blue"],
        ),
        (",Roc,,nylon,\nTime [s],Stroke [mm],Load [N],Stroke [mm],Load [N]", COMMON, ["Roc", "nylon"]),
        # columns that a unit alone names
        ("Probe 1,,,Probe 2,,\ns,mm,N,s,mm,N", APART, ["Probe-1", "Probe-2"]),
        ("red,red,red,blue,blue,blue\ns,mm,N,s,mm,N", APART, ["red", "blue"]),
        (",Roc,,nylon,\n[s],[mm],[N],[mm],[N]", COMMON, ["Roc", "nylon"]),
        ("Time,Roc,Roc,nylon,nylon\ns,mm,N,mm,N", COMMON, ["Roc", "nylon"]),
    ],
)
def test_specimens_side_by_side_are_a_test_each(tmp_path, header, rows, names):
    made = read(tmp_path, header, rows)
    assert [each.experiment.name for each in made] == names
    assert [rows_of(each) for each in made] == [SOFT, STIFF]
    assert all("one of several specimens: " in each.notes[0] for each in made)


def test_a_unit_that_is_of_no_quantity_leaves_the_names_as_they_are(tmp_path):
    with pytest.raises(InputError, match="found s a second time"):
        read(tmp_path, "red,,,blue,,\ns,mm,V,s,mm,V", APART)


def test_a_shorter_test_ends_earlier(tmp_path):
    rows = [row if i < 6 else row.rpartition(",")[0].rpartition(",")[0] for i, row in enumerate(COMMON)]
    assert [rows_of(each) for each in read(tmp_path, WITH_CLOCK, rows)] == [SOFT, STIFF[:6]]


def test_one_of_them_is_chosen_by_its_columns(tmp_path):
    for mapping in (("Weg 1 [mm]=ignore", "Kraft 1 [N]=ignore"), ("Kraft 2 [N]=tension", "Weg 2 [mm]=displacement")):
        (second,) = read(tmp_path, WITH_CLOCK, COMMON, mapping=mapping)
        assert rows_of(second) == STIFF and second.experiment.name == "bench"


def test_a_unit_is_asked_for_once_for_all_of_them(tmp_path):
    header = WITH_CLOCK.replace(" [N]", "")
    with pytest.raises(Undecided, match=r"line 1, column 3 \(Kraft of specimen 1\): found no unit") as refused:
        read(tmp_path, header, COMMON)
    assert "--map Kraft=tension [kN]" in refused.value.answers
    made = read(tmp_path, header, COMMON, mapping=("Kraft=tension [kN]",))
    assert [each.rows[0][3] for each in made] == [1000.0, 2000.0]


@pytest.mark.parametrize(
    ("header", "rows"),
    [
        ("Time (s),Roc stroke (mm),Roc load (N),nylon stroke (mm),nylon load (N)", COMMON),
        ("Time (s),Stroke (mm),Load 1 (N),Load 2 (N)", ONE_STROKE),
    ],
    ids=["names that differ by a word", "one displacement"],
)
def test_two_columns_that_may_be_two_sensors_are_asked_about(tmp_path, header, rows):
    with pytest.raises(Undecided, match="each of which may be the tension.* or --specimens several to say which"):
        read(tmp_path, header, rows)
    assert [rows_of(each) for each in read(tmp_path, header, rows, specimens="several")] == [SOFT, STIFF]


def test_two_sensors_of_one_wire_are_not_taken_for_two_wires(tmp_path):
    """Both forces and both displacements agree within .5 % of their range, and are not the same numbers."""

    def of_sensors(apart):
        return [f"{t},{x},{a},{x + 0.001 * (-1) ** i},{a + apart}" for i, (x, t, a) in enumerate(SOFT)]

    with pytest.raises(Undecided, match="nearly the same numbers.* --specimens several or --specimens one"):
        read(tmp_path, WITH_CLOCK, of_sensors(0.0153))  # of a range of 3.12 N: .49 %
    assert len(read(tmp_path, WITH_CLOCK, of_sensors(0.0159))) == 2  # .51 %
    with pytest.raises(Undecided, match="each of which may be the tension"):
        read(tmp_path, WITH_CLOCK, of_sensors(0.0153), specimens="one")


def test_axes_and_stresses_of_one_specimen_are_no_specimens(tmp_path):
    header = "Time (s),Extension (mm),Load (N),Tensile strain (%),Tensile stress (MPa)"
    (only,) = read(tmp_path, header, COMMON)
    assert rows_of(only) == SOFT
    with pytest.raises(Undecided, match="each of which may be the tension"):
        read(tmp_path, WITH_CLOCK.replace("1", "X").replace("2", "Y"), COMMON)


BY_ROW = [f"{h},{','.join(str(f) for x, _, f in SOFT if x == h)}" for h in (1, 2, 3, 4)]
BY_COLUMN = [f"{t},{','.join(str(f) for _, u, f in SOFT if u == t)}" for t in TIMES]


@pytest.mark.parametrize(
    ("header", "rows", "how"),
    [
        ("Weg [mm],Kraft bei 0 s [N],Kraft bei 30 s [N],Kraft bei 60 s [N]", BY_ROW, "a hold in each row"),
        ("Weg [mm],F(0 s) [N],F(30 s) [N],F(60 s) [N]", BY_ROW, "a hold in each row"),
        (",Tension (N),,\nStroke (mm),0 s,30 s,60 s", BY_ROW, "a hold in each row"),
        ("Weg,0 s,30 s,60 s\n[mm],[N],[N],[N]", BY_ROW, "a hold in each row"),
        (",Tension (N),,,\nTime (s),1 mm,2 mm,3 mm,4 mm", BY_COLUMN, "a hold in each column"),
    ],
)
def test_a_table_with_a_column_for_each_time_or_hold_is_read(tmp_path, header, rows, how):
    (made,) = read(tmp_path, header, rows)
    assert rows_of(made) == SOFT
    assert how in made.notes[0]


def test_under_weights_the_cells_of_a_wide_table_are_displacements(tmp_path):
    (made,) = read(tmp_path, ",Dial [mm],,\nMass [kg],0 min,1 min,5 min", ["1,2.1,2.2,2.25", "2,4.2,4.4,4.5"])
    assert made.experiment.control == "force"
    assert [hold.readings.tolist() for hold in made.experiment.holds] == [[2.1, 2.2, 2.25], [4.2, 4.4, 4.5]]
    assert made.experiment.holds[0].time_s.tolist() == [0.0, 60.0, 300.0]


def test_what_a_wide_table_leaves_open_is_asked_with_its_line(tmp_path):
    with pytest.raises(Undecided, match=r"line 1 \(tension\): found no unit") as refused:
        read(tmp_path, "Stroke (mm),0 s,30 s,60 s", BY_ROW)
    answer = "--map tension=tension [kN]"
    assert answer in refused.value.answers
    (made,) = read(tmp_path, "Stroke (mm),0 s,30 s,60 s", BY_ROW, mapping=(answer.removeprefix("--map "),))
    assert made.rows[0][3] == 1000.0
    with pytest.raises(wb.InputError, match=r"line 3, column 3 \(30 s\): found 'n/a', expected a number, or nothing"):
        read(tmp_path, "Stroke (mm),0 s,30 s,60 s", [BY_ROW[0], BY_ROW[1].replace("1.94", "n/a"), *BY_ROW[2:]])


def test_specimens_are_written_each_and_all_together(tmp_path):
    raw = tmp_path / "bench.csv"
    raw.write_text("\n".join([WITH_CLOCK, *COMMON]))
    made = wb.import_bench(raw, length_mm=1000, name="t", material="rope", output=tmp_path / "out")
    assert list(made.summary()["experiments"]) == ["t-1", "t-2"]
    both = wb.read_experiments(tmp_path / "out" / "experiments.toml")
    assert [(e.name, e.material) for e in both] == [("t-1", "rope"), ("t-2", "rope")]
    raw.write_text("\n".join(["a,a,a,A,A,A\nTime [s],Stroke [mm],Load [N],Time [s],Stroke [mm],Load [N]", *APART]))
    names = list(wb.import_bench(raw, length_mm=1000, output=tmp_path / "alike").summary()["experiments"])
    assert names == ["bench-1", "bench-2"]  # no file system tells a from A everywhere


@pytest.mark.parametrize(
    "header",
    ["Weight (kg),1 min,10 min,1 h [mm]", "Weight (kg),ΔL (mm) after 1 min,ΔL (mm) after 10 min,ΔL (mm) after 1 h"],
)
def test_times_across_may_be_in_several_units(tmp_path, header):
    path = tmp_path / "raw.csv"
    rows = [f"{kg},{kg + 0.25:.2f},{kg + 0.5:.2f},{kg + 0.75:.2f}" for kg in (1, 2, 3)]
    path.write_text("\n".join([header.replace(" [mm]", ""), *rows]))
    mapping = ("displacement=displacement [mm]",) if "[mm]" in header else ()
    (made,) = convert(path, ABOUT, Choices(mapping=mapping))
    assert [(row[1], row[2]) for row in made.rows[:3]] == [(1.25, 60.0), (1.5, 600.0), (1.75, 3600.0)]


@pytest.mark.parametrize(
    ("labels", "settings"),
    [
        (("1 mm", "2 mm"), [1.0, 2.0]),
        (("Step 1: 5 mm", "Step 2: 1 cm"), [5.0, 10.0]),
        (("Rope 1 mm", "Rope 2 mm"), None),
    ],
)
def test_holds_side_by_side_under_what_was_set_are_one_test(tmp_path, labels, settings):
    rows = [f"{t},{5 - t / 100},{t if t < 90 else ''},{9 - t / 100 if t < 90 else ''}" for t in (0, 30, 60, 90)]
    path = tmp_path / "raw.csv"
    path.write_text("\n".join([f"{labels[0]},,{labels[1]},", "Time (s),Force (N),Time (s),Force (N)", *rows]))
    if settings is None:  # thicknesses of two ropes
        with pytest.raises(Undecided, match="found no column of displacement"):
            convert(path, ABOUT, Choices())
    else:
        (made,) = convert(path, ABOUT, Choices())
        assert [hold.setting for hold in made.experiment.holds] == settings
        assert [list(hold.readings) for hold in made.experiment.holds] == [[5, 4.7, 4.4, 4.1], [9, 8.7, 8.4]]


@pytest.mark.parametrize(
    "above",
    [
        ["Displacement,Time,Force", "Ch 1,Ch 0,Ch 2", "mm,s,N"],
        ["Displacement,Time,Force", "mm,s,N", "LVDT 50,internal clock,S-beam 500N"],
        ["Test of displacement,at a time,and force", "x (mm),t (s),F (N)"],  # a title above names with units
    ],
)
def test_a_row_of_channels_is_no_header(tmp_path, above):
    path = tmp_path / "raw.csv"
    path.write_text("\n".join([*above, *(f"{x},{t},{5 * x - t / 100}" for x in (1, 2) for t in (0, 30, 60))]))
    (made,) = convert(path, ABOUT, Choices())
    assert [row[1:] for row in made.rows[:2]] == [[1.0, 0.0, 5.0], [1.0, 30.0, 4.7]]


@pytest.mark.parametrize(
    ("settings", "numbers"),
    [
        ((1, 2, 3, 4, 3, 2), (1, 2, 3, 4, 3, 2)),
        ((1, 2, 3, 1), (1, 2, 3, 1)),
        ((1, 2, 3, 1, 2, 3), None),
        ((1, 2, 2, 3), None),
    ],
)
def test_a_column_for_each_hold_may_load_and_unload(tmp_path, settings, numbers):
    """Settings that come again in the order of the first time may be those of another specimen."""
    header = ",Tension (N)\nTime (s)," + ",".join(f"{x} mm" for x in settings)
    rows = [f"{t}," + ",".join(f"{2 * x - t / 100:.2f}" for x in settings) for t in TIMES]
    if numbers is None:
        with pytest.raises(InputError, match="a second time.*is a length or a force with its unit"):
            read(tmp_path, header, rows)
        return
    (made,) = read(tmp_path, header, rows)
    assert [hold.displacement_mm for hold in made.experiment.holds] == [float(x) for x in numbers]


def test_settings_below_a_title_over_all_of_them_are_refused_with_what_to_write(tmp_path):
    with pytest.raises(InputError, match="with its unit: Time .s., 1 mm, 2 mm, 3 mm; and the unit of the readings in"):
        read(tmp_path, "time (s),scale (g) at screw turns", [",1,2,3", "0,10,20,30", "15,9,19,29", "30,8,18,28"])


@pytest.mark.parametrize("name", ["", "Run {}: "])
@pytest.mark.parametrize(("settings", "is_read"), [((1, 2, 3, 2), True), ((1, 2, 3, 1, 2, 3), False)])
def test_runs_side_by_side_may_load_and_unload(tmp_path, name, settings, is_read):
    runs = [name.format(i) for i in range(1, len(settings) + 1)]
    header = ",,".join(f"{x} mm" for x in settings) + ",\n" + ",".join(f"{run}Time (s),{run}Force (N)" for run in runs)
    rows = [",".join(f"{t},{5 * x - t / 100:.2f}" for x in settings) for t in TIMES]
    if not is_read:  # again in the order of the first time: perhaps another specimen's
        with pytest.raises(InputError):
            read(tmp_path, header, rows)
        return
    (made,) = read(tmp_path, header, rows)
    assert [hold.setting for hold in made.experiment.holds] == [float(x) for x in settings]
    assert [hold.readings[1] for hold in made.experiment.holds] == [4.7, 9.7, 14.7, 9.7]


def test_runs_of_which_nothing_says_what_was_set_are_refused_with_what_to_write(tmp_path):
    header = ",".join(f"Run {i}: Time (s),Run {i}: Force (N)" for i in (1, 2, 3))
    rows = [f"{t},{5 - t / 100},{t},{9 - t / 100},{t},{12 - t / 100}" for t in TIMES]
    with pytest.raises(
        InputError, match="found 3 columns of tension, .* and none of displacement, expected a row above"
    ):
        read(tmp_path, header, rows)
    (made,) = read(tmp_path, "1 mm,,2 mm,,3 mm,\n" + header, rows)
    assert [hold.setting for hold in made.experiment.holds] == [1.0, 2.0, 3.0]
