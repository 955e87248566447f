"""What processes that share the work need: imported, for all of them, by the one process from which they are forked.

That process ends with the command, even while it still loads: whoever reads the command's output waits for its end.
"""

import ctypes
import gc
import signal

_PARENT_DEATH_SIGNAL = 1  # PR_SET_PDEATHSIG of Linux's <sys/prctl.h>

ctypes.CDLL(None).prctl(_PARENT_DEATH_SIGNAL, signal.SIGKILL)

from wirebayes.processes.workers import SELDOM  # noqa: E402

gc.set_threshold(*SELDOM)

import wirebayes.discovery.model_check  # noqa: E402
import wirebayes.results.store  # noqa: E402, F401
