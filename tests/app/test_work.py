"""The app without a browser: its folders, and work in processes that say how they go and can be stopped."""

import subprocess
import sys
import time
from pathlib import Path

import pytest

from wirebayes.app.folders import READ, Shelf
from wirebayes.app.jobs import Jobs
from wirebayes.app.work import _own_robot
from wirebayes.cli import main
from wirebayes.errors import InputError
from wirebayes.processes.workers import load_early

BENCH = Path(__file__).parents[2] / "docs" / "example" / "bench.csv"
SAMPLE = {"length_mm": 1200.0, "material": "line", "area_mm2": None, "control": "", "options": []}


@pytest.fixture
def shelf(tmp_path):
    return Shelf(tmp_path / "app")


@pytest.fixture
def jobs():
    load_early()  # as the server does: what processes load is loaded once
    running = Jobs()
    yield running
    running.stop_all()


def dropped(shelf, name, content):
    test = shelf.new(Path(name).stem)
    (test.folder / "raw" / name).write_bytes(content)
    return test


def ended(job, seconds=60):
    end = time.monotonic() + seconds
    while job.state == "running":
        assert time.monotonic() < end, job
        time.sleep(0.02)
    return job


def test_tests_of_one_name_have_folders_of_their_own(shelf):
    assert [shelf.new("my bench/2").name for _ in range(3)] == ["my-bench-2", "my-bench-2-2", "my-bench-2-3"]
    assert shelf.new("…").name == "test"


@pytest.mark.parametrize("name", ["..", ".", "", "absent", "a/../b", "/etc", "b\0"])
def test_an_address_reaches_no_other_folder(shelf, name):
    shelf.new("b")
    (shelf.root.parent / "raw").mkdir()  # what ".." would find
    assert shelf.get(name) is None
    assert shelf.get("b").folder == shelf.root / "b"


def test_a_folder_that_cannot_be_written_is_said_in_a_line(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="file: cannot be a folder"):
        Shelf(tmp_path / "file")


def test_a_damaged_record_is_as_none(shelf):
    test = shelf.new("b")
    (test.folder / "fit.json").write_text('{"half')
    assert test.record("fit") is None


def test_a_bench_file_is_read_checked_and_drawn(shelf, jobs):
    test = dropped(shelf, "bench.csv", BENCH.read_bytes())
    test.say(SAMPLE)
    job = ended(jobs.start(test, READ, test.about()))
    assert (job.state, job.value) == ("done", None)
    assert test.record(READ)["lines"][0] == "bench: 17 holds, 85 readings, 1200 mm of line"
    assert [Path(file).name for file in test.files(READ)] == ["import.json", "bench.csv", "bench.toml", "bench.svg"]
    (test.folder / "check").mkdir()
    (test.folder / "check.json").write_text("{}")
    assert test.steps() == [READ, "check"]
    ended(jobs.start(test, READ, test.about() | {"length_mm": 1300.0}))
    assert test.steps() == [READ] and not (test.folder / "check").exists()  # it was of another length


def test_what_a_file_leaves_open_is_asked_all_at_once_and_the_answers_settle_it(shelf, jobs):
    lines = BENCH.read_text().splitlines()
    head = lines[1].replace("Weg [mm]", "Kanal 1").replace("Zeit [s]", "Kanal 2")
    assert head.startswith("Stufe;Kanal 1;Kanal 2;")
    test = dropped(shelf, "bench.csv", "\n".join([head, *lines[2:]]).encode())
    job = ended(jobs.start(test, READ, SAMPLE))
    assert job.state == "undecided"
    assert [question["question"] for question in job.value] == [
        "which column is the displacement",
        "which column is the time",
    ]
    assert str(shelf.root) not in job.value[0]["found"]
    columns = ["--map Kanal 1=displacement", "--map Kanal 2=time"]
    assert [columns[i] in question["answers"] for i, question in enumerate(job.value)] == [True, True]
    job = ended(jobs.start(test, READ, SAMPLE | {"options": columns}))
    assert job.state == "undecided" and {q["question"] for q in job.value} == {
        "the unit of displacement",
        "the unit of time",
    }
    units = ["--map Kanal 1=displacement [mm]", "--map Kanal 2=time [s]"]
    assert ended(jobs.start(test, READ, SAMPLE | {"options": [*columns, *units]})).state == "done"


