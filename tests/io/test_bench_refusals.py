"""Where a raw file can be read in two ways, or not at all, nothing is guessed: what is said, and what settles it."""

import datetime

import openpyxl
import pytest

import wirebayes as wb
from tests.io.bench_files import convert, convert_all
from wirebayes.cli import main
from wirebayes.io.bench.about import About
from wirebayes.io.bench.undecided import Choices, Undecided

ABOUT = About("wire", "line", 1000.0)
HEADER = "Weg [mm],Zeit [s],Kraft [N]\n"
BODY = "1,0,2.1\n1,30,2.05\n1,60,2.01\n2,0,4.1\n2,30,4.05\n2,60,4.01\n"
THREE_DECIMALS = "1;0;1,234\n1;30;1,205\n1;60;1,111\n2;0;2,345\n2;30;2,222\n2;60;2,111\n"
CLOCK = "Weg [mm],Zeit,Kraft [N]\n" + "".join(
    f"{h},{h - 1}:{t:02d},{h}.{9 - t // 10}\n" for h in range(1, 5) for t in (0, 20, 50)
)
DOWN = "Weg [mm],Zeit [s],Kraft [N]\n-1,0,2.2\n-1,30,2.1\n-2,0,4.1\n-2,30,3.9\n-3,0,6.2\n-3,30,6.0\n"
BOTH_INVERTED = HEADER + "".join(f"{-h},{t},{-3 * h + t / 300}\n" for h in range(1, 6) for t in (0, 30, 60))
PUSH = HEADER + "".join(f"{h},{t},{-2 * h + t / 300}\n" for h in range(1, 6) for t in (0, 30, 60))
TWO_HOLDS = "hold," + HEADER + "1,1,0,2\n1,1,30,1.9\n2,2,60,4\n2,2,90,3.9\n2,2,120,3.8\n"
POSITION = HEADER + "".join(f"{520 + h},{t},{2 * h - t / 300}\n" for h in range(1, 6) for t in (0, 30, 60))


def with_readings(made):
    """The rows of readings, without those that say when a hold ended."""
    return [row for row in made.rows if row[3] is not None]


def read(folder, text, **choices):
    path = folder / "raw.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return convert(path, ABOUT, Choices(**choices))


@pytest.mark.parametrize(
    ("text", "message", "answers"),
    [
        (HEADER.replace(" [N]", "") + BODY, r"line 1, column 3 \(Kraft\): found no unit", "--map Kraft=tension [kgf]"),
        (
            HEADER.replace("Weg [mm]", "Strain") + BODY,
            r"line 1, column 1 \(Strain\): found no unit",
            "--map Strain=displacement [mm/mm]",
        ),
        (
            HEADER.replace("Weg [mm]", "ε (-)") + BODY,
            r"line 1, column 1 \(ε \(-\)\): found no unit",
            "--map ε (-)=displacement [%]",
        ),
        (HEADER.replace(" [s]", "") + BODY, r"line 1, column 2 \(Zeit\): found no unit", "--map Zeit=time [min]"),
        (
            HEADER.replace("\n", ",Kraft 2 [N]\n") + BODY.replace("\n", ",1\n").replace("4.1,1", "4.1,2"),
            r"line 1: found Kraft \[N\] and Kraft 2 \[N\], each of which may be the tension",
            "--map Kraft 2 [N]=tension",
        ),
        (
            HEADER.replace(",", ";") + THREE_DECIMALS,
            r"line 2, column 3 \(Kraft \[N\]\): found '1,234', which is 1.234 or 1234",
            "--decimal comma",
        ),
        (
            HEADER.replace(",", ";") + THREE_DECIMALS.replace(",", "."),
            r"line 2, column 3 \(Kraft \[N\]\): found '1.234', which is 1.234 or 1234",
            "--decimal point",
        ),
        (CLOCK, r"line 2, column 2 \(Zeit\): found '0:00', which is minutes and seconds or", "--map Zeit=time [mm:ss]"),
        (
            TWO_HOLDS,
            r"line 4, column 3 \(Zeit \[s\]\): found 60 s at the first reading of the second",
            "--time-since test",
        ),
        (POSITION, r"line 2, column 1 \(Weg \[mm\]\): found displacements from 521 to 525 mm", "--zero-mm 521"),
    ],
    ids=[
        "force unit",
        "strain unit",
        "no unit in brackets",
        "time unit",
        "two forces",
        "comma",
        "point",
        "clock",
        "times run on",
        "machine position",
    ],
)
def test_two_readings_are_refused_and_an_answer_settles_it(tmp_path, text, message, answers):
    with pytest.raises(Undecided, match=f"raw.csv, {message}.*, expected --") as refused:
        read(tmp_path, text)
    assert answers in refused.value.answers
    before = len(refused.value.answers)
    assert before > 1
    for answer in refused.value.answers:
        path = tmp_path / "raw.csv"
        assert all(made.rows for made in convert_all(path, ABOUT, Choices().with_option(answer)))


