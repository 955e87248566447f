"""Work shared with copies of a process: in order, all of it, whatever becomes of a copy."""

import os
import subprocess
import sys
import textwrap
import threading

import pytest

from wirebayes.processes.copies import in_copies

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
        from concurrent.futures import ProcessPoolExecutor
        from multiprocessing import get_context
        def piece():
            time.sleep(0.3)
            return os.getpid()
        def work():
            return len(set(in_copies([piece] * 2)))
        print(work(), ProcessPoolExecutor(1, get_context("fork")).submit(work).result())
    """)
    assert found == "2 1"
