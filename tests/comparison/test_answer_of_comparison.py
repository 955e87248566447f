"""A comparison in words: which models are ranked, and what to do next."""

from pathlib import Path
from typing import Any

import pytest

from wirebayes.answers.headline import comparison_in_words
from wirebayes.io.run_folder import write_json
from wirebayes.views.comparison import Comparison
from wirebayes.views.result import Given, ResultFolder


def stored(folder: Path, content: dict[str, Any]) -> Comparison:
    write_json(folder / "comparison.json", content)
    return Comparison(ResultFolder(folder))


@pytest.mark.parametrize(
    ("elpd", "said"),
    [
        (
            55.7,
            ["chain is scored on other readings and not ranked"],
        ),
        (-55.7, []),
        (30.0, []),  # less than two standard errors
    ],
)
def test_a_model_that_is_scored_on_other_readings_is_not_ranked_and_said_where_it_predicts_better(
    tmp_path: Path, elpd: float, said: list[str]
) -> None:
    """Where `compare --likelihood hold` was asked for the chain alone, plain was said to be best, then the chain."""
    law = {"elastic_law": "hooke", "history": "saturating", "failed": None, "effects": []}
    plain = law | {
        "name": "plain",
        "likelihood": "hold",
        "scored": "later readings",
        "difference": {"elpd": 0, "se": 0},
    }
    other = {"name": "chain", "likelihood": "chain", "scored": "all readings", "difference": None}
    other |= law | {"given_first_difference": {"elpd": elpd, "se": 22.0}}
    table = {"base": "plain", "models": [plain, other]}
    found = stored(tmp_path, {"experiments": {"w": table}})
    first, *beside = found.lines()
    assert first == "w: plain predicts left-out holds best"
    assert [line.strip().split(";")[0] for line in beside] == said
    words = comparison_in_words("w", table)
    assert words.startswith("w: plain predicts left-out holds best.") and "then" not in words
    assert ("Chain is scored on other readings" in words) == bool(said)


@pytest.mark.parametrize(
    ("base", "best", "next_"),
    [
        (("modified", "additive", "chain"), {"history": "saturating"}, "fit w.toml --elastic-law modified"),
        (("modified", "saturating", "chain"), {"elastic_law": "hooke"}, "fit w.toml"),
        (("modified", "saturating", "chain"), {}, ""),  # a law of time that fit has no option for
        (("hooke", "additive", "hold"), None, "fit w.toml --history additive --likelihood hold"),
    ],
)
def test_the_next_step_is_the_best_model_also_where_another_than_the_usual_one_was_compared(
    tmp_path: Path, base: tuple[str, str, str], best: dict[str, str] | None, next_: str
) -> None:
    law, history, likelihood = base
    plain = {"name": "plain", "elastic_law": law, "history": history, "likelihood": likelihood}
    plain |= {"failed": None, "effects": []}
    models = [plain] if best is None else [plain | {"name": "best"} | best, plain]
    content = {"experiments": {"w": {"base": "plain", "models": models}}}
    *fits, discover = stored(tmp_path, content).next_step(Given("w.toml")).splitlines()
    assert fits == ([f"wirebayes {next_}"] if next_ else [])
    searched = [f"--elastic-law {law}"] * (law != "hooke") + [f"--history {history}"] * (history != "saturating")
    assert discover == " ".join(["wirebayes discover w.toml", *searched])