def test_each_answer_means_what_it_says(tmp_path):
    rows = read(tmp_path, HEADER.replace(",", ";") + THREE_DECIMALS, decimal="comma").rows
    assert rows[0] == [1, 1.0, 0.0, 1.234]
    rows = read(tmp_path, HEADER.replace(",", ";") + THREE_DECIMALS, decimal="point").rows
    assert rows[0] == [1, 1.0, 0.0, 1234.0]
    assert read(tmp_path, CLOCK, mapping=("Zeit=time [mm:ss]",)).rows[1][2] == 20.0
    assert read(tmp_path, CLOCK, mapping=("Zeit=time [hh:mm]",)).rows[1][2] == 1200.0
    assert [row[2] for row in with_readings(read(tmp_path, TWO_HOLDS, time_since="test"))] == [
        0.0,
        30.0,
        0.0,
        30.0,
        60.0,
    ]
    assert [row[2] for row in read(tmp_path, TWO_HOLDS, time_since="hold").rows] == [0.0, 30.0, 60.0, 90.0, 120.0]
    assert read(tmp_path, POSITION, zero_mm=520.0).rows[0][1] == 1.0
    bare = HEADER.replace(" [N]", "") + BODY
    for mapping, factor in (("Kraft=tension [kN]", 1000.0), ("Kraft [kN]=tension", 1000.0), ("Kraft=tension [N]", 1.0)):
        assert read(tmp_path, bare, mapping=(mapping,)).rows[0][3] == 2.1 * factor
    assert read(tmp_path, PUSH, mapping=("Kraft [N]=tension [-N]",)).rows[0][3] == 2.0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"", "line 1: found an empty file"),
        (BODY, "line 1: found numbers without a header"),
        ("a,b,c\nd,e,f\n", "line 1: found no columns of numbers"),
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\1", "line 1: found binary data"),
        (b"PK\x03\x04 no archive", "found no workbook that can be opened"),
        (HEADER.replace("Kraft", "Weg").replace("[N]", "[mm]") + BODY, "found Weg .mm. a second time"),
        (HEADER + BODY.replace("2.05", "n/a"), r"line 3, column 3 \(Kraft .N.\): found 'n/a', expected a number"),
        (HEADER + BODY.replace("2.05", ""), r"line 3, column 3 \(Kraft .N.\): found an empty cell"),
        (HEADER + BODY.replace("2.05", "2,05"), "line 3, column 4: found 4 cells, expected 3 .*comma as decimal sign"),
        (HEADER + BODY.replace("1,30,", "1,0,"), r"line 3, column 2 \(Zeit .s.\): found 0 s after 0 s in one hold"),
        (HEADER.replace("[N]", "[V]") + BODY, r"line 1, column 3 \(Kraft .V.\): found the unit 'V', expected one of"),
        (HEADER.replace("Zeit [s]", "Kanal 7") + BODY, "line 1: found no column of time among Weg"),
        (PUSH, r"line 14, column 3 .*expected a pull .*with --map \"Kraft \[N\]=tension \[-N\]\""),
        (
            BOTH_INVERTED,
            r"line 14, column 3 .*found -15.0, expected a pull counted positive: change the signs with "
            r"--map \"Weg \[mm\]=displacement \[-mm\]\" --map \"Kraft \[N\]=tension \[-N\]\" \(a slack wire",
        ),
        (DOWN, r"line 2, column 1 .*down to -3 mm, .*with --map \"Weg \[mm\]=displacement \[-mm\]\""),
        (
            "x [mm],t [s],F [N]\n" + "".join(f"{i / 100},{i / 10},{i / 50}\n" for i in range(400)),
            r"line \d+, column 1 \(x .mm.\): found a displacement that stays in \d+ % of the readings",
        ),
        ("hold," + HEADER + "1,1,0,2\n1,1,9,2\n1,7,20,2\n2,2,0,4\n2,2,9,3\n", r"line 4, column 2 .*7 mm in a hold"),
    ],
)
def test_what_cannot_be_read_is_refused_with_its_place(tmp_path, text, message):
    with pytest.raises(wb.InputError, match=message):
        read(tmp_path, text)


def test_compression_counted_positive_is_turned_as_the_message_says(tmp_path):
    turned = read(tmp_path, BOTH_INVERTED, mapping=("Weg [mm]=displacement [-mm]", "Kraft [N]=tension [-N]"))
    assert [turned.rows[i][1:] for i in (0, -1)] == [[1.0, 0.0, 3.0], [5.0, 60.0, 14.8]]