def test_an_experiment_file_without_its_table_is_refused_in_a_line(shelf, jobs):
    test = dropped(shelf, "a.toml", b'[[experiment]]\nname = "a"\nmaterial = "m"\nlength_mm = 1\nreadings = "a.csv"\n')
    job = ended(jobs.start(test, READ, {}))
    assert job.state == "refused" and "\n" not in job.value
    assert job.value.startswith("a.toml, line 5, experiment a, key readings: found 'a.csv', which is no file there")


def test_a_robot_that_is_dropped_before_a_wire_is_told_where_it_belongs(shelf, jobs):
    robot = Path(__file__).parents[2] / "data" / "robots" / "linear-6.toml"
    job = ended(jobs.start(dropped(shelf, "mine.toml", robot.read_bytes()), READ, {}))
    assert job.state == "refused"
    assert job.value == "mine.toml: found a robot, expected an experiment; drop it below the results of a fit"


def test_models_that_share_the_probability_come_after_the_final_one_and_the_summaries(shelf):
    test = shelf.new("d")
    names = ["final/posterior.nc", "final/summary.json", "final/undecided/1/posterior.nc", "plain/posterior.nc"]
    for name in names:
        path = test.folder / "discover" / "wire" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("")
    last = f"discover/wire/{names.pop(2)}"
    assert test.files("discover")[-1] == last


def test_a_robot_of_ones_own_is_one_file_and_at_most_one_table(shelf):
    test = dropped(shelf, "b.csv", b"")
    place = test.place_for_robot(["way.csv", "my robot.TOML"])
    assert place == test.folder / "robots" / "my-robot"
    with pytest.raises(InputError, match="expected one robot's file"):
        _own_robot(place)
    (place / "my robot.TOML").write_text("")
    assert _own_robot(place) == (place / "my robot.TOML", {})
    for header, kind in (("time_s,x_m,y_m,z_m", "trajectory"), ("time_s,joint_1_m", "joints")):
        (place / "way.csv").write_text(f"{header}\n0,1,2,3\n")
        assert _own_robot(place)[1] == {kind: place / "way.csv"}
    (place / "log.csv").write_text("")
    with pytest.raises(InputError, match="found log.csv, my robot.TOML, way.csv; expected"):
        _own_robot(place)
    assert list(test.place_for_robot(["my robot.toml"]).iterdir()) == []  # dropped anew


def test_a_stop_ends_the_work_with_all_its_processes_and_it_can_go_on(shelf, jobs):
    psutil = pytest.importorskip("psutil")
    test = dropped(shelf, "bench.csv", BENCH.read_bytes())
    ended(jobs.start(test, READ, SAMPLE))
    job = jobs.start(test, "discover", {"seed": 0})
    assert jobs.start(test, "fit", {"seed": 0}) is None  # one at a time
    end = time.monotonic() + 60
    while not (family := psutil.Process(job._process.pid).children(recursive=True)):
        assert time.monotonic() < end
        time.sleep(0.01)
    job.stop()
    assert ended(job).state == "stopped"
    assert psutil.wait_procs(family, timeout=60)[1] == []  # one that still loads its modules ends after that
    assert test.steps() == [READ]
    assert jobs.start(test, "fit", {"seed": 0}) is not None


def test_a_process_that_is_killed_is_said(shelf, jobs):
    test = dropped(shelf, "bench.csv", BENCH.read_bytes())
    job = jobs.start(test, READ, SAMPLE)
    job._process.kill()
    assert ended(job).state == "broken" and "code -9" in job.value


def test_without_the_extra_one_line_says_what_to_install(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("wirebayes.cli.app.find_spec", lambda name: None)
    monkeypatch.chdir(tmp_path)
    assert main(["app"]) == 2
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 1 and 'pip install "wirebayes[app]"' in said[0]
    assert list(tmp_path.iterdir()) == []


def test_the_server_loads_nothing_that_computes_or_draws():
    heavy = "numpy", "scipy", "matplotlib", "emcee", "xarray"
    script = f"import sys, wirebayes.app.jobs, wirebayes.app.folders; print([n for n in {heavy} if n in sys.modules])"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
