"""What is claimed of all of it: the table of the page on trust, and the four figures of the README."""

import re
from pathlib import Path
from typing import Any

from figure_texts.tables import percent, table_row

DOCS = Path(__file__).parents[1]


_OF_NO_GROUP = "an accepted name that is of no hidden effect's group"


def table_of_claims(kept: dict[str, Any]) -> str:
    """A table of what is claimed and what was found, with the study behind it."""
    found = {name: study["result"] for name, study in kept.items()}
    coverage, scales, clean = found["coverage"], found["any_scale"]["all"], found["clean_any_scale"]["all"]["check"]
    robots, agreement = found["robot_calibration"]["shares"]["all"], found["robot_agreement"]
    taut, slack = (found["any_protocol"]["shares"][group] for group in ("taut throughout", "slack in a hold"))
    every_scale = [share for name, share in scales.items() if name != "tests"]
    wires = found["real_wires"]["first holds to the rest"]
    errors = "; ".join(
        f"{name}: {wire['plain_rmse_N']:.3f} to {wire['final_rmse_N']:.3f} N" for name, wire in wires.items()
    )
    rows = [
        (
            "90 % intervals of parameters hold the truth",
            f"{percent(coverage['interval_coverage'])} of {coverage['intervals']}, on {coverage['wires']} wires",
            "intervals-study",
        ),
        (
            "they do so at any scale, from thread to mooring rope",
            f"{percent(min(every_scale))} to {percent(max(every_scale))}, by parameter, of {scales['tests']} tests",
            "intervals-study",
        ),
        (
            "they do so whatever the protocol, as long as the wire stays taut",
            f"{percent(taut['all'])}, of {taut['tests']} tests; {percent(slack['all'])} where it is slack in a hold",
            "intervals-study",
        ),
        (
            "90 % bands hold the readings of later holds",
            f"{percent(coverage['held_out_coverage'])} of {coverage['held_out_readings']}",
            "intervals-study",
        ),
        (
            "the check of a right model fails in 4 %",
            f"{100 * clean['value']:.1f} % [{100 * clean['low']:.1f}, {100 * clean['high']:.1f}] of {clean['n']} tests",
            "check-study",
        ),
        (
            "``discover`` names an effect of its catalogue, of δ = 10, correctly",
            f"{share_in_table('discover-hidden.inc', 'top-ranked effect in the true group, δ = 10')} files in which "
            "it sees something",
            "discover-study",
        ),
        (
            "an accepted name is wrong in at most 10 %",
            f"{share_in_table('discover-hidden.inc', _OF_NO_GROUP)} names",
            "discover-study",
        ),
        (
            "both of two effects at once are named",
            f"{share_in_table('discover-hidden.inc', 'two effects: both accepted')} files; an ideal judge: "
            f"{share_in_table('discover-hidden.inc', 'an ideal judge who has to estimate the noise: both')}",
            "discover-study",
        ),
        (
            "an effect in no catalogue is not given a name",
            f"{share_in_table('discover-hidden.inc', 'effect in no catalogue: unknown or its group')} files",
            "discover-study",
        ),
        ("with what is named, the error on the paper's later holds falls", errors, "models-study"),
        (
            "a robot's poses agree with independent solvers",
            f"{agreement['cases']} equilibria within {agreement['largest_m']:.0e} m",
            "robot-study",
        ),
        (
            "90 % intervals of calibrated wire lengths hold the truth",
            f"{percent(robots['lengths'])}, on {robots['robots']} drawn robots",
            "robot-study",
        ),
    ]
    lines = [".. list-table::", "   :header-rows: 1", "   :widths: 42 44 14", "", *table_row("claim", "found", "study")]
    for claim, result, study in rows:
        lines += table_row(claim, result, f":doc:`{study.removesuffix('-study')} <{study}>`")
    return "\n".join(lines) + "\n"


def share_in_table(file: str, row: str) -> str:
    """What a pooled table found, in the row of that name."""
    table = (DOCS / file).read_text(encoding="utf-8")
    found = re.search(rf"\* - {re.escape(row)}\n.*\n\s+- (.*)", table)
    assert found is not None, row
    return found[1].strip("*").replace("**", "")


def answer_of_discover() -> str:
    """What the study of `discover` found, before its tables."""
    hidden = "discover-hidden.inc"
    alarms = share_in_table("discover-clean.inc", "false alarms on clean files")
    seen = share_in_table(hidden, "detected at δ = 10")
    first = share_in_table(hidden, "top-ranked effect in the true group, δ = 10")
    both = share_in_table(hidden, "two effects: both accepted")
    wrong = share_in_table(hidden, _OF_NO_GROUP)
    return (
        f"It suspects an effect in {alarms} files that have none. It sees a single hidden effect of δ = 10 in "
        f"{seen} files; where it does, the effect that it ranks first is of the true kind in {first}. Of two effects "
        f"at once it accepts both in {both}. Of the names that it accepts, {wrong} are wrong.\n"
    )


def readme_figures(kept: dict[str, Any]) -> str:
    """The README's list."""
    coverage, robots = kept["coverage"]["result"], kept["robot_agreement"]["result"]
    inside, later = (100 * coverage[f"{of}_coverage"] for of in ("interval", "held_out"))
    wire = kept["real_wires"]["result"]["first holds to the rest"]["roc-line-1m"]
    alarms = share_in_table("discover-clean.inc", "false alarms on clean files")
    intervals = f"{inside:.0f} % of {coverage['intervals']} intervals of 90 % hold the truth"
    error = f"on the paper's thin line from {wire['plain_rmse_N']:.3f} to {wire['final_rmse_N']:.3f} N"
    others = f"MuJoCo or a minimiser of the energy within {robots['largest_m']:.0e} m"
    suspected = f"`discover` suspects an effect in {alarms} files without one"
    return (
        f"- [Intervals](docs/intervals-study.rst): {intervals}; {later:.0f} % of later readings lie in their bands.\n"
        f"- [False alarms](docs/discover-study.rst): {suspected}; 4 % are intended.\n"
        f"- [Real wires](docs/models-study.rst): what `discover` named lowers the error {error}.\n"
        f"- [Robots](docs/robot-study.rst): {robots['cases']} random equilibria agree with {others}.\n"
    )
