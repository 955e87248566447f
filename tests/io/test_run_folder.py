"""Files are written whole, and a folder belongs to one configuration."""

import errno
import hashlib
import json
import os
import stat
from pathlib import Path

import numpy as np
import pytest

from wirebayes.commands.new_experiment import new_experiment
from wirebayes.errors import InputError
from wirebayes.io import run_folder
from wirebayes.io.run_folder import Run, check_file, check_run, open_run, write_bytes, write_csv, write_json


def opened(folder: Path, configuration: dict[str, object]) -> Run:
    """As a run that ends at once."""
    with open_run(folder, configuration) as run:
        return run


CONFIGURATION = {"command": "fit", "seed": 0, "data": {"wire-a": "abc"}, "effects": ["toe"]}


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "a.json"
    write_json(path, {"b": 1})
    with pytest.raises(TypeError):
        write_json(path, {"b": object()})
    with pytest.raises(TypeError):
        write_bytes(path, "text, not bytes")
    assert json.loads(path.read_text()) == {"b": 1}
    assert [file.name for file in tmp_path.iterdir()] == ["a.json"]


def test_what_a_killed_run_was_writing_is_removed_by_the_next_command(tmp_path):
    folder, table = tmp_path / "out", tmp_path / "predicted.csv"
    opened(folder, CONFIGURATION)
    (folder / "wire-a").mkdir()
    left = [folder / ".configuration.json.x.partial", folder / "wire-a" / ".posterior.nc.partial"]
    left.append(tmp_path / ".predicted.csv.x.partial")
    others = [folder / "wire-a" / "thesis.partial", tmp_path / ".other.csv.x.partial"]
    for path in [*left, *others]:
        path.write_text("half")
    opened(folder, CONFIGURATION)
    check_file(table)
    assert [path for path in left if path.exists()] == []
    assert all(path.exists() for path in others)


def test_files_are_readable_by_others_as_usual(tmp_path):
    (tmp_path / "usual").write_text("")
    write_bytes(tmp_path / "ours", b"")
    modes = {stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ("usual", "ours")}
    assert len(modes) == 1


def test_json_keeps_order_and_exact_numbers(tmp_path):
    path = tmp_path / "a.json"
    write_json(path, {"k1": np.float64(0.1), "B": np.arange(2), "x": (np.nan, np.inf), "ok": np.True_, "p": tmp_path})
    assert path.read_text().endswith("}\n")
    found = json.loads(path.read_text())
    assert list(found.items()) == [
        ("k1", 0.1),
        ("B", [0, 1]),
        ("x", [None, None]),
        ("ok", True),
        ("p", str(tmp_path)),
    ]


def test_csv_round_trips(tmp_path):
    write_csv(tmp_path / "a.csv", ["name", "mean_N"], [("a,b", np.float64(1 / 3)), ("c", np.nan)])
    assert (tmp_path / "a.csv").read_bytes() == b'name,mean_N\n"a,b",0.3333333333333333\nc,\n'


def test_a_folder_is_new_then_resumed_then_done(tmp_path):
    folder = tmp_path / "out" / "fit"
    run = opened(folder, CONFIGURATION)
    assert run.state == "new"
    assert json.loads((folder / "configuration.json").read_text()) == CONFIGURATION
    assert opened(folder, CONFIGURATION).state == "resumed"
    run.finish()
    assert opened(folder, CONFIGURATION).state == "done"


def test_an_empty_folder_or_one_left_by_a_kill_is_new(tmp_path):
    (tmp_path / ".configuration.json.x.partial").write_text("{")
    assert opened(tmp_path, CONFIGURATION).state == "new"


def test_checking_makes_nothing(tmp_path):
    assert check_run(tmp_path / "out", CONFIGURATION) == "new"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("change", "found"),
    [
        ({"seed": 1}, "seed is 0 there, 1 here;"),
        ({"data": {"wire-a": "abd"}}, "data.wire-a is abc there, abd here;"),
        ({"effects": []}, 'effects is ["toe"] there, [] here;'),
        ({"history": "additive"}, "history is nothing there, additive here;"),
    ],
)
def test_another_configuration_is_refused_by_name(tmp_path, change, found):
    opened(tmp_path / "out", CONFIGURATION)
    before = (tmp_path / "out" / "configuration.json").read_bytes()
    with pytest.raises(InputError) as caught:
        opened(tmp_path / "out", CONFIGURATION | change)
    assert str(caught.value).startswith(f"{tmp_path / 'out'}: made with another configuration: {found} expected a new")
    assert (tmp_path / "out" / "configuration.json").read_bytes() == before


def test_a_file_that_has_changed_since_is_said_to_have(tmp_path):
    sums = [hashlib.sha256(text).hexdigest() for text in (b"before", b"after")]
    opened(tmp_path / "out", {"raw": {"bench.csv": sums[0]}, "seed": 0})
    with pytest.raises(InputError, match=r"configuration: bench\.csv has changed since; expected a new"):
        opened(tmp_path / "out", {"raw": {"bench.csv": sums[1]}, "seed": 0})
    assert run_folder.differences("abc", "abd", "data") == ["data is abc there, abd here"]


