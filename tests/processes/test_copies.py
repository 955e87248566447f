"""Work shared with copies of a process: in order, all of it, whatever becomes of a copy."""

import os
import subprocess
import sys
import textwrap
import threading

import pytest

from wirebayes.processes.copies import in_copies, loaded_meanwhile, prepared_copy

LINUX = pytest.mark.skipif(sys.platform != "linux", reason="processes are copied on Linux alone")


def run(script: str) -> str:
    """What a script prints that runs in a process with one thread, on two cores as far as it knows."""
    begin = """
        import os, time
        from wirebayes.processes import copies
        copies.cores = lambda: 2
        from wirebayes.processes.copies import in_copies
    """
    code = textwrap.dedent(begin) + textwrap.dedent(script)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_results_come_in_the_order_of_the_pieces():
    assert run("print(in_copies([lambda k=k: (time.sleep(0.05 * (3 - k)), k)[1] for k in range(4)]))") == "[0, 1, 2, 3]"


@LINUX
def test_two_processes_share_the_pieces():
    found = run("""
        def piece():
            time.sleep(0.3)
            return os.getpid()
        print(len(set(in_copies([piece] * 4))))
    """)
    assert found == "2"


@LINUX
def test_what_a_copy_raises_is_raised_here():
    found = run("""
        here = os.getpid()
        def piece():
            time.sleep(0.2)
            if os.getpid() != here:
                raise ValueError("of a copy")
        try:
            in_copies([piece] * 4)
        except ValueError as error:
            print(error)
    """)
    assert found == "of a copy"


@LINUX
def test_an_error_that_wants_more_than_a_message_is_raised_as_the_nearest_that_does_not():
    found = run("""
        class Wanting(KeyError):
            def __init__(self, found, expected):
                super().__init__(f"found {found}, expected {expected}")
        here = os.getpid()
        def piece():
            time.sleep(0.2)
            if os.getpid() != here:
                raise Wanting("a", "b")
        def asked():
            raise Wanting("c", "d")
        try:
            in_copies([piece] * 4)
        except KeyError as error:
            print(error)
        with copies.prepared_copy(lambda: None) as ask:
            try:
                ask(asked)
            except KeyError as error:
                print(error)
    """)
    assert "found a, expected b" in found and "found c, expected d" in found


@LINUX
def test_pieces_of_a_copy_that_is_gone_are_done_here():
    found = run("""
        here = os.getpid()
        def piece():
            time.sleep(0.2)
            if os.getpid() != here:
                os._exit(1)
            return "done"
        print(in_copies([piece] * 3))
    """)
    assert found == "['done', 'done', 'done']"


def test_a_process_with_several_threads_is_not_copied():
    end = threading.Event()
    other = threading.Thread(target=end.wait)
    other.start()
    try:
        assert in_copies([os.getpid, os.getpid]) == [os.getpid()] * 2
    finally:
        end.set()
        other.join()


@LINUX
def test_a_worker_is_not_copied():
    found = run("""
        from wirebayes.processes.workers import processes
        def piece():
            time.sleep(0.3)
            return os.getpid()
        def work():
            return len(set(in_copies([piece] * 2)))
        with processes(1) as pool:
            there = pool.submit(work).result()
        print(work(), there)
    """)
    assert found == "2 1"


PREPARED = """
    import sys
    from pathlib import Path
    from wirebayes.processes.copies import prepared_copy
    def prepare():
        sys.modules["prepared"] = os
    def asked(number):
        if number == 0:
            raise ValueError("of a copy")
        if number == 9 and os.getpid() != here:
            os._exit(1)
        return number, "prepared" in sys.modules, os.getpid() == here
    here = os.getpid()
"""


@LINUX
def test_a_copy_prepares_and_does_what_is_asked():
    found = run(
        textwrap.dedent(PREPARED)
        + textwrap.dedent("""
        with prepared_copy(prepare) as in_copy:
            print(in_copy(asked, 1), in_copy(asked, 2))
            try:
                in_copy(asked, 0)
            except ValueError as error:
                print(error)
            print(in_copy(asked, 3), "prepared" in sys.modules)
        """)
    )
    assert found.splitlines() == ["(1, True, False) (2, True, False)", "of a copy", "(3, True, False) False"]


@LINUX
def test_what_a_copy_that_is_gone_was_asked_for_is_done_here():
    found = run(
        textwrap.dedent(PREPARED)
        + textwrap.dedent("""
        with prepared_copy(prepare) as in_copy:
            print(in_copy(asked, 9), in_copy(asked, 1))
        """)
    )
    assert found == "(9, False, True) (1, False, True)"


@LINUX
def test_a_copy_that_nobody_needs_ends_at_once():
    found = run("""
        from wirebayes.processes.copies import prepared_copy
        from multiprocessing import active_children
        begin = time.monotonic()
        with prepared_copy(lambda: time.sleep(60)):
            pass
        print(active_children(), time.monotonic() - begin < 30)
    """)
    assert found == "[] True"


def test_where_other_threads_run_what_a_copy_is_asked_for_is_done_here():
    end = threading.Event()
    other = threading.Thread(target=end.wait)
    other.start()
    try:
        with prepared_copy(lambda: None) as in_copy:
            assert in_copy(os.getpid) == os.getpid()
    finally:
        end.set()
        other.join()


def test_a_module_is_loaded_at_the_end_of_the_block(tmp_path, monkeypatch):
    (tmp_path / "loaded_late.py").write_text("import time\ntime.sleep(0.2)\nready = True")
    monkeypatch.syspath_prepend(tmp_path)
    with loaded_meanwhile("loaded_late"):
        assert not hasattr(sys.modules.get("loaded_late"), "ready")
    assert sys.modules.pop("loaded_late").ready


@LINUX
def test_a_copy_that_cannot_prepare_says_nothing():
    found = run("""
        from wirebayes.processes.copies import prepared_copy
        os.dup2(1, 2)  # what is said of errors, too
        def fails():
            raise ValueError("no space left")
        with prepared_copy(fails) as in_copy:
            print(in_copy(abs, -3))
    """)
    assert found == "3"
