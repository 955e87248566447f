"""emcee without `scipy.stats`, which one of its moves asks for and which takes longer to load than all else together.

That move (`KDEMove`) is not used here; where somebody uses it elsewhere in the same process, it loads what it needs
when it runs.
"""

import sys
from typing import Any

_NEEDED = "scipy.stats"


def _gaussian_kde(*args: Any, **options: Any) -> Any:
    from scipy.stats import gaussian_kde

    return gaussian_kde(*args, **options)


if _NEEDED in sys.modules or "emcee" in sys.modules:
    import emcee
else:
    sys.modules[_NEEDED] = None  # type: ignore[assignment]  # an import of it fails, for which emcee is prepared
    try:
        import emcee
    finally:
        del sys.modules[_NEEDED]
    emcee.moves.kde.gaussian_kde = _gaussian_kde

EmceeState = emcee.State
EnsembleSampler = emcee.EnsembleSampler
Move = emcee.moves.move.Move
RedBlueMove = emcee.moves.RedBlueMove