@pytest.mark.parametrize("header", [HEADER, "hold," + HEADER, HEADER.replace("Zeit [s]", "Uhrzeit")])
@pytest.mark.parametrize("of_test", [False, True])
def test_rows_with_the_newest_first_are_refused(tmp_path, header, of_test):
    """Each would be a hold of one reading."""
    rows = []
    for h in (1, 2, 3, 4):
        for i in range(4):
            s = 30 * i + 150 * (h - 1) * of_test
            time = f"10:{s // 60:02d}:{s % 60:02d}" if "Uhrzeit" in header else s
            rows.append(f"{f'{h},' * header.startswith('hold')}{h},{time},{2 * h - i / 10}\n")
    assert len(read(tmp_path, header + "".join(rows)).experiment.holds) == 4
    with pytest.raises(
        wb.InputError, match=r"line 3, column \d \(.*\): found \d+ s after \d+ s, and times that fall in "
    ):
        read(tmp_path, header + "".join(reversed(rows)))


def specimens(header, labels, holds=(1, 2, 3, 4), of_test=False, extra=""):
    """A test for each label, one below the other; `extra` is filled in from hold and reading."""
    rows = []
    for k, label in enumerate(labels):
        for j, h in enumerate(holds):
            for i in range(4):
                time = 30 * i + 150 * (j + len(holds) * k) * of_test
                rows.append(f"{label}{extra.format(h=h, i=i)};{h};{time};{2 * h - i / 10}\n")
    return f"{header};Weg [mm];Zeit [s];Kraft [N]\n" + "".join(rows)


@pytest.mark.parametrize("of_test", [False, True])
@pytest.mark.parametrize(
    ("header", "labels"),
    [("Probe", "AB"), ("Probe", "12"), ("Sample ID", "ABC"), ("Name", ("Draht 1", "Draht 2")), ("Éprouvette n°", "12")],
)
def test_several_specimens_in_a_file_are_not_merged(tmp_path, header, labels, of_test):
    (tmp_path / "raw.csv").write_text(specimens(header, labels, of_test=of_test))
    made = convert_all(tmp_path / "raw.csv", ABOUT, Choices())
    assert [[hold.setting for hold in each.experiment.holds] for each in made] == [[1.0, 2.0, 3.0, 4.0]] * len(labels)
    assert [row[3] for row in made[-1].rows if row[3] is not None] == [
        2 * h - i / 10 for h in (1, 2, 3, 4) for i in range(4)
    ]
    assert len({each.experiment.name for each in made}) == len(labels)
    assert "in lines 18 to 33, columns 2, 3 and 4" in made[1].notes[0]
    for choices in ({"mapping": (f"{header}=ignore",)}, {"specimens": "one"}):
        assert len(read(tmp_path, specimens(header, labels, of_test=of_test), **choices).experiment.holds) == 4 * len(
            labels
        )


def test_words_beside_times_that_begin_again_may_be_specimens_too(tmp_path):
    text = specimens("Bezeichnung", ("red", "blue"))
    with pytest.raises(Undecided, match=r"line 18, column 1 \(Bezeichnung\): found 'blue' after 'red'.* or --spec"):
        read(tmp_path, text)
    made = convert_all(tmp_path / "raw.csv", ABOUT, Choices(specimens="several"))
    assert [each.experiment.name for each in made] == ["red", "blue"]
    merged = [row if i in (0, 1, 17) else ";" + row.partition(";")[2] for i, row in enumerate(text.splitlines())]
    with pytest.raises(Undecided, match=r"line 18, column 1 \(Bezeichnung\): found 'blue' after 'red'"):
        read(tmp_path, "\n".join(merged))
    assert read(tmp_path, specimens("Bezeichnung", ("red", "blue"), of_test=True)).rows


@pytest.mark.parametrize(
    ("header", "labels", "holds", "extra"),
    [
        ("Zyklus", "12", (1, 2, 3, 4), ""),
        ("Zyklus", ("Zyklus 1", "Zyklus 2"), (1, 2, 3, 4), ""),
        ("Kommentar", ("", ""), (1, 2, 3, 4), "at {h} mm"),
        ("Kommentar", ("first", "second"), (1, 2, 3, 4), " at {h} mm"),
        ("Sample", ("", ""), (1, 2, 3, 4), "{h}{i}"),
        ("Probe", "AA", (1, 2, 3, 4), ""),
        ("Phase", ("up", "down"), (1, 2, 3, 4, 3, 2), ""),
        ("Phase", ("up", "down", "up", "down"), (1, 2, 3), ""),
    ],
)
def test_a_column_of_cycles_comments_or_counts_is_named_and_no_more(tmp_path, header, labels, holds, extra):
    text = specimens(header, labels, holds, extra=extra)
    if header == "Phase" and len(labels) == 2:  # one test that goes up and down again, not two
        rows = text.splitlines()[:25]
        text = "\n".join([*rows[:17], *(row.replace("up", "down") for row in rows[17:])])
    assert f"not read: '{header}'" in read(tmp_path, text).notes


