import json

import numpy as np
import pytest

from wirebayes.bayes.problem import Sample
from wirebayes.bayes.result import Stored
from wirebayes.cli import main
from wirebayes.wire.protocol import Protocol
from wirebayes.wire.staircase import Model

PROTOCOL = Protocol(
    length_mm=1000.0,
    displacement_mm=np.array([1.0, 13.0]),
    time_s=np.tile([0.0, 120.0], (2, 1)),
    mask=np.ones((2, 2), bool),
    duration_s=np.full(2, 120.0),
    number=np.arange(1, 3),
)


@pytest.fixture
def fitted(tmp_path, monkeypatch):
    """A folder whose posterior is made up: the commands see what a fit would have stored."""
    rng = np.random.default_rng(3)
    means = {"k1": 803, "B": 0.31, "U": 1.0, "k2": 0.03, "N": 0.64, "preload": -0.1, "sensor_sd": 0.01}
    stored = Stored(
        {k: m * np.exp(0.03 * rng.standard_normal(80)) for k, m in means.items()},
        Sample("made-up", "made up", PROTOCOL, np.array([[0.85, 0.8], [7.65, 7.3]])[..., None], 0.01, Model()),
        "chain",
    )
    monkeypatch.setattr("wirebayes.bayes.result.load", lambda folder, experiment=None: stored)
    folder = tmp_path / "fit"
    folder.mkdir()
    (folder / "posterior.nc").write_bytes(b"made up")
    return folder


def test_pose_answers_and_repeats_to_the_byte(fitted, tmp_path, capsys):
    out = [tmp_path / "a", tmp_path / "b"]
    for folder in out:
        arguments = ["pose", "linear-6", "--wires", str(fitted), "--output", str(folder), "--times", "0,60"]
        assert main([*arguments, "--seed", "4"]) == 0
    assert "60" not in capsys.readouterr().err  # within the tested time: no warning about it
    first, second = ((folder / "pose.json").read_bytes() for folder in out)
    assert first == second
    said = json.loads(first)
    assert said["feasible"]
    assert said["forward"]["solved"] == 1.0
    assert said["forward"]["largest_round_trip_error_m"] < 1e-9
    assert [d["specimen_spread"] for d in said["drift"]] == [0.0, 0.05]
    for entry in said["drift"]:
        low, mid, high = (entry["distance_mm"][q][-1] for q in ("q05", "q50", "q95"))
        assert 0 < low < mid < high
    assert sum(said["variance_shares"]["shared_draw"].values()) == pytest.approx(1.0)
    hooke, aware = (
        next(e for e in said["pose_error"] if e["controller"] == c and e["specimen_spread"] == 0)["distance_mm"]["q50"]
        for c in ("hooke_only", "creep_aware")
    )
    assert aware[-1] < 0.6 * hooke[-1]
    assert (out[0] / "robot.png").stat().st_size > 1000


def test_a_pose_that_cannot_be_held_is_an_answer(fitted, tmp_path):
    out = tmp_path / "far"
    arguments = ["pose", "linear-6", "--wires", str(fitted), "--output", str(out), "--position", "5,0,0.6"]
    assert main(arguments) == 0
    said = json.loads((out / "pose.json").read_text())
    assert not said["feasible"]
    assert "sentence" in said


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["no-such-robot"], "no-such-robot"),
        (["linear-6", "--position", "1,2"], "--position"),
        (["linear-6", "--position", "1,2,nan"], "--position"),
        (["linear-6", "--times", "60,0"], "--times"),
        (["linear-6", "--times", "a"], "--times"),
    ],
)
def test_bad_input_is_one_plain_line_and_writes_nothing(fitted, tmp_path, capsys, arguments, said):
    out = tmp_path / "out"
    assert main(["pose", *arguments, "--wires", str(fitted), "--output", str(out)]) == 2
    line = capsys.readouterr().err.strip()
    assert said in line
    assert "\n" not in line
    assert not out.exists()


def test_a_folder_without_a_posterior_is_refused(tmp_path, capsys):
    assert main(["pose", "linear-6", "--wires", str(tmp_path), "--output", str(tmp_path / "o")]) == 2
    assert "posterior.nc" in capsys.readouterr().err
    (tmp_path / "posterior.nc").write_text("not netcdf")
    assert main(["pose", "linear-6", "--wires", str(tmp_path), "--output", str(tmp_path / "o")]) == 2
    assert "posterior.nc" in capsys.readouterr().err
