"""Warnings are the same on terminal, page and JSON, each of a documented kind, and what is advised depends on kinds."""

import json
import re
from collections.abc import Callable
from html import unescape
from pathlib import Path
from typing import Any

import pytest

import wirebayes as wb
from wirebayes.answers.headline import UNUSABLE
from wirebayes.cli.answer import conclude
from wirebayes.report.blocks import Notices, Page, Section
from wirebayes.report.page import render
from wirebayes.report.pages.fit import _cautions, _next
from wirebayes.result_warnings import KINDS, Notice, NoticeJson, from_json, to_json
from wirebayes.views.result import Result

ROOT = Path(__file__).parents[2]
FEW = wb.Policy(walkers=32, ess=300, rounds=2, round_draws=1024, block=20, most_steps=60, r_hat=1.5)
HASTY = wb.Policy(walkers=64, rounds=2, round_draws=1024, most_rounds=2, block=2, most_steps=2)
RAW = "Weg [mm];Zeit [s];Kraft [N]\n" + "".join(
    f"{hold};{time};{5 * hold - 0.002 * time + 0.01 * (time % 7):.2f}\n".replace(".", ",")
    for hold in (1, 2, 3)
    for time in (0, 30, 61)
)
ROWS = {"hold": [9, 9], "displacement_mm": [40, 40], "time_s": [0, 90000]}


def wire(**changes: Any) -> wb.Experiment:
    """A small simulated test."""
    options: dict[str, Any] = {"displacements": range(1, 6), "times": [0, 30, 60], "seed": 1}
    (one,) = wb.simulate_tests(**options | changes).experiments
    return one


@pytest.fixture(scope="module")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> Any:
    return wb.fit(wire(), policy=HASTY, check=False, output=tmp_path_factory.mktemp("fit") / "out")


def mixed() -> wb.Experiment:
    """Readings whose holds are in the wrong order: `check` must object."""
    columns = {
        "hold": [h for h in range(1, 7) for _ in range(3)],
        "displacement_mm": [float(h) for h in range(1, 7) for _ in range(3)],
        "time_s": [0.0, 30.0, 60.0] * 6,
        "tension_N": [
            value for start in (9.0, 7.0, 5.0, 4.0, 3.0, 2.0) for value in (start, start - 0.1, start - 0.13)
        ],
    }
    return wb.from_arrays(columns, name="mixed", material="line", length_mm=1000.0)


COMMANDS: dict[str, Callable[[Any, Path], Result[Any]]] = {
    "fit": lambda fitted, out: wb.fit(wire(), policy=HASTY, check=False, output=out),
    "fits": lambda fitted, out: wb.fit([wire(), mixed()], policy=HASTY, check=False, output=out),
    "check": lambda fitted, out: wb.check(mixed(), output=out),
    "discover": lambda fitted, out: wb.discover(mixed(), policy=HASTY, simulations=99, output=out),
    "compare": lambda fitted, out: wb.compare(mixed(), only="exponential", policy=HASTY, output=out),
    "batch": lambda fitted, out: wb.batch([wire(), mixed()], discover=False, check=False, policy=HASTY, output=out),
    "plan": lambda fitted, out: wb.plan(wire(), tests=4, budget_min=0.5, output=out),
    "pose": lambda fitted, out: wb.pose("linear-7", fitted, draws=20, times=[0, 60], output=out),
    "unheld": lambda fitted, out: wb.pose("linear-7", fitted, draws=20, position=[3, 3, 0.6], output=out),
    "trajectory": lambda fitted, out: wb.pose(
        "linear-7",
        fitted,
        draws=8,
        output=out,
        trajectory={"time_s": [0, 9000], "x_m": [0, 0], "y_m": [0, 0], "z_m": [0.6, 0.6]},
    ),
    "calibrate": lambda fitted, out: wb.calibrate(
        "linear-7", ROOT / "docs" / "example" / "linear-7-session.csv", fitted, draws=20, output=out
    ),
    "export": lambda fitted, out: wb.export("linear-7", fitted, draws=20, output=out),
    "simulate": lambda fitted, out: wb.simulate_tests(displacements=[1, 2, 3], seed=1, output=out),
}
WARNED = {  # what must be warned of, so that an empty list is no answer
    "fit": "not-converged",
    "fits": "data",
    "check": "data",
    "discover": "data",
    "compare": "data",
    "batch": "data",
    "plan": "budget",
    "pose": "not-converged",
    "unheld": "unheld",
    "trajectory": "not-converged",
    "calibrate": "misfit",
    "export": "left-out",
}


def flat(text: str) -> str:
    """A text as it can be compared between a page and a terminal."""
    return re.sub(r"\s+", " ", unescape(re.sub(r"<[^>]+>", " ", text))).lower()