def test_columns_that_are_not_read_are_named_in_the_files(tmp_path):
    raw = tmp_path / "raw.csv"
    raw.write_text(HEADER.replace("\n", ",Note,Level [V],Empty\n") + BODY.replace("\n", ",good,7,\n"))
    wb.import_bench(raw, length_mm=1000, output=tmp_path / "out")
    assert "# Not read: 'Note' and 'Level [V]'.\n" in (tmp_path / "out" / "raw.toml").read_text()


@pytest.mark.parametrize("cell", ["", "NaN", "-", "n/a", "#N/A"])
def test_a_missing_reading_is_refused_and_its_row_may_be_deleted(tmp_path, cell):
    with pytest.raises(
        wb.InputError, match=r"line 6, column 3 .*, expected a number.*; where .* missing, delete its row"
    ):
        read(tmp_path, HEADER + BODY.replace("4.05", cell))
    assert len(read(tmp_path, HEADER + BODY.replace("2,30,4.05\n", "")).rows) == 5
    with pytest.raises(
        wb.InputError, match=r"found '4.0S', expected a number \(decimal point, as elsewhere in the file\)$"
    ):
        read(tmp_path, HEADER + BODY.replace("4.05", "4.0S"))


@pytest.mark.parametrize("cell", ["", "NaN", "-", "n/a", "#N/A"])
def test_rows_without_a_reading_are_left_out_where_that_is_said(tmp_path, cell):
    raw = tmp_path / "raw.csv"
    raw.write_text(HEADER + BODY.replace("4.05", cell))
    notes = wb.import_bench(raw, length_mm=1000, drop_breaks=True).summary()["experiments"]["raw"]["notes"]
    assert "left out: 1 row without a reading, from line 6 on" in notes
    kept = read(tmp_path, raw.read_text(), drop_breaks=True).rows
    assert kept == read(tmp_path, HEADER + BODY.replace("2,30,4.05\n", "")).rows
    misprint = HEADER + BODY.replace("4.05", "4.0S")
    with pytest.raises(wb.InputError, match="found '4.0S'"):
        read(tmp_path, misprint, drop_breaks=True)


def test_a_missing_temperature_loses_no_reading(tmp_path):
    text = "Hold,Displacement (mm),Time (s),Force (N),Temperature (C)\n1,1,0,2.0,20\n1,1,30,1.9,\n1,1,60,1.8,20\n"
    with pytest.raises(wb.InputError, match=r"line 3, column 5 \(Temperature \(C\)\): found an empty cell"):
        read(tmp_path, text, drop_breaks=True)


def test_a_displacement_downwards_is_turned_and_one_upwards_from_below_zero_is_read(tmp_path):
    turned = read(tmp_path, DOWN, mapping=("Weg [mm]=displacement [-mm]",))
    assert [row[1] for row in turned.rows[::2]] == [1.0, 2.0, 3.0]
    assert read(tmp_path, DOWN.replace("-1,", "-4,"), zero_mm=-5.0).rows[0][1] == 1.0


@pytest.mark.parametrize(
    ("mapping", "message"),
    [
        ("Kraft [N]=tenson", r"--map: found 'Kraft \[N\]=tenson' \(did you mean tension\?\)"),
        ("Kraft [N]", "expected HEADER=COLUMN"),
        ("Kraftt [N]=tension", r"found no column 'Kraftt \[N\]' \(did you mean Kraft \[N\]\?\)"),
        ("Kraft [N]=tension [mm]", "--map: found the unit 'mm' for Kraft"),
        ("Weg [mm]=tension [N]", "found no column of displacement among"),
    ],
)
def test_a_wrong_mapping_is_refused(tmp_path, mapping, message):
    with pytest.raises(wb.InputError, match=message):
        read(tmp_path, HEADER + BODY, mapping=(mapping,))


def workbook(path, rows, *more):
    book = openpyxl.Workbook()
    for sheet, content in zip([book.active, *(book.create_sheet() for _ in more)], [rows, *more], strict=True):
        for row in content:
            sheet.append(row)
    book.save(path)
    return path


def test_workbooks_with_times_line_breaks_and_several_sheets(tmp_path):
    times = [datetime.time(0, 0, 0), datetime.time(0, 0, 30), datetime.time(0, 1, 0)]
    rows = [
        ["Weg\n[mm]", "Zeit", "Kraft\n[N]"],
        *([h, t, 2.0 * h - 0.1 * i] for h in (1, 2) for i, t in enumerate(times)),
    ]
    path = workbook(tmp_path / "a.xlsx", rows, [["notes"]])
    assert [row[2] for row in convert(path, ABOUT, Choices()).rows] == [0.0, 30.0, 60.0] * 2
    path = workbook(tmp_path / "b.xlsx", rows, rows)
    with pytest.raises(Undecided, match="found readings in 2 sheets") as refused:
        convert(path, ABOUT, Choices())
    assert list(refused.value.answers) == ["--sheet Sheet", "--sheet Sheet1"]
    assert convert(path, ABOUT, Choices(sheet="Sheet1")).rows
    rows[2][2] = "#DIV/0!"
    path = workbook(tmp_path / "c.xlsx", rows)
    with pytest.raises(wb.InputError, match=r"line 3, column C \(Kraft \[N\]\): found '#DIV/0!', expected a number"):
        convert(path, ABOUT, Choices())


