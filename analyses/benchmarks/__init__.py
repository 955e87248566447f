"""How fast a posterior is sampled, against other samplers on the same posterior; and what an evaluation costs."""

import os
from pathlib import Path

# One thread for everyone, set before any of the libraries starts.
os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1")
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(name, "1")


def parsed(parser):
    """What the command line asks for: the options of `parser` and ``--output``, a folder that is there afterwards."""
    parser.add_argument("--output", type=Path, default=Path("out/benchmarks"))
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    return options
