"""The few lines that a command ends with."""

import json
import sys
from contextlib import redirect_stderr
from pathlib import Path
from typing import Any

import pytest

import wirebayes as wb
from tests.simulated import simulated_tests
from wirebayes.answers import terminal
from wirebayes.answers.headline import findings_in_a_sentence
from wirebayes.answers.lines import for_terminal
from wirebayes.cli import answer
from wirebayes.sentences import p_in_words, spoken
from wirebayes.simulation.synthetic import Bench, Truth
from wirebayes.views.calibration import Calibration
from wirebayes.views.comparison import Comparison
from wirebayes.views.export import Export
from wirebayes.views.findings import Findings
from wirebayes.views.pose import Pose
from wirebayes.views.result import Given, ResultFolder

HELD_OUT = {"plain": {"rmse_N": 0.25}, "final": {"rmse_N": 0.05}}
SLIP = {
    "verdict": "ambiguous",
    "effects": ["grip_slip", "toe"],
    "set": ["grip_slip", "unknown", "toe"],
    "probabilities": {"grip_slip": 0.62, "toe": 0.14, "unknown": 0.17, "ageing": 0.07},
    "group": ["grip_slip", "toe", "ageing", "unknown"],
    "p_global": 0.001,
    "p_simulations": 999,
    "held_out": HELD_OUT,
    "next_measurement": "Unload.",
    "amplitudes": {"grip_slip": {"mean": 0.7, "q05": 0.25, "q50": 0.31, "q95": 0.38, "unit": "mm", "hold": 4}},
}
CLEAN = {
    "verdict": "nothing-missing",
    "effects": [],
    "set": [],
    "probabilities": {},
    "group": [],
    "p_global": 0.4,
    "p_simulations": 199,
    "held_out": HELD_OUT,
    "next_measurement": "Hold longer.",
    "amplitudes": {},
}


def stored(kind: type, folder: Path, name: str, content: dict[str, Any]) -> Any:
    """A result whose folder holds just this."""
    (folder / name).write_text(json.dumps(content))
    return kind(ResultFolder(folder))


def test_an_effect_is_spoken_of_in_words_with_its_hold() -> None:
    assert spoken("tension_dependent_rate") == "tension dependent rate"
    assert spoken("grip_slip@7") == "grip slip at hold 7"
    assert spoken("discrepancy@13:0.1:60.0:1.0:12.0") == "discrepancy"
    assert spoken("unknown") == "something unknown"


def test_an_error_on_held_out_holds_that_grows_is_said_to_be_no_better(tmp_path: Path) -> None:
    for after, said in ((0.25, "0.25 -> 0.25 N rms"), (0.26, "0.25 -> 0.26 N rms: no better")):
        held_out = {"plain": {"rmse_N": 0.25}, "final": {"rmse_N": after}}
        content = {"version": 2, "experiments": {"a": SLIP | {"held_out": held_out}}}
        assert (
            f"  error on holds kept out of the fit: {said}"
            in stored(Findings, tmp_path, "discovery.json", content).lines()
        )


def test_findings_name_effects_with_hold_unit_and_what_is_alike(tmp_path: Path) -> None:
    found = stored(Findings, tmp_path, "discovery.json", {"version": 2, "experiments": {"a": SLIP, "b": CLEAN}})
    assert found.lines() == [
        "a: something is missing; these readings do not tell what: grip slip (62 %), toe (14 %) or none "
        "of the catalogue (17 %) (p < 0.001)",
        "  grip slip at hold 4 0.31 [0.25, 0.38] mm: the wire slipped in its grip once",
        "  hard to distinguish on this protocol: ageing",
        "  error on holds kept out of the fit: 0.25 -> 0.05 N rms",
        "b: nothing is missing that these readings can show (p = 0.4)",
    ]
    assert found.next_step() == "a: Unload.\nb: Hold longer."
    few = {"warnings": [{"kind": "few-holds", "text": "2 holds: no effect can be established"}]}
    two = stored(Findings, tmp_path, "discovery.json", {"experiments": {"b": CLEAN | few}})
    assert two.lines() == ["b: nothing stands out (p = 0.4)"]


