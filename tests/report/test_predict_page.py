"""The page of a prediction: a sentence with number, unit and band, then the bands, then the rows."""

from pathlib import Path

import pytest

from wirebayes.prediction.table import dataset
from wirebayes.report.pages.predict import in_a_sentence, predict_page, write_beside
from wirebayes.wire.protocol import Control

ABOUT = {"prediction": "hold 8 predicted as a continuation", "seed": 3}
WARNED = {"warnings": ["it fails its check", "a long hold"], "warning_kinds": ["model-check", "extrapolation"]}


def rows(holds: int = 2) -> list[list[object]]:
    """Two readings a hold, the second half a newton lower."""
    each = [(8 + hold, 12.0 + hold, time) for hold in range(holds) for time in (0.0, 600.0)]
    out: list[list[object]] = []
    for hold, setting, time in each:
        middle = 5.0 + (hold - 8) - 0.5 * (time > 0)
        out.append(["kite", hold, setting, time, middle, 0.1, middle - 0.16, middle, middle + 0.16])
    return out


def test_the_answer_has_number_unit_and_band() -> None:
    assert in_a_sentence(dataset(rows(), ABOUT)) == (
        "Hold 8 of kite, at 12 mm, is expected to read 5.00 N (4.84 … 5.16) after 0 s and 4.50 N (4.34 … 4.66) after "
        "600 s; 90 % intervals in brackets; 1 more hold below."
    )
    assert in_a_sentence(dataset(rows(1)[:1], ABOUT)).count("after") == 1


def test_a_hold_without_a_predicted_reading_is_said_to_have_none() -> None:
    empty = [[*row[:4], *[float("nan")] * 5] for row in rows()]
    assert in_a_sentence(dataset(empty, ABOUT, "force")) == (
        "Hold 8 of kite, at 12 N, has no predicted reading: in most draws the wire cannot carry what is set; "
        "1 more hold below."
    )
    drawn = dataset([*rows(), *[[*row[:1], row[1] + 2, *row[2:]] for row in empty]], ABOUT, "force")  # type: ignore[operator]
    _, labels = drawn.plot().get_legend_handles_labels()
    assert labels == ["hold 8, 12 N", "hold 9, 13 N"]


def test_a_page_without_figures_has_no_picture(tmp_path: Path) -> None:
    table = tmp_path / "next.csv"
    table.write_text("rows")
    empty = [[*row[:4], *[float("nan")] * 5] for row in rows()]
    assert "<img" not in write_beside(dataset(empty, ABOUT, "force"), table).read_text(encoding="utf-8")
    assert "<img" in write_beside(dataset(rows(), ABOUT, "force"), table).read_text(encoding="utf-8")


def test_under_weights_millimetres_are_read() -> None:
    said = in_a_sentence(dataset(rows(1), ABOUT, "force"))
    assert "at 12 N" in said and "5.00 mm (4.84 … 5.16)" in said


@pytest.mark.parametrize("control", ["displacement", "force"])
def test_the_page_lies_beside_the_table(tmp_path: Path, control: Control) -> None:
    table = tmp_path / "next.csv"
    table.write_text("rows")
    written = write_beside(dataset(rows(), ABOUT | WARNED, control), table)
    html = written.read_text(encoding="utf-8")
    assert written == tmp_path / "next.html" and table.read_text() == "rows"
    order = [
        html.index(text) for text in ("It fails its check", "is expected to read", "data:image/svg", "A long hold")
    ]
    assert order == sorted(order)  # a grave warning, the answer, the picture, a light one
    assert html.count("<tr>") == 1 + 4 and 'href="next.csv"' in html


def test_a_table_that_is_called_as_a_page_keeps_its_name(tmp_path: Path) -> None:
    assert write_beside(dataset(rows(), ABOUT), tmp_path / "next.html").name == "next.html.html"


def test_a_long_prediction_shows_its_first_rows_and_says_how_many_there_are() -> None:
    long = predict_page(dataset(rows(150), ABOUT), Path("next.csv"))
    table = long.sections[0].blocks[-1]
    assert len(table.rows) == 200 and table.caption == "The file has 100 more rows."  # type: ignore[union-attr]
