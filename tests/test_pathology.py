"""Data that no model deserves: the answer is honest, never a silent number.

Each case says what must stand among the warnings of its fit, the words on convergence and on what the data determine.
Chains are too short to be believed; what is asserted does not hang on their length.
"""

import warnings
from dataclasses import replace

import numpy as np
import pytest

import wirebayes as wb
from wirebayes.io.experiment import Experiment
from wirebayes.io.paper import experiments
from wirebayes.wire.staircase import simulate

POLICY = wb.Policy(walkers=32, ess=300.0, r_hat=1.5, rounds=2, round_draws=1024, block=20, most_steps=60)
WIRE = {"k1": 900.0, "B": 0.25, "U": 0.6, "k2": 0.05, "N": 0.7, "preload": 0.4, "sensor_sd": 0.01, "setting_sd": 0.02}
BASE = experiments()[2].train(6)
CLEAN = simulate(BASE.protocol(), {name: np.array([value]) for name, value in WIRE.items()})[..., 0]
NOISE = np.random.default_rng(0).normal(0.0, WIRE["sensor_sd"], CLEAN.shape)
USUAL = np.round(CLEAN + NOISE, 2)


def reading(tension_N: np.ndarray, resolution_N: float = 0.01) -> Experiment:
    """The protocol of a wire of the paper with these readings."""
    holds = [replace(h, readings=row[: h.time_s.size]) for h, row in zip(BASE.holds, tension_N, strict=True)]
    return replace(BASE, holds=tuple(holds), resolution=resolution_N)


def spiked() -> np.ndarray:
    out = USUAL.copy()
    out[3, 2] += 500.0
    return out


CASES: dict[str, tuple[Experiment, str]] = {
    "constant tension": (reading(np.full(CLEAN.shape, 2.0)), "stays at 2 N while the displacement changes"),
    "no noise": (reading(CLEAN, 0.0), "the readings carry no noise"),
    # no k1 is far outside its prior, whose scale is that of the noise
    "nothing read": (reading(0.0 * CLEAN), "the wire was slack throughout"),
    "slack": (reading(NOISE), "the wire was slack throughout"),
    "slack until halfway": (reading(np.where(np.arange(6)[:, None] < 3, 0.0, USUAL)), "in holds 1, 2 and 3 ("),
    "holds in the wrong order": (reading(USUAL[[4, 1, 5, 0, 3, 2]]), "the displacements do not explain the tensions"),
    "time runs backward": (reading(USUAL[:, ::-1]), "check that time_s runs forward"),
    "a misprint": (reading(spiked()), "check it, correct a misprint"),
    "two holds": (reading(USUAL).train(2), "setting_sd: the data say next to nothing about it"),
    "metres written as mm": (replace(reading(USUAL), length_mm=1.5), "length_mm"),
}
SLOW = set(CASES) - {"constant tension", "holds in the wrong order"}


@pytest.mark.parametrize(
    "what", [pytest.param(name, marks=pytest.mark.slow) if name in SLOW else name for name in CASES]
)
def test_what_no_model_deserves_is_said(what: str) -> None:
    experiment, words = CASES[what]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        summary = wb.fit(experiment, policy=POLICY, check=False).summary()
    warned = [notice["text"] for notice in summary["warnings"]]
    sentences = [*warned, *(known["sentence"] for known in summary["identifiability"].values())]
    assert any(words in sentence for sentence in sentences), sentences
    assert summary["converged"] or any(sentence.startswith("not converged") for sentence in sentences)


@pytest.mark.slow
def test_a_sound_test_of_the_same_protocol_gets_no_warning() -> None:
    """Otherwise warnings would mean nothing."""
    found = wb.fit(reading(USUAL), policy=POLICY, check=False)
    assert found.kinds <= {"not-converged"}
