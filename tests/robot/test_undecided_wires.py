"""Wires whose test leaves undecided which effects they have: draws of all models, each moving the robot as its own."""

import shutil
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import wirebayes as wb
from tests.light import POLICY
from tests.robot.lines import CORE, line_about
from wirebayes.cli import main
from wirebayes.commands import pose_history
from wirebayes.commands.asked_pose import AskedPose
from wirebayes.commands.predict import find_posterior
from wirebayes.commands.wires import content_hash, content_of, draws_of
from wirebayes.effects import catalogue, effect_named
from wirebayes.effects.creep import SteadyCreep, SteadyCreepCarried
from wirebayes.errors import InputError
from wirebayes.inference.fit import fit_problem
from wirebayes.io import paper
from wirebayes.io.run_folder import read_json
from wirebayes.model.build import build
from wirebayes.results import store
from wirebayes.results.mixture import write_mixture
from wirebayes.robot.history.unknowns import Uncertain
from wirebayes.robot.mechanics import draws, schema
from wirebayes.robot.mechanics.draws import WireDraws
from wirebayes.robot.mechanics.undecided_models import (
    draws_of_each,
    models_together,
    most_probable,
    that_go_together,
)
from wirebayes.robot.mechanics.wires_used import undecided_in_words, wires_summary
from wirebayes.robot.motion import drift

pose = import_module("wirebayes.commands.pose")


def model_with(effects, count, seed, **values):
    """A model about known parameters, with effects at values (n,) that scatter as well."""
    line = line_about(CORE, 0.05, count, seed)
    scatter = np.random.default_rng(seed).uniform(0.9, 1.1, count)
    own = {name.replace("__", "."): value * scatter for name, value in values.items()}
    return replace(line, parameters={**line.parameters, **own}, effects=tuple(effects))


def models() -> list[WireDraws]:
    """Of one test: a second relaxation, a stiffening with a sensor's curve, and what only the bench did."""
    return [
        model_with([effect_named("second_relaxation")], 5, 1, second_relaxation__A=0.05, second_relaxation__T2=20.0),
        model_with(
            [effect_named("strain_stiffening"), effect_named("sensor_nonlinearity")], 3, 2, strain_stiffening__c=40.0
        ),
        model_with([effect_named("sensor_drift")], 2, 3),
    ]


def drifted(line):
    robot = schema.read_robot_file("cogiro-desk")
    wires = draws.for_robot(robot, line)
    course = drift.from_command(robot, wires, robot.home_m, np.eye(3), np.array([0.0, 60.0, 600.0]))
    assert course.found.all()
    return course.position_m


def test_each_draw_moves_the_robot_as_under_its_own_model() -> None:
    each = models()
    whole = models_together(each)
    assert [effect.name for effect in whole.material()] == ["second_relaxation", "strain_stiffening"]
    for number, model in enumerate(each):
        # by itself, for draws that creep together share their steps
        own = whole.part(np.flatnonzero(whole.undecided.of_draw == number))
        np.testing.assert_allclose(drifted(own), drifted(model), rtol=0, atol=1e-12)


def test_few_draws_evenly_taken_are_of_all_models() -> None:
    whole = models_together(models())
    assert np.bincount(whole.undecided.of_draw).tolist() == [5, 3, 2]
    few = whole.part(slice(0, 5))
    assert sorted(few.undecided.of_draw.tolist()) in ([0, 0, 0, 1, 2], [0, 0, 1, 1, 2])
    assert few.undecided.of_draw.tolist() == whole.undecided.of_draw[:5].tolist()


def test_the_centre_is_that_of_the_most_probable_model() -> None:
    first, *_ = each = models()
    centre = models_together(each).centre()
    assert centre.undecided is None
    assert centre.parameters["strain_stiffening.c"] == 0.0
    for name, values in first.parameters.items():
        assert centre.parameters[name] == pytest.approx(values.mean(), rel=1e-12)


