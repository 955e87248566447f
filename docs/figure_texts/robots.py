"""Studies of calibrated robots."""

from typing import Any

from figure_texts.tables import run_of, table_head, table_row

_HELD = {"exit_points": "exit points", "references": "references", "lengths": "lengths", "poses": "poses"}


def calibrated_robots(kept: dict[str, Any]) -> str:
    """A table of intervals of drawn robots by what is known of the poses."""
    found = kept["result"]
    lines = [
        f"{run_of(kept)} draws {found['robots']} robots of 2 to 9 wires",
        f"and takes {found['median_seconds_each']:.1f} s each at the median. Shares of 90 % intervals that hold",
        "the truth, and of calibrations that converge and are usable, in %:",
        "",
        *table_head("poses", "robots", *_HELD.values(), "converged", "usable"),
    ]
    for mode in ("all", "poses known", "poses roughly known", "some poses", "poses unknown"):
        share = found["shares"][mode]
        lines += table_row(
            mode, share["robots"], *(f"{100 * share[name]:.0f}" for name in (*_HELD, "converged", "usable"))
        )
    return "\n".join(lines) + "\n\n"


def anchors_from_lengths_alone(kept: dict[str, Any]) -> str:
    """Sentences on anchors from lengths alone."""
    blind = kept["result"]
    right, wrong = (
        f"{100 * share['share']:.0f} % [{100 * share['low']:.0f}, {100 * share['high']:.0f} %]"
        for share in (blind["found"], blind["silently_wrong"])
    )
    lines = [
        "Lengths alone, at 24 unknown poses, with four or five anchors that are off by 2 % of the span, and with",
        "unread tensions that the robot's file bounds at 0.3 of what the lines may bear:",
        f"{run_of(kept)} finds {right} of {blind['robots']}",
        "calibrations usable with every coordinate within four standard errors (95 % interval),",
        f"{wrong} usable and wrong; the others are refused. Errors of distances between anchors are then",
        f"{100 * blind['distance_error_over_before']:.0f} % of those before, at the median.",
    ]
    return "\n".join(lines) + "\n"


def anchors_held_exact(kept: dict[str, Any]) -> str:
    """A paragraph on what is said of anchors that are held exact, right ones and wrong ones."""
    found = kept["result"]

    def said(key: str) -> str:
        one = found[key]
        return f"{round(one['share'] * one['of'])} of {one['of']} [{100 * one['low']:.0f}, {100 * one['high']:.0f} %]"

    return (
        f"\nAnchors held exact: {run_of(kept)},\n"
        f"{found['robots']} robots, joint values exact or of a stated error, anchors right or off by\n"
        "0.01 to 1 % of the span; 95 % intervals. Where all is right,\n"
        f"{said('usable_where_all_is_right')} calibrations are usable. Of wrong anchors that a\n"
        "chi-squared test of all readings, which knows every error, would see with 99 % power,\n"
        f"{said('not_usable_where_power_is_99_percent')} are not usable; where its power is less,\n"
        f"{said('not_usable_where_it_is_less')} are not.\n"
    )
