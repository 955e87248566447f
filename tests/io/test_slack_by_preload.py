"""A stated preload that contradicts the readings is said in one line; any that a taut wire may have is not."""

import numpy as np
import pytest

from wirebayes.io import data_checks
from wirebayes.io.arrays import from_arrays
from wirebayes.io.slack_by_preload import slack_by_preload

TIMES_S = (0.0, 30.0, 60.0)


def three_holds(control="displacement", **about):
    """Three holds of a wire that pulls in each of them."""
    settings, readings = (1.0, 2.0, 3.0), (2.0, 4.0, 6.0)
    displacements, tensions = (settings, readings) if control == "displacement" else (readings, settings)
    holds = range(1, 4)
    return from_arrays(
        hold=np.repeat(holds, 3),
        time_s=np.tile(TIMES_S, 3),
        displacement_mm=np.repeat(displacements, 3) + (control == "force") * np.tile([0.0, 0.05, 0.08], 3),
        tension_N=np.repeat(tensions, 3) - (control == "displacement") * np.tile([0.0, 0.05, 0.08], 3),
        length_mm=1000.0,
        name="wire",
        material="line",
        control=control,
        **about,
    )


def about_preload(experiment):
    return [notice for notice in data_checks.of_experiment(experiment) if "preload_mm" in notice.text]


@pytest.mark.parametrize(
    ("preload_mm", "where"),
    [
        (-4.5, "holds 1, 2 and 3, but in hold 1 it pulls with 1.92 N at 1 mm:"),
        (-2.5, "holds 1 and 2, but"),
        (-1.0, "hold 1, but in hold 1 it pulls"),
    ],
)
def test_holds_that_pull_though_nothing_stretches_them_are_named(preload_mm, where):
    (notice,) = about_preload(three_holds(preload_mm=preload_mm))
    assert notice.kind == "data"
    assert f"a stretch of {preload_mm:g} mm at displacement zero (preload_mm)" in notice.text
    assert where in notice.text


@pytest.mark.parametrize("preload_mm", [None, -0.9, 0.0, 4.5])
def test_a_preload_that_a_taut_wire_may_have_is_not_said(preload_mm):
    assert about_preload(three_holds(preload_mm=preload_mm)) == []


def test_under_weights_it_is_the_zero_of_the_gauge():
    assert about_preload(three_holds("force", preload_mm=-1.5)) == []
    (notice,) = about_preload(three_holds("force", preload_mm=-2.5))
    assert "in hold 1 it pulls with 1 N at 2.08 mm:" in notice.text


def test_a_wire_that_reads_nothing_where_it_is_slack_contradicts_nothing():
    made = three_holds(preload_mm=-1.5)
    readings = made.readings()
    readings[0] = 0.0
    assert slack_by_preload(made.protocol(), readings, 0.0, -1.5) == []
