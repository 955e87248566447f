"""Random protocols and parameters, and the saturating chain in a few lines of plain Python as independent truth."""

import math
from functools import partial

import numpy as np
from hypothesis import strategies as st

from wirebayes.wire.protocol import Protocol


def protocol(settings, times, *, length=1000.0, unrecorded=(), warming=None, control="displacement") -> Protocol:
    """Holds with reading times of their own (ragged), those in `unrecorded` without readings."""
    width = max(len(t) for i, t in enumerate(times) if i not in unrecorded)
    time, mask = np.zeros((len(times), width)), np.zeros((len(times), width), bool)
    for i, t in enumerate(times):
        if i not in unrecorded:
            time[i, : len(t)], mask[i, : len(t)] = t, True
    number = np.array([-1 if i in unrecorded else i + 1 for i in range(len(times))])
    duration = np.array([t[-1] for t in times], float)
    return Protocol(length, np.array(settings, float), time, mask, duration, number, warming, control=control)


def columns(**values):
    """Parameters as arrays of one row, each (1,)."""
    return {name: np.array([float(value)]) for name, value in values.items()}


PLAIN = {"k1": 900.0, "B": 0.25, "U": 0.6, "k2": 0.05, "N": 0.7, "preload": 0.4}


def _crept(theta, carried, amount, t):
    """Creep at a time of a hold that began with what was carried in."""
    return carried + amount * (1.0 - math.exp(-theta["k2"] * t ** theta["N"]))


def by_hand(p, theta, *, law="hooke", history="saturating", setting=None):
    """Eqs (1)-(6) hold after hold; a list of lists of tensions, nothing for an unrecorded hold."""
    carried, out = 0.0, []
    for j, displacement in enumerate(p.setting):
        stretched = p.length_mm + theta["preload"] + displacement + (0.0 if setting is None else setting[j])

        def tension(creep, stretched=stretched):
            zero = p.length_mm + creep
            strain = stretched / zero - 1.0 if law == "hooke" else 1.0 - zero / stretched
            return max(theta["k1"] * strain, 0.0)

        first = tension(carried)
        goal = theta["B"] * first ** theta["U"] if first > 0 else 0.0
        amount = goal - carried if history == "saturating" else goal
        creep = partial(_crept, theta, carried, amount)
        times = p.time_s[j][p.mask[j]]
        out.append([tension(creep(t)) for t in times])
        carried = creep(p.duration_s[j])
    return out


def weights_by_hand(p, theta, *, law="hooke", history="saturating", setting=None):
    """The law solved for the length, hold after hold; a list of lists of displacements."""
    carried, out = 0.0, []
    for j, weight in enumerate(p.setting):
        tension = weight + (0.0 if setting is None else setting[j])
        goal = theta["B"] * tension ** theta["U"]
        amount = goal - carried if history == "saturating" else goal
        creep = partial(_crept, theta, carried, amount)
        strain = tension / theta["k1"]
        longer = 1.0 + strain if law == "hooke" else 1.0 / (1.0 - strain)
        times = p.time_s[j][p.mask[j]]
        out.append([(p.length_mm + creep(t)) * longer - p.length_mm - theta["preload"] for t in times])
        carried = creep(p.duration_s[j])
    return out


@st.composite
def protocols(draw, most_holds=6, control="displacement"):
    """Lengths, steps up and down (slack included) or weights, ragged times, late first readings, unrecorded holds."""
    holds = draw(st.integers(1, most_holds))
    each = st.floats(-2.0, 12.0) if control == "displacement" else st.floats(0.1, 50.0)
    values = draw(st.lists(each, min_size=holds, max_size=holds))
    gaps = st.lists(st.floats(1.0, 300.0), min_size=1, max_size=5)
    times = []
    for _ in range(holds):
        steps = draw(gaps)
        late = draw(st.sampled_from([0.0, 0.0, 5.0]))
        times.append([late + t for t in np.concatenate([[0.0], np.cumsum(steps)])])
    unrecorded = draw(st.sets(st.integers(0, holds - 2), max_size=1)) if holds > 1 else set()
    return protocol(values, times, length=draw(st.floats(300.0, 3000.0)), unrecorded=unrecorded, control=control)


def parameters():
    """Plain parameters over the range of thin lines."""
    return st.fixed_dictionaries(
        {
            "k1": st.floats(100.0, 20000.0),
            "B": st.floats(0.001, 1.0),
            "U": st.floats(0.1, 1.6),
            "k2": st.floats(0.003, 0.3),
            "N": st.floats(0.3, 1.5),
            "preload": st.floats(-1.0, 2.0),
        }
    )