def test_the_most_probable_model_alone_has_as_many_draws() -> None:
    first, *_ = each = models()
    other = replace(first, name="thick")
    line = replace(models_together(each), others={"thick": other})
    alone = most_probable(line)
    assert alone.count == line.count == 10 and alone.undecided is None
    assert set(alone.parameters) == set(first.parameters)
    assert [effect.name for effect in alone.material()] == ["second_relaxation"]
    for name, values in first.parameters.items():
        np.testing.assert_array_equal(np.sort(alone.parameters[name]), np.sort(np.tile(values, 2)))
    (said,) = alone.doubts
    assert said.kind == "left-out" and said.text.endswith(
        "only the most probable is used here: second relaxation, 50 %"
    )
    assert alone.others["thick"].parameters == first.parameters and alone.others["thick"].doubts == ()


def test_a_shape_without_its_amplitude_is_that_of_the_others() -> None:
    first, *_ = each = models()
    whole = models_together(each)
    rows = whole.undecided.of_draw != 0
    assert (whole.parameters["second_relaxation.A"][rows] == 0.0).all()
    expected = first.parameters["second_relaxation.T2"].mean()
    assert whole.parameters["second_relaxation.T2"][rows] == pytest.approx(np.full(5, expected), rel=1e-12)


def test_two_variants_of_an_effect_do_not_go_together() -> None:
    beside, carried = (
        model_with([effect], 4, 0, steady_creep__a=1e-5) for effect in (SteadyCreep(), SteadyCreepCarried())
    )
    plain = model_with([], 4, 0)
    assert that_go_together([carried, plain, beside, carried]) == [0, 1, 3]


@pytest.mark.parametrize(
    ("probabilities", "counts", "most", "shares"),
    [
        ([0.6, 0.4], [1000, 1000], 100, [60, 40]),
        ([0.3, 0.2], [1000, 1000], 100, [60, 40]),  # of those that go together
        ([0.6, 0.4], [30, 1000], 100, [30, 20]),
        ([0.999, 0.001], [1000, 1000], 100, [100, 0]),
    ],
)
def test_draws_are_taken_in_proportion_to_probability(probabilities, counts, most, shares) -> None:
    assert draws_of_each(np.array(probabilities), counts, most) == shares


