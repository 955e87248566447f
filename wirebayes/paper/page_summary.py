"""The summary of the paper reproduced: what was measured, what is known well, what is not."""

from typing import Any

from wirebayes.paper.page_tables import LEAST_COVERAGE, Rows
from wirebayes.report.blocks import Columns, Points, number, span
from wirebayes.sentences import counted, listed


def in_a_minute(tables: dict[str, Rows]) -> Columns:
    """Three short lists, every number from the tables."""
    return Columns([_measured(tables["measured"]), _known(tables), _open(tables)])


def creep_of_each_wire(rows: Rows) -> str:
    """The creep of each wire in a sentence, as one history."""
    first = [row for row in rows if row["likelihood"] == "chain" and row["time_s"] == TWO_MINUTES_S]
    creep = [
        f"{unbroken(r)} {number(r['q50_mm'])} mm ({span(r['q05_mm'], r['q95_mm'])}) under {r['tension_N']:.1f} N"
        for r in first
    ]
    return f"Creep within two minutes: {'; '.join(creep)}; 90 % intervals in brackets."


TWO_MINUTES_S = 120.0  # the paper's longest hold


def _measured(rows: Rows) -> Points:
    samples = listed([f"{row['material']} ({row['length_mm'] / 1000:g} m)" for row in rows])
    losses = [row["median_loss_percent"] for row in rows]
    low, high = min(row["smallest_tension_N"] for row in rows), max(row["largest_tension_N"] for row in rows)
    readings = sum(row["readings"] for row in rows)
    return Points(
        "What was measured",
        [
            f"{counted(len(rows), 'sample')}: {samples}.",
            f"Each was stretched step by step and held: {readings} tensions, from {low:.2f} to {high:.2f} N.",
            f"Within one hold a wire typically lost {_percent(min(losses), max(losses))} of its tension.",
        ],
    )


def _percent(low: float, high: float) -> str:
    """A range, or one number where both ends round to it."""
    return f"{low:.0f} %" if f"{low:.0f}" == f"{high:.0f}" else f"{low:.0f} to {high:.0f} %"


def _known(tables: dict[str, Rows]) -> Points:
    stiff = [row for row in tables["posterior"] if row["likelihood"] == "chain" and row["parameter"] == "k1"]
    intervals = "; ".join(f"{unbroken(row)} {span(row['q05'], row['q95'])} N" for row in stiff)
    outside = sum(row["verdict"] == "outside" for row in stiff)
    exponents = [row for row in tables["posterior"] if row["parameter"] == "N"]
    below = sum(row["q95"] < 1 for row in exponents)
    whole = sum(row["published"] == 1 for row in exponents if row["likelihood"] == "chain")
    points = [
        f"Stiffness k1, once the holds are taken as one history (90 % intervals): {intervals}.",
        f"The published k1 lies outside for {outside} of {counted(len(stiff), 'wire')}.",
        f"Creep follows a stretched exponential: N is below 1 in {below} of {len(exponents)} fits. "
        f"The paper has N = 1 on {whole} of {counted(len(stiff), 'wire')}.",
    ]
    rows = of_table_4(tables.get("least_squares", []), "published")
    if rows:
        misses = listed([f"{row['rms_all_N']:.3f}" for row in rows])
        points.append(f"Table 4 does fit if every hold starts afresh from its first reading: rms {misses} N.")
    return Points("What is known well", points)


def _open(tables: dict[str, Rows]) -> Points:
    loose = [row for row in tables["posterior"] if row["verdict"] == "not determined" and "*" not in row["parameter"]]
    alone = list(dict.fromkeys(row["parameter"] for row in loose if row["likelihood"] == "hold"))
    ridge = [row for row in tables["posterior"] if row["likelihood"] == "hold" and row["parameter"] == "k1"]
    factor = min(row["q95"] / row["q05"] for row in ridge)
    chain = [f"{row['parameter']} of {unbroken(row)}" for row in loose if row["likelihood"] == "chain"]
    points = []
    if alone:
        points.append(
            f"Hold by hold, the only way in which Table 4 fits, the readings do not determine {listed(alone)}: "
            f"k1's 90 % interval spans at least a factor of {number(factor, 2)}."
        )
    if chain:
        points.append(f"Not determined even as one history: {listed(chain)}.")
    poor = [row for row in tables["held_out"] if row["likelihood"] == "chain" and row["coverage_90"] < LEAST_COVERAGE]
    if poor:
        wires = len({row["experiment"] for row in tables["held_out"]})
        points.append(
            "The model is incomplete: fitted to the first five holds as one history, it misses the later ones "
            f"on {len(poor)} of {counted(wires, 'wire')}."
        )
    points.append("No hold was read for longer than two minutes: creep after an hour or a day is extrapolated.")
    return Points("What is not known", points)


def of_table_4(rows: Rows, source: str) -> Rows:
    """Rows of the reading under which Table 4 fits: hold by hold, law (1)."""
    return [r for r in rows if (r["likelihood"], r["elastic_law"], r["parameters"]) == ("hold", "hooke", source)]


def unbroken(row: dict[str, Any]) -> str:
    """A sample's name that does not break at its hyphens."""
    return str(row["experiment"]).replace("-", "\u2011")
