"""Files of people who test lines: what is understood of each, and what a fit of it says of the wire.

Most were simulated, so the truth is known; the tendons are public recordings, compared with a plain least squares.
Long recordings keep every second to fifth reading.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import wirebayes as wb
from analyses.posterior import real_files
from wirebayes.io import data_checks
from wirebayes.io.experiment import Experiment
from wirebayes.io.experiment_file import read_experiments
from wirebayes.model.build import build
from wirebayes.views.posterior import Posterior
from wirebayes.wire.staircase import simulate

CASES = Path(__file__).parent / "data" / "bench"
FEW = wb.Policy(walkers=64, round_draws=2048, ess=1000.0, most_steps=800)


def imported(name: str, length_mm: float = 1000.0, **options: object) -> tuple[Experiment, list[str]]:
    """What `import` makes of a raw file, and what it says of it."""
    made = wb.import_bench(CASES / name, length_mm=length_mm, name="w", **options)  # type: ignore[arg-type]
    (test,) = made.experiments
    return test, made.summary()["experiments"]["w"]["notes"]


def read(name: str) -> Experiment:
    (test,) = read_experiments(CASES / name)
    return test


def fitted(test: Experiment, **options: object) -> Posterior:
    found = wb.fit(test, check=False, policy=FEW, **options)  # type: ignore[arg-type]
    assert found.summary()["converged"]
    return found


def creep(posterior: Posterior, tension_N: float) -> np.ndarray:
    """(2,) ends of the 90 % interval of the creep of a fresh sample after two minutes, mm."""
    d = posterior.draws()
    each = d["B"] * tension_N ** d["U"] * -np.expm1(-d["k2"] * 120.0 ** d["N"])
    return np.quantile(each, [0.05, 0.95])


def interval(posterior: Posterior, name: str) -> tuple[float, float]:
    entry = posterior.summary()["parameters"][name]
    return entry["q05"], entry["q95"]


@pytest.mark.parametrize(
    ("name", "settings", "said"),
    [
        ("bluehill.csv", [0, 1, 2, 3, 4], "'Tensile extension' (the same numbers as 'Extension')"),
        ("bluehill2.csv", [0, 1, 2, 3, 4], "not read: 'Tensile strain (Extension)'"),
        ("steps_gbk.csv", [1, 2, 3, 4, 5, 6], "GB18030; displacement from '位移'"),
        ("Z_labview.lvm", [1, 2, 3, 4, 5, 6], "LabVIEW measurement; displacement from 'Position', time from 'X_Value'"),
        (
            "reset_cont.csv",
            [0, 1, 2, 3, 4],
            "time starts again at line 652, where the displacement goes on",
        ),
    ],
)
def test_a_recording_of_steps_is_read_as_it_is(name, settings, said):
    test, notes = imported(name)
    assert test.control == "displacement"
    assert [round(hold.setting, 2) for hold in test.holds] == settings
    assert said in " ".join(notes)


def test_a_pull_is_refused_by_the_names_of_its_own_columns():
    """Its header is in GBK, with a row of units: it is understood, and there is nothing to hold."""
    with pytest.raises(wb.InputError, match=r"line 4, column 2 \(位移\): found a displacement that stays in 0 %"):
        imported("vhb_gbk.csv")


HUNG = [
    ("creep_dw_noisy.csv", 4.43, 0.1031),
    ("creep_deadweight_hand.csv", 4.34, 0.8432),
    ("creep_cont_small.csv", 4.43, 0.1031),
]


@pytest.mark.parametrize(
    ("name", "weight"),
    [("creep_dw_noisy.csv", 2.0), ("creep_deadweight_hand.csv", 0.2 * 9.80665), ("creep_cont_small.csv", 2.0)],
)
def test_hung_weights_are_read_as_such(name, weight):
    test, notes = imported(name)
    assert test.control == "force" and len(test.holds) == 4
    assert [hold.setting for hold in test.holds] == pytest.approx([weight * k for k in (1, 2, 3, 4)], rel=0.002)
    assert any("under weights or force control" in note for note in notes)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "tension", "truth"), HUNG)
def test_the_creep_under_weights_lies_in_its_interval(name, tension, truth):
    low, high = creep(fitted(imported(name)[0]), tension)
    assert low < truth < high < 1.3 * low


def test_a_fresh_sample_under_a_weight_is_predicted(tmp_path):
    """Weighed by hand: k1 is 900 N, so 4.34 N stretch a metre by 4.822 mm, and creep adds .8432 mm in two minutes."""
    posterior = fitted(imported("creep_deadweight_hand.csv")[0])
    low, high = creep(posterior, 4.34)
    assert low < 0.8432 < high
    (tmp_path / "p.csv").write_text("hold,tension_N,time_s\n1,4.34,0\n1,4.34,120\n")
    table = wb.predict(posterior, tmp_path / "p.csv", fresh=True, output=tmp_path / "out.csv")
    rows = np.genfromtxt(tmp_path / "out.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
    assert table is not None and rows["q05_mm"][1] < 1000.8432 * (1 + 4.34 / 900.0) - 1000.0 < rows["q95_mm"][1]


def test_a_clock_that_starts_again_changes_nothing():
    (once, notes), (none, _) = imported("restart_once.csv"), imported("restart_none.csv")
    for a, b in zip(once.holds, none.holds, strict=True):
        assert a.time_s.tolist() == b.time_s.tolist() and a.readings.tolist() == b.readings.tolist()
        assert a.duration_s == pytest.approx(b.duration_s, abs=1.0)
    assert any("starts again at the beginning of hold 5" in note for note in notes)


@pytest.mark.slow
def test_a_clock_that_starts_again_leaves_k1_as_it_is():
    once, none = (fitted(imported(f"restart_{which}.csv")[0]) for which in ("once", "none"))
    low, high = interval(once, "k1")
    assert low < 900.0 < high
    assert once.summary()["parameters"]["k1"]["q50"] == pytest.approx(
        none.summary()["parameters"]["k1"]["q50"], abs=1.0
    )


def test_a_relaxation_from_one_ramp_is_one_hold_and_says_what_that_leaves_open():
    test, _ = imported("tendon_fresh1.csv", 14.33, mapping="Extension=displacement")
    (hold,) = test.holds
    assert hold.setting == pytest.approx(0.716, abs=0.001)
    assert data_checks.ONE_HOLD in [notice.text for notice in data_checks.of_experiment(test)]


@pytest.mark.parametrize(
    ("read", "k1", "k2", "N"),
    [
        (lambda: real_files.written_by_hand(real_files.BY_HAND), 54.3, 0.241, 0.486),
        (lambda: real_files.imported(real_files.TENDON, 14.33, ["Extension=displacement"]), 117.3, 0.967, 0.202),
    ],
    ids=["by hand, from the end of the ramp", "imported, from the middle of the ramp"],
)
def test_least_squares_of_a_tendon_depend_on_where_its_hold_begins(read, k1, k2, N):
    (hold,) = read().holds
    found = real_files.by_least_squares(hold.time_s, hold.readings, 14.33, 14.33 + hold.setting)
    assert found[[0, 2, 3]] == pytest.approx([k1, k2, N], rel=2e-3)


def test_a_pull_is_a_staircase_of_the_model():
    """The study's own equations against the simulator's, from the linear law."""
    (sample,) = build([replace(real_files.pulled(real_files.PULL, 80.0), priors=real_files.LINEAR)]).samples
    wire = {"k1": 6.65, "B": 44.0, "U": 1.0, "k2": 0.16, "N": 1.0, "preload": 0.0}
    own = {name: np.full(1, value) for name, value in wire.items()}
    expected = simulate(sample.protocol, own, sample.model, np.zeros((len(sample.protocol.setting), 1)))
    found = real_files.staircase((6.65, 44.0, 0.16), 80.0, sample.protocol.setting)
    assert found == pytest.approx(expected[:, 0, 0], rel=1e-12)


@pytest.mark.slow
def test_a_tendon_agrees_with_least_squares_where_its_priors_are_stated():
    """`scipy.optimize.least_squares`, without a preload: k1 54.3 N, k2 .241, N .486."""
    posterior = fitted(read("fresh1-own.toml"))
    for name, value in (("k1", 54.3), ("k2", 0.241), ("N", 0.486)):
        low, high = interval(posterior, name)
        assert low < value < high
    open_ = fitted(read("tendon-fresh1.toml"))
    said = [w["text"] for w in open_.summary()["warnings"] if w["kind"] == "prior"]
    deciding, moving = next(text for text in said if "twice as wide" in text).split("twice as wide")
    assert "preload" in deciding and "k1" in moving


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "tension", "truth"),
    [
        ("f5fibre_prior.toml", 0.001, 0.0099),
        ("f4rope_prior.toml", 29666.0, 3.48),
        ("f4rope_priorB.toml", 29666.0, 3.48),
    ],
)
def test_fibre_and_rope_creep_as_they_do_with_and_without_a_prior_of_b(name, tension, truth):
    low, high = creep(fitted(read(name)), tension)
    assert low < truth < high


@pytest.mark.slow
def test_a_sling_passes_its_check():
    posterior = wb.fit(read("f14sling.toml"), policy=FEW)
    assert posterior.summary()["model_check"]["passed"]
    low, high = interval(posterior, "k1")
    assert low < 3e5 < high


def test_a_line_that_breaks_is_said_to():
    (event,) = [n for n in data_checks.of_experiment(read("f3break.toml")) if n.kind == "break"]
    assert "tension falls to 0 in hold 8 from" in event.text and "leave these readings out" in event.text


def test_a_load_cell_at_its_limit_is_named_with_value_and_holds():
    (event,) = [n for n in data_checks.of_experiment(read("f2sat.toml")) if n.kind == "saturation"]
    assert "20 readings in holds 6 to 9 all read 4.5 N, the largest of the test" in event.text


@pytest.mark.slow
@pytest.mark.parametrize("name", ["f3break.toml", "f2sat.toml"])
def test_without_what_is_gross_the_wire_is_as_stiff_as_it_is(name):
    as_it_is = fitted(read(name))
    assert {w["kind"] for w in as_it_is.summary()["warnings"]} & {"break", "saturation"}
    low, high = interval(fitted(read(name), drop_breaks=True), "k1")
    assert low < 900.0 < high
