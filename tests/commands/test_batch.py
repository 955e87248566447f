"""Many experiments: the same bytes whoever computes them, no experiment lost to another or to a killed process."""

import csv
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from multiprocessing import active_children
from pathlib import Path

import pytest

import wirebayes as wb
from wirebayes.cli import main
from wirebayes.commands import batch as module
from wirebayes.commands import one_experiment
from wirebayes.io.run_folder import read_json

ROOT = Path(__file__).parents[2]
FEW = wb.Policy(walkers=32, ess=1, rounds=2, most_rounds=2, tail=99, round_draws=512, block=8, most_steps=8, r_hat=99)
TRUTH = {"k1": 1200.0, "B": 0.2, "U": 0.8, "k2": 0.03, "N": 0.8, "preload": 0.3, "sensor_sd": 0.005, "setting_sd": 0.01}
PATIENT_S = 300.0  # for processes to start, however busy the machine is
QUICK = {"discover": False, "check": False, "policy": FEW}


@pytest.fixture(scope="module")
def tests():
    """Short simulated tests."""
    return simulated(4)


def simulated(count):
    made = []
    for i in range(count):
        options = {"displacements": range(1, 6), "times": [0, 30, 60], "seed": i, "parameters": TRUTH}
        (test,) = wb.simulate_tests(**options).experiments
        made.append(replace(test, name=f"spool-{i}", material="line", source=Path("lot.toml")))
    return made


@pytest.fixture
def here(monkeypatch):
    """Work is done in this process, where it can be meddled with."""

    @contextmanager
    def executor(scheduler, most):
        with ThreadPoolExecutor(1) as pool:
            yield pool

    monkeypatch.setattr(module, "executor", executor)


@pytest.fixture(scope="module")
def reference(tests, tmp_path_factory):
    """What all others must equal: computed by processes without any trouble."""
    folder = tmp_path_factory.mktemp("reference") / "out"
    wb.batch(tests, **QUICK, output=folder)
    return folder


def bytes_of(folder):
    files = [path for path in folder.rglob("*") if path.is_file() and path.suffix != ".nc"]
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


