"""Holds of one test in files of their own: their order, what was set in each, and the question what the files are."""

import numpy as np
import pytest

import wirebayes as wb
from tests.simulated import SOFTER
from wirebayes.errors import InputError
from wirebayes.io.bench.undecided import Undecided
from wirebayes.simulation.synthetic import Bench, Truth, draw

SETTINGS = tuple(float(x) for x in range(1, 12))
TIMES_S = (0.0, 10.0, 30.0, 60.0)


@pytest.fixture(scope="module")
def tensions():
    """(11, 4) readings of a known test."""
    made = draw([Bench(displacements_mm=SETTINGS, times_s=TIMES_S)], Truth(SOFTER), seed=1)
    return np.round(made.problem.samples[0].readings[..., 0], 2)


def write(folder, tensions, name, *, header="Time [s];Displacement [mm];Force [N]", cells=None):
    """A file for each hold, named by its number from 1 and its displacement."""
    folder.mkdir()
    cells = cells or (lambda hold, time, force: (time, SETTINGS[hold], force))
    paths = []
    for hold, row in enumerate(tensions):
        lines = [";".join(map(str, cells(hold, time, force))) for time, force in zip(TIMES_S, row, strict=False)]
        paths.append(folder / name.format(hold=hold + 1, x=f"{SETTINGS[hold]:g}"))
        paths[-1].write_text("\n".join([header, *lines]))
    return paths


def read(source, **options):
    """The experiment, and what was understood of it."""
    imported = wb.import_bench(source, length_mm=1000, **options)
    (e,) = imported.experiments
    (content,) = imported.summary()["experiments"].values()
    return e, content


def assert_is(e, tensions, settings=SETTINGS):
    assert [hold.setting for hold in e.holds] == list(settings)
    assert [hold.number for hold in e.holds] == list(range(1, len(settings) + 1))
    assert np.array_equal(e.tension(), tensions)
    assert all(np.array_equal(hold.time_s, TIMES_S) for hold in e.holds)


def test_a_folder_of_holds_is_read_in_the_order_in_which_people_count(tmp_path, tensions):
    write(tmp_path / "raw", tensions, "hold{hold}.csv")
    e, content = read(tmp_path / "raw", each_file="hold")
    assert_is(e, tensions)
    assert e.name == "hold"
    assert content["notes"][0].startswith(
        "holds of one test in the order of their names: hold1.csv, hold2.csv, hold3.csv"
    )
    assert content["raw"].startswith("hold1.csv, hold2.csv, hold3.csv")


def test_files_in_the_order_of_a_shell_are_read_in_that_of_their_numbers(tmp_path, tensions):
    paths = write(tmp_path / "raw", tensions, "hold{hold}.csv")
    assert_is(read(sorted(paths), each_file="hold", name="mine")[0], tensions)


def test_dates_go_before_names_and_tell_rests(tmp_path, tensions):
    def backwards(hold, time, force):
        return f"2026-06-14 10:{20 - hold:02}:{time:02.0f}", SETTINGS[hold], force

    header = "Zeit;Weg [mm];Kraft [N]"
    write(tmp_path / "raw", tensions[:, :3], "hold{hold}.csv", header=header, cells=backwards)
    e, content = read(tmp_path / "raw", each_file="hold")
    assert [hold.setting for hold in e.holds] == list(SETTINGS[::-1])
    assert [hold.duration_s for hold in e.holds] == [60.0] * 10 + [30.0]
    assert content["notes"][0].startswith("holds of one test in the order of their dates: hold11.csv, hold10.csv")


def in_spring(hold, time, force):
    """A hold a day, from the 9th of March on, in American dates; names say nothing of the order."""
    return f"03/{9 + hold:02}/2026 10:{time // 60:02.0f}:{time % 60:02.0f}", SETTINGS[hold], force


def test_a_file_with_a_day_above_twelve_tells_how_dates_are_written_in_all(tmp_path, tensions):
    header = "Time;Weg [mm];Kraft [N]"
    write(tmp_path / "raw", tensions, "{hold}.csv", header=header, cells=in_spring)
    e, _ = read(tmp_path / "raw", each_file="hold")
    assert [hold.start_s for hold in e.holds] == [86400.0 * day for day in range(11)]


