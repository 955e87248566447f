"""Sealed cases: reproducible, blind, readable by the package; answers of baselines and the whole run."""

import json
import tomllib

import numpy as np
import pytest

from analyses.hidden_effects.baselines import answer
from analyses.hidden_effects.cases import SIZES, Spec, build, seal, specs, truth
from analyses.hidden_effects.catalogue import EFFECTS
from analyses.hidden_effects.optimal import judge
from analyses.hidden_effects.run import append_line, main, read_lines
from analyses.hidden_effects.truth import PROTOCOLS
from wirebayes.effects import CATALOGUE
from wirebayes.io.experiment_file import read_experiments

SLIP = Spec("single", "paper", ("grip_slip",), 20.0, 0)


def test_the_full_plan_is_balanced_and_its_keys_differ():
    full = specs(SIZES["full"])
    assert len({s.key for s in full}) == len(full)
    assert sum(s.kind == "clean" for s in full) >= 600
    single = [s for s in full if s.kind == "single"]
    assert {s.names[0] for s in single} == set(EFFECTS)
    for delta in (3.0, 5.0, 10.0, 20.0):
        assert sum(s.delta == delta for s in single) == len(single) / 4
    assert {s.protocol for s in single} == set(PROTOCOLS)


def test_every_effect_of_the_catalogue_is_hidden_by_the_benchmark():
    assert set(EFFECTS) == set(CATALOGUE), "an effect needs a row in analyses/hidden_effects/catalogue.py"


def test_a_part_of_the_plan_is_made_of_the_same_cases():
    part = specs(SIZES["full"], kinds=("single",), protocols=("dense",), names=("toe",))
    assert part
    assert {s.key for s in part} <= {s.key for s in specs(SIZES["full"])}
    assert all(s.names == ("toe",) and s.protocol == "dense" for s in part)


def test_a_case_is_reproducible_and_another_seed_is_another_case(tmp_path):
    for name in ("a", "b"):
        assert seal(SLIP, tmp_path / name / "cases", tmp_path / name / "sealed")
    files = sorted(p.relative_to(tmp_path / "a") for p in (tmp_path / "a").rglob("*.*"))
    assert len(files) == 3
    for file in files:
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes()
    other = build(Spec("single", "paper", ("grip_slip",), 20.0, 0, seed=1))
    assert other is not None and other.rig.wires != build(SLIP).rig.wires


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_the_package_reads_what_was_measured_and_nothing_more(tmp_path, protocol):
    spec = Spec("clean", protocol, (), 0.0, 1)
    case = build(spec)
    assert seal(spec, tmp_path / "cases", tmp_path / "sealed")
    folder = tmp_path / "cases" / spec.key
    experiments = read_experiments(folder / "experiment.toml")
    assert [e.name for e in experiments] == [b.name for b in case.rig.benches]
    for experiment, bench, part in zip(experiments, case.rig.benches, case.rig.bench_slices, strict=True):
        read = np.concatenate([hold.tension_N for hold in experiment.holds if hold.recorded])
        assert read == pytest.approx(case.readings[part], abs=1e-5)
        assert len(experiment.holds) == len(bench.holds)
        assert experiment.length_mm == bench.length_mm
    text = "".join(p.read_text() for p in folder.iterdir())
    assert "k1" not in text and "preload" not in text and tomllib.loads((folder / "experiment.toml").read_text())


def test_truth_says_what_was_hidden(tmp_path):
    seal(SLIP, tmp_path / "cases", tmp_path / "sealed")
    sealed = json.loads((tmp_path / "sealed" / f"{SLIP.key}.json").read_text())
    assert sealed["effects"][0]["name"] == "grip_slip"
    assert sealed["effects"][0]["hold"] > 1
    assert sealed["delta_total"] == pytest.approx(20.0, rel=0.01)


def test_the_ideal_judge_names_what_is_separable_and_tosses_a_coin_for_twins():
    slips = [judge(build(Spec("single", "dense", ("grip_slip",), 20.0, r)), draws=40)["optimal"] for r in range(3)]
    assert np.mean([slip["top1"] for slip in slips]) > 0.9
    assert all(slip["power"] == 1.0 for slip in slips)
    twin = [
        judge(build(Spec("single", "paper", (name,), 10.0, r)), draws=40)["optimal"]["top1"]
        for name in ("strain_stiffening", "sensor_nonlinearity")
        for r in range(4)
    ]
    assert 0.25 < np.mean(twin) < 0.8
    grouped = judge(build(Spec("single", "paper", ("strain_stiffening",), 10.0, 0)), draws=10)
    assert "sensor_nonlinearity" in grouped["groups"][0]


def test_an_effect_of_some_wires_has_an_amplitude_in_each_of_them():
    plan = specs(SIZES["full"], kinds=("some",))
    assert {s.protocol for s in plan} == {"several_wires"}
    assert {EFFECTS[s.names[0]].scope for s in plan} == {"material"}
    cases = [case for case in (build(s) for s in plan[:7]) if case is not None]
    assert {len(case.hidden) for case in cases} == {1, 2, 3}
    for case in cases:
        sealed = truth(case)["effects"]
        assert len({tuple(e["experiments"]) for e in sealed}) == len(case.hidden)
        assert [e["conditional_delta"] for e in sealed] == pytest.approx([10.0] * len(sealed), rel=0.01)


def test_baselines_find_a_large_slip_and_obey_without():
    case = build(SLIP)
    bench = case.rig.benches[0].name
    named = answer(case, "bic")["experiments"][bench]
    assert named["best"] == "grip_slip"
    assert named["held_out"]["holds"]
    assert answer(case, "sparse")["experiments"][bench]["best"] == "grip_slip"
    blind = build(Spec("without", "paper", ("grip_slip",), 20.0, 0))
    assert answer(blind, "bic")["experiments"][bench]["best"] != "grip_slip"
    assert answer(case, "flexible")["experiments"][bench]["best"] in (None, "unknown")


def test_answers_survive_an_interrupted_write(tmp_path):
    path = tmp_path / "answers.jsonl"
    append_line(path, {"key": "a", "error": None})
    with path.open("a") as stream:
        stream.write('{"key": "b", "err')
    append_line(path, {"key": "c", "error": None})
    assert set(read_lines(path)) == {"a", "c"}


@pytest.mark.slow
def test_the_benchmark_runs_resumes_and_prints_the_table(tmp_path, capsys):
    options = ["--size", "tiny", "--protocols", "paper", "--answer", "bic", "--output", str(tmp_path), "--workers", "1"]
    assert main(options) == 0
    first = capsys.readouterr().out
    assert "false alarms" in first and "gap closed" in first
    before = (tmp_path / "answers" / "bic.jsonl").read_bytes()
    assert main(options) == 0
    assert capsys.readouterr().out == first
    assert (tmp_path / "answers" / "bic.jsonl").read_bytes() == before
    page = (tmp_path / "page.html").read_text()
    assert "<script" not in page and "http" not in page