def test_under_weights_an_effect_is_one_of_the_instrument_that_is_there(tmp_path: Path) -> None:
    """Where the force is set no force sensor drifts: the gauge does, and it is read in mm."""
    drift = {"mean": 2e-5, "q05": 1e-5, "q95": 3e-5, "hold": None}
    named = SLIP | {"verdict": "named", "effects": ["sensor_drift"], "group": ["sensor_drift"]}
    for unit, what in (("N", "the force sensor drifts with time"), ("mm", "the gauge drifts with time")):
        held_out = {"plain": {f"rmse_{unit}": 0.25}, "final": {f"rmse_{unit}": 0.05}}
        report = named | {"held_out": held_out, "amplitudes": {"sensor_drift": drift | {"unit": f"{unit}/s"}}}
        found = stored(Findings, tmp_path, "discovery.json", {"experiments": {"a": report}})
        assert found.lines()[1] == f"  sensor drift 2e-05 [1e-05, 3e-05] {unit}/s: {what}"
        assert f"sensor drift is missing ({what})" in findings_in_a_sentence("a", report)


def test_files_for_other_programs_say_where_each_belongs(tmp_path: Path) -> None:
    exported = stored(Export, tmp_path, "export.json", {})
    assert exported.next_step() == f"read {tmp_path}"
    (tmp_path / "robot.xml").write_text("")
    view = f"python -m mujoco.viewer --mjcf={tmp_path / 'robot.xml'}"
    assert exported.next_step() == view
    (tmp_path / "klipper.cfg").write_text("")
    assert exported.next_step() == f"put the lines of {tmp_path / 'klipper.cfg'} into the printer's printer.cfg\n{view}"


@pytest.mark.parametrize(
    ("p", "simulations", "words"),
    [
        (0.001, 999, "p < 0.001"),
        (0.003, 334, "p < 0.01"),
        (0.01, 199, "p = 0.01"),
        (0.005, 199, "p < 0.01"),
        (0.34, 199, "p = 0.34"),
        (0.05, 19, "p < 0.1"),
    ],
)
def test_a_p_value_says_no_more_than_its_simulations_can(p: float, simulations: int, words: str) -> None:
    assert p_in_words(p, simulations) == words


def test_a_part_that_has_a_name_is_said_with_the_rest_that_has_none(tmp_path: Path) -> None:
    part = SLIP | {"verdict": "partial", "effects": ["grip_slip"]}
    found = stored(Findings, tmp_path, "discovery.json", {"version": 2, "experiments": {"a": part}})
    assert found.lines()[0] == "a: grip slip is missing, and something that is not in the catalogue (p < 0.001)"
    two = stored(Findings, tmp_path, "discovery.json", {"experiments": {"a": part | {"effects": ["grip_slip", "toe"]}}})
    assert two.lines()[0].startswith("a: grip slip and toe are missing, and something")


def test_something_unknown_does_not_hide_the_names_that_are_likely_beside_it(tmp_path: Path) -> None:
    """A remainder with toe at 90 % beside it, which is not quite enough to accept it, is no answer without a name."""
    open_ = SLIP | {"verdict": "unknown", "effects": [], "amplitudes": {}}
    likely = open_ | {"set": ["toe", "unknown"], "probabilities": {"toe": 0.89, "ageing": 0.03, "unknown": 0.08}}
    alone = open_ | {"set": ["unknown"], "probabilities": {"toe": 0.04, "unknown": 0.96}}
    found = stored(Findings, tmp_path, "discovery.json", {"version": 2, "experiments": {"a": likely, "b": alone}})
    assert found.lines() == [
        "a: something is missing that has no established name (p < 0.001)",
        "  its largest part may be toe (89 %) or none of the catalogue (8 %)",
        "b: something is missing that no effect in the catalogue explains (p < 0.001)",
    ]


def test_a_comparison_leaves_out_models_that_failed(tmp_path: Path) -> None:
    models = [{"name": n, "failed": f} for n, f in (("toe", None), ("plain", None), ("ageing", "no fit"))]
    found = stored(Comparison, tmp_path, "comparison.json", {"experiments": {"a": {"models": models}}})
    assert found.lines() == ["a: toe predicts left-out holds best, then plain"]


