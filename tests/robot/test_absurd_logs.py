"""Logs that fit no robot near the file's: the search is given up and says so; and how far a search has come."""

import csv
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from tests.robot.test_commands import fitted, session_csv  # noqa: F401
from wirebayes.commands.calibrate import calibrate
from wirebayes.commands.wires import robot_of
from wirebayes.robot.mechanics.draws import WireDraws
from wirebayes.robot.self_calibration import descent, residuals, session_file, whole
from wirebayes.robot.self_calibration.session import LengthPrior
from wirebayes.robot.self_calibration.unknowns import StatedErrors
from wirebayes.robot.self_calibration.whole_answer import calibration_report
from wirebayes.strict.columns import columns_table

FIELD = Path(__file__).parent / "field" / "calibrate-wrong-anchors"
LINE = WireDraws({k: np.full(2, v) for k, v in {"k1": 5e3, "B": 0.09, "U": 0.6, "k2": 0.014, "N": 0.6}.items()}, 1000.0)
ROUGH = StatedErrors(0.05, 0.0, 0.0, None, 0.0)


def _turned_log(holds):
    """A printer's log whose joint values stand in the columns of the next wire each."""
    with open(FIELD / "hp-session.csv", newline="") as file:
        rows = list(csv.DictReader(file))[:holds]
    log = {name: [row[name] for row in rows] for name in rows[0]}
    joints = [f"joint_{i}_m" for i in range(1, 5)]
    return log | {name: log[other] for name, other in zip(joints, joints[1:] + joints[:1], strict=True)}


def _calibrated(holds=None, errors=ROUGH, **options):
    robot = robot_of(FIELD / "hp4-rough.toml")
    table = columns_table(_turned_log(holds), Path("log"), session_file.may_be_empty)
    read = session_file.parse_session(table, robot, 5.0, 1e-3)
    with np.errstate(all="ignore"):  # as the command has it
        return calibration_report(
            robot, LengthPrior(LINE, 0.05, 0.05), errors, *read, requests=True, visits=1, **options
        )


def test_a_log_that_fits_nothing_ends_early_and_says_how_far_off_it_is(monkeypatch):
    """Without an end to hopeless searches it took 6700 linearisations; a log of the printer's own takes 3400."""
    count, said = [], []
    for module in (descent, whole):
        monkeypatch.setattr(module, "linearised", _counted(module.linearised, count))
    found = _calibrated(progress=lambda name, done, total: said.append((name, done / total)))
    assert len(count) < 1500
    assert not found.content["usable"] and not found.content["with_creep_model"]["converged"]
    (notice,) = found.content["warnings"]
    assert notice["kind"] == "not-converged" and "m (root mean square) from what robot" in notice["text"]
    assert list(dict(said)) == ["start 1", "start 2", "start 3", "poses as requests", "without creep"]
    assert set(dict(said).values()) == {1.0}
    assert all(0.0 <= share <= 1.0 for _, share in said)


def test_the_share_of_a_part_never_falls():
    """Where exact joint values fit nothing, all starts come again with rough ones."""
    said = {}
    _calibrated(
        6, replace(ROUGH, joint_m=0.0), progress=lambda name, done, total: said.setdefault(name, []).append(done)
    )
    assert {"start 1", "rough start 1"} <= said.keys()
    assert all(shares == sorted(shares) and shares.count(1.0) == 1 for shares in said.values())


def _counted(function, count):
    def counted(*arguments):
        count.append(1)
        return function(*arguments)

    return counted


@pytest.mark.parametrize(
    ("share", "stated", "rounds"),
    [(0.0999, None, 8), (0.1001, None, 5), (0.1999, 0.2 / 3, 8), (0.2001, 0.2 / 3, 5)],
)
def test_a_search_is_given_up_where_loops_are_further_open_than_the_robot_or_its_errors_allow(
    monkeypatch, share, stated, rounds
):
    """A tenth of the robot, or three times the stated error of the joint values."""
    monkeypatch.setattr(whole, "_ROUNDS", 8)
    monkeypatch.setattr(whole, "_STILL", 0.0)  # no round is the last by itself
    monkeypatch.setattr(whole, "length_rms_m", lambda found: share * found.unknowns.robot.span_m)
    shares, robot = [], robot_of(FIELD / "hp4-rough.toml")
    whole_wire = robot.span_m / np.sqrt(np.mean(1 / robot.lines**2))  # of each line no more than its part is open
    errors = replace(ROUGH, joint_m=stated and stated * whole_wire)
    _calibrated(6, errors, progress=lambda name, done, total: shares.append(done) if name == "start 1" else None)
    assert shares == [*(k / 8 for k in range(rounds)), 1.0]


@pytest.mark.parametrize(
    ("share", "stated_m", "lost"),
    [(0.0099, None, False), (0.0101, None, True), (0.0101, 0.08, False), (0.0239, 0.08, False), (0.0241, 0.08, True)],
)
def test_loops_that_stay_a_hundredth_of_the_robot_open_are_another_robots(share, stated_m, lost):
    """Of four lines, each is a quarter of the loop; three times its stated error is no other robot."""
    equations = SimpleNamespace(residual=np.full((3, 2), 4 * share), rows={"loop": slice(0, 2)})
    robot = SimpleNamespace(lines=np.full(2, 4.0), span_m=2.5)
    found = SimpleNamespace(
        equations=equations,
        noise=SimpleNamespace(joint_m=2.5),
        unknowns=SimpleNamespace(robot=robot, errors=SimpleNamespace(joint_m=stated_m)),
    )
    assert residuals.length_rms_m(found) == pytest.approx(2.5 * share)
    assert residuals.lost(found) is lost
    equations.residual[0, 0] = np.nan
    assert residuals.lost(found)


def test_lengths_alone_say_how_far_they_have_come(fitted, session_csv, tmp_path):  # noqa: F811
    said = []
    calibrate(
        "linear-7", session_csv[0], fitted, next_poses=1, output=tmp_path / "out",
        progress=lambda name, done, total: said.append((name, done / total)),
    )  # fmt: skip
    assert dict(said) == {"lengths": 1.0, "without creep": 1.0}
