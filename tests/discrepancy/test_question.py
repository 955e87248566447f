"""What a protocol file asks: temperatures, absent holds, fresh samples and their events."""

from pathlib import Path

import numpy as np
import pytest

from wirebayes.bayes.problem import build
from wirebayes.bayes.result import Stored
from wirebayes.discrepancy.question import read_question
from wirebayes.effects import named
from wirebayes.errors import InputError
from wirebayes.experiment import read_experiments

TRAINED = """hold,displacement_mm,time_s,tension_N,temperature_C
1,1,0,1.00,20.0
1,1,60,0.90,20.5
3,2,0,2.00,21.0
3,2,60,1.90,21.5
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
    effects = [named("thermal_expansion"), named("grip_slip@3")]
    sample = build(read_experiments(tmp_path / "warm.toml"), effects).samples[0]
    return Stored({"k1": np.ones(3)}, sample, "chain")


def ask(folder: Path, text: str) -> Path:
    path = folder / "protocol.csv"
    path.write_text(text)
    return path


def test_holds_to_come_follow_all_that_was_held(tmp_path: Path, stored: Stored) -> None:
    text = "hold,displacement_mm,time_s,temperature_C\n3,2,0,21.0\n3,2,60,21.5\n7,4,0,25\n7,4,10,25\n7,4,90,26\n"
    asked = read_question(ask(tmp_path, text), stored)
    question = asked.question
    assert not asked.fresh and question.trained == 3
    assert list(question.asked) == [False, False, True, True]
    assert list(question.protocol.number) == [1, -1, 3, 7]
    assert list(question.protocol.duration_s) == [60, 30, 60, 90]
    assert question.protocol.warming_K is not None
    # warming counts from the first temperature of the training, hold 1's 20.0, which this file does not repeat
    assert question.protocol.warming_K[3] == pytest.approx([5.0, 5.0, 6.0])
    assert asked.stored is stored


def test_a_fresh_sample_starts_anew_without_the_others_events(tmp_path: Path, stored: Stored) -> None:
    asked = read_question(ask(tmp_path, "hold,displacement_mm,time_s,temperature_C\n101,3,0,24\n101,3,60,26\n"), stored)
    assert asked.fresh and asked.question.trained == 0
    assert asked.question.protocol.warming_K is not None
    assert asked.question.protocol.warming_K[0] == pytest.approx([0.0, 2.0])
    assert [e.key for e in asked.stored.sample.model.effects] == ["thermal_expansion"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("hold,displacement_mm,time_s\n3,2,0\n3,2,60\n", "no column temperature_C"),
        (
            "hold,displacement_mm,time_s,temperature_C\n1,1,0,20\n1,1,60,20.5\n3,2,0,21\n3,2,60,23\n",
            "line 5, column 4 (temperature_C): found 23, expected 21.5",
        ),
        (
            "hold,temperature_C,displacement_mm,time_s\n2,20,1.5,0\n3,21,2,0\n3,21.5,2,60\n",
            "line 2, column 1 (hold): found 2, expected one of the trained holds (1, 3), or one after hold 3",
        ),
        (
            "hold,temperature_C,displacement_mm,time_s\n3,21,2.5,0\n3,21.5,2.5,60\n",
            "line 2, column 3 (displacement_mm): found 2.5, expected 2",
        ),
    ],
)
def test_refusals_say_where(tmp_path: Path, stored: Stored, text: str, words: str) -> None:
    with pytest.raises(InputError) as caught:
        read_question(ask(tmp_path, text), stored)
    assert words in str(caught.value)
