"""Reports of falls: how probable, when, by which wire, and how close a platform that holds comes to one."""

from collections.abc import Callable

import numpy as np

from wirebayes.json_files.pose import FallsReport, Times
from wirebayes.numeric.typing import Bools, Floats, Ints
from wirebayes.result_warnings import Notice
from wirebayes.robot.motion.course import Course, Falls
from wirebayes.robot.pose.request import band_over_draws
from wirebayes.sentences import lasting, short

NEAR_SLACK, NEAR_LOOSE = 0.2, 0.3  # shares of first tension and stiffness: a builder wants to know below these


def summary(course: Course) -> FallsReport:
    """Falls, slack wires and margins over the draws whose hold began in a stable pose.

    Probabilities are shares of the draws that began; wires are numbered from 1 in the order of the robot's legs.
    """
    falls = course.falls
    if falls is None:
        return {"began": 0.0}
    began = np.isfinite(falls.stiffness_share)
    if not began.any():
        return {"began": 0.0}
    fell, fell_at_s = falls.fell[began], falls.time_s[began]
    fallen_by = fell_at_s[:, None] <= course.times_s
    by_wire = _by_wire(falls.wire[began][fell], course.tension_N.shape[-1], len(fell))
    slack_s = falls.slack_s[began]
    is_slack = np.isfinite(slack_s)
    slack_time = [_spread(times[known]) for times, known in zip(slack_s.T, is_slack.T, strict=True)]
    drop_m = falls.drop_m[began][fell]
    caught = np.isfinite(drop_m)
    holds = began & ~falls.fell  # margins mean something where there is a hold to lose
    lowest = _finite_or_infinite(falls.tension_share[holds]).min(axis=1, initial=np.inf)
    return {
        "began": float(began.mean()),
        "fall_probability": float(fell.mean()),
        "fall_probability_at": fallen_by.mean(0),
        "fall_time_s": _spread(fell_at_s[fell]),
        "fall_wires": by_wire,
        "fall_distance_mm": _spread(1e3 * drop_m[caught]),
        "caught_probability": float(caught.mean()) if fell.any() else None,
        "slack_probability": is_slack.mean(0),
        "slack_time_s": slack_time,
        "least_tension_wire": int(_nearest(falls, began)) + 1,
        "least_tension_share": band_over_draws(lowest),
        "stiffness_share": band_over_draws(falls.stiffness_share[holds]),
    }


def _finite_or_infinite(values: Floats) -> Floats:
    return np.where(np.isfinite(values), values, np.inf)


def _spread(values: Floats) -> Times | None:
    if not len(values):
        return None
    return {"first": float(values.min()), "median": float(np.median(values)), "last": float(values.max())}


def _by_wire(wires: Ints, legs: int, draws: int) -> Floats:
    return np.bincount(wires, minlength=legs) / draws


def _nearest(falls: Falls, began: Bools) -> int:
    """The wire that comes nearest to slackness in most draws."""
    share = _finite_or_infinite(falls.tension_share)[began]
    return int(np.bincount(share.argmin(1), minlength=share.shape[1]).argmax())


def stability_warnings(courses: dict[float, Course], stable: bool = True) -> list[Notice]:
    """One warning for each way in which the platform may lose its hold, the worst first.

    Parameters
    ----------
    courses : dict of float to Course
        By the specimen spread that each was computed for. A warning says them beside each other.
    stable : bool
        Whether the commanded pose is a stable equilibrium at all.
    """
    last_s = max(course.times_s[-1] for course in courses.values())
    within = f"within {lasting(last_s)}"
    found, began = {}, {}
    for spread, course in courses.items():
        who = _who(spread)
        found[who] = one = summary(course)
        if one["began"]:
            began[who] = one
    notices: list[Notice] = []

    def warn(kind: str, head: str, by_who: dict[str, str]) -> None:
        if by_who:
            notices.append(Notice(kind, f"{head}: {_beside(by_who)}"))

    reason = "no stable equilibrium is found there" if stable else "the pose is balanced but not stable"
    warn("fall", f"draws cannot begin at the pose, {reason}", _told(found, _not_begun))
    warn("fall", f"the platform falls {within}", _told(began, _fallen))
    slack = _told(began, _slack)
    warn("slack", f"wires go slack {within}", slack)
    if not slack:
        warn("slack", f"a wire may keep little of its tension {within}", _told(began, _weak))
    warn("fall", f"the stiffness against the softest motion may fall {within}", _told(began, _loose))
    return notices


def _who(spread: float) -> str:
    return f"specimens differing by {100 * spread:g} %" if spread else "specimens alike"


def _told(found: dict[str, FallsReport], words: Callable[[FallsReport], str | None]) -> dict[str, str]:
    """What there is to say of each of the courses, by whose they are."""
    said = {who: words(one) for who, one in found.items()}
    return {who: text for who, text in said.items() if text is not None}


def _beside(told: dict[str, str]) -> str:
    """What is said of the courses beside each other; once, where it is the same."""
    by_text: dict[str, list[str]] = {}
    for who, text in told.items():
        by_text.setdefault(text, []).append(who)
    return "; ".join(f"{text} ({' or '.join(who)})" for text, who in by_text.items())


def _not_begun(found: FallsReport) -> str | None:
    return f"{_percent(1 - found['began'])} of them" if found["began"] < 1 else None


def _fallen(found: FallsReport) -> str | None:
    times, drop = found["fall_time_s"], found["fall_distance_mm"]
    if times is None:
        return None
    wire = int(np.argmax(found["fall_wires"])) + 1
    end = f"dropping {short(drop['median'], 3)} mm" if drop else "nothing catching it nearby"
    return (
        f"in {_percent(found['fall_probability'])} of the draws, first after {lasting(times['first'])}, in the "
        f"median after {lasting(times['median'])}, wire {wire} giving way, {end}"
    )


def _slack(found: FallsReport) -> str | None:
    each = []
    for i, (share, times) in enumerate(zip(found["slack_probability"], found["slack_time_s"], strict=True)):
        if times is not None:
            each.append(f"wire {i + 1} in {_percent(share)} of the draws, first after {lasting(times['first'])}")
    return ", ".join(each) or None


def _weak(found: FallsReport) -> str | None:
    tension = found["least_tension_share"]["q05"]
    if tension is None or tension >= NEAR_SLACK:
        return None
    return f"wire {found['least_tension_wire']} {_percent(float(tension))}"


def _loose(found: FallsReport) -> str | None:
    stiffness = found["stiffness_share"]["q05"]
    if stiffness is None or stiffness >= NEAR_LOOSE:
        return None
    return f"to {_percent(max(float(stiffness), 0.0))}"


def _percent(share: float) -> str:
    return "nearly all" if 0.995 <= share < 1 else f"{short(100 * share, 3)} %"
