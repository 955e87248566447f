"""Shapes that programs write: parts of seconds apart, errors beside quantities, cells guarded from spreadsheets."""

import pytest

import wirebayes as wb
from tests.io.bench_files import convert
from wirebayes.io.bench.about import About
from wirebayes.io.bench.undecided import Choices, Undecided

ABOUT = About("wire", "line", 1000.0)
ROWS = [(70.0 * hold + t, hold + 1.0, 10 * hold + 9 - t / 100) for hold in range(4) for t in (0.25, 10.5, 20.125, 40)]


def read(folder, header, lines, **choices):
    path = folder / "raw.csv"
    path.write_text("\n".join([header, *lines]) + "\n")
    return convert(path, ABOUT, Choices(**choices))


def assert_is_the_test(made):
    assert [(row[1], row[3]) for row in made.rows if row[3] is not None] == [(x, round(f, 4)) for _, x, f in ROWS]
    times = [time for hold in made.experiment.holds for time in hold.time_s]
    assert times == pytest.approx([t - ROWS[i // 4 * 4][0] for i, (t, *_) in enumerate(ROWS)], abs=1e-6)


@pytest.mark.parametrize(
    ("header", "parts"),
    [
        ("sec,nsec", 10**9),
        ("header.stamp.secs,header.stamp.nsecs", 10**9),
        ("tv_sec,tv_usec", 10**6),
        ("Time (s),Time (ms)", 10**3),
        ("seconds,microseconds", 10**6),
    ],
)
@pytest.mark.parametrize("begin", [0, 1781424000])
@pytest.mark.parametrize("sign", [".", ","])
def test_whole_seconds_and_what_is_left_of_them_are_one_time(tmp_path, header, parts, begin, sign):
    cells = [(int(begin + t), round(t % 1 * parts), f"{x:.1f}", f"{f:.4f}") for t, x, f in ROWS]
    lines = [";".join(map(str, row)).replace(".", sign) for row in cells]
    made = read(tmp_path, f"{header};x (mm);F (N)".replace(",", ";"), lines)
    assert_is_the_test(made)
    assert f"time from {' and '.join(header.split(','))}" in made.notes[0]


def test_one_time_in_seconds_and_milliseconds_is_no_parts(tmp_path):
    lines = [f"{round(t)},{round(t) * 1000},{x},{f:.4f}" for t, x, f in ROWS]
    made = read(tmp_path, "Time (s),Time (ms),x (mm),F (N)", lines)
    assert [hold.time_s[1] for hold in made.experiment.holds] == [10.0] * 4


@pytest.mark.parametrize(
    "header",
    [
        "t (s),x (mm),x error (mm),F (N),F error (N)",
        "Time (s),Position (mm),Position error (mm),Force (N),Force error (N)",
        "time_s,disp_mm,disp_sd_mm,load_N,load_sd_N",
        "Zeit [s],Weg [mm],Unsicherheit Weg [mm],Kraft [N],Unsicherheit Kraft [N]",
    ],
)
def test_the_error_of_a_quantity_is_not_the_quantity(tmp_path, header):
    lines = [f"{t},{x},{0.01 * x:.3f},{f:.4f},{0.02 * f:.3f}" for t, x, f in ROWS]
    made = read(tmp_path, header, lines)
    assert_is_the_test(made)
    assert any(note.startswith("not read: ") for note in made.notes)


def test_cells_that_spreadsheets_shall_not_change_and_comments_behind_numbers(tmp_path):
    lines = [f'="{t}","=""{x}""",{f:.4f}{" # touched the table" * (i == 5)}' for i, (t, x, f) in enumerate(ROWS)]
    assert_is_the_test(read(tmp_path, "t (s),x (mm),F (N)", lines))


def test_steps_of_a_machine_that_number_its_moves_too_divide_no_recording(tmp_path):
    lines = []
    for hold in range(4):
        lines += [(2 * hold + 1, hold + (k + 1) / 20, 10.0 * hold) for k in range(20)]
        lines += [(2 * hold + 2, hold + 1 + 1e-3 * (k % 2), 10 * hold + 9 - k / 1e3) for k in range(300)]
    cells = [f"{i / 10:.1f},{step},{x:.4f},{f:.4f}" for i, (step, x, f) in enumerate(lines)]
    made = read(tmp_path, "t (s),Step,x (mm),F (N)", cells)
    assert [hold.setting for hold in made.experiment.holds] == pytest.approx([1.0, 2.0, 3.0, 4.0], abs=2e-3)


@pytest.mark.parametrize("decimal", [".", ","])
def test_labview_without_a_column_of_times_counts_from_its_preamble(tmp_path, decimal):
    head = [
        "LabVIEW Measurement\t",
        "Separator\tTab",
        f"Decimal_Separator\t{decimal}",
        "X_Columns\tNo",
        "***End_of_Header***\t",
    ]
    lines = [*head, ""]
    for hold in range(3):
        block = ["Channels\t2", "Samples\t40\t40", "Y_Unit_Label\tN\tmm", "X_Dimension\tTime\tTime"]
        block += [
            f"X0\t{50.0 * hold}\t{50.0 * hold}",
            "Delta_X\t0.5\t0.5",
            "***End_of_Header***",
            "X_Value\tForce\tPosition\tComment",
        ]
        block += [f"\t{10 * hold + 9 - k / 100:.3f}\t{hold + 1:.3f}" for k in range(40)]
        lines += [line.replace(".", decimal) for line in block]
    path = tmp_path / "raw.lvm"
    path.write_text("\n".join(lines) + "\n")
    made = convert(path, ABOUT, Choices())
    assert [hold.setting for hold in made.experiment.holds] == [1.0, 2.0, 3.0]
    assert [hold.start_s for hold in made.experiment.holds] == [0.0, 50.0, 100.0]
    assert list(made.experiment.holds[1].time_s[:3]) == [0.0, 0.5, 1.0]


def test_a_page_that_is_called_a_workbook_is_named(tmp_path):
    with pytest.raises(wb.InputError, match="line 1: found HTML or XML, expected .* save it as xlsx"):
        read(tmp_path, "<html><body><table>", ["<tr><td>1</td><td>2</td></tr>"])


def test_columns_that_count_the_same_or_nothing_are_one(tmp_path):
    """As a program of a fatigue machine writes them."""
    header = "Total Time (s),Total Cycles,Elapsed Cycles,Step,Position (mm),Load (N)"
    made = read(tmp_path, header, [f"{t},{x - 1:.0f},0,{x:.0f},{x},{f:.4f}" for t, x, f in ROWS])
    assert_is_the_test(made)
    assert "hold from 'Total Cycles'" in made.notes[0]
    lines = [f"{t},{x - 1:.0f},{int(t > 100)},{x:.0f},{x},{f:.4f}" for t, x, f in ROWS]
    with pytest.raises(Undecided, match="found Total Cycles and Elapsed Cycles, each of which may be the hold"):
        read(tmp_path, header, lines)


def test_steps_of_a_motor_may_be_the_displacement_that_is_missing(tmp_path):
    lines = [f"{t},{200 * x:.0f},{f:.4f}" for t, x, f in ROWS]
    with pytest.raises(Undecided, match=r'say which with --map "pos_steps=displacement \[0.5 mm\]" \(with the length'):
        read(tmp_path, "time_s,pos_steps,force_N", lines)
    assert_is_the_test(
        read(tmp_path, "time_s,pos_steps,force_N", lines, mapping=("pos_steps=displacement [0.005 mm]",))
    )


def test_a_unit_that_is_not_known_is_refused_with_what_can_be_copied(tmp_path):
    lines = [f"{t},{x},{f:.4f}" for t, x, f in ROWS]
    with pytest.raises(wb.InputError, match=r'; or --map "Load \(% MBL\)=tension \[N\]" if that is what it means'):
        read(tmp_path, "time_s,x_mm,Load (% MBL)", lines)


@pytest.mark.parametrize("sign", [" ", "\t", ","])
def test_numbers_of_rows_without_a_name_stand_before_the_columns(tmp_path, sign):
    """As R writes a table."""
    header = sign.join(['"time_s"', '"x (mm)"', '"F [N]"'])
    lines = [sign.join([f'"{i}"', str(t), str(x), f"{f:.4f}"]) for i, (t, x, f) in enumerate(ROWS, start=1)]
    assert_is_the_test(read(tmp_path, header, lines))
    lines[3] = lines[3].replace('"4"', '"9"')  # no numbers of rows: who knows what
    with pytest.raises(wb.InputError, match="found 4 cells, expected 3 as in the header"):
        read(tmp_path, header, lines)