@pytest.mark.parametrize("gap", [",0:30,,phone rang", "0.25,0:30,", ",0:30,"])
def test_a_reading_that_is_missing_early_does_not_hide_the_header(tmp_path, gap):
    rows = ["0.25,0:00,2.05", ",0:15,1.89", gap, ",1:00,1.74", ",2:00,1.62"]
    text = "Nylon of 3 May\nStretch (in),Elapsed (min:sec),Pull (lbf),Comment\n" + "\n".join(rows)
    with pytest.raises(wb.InputError, match=r"line 5, column 3 \(Pull \(lbf\)\): found an empty cell"):
        read(tmp_path, text)


def test_lines_of_words_between_readings_and_statistics_below_them_are_left_out_and_said(tmp_path):
    first, second = (["10\t0\t11", "10\t60\t10", "10\t120\t9.5"], ["20\t0\t18", "20\t60\t17.5", "20\t120\t17"])
    lines = ["Stretch mm\ts\tForce (N)", "Cycle 1", *first, "Cycle 2", *second, "", "Mean\t\t13.8", "Max\t90\t18"]
    found = read(tmp_path, "\n".join(lines), mapping=("s=time [s]",))
    assert "lines 6 (Cycle 2), 11 (Mean) and 12 (Max) left out: words or statistics in place of readings" in found.notes
    assert [hold.readings.tolist() for hold in found.experiment.holds] == [[11.0, 10.0, 9.5], [18.0, 17.5, 17.0]]


def test_a_word_among_the_readings_is_no_statistic(tmp_path):
    """A statistic stands below all readings; a reading that is no number is refused wherever it stands."""
    rows = ["10,0,11", "Mean,60,10", "10,120,9.5", "20,0,18", "20,60,17.5", "20,120,NaN"]
    with pytest.raises(wb.InputError, match=r"line 3, column 1 .*found 'Mean', expected a number"):
        read(tmp_path, "Displacement (mm),Time (s),Force (N)\n" + "\n".join(rows))
    rows[1] = "10,60,10"
    with pytest.raises(wb.InputError, match=r"line 7, column 3 .*found 'NaN', expected a number"):
        read(tmp_path, "Displacement (mm),Time (s),Force (N)\n" + "\n".join(rows))


@pytest.mark.parametrize(("begins", "said"), [(269, False), (271, True)])
def test_holds_that_go_on_long_after_their_last_readings_are_named(tmp_path, begins, said):
    """Longer than half of what was read, and than 1.5 of its pauses: it may be a rest that is not in the file."""
    first = [f"{t},5,{10 + t / 100}" for t in (0, 60, 120, 180)]
    second = [f"{begins + t},10,{20 + t / 100}" for t in (0, 60, 120, 180)]
    text = "Time (s),Weight (kg),Elongation (mm)\n" + "\n".join(first + second)
    notes = read(tmp_path, text, time_since="test").notes
    assert any("hold 1: the next one begins up to 1.52 min after the last reading" in note for note in notes) == said
    longer_pause = text.replace(f"{first[2]}\n", "")
    assert not any("the next one begins" in note for note in read(tmp_path, longer_pause, time_since="test").notes)


@pytest.mark.parametrize("sign", [";", ","])
def test_units_that_are_not_known_are_asked_into_the_header(tmp_path, sign):
    lines = [["Step", "Stretch", "Time", "Pull"], ["1", "4 cl", "0 x", "11.02 V"], ["1", "4 cl", "10 x", "10.48 V"]]
    with pytest.raises(wb.InputError, match="expected numbers alone in the cells, not '4 cl', and their units in the"):
        read(tmp_path, "\n".join(map(sign.join, lines)))


def test_a_unit_in_the_cells_of_one_column_is_asked_into_the_header(tmp_path):
    text = HEADER + BODY.replace("4.05", "4.05 N")
    with pytest.raises(wb.InputError, match=r"found '4.05 N', expected a number alone, and its unit in the header$"):
        read(tmp_path, text)


def test_clocks_that_count_from_1970_keep_their_milliseconds(tmp_path):
    rows = "".join(f"{1781431200123 + t},2,{5 - t / 1e4}\n" for t in (0, 7, 1008, 30009))
    found = read(tmp_path, "Time (ms),x (mm),Force (N)\n" + rows, time_since="test")
    assert [row[2] for row in found.rows] == pytest.approx([0.0, 0.007, 1.008, 30.009], abs=1e-6)