def test_a_comparison_says_errors_with_units_and_the_command_of_the_best_model(tmp_path: Path) -> None:
    law = {"elastic_law": "hooke", "history": "saturating", "likelihood": "chain", "failed": None, "effects": []}
    scored = [
        (name, law | {"name": name, "held_out": {"free": {"rmse_mm": e}}}) for name, e in (("a", 0.341), ("plain", 1.7))
    ]
    (_, best), (_, plain) = scored
    for changed, next_ in (
        ({"effects": ["grip_slip@3"]}, "wirebayes fit w.toml --effect grip_slip@3\nwirebayes discover w.toml"),
        ({"history": "additive"}, "wirebayes fit w.toml --history additive\nwirebayes discover w.toml"),
        ({}, "wirebayes discover w.toml"),  # a law of time that fit has no option for
        ({"effects": ["own_power"]}, "wirebayes discover w.toml"),  # a user's own: fit asks for its file
    ):
        table = {"base": "plain", "models": [best | changed, plain]}
        found = stored(Comparison, tmp_path, "comparison.json", {"experiments": {"w": table}})
        assert found.next_step(Given("w.toml")) == next_
        assert found.lines() == [
            "w: a predicts left-out holds best, then plain",
            "  rms error on the last holds: a 0.34 mm, plain 1.7 mm",
        ]
    table = {"base": "plain", "models": [plain]}
    found = stored(Comparison, tmp_path, "comparison.json", {"experiments": {"w": table}})
    assert found.next_step(Given("w.toml")) == "wirebayes fit w.toml\nwirebayes discover w.toml"


@pytest.mark.parametrize(
    ("elpd", "then", "next_"),
    [
        (7.6, ", which may be chance; then plain", "fit w.toml"),
        (9.6, ", then plain", "fit w.toml --effect grip_slip@3"),
    ],
)
def test_a_lead_that_may_be_chance_is_said_and_not_followed(tmp_path: Path, elpd: float, then: str, next_: str) -> None:
    law = {"elastic_law": "hooke", "history": "saturating", "likelihood": "chain", "failed": None}
    best = law | {"name": "slip", "effects": ["grip_slip@3"], "difference": {"elpd": elpd, "se": 4.3}}
    plain = law | {"name": "plain", "effects": [], "difference": {"elpd": 0.0, "se": 0.0}}
    table = {"base": "plain", "models": [best, plain]}
    found = stored(Comparison, tmp_path, "comparison.json", {"experiments": {"w": table}})
    assert found.lines() == [f"w: slip predicts left-out holds best{then}"]
    assert found.next_step(Given("w.toml")) == f"wirebayes {next_}\nwirebayes discover w.toml"


def test_a_pose_that_cannot_be_held_says_why(tmp_path: Path) -> None:
    found = stored(Pose, tmp_path, "pose.json", {"robot": "r", "feasible": False, "sentence": "Too heavy."})
    assert found.lines() == ["r: Too heavy."]


def test_a_pose_says_its_drift_for_each_spread(tmp_path: Path) -> None:
    far = {"q05": [0.0, 0.5], "q50": [0.0, 1.0], "q95": [0.0, 2.0]}
    drift = [{"specimen_spread": 0.05, "times_s": [0.0, 600.0], "distance_mm": far}]
    found = stored(Pose, tmp_path, "pose.json", {"robot": "r", "feasible": True, "drift": drift})
    (line,) = found.lines()
    assert line == "r: after 10 min the platform has drifted by 1 mm [0.5, 2] if wires cut from one line differ by 5 %"


NAMED = {"usable": True, "exit_points_m": {"sd": [[0.0]]}, "identified": {"not_determined": []}}


def test_a_calibration_offers_no_lengths_unless_it_converged(tmp_path: Path) -> None:
    known = {"converged": True, "length_m": {"mean": [1.0], "q05": [0.9], "q95": [1.1]}}
    content = {"robot": "r", "with_creep_model": known, "warnings": [], **NAMED}
    good = stored(Calibration, tmp_path, "calibration.json", content)
    assert good.lines() == ["r: zero-tension lengths in m: 1.00000 [0.90000, 1.10000]"]
    bad = {"robot": "r", "with_creep_model": known | {"converged": False}}
    assert stored(Calibration, tmp_path, "calibration.json", bad).lines() == ["r: not converged, no lengths to use"]


