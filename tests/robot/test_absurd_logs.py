"""Logs that fit no robot near the file's: the search is given up and says so; and how far a search has come."""

import csv
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from tests.robot.test_commands import fitted, session_csv  # noqa: F401
from wirebayes.commands.calibrate import calibrate
from wirebayes.commands.wires import robot_of
from wirebayes.robot.mechanics.draws import WireDraws
from wirebayes.robot.self_calibration import descent, estimate, open_where, residuals, session_file
from wirebayes.robot.self_calibration.answer import calibration_report
from wirebayes.robot.self_calibration.equations import Holds, Noise, State
from wirebayes.robot.self_calibration.search import StatedPoses
from wirebayes.robot.self_calibration.session import LengthPrior
from wirebayes.robot.self_calibration.trust import SIGNIFICANT
from wirebayes.robot.self_calibration.unknowns import StatedErrors, Unknowns
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


def _calibrated(holds=None, errors=ROUGH, changed=lambda log: log, **options):
    robot = robot_of(FIELD / "hp4-rough.toml")
    table = columns_table(changed(_turned_log(holds)), Path("log"), session_file.may_be_empty)
    read = session_file.parse_session(table, robot, 5.0, 1e-3)
    with np.errstate(all="ignore"):  # as the command has it
        return calibration_report(
            robot, LengthPrior(LINE, 0.05, 0.05), errors, *read, poses=StatedPoses.EITHER, visits=1, **options
        )


def test_a_log_that_fits_nothing_ends_early_and_says_how_far_off_it_is(monkeypatch):
    """Without an end to hopeless searches it took 6700 linearisations; a log of the printer's own takes 3400."""
    count, said = [], []
    for module in (descent, estimate):
        monkeypatch.setattr(module, "linearised", _counted(module.linearised, count))
    found = _calibrated(progress=lambda name, done, total: said.append((name, done / total)))
    assert len(count) < 1500
    assert not found.content["usable"] and not found.content["with_creep_model"]["converged"]
    (notice,) = found.content["warnings"]
    assert notice["kind"] == "not-converged" and "m (root mean square) from what robot" in notice["text"]
    assert list(dict(said)) == ["start 1", "start 2", "start 3", "poses as requests", "without creep"]
    assert set(dict(said).values()) == {1.0}
    assert all(0.0 <= share <= 1.0 for _, share in said)


