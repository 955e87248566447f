"""Axes that are shared by all pictures."""

import matplotlib
import matplotlib.pyplot as plt
import pytest

from wirebayes.report.figures import logarithmic

matplotlib.use("Agg")


@pytest.mark.parametrize(("values", "scale"), [([0.0, 0.0], "linear"), ([-1.0, 0.0], "linear"), ([0.0, 1e-9], "log")])
def test_an_axis_is_logarithmic_where_something_is_above_zero(values, scale):
    figure, axes = plt.subplots()
    axes.plot([1.0, 2.0], values)
    logarithmic(axes, "both")
    assert axes.get_xscale() == "log" and axes.get_yscale() == scale
    plt.close(figure)