def test_what_is_found_is_used_and_what_is_not_is_measured(tmp_path: Path) -> None:
    for verdict, steps in (("named", 2), ("nothing-missing", 3), ("partial", 1), ("unknown", 1)):
        content = {"experiments": {"a": SLIP | {"verdict": verdict}}}
        first, *others = stored(Findings, tmp_path, "discovery.json", content).next_step().splitlines()
        assert len(others) == steps - 1
        assert first.startswith("Unload" if steps == 1 else f"wirebayes predict {tmp_path} {tmp_path}/a/next.csv")
        assert steps == 1 or others[0].startswith(f"wirebayes pose linear-7 --wires {tmp_path / 'a' / 'final'}  (")


def test_a_line_is_as_wide_as_the_terminal_and_a_number_stays_with_its_interval(monkeypatch) -> None:
    numbers = [f"B{i} 0.2402 [0.21, 0.2721] mm N⁻ᵁ" for i in range(6)]
    line = f"  creep law: {', '.join(numbers)}"
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "70")
    shown = for_terminal([line])
    assert max(map(len, shown)) <= 70 and [part[:4] for part in shown] == ["  cr", *(3 * ["    "])]
    assert all(any(number in part for part in shown) for number in numbers)
    monkeypatch.setenv("COLUMNS", "300")
    assert 70 < max(map(len, for_terminal([line]))) <= 100
    monkeypatch.setattr(sys.stdout, "isatty", lambda: False)  # as in a pipe
    assert for_terminal([line]) == [line]
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    assert len(for_terminal([line], sys.stderr)) > 1
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: False)  # warnings that go to a file, the answer to the terminal
    assert for_terminal([line], sys.stderr) == [line]


def test_a_command_stays_in_one_line_to_be_copied(monkeypatch) -> None:
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "40")
    command = f"wirebayes pose ROBOT.toml --wires {'a' * 40}"
    assert answer.next_lines(f"{command}\n{'word ' * 12}") == [
        f"Next: {command}",
        "  or: word word word word word word word",
        "    word word word word word",
    ]


def test_the_answer_stands_before_what_limits_it_and_the_next_step_behind(tmp_path, capfd) -> None:
    """On a terminal, where both streams meet."""
    few = {"warnings": [{"kind": "few-holds", "text": "2 holds: no effect can be established"}]}
    content = {"version": 2, "experiments": {"b": CLEAN | few}, **few}
    found = stored(Findings, tmp_path, "discovery.json", content)
    with redirect_stderr(sys.stdout):
        answer.print_answer(found)
    shown = capfd.readouterr().out.splitlines()
    starts = [line.split(":")[0].strip() for line in shown]
    assert starts == ["b", "warning", "Results", "Next", "or", "or"]


def test_json_is_the_summary_and_quiet_is_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = stored(Findings, tmp_path, "discovery.json", {"version": 2, "experiments": {"b": CLEAN}, "warnings": []})
    (tmp_path / "report.html").write_text("")
    known = Findings(found.place, computed=False)
    answer.conclude(known, as_json=True)
    assert json.loads(capsys.readouterr().out) == found.summary()
    answer.conclude(known, quiet=True)
    assert capsys.readouterr().out == ""
    answer.conclude(known)
    assert f"Results: {tmp_path} (open {tmp_path / 'report.html'})\n" in capsys.readouterr().out


def test_a_pose_that_no_draw_keeps_to_the_end_is_said_to_be_none(tmp_path: Path) -> None:
    band = {"q05": [0.0, None], "q50": [0.0, None], "q95": [0.0, None]}
    drift = {"distance_mm": band, "times_s": [0.0, 60.0], "specimen_spread": 0.0}
    lost = stored(Pose, tmp_path, "pose.json", {"robot": "r", "feasible": True, "drift": [drift], "wires": {}})
    assert lost.lines() == ["r: no draw of the wires could be solved"]
    band = {"q05": [0.0, 1.0], "q50": [0.0, 1.5], "q95": [0.0, 2.0]}
    held = stored(
        Pose,
        tmp_path,
        "pose.json",
        {"robot": "r", "feasible": True, "drift": [drift | {"distance_mm": band}], "wires": {}},
    )
    assert held.lines()[0].startswith("r: after 1 min the platform has drifted by 1.5 mm [1, 2]")


def test_a_pose_that_nothing_holds_leads_to_another_one(tmp_path: Path) -> None:
    found = {"robot": "r", "feasible": False, "sentence": "No.", "wires": {}, "warnings": []}
    assert stored(Pose, tmp_path, "pose.json", found).next_step().startswith("another pose or payload")
    held = stored(Pose, tmp_path, "pose.json", found | {"feasible": True})
    assert held.next_step().startswith("wirebayes calibrate")
    uncarried = found | {"warnings": [{"kind": "uncarried", "text": "No wire pulls upwards."}]}
    assert stored(Pose, tmp_path, "pose.json", uncarried).next_step().startswith("[plane]")