def test_the_share_of_a_part_never_falls(monkeypatch):
    """Where exact joint values fit nothing, all starts come again with rough ones."""
    monkeypatch.setattr(estimate, "_ROUNDS", 3)
    said = {}
    _calibrated(
        4, replace(ROUGH, joint_m=0.0), progress=lambda name, done, total: said.setdefault(name, []).append(done)
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
    monkeypatch.setattr(estimate, "_ROUNDS", 8)
    monkeypatch.setattr(estimate, "_STILL", 0.0)  # no round is the last by itself
    monkeypatch.setattr(estimate, "length_rms_m", lambda found: share * found.unknowns.robot.span_m)
    shares, robot = [], robot_of(FIELD / "hp4-rough.toml")
    whole_wire = robot.span_m / np.sqrt(np.mean(1 / robot.lines**2))  # of each line no more than its part is open
    errors = replace(ROUGH, joint_m=stated and stated * whole_wire)
    _calibrated(6, errors, progress=lambda name, done, total: shares.append(done) if name == "start 1" else None)
    assert shares == [*(k / 16 for k in range(rounds)), 1.0]  # the other half is the search with finer slopes


@pytest.mark.parametrize(
    ("open_m", "given_up"),
    [
        ([0.1] * 10, False),
        ([0.1] * 11, True),
        ([0.1] * 10 + [0.0901], True),
        ([0.1] * 10 + [0.0899], False),
        ([0.0251] * 11, True),
        ([0.0249] * 11, False),
        ([0.02] + [0.1] * 20, False),
        ([0.2] * 4 + [0.251], True),
        ([0.2] * 4 + [0.249], False),
    ],
)
def test_a_search_whose_loops_come_no_tenth_nearer_in_ten_rounds_is_given_up(open_m, given_up):
    assert estimate._given_up(open_m, 0.25, 0.025) is given_up


@pytest.mark.parametrize(
    ("moved", "circling"),
    [
        ([0.1] * 10, False),
        ([0.1] * 11, True),
        ([0.1] * 10 + [0.0901], True),
        ([0.1] * 10 + [0.0899], False),
        ([0.0501] * 11, True),
        ([0.0499] + [0.06] * 10, False),
    ],
)
def test_unknowns_that_come_no_tenth_nearer_to_rest_in_ten_rounds_go_to_and_fro(moved, circling):
    assert estimate._no_nearer(moved, estimate._STILL) is circling


@pytest.mark.parametrize(
    ("p", "converges", "finer"), [(SIGNIFICANT, True, 4), (SIGNIFICANT, False, 49), (0.99 * SIGNIFICANT, False, 0)]
)
def test_a_search_that_goes_to_and_fro_goes_on_with_slopes_by_every_tension(monkeypatch, p, converges, finer):
    """It then has as many rounds as are left; where it explains nothing that was read, it ends."""
    each = []

    def a_round(search):
        each.append(search.each)
        search.rounds.append(None)
        at_rest = converges and each.count(True) == finer
        search.passed = [search.state]
        search.state = replace(search.state, white=search.state.white + (0.0 if at_rest else 1.0))
        return _at(search, cost=1.0)

    monkeypatch.setattr(estimate._Search, "_round", a_round)
    monkeypatch.setattr(estimate._Search, "_settled", lambda search, found: True)
    monkeypatch.setattr(estimate._Search, "_leads_nowhere", lambda search, found: False)
    monkeypatch.setattr(estimate._Search, "_go_on", lambda search, *arguments: None)
    monkeypatch.setattr(estimate, "trust", lambda found: p)
    found = _search().at_rest(lambda share: None)
    assert found.converged is converges
    assert (each.count(False), each.count(True)) == (11, finer)


@pytest.mark.parametrize(("cost", "ends"), [(1e300, False), (np.inf, True)])
def test_a_search_ends_where_its_equations_are_no_numbers(monkeypatch, cost, ends):
    """All searches for exact joint values of another robot came there; from no numbers there is no step."""
    monkeypatch.setattr(estimate, "length_rms_m", lambda found: 0.0)
    monkeypatch.setattr(estimate, "most_open_m", lambda found, share: 1.0)
    monkeypatch.setattr(estimate, "lost_m", lambda found: 1.0)
    monkeypatch.setattr(estimate, "contradicted", lambda found: False)
    search = _search()
    assert search._leads_nowhere(_at(search, cost)) is ends


@pytest.mark.parametrize(
    ("follow", "each", "unusual", "given_up"),
    [(True, False, True, True), (False, False, True, False), (True, True, True, False), (True, False, False, False)],
)
def test_where_other_starts_follow_loops_that_stay_unusually_open_end_a_search(
    monkeypatch, follow, each, unusual, given_up
):
    """But for slopes by every tension, which come in where a search is at rest or goes to and fro."""
    monkeypatch.setattr(estimate, "length_rms_m", lambda found: 0.001)
    monkeypatch.setattr(estimate, "most_open_m", lambda found, share: 1.0)
    monkeypatch.setattr(estimate, "lost_m", lambda found: 0.01)
    monkeypatch.setattr(estimate, "contradicted", lambda found: False)
    monkeypatch.setattr(estimate, "unusually_open", lambda found: unusual)
    search = _search(follow)
    search.each = each
    ends = [search._leads_nowhere(_at(search, 1.0)) for _ in range(11)]
    assert ends == [False] * 10 + [given_up]


@pytest.mark.parametrize(("p", "unusual"), [(0.00251, False), (0.00249, True)])
def test_loops_are_unusually_open_where_their_share_of_the_level_is_lost(monkeypatch, p, unusual):
    """A hundredth, shared by four tests."""
    monkeypatch.setattr(residuals, "_usual_noise", lambda found: p)
    assert residuals.unusually_open(None) is unusual


@dataclass(frozen=True)
class _Found:
    """As much of a posterior as a search asks for."""

    covariance: np.ndarray
    cost: float
    converged: bool = True


def _at(search, cost):
    return _Found(np.eye(len(search.state.white)), cost)


def _search(others_follow=False):
    """A search of a printer's log that has not begun."""
    robot = robot_of(FIELD / "hp4-rough.toml")
    table = columns_table(_turned_log(3), Path("log"), session_file.may_be_empty)
    session, _ = session_file.parse_session(table, robot, 5.0, 1e-3)
    holds = Holds(session, np.full(session.joint_m.shape, np.nan))
    unknowns = Unknowns(robot, LengthPrior(LINE, 0.05, 0.05), ROUGH)
    state = State(np.zeros(unknowns.count), session.position_m, session.rotation, np.ones(session.joint_m.shape))
    noise = Noise(1.0, 1.0, 1.0, 1.0, 1.0)
    return estimate._Search(unknowns, holds, noise, state, None, others_follow)


def test_a_column_of_other_holds_ends_early_and_is_named(monkeypatch):
    """Each search took all 60 rounds; the joint values of wire 3 stand in the rows of other holds."""
    said = []

    def mixed_up(log):
        joints = [log[f"joint_{i}_m"] for i in (4, 1, 2, 3)]  # back from where `_turned_log` has them
        return log | {f"joint_{i}_m": values[::-1] if i == 3 else values for i, values in enumerate(joints, 1)}

    found = _calibrated(24, changed=mixed_up, progress=lambda name, done, total: said.append((name, done)))
    for name in ("start 1", "start 2", "start 3"):
        assert len([1 for one, _ in said if one == name]) <= 13  # eleven rounds, the end
    (notice,) = found.content["warnings"]
    assert ", mostly in joint value 3 (" in notice["text"]


@pytest.mark.parametrize(
    ("size", "noise_m", "stated_m", "said"),
    [(3.8, 1e-3, None, False), (4.0, 1e-3, None, True), (4.0, 1e-5, None, False), (4.0, 1e-3, 1e-3, False)],
)
def test_a_hold_that_stands_out_where_the_error_was_estimated_with_it_is_named(
    monkeypatch, size, noise_m, stated_m, said
):
    """24 holds of 8 wires and 6 degrees of freedom; in one of them its share has a chance of 1.9e-4, or of 7.7e-5."""
    monkeypatch.setattr(open_where, "leverage", lambda found, rows: np.full((24, 8), 0.75))
    residual = np.ones((24, 8))
    residual[5, 1] = size * np.sqrt(8)
    found = SimpleNamespace(
        equations=SimpleNamespace(residual=residual, rows={"loop": slice(0, 8)}),
        noise=SimpleNamespace(joint_m=noise_m),
        unknowns=SimpleNamespace(
            robot=SimpleNamespace(lines=np.ones(8), span_m=3.0), errors=SimpleNamespace(joint_m=stated_m)
        ),
    )
    notices = open_where.odd_hold(found, SimpleNamespace(numbers=np.arange(11, 35)))
    assert [notice.text.startswith("hold 16 contradicts the others") for notice in notices] == [True] * said
    assert all("most of it joint value 2;" in notice.text for notice in notices)


@pytest.mark.parametrize(
    ("shape", "large", "size", "said"),
    [
        ((6, 4), (slice(None), 2), 2.15, ", mostly in joint value 3 (61 % of the sum of squares)"),
        ((6, 4), (slice(None), 2), 2.1, ""),
        ((6, 3), (slice(None), 2), 9.0, ""),
        ((6, 8), (slice(None), [1, 5]), 3.1, ", mostly in joint values 2 and 6 (76 % of the sum of squares)"),
        ((6, 8), (slice(None), [1, 5]), 2.9, ""),
        ((6, 4), (4, slice(None)), 2.3, ", mostly in hold 5 (51 %)"),
        ((6, 4), (4, slice(None)), 2.2, ""),
        ((3, 4), (1, slice(None)), 9.0, ""),
    ],
)
def test_what_is_open_is_placed_only_where_it_stands_out(shape, large, size, said):
    """Shares of the sum of squares on both sides of three fifths, three quarters and a half."""
    residual = np.ones(shape)
    residual[large] = size
    equations = SimpleNamespace(residual=residual, rows={"loop": slice(0, shape[1])})
    robot = SimpleNamespace(lines=np.ones(shape[1]))
    found = SimpleNamespace(equations=equations, unknowns=SimpleNamespace(robot=robot))
    session = SimpleNamespace(numbers=np.arange(1, shape[0] + 1))
    assert open_where.most_open(found, session) == said


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
    assert dict(said) == {"start 1": 1.0, "without creep": 1.0}
