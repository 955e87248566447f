"""Files as benches of all countries write them: code pages, LabVIEW, strains and stresses, repeated columns."""

import numpy as np
import pytest

import wirebayes as wb
from tests.io.bench_files import convert
from wirebayes.io.bench.about import About
from wirebayes.io.bench.undecided import Choices, Undecided

ROWS = [(h, 30 * i, 2.0 * h - 0.1 * i) for h in (1, 2, 3) for i in range(4)]


def read(path, about=None, **choices):
    return convert(path, about or About("wire", "line", 1000.0), Choices(**choices))


def body(sign=",", decimal="."):
    return "".join(sign.join(f"{v:.2f}".replace(".", decimal) for v in row) + "\n" for row in ROWS)


@pytest.mark.parametrize(
    ("encoding", "header"),
    [
        ("gb18030", "位移(mm),时间(s),力(N)"),
        ("gbk", "伸长(毫米),时间(秒),拉力(牛)"),
        ("shift_jis", "変位(mm),時間(s),荷重(N)"),
        ("shift_jis", "ストローク(mm),時間(s),試験力(N)"),
        ("euc_kr", "변위(mm),시간(s),하중(N)"),
        ("big5", "位移(mm),時間(s),拉力(N)"),
        ("cp1252", "Förlängning [mm];Tid [s];Kraft [N]"),
        ("cp1252", "Siirtymä [mm];Aika [s];Voima [N]"),
        ("cp1250", "Posunutí [mm];Čas [s];Síla [N]"),
        ("cp1254", "Uzama [mm];Zaman [s];Kuvvet [N]"),
        ("cp1251", "Перемещение (мм),Время (с),Нагрузка (Н)"),
        ("koi8-r", "Удлинение [мм],Время [сек],Усилие [Н]"),
        ("cp866", "Ход, мм;Время, с;Сила, Н"),
        ("cp1252", "Verlängerung [mm],Prüfzeit [s],Kraft [N]"),
        ("latin-1", "Déplacement (mm),Durée (s),Force (N)"),
        ("cp1250", "wydłużenie [mm],czas [s],obciążenie [N]"),
        ("utf-8", "位移(mm),时间(s),力(N)"),
        ("utf-16", "変位(mm),時間(s),荷重(N)"),
    ],
)
def test_headers_in_the_code_pages_of_many_countries_are_read(tmp_path, encoding, header):
    path = tmp_path / "raw.csv"
    path.write_bytes((header + "\n" + body(";" if ";" in header else ",")).encode(encoding))
    made = read(path)
    assert [row[3] for row in made.rows] == [pytest.approx(f) for _, _, f in ROWS]
    assert ("GB18030" in made.notes[0]) == (encoding in ("gb18030", "gbk"))


def test_a_file_in_no_known_words_says_how_it_was_read(tmp_path):
    path = tmp_path / "raw.csv"
    path.write_bytes(("ŝovo (mm),horloĝo (s),tiro (N)\n" + body()).encode("iso8859-3"))
    with pytest.raises(wb.InputError, match="the file is not UTF-8 and was read as CP1252: if names look wrong, save"):
        read(path)
    path.write_text("gap (mm),when (s),pulling (N)\n" + body())
    named = r'--map "gap \(mm\)=displacement" --map "when \(s\)=time" --map "pulling \(N\)=tension"$'
    with pytest.raises(wb.InputError, match=named):  # what each unit says; the user decides
        read(path)
    path.write_text("gap (mm),width (mm),when (s),pulling (N)\n" + body())
    with pytest.raises(wb.InputError, match=r'"HEADER=displacement \[mm\]".*if the name has one\)$'):
        read(path)


@pytest.mark.parametrize("header", ["Minutes at load", "minutes", "Minuten", "hours since the step"])
def test_a_time_may_begin_with_its_unit(tmp_path, header):
    path = tmp_path / "raw.csv"
    path.write_text(
        f"{header},Stage,Extension (mm),Load (kN)\n"
        + "".join(
            f"{minute},{stage},{stage},{stage + 0.1 / (1 + minute)}\n" for stage in (1, 2) for minute in (0, 1, 3)
        )
    )
    scale = 3600.0 if "hours" in header else 60.0
    assert [row[2] for row in read(path).rows] == [0.0, scale, 3.0 * scale] * 2


def test_all_columns_that_are_missing_are_said_at_once(tmp_path):
    path = tmp_path / "raw.csv"
    path.write_text("CH1,CH2,CH3\n" + body())
    expected = (
        r"found no column of displacement, time or tension among CH1, CH2, CH3, expected one of each; say which with "
        r"--map \"HEADER=displacement \[mm\]\" --map \"HEADER=time \[s\]\" --map \"HEADER=tension \[N\]\""
    )
    with pytest.raises(wb.InputError, match=expected):
        read(path)


