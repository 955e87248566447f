"""The order of planned tests: within the time there is first, then by the aim."""

from wirebayes.planning.ranking import Judged, ranked, too_long
from wirebayes.planning.sensitivity import Sensitivity
from wirebayes.planning.widths import Expected
from wirebayes.simulation.synthetic import Bench
from wirebayes.wire.model import PLAIN


def judged(name, bits, creep_sd, cosine=0.0, holds=10):
    width = {"sd": creep_sd, "width_90": 0.0, "width_90_low": 0.0, "width_90_high": 0.0, "guess_sd": 1.0, "unit": "mm"}
    expected = Expected({"creep_1h_mm": width}, 1.0, 1000.0, 60.0, bits, 5, PLAIN, ())
    power = {"amplitude_80": 1.0, "unit": "-", "delta_80": 4.0, "delta_prior": 10.0, "confused_with": []}
    effects = Sensitivity({"a": power, "b": power}, {("a", "b"): cosine, ("b", "a"): cosine})
    bench = Bench(name, displacements_mm=tuple(range(1, holds + 1)), times_s=(0.0, 60.0))
    return Judged(bench.experiment(), "", expected, effects)


TESTS = [judged("x", 10.0, 0.3, 0.99), judged("y", 20.0, 0.2, 0.5, holds=30), judged("z", 5.0, 0.1, 0.9)]


def order(aim, budget=None):
    return [j.test.name for j in ranked(TESTS, aim, budget)]


def test_each_aim_has_its_order():
    assert order(("parameters",)) == ["y", "x", "z"]
    assert order(("creep",)) == ["z", "y", "x"]
    assert order(("a", "b")) == ["y", "z", "x"]


def test_what_takes_too_long_comes_last():
    assert order(("parameters",), 20.0) == ["x", "z", "y"]
    assert [too_long(j, 20.0) for j in TESTS] == [False, True, False]
    assert TESTS[1].duration_min == 30.0
