"""Numbers that decide what a user reads, each by what it promises."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import integrate

from wirebayes.discovery import held_out
from wirebayes.discovery.model_check import level
from wirebayes.discovery.power import amplitude_80
from wirebayes.discovery.refit import LARGEST, occam
from wirebayes.discovery.settings import ALPHA
from wirebayes.io.paper import experiments
from wirebayes.model.build import build
from wirebayes.model.spec import PLAIN_SPEC
from wirebayes.wire.staircase import simulate

WIRE = {"k1": 900.0, "B": 0.25, "U": 0.6, "k2": 0.05, "N": 0.7, "preload": 0.4, "sensor_sd": 0.01, "setting_sd": 1e-9}


def test_one_clean_file_in_twenty_five_is_called_incomplete() -> None:
    assert pytest.approx(1 / 25) == ALPHA == level(1)


@pytest.mark.parametrize("one_sided", [True, False])
def test_the_occam_factor_is_the_integral_over_the_prior(one_sided: bool) -> None:
    """Of a normal likelihood well within the range: ∫ exp(-(δ - δ₀)² / 2) p(δ) dδ, p uniform on one side or on both."""
    low = 0.0 if one_sided else -LARGEST
    middle = 0.5 * LARGEST
    area = integrate.quad(lambda d: np.exp(-0.5 * (d - middle) ** 2), low, LARGEST, points=[middle])[0]
    assert occam(one_sided) == pytest.approx(np.log(area / (LARGEST - low)), abs=1e-6)


def test_a_detectable_amplitude_is_found_in_four_tests_of_five() -> None:
    """The log Bayes factor grows as amplitude times a number that is evenly spread over the simulations."""
    spread = (np.arange(1000) + 0.5) / 1000
    pieces = SimpleNamespace(log_bayes=lambda amplitude: amplitude * spread)
    null = SimpleNamespace(norm=np.ones((3, 1)), pieces=SimpleNamespace(of=lambda i: pieces))
    found = amplitude_80(null, SimpleNamespace(one_sided=True), 0, occam(True) + 1.0)  # type: ignore[arg-type]
    assert found == pytest.approx(5.0, abs=0.03)  # a (1 - 0.8) = 1
    assert amplitude_80(null, SimpleNamespace(one_sided=True), 0, occam(True) + LARGEST) is None  # type: ignore[arg-type]


def test_weights_of_a_hold_left_out_are_truncated(monkeypatch: pytest.MonkeyPatch) -> None:
    """One draw of a hundred that would have 60 % of the weight has at most a tenth of what the sum was before."""
    values = np.zeros((1, 100))
    values[0, 7] = -5.0
    sample = SimpleNamespace(protocol=SimpleNamespace(recorded=np.ones(1, bool)))
    problem = SimpleNamespace(samples=[sample], leave_one_hold_out=lambda theta: [values])
    monkeypatch.setattr(held_out, "_draws", lambda block, rng, n: (problem, None))
    weight = np.exp(5.0) / (np.exp(5.0) + 99)
    each, capped = (1.0 - weight) / 99, min(weight, 1 / np.sqrt(100))
    share = capped / (capped + 99 * each)
    expected = np.log(share * np.exp(-5.0) + (1.0 - share))
    found = held_out.truncated_leave_one_hold_out(None, np.random.default_rng(0))  # type: ignore[arg-type]
    assert weight > 0.5 and found == pytest.approx([expected], rel=1e-12)


class Even:
    """Draws that are the normal distribution itself, evenly."""

    def normal(self, size: tuple[int, int]) -> Any:
        from scipy.stats import norm

        return np.tile(norm.ppf((np.arange(size[1]) + 0.5) / size[1]), (size[0], 1))


@pytest.mark.parametrize(("away", "covered"), [(1.2, 1.0), (1.5, 1.0), (-1.5, 1.0), (1.8, 0.0), (-1.8, 0.0)])
def test_bands_of_held_out_readings_hold_nine_in_ten(
    away: float, covered: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Readings of the last hold lie so many standard deviations from a known prediction; nine in ten are 1.645."""
    one = replace(experiments()[2].train(4), resolution=0.0)
    expected = simulate(one.protocol(), {name: np.array([value]) for name, value in WIRE.items()})[..., 0]
    last = len(one.holds) - 1
    holds = [
        replace(h, readings=row[: h.time_s.size] + WIRE["sensor_sd"] * away * (j == last))
        for j, (h, row) in enumerate(zip(one.holds, expected, strict=True))
    ]
    one = replace(one, holds=tuple(holds))
    problem = build([one.train(3)])
    theta = np.tile([WIRE[name] for name in problem.names], (500, 1))
    monkeypatch.setattr(held_out, "fitted", lambda *given, **_: None)
    monkeypatch.setattr(held_out, "_draws", lambda *_: (problem, theta))
    block = SimpleNamespace(effects=("none",), spec=PLAIN_SPEC, scales=None)
    (found,) = held_out.predicted([one], [3], (), block, Even())  # type: ignore[arg-type]
    assert found.inside == covered
    assert found.squares == pytest.approx((away * WIRE["sensor_sd"]) ** 2, rel=1e-6)
    assert found.floor == pytest.approx(WIRE["sensor_sd"] ** 2, rel=1e-6)
