"""Whose predictions a comparison draws."""

from wirebayes.report.pictures.compare import winner


def test_the_best_model_that_could_be_scored_is_the_winner():
    rows = [{"name": "broken", "failed": "no fit"}, {"name": "toe", "failed": None}, {"name": "plain", "failed": None}]
    assert winner({"base": "plain", "models": rows}) == "toe"  # type: ignore[arg-type]
    assert winner({"base": "plain", "models": rows[:1]}) is None  # type: ignore[arg-type]
