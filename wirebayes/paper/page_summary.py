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
    creep = []
    for row in rows:
        if row["likelihood"] == "chain" and row["time_s"] == TWO_MINUTES_S:
            interval = span(row["q05_mm"], row["q95_mm"])
            creep.append(f"{unbroken(row)} {number(row['q50_mm'])} mm ({interval}) under {row['tension_N']:.1f} N")
    return f"Creep within two minutes: {'; '.join(creep)}; 90 % intervals in brackets."


TWO_MINUTES_S = 120.0  # the paper's longest hold


def _measured(rows: Rows) -> Points:
    samples = []
    losses = []
    readings = 0
    for row in rows:
        length_m = row["length_mm"] / 1000
        samples.append(f"{row['material']} ({length_m:g} m)")
        losses.append(row["median_loss_percent"])
        readings += row["readings"]
    low = min(row["smallest_tension_N"] for row in rows)
    high = max(row["largest_tension_N"] for row in rows)
    loss = _percent(min(losses), max(losses))
    points = [
        f"{counted(len(rows), 'sample')}: {listed(samples)}.",
        f"Each was stretched step by step and held: {readings} tensions, from {low:.2f} to {high:.2f} N.",
        f"Within one hold a wire typically lost {loss} of its tension.",
    ]
    return Points("What was measured", points)


def _percent(low: float, high: float) -> str:
    """A range, or one number where both ends round to it."""
    return f"{low:.0f} %" if f"{low:.0f}" == f"{high:.0f}" else f"{low:.0f} to {high:.0f} %"


def _known(tables: dict[str, Rows]) -> Points:
    points = [*_known_stiffness(tables["posterior"]), _known_exponents(tables["posterior"])]
    rows = of_table_4(tables.get("least_squares", []), "published")
    if rows:
        misses = listed([f"{row['rms_all_N']:.3f}" for row in rows])
        points.append(f"Table 4 does fit if every hold starts afresh from its first reading: rms {misses} N.")
    return Points("What is known well", points)


def _known_stiffness(rows: Rows) -> list[str]:
    stiff = _of(rows, "chain", "k1")
    intervals = "; ".join(f"{unbroken(row)} {span(row['q05'], row['q95'])} N" for row in stiff)
    outside = sum(row["verdict"] == "outside" for row in stiff)
    return [
        f"Stiffness k1, once the holds are taken as one history (90 % intervals): {intervals}.",
        f"The published k1 lies outside for {outside} of {counted(len(stiff), 'wire')}.",
    ]


def _known_exponents(rows: Rows) -> str:
    exponents = [row for row in rows if row["parameter"] == "N"]
    below = sum(row["q95"] < 1 for row in exponents)
    chains = _of(rows, "chain", "N")
    whole = sum(row["published"] == 1 for row in chains)
    return (
        f"Creep follows a stretched exponential: N is below 1 in {below} of {len(exponents)} fits. "
        f"The paper has N = 1 on {whole} of {counted(len(chains), 'wire')}."
    )


def _of(rows: Rows, likelihood: str, parameter: str) -> Rows:
    return [row for row in rows if row["likelihood"] == likelihood and row["parameter"] == parameter]


def _open(tables: dict[str, Rows]) -> Points:
    points = [*_not_determined(tables["posterior"]), *_not_predicted(tables["held_out"])]
    points.append("No hold was read for longer than two minutes: creep after an hour or a day is extrapolated.")
    return Points("What is not known", points)


def _not_determined(rows: Rows) -> list[str]:
    """The parameters that the readings leave open, hold by hold and as one history."""
    alone = []
    chain = []
    for row in rows:
        name = row["parameter"]
        if row["verdict"] != "not determined" or "*" in name:
            continue
        if row["likelihood"] == "chain":
            chain.append(f"{name} of {unbroken(row)}")
        elif name not in alone:
            alone.append(name)
    points = []
    if alone:
        factor = min(row["q95"] / row["q05"] for row in _of(rows, "hold", "k1"))
        points.append(
            f"Hold by hold, the only way in which Table 4 fits, the readings do not determine {listed(alone)}: "
            f"k1's 90 % interval spans at least a factor of {number(factor, 2)}."
        )
    if chain:
        points.append(f"Not determined even as one history: {listed(chain)}.")
    return points


def _not_predicted(rows: Rows) -> list[str]:
    """The wires whose later holds the first ones do not predict."""
    poor = [row for row in rows if row["likelihood"] == "chain" and row["coverage_90"] < LEAST_COVERAGE]
    if not poor:
        return []
    wires = len({row["experiment"] for row in rows})
    return [
        "The model is incomplete: fitted to the first five holds as one history, it misses the later ones "
        f"on {len(poor)} of {counted(wires, 'wire')}."
    ]


def of_table_4(rows: Rows, source: str) -> Rows:
    """Rows of the reading under which Table 4 fits: hold by hold, law (1)."""
    wanted = ("hold", "hooke", source)
    return [row for row in rows if (row["likelihood"], row["elastic_law"], row["parameters"]) == wanted]


def unbroken(row: dict[str, Any]) -> str:
    """A sample's name that does not break at its hyphens."""
    return str(row["experiment"]).replace("-", "\u2011")
