"""`import wirebayes as wb`: light, complete, and without a name that two things share."""

import gc
import os
import pkgutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas
import pytest

import wirebayes as wb
from wirebayes.cli import main
from wirebayes.io import paper

FUNCTIONS = {
    "read_experiments", "from_arrays", "fit", "compare", "discover", "predict", "simulate_tests", "load", "read_robot",
    "pose", "calibrate", "export", "list_effects", "write_report", "reproduce_paper", "import_bench",
    "batch", "new_experiment", "check", "plan", "import_robot",
}  # fmt: skip
FEW = wb.Policy(walkers=32, ess=300, rounds=2, round_draws=1024, block=20, most_steps=60, r_hat=1.5)
DOCS = Path(wb.__file__).parents[1] / "docs"
HEAVY = ("numpy", "scipy", "xarray", "matplotlib", "emcee", "arviz", "arviz_base", "pint", "openpyxl")


def test_the_import_loads_nothing_heavy():
    code = f"import sys, wirebayes; dir(wirebayes); print([m for m in {HEAVY} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_every_function_is_there_and_listed():
    assert FUNCTIONS <= set(wb.__all__) <= set(dir(wb))
    for name in wb.__all__:
        assert getattr(wb, name) is getattr(wb, name)
    with pytest.raises(AttributeError, match="no attribute 'fits'"):
        _ = wb.fits


def test_no_public_name_is_that_of_a_submodule():
    assert not {module.name for module in pkgutil.iter_modules(wb.__path__)} & set(wb.__all__)


def test_arrays_are_the_same_test_as_the_file():
    nylon = paper.experiments()[2]
    recorded = nylon.recorded_holds
    columns = {
        "hold": np.concatenate([np.full(h.time_s.size, h.number) for h in recorded]),
        "displacement_mm": np.concatenate([np.full(h.time_s.size, h.displacement_mm) for h in recorded]),
        "time_s": np.concatenate([h.time_s for h in recorded]),
        "tension_N": np.concatenate([h.tension_N for h in recorded]),
    }
    gaps = [
        {
            "before_hold": next(k.number for k in nylon.holds[i:] if k.recorded),
            "displacement_mm": h.displacement_mm,
            "duration_s": h.duration_s,
        }
        for i, h in enumerate(nylon.holds)
        if not h.recorded
    ]
    about = {
        "length_mm": nylon.length_mm,
        "name": nylon.name,
        "material": nylon.material,
        "resolution_N": nylon.resolution_N,
        "unrecorded_holds": gaps,
    }
    one, other = wb.from_arrays(**columns, **about), wb.from_arrays(columns, **about)
    assert one.data_hash == other.data_hash == nylon.data_hash


GOOD = {
    "hold": [1, 1, 1, 2, 2],
    "displacement_mm": [1.0, 1.0, 1.0, 2.0, 2.0],
    "time_s": [0.0, 30.0, 60.0, 0.0, 30.0],
    "tension_N": [2.1, 1.9, 1.8, 2.5, 2.3],
}
HIDDEN = np.ma.masked_greater([2.1, 999.0, 1.9, 2.0, 2.0], 100.0)  # a reading that is marked as invalid
ABOUT = {"length_mm": 1200.0, "name": "wire", "material": "line"}


@pytest.mark.parametrize(
    ("column", "values", "message"),
    [
        ("time_s", [0, 30, 30, 0, 30], r"row 2 .from 0., column time_s: found 30, expected a time after 30 s"),
        ("hold", [1, 1, 1, 2.5, 2], r"row 3 \(from 0\), column hold: found '2.5', expected a whole number"),
        ("hold", [2, 2, 2, 1, 1], r"row 3 \(from 0\), column hold: found 1, expected a hold number above 2"),
        ("displacement_mm", [1, 1, 2, 2, 2], r"row 2 .from 0., column displacement_mm: found 2, expected 1 as before"),
        ("tension_N", [2, 1, 1], "column tension_N: found 3 values, expected 5 as in hold"),
        ("temperature_C", [20, 20, -300, 20, 20], r"row 2 .from 0., column temperature_C: found -300, expected"),
    ],
)
def test_a_mistake_in_arrays_is_named_by_row_and_column(column, values, message):
    with pytest.raises(wb.InputError, match=f"^from_arrays, {message}"):
        wb.from_arrays(**GOOD | {column: values}, **ABOUT)


