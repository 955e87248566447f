"""The benchmark as one self-contained page, and its table of targets as text."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import Any

from .cases import Spec
from .files import write_atomically

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 70rem; margin: 2rem auto; padding: 0 1rem; color: #222 }
table { border-collapse: collapse; margin: .5rem 0 1.5rem } td, th { padding: .15rem .6rem; text-align: left }
th { border-bottom: 1px solid #888 } td.n { text-align: right; font-variant-numeric: tabular-nums }
tr.pass td:last-child { color: #06682e } tr.miss td:last-child { color: #a31515; font-weight: 600 }
.scroll { overflow-x: auto } .turn { writing-mode: vertical-rl; font-weight: 400 } small { color: #555 }
"""


def _number(value: float | None, digits: int = 3) -> str:
    return "-" if value is None or value != value else f"{value:.{digits}f}"


def _interval(found: dict[str, Any] | None) -> str:
    if not found:
        return "no cases"
    return f"{found['value']:.3f} [{found['low']:.3f}, {found['high']:.3f}] n={found['n']}"


def _verdict(passed: bool | None) -> str:
    return "-" if passed is None else "pass" if passed else "MISS"


def table(how: str, result: dict[str, Any]) -> str:
    """Targets of one answerer as text."""
    lines = [f"== {how}"]
    head = f"{'target':<54} {'wanted':<28} {'found, 90 % interval':<34}"
    lines.append(f"{head}      if still visible after a refit")
    for row, seen in zip(result["targets"], result["targets_visible"], strict=True):
        cells = f"{row['target']:<54} {row['wanted']:<28} {_interval(row['found']):<34} {_verdict(row['passed']):<4}"
        lines.append(f"{cells} {_interval(seen['found'])}")
    seconds = result["seconds"]
    if seconds:
        lines.append(f"seconds a case: median {seconds['median']:.1f}, largest {seconds['largest']:.1f}")
    if result["failed"]:
        lines.append(f"{len(result['failed'])} cases without an answer")
    return "\n".join(lines) + "\n"


def _comparison(results: dict[str, dict[str, Any]]) -> str:
    """Every target of every answerer side by side."""
    head = "<tr><th>target</th><th>wanted</th>" + "".join(f"<th>{escape(how)}</th>" for how in results) + "</tr>"
    rows = []
    for lines in zip(*(result["targets"] for result in results.values()), strict=True):
        cells = [escape(lines[0]["target"]), escape(lines[0]["wanted"])]
        cells += [_number(line["found"]["value"]) if line["found"] else "-" for line in lines]
        rows.append("<tr>" + "".join(f"<td>{c}</td>" for c in cells) + "</tr>")
    return f"<h2>Side by side</h2><table>{head}{''.join(rows)}</table>"


def _targets(found: list[dict[str, Any]]) -> str:
    rows = []
    for row in found:
        cells = [row["target"], row["wanted"], _interval(row["found"]), _verdict(row["passed"])]
        kind = {True: "pass", False: "miss", None: ""}[row["passed"]]
        rows.append(f'<tr class="{kind}">' + "".join(f"<td>{escape(c)}</td>" for c in cells) + "</tr>")
    head = "<tr><th>target</th><th>wanted</th><th>found, 90 % interval</th><th></th></tr>"
    return f"<table>{head}{''.join(rows)}</table>"


def _confusion(counts: dict[str, dict[str, int]]) -> str:
    answers = sorted({a for line in counts.values() for a in line} - set(counts))
    columns = [*counts, *answers]
    head = "<th>true</th>" + "".join(f'<th class="turn">{escape(c)}</th>' for c in columns)
    body = []
    for name, line in counts.items():
        total = sum(line.values())
        cells = []
        for c in columns:
            n = line.get(c, 0)
            hue = "64,140,84" if c == name else "190,90,60"
            shade = f' style="background: rgba({hue},{0.75 * n / total:.2f})"' if n else ""
            cells.append(f'<td class="n"{shade}>{n or ""}</td>')
        body.append(f"<tr><td>{escape(name)}</td>{''.join(cells)}</tr>")
    return f'<div class="scroll"><table><tr>{head}</tr>{"".join(body)}</table></div>'


