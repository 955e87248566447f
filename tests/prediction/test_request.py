"""What a protocol file asks: temperatures, absent holds, fresh samples and their events."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from wirebayes.effects import effect_named
from wirebayes.errors import InputError
from wirebayes.io.experiment_file import read_experiments
from wirebayes.io.readings import protocol_table
from wirebayes.model.build import build
from wirebayes.model.spec import ModelSpec
from wirebayes.prediction.request import request_of
from wirebayes.results.read_back import Stored
from wirebayes.strict.table import CsvTable

TRAINED = """hold,displacement_mm,time_s,tension_N,temperature_C
1,1,0,1.00,20.0
1,1,60,0.90,20.5
3,2,0,2.00,21.0
3,2,60,1.90,21.5
4,3,0,2.90,22.0
"""
TOML = """[[experiment]]
name = "warm"
material = "line"
length_mm = 1000.0
readings = "warm.csv"
unrecorded_holds = [{ before_hold = 3, displacement_mm = 1.5, duration_s = 30.0 }]
"""


@pytest.fixture
def stored(tmp_path: Path) -> Stored:
    (tmp_path / "warm.csv").write_text(TRAINED)
    (tmp_path / "warm.toml").write_text(TOML)
    effects = [effect_named("thermal_expansion"), effect_named("grip_slip@3")]
    (experiment,) = read_experiments(tmp_path / "warm.toml")
    sample = build([experiment.train(2)], effects).samples[0]
    return Stored({"k1": np.ones(3)}, sample, "chain")


def ask(folder: Path, text: str) -> CsvTable:
    path = folder / "protocol.csv"
    path.write_text(text)
    return protocol_table(path)


def test_holds_to_come_follow_all_that_was_held(tmp_path: Path, stored: Stored) -> None:
    text = "hold,displacement_mm,time_s,temperature_C\n3,2,0,21.0\n3,2,60,21.5\n7,4,0,25\n7,4,10,25\n7,4,90,26\n"
    request = request_of(ask(tmp_path, text), stored)
    prediction = request.prediction
    assert prediction.trained == 3
    assert list(prediction.requested) == [False, False, True, True]
    assert list(prediction.protocol.number) == [1, -1, 3, 7]
    assert list(prediction.protocol.duration_s) == [60, 30, 60, 90]
    assert prediction.protocol.warming_K is not None
    # warming counts from the first temperature of the training, hold 1's 20.0, which this file does not repeat
    assert prediction.protocol.warming_K[3] == pytest.approx([5.0, 5.0, 6.0])
    assert request.stored is stored
    assert request.sentence == (
        "hold 3 predicted as replicates of the tested ones; hold 7 predicted as a continuation of the test from "
        "the end of hold 3 on, given all readings of the test (--fresh predicts a fresh sample instead); "
        "nothing is assumed to have happened in between: holds 4 to 6 not in its history"
    )


def test_later_holds_continue_the_test_though_no_training_hold_is_repeated(tmp_path: Path, stored: Stored) -> None:
    later = "7,4,0,25\n7,4,10,25\n7,4,90,26\n9,5,0,25\n10,4.5,0,25\n"
    header = "hold,displacement_mm,time_s,temperature_C\n"
    alone = request_of(ask(tmp_path, header + later), stored)
    repeating = request_of(ask(tmp_path, header + "3,2,0,21.0\n3,2,60,21.5\n" + later), stored)
    assert alone.prediction.trained == repeating.prediction.trained == 3
    assert list(alone.prediction.requested) == [False, False, False, True, True, True]
    one, other = alone.prediction.protocol, repeating.prediction.protocol
    for name in ("number", "setting", "duration_s", "start_s", "time_s", "mask", "warming_K"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name
    # the slip at hold 3 goes on, the temperature reference is the training's, the clock goes on after 150 s
    assert [e.key for e in alone.stored.sample.model.effects] == ["thermal_expansion", "grip_slip@3"]
    assert one.warming_K is not None and one.warming_K[3] == pytest.approx([5.0, 5.0, 6.0])
    assert one.start_s[3] == 150.0
    assert "holds 7, 9 to 10 predicted as a continuation" in alone.sentence
    assert "holds 4 to 6, 8 not in its history" in alone.sentence and "replicate" not in alone.sentence


@pytest.mark.parametrize("number", [1, 2, 101])
def test_a_fresh_sample_starts_anew_without_the_others_events(tmp_path: Path, stored: Stored, number: int) -> None:
    text = f"hold,displacement_mm,time_s,temperature_C\n{number},3,0,24\n{number},3,60,26\n"
    request = request_of(ask(tmp_path, text), stored, fresh=True)
    protocol = request.prediction.protocol
    assert request.prediction.trained == 0 and list(protocol.start_s) == [0.0]
    assert protocol.warming_K is not None and protocol.warming_K[0] == pytest.approx([0.0, 2.0])
    assert [e.key for e in request.stored.sample.model.effects] == ["thermal_expansion"]
    assert "fresh sample with no history" in request.sentence


@pytest.mark.parametrize("fresh", [False, True])
def test_temperatures_are_refused_where_the_training_had_none(tmp_path: Path, stored: Stored, fresh: bool) -> None:
    protocol = replace(stored.sample.protocol, reference_C=None, warming_K=None)
    cold = replace(stored, sample=replace(stored.sample, protocol=protocol))
    text = "hold,displacement_mm,time_s,temperature_C\n7,3,0,24\n7,3,60,26\n"
    with pytest.raises(InputError, match=r"line 2, column 4 \(temperature_C\): found 24, expected no column temp"):
        request_of(ask(tmp_path, text), cold, fresh=fresh)
    without = ask(tmp_path, "hold,displacement_mm,time_s\n7,3,0\n7,3,60\n")
    assert request_of(without, cold, fresh=fresh).prediction.protocol.warming_K is None


def test_replicates_alone_are_said_to_be_that(tmp_path: Path, stored: Stored) -> None:
    text = "hold,displacement_mm,time_s,temperature_C\n1,1,0,20\n1,1,60,20.5\n3,2,0,21\n3,2,60,21.5\n"
    assert request_of(ask(tmp_path, text), stored).sentence == "holds 1, 3 predicted as replicates of the tested ones"


@pytest.mark.parametrize("temperature", ["", "20", "21.5"])
def test_the_row_that_says_when_a_tested_hold_ended_may_be_repeated(tmp_path: Path, temperature: str) -> None:
    (tmp_path / "warm.csv").write_text(TRAINED.replace("4,3,0", f"3,2,90,,{temperature}\n4,3,0"))
    (tmp_path / "warm.toml").write_text(TOML)
    (experiment,) = read_experiments(tmp_path / "warm.toml")
    stored = Stored({"k1": np.ones(3)}, build([experiment.train(2)]).samples[0], "chain")
    text = f"hold,displacement_mm,time_s,temperature_C\n3,2,0,21.0\n3,2,60,21.5\n3,2,90,{temperature}\n"
    request = request_of(ask(tmp_path, text), stored)
    assert list(request.prediction.requested) == [False, False, True]


@pytest.mark.parametrize(("fresh", "line"), [(False, 4), (True, 3)])
def test_a_hold_to_come_needs_its_temperature_at_all_times(
    tmp_path: Path, stored: Stored, fresh: bool, line: int
) -> None:
    repeated = "" if fresh else "1,1,0,20\n1,1,60,20.5\n"
    rows = "7,4,10,25\n7,4,90,\n" if fresh else "7,4,10,\n7,4,90,26\n"
    table = ask(tmp_path, f"hold,displacement_mm,time_s,temperature_C\n{repeated}{rows}")
    with pytest.raises(InputError, match=rf"line {line}, column 4 \(temperature_C\): found an empty cell, expected a"):
        request_of(table, stored, fresh=fresh)


def test_a_weight_that_no_wire_can_bear_by_the_modified_law_is_refused(tmp_path: Path) -> None:
    rows = "".join(f"{number},{x},{t},{number}\n" for number, x in ((1, 1.0), (2, 2.0)) for t in (0, 60))
    (tmp_path / "warm.csv").write_text("hold,displacement_mm,time_s,tension_N\n" + rows)
    keys = 'name = "warm"\nmaterial = "line"\nlength_mm = 1000.0\nreadings = "warm.csv"\ncontrol = "force"\n'
    (tmp_path / "warm.toml").write_text("[[experiment]]\n" + keys)
    sample = build(read_experiments(tmp_path / "warm.toml"), spec=ModelSpec("modified")).samples[0]
    stored = Stored({"k1": np.array([900.0, 1000.0]), "setting_sd": np.array([0.1, 0.1])}, sample, "chain")
    path = tmp_path / "protocol.csv"
    path.write_text("hold,tension_N,time_s\n5,800,0\n6,900,0\n")
    with pytest.raises(
        InputError, match=r"line 3, column 2 \(tension_N\): found 900, expected a tension below 899.4 N"
    ):
        request_of(protocol_table(path, "force"), stored)
    linear = replace(stored, sample=replace(sample, model=replace(sample.model, law="hooke")))
    assert request_of(protocol_table(path, "force"), linear).prediction.requested[-2:].all()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("hold,displacement_mm,time_s\n3,2,0\n3,2,60\n", "no column temperature_C"),
        (
            "hold,displacement_mm,time_s,temperature_C\n3,2,0,21.0\n3,2,60,\n",
            "line 3, column 4 (temperature_C): found an empty cell, expected 21.5, as hold 3 was trained on",
        ),
        (
            "hold,displacement_mm,time_s,temperature_C\n1,1,0,20\n1,1,60,20.5\n3,2,0,21\n3,2,60,23\n",
            "line 5, column 4 (temperature_C): found 23, expected 21.5",
        ),
        (
            "hold,temperature_C,displacement_mm,time_s\n2,20,1.5,0\n3,21,2,0\n3,21.5,2,60\n",
            "line 2, column 1 (hold): found 2, expected one of the trained holds (1, 3), or one after hold 3",
        ),
        (
            "hold,temperature_C,displacement_mm,time_s\n0,20,1.5,0\n",
            "line 2, column 1 (hold): found 0, expected one of the trained holds (1, 3), or one after hold 3",
        ),
        (  # the whole file shifted by a degree: the reference is known, not guessed from the file
            "hold,displacement_mm,time_s,temperature_C\n3,2,0,22\n3,2,60,22.5\n",
            "line 2, column 4 (temperature_C): found 22, expected 21, as hold 3 was trained on",
        ),
        (
            "hold,temperature_C,displacement_mm,time_s\n3,21,2.5,0\n3,21.5,2.5,60\n",
            "line 2, column 3 (displacement_mm): found 2.5, expected 2",
        ),
    ],
)
def test_refusals_say_where(tmp_path: Path, stored: Stored, text: str, words: str) -> None:
    with pytest.raises(InputError) as caught:
        request_of(ask(tmp_path, text), stored)
    assert words in str(caught.value)
