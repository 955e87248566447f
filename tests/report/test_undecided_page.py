"""The page of a search that leaves undecided which effects are missing: whose parameters it shows."""

from pathlib import Path

import pytest

from wirebayes.io.run_folder import write_json
from wirebayes.report.pages import discover
from wirebayes.results.mixture import write_mixture

PARAMETER = {"unit": "N", "q05": 1.0, "q50": 2.0, "q95": 3.0}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for model in ("plain", "final"):
        (tmp_path / model).mkdir()
        write_json(tmp_path / model / "summary.json", {"parameters": {"k1": PARAMETER}})
    return tmp_path


def test_parameters_of_the_most_probable_model_are_said_to_be_its_own(folder: Path) -> None:
    found = {"verdict": "ambiguous", "accepted": ["ageing", "steady_creep"]}
    (table,) = discover._parameters(folder, found)  # type: ignore[arg-type]
    assert "most probable" not in table.caption  # type: ignore[union-attr]
    members = [(".", 0.43, found["accepted"]), ("undecided/1", 0.32, []), ("undecided/2", 0.25, [])]
    write_mixture(folder / "final", members)  # type: ignore[arg-type]
    (table,) = discover._parameters(folder, found)  # type: ignore[arg-type]
    said = "the most probable of 3 models that stay undecided, with ageing and steady creep (43 %)"
    assert said in table.caption  # type: ignore[union-attr]