def _breakdown(parts: dict[str, Any]) -> str:
    deltas = list(dict.fromkeys(d for line in parts.values() for d in line))
    head = "<th></th>" + "".join(f"<th>delta {escape(d)}</th>" for d in deltas)
    body = []
    for name, line in parts.items():
        cells = []
        for d in deltas:
            cell = line.get(d)
            if cell is None:
                cells.append("<td>-</td>")
                continue
            values = [cell[k]["value"] if cell[k] else None for k in ("detected", "right_group", "right")]
            n = cell["detected"]["n"]
            shown = " / ".join(_number(v, 2) for v in (*values, cell["optimal"]))
            cells.append(f'<td class="n">{shown} <small>n={n}</small></td>')
        body.append(f"<tr><td>{escape(name)}</td>{''.join(cells)}</tr>")
    note = "<p>Detected / best in the true group / best right (both of the detected) / Bayes-optimal best right.</p>"
    return f"{note}<table><tr>{head}</tr>{''.join(body)}</table>"


def _power(parts: dict[str, Any]) -> str:
    """Detection against delta, a line for each part, as inline SVG."""
    width, height, left, top = 460, 240, 40, 10
    deltas = sorted({float(d) for line in parts.values() for d in line})
    if len(deltas) < 2:
        return ""
    at = {d: left + i * (width - left - 130) / (len(deltas) - 1) for i, d in enumerate(deltas)}
    marks = [f'<text x="{at[d] - 6:.0f}" y="{height - 4}" font-size="11">{d:g}</text>' for d in deltas]
    for share in (0.0, 0.5, 1.0):
        y = top + (1 - share) * (height - 40)
        marks.append(f'<line x1="{left}" x2="{width - 130}" y1="{y:.0f}" y2="{y:.0f}" stroke="#ddd"/>')
        marks.append(f'<text x="6" y="{y + 4:.0f}" font-size="11">{share:g}</text>')
    for i, (name, line) in enumerate(parts.items()):
        colour = f"hsl({i * 360 // max(len(parts), 1)},60%,40%)"
        points = [(at[float(d)], top + (1 - c["detected"]["value"]) * (height - 40)) for d, c in line.items()]
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        marks.append(f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="1.5"/>')
        marks.append(f'<text x="{width - 122}" y="{16 + 14 * i}" font-size="11" fill="{colour}">{escape(name)}</text>')
    label = "share detected against delta, by protocol"
    return f'<svg viewBox="0 0 {width} {height}" width="{width}" role="img" aria-label="{label}">{"".join(marks)}</svg>'


def _rates(title: str, rates: dict[str, Any]) -> str:
    rows = "".join(f"<tr><td>{escape(k)}</td><td>{escape(_interval(v))}</td></tr>" for k, v in rates.items())
    return f"<h3>{escape(title)}</h3><table>{rows}</table>"


def _together(kinds: dict[str, Any]) -> str:
    """Files in which several effects hide, by kind and protocol: what was accepted and what is possible."""
    out = []
    for kind, labels in kinds.items():
        if not labels["all"]["detected"]:
            continue
        keys = [k for k, v in labels["all"].items() if v is not None and k != "left_over"]
        head = "<tr><th></th>" + "".join(f"<th>{escape(label)}</th>" for label in labels) + "</tr>"
        rows = []
        for key in keys:
            cells = [line[key] for line in labels.values()]
            shown = [_number(c, 2) if isinstance(c, float) else _interval(c) for c in cells]
            rows.append(f"<tr><td>{escape(key)}</td>" + "".join(f"<td>{escape(c)}</td>" for c in shown) + "</tr>")
        out.append(f"<h3>{escape(kind)}</h3><table>{head}{''.join(rows)}</table>{_left(labels['all']['left_over'])}")
    return "".join(out)


def _left(parts: dict[str, Any]) -> str:
    """What the best names leave of the truth: how often too little to be seen, and the power of a test of it."""
    lines = [
        f"<li>the best {escape(size)}: too little left in {escape(_interval(part['too_little']))} of the cases, power"
        f" {_number(part['power'], 2)}</li>"
        for size, part in parts.items()
    ]
    return f"<p>What the best names leave:</p><ul>{''.join(lines)}</ul>" if lines else ""


def _calibration(bins: list[dict[str, Any]]) -> str:
    """Stated probability against how often it came true, 95 % intervals."""
    rows = "".join(
        f"<tr><td>{b['from']:g} to {b['from'] + 0.2:g}</td><td>{_number(b['said'], 2)}</td>"
        f"<td>{escape(_interval(b['found']))}</td></tr>"
        for b in bins
    )
    return f"<table><tr><th>bin</th><th>stated</th><th>came true, 95 % interval</th></tr>{rows}</table>"


def _section(how: str, result: dict[str, Any]) -> str:
    others = {
        "clean files with one gross error: alarms": result["gross_error_alarms"],
        "wires of a file that carry no effect: alarms": result["innocent_alarms"],
        "events: the right hold, of those named right": result["event_hold_right"],
    }
    failed = f"<p>{len(result['failed'])} cases without an answer.</p>" if result["failed"] else ""
    return "".join(
        (
            f"<h2>{escape(how)}</h2>",
            failed,
            _targets(result["targets"]),
            "<h3>The same, cases that stay visible</h3><p>Without the cases whose effect the plain model swallows when"
            " it is refitted (less than 0.8 delta is left): delta, which is linear, promises more there than anyone can"
            " see.</p>",
            _targets(result["targets_visible"]),
            "<h3>What was named</h3>",
            _confusion(result["confusion"]),
            "<h3>Power</h3>",
            _power(result["by_protocol"]),
            "<h3>By protocol</h3>",
            _breakdown(result["by_protocol"]),
            "<h3>By effect</h3>",
            _breakdown(result["by_effect"]),
            _rates("Two effects at once", result["pairs"]),
            "<h3>Several effects, each visible beside the others</h3>",
            _together(result["together"]),
            *(f"<h3>{kind}, alone</h3>{_left(parts)}" for kind, parts in result["alone"].items() if parts),
            "<h3>Probability of a remainder</h3>",
            _calibration(result["remainder_calibration"]),
            "<p>The same with the kinds as frequent as the prior expects them:</p>",
            _calibration(result["remainder_calibration_as_expected"]),
            *(
                f"<h3>Inclusion of {of}, kinds as frequent as the prior expects them</h3>{_calibration(bins)}"
                for of, bins in result["inclusion_calibration"].items()
            ),
            *(_rates(f"Several wires, {kind}", found) for kind, found in result["several_wires"].items()),
            _rates("False alarms by protocol", result["clean_by_protocol"]),
            _rates("Held-out gap closed, pooled, by delta", result["gap_closed"]),
            _rates("Also", others),
        )
    )


def write_page(path: Path, results: dict[str, dict[str, Any]], lost: list[Spec]) -> None:
    """Write the page of all answerers.

    Parameters
    ----------
    lost : cases whose delta no sensible amplitude reaches on their protocol.
    """
    absent: dict[str, list[str]] = {}
    for spec in lost:
        absent.setdefault(f"{' + '.join(spec.names)}, {spec.protocol}", []).append(f"{spec.delta:g}")
    listed = "".join(f"<li>{escape(k)}: delta {', '.join(v)}</li>" for k, v in absent.items())
    body = "".join(_section(how, result) for how, result in results.items())
    html = (
        '<!doctype html><html lang="en"><head><meta charset="utf-8"><title>Hidden effects</title>'
        f"<style>{STYLE}</style></head><body><h1>Hidden effects</h1>"
        "<p>Simulated tests in which one effect, two or none is hidden; delta is its size in standard deviations after"
        " everything the plain model can absorb. Intervals: Clopper-Pearson for rates, bootstrap over cases for pooled"
        f" figures.</p>{_comparison(results)}{body}"
        f"<h2>Out of reach</h2><p>No sensible amplitude gives these:</p><ul>{listed}</ul></body></html>\n"
    )
    write_atomically(path, html)