def measurement(sign="\t", decimal=".", units="mm\tN", segments=1, comment=True):
    """An LVM file with the preamble of the file and one of its channels."""
    head = [
        "LabVIEW Measurement",
        "Writer_Version\t2",
        f"Separator\t{'Tab' if sign == chr(9) else 'Comma'}",
        f"Decimal_Separator\t{decimal}",
        "X_Columns\tOne",
        "***End_of_Header***",
    ]
    channels = [
        "",
        "Channels\t2",
        "Samples\t12\t12",
        "Date\t2019/05/06\t2019/05/06",
        "Time\t10:11:12.3\t10:11:12.3",
        *([f"Y_Unit_Label\t{units}"] if units else []),
        "X_Dimension\tTime\tTime",
        "X0\t0.0\t0.0",
        "Delta_X\t0.1\t0.1",
        "***End_of_Header***",
        "X_Value\tPosition\tForce" + "\tComment" * comment,
    ]
    size = len(ROWS) // segments
    lines = head
    for k in range(segments):
        rows = ROWS[k * size : (k + 1) * size]
        lines = lines + channels + ["\t".join([f"{t + 200 * h:.6f}", f"{h:.4f}", f"{f:.5f}"]) for h, t, f in rows]
    return "\n".join(line.replace(".", decimal) if line[:1].isdigit() else line for line in lines).replace("\t", sign)


@pytest.mark.parametrize(
    "options", [{}, {"segments": 3}, {"decimal": ","}, {"sign": ","}, {"comment": False}, {"units": "m\tkN"}]
)
def test_a_labview_measurement_is_read_with_the_units_of_its_preamble(tmp_path, options):
    path = tmp_path / "raw.lvm"
    path.write_text(measurement(**options))
    made = read(path, About("wire", "line", 1e6))
    factor = 1000.0 if "m\tkN" in options.values() else 1.0
    assert [row[3] for row in made.rows if row[3] is not None] == pytest.approx([factor * f for *_, f in ROWS])
    assert [hold.setting for hold in made.experiment.holds] == [factor, 2 * factor, 3 * factor]


def test_a_labview_measurement_without_units_asks_for_them(tmp_path):
    path = tmp_path / "raw.lvm"
    path.write_text(measurement(units=""))
    with pytest.raises(Undecided, match=r"line 16, column 2 \(Position\): found no unit, expected --map"):
        read(path)
    assert read(path, mapping=("Position=displacement [mm]", "Force=tension [N]")).rows


def table(path, header, units, *columns, sign=","):
    lines = [sign.join(header), *([sign.join(units)] if units else [])]
    path.write_text("\n".join(lines + [sign.join(f"{v:.10g}" for v in row) for row in zip(*columns, strict=True)]))
    return path


X, T, F = (np.array(column, float) for column in zip(*ROWS, strict=True))


@pytest.mark.parametrize(
    ("name", "unit", "factor"),
    [("Tensile strain (Extension)", "%", 5.0), ("Strain", "mm/mm", 500.0), ("Dehnung", "‰", 0.5), ("ε", "µm/m", 5e-4)],
)
def test_a_strain_is_a_displacement_only_where_there_is_no_other(tmp_path, name, unit, factor):
    about = About("wire", "line", 500.0)
    both = table(tmp_path / "a.csv", ["Time", "Extension", "Load", name], ["s", "mm", "N", unit], T, X, F, X / 5)
    made = read(both, about)
    assert "not read" in " ".join(made.notes)
    assert [hold.setting for hold in made.experiment.holds] == [1.0, 2.0, 3.0]
    alone = table(tmp_path / "b.csv", [f"{name} ({unit})", "Time (s)", "Load (N)"], [], X / factor, T, F)
    made = read(alone, about)
    assert [hold.setting for hold in made.experiment.holds] == pytest.approx([1.0, 2.0, 3.0])
    assert "(times the length)" in made.notes[0]


@pytest.mark.parametrize(("unit", "factor"), [("MPa", 1.0), ("N/mm²", 1.0), ("kPa", 1e-3), ("GPa", 1e3), ("psi", None)])
def test_a_stress_is_a_tension_with_the_area_of_the_sample(tmp_path, unit, factor):
    path = table(tmp_path / "a.csv", ["Extension (mm)", "Time (s)", f"Tensile stress ({unit})"], [], X, T, F)
    with pytest.raises(wb.InputError, match=r"line 1, column 3 .*: found a stress in .*, expected --area-mm2 A"):
        read(path)
    made = read(path, About("wire", "line", 1000.0, 0.25))
    factor = 0.00689475729317 if factor is None else factor
    assert [row[3] for row in made.rows] == pytest.approx(F * factor / 4)
    spelt = table(tmp_path / "c.csv", ["x (mm)", "t/s", f"sigma/{unit}"], [], X, T, F)
    assert len(read(spelt, About("wire", "line", 1000.0, 0.25)).rows) == len(F)
    beside = table(tmp_path / "b.csv", ["x (mm)", "Time (s)", "Stress (MPa)", "Load (N)"], [], X, T, 7 * F, F)
    assert [row[3] for row in read(beside).rows] == pytest.approx(F)


