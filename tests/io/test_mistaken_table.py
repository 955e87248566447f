"""A table of readings in place of its experiment file: every command says which file to give, or how to make one."""

import zipfile

import pytest

import wirebayes as wb
from wirebayes.errors import InputError

COMMANDS = {
    "check": wb.check,
    "fit": wb.fit,
    "discover": wb.discover,
    "compare": wb.compare,
    "plan": wb.plan,
    "batch": lambda path: wb.batch([path]),
}
ROWS = "hold,displacement_mm,time_s,tension_N\n1,1.0,0,2.0\n1,1.0,30,1.9\n1,1.0,60,1.8\n"


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_names_the_experiment_file_beside_the_table(tmp_path, command):
    (tmp_path / "other.toml").write_text('[[experiment]]\nreadings = "other.csv"\n', encoding="utf-8")
    (tmp_path / "broken.toml").write_text("[[experiment]\n", encoding="utf-8")
    named = tmp_path / "wire.toml"
    named.write_text('[[experiment]]\nname = "w"\nreadings = "bench.csv"\n', encoding="utf-8")
    table = tmp_path / "bench.csv"
    table.write_text(ROWS, encoding="utf-8")
    with pytest.raises(InputError) as said:
        COMMANDS[command](table)
    assert str(said.value) == (
        f"{table}: found a table of readings, expected the experiment file that names it: {named}"
    )


@pytest.mark.parametrize(
    "content",
    [
        ROWS.encode(),
        "Zeit;Weg;Kraft\ns;mm;N\n0;1,0;2,5\n1;1,0;2,4\n2;1,0;2,3\n".encode("utf-16"),
        "Prüfung 7\n\nt\tF\n0.0\t2.0\n0.1\t1.9\n0.2\t1.8\n".encode("cp1252"),
    ],
    ids=["csv", "utf-16", "tabs"],
)
def test_without_one_the_import_that_makes_it_is_written_out(tmp_path, content):
    table = tmp_path / "my bench.csv"
    table.write_bytes(content)
    with pytest.raises(InputError) as said:
        wb.fit(table)
    assert str(said.value) == (
        f"{table}: found a table of readings, expected an experiment file, which this makes of it: "
        f"wirebayes import '{table}' --output FOLDER --length-mm LENGTH"
    )


def test_a_workbook_is_a_table_too(tmp_path):
    table = tmp_path / "bench.xlsx"
    with zipfile.ZipFile(table, "w") as book:
        book.writestr("xl/workbook.xml", "<workbook/>")
    with pytest.raises(InputError, match="found a table of readings"):
        wb.check(table)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("w.toml", "[[experiment]]\nlength_mm = = 3\n1, 2\n3, 4\n5, 6\n"),
        ("notes.txt", "two holds of 30 s\nwere lost\n"),
        ("two.csv", "hold,displacement_mm\n1,1.0\n2,2.0\n"),
    ],
)
def test_other_files_are_told_what_is_no_toml_in_them(tmp_path, name, content):
    (tmp_path / name).write_text(content, encoding="utf-8")
    with pytest.raises(InputError, match="found a TOML error"):
        wb.check(tmp_path / name)


def test_what_is_not_there_is_said_to_be(tmp_path):
    with pytest.raises(InputError, match="found no such file"):
        wb.fit(tmp_path / "bench.csv")
