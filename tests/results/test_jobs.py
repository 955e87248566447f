"""Many fits at once: those that are not done yet, the longest first."""

from pathlib import Path
from typing import Any

import pytest

from wirebayes.inference.policy import DEFAULT
from wirebayes.results import jobs
from wirebayes.results.jobs import Job, begin


def test_fits_are_handed_over_at_once_and_waited_for_later(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not those that are done; an effect more takes longer."""
    experiment: Any = object()
    todo = [
        Job("plain", (experiment,)),
        Job("both", (experiment,), ("toe", "ageing")),
        Job("toe", (experiment,), ("toe",)),
    ]
    done = Job("done", (experiment,))
    (tmp_path / "done").mkdir()
    (tmp_path / "done" / "summary.json").write_text("{}", encoding="utf-8")
    fitted: list[str] = []
    monkeypatch.setattr(jobs, "one", lambda job, directory, seed, policy: fitted.append(job.folder))
    wait = begin([done, *todo], tmp_path, 0, DEFAULT, lambda function, work: list(map(function, work)))
    assert fitted == ["both", "toe", "plain"]
    heard: list[Any] = []
    wait(lambda *told: heard.append(told))
    assert heard == [("fits", 1, 3), ("fits", 2, 3), ("fits", 3, 3)]


@pytest.mark.parametrize(("share", "ess", "block"), [(1.0, 4000.0, 32), (0.5, 2000.0, 16), (0.03, 1000.0, 8)])
def test_a_fit_is_sampled_as_far_as_its_share_of_an_answer_needs(
    share: float, ess: float, block: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And its summary says by which policy."""
    policies: list[Any] = []
    monkeypatch.setattr(jobs, "fit_job", lambda job, seed, policy, *others: policies.append(policy))
    monkeypatch.setattr(jobs, "store", lambda job, fit, directory, seed, policy: policies.append(policy))
    jobs.one(Job("toe", (), share=share), tmp_path, 0, DEFAULT)
    sampled_by, stored = policies
    assert sampled_by == stored and (sampled_by.ess, sampled_by.block) == (ess, block)