def test_lengths_that_did_not_converge_are_not_for_the_controller(tmp_path: Path) -> None:
    known = {"converged": False, "length_m": {"mean": [1.0], "q05": [0.9], "q95": [1.1]}}
    content = {"robot": "r", "with_creep_model": known, "usable": False, "warnings": []}
    bad = stored(Calibration, tmp_path, "calibration.json", content)
    assert bad.next_step().startswith("wirebayes calibrate FILE.toml with more poses")
    known = known | {"converged": True}
    content = {"robot": "r", "with_creep_model": known, "warnings": [], **NAMED}
    good = stored(Calibration, tmp_path, "calibration.json", content)
    assert good.next_step() == f"set the lengths of {tmp_path / 'calibration.json'} in the controller"
    content = content | {"usable": False}
    wrong = stored(Calibration, tmp_path, "calibration.json", content)
    assert wrong.next_step().startswith("wirebayes calibrate FILE.toml with more poses")


@pytest.mark.parametrize(
    ("end", "change", "begins"),
    [
        (1.0, "0.5", "give the controller the joint values of"),
        (1.0, "", "other commanded poses"),
        (None, "0.5", "check joint values or poses"),
    ],
)
def test_corrections_are_offered_only_where_there_are_some(
    tmp_path: Path, end: float | None, change: str, begins: str
) -> None:
    (tmp_path / "corrections.csv").write_text(f"time_s,joint_1_m,change_1_mm\n0.0,,\n60.0,,{change}\n")
    band = {"q05": [0.0, end], "q50": [0.0, end], "q95": [0.0, end]}
    drift = {"distance_mm": band, "times_s": [0.0, 60.0], "specimen_spread": 0.0}
    found = {"robot": "r", "feasible": True, "drift": [drift], "wires": {}, "warnings": []}
    assert stored(Pose, tmp_path, "pose.json", found).next_step().startswith(begins)
    for kind in ("misfit", "not-converged"):
        contradicted = found | {"warnings": [{"kind": kind, "text": "The readings contradict the joint values."}]}
        assert stored(Pose, tmp_path, "pose.json", contradicted).next_step().startswith("check the log's columns")
    (tmp_path / "corrections.csv").unlink()
    alone = stored(Pose, tmp_path, "pose.json", found).next_step()
    assert alone.startswith("wirebayes calibrate" if end else "another pose or payload")


def test_a_notebook_shows_what_the_terminal_says(tmp_path: Path) -> None:
    named = SLIP | {"verdict": "named"}
    findings = stored(Findings, tmp_path, "discovery.json", {"experiments": {"a": named}, "warnings": []})
    shown = findings._repr_html_()
    assert "grip slip 0.310 mm (0.250 … 0.380)" in shown and "p &lt; 0.001" in shown
    rounded = {"q05": [1e-13, 1.0], "q50": [2e-13, 1.5], "q95": [7e-13, 2.0]}
    drift = {"distance_mm": rounded, "times_s": [0.0, 60.0], "specimen_spread": 0.0}
    content = {"robot": "r", "feasible": True, "drift": [drift], "wires": {}, "warnings": []}
    assert "<td>0 to 0</td>" in stored(Pose, tmp_path, "pose.json", content)._repr_html_()


def test_a_fit_says_nothing_of_parameters_that_it_does_not_have(tmp_path: Path) -> None:
    """Hold by hold, elongations under weights do not depend on k1."""
    bench = Bench(weights_N=(2.0, 4.0, 6.0, 8.0), times_s=(5.0, 30.0, 100.0, 300.0), resolution_mm=0.01)
    (experiment,) = simulated_tests([bench], Truth({"k1": 900.0}), seed=3)
    posterior = wb.fit(experiment, likelihood="hold", check=False, output=tmp_path / "out")
    lines = terminal.of_fit(posterior.summary())
    assert [line.split(":")[0] for line in lines] == ["simulated", "  creep after 2 min at 4 N", "  creep law"]
    assert all(line.partition(": ")[2] for line in lines)
