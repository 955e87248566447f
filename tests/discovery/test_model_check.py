"""The check at the end of every fit: calibrated, first in the summary, and the same question as `discover` asks."""

import json
from dataclasses import replace
from pathlib import Path
from threading import Event
from time import sleep

import numpy as np
import pytest
from scipy import stats

from tests.simulated import WIRE
from wirebayes import cli
from wirebayes.discovery import global_test, model_check, screening
from wirebayes.discovery.apart import APART
from wirebayes.discovery.model_check import ModelCheck, check_model, level
from wirebayes.discovery.search import investigate
from wirebayes.discovery.settings import ALPHA, Settings
from wirebayes.effects import CATALOGUE, effect_named
from wirebayes.inference.laplace_fit import fitted
from wirebayes.io.experiment import Experiment
from wirebayes.io.experiment_file import read_experiments
from wirebayes.io.run_folder import read_json
from wirebayes.model.spec import PLAIN_SPEC, ModelSpec
from wirebayes.results.jobs import Job
from wirebayes.simulation.synthetic import Bench, Truth, write_tests

BENCH = Bench(displacements_mm=tuple(range(1, 8)))


def simulated(folder: Path, truth: dict[str, float] | None = None, effects: tuple[str, ...] = ()) -> Experiment:
    """One test of seven holds, read back from its files."""
    folder.mkdir(exist_ok=True)
    write_tests(folder, [BENCH], Truth(WIRE | (truth or {}), [effect_named(key) for key in effects]), seed=2)
    return read_experiments(folder / "experiments.toml")[0]


def test_a_p_near_the_level_is_distinguished_from_one_that_is_not() -> None:
    """A test that exceeds the level by chance with a risk of more than .00135 is not yet decided."""
    for larger in range(100):
        risk = min(stats.binom.cdf(larger, 999, ALPHA), 1.0 - stats.binom.cdf(larger - 1, 999, ALPHA))
        assert global_test.is_close((1 + larger) / 1000, ALPHA, 999) == (risk > 0.00135)
    assert not global_test.is_close(0.02, ALPHA, 999) and not global_test.is_close(0.065, ALPHA, 999)
    # No exceedance at all decides, also against the smaller level of one of four fits.
    assert not global_test.is_close(0.001, level(4), 999)


def test_a_pair_is_listed_only_where_nothing_is_as_surprising() -> None:
    one = {"toe": 3.0, "ageing": 1.0, "unknown": 2.0}
    assert model_check.directions(one) == ("toe", "a smooth discrepancy", "ageing")
    assert model_check.directions(one | {screening.TWO: 2.9}) == ("toe", "a smooth discrepancy", "ageing")
    assert model_check.directions(one | {screening.TWO: 3.1})[:2] == ("two effects together", "toe")


def test_a_p_too_close_to_the_level_gets_more_simulations(tmp_path: Path) -> None:
    small = simulated(tmp_path, {"strain_stiffening.c": 6.0}, ("strain_stiffening",))
    block = fitted([small], (), PLAIN_SPEC, np.random.default_rng(0))
    kinds = {name: CATALOGUE[name] for name in ("strain_stiffening", "sensor_drift")}

    def tested(alpha: float) -> tuple[float, int, int]:
        found = global_test.examine([block], kinds, 100, np.random.default_rng(1), alpha=alpha).test
        return found.p, len(found.null), len(found.chance["sensor_drift"])

    p, trials, made = tested(alpha=0.5)
    assert (trials, made) == (34, 50) and p < 0.2
    more, trials, made = tested(alpha=p)
    assert trials == made - made // 3
    assert made == 100 * global_test.MOST_TIMES or (made >= 100 and not global_test.is_close(more, p, trials))


def test_the_level_of_several_fits_keeps_the_risk_of_the_command() -> None:
    for tests in (1, 2, 7):
        assert 1.0 - (1.0 - level(tests)) ** tests == pytest.approx(ALPHA, rel=1e-12)
    assert ModelCheck(0.04, level(1), 999).passed is False  # as `discover` decides
    assert ModelCheck(0.041, level(1), 999).passed is True


@pytest.mark.parametrize(
    ("p", "p_alike", "passed", "said"),
    [
        (0.5, None, True, []),
        (0.5, 0.02, True, []),
        (0.5, APART, False, ["The 3 samples differ, "]),
        (0.001, 0.02, False, ["does not describe"]),
        (0.001, 0.002, False, ["does not describe", "and the 3 samples differ, "]),
    ],
)
def test_a_check_fails_where_samples_differ_and_says_so(p, p_alike, passed, said) -> None:
    check = ModelCheck(p, ALPHA, 999, ("toe",), samples=3, p_alike=p_alike)
    assert check.passed is passed and check.to_dict()["p_alike"] == p_alike
    assert len(check.notices) == (not passed)
    for words in ("does not describe", "The 3 samples differ, ", "and the 3 samples differ, "):
        assert any(words in notice.text for notice in check.notices) is (words in said)


def test_samples_fitted_at_once_fail_the_check_where_their_stiffness_differs(tmp_path: Path) -> None:
    """Of 24 pairs whose k1 differed by 4 or 10 %, the test for missing effects alone noticed 12."""
    first = simulated(tmp_path / "a")
    second = replace(simulated(tmp_path / "b", {"k1": 1.1 * WIRE["k1"]}), name="another")
    check = check_model(Job("", (first, second)), simulations=19)
    assert check.samples == 2 and check.samples_differ and check.passed is False