def rows_of(folder):
    with (folder / "summary.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def test_a_row_and_a_folder_for_each_experiment(reference, tests):
    rows = rows_of(reference)
    assert [row["name"] for row in rows] == [test.name for test in tests]
    for row in rows:
        summary = read_json(reference / row["name"] / "summary.json")
        for name, values in summary["parameters"].items():
            for quantity in ("mean", "sd", "q05", "q50", "q95"):
                assert float(row[f"{name}_{quantity}"]) == values[quantity]
        assert (reference / row["name"] / "posterior.nc").is_file()
        assert (row["material"], row["file"], float(row["length_mm"]), row["error"]) == ("line", "lot.toml", 1000.0, "")
        assert row["control"] == "displacement"
    many = wb.load(reference)
    assert list(many.plain) == [test.name for test in tests]
    assert many.final == {}
    assert not (reference / ".computing").exists()


def test_the_table_is_there_as_parquet(reference):
    parquet = pytest.importorskip("pyarrow.parquet")
    table = parquet.read_table(reference / "summary.parquet")
    assert table.column("name").to_pylist() == [row["name"] for row in rows_of(reference)]
    assert table.column("k1_mean").to_pylist() == [float(row["k1_mean"]) for row in rows_of(reference)]


def test_the_same_bytes_within_one_process_and_without_the_draws(reference, tests, tmp_path, here, monkeypatch):
    def unwanted(*args, **kwargs):
        raise AssertionError("nobody reads it")

    monkeypatch.setattr("wirebayes.results.jobs.save_posterior", unwanted)
    monkeypatch.setattr("wirebayes.inference.sampler.checkpoint.write_checkpoint", unwanted)
    wb.batch(tests[:2], **QUICK, output=tmp_path / "out", posteriors=False)
    ours, theirs = bytes_of(tmp_path / "out"), bytes_of(reference)
    for test in tests[:2]:
        for name in ("summary.json", "row.json"):
            assert ours[f"{test.name}/{name}"] == theirs[f"{test.name}/{name}"]
    assert not list(tmp_path.rglob("posterior.nc"))
    assert wb.load(tmp_path / "out").plain == {}


def test_the_same_configuration_answers_at_once_and_another_is_refused(reference, tests, here, monkeypatch):
    monkeypatch.setattr(module, "do", None)
    assert not wb.batch(tests, **QUICK, output=reference).computed
    with pytest.raises(wb.InputError, match="made with another configuration: seed is 0 there, 1 here"):
        wb.batch(tests, **QUICK, output=reference, seed=1)
    with pytest.raises(wb.InputError, match="made with another configuration"):
        wb.batch(tests[:3], **QUICK, output=reference)


def test_a_killed_process_costs_time_but_no_result(reference, tests, tmp_path):
    victims = []

    def kill_one(name, done, total):
        if done == 1 and not victims:
            victims.append(active_children()[0])
            victims[0].kill()

    many = wb.batch(tests, **QUICK, output=tmp_path / "out", progress=kill_one)
    assert victims
    assert [row["error"] for row in many.rows] == [None] * 4
    assert bytes_of(tmp_path / "out") == bytes_of(reference)


def test_processes_that_die_again_and_again_end_it_in_a_line(tests, tmp_path):
    def kill_all(name, done, total):
        for child in active_children():
            child.kill()

    with pytest.raises(wb.InputError, match="processes died again and again"):
        wb.batch(tests[:2], **QUICK, output=tmp_path / "out", progress=kill_all)


def test_a_failing_experiment_says_so_in_its_row(tests, tmp_path, here, monkeypatch):
    store = one_experiment.store

    def fails(job, fit, folder, *rest, **options):
        if job.folder == "spool-1":
            raise FloatingPointError(f"{folder}/odd readings")
        store(job, fit, folder, *rest, **options)

    monkeypatch.setattr(one_experiment, "store", fails)
    many = wb.batch(tests[:3], **QUICK, output=tmp_path / "out")
    assert [row["error"] for row in rows_of(tmp_path / "out")] == ["", "FloatingPointError: odd readings", ""]
    assert any("spool-1: FloatingPointError: odd readings" in message for message in many.messages)
    assert list(many.plain) == ["spool-0", "spool-2"]
    assert "Not fitted: spool-1." in wb.write_report(many).read_text()


def test_a_full_disk_is_nobodys_row(tests, tmp_path, here, monkeypatch):
    def full(*rest, **options):
        raise OSError("no space left")

    monkeypatch.setattr(one_experiment, "store", full)
    with pytest.raises(OSError, match="no space left"):
        wb.batch(tests[:2], **QUICK, output=tmp_path / "out")
    assert not list((tmp_path / "out").rglob("row.json"))


def test_an_interrupted_batch_goes_on_where_it_was(reference, tests, tmp_path, here, monkeypatch):
    class Stopped(Exception):
        pass

    def stop(name, done, total):
        if done == 2:
            raise Stopped

    with pytest.raises(Stopped):
        wb.batch(tests, **QUICK, output=tmp_path / "out", progress=stop)
    kept = {path: path.stat().st_mtime_ns for path in (tmp_path / "out").rglob("row.json")}
    assert len(kept) == 2
    wb.batch(tests, **QUICK, output=tmp_path / "out")
    assert {path: path.stat().st_mtime_ns for path in kept} == kept
    assert bytes_of(tmp_path / "out") == bytes_of(reference)


def test_files_are_read_before_any_work(experiment_file, tmp_path, capsys):
    good = experiment_file()
    bad = tmp_path / "bad.toml"
    bad.write_text(good.read_text().replace("1000.0", "-1"))
    assert main(["batch", str(good), str(bad), str(tmp_path / "none.toml"), "--output", str(tmp_path / "out")]) == 2
    message = capsys.readouterr().err
    assert f"{bad}, line 4, experiment wire-a, key length_mm: found -1" in message
    assert "none.toml: " in message
    assert message.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_with_keep_going_a_bad_file_has_a_row(experiment_file, tmp_path, here):
    good = experiment_file()
    many = wb.batch([good, tmp_path / "none.toml"], **QUICK, keep_going=True, output=tmp_path / "out")
    assert [(row["name"], row["error"] is None) for row in many.rows] == [("wire-a", True), ("none", False)]
    assert "none.toml" in rows_of(tmp_path / "out")[1]["error"]
    with pytest.raises(wb.InputError, match=r"none\.toml"):
        wb.batch(tmp_path / "none.toml", **QUICK, keep_going=True)


def test_one_name_in_two_files_takes_the_files_name_with_it(experiment_file, tmp_path, here):
    good = experiment_file()
    other = tmp_path / "f.toml"
    other.write_bytes(good.read_bytes())
    many = wb.batch([good, other], **QUICK)
    assert [row["name"] for row in many.rows] == ["e.wire-a", "f.wire-a"]
    with pytest.raises(wb.InputError, match=r"e\.toml: found the experiment e\.wire-a a second time"):
        wb.batch([good, good], **QUICK)


def test_names_that_differ_in_case_take_the_files_name_with_them(experiment_file, tmp_path, here):
    good = experiment_file()
    other = tmp_path / "f.toml"
    other.write_text(good.read_text().replace("wire-a", "Wire-A"))
    many = wb.batch([good, other], **QUICK)
    assert [row["name"] for row in many.rows] == ["e.wire-a", "f.Wire-A"]


def test_a_discovered_experiment_has_both_posteriors_and_a_verdict(tests, tmp_path, here):
    many = wb.batch(tests[0], policy=FEW, simulations=99, without=_all_but("toe"), output=tmp_path / "out")
    (row,) = rows_of(tmp_path / "out")
    report = read_json(tmp_path / "out" / "spool-0" / "discovery.json")["experiments"]["spool-0"]
    assert row["verdict"] == report["verdict"]
    assert float(row["p_global"]) == report["p_global"]
    assert row["check"] == ("passed" if report["p_global"] > 0.04 else "failed")
    assert many.final["spool-0"].within == "spool-0/final"
    assert (tmp_path / "out" / "spool-0" / "spool-0.svg").is_file()
    protocol = {"hold": [6], "displacement_mm": [6], "time_s": [0]}
    assert wb.predict(tmp_path / "out", protocol, experiment="spool-0")["mean_N"].shape == (1,)
    assert row["verdict"].replace("-", " ") in wb.write_report(many).read_text()


def test_parameters_of_a_plain_model_that_lacks_something_are_said_to_be_such(tmp_path, here):
    options = {"displacements": range(1, 9), "times": [0, 30, 60], "seed": 1, "parameters": TRUTH}
    (test,) = wb.simulate_tests(**options, effects={"toe.w": 2.0}).experiments
    many = wb.batch(test, policy=FEW, simulations=99, without=_all_but("toe"), output=tmp_path / "out")
    (row,) = rows_of(tmp_path / "out")
    assert row["verdict"] == "named"
    assert "lacks what was found missing (p" in row["warnings"]
    assert f"{test.name}/final/summary.json" in row["warnings"]
    assert (many.folder / test.name / "final" / "summary.json").is_file()


def _all_but(*names):
    return [effect.name for effect in wb.list_effects() if effect.name not in names]


@contextmanager
def cluster(folder):
    """A scheduler and two workers on loopback; yields its address and the workers' processes."""
    from distributed import Client

    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    file = folder / "scheduler.json"

    def start(part, *options):
        command = [sys.executable, "-m", f"distributed.cli.dask_{part}", *options]
        return subprocess.Popen(command, env=environment, cwd=folder, stderr=subprocess.DEVNULL)

    loopback = ("--host", "127.0.0.1", "--no-dashboard", "--scheduler-file", str(file))
    started = [start("scheduler", "--port", "0", *loopback)]
    try:
        while not file.is_file():
            time.sleep(0.05)
        started += [start("worker", "--nthreads", "1", "--no-nanny", *loopback) for _ in range(2)]
        while not (address := _address(file)):
            time.sleep(0.05)
        with Client(address, timeout=PATIENT_S, set_as_default=False) as client:
            client.wait_for_workers(2)  # a busy machine takes longer to start them than a user is kept waiting
        yield address, started[1:]
    finally:
        for process in started:
            process.kill()
            process.wait()


def _address(file):
    try:
        return read_json(file)["address"]
    except ValueError:
        return None


def test_a_specimen_that_lies_apart_stands_in_table_answer_and_page(tests, tmp_path, here, monkeypatch):
    """Rows are made up: what is far is judged elsewhere, this is about where it is said."""

    def fitted(experiment, task, folder):
        k1 = {"spool-3": 2000.0}.get(experiment.name, 1000.0 + int(experiment.name[-1]))
        quantities = {"mean": k1, "sd": 5.0, "q05": k1 - 8, "q50": k1, "q95": k1 + 8}
        parameters = dict.fromkeys(("k1", "B", "U", "k2", "N"), quantities)
        return {"converged": True, "parameters": parameters}

    monkeypatch.setattr(one_experiment, "_fitted", fitted)
    many = wb.batch(simulated(7), **QUICK, output=tmp_path / "out")
    assert [row["outlier"] for row in rows_of(tmp_path / "out")][2:5] == ["", "k1; B; U; k2; N", ""]
    sentence = next(o["sentence"] for o in many.outliers if o["parameter"] == "k1")
    assert sentence.startswith("spool-3: k1 is 2000")
    assert f"  apart: {sentence}" in many.lines()
    assert many.lines()[0] == "7 experiments: 7 converged, 0 failed"
    page = wb.write_report(many).read_text()
    assert page.count(">spool-3<") == 6  # five parameters of it, and its row


def test_a_cluster_gives_the_same_bytes_though_a_worker_is_killed(reference, tests, tmp_path):
    pytest.importorskip("distributed")
    with cluster(tmp_path) as (address, workers):

        def kill_one(name, done, total):
            if done == 1:
                workers[0].send_signal(signal.SIGKILL)

        wb.batch(tests, **QUICK, output=tmp_path / "out", scheduler=address, progress=kill_one)
        assert workers[0].poll() is not None
    assert bytes_of(tmp_path / "out") == bytes_of(reference)


@pytest.mark.slow
def test_a_batch_on_a_cluster_is_killed_loses_a_worker_and_goes_on(tmp_path):
    """Twenty experiments: the asking process is killed, a worker too, and a second run ends with the same bytes."""
    pytest.importorskip("distributed")
    made = wb.simulate_tests(tests=20, displacements=range(1, 6), times=[0, 30, 60], output=tmp_path / "tests")
    file = made.folder / "experiments.toml"
    wb.batch(file, **QUICK, output=tmp_path / "serial")
    with cluster(tmp_path) as (address, workers):
        script = (
            f"import wirebayes as wb; wb.batch({str(file)!r}, discover=False, check=False, policy=wb.{FEW!r}, "
            f"output='out', scheduler={address!r})"
        )
        caller = subprocess.Popen([sys.executable, "-c", script], cwd=tmp_path, env={**os.environ, "PYTHONPATH": ROOT})
        while len(list((tmp_path / "out").glob("*/row.json"))) < 3:
            assert caller.poll() is None
            time.sleep(0.05)
        caller.kill()
        caller.wait()
        workers[1].kill()
        assert not (tmp_path / "out" / "complete.json").exists()
        wb.batch(file, **QUICK, output=tmp_path / "out", scheduler=address)
    assert bytes_of(tmp_path / "out") == bytes_of(tmp_path / "serial")


def test_a_scheduler_that_is_not_there_is_a_mistake(experiment_file, tmp_path, capsys, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr("wirebayes.processes.workers._PATIENCE_S", 0.5)
    for address in ("tcp://127.0.0.1:9", "nonsense://x"):
        assert main(["batch", str(experiment_file()), "--scheduler", address, "--output", str(tmp_path / "out")]) == 2
        message = capsys.readouterr().err
        assert message.startswith(f"--scheduler {address}: found no Dask scheduler there")
        assert message.count("\n") == 1
    assert not (tmp_path / "out").exists()
