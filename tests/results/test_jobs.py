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
