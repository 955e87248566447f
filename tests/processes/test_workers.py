"""Work spread over processes: in order, for any amount of it, with effects that only a user's file has."""

import gc
import subprocess
import sys
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from wirebayes.commands.check import check
from wirebayes.effects import catalogue
from wirebayes.io import paper
from wirebayes.processes.workers import computing, workers

OWN = Path(__file__).parents[2] / "docs" / "own_effect.py"


@pytest.mark.parametrize("pieces", [0, 1, 5])
def test_answers_come_in_order_for_any_amount_of_work(pieces: int) -> None:
    with workers(pieces) as parallel_map:
        assert list(parallel_map(divmod, range(pieces), [2] * pieces)) == [divmod(i, 2) for i in range(pieces)]


def test_processes_know_a_users_own_effects() -> None:
    known = catalogue(OWN)
    [name] = known.keys() - catalogue().keys()
    with workers(prepare=partial(catalogue, OWN)) as parallel_map:
        [columns] = parallel_map(known[name].columns, [known[name]()])
    assert columns == known[name]().columns()


def _shared(pieces: int) -> list[tuple[int, int]]:
    with workers(pieces) as parallel_map:
        return list(parallel_map(divmod, range(pieces), [2] * pieces))


def test_a_worker_of_a_pool_that_may_start_none_does_the_work_itself() -> None:
    with get_context("spawn").Pool(1) as pool:
        assert pool.apply(_shared, (5,)) == [divmod(i, 2) for i in range(5)]


def test_an_error_in_a_process_arrives() -> None:
    with workers(2) as parallel_map, pytest.raises(ZeroDivisionError):
        list(parallel_map(divmod, [1, 1], [1, 0]))


def _run(script: str, folder: Path) -> str:
    """What a script prints that runs in a folder of its user."""
    done = subprocess.run([sys.executable, "-c", script], cwd=folder, capture_output=True, text=True, timeout=300)
    assert not done.stderr
    return done.stdout.strip()


LINUX = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere processes are not forked")
SECOND_THREAD = """
import threading
end = threading.Event()
threading.Thread(target=end.wait).start()
"""


@LINUX
@pytest.mark.parametrize(("before", "copied"), [("", True), (SECOND_THREAD, False)])
def test_processes_are_copies_unless_other_threads_run(before: str, copied: bool, tmp_path: Path) -> None:
    script = f"""{before}
import sys
sys.modules["only_here"] = sys
from wirebayes.processes.workers import workers
with workers(2) as parallel_map:
    print(*parallel_map(abs, [-1, -2]), *parallel_map(eval, ["'only_here' in __import__('sys').modules"]))
if "threading" in globals(): end.set()
"""
    assert _run(script, tmp_path) == f"1 2 {copied}"


@LINUX
def test_processes_that_are_no_copies_find_their_modules_loaded(tmp_path: Path) -> None:
    loaded = "'wirebayes.discovery.model_check' in __import__('sys').modules"
    script = f"""{SECOND_THREAD}
from wirebayes.processes.workers import load_early, workers
{{}}
with workers(2) as parallel_map:
    print(*parallel_map(eval, ["{loaded}"]))
end.set()
"""
    assert _run(script.format("load_early()"), tmp_path) == "True"
    assert _run(script.format(""), tmp_path) == "False"


@LINUX
def test_ctrl_c_while_modules_load_is_not_heard_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "interrupting.py").write_text("import os, signal\nos.kill(os.getpid(), signal.SIGINT)")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    script = f"""{SECOND_THREAD}
from wirebayes.processes.workers import _prepared, workers
_prepared(["interrupting"])
with workers(2) as parallel_map:
    print(*parallel_map(abs, [-1, -2]))
    print(*parallel_map(eval, ["'interrupting' in __import__('sys').modules"]))
end.set()
"""
    assert _run(script, tmp_path) == "1 2\nTrue"


def test_a_users_files_are_not_taken_for_pythons(tmp_path: Path) -> None:
    (tmp_path / "random.py").write_text("raise RuntimeError('this is not the module you look for')")
    script = f"""
import sys
sys.path = [place for place in sys.path if place]  # as in a command that was installed
{SECOND_THREAD}
from wirebayes.processes.workers import workers
with workers(2) as parallel_map:
    print(*parallel_map(abs, [-1, -2]))
end.set()
"""
    assert _run(script, tmp_path) == "1 2"


@LINUX
def test_a_copy_hears_sigterm_at_once_and_leaves_its_parents_files(tmp_path: Path) -> None:
    script = """
import os, signal, time
from pathlib import Path
from wirebayes.processes.interrupt import unfinished, watch
from wirebayes.processes.workers import processes
watch([])
with unfinished(Path("half")):
    Path("half").write_text("of a file")
    try:
        with processes(1) as pool:
            worker = pool.submit(os.getpid).result()
            asleep = pool.submit(time.sleep, 60)
            os.kill(worker, signal.SIGTERM)
            asleep.result()
    except Exception as error:
        pool.shutdown()  # Python complains where it ends while the pool does
        print(type(error).__name__, Path("half").is_file())
"""
    assert _run(script, tmp_path) == "BrokenProcessPool True"


def test_while_computing_linear_algebra_has_one_thread_and_then_what_it_had() -> None:
    np.linalg.eigh(np.eye(3))

    def threads() -> list[int]:
        return [library["num_threads"] for library in threadpool_info()]

    with threadpool_limits(2):
        before = threads()
        with computing():
            assert set(threads()) == {1}
        assert threads() == before
        assert max(before) == 2  # else this machine has nothing to limit


def test_while_computing_cycles_of_objects_are_looked_for_seldom() -> None:
    """Whoever called may look as often as before."""
    before = gc.get_threshold()
    assert before[0] < 100_000
    with pytest.raises(InterruptedError), computing():
        assert gc.get_threshold()[0] == 100_000
        raise InterruptedError
    assert gc.get_threshold() == before


def test_a_script_that_loaded_numpy_first_computes_with_one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[int] = []

    def look(*given: object) -> None:
        seen.extend(library["num_threads"] for library in threadpool_info())
        raise InterruptedError

    monkeypatch.setattr("wirebayes.commands.check.preview", look)
    with threadpool_limits(2), pytest.raises(InterruptedError):
        check(paper.experiments()[2])
    assert set(seen) == {1}