@pytest.mark.parametrize(("unit", "order"), [("mm/dd/yyyy", [0, 1, 2, 3]), ("dd/mm/yyyy", [1, 3, 0, 2])])
@pytest.mark.parametrize("in_header", [True, False])
def test_the_order_of_files_follows_what_is_said_of_their_dates(tmp_path, tensions, unit, order, in_header):
    days = ("03/11/2026", "04/01/2026", "04/12/2026", "05/02/2026")

    def cells(hold, time, force):
        return f"{days[hold]} 10:{time // 60:02.0f}:{time % 60:02.0f}", SETTINGS[hold], force

    header = f"Time ({unit});Weg [mm];Kraft [N]" if in_header else "Time;Weg [mm];Kraft [N]"
    write(tmp_path / "raw", tensions[:4], "{hold}.csv", header=header, cells=cells)
    mapping = [] if in_header else [f"Time=time [{unit}]"]
    e, _ = read(tmp_path / "raw", each_file="hold", mapping=mapping)
    assert [hold.setting for hold in e.holds] == [SETTINGS[i] for i in order]


def test_dates_of_files_that_nothing_decides_are_a_question(tmp_path, tensions):
    header = "Time;Weg [mm];Kraft [N]"
    write(tmp_path / "raw", tensions[:3], "{hold}.csv", header=header, cells=in_spring)
    with pytest.raises(Undecided) as question:
        read(tmp_path / "raw", each_file="hold")
    assert list(question.value.answers) == ["--map Time=time [dd/mm/yyyy]", "--map Time=time [mm/dd/yyyy]"]
    assert "1.csv to 3.csv, line 2 of 1.csv" in str(question.value)


def test_what_no_column_holds_is_in_the_names_of_the_files(tmp_path, tensions):
    header, cells = "Time [s];Force [N]", lambda hold, time, force: (time, force)
    paths = write(tmp_path / "raw", tensions, "rope 6 mm at {x}mm.csv", header=header, cells=cells)
    with pytest.raises(
        InputError, match="found no column of what was set, and 1 mm, 2 mm.*, expected --each-file hold"
    ):
        read(paths)
    e, content = read(paths, each_file="hold")
    assert_is(e, tensions)
    assert content["notes"][1].startswith("the displacement of each hold from the names of the files: 1 mm, 2 mm")


def test_what_neither_column_nor_name_says_is_listed(tmp_path, tensions):
    header, cells = "Time [s];Force [N]", lambda hold, time, force: (time, force)
    paths = write(tmp_path / "raw", tensions, "hold{hold}.csv", header=header, cells=cells)
    with pytest.raises(
        InputError, match='found no displacement in .*, expected --each-file "1 mm, 2 mm, …", one for each'
    ):
        read(paths, each_file="hold")
    settings = [x / 10 for x in SETTINGS]
    e, _ = read(paths, each_file=", ".join(f"{x} cm" for x in settings))
    assert_is(e, tensions)
    for wrong in ("1 mm, 2 mm", "holds", ", ".join(f"{x} kg" for x in settings)):
        with pytest.raises(InputError, match="--each-file"):
            read(paths, each_file=wrong)


def test_weights_may_be_in_the_names(tmp_path):
    weights = (2.0, 4.0, 6.0)
    made = draw([Bench(weights_N=[9.80665 * w for w in weights], times_s=TIMES_S)], Truth(SOFTER), seed=1)
    lengths = np.round(made.problem.samples[0].readings[..., 0], 2)
    header = "Time [s];Extension [mm]"
    write(tmp_path / "raw", lengths, "{hold}_{x}kg.csv", header=header, cells=lambda hold, time, x: (time, x))
    for hold, weight in enumerate(weights):
        (tmp_path / "raw" / f"{hold + 1}_{SETTINGS[hold]:g}kg.csv").rename(
            tmp_path / "raw" / f"{hold + 1}_{weight}kg.csv"
        )
    e, _ = read(tmp_path / "raw", each_file="hold")
    assert e.control == "force" and np.allclose([hold.setting for hold in e.holds], [9.80665 * w for w in weights])
    assert np.array_equal([hold.readings for hold in e.holds], lengths)


