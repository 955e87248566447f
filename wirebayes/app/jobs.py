"""Work that goes on in a process of its own: how far it is, what it ended with, and how it is stopped."""

from dataclasses import dataclass, field
from multiprocessing import Pipe
from pathlib import Path
from threading import Thread
from typing import Any

from wirebayes.app import work
from wirebayes.app.folders import Test
from wirebayes.processes.workers import start_apart

_PATIENCE_S = 5.0  # for a process to tidy up after SIGTERM, before it is killed


@dataclass
class AppJob:
    """A step of one test.

    Attributes
    ----------
    step : str
    state : str
        ``running``, and at the end ``done``, ``undecided``, ``refused``, ``broken`` or ``stopped``.
    value : object
        With the last: the questions, or the line that says what is wrong.
    progress : dict of str to float
        Share of each part of the work, by its name.
    stopping : bool
        Whether it was asked to end.
    """

    step: str
    state: str = "running"
    value: Any = None
    progress: dict[str, float] = field(default_factory=dict)
    stopping: bool = False
    _process: Any = None

    def start(self, folder: Path, options: dict[str, Any]) -> None:
        """Begin with a test in its folder."""
        receive, send = Pipe(duplex=False)
        self._process = start_apart(work.do_step, send, folder, self.step, options)
        send.close()
        Thread(target=self._listen, args=(receive,), daemon=True).start()

    def stop(self) -> None:
        """End the work with all its processes; what was finished before stays."""
        if self.state == "running":
            self.stopping = True
            self._process.terminate()

    def _listen(self, receive: Any) -> None:
        """Follow the process to its end: whether anybody looks or not, it must not wait to be heard."""
        ended: tuple[str, Any] | None = None
        with receive:
            while True:
                try:
                    kind, value = receive.recv()
                except (EOFError, OSError):
                    break
                if kind == "progress":
                    name, done, total = value
                    self.progress[name] = done / total if total else 0.0
                else:
                    ended = kind, value
        self._process.join(_PATIENCE_S)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
        broken = "broken", f"its process ended with code {self._process.exitcode}"
        state, self.value = ended or (("stopped", None) if self.stopping else broken)
        self.state = state  # last: whoever sees it may start the next step


class Jobs:
    """The newest job of each test; one at a time."""

    def __init__(self) -> None:
        self._of: dict[str, AppJob] = {}

    def of(self, test: Test) -> AppJob | None:
        """The job of a test, running or ended."""
        return self._of.get(test.name)

    def start(self, test: Test, step: str, options: dict[str, Any]) -> AppJob | None:
        """Begin a step; None where another one of the test is still running.

        Parameters
        ----------
        options : dict
        """
        before = self.of(test)
        if before is not None and before.state == "running":
            return None
        self._of[test.name] = job = AppJob(step)
        job.start(test.folder, options)
        return job

    def stop_all(self) -> None:
        """At the end of the program."""
        for job in self._of.values():
            job.stop()