def test_a_record_of_tension_over_time_needs_a_column_of_its_displacement(tmp_path):
    rows = "\n".join(f"{t},{10 - t / 10}" for t in range(1, 6))
    with pytest.raises(Undecided, match="to a hold at one displacement add a column with it, the same in every row$"):
        read(tmp_path, f"t/s,F/N\n{rows}")


def test_a_weight_written_once_for_each_hold_is_filled_from_above(tmp_path):
    rows = ["0,5,10.1", "60,,10.4", "120,,10.5", "180,10,20.0", "240,,20.6", "300,,20.7"]
    found = read(tmp_path, "Time (s),Weight (kg),Elongation (mm)\n" + "\n".join(rows), time_since="test")
    assert "4 empty cells of hold or weight filled with the value above them" in found.notes
    assert [len(hold.readings) for hold in found.experiment.holds] == [3, 3]
    assert [hold.setting for hold in found.experiment.holds] == pytest.approx([5 * 9.80665, 10 * 9.80665])


@pytest.mark.parametrize(
    "rows",
    [
        ["0,5,10.1", "60,4.9,10.1", "120,,10.1", "180,10,20.0", "240,9,20.0", "300,,20.0"],  # readings that are missing
        ["0,5,10.1", "60,,10.1", "120,,10.1", "180,10,20.0", "240,,20.0", "300,,20.0"],  # displacements that were set
        [
            "0,,10.1",
            "60,5,10.4",
            "120,,10.5",
            "180,10,20.0",
            "240,,20.6",
            "300,,20.7",
        ],  # nothing to fill the first from
    ],
)
def test_a_missing_tension_is_not_filled(tmp_path, rows):
    with pytest.raises(wb.InputError, match="found an empty cell"):
        read(tmp_path, "Time (s),Force (N),Displacement (mm)\n" + "\n".join(rows))


def test_a_crosshead_and_an_extensometer_are_two_displacements(tmp_path):
    rows = ["0,4.055,4.000,11.0", "10,4.052,4.000,10.5", "0,8.1,8.0,21.0", "10,8.1,8.0,20.5"]
    text = "Time (s),Crosshead (mm),Extensometer (mm),Force (N)\n" + "\n".join(rows)
    with pytest.raises(
        Undecided, match=r"found Crosshead \(mm\) and Extensometer \(mm\), each of which may be the disp"
    ):
        read(tmp_path, text)
    found = read(tmp_path, text, mapping=("Extensometer (mm)=displacement",))
    assert [hold.setting for hold in found.experiment.holds] == [4.0, 8.0]


def test_moments_of_a_day_pass_midnight(tmp_path):
    rows = ["23:59:00;1;2", "23:59:30;1;1,9", "00:00:10;2;4", "00:00:40;2;3,9", "00:01:10,5;2;3,8"]
    found = with_readings(read(tmp_path, "Uhrzeit;Weg [mm];Kraft [N]\n" + "\n".join(rows)))
    assert [row[2] for row in found] == [0.0, 30.0, 0.0, 30.0, 60.5]


def test_a_clock_without_dates_goes_on_the_next_morning(tmp_path):
    """Of a weight changed every morning, and read through the day."""
    rows = [f"{hour}:00:00,{5 + 5 * day},{10 + day}.{hour}" for day in range(3) for hour in ("08", "09", "17")]
    text = "Time,Weight (kg),Elongation (mm)\n" + "\n".join(rows)
    found = read(tmp_path, text)
    assert "the clock passes midnight 2 times" in found.notes
    assert [hold.duration_s for hold in found.experiment.holds] == [86400.0, 86400.0, 32400.0]
    first, second = read(tmp_path, text.replace(",10,", ",5,")).experiment.holds
    assert first.time_s.tolist() == [0.0, 3600.0, 32400.0, 86400.0, 90000.0, 118800.0]
    assert (first.duration_s, second.duration_s) == (172800.0, 32400.0)


@pytest.mark.parametrize(("first", "goes_on"), [("3:00:00", False), ("3:00:01", True)])
def test_a_clock_that_begins_no_later_than_its_readings_are_apart_may_start_again(tmp_path, first, goes_on):
    """One hour is the least time between readings; three times as much is the most that counts as a beginning."""
    rows = [f"{time},{weight},{weight}.{time[0]}" for weight in (5, 10) for time in (first, "4:00:01", "5:00:01")]
    found = read(tmp_path, "Time,Weight (kg),Elongation (mm)\n" + "\n".join(rows))
    assert any("passes midnight" in note for note in found.notes) == goes_on
    assert any("time starts again at the beginning of hold 2" in note for note in found.notes) != goes_on