@pytest.mark.parametrize(
    ("about", "message"),
    [
        ({"length_mm": -1}, "argument length_mm: found -1, expected a length above 0 mm"),
        ({"name": "a b"}, "argument name: found 'a b', expected a name of letters"),
        ({"resolution_N": -0.1}, "argument resolution_N: found -0.1, expected a step above 0 N"),
        (
            {"unrecorded_holds": [{"before_hold": 9, "displacement_mm": 1, "duration_s": 3}]},
            r"argument unrecorded_holds\[0\].before_hold: found 9, expected a hold number from 0 to 2",
        ),
    ],
)
def test_a_wrong_argument_is_named(about, message):
    with pytest.raises(wb.InputError, match=f"^from_arrays, {message}"):
        wb.from_arrays(**GOOD, **ABOUT | about)


def test_a_table_without_a_column_is_refused():
    with pytest.raises(wb.InputError, match="found no column time_s, expected a header of hold,displacement_mm,time_s"):
        wb.from_arrays({k: v for k, v in GOOD.items() if k != "time_s"}, **ABOUT)
    with pytest.raises(wb.InputError, match=r"found 'force', expected a header of hold"):
        wb.from_arrays(GOOD | {"force": [1] * 5}, **ABOUT)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"elastic_law": "hook"}, "elastic_law: found 'hook'.* expected hooke or modified"),
        ({"seed": -1}, "seed: found -1, expected a whole number, 0 or more"),
        ({"train_holds": 2.5}, "train_holds: found 2.5, expected a whole number"),
        ({"effects": "nope"}, "effect nope: no such effect"),
        ({"experiment": "x"}, "found no experiment 'x'"),
        ({"experiment": "w", "together": "w"}, "--together w: found --experiment w beside it, expected one of the two"),
    ],
)
def test_a_wrong_option_of_fit_is_named(options, message):
    with pytest.raises(wb.InputError, match=message):
        wb.fit(wb.from_arrays(**GOOD, **ABOUT), **options)


def test_what_is_no_test_at_all_is_named():
    with pytest.raises(wb.InputError, match="source: found int, expected the path of a file or Experiments"):
        wb.fit(3)
    for tests in (0, -1, 1.5, True):
        with pytest.raises(wb.InputError, match=f"--tests: found {tests}, expected a whole number, 1 or more"):
            wb.simulate_tests(tests=tests)
    assert len(wb.simulate_tests(tests=np.int64(2), seed=1).experiments) == 2
    for times, found in ((-1, "-1"), ([None], "None"), ("a", "a")):
        with pytest.raises(wb.InputError, match=f"--times: found .?{found}"):
            wb.simulate_tests(times=times)
    with pytest.raises(wb.InputError, match="output: found 3, expected a path"):
        wb.check(wb.from_arrays(**GOOD, **ABOUT), output=3)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda test: wb.read_experiments(3), "path: found 3, expected a path"),
        (lambda test: wb.read_robot(None), "robot: found None, expected a path"),
        (lambda test: wb.load(3), "folder: found 3, expected a path"),
        (lambda test: wb.write_report(None), "folder: found None, expected a path"),
        (lambda test: wb.new_experiment(3), "folder: found 3, expected a path"),
        (lambda test: wb.reproduce_paper(3), "output: found 3, expected a path"),
        (lambda test: wb.import_robot(3, "robot.toml"), "files: found 3, expected a path"),
        (lambda test: wb.import_bench([3], length_mm=1000), "raw: found 3, expected a path"),
        (lambda test: wb.import_bench("x.csv", length_mm="1 m"), "--length-mm: found '1 m', expected a finite number"),
        (lambda test: wb.import_bench("x.csv", length_mm=1, mapping=3), "mapping: found 3, expected a name or several"),
        (lambda test: wb.batch(3), "sources: found int, expected paths of files or Experiments"),
        (lambda test: wb.fit(test, own_effects=3), "own_effects: found 3, expected a path"),
        (lambda test: wb.fit(test, effects=[3]), "effects: found 3, expected a name or several"),
        (lambda test: wb.fit(test, together=3), "--together: found 3, expected a material"),
        (lambda test: wb.discover(test, without=3), "without: found 3, expected a name or several"),
        (lambda test: wb.plan(test, budget_min="1 h"), "--budget-min: found '1 h', expected a finite number above 0"),
        (lambda test: wb.plan(test, experiment="nope"), "found no experiment 'nope', expected one of"),
        (lambda test: wb.plan(test, aim=3), "--aim: found 3, expected a name or several"),
        (lambda test: wb.pose("linear-7", draws=0), "--draws: found 0, expected a whole number, 1 or more"),
        (lambda test: wb.export("linear-7", draws="x"), "--draws: found 'x', expected a whole number, 1 or more"),
        (lambda test: wb.pose("linear-7", payload="1 kg"), "--payload: found '1 kg', expected kilograms, 0 or more"),
        (lambda test: wb.pose("linear-7", tolerance=None), "--tolerance: found None, expected a finite number above 0"),
        (lambda test: wb.pose("linear-7", specimen_spread="5 %"), "--specimen-spread: found '5 %', expected a number"),
        (
            lambda test: wb.calibrate("linear-7", {}, tension_sd="x"),
            "--tension-sd: found 'x', expected a finite number",
        ),
        (
            lambda test: wb.calibrate("linear-7", {}, anchor_sd=None),
            "--anchor-sd: found None, expected a finite number",
        ),
        (lambda test: wb.calibrate("linear-7", {}, next_poses=1.5), "--next-poses: found 1.5, expected a whole number"),
        (lambda test: wb.simulate_tests(parameters=3), "parameters: found 3, expected values by name"),
        (lambda test: wb.simulate_tests(unload=-1), "--unload: found -1, expected a whole number, 0 or more"),
        (
            lambda test: wb.simulate_tests(resolution=-1),
            "--resolution: found -1, expected a finite number of",
        ),
        (lambda test: wb.from_arrays(**GOOD, **ABOUT, control=[]), "control: found .., expected .displacement."),
        (
            lambda test: wb.from_arrays(**GOOD, **ABOUT, unrecorded_holds=3),
            "unrecorded_holds: found 3, expected",
        ),
        (lambda test: wb.from_arrays(**GOOD, **ABOUT, unrecorded_holds=[3]), "unrecorded_holds.0.: found 3, expected"),
    ],
)
def test_an_argument_of_a_wrong_kind_is_refused_in_one_line(call, message):
    test = wb.from_arrays(**GOOD, **ABOUT)
    with pytest.raises(wb.InputError, match=message) as refused:
        call(test)
    assert "\n" not in str(refused.value)


