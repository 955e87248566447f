"""Lines above blocks of readings that say what no column does: what was set, and whose readings these are."""

import pytest

from tests.io.bench_files import convert_all
from wirebayes.io.bench.about import About
from wirebayes.io.bench.undecided import Choices, Undecided
from wirebayes.io.bench.unread import names_a_specimen

ABOUT = About("wire", "line", 1000.0)
READ_S = (0, 30, 60, 90)


def in_blocks(tmp_path, titles, header, cells, preamble="Rope 6 mm, preload 5 N\n"):
    """Blocks with their own titles and headers."""
    blocks = []
    for i, title in enumerate(titles, start=1):
        rows = [cells(i, t) for t in READ_S]
        blocks.append("\n".join([title, header, *rows, ""]))
    path = tmp_path / "raw.csv"
    path.write_text(preamble + "\n".join(blocks))
    return convert_all(path, ABOUT, Choices())


def tension(i, t):
    return f"{t},{5 * i - t / 1000:.3f}"


@pytest.mark.parametrize(
    "titles",
    [
        ["Step 1: 2 mm", "Step 2: 4 mm", "Step 3: 3.5 mm"],
        ["2mm", "4mm", "3.5mm"],
        ["Hold at 2 mm for 120 s", "Hold at 4 mm for 120 s"],
        ["Hold 1\nDisplacement (mm): 2\nRate: 10 mm/min", "Hold 2\nDisplacement (mm): 4\nRate: 20 mm/min"],
        ["Hold 1\nDisplacement,2,mm\nGauge length,1 mm", "Hold 2\nDisplacement,4,mm\nGauge length,3 mm"],
        ["# Step 1: 2 mm", "# Step 2: 4 mm"],
    ],
)
def test_displacements_stand_above_their_blocks(tmp_path, titles):
    (made,) = in_blocks(tmp_path, titles, "Time (s),Force (N)", tension)
    assert [hold.setting for hold in made.experiment.holds] == [2.0, 4.0, 3.5][: len(titles)]
    assert [row[3] for row in made.rows[:4]] == [5.0, 4.97, 4.94, 4.91]
    assert "the displacement of each block from the line above it" in made.notes[0]


def test_weights_stand_above_their_blocks(tmp_path):
    titles = ["Load 5 kg", "Load 10 kg", "Load 7,5 kg"]
    (made,) = in_blocks(
        tmp_path, titles, "Zeit [s];Messuhr [mm]", lambda i, t: f"{t};{i + t / 1000:.3f}".replace(".", ",")
    )
    assert [hold.setting for hold in made.experiment.holds] == pytest.approx([9.80665 * kg for kg in (5, 10, 7.5)])
    assert made.experiment.control == "force"


@pytest.mark.parametrize(
    "titles",
    [
        ["Step 1", "Step 2"],  # says nothing
        ["Step 1: 2 mm", "Step 2: 2 mm"],  # the same
        ["Step 1: 2 mm", "Step two: 4 mm"],  # not alike
        ["Step 1: 2 to 3 mm, 4 mm", "Step 2: 3 to 5 mm, 6 mm"],  # two measures
        ["Step 1: 2 mm/min", "Step 2: 4 mm/min"],  # of something else
        ["Rope 2 mm", "Rope 4 mm"],  # a thickness
        ["Length 200 mm", "Length 400 mm"],  # of two ropes
        ["Step 1: +2 mm", "Step 2: +3 mm"],  # a change
        ["Stretch (mm): +2", "Stretch (mm): +3"],
    ],
)
def test_titles_that_do_not_say_one_displacement_leave_it_open(tmp_path, titles):
    with pytest.raises(Undecided, match="found no column of displacement"):
        in_blocks(tmp_path, titles, "Time (s),Force (N)", tension)


def steps(i, t):
    return f"{1 + t // 60},{t % 60},{5 * (1 + t // 60) - t % 60 / 1000 + i / 10:.3f}"


@pytest.mark.parametrize(
    "titles", [["Specimen 1", "Specimen 2"], ["Probe: red", "Probe: blue"], ["Sample no,7", "Sample no,8"]]
)
def test_titles_that_name_specimens_divide_them(tmp_path, titles):
    made = in_blocks(tmp_path, titles, "x (mm),Time (s),Force (N)", steps)
    assert [len(each.experiment.holds) for each in made] == [2, 2]
    assert [each.rows[0][3] for each in made] == [5.1, 5.2]


def test_samples_at_displacements_that_go_on_may_be_holds(tmp_path):
    titles = ["Sample 1", "Sample 2", "Sample 3"]
    with pytest.raises(Undecided, match="found '2' after '1' where times begin again, expected --specimens several"):
        in_blocks(tmp_path, titles, "x (mm),Time (s),Force (N)", lambda i, t: f"{i},{tension(i, t)}")
    (made,) = convert_all(tmp_path / "raw.csv", ABOUT, Choices(specimens="one"))
    assert [hold.setting for hold in made.experiment.holds] == [1.0, 2.0, 3.0]
    assert len(convert_all(tmp_path / "raw.csv", ABOUT, Choices(specimens="several"))) == 3


@pytest.mark.parametrize(
    ("line", "name"),
    [
        ("Specimen 3", "3"),
        ("Probe Nr. 3", "3"),
        ("Éprouvette: corde bleue", "corde bleue"),
        ("Sample rate: 10 Hz", ""),
        ("Samples: 120", ""),
        ("The specimen 3", ""),
        ("Wire length 1000 mm", ""),
    ],
)
def test_a_line_names_a_specimen_and_nothing_else(line, name):
    assert names_a_specimen(line) == name