@pytest.mark.parametrize(("again", "goes_on"), [("02:00:00", False), ("01:59:59", True)])
def test_a_clock_that_is_put_back_by_an_hour_is_no_new_day(tmp_path, again, goes_on):
    rows = [f"{time},5,5.{i}" for i, time in enumerate(("02:58:00", "02:59:00", "03:00:00"))]
    rows += [f"{time},10,10.{i}" for i, time in enumerate((again, "02:01:00", "02:02:00"))]
    found = read(tmp_path, "Time,Weight (kg),Elongation (mm)\n" + "\n".join(rows))
    assert any("passes midnight 1 time" in note for note in found.notes) == goes_on


@pytest.mark.parametrize(
    "moments",
    [
        ("2026-06-14T23:59:00Z", "2026-06-14T23:59:30Z", "2026-06-15T00:00:10Z", "2026-06-15T00:00:40.5Z"),
        ("2026-10-25T2:59:00+02:00", "2026-10-25T2:59:30+0200", "2026-10-25 2:00:10 +01:00", "2026-10-25 2:00:40.5+01"),
        ("06/14/2026 11:59:00 PM", "06/14/2026 11:59:30 PM", "06/15/2026 12:00:10 AM", "06/15/2026 12:00:40.5 AM"),
        ("11:59:00 am", "11:59:30 am", "12:00:10 p.m.", "12:00:40.5 p.m."),
        ("11:59:00 PM", "11:59:30 PM", "12:00:10 AM", "12:00:40.5 AM"),
        ("14-06-2026 10:00:00", "14-06-2026 10:00:30", "14-06-2026 10:01:10", "14-06-2026 10:01:40.5"),
        ("05-06-2026 10:00:00", "05-06-2026 10:00:30", "05-06-2026 10:01:10", "05-06-2026 10:01:40.5"),
        ("12/06/2026 23:59:00", "12/06/2026 23:59:30", "13/06/2026 0:00:10", "13/06/2026 0:00:40.5"),
        ("31-Dec-2025 23:59:00", "31-Dec-2025 23:59:30", "1-Jan-2026 0:00:10", "1-Jan-26 0:00:40.5"),
        ("30. Mai 2026 23:59:00", "30. Mai 2026 23:59:30", "31. Mai 2026 0:00:10", "31. Mai 2026 0:00:40,5"),
        ("20260614 10:00:00", "20260614 10:00:30", "20260614 10:01:10", "20260614T10:01:40.5"),
        ("2026/06/14 10:00:00", "2026/06/14 10:00:30", "2026/06/14 10:01:10", "2026/06/14 10:01:40.5"),
    ],
)
def test_dates_of_many_countries_are_the_same_times(tmp_path, moments):
    begin, *others, end = moments
    times = (begin, *others, end, *others, end)
    rows = "".join(f"{m};{h};{h};{2 * h}\n" for m, h in zip(times, (1, 1, 2, 2, 3, 4, 4), strict=True))
    found = with_readings(read(tmp_path, "Timestamp;Stufe;Weg [mm];Kraft [N]\n" + rows))
    assert [row[2] for row in found] == [0.0, 30.0, 0.0, 30.5, 0.0, 0.0, 30.5]


@pytest.mark.parametrize("moments", ["2026-06-14 9:59|2026-06-14 10:00", "11:59 AM|12:00 PM", "12:59 AM|1:00 AM"])
def test_minutes_of_a_date_or_of_half_a_day_are_no_question(tmp_path, moments):
    first, last = moments.split("|")
    rows = f"{first};1;1;2\n{last};1;1;1.9\n{first};2;2;4\n{last};2;2;3.9\n{last};3;3;6\n"
    found = read(tmp_path, "Timestamp;Stufe;Weg [mm];Kraft [N]\n" + rows, time_since="test").rows
    assert [row[2] for row in found] == [0.0, 60.0, 0.0, 60.0, 0.0]


@pytest.mark.parametrize(
    ("first", "last", "message"),
    [
        ("14 juin 2026 10:00:00", "14 juin 2026 10:00:30", "found '14 juin .*0', expected a time such as .*31-May"),
        ("05/06/2026 10:00:00", "06/06/2026 10:00:30", "found '05/06/2026', which may begin with the day or"),
        ("14/06/2026 10:00:00", "06/15/2026 10:00:30", "found '14/06/2026', expected a date such as 2024-05-31"),
        ("14/14/2026 10:00:00", "14/14/2026 10:00:30", "found '14/14/2026', expected a date such as 2024-05-31"),
        ("13:00:00 PM", "01:00:30 PM", "found '13:00:00 PM', expected a time such as 0:01:30 or 10:01:30 AM"),
        ("2026-06-14 10:00:00", "10:00:30", "found '10:00:30', expected a time with a date, as in the lines"),
        ("2026-06-14 10:00:00", "2026-06-14 10:00:30Z", "found .*30Z', expected a time without an offset from UTC, as"),
        ("2026-06-14", "2026-06-14", "found '2026-06-14', expected a time such as"),
    ],
)
def test_dates_that_are_not_clear_are_refused_with_those_that_are(tmp_path, first, last, message):
    for header in ("Timestamp", "Timestamp [s]") if "juin" in first else ("Timestamp",):
        with pytest.raises(wb.InputError, match=rf"line \d, column 1 \(Timestamp.*\): {message}"):
            read(tmp_path, f"{header};Weg [mm];Kraft [N]\n{first};1;2\n{last};1;1.9\n{last};2;4\n{last};2;4.1\n")