def test_one_hold_in_each_file_is_asked_about_and_several_are_not(tmp_path, tensions):
    paths = write(tmp_path / "raw", tensions[:3], "hold{hold}.csv")
    with pytest.raises(
        InputError, match="hold1.csv to hold3.csv: found one hold in each of 3 files, expected --each-file"
    ):
        wb.import_bench(paths, length_mm=1000)
    assert len(wb.import_bench(paths, length_mm=1000, each_file="test").experiments) == 3
    asked = []
    imported = wb.import_bench(paths, length_mm=1000, ask=lambda question: asked.append(question) or "--each-file hold")
    assert [len(e.holds) for e in imported.experiments] == [3] and len(asked) == 1
    paths[0].write_text(paths[0].read_text() + "\n0;2;5\n30;2;4.9")
    assert [len(e.holds) for e in wb.import_bench(paths, length_mm=1000).experiments] == [2, 1, 1]


def test_errors_name_line_and_file(tmp_path, tensions):
    paths = write(tmp_path / "raw", tensions[:3], "hold{hold}.csv")
    paths[1].write_text(paths[1].read_text() + "\n90;2;4,x")
    with pytest.raises(
        InputError, match=r"hold1.csv to hold3.csv, line 6 of hold2.csv, column 3 \(Force \[N\]\): found"
    ):
        read(paths, each_file="hold")
    paths[1].write_text("Time [s];Force [N];Displacement [mm]\n0;5;2\n9;4;2")
    with pytest.raises(InputError, match="hold2.csv, line 1: found the columns Time"):
        read(paths, each_file="hold")
    with pytest.raises(InputError, match="found 'hold' for one file"):
        read(paths[0], each_file="hold")


def test_a_list_goes_with_files_in_the_order_of_the_holds(tmp_path, tensions):
    """In any other order, as a shell's, the list may be meant for the files or for the holds."""
    header, cells = "Time [s];Force [N]", lambda hold, time, force: (time, force)
    paths = write(tmp_path / "raw", tensions, "hold{hold}.csv", header=header, cells=cells)
    settings = ", ".join(f"{x} mm" for x in SETTINGS)
    assert_is(read(tmp_path / "raw", each_file=settings)[0], tensions)
    with pytest.raises(InputError, match="^--each-file: .* order hold1.csv, hold10.csv.* names: hold1.csv, hold2.csv"):
        read(sorted(paths), each_file=settings)
    with pytest.raises(InputError, match="--each-file: found ''"):
        read(paths, each_file="")


def test_durations_beside_dates_are_durations_in_files_too_and_the_dates_tell_the_order(tmp_path, tensions):
    def backwards(hold, time, force):
        return f"2026-06-{14 - hold:02}", f"0:{time // 60:02.0f}:{time % 60:02.0f}", SETTINGS[hold], force

    header = "Date;Time;Weg [mm];Kraft [N]"
    write(tmp_path / "raw", tensions, "hold{hold}.csv", header=header, cells=backwards)
    e, content = read(tmp_path / "raw", each_file="hold")
    assert_is(e, tensions[::-1], SETTINGS[::-1])
    assert [hold.duration_s for hold in e.holds] == [60.0] * 11
    assert content["notes"][0].startswith("holds of one test in the order of their dates: hold11.csv")


def test_columns_without_a_header_are_called_by_their_numbers_in_files_too(tmp_path, tensions):
    paths = write(tmp_path / "raw", tensions, "hold{hold}.csv")
    for path in paths:
        path.write_text(path.read_text().partition("\n")[2])
    with pytest.raises(InputError, match="numbers without a header, and no column of .* N the number of the column"):
        read(paths, each_file="hold")
    assert_is(
        read(paths, each_file="hold", mapping=["1=time [s]", "2=displacement [mm]", "3=tension [N]"])[0], tensions
    )