def test_a_column_may_come_from_a_generator_and_no_unrecorded_hold_may_be_none():
    made = wb.from_arrays(
        **GOOD | {"tension_N": (value for value in GOOD["tension_N"])}, **ABOUT, unrecorded_holds=None
    )
    assert made.data_hash == wb.from_arrays(**GOOD, **ABOUT).data_hash


SCRIPT = """
import wirebayes as wb
print("script", flush=True)
few = wb.Policy(walkers=32, ess=300, rounds=2, round_draws=1024, block=20, most_steps=60, r_hat=1.5)
made = wb.simulate_tests(tests=2, displacements=range(1, 6), times=[0, 30, 60], seed=1)
fitted = wb.fit(made.experiments, check=False, policy=few)
print(list(fitted))
"""


def test_a_script_needs_no_guard(tmp_path):
    """Processes that fit must not run the script again; two fits on two cores start some."""
    (tmp_path / "script.py").write_text(SCRIPT)
    pretend = "import os; os.sched_getaffinity = lambda _: {0, 1}"
    (tmp_path / "sitecustomize.py").write_text(pretend)
    paths = os.pathsep.join([str(tmp_path), str(Path(wb.__file__).parents[1])])
    done = subprocess.run(
        [sys.executable, tmp_path / "script.py"],
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": paths},
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == "script\n['wire-1', 'wire-2']\n"


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """A quick fit and a simulated test as functions leave them, and the same of the command line."""
    folder = tmp_path_factory.mktemp("folders")
    options = {"displacements": [1, 2, 3, 4, 5, 6], "times": [0, 30, 60], "seed": 3, "parameters": {"k1": 700}}
    made = wb.simulate_tests(**options, output=folder / "simulated")
    command = "simulate --displacements 1,2,3,4,5,6 --times 0,30,60 --seed 3 --parameter k1=700 --output"
    assert main([*command.split(), str(folder / "simulate")]) == 0
    wb.fit(made.experiments, policy=FEW, check=False, output=folder / "fit")
    return folder


def bytes_of(folder):
    return {path.name: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_a_function_writes_what_its_command_writes(folders, tmp_path, capsys):
    assert bytes_of(folders / "simulated") == bytes_of(folders / "simulate")
    fit = folders / "fit" / "wire"
    assert main(["export", "hangprinter-4", "--wires", str(fit), "--draws", "50", "--output", str(tmp_path / "a")]) == 0
    wb.export("hangprinter-4", wb.load(folders / "fit"), draws=50, output=tmp_path / "b")
    assert bytes_of(tmp_path / "a") == bytes_of(tmp_path / "b")
    capsys.readouterr()
    columns = {"hold": [6, 6, 6, 7, 7], "displacement_mm": [6, 6, 6, 7, 7], "time_s": [0, 30, 60, 0, 150]}
    rows = zip(*columns.values(), strict=True)
    (tmp_path / "p.csv").write_text(",".join(columns) + "\n" + "".join(f"{a},{b},{c}\n" for a, b, c in rows))
    assert main(["predict", str(fit), str(tmp_path / "p.csv"), "--output", str(tmp_path / "a.csv")]) == 0
    predicted = wb.predict(wb.load(fit), columns, output=tmp_path / "b.csv")
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()
    assert capsys.readouterr().err == f"{tmp_path / 'p.csv'}: {predicted.attrs['prediction']}\n"
    assert [predicted[name].attrs["units"] for name in ("mean_N", "time_s", "displacement_mm")] == ["N", "s", "mm"]


def test_results_are_saved_and_loaded_again(folders, tmp_path):
    one = wb.load(folders / "fit")
    again = wb.load(one.save(tmp_path / "fit"))
    assert bytes_of(tmp_path / "fit") == bytes_of(folders / "fit")
    assert repr(again) == repr(one) == "Posterior(wire, chain hooke saturating, converged)"
    assert again.summary() == one.summary()
    assert again.to_datatree().identical(one.to_datatree())
    assert again.save(tmp_path / "fit") == tmp_path / "fit"  # what is there already
    assert "<td>k1</td>" in one._repr_html_()
    made = wb.load(folders / "simulated")
    with pytest.raises(wb.InputError, match="made with another configuration"):
        made.save(tmp_path / "fit")
    assert wb.load(folders / "fit" / "wire").draws().keys() == one.draws().keys()


def test_a_temporary_folder_goes_with_the_last_result():
    posterior = wb.simulate_tests(displacements=[1, 2], seed=1)
    folder = posterior.folder
    assert folder.is_dir()
    del posterior
    gc.collect()
    assert not folder.exists()


def test_unfinished_or_foreign_folders_are_not_loaded(folders, tmp_path):
    with pytest.raises(wb.InputError, match="found no configuration.json"):
        wb.load(tmp_path)
    half = wb.load(folders / "simulated").save(tmp_path / "half")
    (half / "complete.json").unlink()
    with pytest.raises(wb.InputError, match="found unfinished results"):
        wb.load(half)


def test_a_protocol_in_memory_is_checked_by_row_and_column(folders):
    posterior = wb.load(folders / "fit")
    with pytest.raises(wb.InputError, match=r"^protocol, row 1 \(from 0\), column time_s: found 0, expected a time"):
        wb.predict(posterior, {"hold": [7, 7], "displacement_mm": [7, 7], "time_s": [0, 0]})
    with pytest.raises(wb.InputError, match=r"^protocol, row 0 \(from 0\), column displacement_mm: found 2, expect"):
        wb.predict(posterior, {"hold": [1, 1, 1], "displacement_mm": [2, 2, 2], "time_s": [0, 30, 60]})
    given = {"hold": [7, 7], "displacement_mm": [7, 7], "time_s": [0, 9], "tension_N": [3.0, np.nan]}
    assert wb.predict(posterior, given)["mean_N"][0] == 3.0


def test_a_data_frame_is_taken_as_it_is(folders):
    made = wb.load(folders / "simulated")
    frame = pandas.read_csv(folders / "simulated" / "wire.csv")
    (read,) = made.experiments
    about = {"length_mm": read.length_mm, "name": read.name, "material": read.material, "resolution_N": 0.01}
    assert wb.from_arrays(frame, **about).data_hash == read.data_hash
    columns = [frame[name] for name in frame.columns]
    assert wb.from_arrays(*columns, **about).data_hash == read.data_hash
    later = pandas.DataFrame({"hold": [7, 7], "displacement_mm": [7.0, 7.0], "time_s": [0, 30]})
    later["tension_N"] = [None, None]
    predicted = wb.predict(wb.load(folders / "fit"), later)
    assert predicted.to_dataframe()["hold"].tolist() == [7, 7]
    assert predicted.equals(wb.predict(folders / "fit", later.drop(columns="tension_N")))


def test_a_session_in_memory_is_checked_by_row_and_column(folders):
    frame = pandas.read_csv(DOCS / "example" / "linear-7-session.csv")
    frame.loc[2, "duration_s"] = 0.0
    message = r"^readings, row 2 \(from 0\), column duration_s: found '0', expected a number above 0"
    with pytest.raises(wb.InputError, match=message):
        wb.calibrate("linear-7", frame, folders / "fit" / "wire")
    with pytest.raises(
        wb.InputError, match="^readings, columns: found no column duration_s, expected a header of hold,"
    ):
        wb.calibrate("linear-7", {"hold": [1]}, folders / "fit" / "wire")


def test_a_folder_of_another_configuration_is_refused(folders):
    with pytest.raises(wb.InputError, match="made with another configuration: seed is 3 there, 4 here"):
        wb.simulate_tests(
            displacements=range(1, 7), times=[0, 30, 60], seed=4, parameters={"k1": 700}, output=folders / "simulated"
        )
