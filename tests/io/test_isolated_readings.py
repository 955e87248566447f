"""A first reading counts as a misprint where neither creep nor the move before it explains it, and only there."""

import numpy as np
import pytest

from wirebayes.io.checked_test import CheckedTest
from wirebayes.io.isolated_readings import outlier
from wirebayes.wire.protocol import Protocol

TIMES = np.arange(12.0) * 10.0


def protocol(setting, control="displacement"):
    held = np.asarray(setting, float)
    times = np.tile(TIMES, (held.size, 1))
    lasts = np.full(held.size, TIMES[-1])
    taken = np.ones(times.shape, bool)
    return Protocol(1000.0, held, times, taken, lasts, np.arange(1, held.size + 1), control=control)


def relaxing(moves, share=0.1, stiffness=1.0):
    """Tensions that jump by each move, and lose a share of the jump at once."""
    begins = np.cumsum(np.asarray(moves, float)) * stiffness
    lost = share * np.abs(moves)[:, None] * (1.0 - np.exp(-TIMES / 5.0))
    return begins[:, None] - lost * np.sign(moves)[:, None]


def said(test, readings):
    return outlier(CheckedTest(test, readings, 0.01))


@pytest.mark.parametrize("value", [-3.0, 0.0, 40.0])
@pytest.mark.parametrize("hold", [0, 4, 7])
def test_an_absurd_first_reading_is_named_with_its_place(value, hold):
    readings = relaxing(np.ones(8), share=0.05)
    assert said(protocol(range(1, 9)), readings) == ""
    readings[hold, 0] = value
    expected = f"the reading of {value:g} N in hold {hold + 1} at 0 s"
    # what the first move adds is not known, so that its first reading may be high, and next to nothing may be right
    is_possible = hold == 0 and value == 0.0
    assert (expected in said(protocol(range(1, 9)), readings)) != is_possible


def test_a_first_reading_below_zero_is_named_where_a_wire_is_let_out():
    setting = [4.0, 8.0, 6.0, 4.0]
    readings = relaxing(np.diff([0.0, *setting]), share=0.2)
    assert said(protocol(setting), readings) == ""
    readings[3, 0] = -5.0
    assert "the reading of -5 N in hold 4 at 0 s" in said(protocol(setting), readings)


@pytest.mark.parametrize("at", [0, 2])
def test_a_large_move_among_small_ones_relaxes_by_more(at):
    """Most of the tension may be gone by the second reading."""
    moves = np.full(5, 0.2)
    moves[at] = 10.0
    assert said(protocol(np.cumsum(moves)), relaxing(moves, share=0.7)) == ""


@pytest.mark.parametrize(("value", "warned"), [(-12.0, False), (16.0, True)])
def test_under_weights_a_displacement_that_falls_is_no_creep(value, warned):
    """Creep may take the first weight far, and a gauge may have any zero."""
    test = protocol([10.0, 10.5, 11.0, 11.5], "force")
    readings = np.linspace(0.0, 3.0, 4)[:, None] + 0.1 * (1.0 - np.exp(-TIMES / 5.0))
    readings[0, 0] = value
    assert ("in hold 1 at 0 s" in said(test, readings)) == warned