@pytest.mark.parametrize("unit", ["mm/min", "V", "N/tex", "mV/V", "Nm"])
@pytest.mark.parametrize("row", [False, True])
def test_a_column_in_a_unit_of_something_else_is_none_of_the_columns(tmp_path, unit, row):
    names = ["Extension", "Time", "Load", "Crosshead travel", "Load cell 2"]
    units = ["mm", "s", "N", unit, unit]
    header = names if row else [f"{n} ({u})" for n, u in zip(names, units, strict=True)]
    made = read(table(tmp_path / "a.csv", header, units if row else [], X, T, F, X + 1, F + 1))
    assert [row[3] for row in made.rows] == pytest.approx(F)


def test_columns_with_the_same_numbers_are_one_and_others_are_asked_about(tmp_path):
    header = ["Extension (mm)", "Time (s)", "Load (N)", "Tensile extension (mm)", "Force (N)"]
    notes = read(table(tmp_path / "a.csv", header, [], X, T, F, X, F)).notes
    same = "'Tensile extension (mm)' (the same numbers as 'Extension (mm)') and 'Force (N)' (the same numbers as"
    assert f"not read: {same} 'Load (N)')" in notes
    with pytest.raises(Undecided, match=r"found Extension \(mm\) and Tensile extension \(mm\), each of which may be"):
        read(table(tmp_path / "a.csv", header, [], X, T, F, X + 0.01, F))


RUNNING = T + 200.0 * X


@pytest.mark.parametrize(
    ("others", "read_from"),
    [
        ([("Step time (s)", T)], "Time (s)"),
        ([("Elapsed (min)", np.round(RUNNING / 60, 1))], "Time (s)"),
        ([("Elapsed (ms)", RUNNING * 1000 + 7)], "Elapsed (ms)"),
        ([("Elapsed (h)", RUNNING / 3600)], "Elapsed (h)"),
    ],
)
def test_clocks_that_tell_the_same_are_one(tmp_path, others, read_from):
    header = ["Time (s)", "Extension (mm)", "Load (N)", *(name for name, _ in others)]
    made = read(table(tmp_path / "a.csv", header, [], RUNNING, X, F, *(values for _, values in others)))
    assert f"time from '{read_from}'" in made.notes[0]
    assert [row[2] for row in made.rows if row[3] is not None] == pytest.approx(T)


@pytest.mark.parametrize("wrong", [RUNNING * 1.02, RUNNING + 90.0 * (X > 2) * (T > 40)])
def test_clocks_that_part_are_asked_about_with_the_line(tmp_path, wrong):
    path = table(
        tmp_path / "a.csv", ["Time (s)", "Extension (mm)", "Load (N)", "Elapsed (s)"], [], RUNNING, X, F, wrong
    )
    with pytest.raises(
        Undecided, match=r"found Time \(s\) and Elapsed \(s\), which tell different times from line \d+"
    ):
        read(path)
    assert read(path, mapping=("Time (s)=time", "Elapsed (s)=ignore")).rows


@pytest.mark.parametrize("ranges", ["50 mm;;500 N", "50 mm;600 s;500 N", "±50 mm;;0,5 kN"])
def test_ranges_of_sensors_under_their_names_are_no_header(tmp_path, ranges):
    path = tmp_path / "raw.csv"
    path.write_text(f"Export\n\nWegaufnehmer [mm];Zeit [s];Kraftaufnehmer [N]\n{ranges}\n" + body(";", ","))
    assert [row[3] for row in read(path).rows] == [pytest.approx(f) for _, _, f in ROWS]


@pytest.mark.parametrize("above", ["Kraft [N];Zeit", "Kraft [N];Kraft [N];Kraft [N];Kraft [N]"])
def test_settings_of_columns_are_no_ranges(tmp_path, above):
    """Fewer names above them, or one name for all."""
    path = tmp_path / "raw.csv"
    path.write_text(f"{above}\n0 s;1 mm;2 mm;3 mm\n" + "0;5,1;9,2;12,3\n30;5,0;9,1;12,2\n60;4,9;9,0;12,1\n")
    with pytest.raises(wb.InputError, match="line 2: "):
        read(path)
