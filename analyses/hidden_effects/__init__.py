"""The hidden-effect benchmark: an independent generator, sealed cases and the scores of `wirebayes discover` on them.

Nothing here imports the package's physics; `run.py` alone calls the package, to have its answers judged.
"""