SLOW = ("pose", "calibrate", "compare", "discover", "batch")


@pytest.mark.parametrize(
    "command", [pytest.param(name, marks=pytest.mark.slow) if name in SLOW else name for name in COMMANDS]
)
def test_terminal_page_and_json_hold_the_same_warnings(
    command: str, fitted: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = COMMANDS[command](fitted, tmp_path / "out")
    stored = json.loads(json.dumps(found.summary()))["warnings"]
    assert all(set(entry) == {"kind", "text"} and entry["kind"] in KINDS for entry in stored)
    assert WARNED.get(command) in [*(entry["kind"] for entry in stored), None]
    conclude(found, as_json=True)
    assert json.loads(capsys.readouterr().out)["warnings"] == stored
    page = flat((found.place.path / "report.html").read_text(encoding="utf-8"))
    terminal = flat("\n".join(found.messages))
    for entry in stored:
        assert flat(entry["text"]) in terminal
        alone = entry["text"].removeprefix("wire: ").removeprefix("mixed: ")  # a page's section is named by it
        assert flat(alone) in page
        assert entry["kind"] in page
    assert len(found.warnings) == len(stored) == terminal.count("warning: ")


def test_an_import_warns_of_its_readings(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    raw = tmp_path / "bench.csv"
    raw.write_text(RAW.replace("3;61;", "3;61;-"), encoding="utf-8")
    found = wb.import_bench(raw, length_mm=1000.0, output=tmp_path / "out")
    stored = found.summary()["warnings"]
    assert stored and all(entry["kind"] == "data" for entry in stored)
    assert [f"warning: {entry['text']}" for entry in stored] == list(found.messages)
    page = flat(wb.write_report(tmp_path / "out").read_text(encoding="utf-8"))
    assert all(flat(entry["text"].removeprefix("bench: ")) in page for entry in stored)


def test_a_prediction_warns_by_kind(fitted: Any) -> None:
    predicted = wb.predict(fitted, ROWS)
    assert "extrapolation" in predicted.attrs["warning_kinds"] and "not-converged" in predicted.attrs["warning_kinds"]
    assert len(predicted.attrs["warnings"]) == len(predicted.attrs["warning_kinds"])


def test_a_running_estimator_knows_what_speaks_against_its_wires(fitted: Any) -> None:
    assert [notice.kind for notice in wb.live("linear-7", fitted, draws=4).warnings] == ["not-converged"]


def changed(folder: Path, file: str, warnings: list[NoticeJson]) -> None:
    """Other warnings in a stored result."""
    path = folder / file
    path.write_text(json.dumps(json.loads(path.read_text()) | {"warnings": warnings}))


def test_advice_depends_on_kinds_and_not_on_words(fitted: Any, tmp_path: Path) -> None:
    posterior = wb.load(fitted.save(tmp_path / "fit"))
    file = f"{posterior.within}/summary.json"
    said = "model-check failed, falls, slack"
    for kind, advice in (
        ("model-check", "wirebayes discover"),
        ("not-converged", UNUSABLE),
        ("prior", "wirebayes pre"),
    ):
        changed(posterior.place.path, file, [{"kind": kind, "text": said}])
        assert posterior.next_step().startswith(advice)
        assert f"Next: {advice}" in _next(posterior.summary())


def test_a_page_shows_first_what_its_kind_says(fitted: Any) -> None:
    for name, kind in KINDS.items():
        summary = fitted.summary() | {"warnings": [{"kind": name, "text": "these are the words"}]}
        first, *others = _cautions(summary)
        shown = first if kind.first else others[-1]
        assert isinstance(shown, Notices) and [notice.kind for notice in shown.notices] == [name]
        page = render(Page("", "", [Section("", [shown])]))
        assert "These are the words." in page and ('class="first"' in page) is kind.first


def test_notices_are_sorted_once_and_of_known_kinds() -> None:
    slack, check = Notice("slack", "a"), Notice("model-check", "b")
    assert [entry["kind"] for entry in to_json([slack, check, slack])] == ["model-check", "slack"]
    assert from_json(to_json([slack])) == (slack,)
    with pytest.raises(ValueError, match="no kind of warning: odd"):
        Notice("odd", "a")


def test_the_docs_list_every_kind() -> None:
    text = (ROOT / "docs" / "warnings.rst").read_text(encoding="utf-8")
    for name, kind in KINDS.items():
        assert f"``{name}``" in text and kind.meaning in re.sub(r"\s+", " ", text)
    assert len(re.findall(r"^``([a-z-]+)``$", text, re.MULTILINE)) == len(KINDS)
