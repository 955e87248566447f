"""The ideal judge of several effects: by hand in three dimensions, and on cases where the answer is known."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import chi2, multivariate_normal, ncx2

from analyses.hidden_effects.cases import Spec, build
from analyses.hidden_effects.optimal import judge
from analyses.hidden_effects.optimal_sets import DELTA_RANGE, Directions, Sets, left_over

SLANTED = np.array([0.6, 0.8, 0.0])
THREE = Directions(np.array([[1.0, 0, 0], SLANTED, [0, 0, 1.0], [0, 0, -1.0]]), np.array([0, 1, 2, 2]), ["a", "b", "c"])


def geometry_of(readings: int, parameters: int) -> SimpleNamespace:
    return SimpleNamespace(basis=np.zeros((readings, parameters)))


def test_sets_are_of_different_effects_and_those_of_the_same_lie_together():
    sets = Sets.of(THREE, 2)
    assert [tuple(m) for m in sets.members] == [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3)]
    assert [tuple(e) for e in sets.effects] == [(0, 1), (0, 2), (1, 2)]
    assert list(sets.first) == [0, 1, 3]


def test_directions_that_agree_make_no_set():
    twin = Directions(np.array([[1.0, 0], [1.0, 1e-5]]), np.array([0, 1]), ["a", "b"])
    assert len(Sets.of(twin, 2).members) == 0


def test_what_a_set_explains_is_the_projection_with_amplitudes_of_the_right_sign():
    sets = Sets.of(THREE, 2)
    data = np.array([3.0, 2.0, -1.0])
    explained = dict(zip(map(tuple, sets.members), sets.explained(THREE.units @ data), strict=True))
    assert explained[0, 1] == pytest.approx(13.0)
    assert explained[0, 3] == pytest.approx(10.0)
    assert explained[0, 2] == -np.inf  # it would need a negative amplitude


def test_log_evidence_is_the_integral_over_the_amplitudes():
    """Of one choice of effects by a grid; the likelihood ratio against no effect, the prior flat up to the largest."""
    two = Directions(THREE.units[:2], THREE.owner[:2], THREE.names)
    data = np.array([9.0, 6.0, 0.5])
    grid = np.linspace(-DELTA_RANGE[1], DELTA_RANGE[1], 401)
    a, b = np.meshgrid(grid, grid, indexing="ij")
    model = a[..., None] * two.units[0] + b[..., None] * two.units[1]
    ratio = multivariate_normal.logpdf(data - model, np.zeros(3)) - multivariate_normal.logpdf(data, np.zeros(3))
    expected = np.log(np.exp(ratio).mean())
    (found,) = Sets.of(two, 2).log_evidence(two.units @ data)
    assert found == pytest.approx(expected, abs=0.02)


def test_what_the_best_effects_leave_and_how_well_it_would_be_seen():
    found = left_over(geometry_of(3, 0), THREE, np.array([3.0, 4.0, -6.0]), 2)
    assert (found["1"]["names"], found["1"]["delta"]) == (["c"], pytest.approx(5.0))
    assert found["2"]["names"] == ["b", "c"]
    assert found["2"]["delta"] == pytest.approx(0.0, abs=1e-6)
    one = left_over(geometry_of(3, 0), THREE, np.array([0.0, 0.0, 7.0]) + 2.0 * np.array([-0.8, 0.6, 0.0]), 1)["1"]
    assert (one["names"], one["delta"]) == (["c"], pytest.approx(2.0))
    assert one["power"] == pytest.approx(ncx2.sf(chi2.isf(0.03, 2), 2, 4.0))


def test_more_names_leave_no_more():
    found = judge(build(Spec("foreign", "paper", ("worn_thread",), 10.0, 0)), draws=4)["left_over"]
    assert 10.0 >= found["1"]["delta"] >= found["2"]["delta"] > 0.0


def test_a_step_of_the_zero_is_a_slip_to_the_judge_and_a_worn_thread_is_not():
    known, step, thread = "steady_creep", "zero_step", "worn_thread"
    mimicked = judge(build(Spec("mixed", "unloading", (known, step), 10.0, 0)), draws=15)
    strange = judge(build(Spec("mixed", "unloading", (known, thread), 10.0, 0)), draws=15)
    assert mimicked["left_over"]["2"]["delta"] < 3.3 < strange["left_over"]["2"]["delta"]
    assert strange["optimal_mixed"]["remains"] > mimicked["optimal_mixed"]["remains"]
    assert mimicked["optimal_mixed"]["known"] > 0.6


def test_an_effect_taken_from_the_catalogue_does_not_explain_itself():
    removed = judge(build(Spec("without", "dense", ("superposition",), 10.0, 0)), draws=4)["left_over"]
    assert "superposition" not in removed["1"]["names"]
    assert removed["1"]["delta"] > 3.3


@pytest.mark.parametrize("names", [("grip_slip", "steady_creep"), ("grip_slip", "steady_creep", "reading_delay")])
def test_effects_that_differ_are_named_together(names):
    kind = "two" if len(names) == 2 else "three"
    found = judge(build(Spec(kind, "unloading", names, 10.0, 0)), draws=40)
    assert found[f"optimal_{kind}"]["group"] > 0.9
