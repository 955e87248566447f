"""The page of ``wirebayes plan``: tests that could be done, best first, with what each would teach and show."""

from pathlib import Path
from typing import Any

from wirebayes.answers.headline import plan_in_a_sentence
from wirebayes.io.run_folder import read_json
from wirebayes.json_files.plan import JudgedProtocol, PlanJson
from wirebayes.report.blocks import (
    Block,
    Columns,
    Page,
    Picture,
    Pictures,
    Points,
    Section,
    Table,
    Text,
    before_the_answer,
    beside_the_answer,
    embedded,
    files_beside,
    number,
    picture_file,
    seed_of_page,
    span,
    unit_text,
)
from wirebayes.report.glossary import meaning
from wirebayes.report.pictures.plan import is_given
from wirebayes.sentences import counted, spoken

_AIMS = {
    "parameters": "how much they say about the material",
    "creep": "how well the creep after an hour would be known",
}


def plan_page(folder: Path, configuration: dict[str, Any]) -> Page:
    """The content of ``plan.json``."""
    found: PlanJson = read_json(folder / "plan.json")
    rows = found["protocols"]
    columns = Columns([_requested(found), _recommended(found), _reliability(rows)])
    first = before_the_answer(found)
    picture = picture_file(folder, "plan")
    if picture is not None:
        alt = "Expected widths and detectable effects of each test."
        first.append(Pictures([Picture(embedded(picture), alt, _PICTURE, wide=True)]))
    first += [*beside_the_answer(found), columns, _ranking(found)]
    sections = [Section("Summary", first)]
    sections += [Section(f"{row['rank']}. {row['name']}", _protocol(row), folded=row["rank"] > 1) for row in rows]
    sections.append(files_beside(folder, _FILES))
    effects = [effect for row in rows for effect in row["effects"]]
    sections.append(meaning(("hold", "90 % interval", "information", "δ"), effects))
    lead = plan_in_a_sentence(found)
    return Page("What a test would teach", lead, sections, seed_of_page(configuration))


_PICTURE = (
    "Left: the uncertainty that each test would leave of each quantity, as a share of the guess's; right: how easily "
    "it would show each effect."
)
_FILES = (
    ("plan.json", "every number of this page as JSON"),
    ("configuration.json", "the options of this run, with version and seed"),
)


def _requested(found: PlanJson) -> Points:
    aim = found["aim"]
    by = _AIMS[aim[0]] if len(aim) == 1 else f"how well {_words(aim[0])} and {_words(aim[1])} would be distinguished"
    points = [f"The guess: {found['guess']['source']}.", f"The tests are ranked by {by}."]
    if found["budget_min"] is not None:
        points.append(f"Available time: {number(found['budget_min'])} min.")
    return Points("What was requested", points)


def _recommended(found: PlanJson) -> Points:
    best = found["protocols"][0]
    points = [f"Do {best['name']}" + (f": {best['words']}." if best["words"] else ".")]
    creep = best["creep"]["creep_1h_mm"]
    points.append(
        f"The creep after an hour at {number(best['creep']['tension_N'])} N would be known to "
        f"{number(creep['sd'], 2)} mm (guess: {number(creep['guess_sd'], 2)} mm)."
    )
    return Points("What to do", points)


def _reliability(rows: list[JudgedProtocol]) -> Points:
    least = min(row["simulated_tests"] for row in rows)
    return Points(
        "How far it can be trusted",
        [
            f"Each test was simulated and fitted {least} times or more, with the priors of the later fit. Half of the "
            "tests would do better than a median, half worse; the range says by how much.",
            "They hold if the wire is as guessed and nothing is missing in the model.",
        ],
    )


def _ranking(found: PlanJson) -> Table:
    names = [n for n in ("k1", "B", "U", "k2", "N") if n in found["protocols"][0]["parameters"]]
    robot = found["protocols"][0]["robot"] is not None
    lines = [
        [
            str(row["rank"]),
            row["name"],
            number(row["duration_min"]),
            number(row["information_bits"]),
            *(number(row["parameters"][n]["sd"], 2) for n in names),
            number(row["creep"]["creep_1h_mm"]["sd"], 2),
            *([number(row["robot"] and row["robot"]["drift_sd_mm"], 2)] if robot else []),
            "yes" if row["within_budget"] else "too long",
        ]
        for row in found["protocols"]
    ]
    header = ["rank", "test", "minutes", "bits"]
    units = {n: unit_text(found["protocols"][0]["parameters"][n]["unit"]) for n in names}
    header += [f"sd of {n}, {units[n]}" if units[n] else f"sd of {n}" for n in names]
    header.append("sd of creep in 1 h, mm")
    header += ["sd of the robot's drift in 1 h, mm"] if robot else []
    return Table(
        [*header, "within budget"], lines, "Standard deviations of the posterior, median over the simulated tests."
    )


def _protocol(row: JudgedProtocol) -> list[Block]:
    blocks: list[Block] = [
        Text(
            f"{counted(row['holds'], 'hold')} with {counted(row['readings'], 'reading')}, "
            f"{number(row['duration_min'])} min" + (f": {row['words']}." if row["words"] else ".")
        )
    ]
    quantities = row["parameters"] | {
        "creep_longest_hold_mm": row["creep"]["creep_longest_hold_mm"],
        "creep_1h_mm": row["creep"]["creep_1h_mm"],
    }
    lines = [
        [
            f"{_words(n)}, {unit}" if (unit := unit_text(q["unit"])) else _words(n),
            *(number(value, 2) for value in (q["sd"], q["width_90"])),
            span(q["width_90_low"], q["width_90_high"], 2),
            "given" if is_given(q) else number(q["guess_sd"], 2),
        ]
        for n, q in quantities.items()
    ]
    header = ["quantity", "sd", "90 % width", "in 90 % of tests", "sd of the guess"]
    creep = row["creep"]
    caption = f"Creep of {number(creep['length_mm'])} mm at {number(creep['tension_N'])} N; the longest hold lasts "
    blocks.append(Table(header, lines, caption + f"{number(creep['longest_hold_s'])} s."))
    if row["effects"]:
        shown = [
            [
                _words(n),
                number(e["amplitude_80"], 2),
                unit_text(e["unit"]) or "–",
                number(e["delta_80"], 2),
                ", ".join(map(_words, e["confused_with"])) or "–",
            ]
            for n, e in row["effects"].items()
        ]
        caption = "Smallest amplitude seen in 80 % of tests, its size δ in standard deviations, and what it looks like."
        blocks.append(Table(["effect", "amplitude", "unit", "δ", "hard to distinguish from"], shown, caption))
    if row["not_identifiable"]:
        parts = [sentence.partition(": ")[::2] for sentence in row["not_identifiable"]]
        blocks.append(Table(["what", "why not"], [[_words(a), b] for a, b in parts], "What it would not show."))
    return blocks


def _words(name: str) -> str:
    return _SPOKEN.get(name, spoken(name))


_SPOKEN = {
    "creep_longest_hold_mm": "creep after the longest hold",
    "creep_1h_mm": "creep after 1 h",
    "sensor_sd": "error of a reading (sensor_sd)",
    "setting_sd": "error of a setting (setting_sd)",
}
