"""Tables of the paper reproduced, from the rows that ``reproduce`` wrote."""

from collections.abc import Mapping, Sequence
from typing import Any

from wirebayes.report.blocks import Table, number, span
from wirebayes.report.cells import percent, with_unit

Rows = list[dict[str, Any]]
VERDICTS = {"inside": "good", "outside": "bad", "not determined": "open", "yes": "good", "no": "bad"}
LIKELIHOOD = {"chain": "chain", "hold": "hold by hold"}
LEAST_COVERAGE = 0.75  # of readings in a band that promises 0.9
_TIMES = {120.0: "2 min", 3600.0: "1 h", 86400.0: "1 day"}  # as people say them


def column_values(rows: Sequence[Mapping[str, Any]], key: str) -> list[Any]:
    """What stands under a key, each once, in the order of the rows."""
    return list(dict.fromkeys(row[key] for row in rows))


def test_table(rows: Rows) -> Table:
    """What each test consisted of."""
    header = ["sample", "material", "length, mm", "holds", "not recorded", "readings", "tension, N", "median loss, %"]
    lines = []
    for r in rows:
        tension = f"{r['smallest_tension_N']:.2f} … {r['largest_tension_N']:.2f}"
        counts = (str(r[key]) for key in ("holds", "unrecorded_holds", "readings"))
        loss = f"{r['median_loss_percent']:.1f}"
        lines.append([r["experiment"], r["material"], number(r["length_mm"], 4), *counts, tension, loss])
    return Table(header, lines)


def table_4(rows: Rows, likelihood: str, history: str, law: str, caption: str) -> Table:
    """Published and refitted parameters in one interpretation of the model.

    Parameters
    ----------
    rows : sequence of dict
        Those of ``least_squares.json``.
    likelihood : {"chain", "hold"}
    history : {"saturating", "additive"}
    law : {"hooke", "modified"}
        Which rows are shown.
    """
    chosen = [r for r in rows if (r["likelihood"], r["history"], r["elastic_law"]) == (likelihood, history, law)]
    header = ["sample", "parameters", "k1, N", "B, mm N⁻ᵁ", "U", "k2, s⁻ᴺ", "N", "preload, mm"]
    header += ["rms, first five, N", "rms, rest, N", "rms, all, N", "parameters not constrained"]
    lines = []
    for r in chosen:
        values = (number(r[key], 4) for key in ("k1_N", "B", "U", "k2", "N", "preload_mm"))
        misses = (f"{r[key]:.3f}" for key in ("rms_first_N", "rms_rest_N", "rms_all_N"))
        lines.append([r["experiment"], r["parameters"], *values, *misses, r["not_held_back"] or "–"])
    return Table(header, lines, caption)


def interval_table(rows: Rows, caption: str) -> Table:
    """Intervals and verdicts of both likelihoods beside every published value."""
    header = ["sample", "parameter", "published"]
    for likelihood in LIKELIHOOD.values():
        header += [f"{likelihood}: 90 % interval", "contraction", "verdict"]
    lines = []
    for chain, alone in _pairs(rows, "parameter"):
        parameter = chain["parameter"].replace("*", "·")
        name = with_unit(parameter, chain["unit"])
        line = [chain["experiment"], name, number(chain["published"], 4)]
        for row in (chain, alone):
            line += [span(row["q05"], row["q95"]), percent(row["contraction"]), row["verdict"]]
        lines.append(line)
    return Table(header, lines, caption, VERDICTS)


def forecast_table(rows: Rows, caption: str) -> Table:
    """How the forecasts of the unused holds did."""
    header = ["sample", "interpretation of the model", "unused readings", "rms, N", "median width of band, N"]
    lines = []
    for r in rows:
        kept = "yes" if r["coverage_90"] >= LEAST_COVERAGE else "no"
        misses = (f"{r[key]:.3f}" for key in ("rms_N", "median_band_width_N"))
        covered = f"{100 * r['coverage_90']:.0f} %"
        lines.append([r["experiment"], LIKELIHOOD[r["likelihood"]], str(r["readings"]), *misses, covered, kept])
    return Table([*header, "in the 90 % band", "reliable"], lines, caption, VERDICTS)


def creep(rows: Rows, caption: str) -> Table:
    """Creep elongation at a tension after some times."""
    header = ["sample", "tension, N", "after", "Table 4, mm"]
    for likelihood in LIKELIHOOD.values():
        header += [f"{likelihood}, mm", "90 % interval"]
    lines = []
    for of_chain, alone in _pairs(rows, "time_s"):
        time_s = of_chain["time_s"]
        after = _TIMES.get(time_s, f"{time_s:g} s")
        tension = f"{of_chain['tension_N']:.2f}"
        line = [of_chain["experiment"], tension, after, number(of_chain["published_mm"])]
        for row in (of_chain, alone):
            interval = span(row["q05_mm"], row["q95_mm"])
            line += [number(row["q50_mm"]), interval]
        lines.append(line)
    return Table(header, lines, caption)