def test_what_is_harmless_is_done_and_said(tmp_path):
    text = "Stufe,Weg [mm],Zeit [s],Kraft [N]\n1,1,0,2.1\n,,30,2\n,,30,2\n,,60,1.9\n4,2,0,4\n,,30,3.9\nend of test\n"
    found = read(tmp_path, text)
    assert len(found.rows) == 5
    message = " ".join(found.notes)
    for note in (
        "filled with the value above",
        "repeat the row above left out: 1",
        "1 line under the readings",
        "holds 2 and 3 have no readings",
    ):
        assert note in message
    assert found.recording is None


def test_resolution_is_written_only_where_it_is_evident(tmp_path):
    def resolution(values, unit="N"):
        rows = [f"{1 + i // 5},{i % 5},{value}" for i, value in enumerate(values)]
        return read(tmp_path, HEADER.replace("[N]", f"[{unit}]") + "\n".join(rows)).experiment.resolution_N

    steady = [f"{2 + 0.37 * i:.2f}" for i in range(30)]
    assert resolution(steady) == 0.01
    assert resolution(steady, "kgf") == pytest.approx(0.0980665)
    assert resolution([f"{2 + 0.06 * ((7 * i) % 40):.2f}" for i in range(30)]) == 0.02
    assert resolution(steady[:8]) == 0.0  # too few to tell
    assert resolution([*steady[:20], "4.5678", *steady[20:]]) == 0.0  # one of more digits
    assert resolution([f"{2 + i / 7:.15f}" for i in range(30)]) == 0.0  # computed, not displayed


def test_the_command_refuses_in_one_line_and_leaves_nothing(tmp_path, capsys):
    raw = tmp_path / "raw.csv"
    raw.write_text(HEADER.replace(" [N]", "") + BODY)
    arguments = ["import", str(raw), "--output", str(tmp_path / "out"), "--length-mm", "1000"]
    assert main(arguments) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err.count("\n") == 1
    assert '--map "Kraft=tension [N]"' in shown.err
    assert not (tmp_path / "out").exists()
    assert main([*arguments, "--map", "Kraft [N]=tension"]) == 0
    assert "2 holds, 6 readings" in capsys.readouterr().out
    assert len(wb.read_experiments(tmp_path / "out" / "raw.toml")) == 1


def test_a_person_is_asked_and_the_answer_holds(tmp_path):
    raw = tmp_path / "raw.csv"
    raw.write_text(HEADER.replace(" [N]", "").replace(" [s]", "") + BODY)
    questions = []

    def ask(question):
        questions.append(question.question)
        return list(question.answers)[0]

    with pytest.raises(
        Undecided, match="--map .Zeit=time .s.*; besides, undecided: line 1, column 3 .Kraft.: found no"
    ):
        wb.import_bench(raw, length_mm=1000)
    imported = wb.import_bench(raw, length_mm=1000, ask=ask)
    assert questions == ["the unit of time", "the unit of tension"]
    assert imported.experiments[0].tension()[0, 0] == 2.1


def test_a_column_that_is_chosen_may_still_be_asked_for_its_unit(tmp_path):
    raw = tmp_path / "raw.csv"
    raw.write_text(HEADER.replace("Kraft [N]", "Kraft 1,Kraft 2") + BODY.replace("\n", ",1\n"))
    answers = ["--map Kraft 1=tension", "--map Kraft 1=tension [kN]"]
    imported = wb.import_bench(raw, length_mm=1000, ask=lambda question: answers.pop(0))
    assert imported.experiments[0].tension()[0, 0] == 2100.0


@pytest.mark.parametrize(("unit", "first_mm"), [("mm/mm", 1000.0), ("%", 10.0), ("mm", 1.0)])
def test_a_strain_without_a_unit_is_read_as_what_it_is_said_to_be(tmp_path, unit, first_mm):
    text = HEADER.replace("Weg [mm]", "Strain") + BODY
    made = read(tmp_path, text, mapping=(f"Strain=displacement [{unit}]",))
    assert with_readings(made)[0][1] == first_mm


def test_a_displacement_stands_before_a_strain_without_a_unit(tmp_path):
    text = HEADER.replace("Weg [mm]", "Weg [mm],Strain") + BODY.replace("1,", "1,0.001,", 3).replace("2,", "2,0.002,")
    assert with_readings(read(tmp_path, text))[0][1] == 1.0
