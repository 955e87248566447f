"""Axes that are shared by all pictures."""

import matplotlib
import matplotlib.pyplot as plt
import pytest

from wirebayes.io.paper import experiments
from wirebayes.report.figures import logarithmic, measured

matplotlib.use("Agg")


@pytest.mark.parametrize(("values", "scale"), [([0.0, 0.0], "linear"), ([-1.0, 0.0], "linear"), ([0.0, 1e-9], "log")])
def test_an_axis_is_logarithmic_where_something_is_above_zero(values, scale):
    figure, axes = plt.subplots()
    axes.plot([1.0, 2.0], values)
    logarithmic(axes, "both")
    assert axes.get_xscale() == "log" and axes.get_yscale() == scale
    plt.close(figure)


def test_readings_below_zero_are_in_the_picture():
    """Noise of a slack wire is; a test whose readings are all above zero begins at zero."""
    experiment = experiments()[0]
    readings = experiment.readings()
    above = measured(experiment.protocol(), readings, "a").axes[0].get_ylim()
    below = measured(experiment.protocol(), readings - readings[experiment.protocol().mask].max() / 2, "a")
    assert above[0] == 0.0 and below.axes[0].get_ylim()[0] < (-readings[experiment.protocol().mask].max() / 2) * 0.8
