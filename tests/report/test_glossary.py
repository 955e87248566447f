"""The section of a page that says what its words mean."""

from wirebayes.report.glossary import meaning


def test_an_effect_is_explained_for_steps_and_for_weights_where_these_differ() -> None:
    (named,) = meaning(effects=["sensor_drift", "ageing", "toe"], model=False).blocks
    drift, ageing, toe = (text for _, text in named.terms)
    assert drift.startswith("The force sensor drifts with time. ")
    assert drift.endswith(" Under weights: The gauge drifts with time. Size: a (N/s; under weights mm/s).")
    assert "Under weights: Each hold creeps less than the one before" in ageing and ageing.endswith("Size: a.")
    assert "weights" not in toe and toe.endswith("Size: w (mm).")
