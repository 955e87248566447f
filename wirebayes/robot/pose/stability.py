"""Reports of falls: how probable, when, by which wire, and how close a platform that holds comes to one."""

import numpy as np

from wirebayes.json_files.pose import FallsReport, Times
from wirebayes.notice import Notice
from wirebayes.numeric.typing import Bools, Floats, Ints
from wirebayes.robot.motion.course import Course, Falls
from wirebayes.robot.pose.request import band_over_draws

NEAR_SLACK, NEAR_LOOSE = 0.2, 0.3  # shares of first tension and stiffness: a builder wants to know below these


def summary(course: Course) -> FallsReport:
    """Falls, slack wires and margins over the draws whose hold began in a stable pose.

    Probabilities are shares of the draws that began; wires are numbered from 1 in the order of the robot's legs.
    """
    falls = course.falls
    began = np.isfinite(falls.stiffness_share) if falls is not None else np.zeros(0, bool)
    if falls is None or not began.any():
        return {"began": 0.0}
    fell, fell_at_s = falls.fell[began], falls.time_s[began]
    slack_s = falls.slack_s[began]
    slack = np.isfinite(slack_s)
    drop_m = falls.drop_m[began][fell]
    caught = np.isfinite(drop_m)
    holds = began & ~falls.fell  # margins mean something where there is a hold to lose
    tension_share = falls.tension_share[holds]
    lowest = np.where(np.isfinite(tension_share), tension_share, np.inf).min(axis=1, initial=np.inf)
    return {
        "began": float(began.mean()),
        "fall_probability": float(fell.mean()),
        "fall_probability_at": (fell_at_s[:, None] <= course.times_s).mean(0),
        "fall_time_s": _spread(fell_at_s[fell]),
        "fall_wires": _by_wire(falls.wire[began][fell], course.tension_N.shape[-1], len(fell)),
        "fall_distance_mm": _spread(1e3 * drop_m[caught]),
        "caught_probability": float(caught.mean()) if fell.any() else None,
        "slack_probability": slack.mean(0),
        "slack_time_s": [_spread(times[np.isfinite(times)]) for times in slack_s.T],
        "least_tension_wire": int(_nearest(falls, began)) + 1,
        "least_tension_share": band_over_draws(lowest),
        "stiffness_share": band_over_draws(falls.stiffness_share[holds]),
    }


def _spread(values: Floats) -> Times | None:
    if not len(values):
        return None
    return {"first": float(values.min()), "median": float(np.median(values)), "last": float(values.max())}


def _by_wire(wires: Ints, legs: int, draws: int) -> Floats:
    return np.bincount(wires, minlength=legs) / draws


def _nearest(falls: Falls, began: Bools) -> int:
    """The wire that comes nearest to slackness in most draws."""
    share = np.where(np.isfinite(falls.tension_share), falls.tension_share, np.inf)[began]
    return int(np.bincount(share.argmin(1), minlength=share.shape[1]).argmax())


def stability_warnings(course: Course, spread: float, stable: bool = True) -> list[Notice]:
    """One warning for each way in which the platform may lose its hold, the worst first.

    Parameters
    ----------
    course : Course
    spread : float
        The specimen spread it was computed for, to be named.
    stable : bool
        Whether the commanded pose is a stable equilibrium at all.
    """
    found, out = summary(course), list[Notice]()
    who = f"specimens differing by {100 * spread:g} %" if spread else "specimens alike"
    last = course.times_s[-1]
    if found["began"] < 1:
        reason = "the pose is balanced but not stable" if not stable else "no stable equilibrium is found there"
        text = f"{_percent(1 - found['began'])} of the draws cannot begin at the pose ({who}): {reason}"
        out.append(Notice("fall", text))
    if not found["began"]:
        return out
    times, drop = found["fall_time_s"], found["fall_distance_mm"]
    if times is not None:
        wire = int(np.argmax(found["fall_wires"])) + 1
        fall = f"; it drops {drop['median']:.3g} mm" if drop else "; nothing catches it nearby"
        text = (
            f"the platform falls in {_percent(found['fall_probability'])} of the draws within {last:g} s ({who}), "
            f"first after {times['first']:.3g} s, in the median after {times['median']:.3g} s, wire {wire} giving "
            f"way{fall}"
        )
        out.append(Notice("fall", text))
    return [*out, *_margin_warnings(found, last, who)]


def _margin_warnings(found: FallsReport, last: float, who: str) -> list[Notice]:
    """Wires that go slack or nearly so, and a platform that comes loose, within the last time (s) for these draws."""
    slack = [
        f"wire {i + 1} in {_percent(p)} of the draws, first after {t['first']:.3g} s"
        for i, (p, t) in enumerate(zip(found["slack_probability"], found["slack_time_s"], strict=True))
        if t is not None
    ]
    out = []
    tension, stiffness = found["least_tension_share"]["q05"], found["stiffness_share"]["q05"]
    if slack:
        out.append(Notice("slack", f"wires go slack within {last:g} s ({who}): {'; '.join(slack)}"))
    elif tension is not None and tension < NEAR_SLACK:
        wire, left = found["least_tension_wire"], _percent(float(tension))
        out.append(Notice("slack", f"wire {wire} may keep only {left} of its tension within {last:g} s ({who})"))
    if stiffness is not None and stiffness < NEAR_LOOSE:
        left = _percent(max(float(stiffness), 0.0))
        text = f"the stiffness against the softest motion may fall to {left} within {last:g} s ({who})"
        out.append(Notice("fall", text))
    return out


def _percent(share: float) -> str:
    return "nearly all" if 0.995 <= share < 1 else f"{100 * share:.3g} %"