def test_one_experiment_gets_the_p_that_discover_reports(tmp_path: Path) -> None:
    experiment = simulated(tmp_path)
    check = check_model(Job("", (experiment,)), seed=5, simulations=19)
    report = investigate([experiment], Settings(simulations=19), 5).report["experiments"][experiment.name]
    assert check.p == report["p_global"] and check.passed == (report["verdict"] == "nothing-missing")


def test_a_missing_effect_fails_the_check_and_the_model_with_it_passes(tmp_path: Path) -> None:
    experiment = simulated(tmp_path, {"strain_stiffening.c": 60.0}, ("strain_stiffening",))
    plain = check_model(Job("", (experiment,)), simulations=49)
    assert plain.passed is False and plain.p == pytest.approx(1 / (1 + plain.simulations))
    assert "strain_stiffening" in plain.surprising and "strain stiffening" in plain.sentence
    assert "does not describe" in plain.sentence
    whole = check_model(Job("", (experiment,), ("strain_stiffening",)), simulations=49)
    assert whole.passed is True and whole.surprising == () and "describes the readings" in whole.sentence


def test_a_gross_error_is_set_aside_and_reported(tmp_path: Path) -> None:
    experiment = simulated(tmp_path)
    hold = experiment.holds[3]
    tension = np.array(hold.tension_N)
    tension[2] += 0.5
    wrong = replace(experiment, holds=(*experiment.holds[:3], replace(hold, readings=tension), *experiment.holds[4:]))
    check = check_model(Job("", (wrong,)), simulations=19)
    assert [(g["hold"], g["reading"]) for g in check.gross_errors] == [(4, 2)]
    assert "Reading 3 of hold 4" in check.sentence and check.passed


def test_what_cannot_be_checked_says_so(tmp_path: Path) -> None:
    experiment = simulated(tmp_path)
    for job in (
        Job("", (experiment,), spec=ModelSpec(likelihood="hold")),
        Job("", (experiment,), ("discrepancy@7:0.1:120.0:1.0:6.0",)),
    ):
        check = check_model(job)
        assert check.passed is None and check.p is None and check.to_dict()["passed"] is None
        assert check.sentence.startswith("The model was not checked")


def test_fit_puts_a_failed_check_first(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    simulated(tmp_path / "wire", {"strain_stiffening.c": 60.0}, ("strain_stiffening",))
    monkeypatch.setattr(model_check, "SIMULATIONS", 49)
    monkeypatch.setattr(model_check, "workers", lambda prepare: _Serial())
    out = tmp_path / "fit"
    command = ["fit", str(tmp_path / "wire" / "experiments.toml"), "--output", str(out)]
    assert cli.main(command) == 0
    summary = read_json(out / "simulated" / "summary.json")
    assert next(iter(summary)) == "model_check" and summary["model_check"]["passed"] is False
    shown = capsys.readouterr()
    captured = shown.err.strip()
    assert captured.splitlines()[0] == f"warning: simulated: {summary['model_check']['sentence']}".rstrip(".")
    assert shown.out.startswith("simulated: converged, MODEL CHECK FAILED (medians, 90 % intervals)\n")
    assert "Next: wirebayes discover" in shown.out
    page = (out / "report.html").read_text()
    assert page.index("does not describe the readings") < page.index("What was measured")
    assert "times the longest hold" in page
    for claim in ("the data hold it together", "hardly depends on the prior", "What the readings determine "):
        assert claim not in page
    # Also when there is nothing to do; as JSON, and not at all.
    assert cli.main([*command, "--json"]) == 0
    shown = capsys.readouterr()
    assert shown.err.strip() == captured and json.loads(shown.out) == summary
    assert cli.main([*command, "--quiet"]) == 0 and capsys.readouterr().out == ""


def test_a_single_fit_is_checked_while_it_is_sampled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same result as afterwards, stored first; whoever comes later does not check again."""
    begun, summary = Event(), tmp_path / "a" / "summary.json"
    summary.parent.mkdir()
    job = Job("a", (simulated(tmp_path / "wire"),))
    found = check_model(job, 5, simulations=19)

    def check(*given: object, parallel_map: object) -> ModelCheck:
        begun.set()
        return found

    monkeypatch.setattr(model_check, "check_model", check)
    monkeypatch.setattr(model_check, "workers", lambda prepare: _Serial())
    with model_check.checked_meanwhile(job, tmp_path, 5):
        assert begun.wait(10.0)  # before there is a fit
        summary.write_text('{"experiment": "a", "warnings": []}')
    assert list(read_json(summary).items()) == [
        ("model_check", found.to_dict()),
        ("experiment", "a"),
        ("warnings", []),
    ]
    begun.clear()
    with model_check.checked_meanwhile(job, tmp_path, 5):
        assert not begun.wait(0.1)


def test_a_fit_that_fails_does_not_wait_for_its_check(tmp_path: Path) -> None:
    """The check's processes end with the fit's block, though they would have worked for minutes."""
    job = Job("a", (simulated(tmp_path / "wire"),))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(model_check, "check_model", lambda job, seed, parallel_map: list(parallel_map(sleep, [600.0])))
        with pytest.raises(ZeroDivisionError), model_check.checked_meanwhile(job, tmp_path, 5):
            raise ZeroDivisionError
    assert not (tmp_path / "a").exists()


class _Serial:
    """The processes that a small test does not need."""

    def __enter__(self) -> type[map]:
        return map

    def __exit__(self, *about: object) -> None:
        pass