def drift_claim(rows: Rows) -> Table:
    """The paper's claim on the drift of a robot."""
    header = ["wire", "robot", "specimens differ by", "loaded before", "drift, mm", "90 %", "tilt, degrees", "90 %"]
    lines = []
    for r in rows:
        loaded = f"{r['loaded_before_s'] / 3600:g} h" if r["loaded_before_s"] else "never"
        line = [r["experiment"], r["robot"], f"{100 * r['specimen_spread']:g} %", loaded]
        for key in ("drift_mm", "tilt_deg"):
            line += [number(r[f"q50_{key}"], 2), span(r[f"q05_{key}"], r[f"q95_{key}"], 2)]
        lines.append([*line, f"{r['probability']:.2f}"])
    return Table([*header, "claim holds with probability"], lines)


CLAIM_STEPS = {
    "table_4_elongation": "Table 4, eq. (5) as printed: elongation of the tested sample",
    "table_4_strain": "Table 4, creep as a strain of the whole wire",
    "chain_strain": "the chain's posterior",
    "chain_workspace": "the chain's posterior, over the workspace",
}


def robot_claim(rows: Rows) -> Table:
    """The paper's claim taken apart, one thing changed a line."""
    wires = column_values(rows, "experiment")
    found = {(row["experiment"], row["step"]): row for row in rows}
    lines = []
    for step, words in CLAIM_STEPS.items():
        drifts = [_drift(found[wire, step], with_band=step.startswith("chain")) for wire in wires]
        lines.append([words, *drifts])
    caption = (
        f"Drift within 60 s on new wires, mm: {rows[0]['robot']} at its home pose unless the workspace is named. Each "
        "line changes one thing and keeps it in the lines below. In brackets: 90 % of the draws (and poses)."
    )
    return Table(["what is assumed", *wires], lines, caption)


def _drift(row: dict[str, Any], with_band: bool) -> str:
    middle = f"{row['q50_drift_mm']:.3g}"
    return f"{middle} ({span(row['q05_drift_mm'], row['q95_drift_mm'], 2)})" if with_band else middle


def robot_mass(rows: Rows) -> Table:
    """What mass and size the claim needs."""
    sizes = column_values(rows, "size_factor")
    wires = column_values(rows, "experiment")
    masses = {(r["experiment"], r["size_factor"]): r["largest_mass_kg"] for r in rows}
    lines = [[wire, *(number(1e3 * masses[wire, size], 2) for size in sizes)] for wire in wires]
    caption = (
        f"What the claim needs: the heaviest platform of {rows[0]['robot']}, in grams, for which it holds on new wires "
        "with a probability of 95 % at nineteen poses of twenty, with the robot made smaller or larger."
    )
    return Table(["wire", *(f"size × {size:g}" for size in sizes)], lines, caption)


def sampling(rows: Rows) -> Table:
    """How the sampler did."""
    header = ["sample", "interpretation of the model", "trained on", "converged", "autocorrelation time, steps"]
    header += ["smallest ESS", "nested R-hat", "likelihood evaluations"]
    header += ["draws per evaluation", "per kept evaluation", "modes"]
    lines = []
    for row in rows:
        lines.append(
            [
                row["experiment"],
                LIKELIHOOD[row["likelihood"]],
                row["trained_on"],
                "yes" if row["converged"] else "no",
                f"{row['autocorrelation_steps']:.1f}",
                number(round(row["smallest_ess"])),
                f"{row['largest_nested_r_hat']:.4f}",
                number(row["likelihood_evaluations"]),
                number(row["effective_draws_per_evaluation"], 2),
                number(row["effective_draws_per_kept_evaluation"], 2),
                str(row["modes_found"]),
            ]
        )
    return Table(header, lines, words=VERDICTS)


def _pairs(rows: Rows, key: str) -> list[tuple[dict[str, Any], dict[str, Any]]]:
    """Rows of the chain, each with its counterpart hold by hold."""
    alone = {(row["experiment"], row[key]): row for row in rows if row["likelihood"] == "hold"}
    pairs = []
    for row in rows:
        if row["likelihood"] == "chain":
            pairs.append((row, alone[row["experiment"], row[key]]))
    return pairs
