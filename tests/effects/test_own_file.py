"""A user's file of effects, read again and again while processes are sent what it defines."""

import pickle
from pathlib import Path

from wirebayes.effects import catalogue

FILE = """
from scipy import stats
from wirebayes.wire.effect import Amplitude, Effect


class Own(Effect):
    name, place, scope = "own", "strain", "material"
    amplitudes = (Amplitude("p", "-", NEUTRAL, stats.norm(0.0, 0.3)),)
    sentence = "Its own."
"""


def test_an_effect_of_a_file_that_is_read_again_can_still_be_sent_to_a_process(tmp_path: Path) -> None:
    file = tmp_path / "own.py"
    file.write_text(FILE.replace("NEUTRAL", "0.0"))
    first = catalogue(file)["own"]
    assert catalogue(file)["own"] is first
    assert pickle.loads(pickle.dumps(first())).key == "own"  # refused where another class stands under its name


def test_a_file_that_was_changed_is_run_again(tmp_path: Path) -> None:
    file = tmp_path / "own.py"
    for neutral in ("0.25", "0.125"):
        file.write_text(FILE.replace("NEUTRAL", neutral))
        assert catalogue(file)["own"].amplitudes[0].neutral == float(neutral)