def test_models_that_differ_on_the_bench_alone_are_one_in_a_robot() -> None:
    robot = schema.read_robot_file("cogiro-desk")
    sensor, delay = (model_with([effect_named(name)], 4, 0) for name in ("sensor_drift", "reading_delay"))
    wires = wires_summary(robot, models_together([sensor, delay]))
    assert wires["undecided"] == {"default": [{"effects": [], "share": 1.0}]}
    assert undecided_in_words(wires) == []
    assert "undecided" not in wires_summary(robot, models_together([sensor]))
    said = undecided_in_words(wires_summary(robot, models_together(models())))
    assert said == [
        "The test leaves undecided which effects the wire has: draws are of second relaxation (50 %), strain "
        "stiffening (30 %) and none of them (20 %)."
    ]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A final posterior of nylon with a stiffening, beside which the plain model is undecided."""
    final = tmp_path_factory.mktemp("final")
    nylon = paper.experiments()[2]
    for place, names in ((final, ["strain_stiffening"]), (final / "undecided" / "1", [])):
        place.mkdir(parents=True, exist_ok=True)
        effects = [catalogue()[name]() for name in names]
        store.save_posterior(fit_problem(build([nylon], effects), 1, policy=POLICY), place, {})
    write_mixture(final, [(".", 0.7, ["strain_stiffening"]), ("undecided/1", 0.3, [])])
    return final


def test_a_folder_gives_draws_of_all_its_models(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    line = draws_of(folder, 50)
    bent = line.parameters["strain_stiffening.c"] != 0
    assert line.count == 50 and bent.sum() == 35
    alone = draws_of(folder / "undecided" / "1", 15)
    np.testing.assert_array_equal(line.parameters["k1"][~bent], alone.parameters["k1"])
    out = tmp_path / "out"
    asked = ["pose", "linear-6", "--wires", str(folder), "--times", "0,60", "--draws", "50", "--output", str(out)]
    assert main([*asked, "--tolerance", "1e-6"]) == 0
    said = "draws are of strain stiffening (70 %) and none of them (30 %)"
    assert said in capsys.readouterr().err
    assert said in (out / "report.html").read_text(encoding="utf-8")
    assert read_json(out / "pose.json")["wires"]["undecided"] == {
        "default": [{"effects": ["strain_stiffening"], "share": 0.7}, {"effects": [], "share": 0.3}]
    }


def test_a_calibration_goes_by_the_most_probable_model(folder: Path, tmp_path: Path) -> None:
    session = Path(__file__).parents[2] / "docs" / "example" / "linear-7-session.csv"
    found = wb.calibrate("linear-7", session, wires=folder, draws=50, output=tmp_path / "out")
    said = [notice.text for notice in found.warnings if notice.kind == "left-out"]
    assert any("only the most probable is used here: strain stiffening, 70 %" in text for text in said)


def test_specimens_go_by_their_most_probable_models(folder: Path, tmp_path: Path) -> None:
    plain = folder / "undecided" / "1"
    of_two = tmp_path / "of-two"
    shutil.copytree(plain, of_two)
    write_mixture(of_two, [(".", 0.6, []), ("undecided/1", 0.4, ["strain_stiffening"])])
    line = draws_of([plain, of_two], 10)
    said = [notice.text for notice in line.doubts if notice.kind == "left-out"]
    assert said == [f"{of_two}: of the models that the test leaves undecided only the most probable is used here, 60 %"]


def test_a_history_goes_on_with_the_wires_that_were_calibrated(monkeypatch: pytest.MonkeyPatch) -> None:
    line = models_together(models())
    kept: list[WireDraws] = []

    def calibrated_of(calibration: object, robot: object, own: WireDraws, *_: object) -> object:
        return SimpleNamespace(prior=SimpleNamespace(line=own, spread=0.05))

    monkeypatch.setattr(pose_history, "calibrated_of", calibrated_of)
    errors = pose_history.calibrated_errors(Uncertain(), "folder", None, line, None, None)  # type: ignore[arg-type]
    monkeypatch.setattr(pose, "pose_over_time", lambda asked, *_: kept.append(asked.line))
    asked = AskedPose(None, line, None, None, 0, None, 0.0)  # type: ignore[arg-type]
    pose._along(asked, None, "path", errors, None)  # type: ignore[arg-type]
    pose._along(asked, "log", None, Uncertain(), None)  # type: ignore[arg-type]
    of_calibration, without = kept
    assert of_calibration.undecided is None and of_calibration.count == line.count
    assert without is line


def test_another_probability_is_another_configuration(folder: Path) -> None:
    before = content_of(folder, None)
    assert before == content_of(folder, None)
    write_mixture(folder, [(".", 0.6, ["strain_stiffening"]), ("undecided/1", 0.4, [])])
    assert content_of(folder, None) != before
    write_mixture(folder, [(".", 0.7, ["strain_stiffening"]), ("undecided/1", 0.3, [])])
    assert content_of(folder / "undecided" / "1", None) == content_hash(folder / "undecided" / "1" / "posterior.nc")


@pytest.mark.parametrize(
    "text",
    [
        "{",
        "[]",
        "{}",
        '{"members": []}',
        '{"members": [{"folder": "."}]}',
        '{"members": [{"folder": ".", "probability": "x"}]}',
    ],
)
def test_a_damaged_list_of_models_is_blamed(text: str, tmp_path: Path) -> None:
    (tmp_path / "posterior.nc").touch()
    (tmp_path / "mixture.json").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"mixture\.json: .*expected what"):
        draws_of(tmp_path, 10)


def test_a_final_posterior_may_lie_in_a_folder_of_any_name(folder: Path, tmp_path: Path) -> None:
    anywhere = tmp_path / "kept"
    shutil.copytree(folder, anywhere)
    name, found = find_posterior(anywhere, None, None)
    assert (name, found) == ("nylon-1.5m", anywhere)