OPTIONS = {"--position": None, "--times": "0,60", "readings": "abc"}


def test_options_are_refused_by_their_names_and_values(tmp_path):
    opened(tmp_path / "out", {"command": "pose", "options": OPTIONS})
    other = OPTIONS | {"--position": "0.1,0,0.3", "readings": "abd", "--map": "0.4"}
    with pytest.raises(InputError) as caught:
        opened(tmp_path / "out", {"command": "pose", "options": other, "history": {"of": "joints", "rows": 3}})
    assert (
        "configuration: --position is unset there, 0.1,0,0.3 here; options.readings is abc there, abd here; --map is "
        "unset there, 0.4 here; and 2 more; expected"
    ) in str(caught.value)
    with pytest.raises(InputError, match="history.of is nothing there, joints here; expected"):
        opened(tmp_path / "out", {"command": "pose", "options": OPTIONS, "history": {"of": "joints"}})


def test_options_that_were_stored_without_names_are_still_known(tmp_path):
    for folder, values in (
        ("same", [None, "0,60", "abc"]),
        ("other", [None, "0,10", "abc"]),
        ("more", [None, 3, 2, 1]),
    ):
        opened(tmp_path / folder, {"command": "pose", "options": values})
    assert opened(tmp_path / "same", {"command": "pose", "options": OPTIONS}).state == "resumed"
    with pytest.raises(InputError, match=r"configuration: --times is 0,10 there, 0,60 here; expected"):
        opened(tmp_path / "other", {"command": "pose", "options": OPTIONS})
    with pytest.raises(
        InputError, match="configuration: options are others there, stored without their names; expected"
    ):
        opened(tmp_path / "more", {"command": "pose", "options": OPTIONS})


def test_a_key_that_is_gone_is_a_difference_too(tmp_path):
    opened(tmp_path / "out", CONFIGURATION)
    with pytest.raises(InputError, match="seed is 0 there, nothing here"):
        opened(tmp_path / "out", {key: value for key, value in CONFIGURATION.items() if key != "seed"})


def test_what_is_not_ours_is_left_alone(tmp_path):
    (tmp_path / "thesis.tex").write_text("")
    with pytest.raises(InputError, match="found thesis.tex but no configuration.json"):
        opened(tmp_path, CONFIGURATION)
    with pytest.raises(InputError, match="found a file, expected a folder"):
        opened(tmp_path / "thesis.tex", CONFIGURATION)
    with pytest.raises(InputError, match="cannot be written|expected a folder"):
        opened(tmp_path / "thesis.tex" / "deeper", CONFIGURATION)
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "configuration.json").write_text("{")
    with pytest.raises(InputError, match="found no readable configuration"):
        opened(tmp_path / "broken", CONFIGURATION)


def test_a_file_that_cannot_be_written_is_refused_beforehand(tmp_path):
    check_file(tmp_path / "new.csv")
    with pytest.raises(InputError, match="found a folder"):
        check_file(tmp_path)
    with pytest.raises(InputError, match="found no writable folder"):
        check_file(tmp_path / "absent" / "new.csv")


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EROFS, errno.EACCES, errno.EDQUOT])
def test_a_disk_that_takes_no_more_ends_in_one_line_and_keeps_what_is_there(tmp_path, monkeypatch, number):
    folder = tmp_path / "out"
    opened(folder, CONFIGURATION)
    write_json(folder / "summary.json", {"k1": 1})

    def full(handle: int) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(InputError, match=f"summary.json: cannot be written .{os.strerror(number)}"):
        write_json(folder / "summary.json", {"k1": 2})
    assert json.loads((folder / "summary.json").read_text()) == {"k1": 1}
    assert sorted(path.name for path in folder.iterdir()) == ["configuration.json", "summary.json"]


def test_a_folder_that_vanishes_under_a_run_is_told_in_one_line(tmp_path):
    with pytest.raises(InputError, match="cannot be written"), open_run(tmp_path / "out", CONFIGURATION) as run:
        for path in run.directory.iterdir():
            path.unlink()
        run.directory.rmdir()
        run.finish()


def test_other_errors_of_the_system_are_not_hidden(tmp_path):
    with pytest.raises(BrokenPipeError), open_run(tmp_path / "out", CONFIGURATION):
        raise BrokenPipeError(errno.EPIPE, "a bug of ours")


@pytest.mark.parametrize("below", [".", "results"])
def test_a_link_that_leads_nowhere_is_no_folder(below, tmp_path):
    link = tmp_path / "link"
    link.symlink_to(tmp_path / "gone")
    with pytest.raises(InputError, match=r"link: found a link to .*gone, which is not there, expected a folder"):
        opened(link / below, CONFIGURATION)
    with pytest.raises(InputError, match="found a link"):
        new_experiment(link / below)
    assert not (tmp_path / "gone").exists()
    (tmp_path / "gone").mkdir()
    assert opened(link / below, CONFIGURATION).state == "new"
