"""`wirebayes predict` from the command line: what it answers and what it refuses."""

import csv
import json
import shutil
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

import wirebayes as wb
from wirebayes import cli
from wirebayes.commands.wire_draws import wire_draws
from wirebayes.commands.wires import read_robot
from wirebayes.inference.fit import fit_problem
from wirebayes.inference.policy import Policy
from wirebayes.io.paper import FOLDER, experiments
from wirebayes.model.build import build
from wirebayes.model.spec import ModelSpec
from wirebayes.results.read_back import load_posterior
from wirebayes.results.store import save_posterior
from wirebayes.robot.mechanics.wire_doubts import wire_warnings

QUICK = Policy(ensembles=2, walkers=64, ess=300.0, r_hat=1.1, most_steps=80)
TRAINED = 8


@pytest.fixture(scope="module")
def fits(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Posteriors of two wires after their first holds, chain and hold by hold, in folders as `fit` leaves them."""
    folder = tmp_path_factory.mktemp("fits")
    for likelihood in ("chain", "hold"):
        for experiment in experiments()[1:3]:
            result = fit_problem(
                build([experiment.train(TRAINED)], spec=ModelSpec(likelihood=likelihood)), 1, policy=QUICK
            )
            place = folder / likelihood / experiment.name
            place.mkdir(parents=True)
            save_posterior(result, place, {})
    return folder


@pytest.fixture
def protocol(tmp_path: Path) -> Callable[..., Path]:
    """A protocol of the Roc 1.71 m wire: the given holds of its table, lines changed as asked."""

    def write(holds: list[int], *, first: bool = False, changes: dict[str, str] | None = None) -> Path:
        table = list(csv.reader((FOLDER / "roc-line-1.71m.csv").read_text().splitlines()))
        header, rows = table[0][:3] + ["tension_N"] * first, [r for r in table[1:] if int(r[0]) in holds]
        lines = [",".join(r[:3] + ([r[3] if r[2] == "0" else ""] if first else [])) for r in rows]
        text = "\n".join([",".join(header), *lines]) + "\n"
        for old, new in (changes or {}).items():
            assert old in text
            text = text.replace(old, new, 1)
        path = tmp_path / "protocol.csv"
        path.write_text(text)
        return path

    return write


def predicted(fits: Path, protocol: Path, *more: str, likelihood: str = "chain") -> list[dict[str, str]]:
    out = protocol.parent / "predicted.csv"
    name = () if "--experiment" in more else ("--experiment", "roc-line-1.71m")
    assert cli.main(["predict", str(fits / likelihood), str(protocol), "--output", str(out), *name, *more]) == 0
    return list(csv.DictReader(out.read_text().splitlines()))


def test_a_prediction_is_saved_as_the_command_writes_and_prints_it(
    fits: Path, protocol: Callable[..., Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = predicted(fits, protocol([7, 9]), "--json")
    printed = json.loads(capsys.readouterr().out)
    found = wb.predict(fits / "chain", tmp_path / "protocol.csv", experiment="roc-line-1.71m")
    assert found.summary() == printed and len(printed["readings"]) == len(rows)
    folder = found.save(tmp_path / "kept")
    assert (folder / "predicted.csv").read_bytes() == (tmp_path / "predicted.csv").read_bytes()
    assert json.loads((folder / "predicted.json").read_text()) == printed
    assert found.save(folder) == folder
    for other in (tmp_path, tmp_path / "predicted.csv"):
        with pytest.raises(wb.InputError, match="expected a new or empty folder"):
            found.save(other)


def test_a_row_for_each_row_with_ordered_quantiles(fits: Path, protocol: Callable[..., Path]) -> None:
    rows = predicted(fits, protocol(list(range(2, 13))))
    assert len(rows) == 11 * 5
    assert ",".join(rows[0]) == "experiment,hold,displacement_mm,time_s,mean_N,sd_N,q05_N,q50_N,q95_N"
    assert [int(r["hold"]) for r in rows] == [h for h in range(2, 13) for _ in range(5)]
    assert all(float(r["q05_N"]) < float(r["q50_N"]) < float(r["q95_N"]) and float(r["sd_N"]) > 0 for r in rows)
    measured = experiments()[1].tension()[1:].ravel()
    miss = (measured - [float(r["mean_N"]) for r in rows]) / [float(r["sd_N"]) for r in rows]
    assert np.sqrt(np.mean(miss[: 7 * 5] ** 2)) < 1.5


def test_same_seed_same_bytes_and_another_seed_others(fits: Path, protocol: Callable[..., Path]) -> None:
    path = protocol([8, 9])
    one, again = (predicted(fits, path, "--seed", "3") for _ in range(2))
    other = predicted(fits, path, "--seed", "4")
    assert one == again != other


def test_later_holds_continue_the_tested_sample_unless_a_fresh_one_is_meant(
    fits: Path, protocol: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    after = predicted(fits, protocol([8, 12]))[5:]
    message = capsys.readouterr().err
    assert message.count("\n") == 1 and "hold 12 predicted as a continuation of the test" in message
    assert (
        "hold 8 predicted as replicates of the tested ones" in message and "holds 9 to 11 not in its history" in message
    )
    alone = predicted(fits, protocol([12]))
    assert alone == after
    assert "hold 12 predicted as a continuation of the test" in capsys.readouterr().err
    fresh = predicted(fits, protocol([12]), "--fresh")
    assert "fresh sample" in capsys.readouterr().err
    # a wire pulled to 12 mm at once has crept less before its first reading there
    assert float(fresh[0]["mean_N"]) > float(after[0]["mean_N"])


def test_a_fresh_sample_may_use_the_numbers_of_the_training(fits: Path, protocol: Callable[..., Path]) -> None:
    same = predicted(fits, protocol([12]), "--fresh")
    path = protocol([8], changes={f"8,8,{t}": f"8,12,{t}" for t in (0, 30, 60, 90, 120)})
    assert [{**row, "hold": "12"} for row in predicted(fits, path, "--fresh")] == same


def test_the_holds_to_come_are_met_without_repeating_the_training(fits: Path, protocol: Callable[..., Path]) -> None:
    rows = predicted(fits, protocol([9, 10, 11, 12]))
    measured = experiments()[1].tension()[8:].ravel()
    miss = np.abs(measured - [float(r["mean_N"]) for r in rows]) / [float(r["sd_N"]) for r in rows]
    fresh = predicted(fits, protocol([9, 10, 11, 12]), "--fresh")
    far = np.abs(measured - [float(r["mean_N"]) for r in fresh]) / [float(r["sd_N"]) for r in fresh]
    assert np.sqrt(np.mean(miss**2)) < 0.5 * np.sqrt(np.mean(far**2))


def test_given_first_readings_narrow_what_follows(fits: Path, protocol: Callable[..., Path]) -> None:
    free = predicted(fits, protocol(list(range(8, 13))))
    given = predicted(fits, protocol(list(range(8, 13)), first=True))
    table = [r for r in csv.DictReader((FOLDER / "roc-line-1.71m.csv").read_text().splitlines()) if int(r["hold"]) >= 8]
    for f, g, t in zip(free, given, table, strict=True):
        if t["time_s"] == "0":
            assert float(g["mean_N"]) == float(g["q05_N"]) == float(t["tension_N"]) and float(g["sd_N"]) == 0
        else:
            assert float(g["sd_N"]) < float(f["sd_N"])


def test_hold_by_hold_answers_from_the_first_reading(fits: Path, protocol: Callable[..., Path]) -> None:
    rows = predicted(fits, protocol([9, 10, 11, 12], first=True), likelihood="hold")
    table = [r for r in csv.DictReader((FOLDER / "roc-line-1.71m.csv").read_text().splitlines()) if int(r["hold"]) >= 9]
    miss = [float(r["mean_N"]) - float(t["tension_N"]) for r, t in zip(rows, table, strict=True)]
    assert np.sqrt(np.mean(np.square(miss))) < 0.03


@pytest.mark.parametrize(
    ("holds", "changes", "words"),
    [
        ([8, 9], {"8,8,30": "8,8,31"}, ["line 3", "column 3 (time_s)", "found 31", "0, 30, 60, 90, 120"]),
        ([8, 9], {"8,8,0": "8,7,0"}, ["line 3", "displacement_mm"]),
        ([8, 9], {"8,8,120\n": ""}, ["time_s", "4 readings of hold 8", "expected 5"]),
        ([8, 9], {"9,9,120": "9,9,120\n9,9,150"}, []),
        ([2, 9], {"2,2,0\n2,2,30\n2,2,60\n2,2,90\n2,2,120\n9,9,0": "0,2,0\n8,8,0"}, ["hold"]),
    ],
)
def test_repeated_holds_must_be_as_trained(
    fits: Path,
    protocol: Callable[..., Path],
    capsys: pytest.CaptureFixture[str],
    holds: list[int],
    changes: dict[str, str],
    words: list[str],
) -> None:
    path = protocol(holds, changes=changes)
    out = path.parent / "no.csv"
    code = cli.main(["predict", str(fits / "chain"), str(path), "--experiment", "roc-line-1.71m", "--output", str(out)])
    assert code == (2 if words else 0)
    error = capsys.readouterr().err
    assert all(word in error for word in words) and "Traceback" not in error
    assert out.exists() == (not words)


def test_refusals_name_what_is_wrong(
    fits: Path, protocol: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    path = protocol([8, 9])

    def refused(*arguments: str) -> str:
        assert cli.main(["predict", *arguments]) == 2
        return capsys.readouterr().err

    out = ("--output", str(path.parent / "no.csv"))
    assert "nylon-1.5m, roc-line-1.71m" in refused(str(fits / "chain"), str(path), *out)
    assert "--experiment roc" in refused(str(fits / "chain"), str(path), *out, "--experiment", "roc")
    assert "no posterior.nc" in refused(str(path.parent), str(path), *out)
    assert "no such folder" in refused(str(path.parent / "none"), str(path), *out)
    wire = ("--experiment", "roc-line-1.71m")
    assert "--model plain" in refused(str(fits / "chain"), str(path), *out, *wire, "--model", "plain")
    hold = refused(str(fits / "hold"), str(path), *out, *wire)
    assert "tension_N" in hold and "first reading" in hold
    assert "no writable folder" in refused(str(fits / "chain"), str(path), *wire, "--output", str(path / "a" / "b.csv"))


def test_a_given_reading_far_from_what_is_expected_is_a_warning(
    fits: Path, protocol: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    rows = predicted(fits, protocol([9, 10]))
    mean, sd = (float(rows[0][name]) for name in ("mean_N", "sd_N"))
    given = next(line for line in protocol([9, 10], first=True).read_text().splitlines() if line.startswith("9,"))
    capsys.readouterr()
    # the warning looks at 500 draws, whose standard deviation is known to 3 %: four times that from the threshold
    for deviations, warned in ((4.35, False), (5.65, True), (-300.0, True)):
        changed = given.rsplit(",", 1)[0] + f",{mean + deviations * sd}"
        predicted(fits, protocol([9, 10], first=True, changes={given: changed}))
        shown = capsys.readouterr().err
        assert ("warning: hold 9: its first reading" in shown) == warned, deviations
        assert "hold 10" not in shown


def test_the_protocol_is_not_overwritten(
    fits: Path, protocol: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    path = protocol([9])
    before = path.read_bytes()
    name = ["--experiment", "roc-line-1.71m", "--output", str(path.parent / "." / path.name)]
    assert cli.main(["predict", str(fits / "chain"), str(path), *name]) == 2
    assert "found the protocol itself, expected another file" in capsys.readouterr().err
    assert path.read_bytes() == before


def test_what_speaks_against_the_fit_is_said_again(
    fits: Path, protocol: Callable[..., Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "fit"
    shutil.copytree(fits / "chain" / "roc-line-1.71m", folder)
    path, out = protocol([9]), tmp_path / "predicted.csv"
    asked = ["predict", str(folder), str(path), "--output", str(out)]
    assert cli.main(asked) == 0 and "warning" not in capsys.readouterr().err
    summary = json.loads((folder / "summary.json").read_text())
    (folder / "summary.json").write_text(json.dumps({"model_check": {"passed": True, "p": 0.3}} | summary))
    assert cli.main(asked) == 0 and "warning" not in capsys.readouterr().err
    (folder / "summary.json").write_text(
        json.dumps({"model_check": {"passed": False, "p": 0.0031, "alpha": 0.04, "simulations": 334}} | summary)
    )
    with h5py.File(folder / "posterior.nc", "r+") as file:
        file["posterior"].attrs["converged"] = 0
    assert cli.main(asked) == 0
    shown = capsys.readouterr().err
    assert "warning: the fit of roc-line-1.71m has not converged" in shown
    assert "warning: the model fitted to roc-line-1.71m does not describe its readings (p < 0.01)" in shown
    line = wire_draws(load_posterior(folder), 10)
    assert len(line.doubts) == 2
    use = np.ones(7), 1.0, np.full(7, 1e-3 * line.length_mm)
    assert wire_warnings(read_robot("linear-7"), line, *use)[:2] == [*line.doubts]
    written = tmp_path / "export"
    assert cli.main(["export", "hangprinter-4", "--wires", str(folder), "--output", str(written)]) == 0
    assert "warning: the fit of roc-line-1.71m has not converged" in capsys.readouterr().err
    assert "# Beware: the fit of roc-line-1.71m has not converged" in (written / "klipper.cfg").read_text()
