from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wirebayes.numeric.typing import Array

_Six = tuple[Array, Array, Array, Array, Array, Array]

MOST_EFFECTS: int
FORMULAS: tuple[str, ...]

class Test:
    def __init__(self, **arrays: Any) -> None: ...

class Law:
    def __init__(
        self,
        modified: bool,
        kept: float,
        tension_ref_N: float,
        log_length_ratio: float,
        formulas: Sequence[tuple[str, int, float]],
    ) -> None: ...

class Staircases:
    n: int

class Computed(Staircases):
    def __init__(
        self, test: Test, law: Law, theta: Array, spread: Array, first: Array, column: NDArray[np.intp], variance: Array
    ) -> None: ...

class Stored(Staircases):
    def __init__(
        self,
        tension: Array,
        by_setting: Array,
        by_creep: Array,
        carry_by_setting: Array,
        carry_by_creep: Array,
        *,
        edges: tuple[Array, ...] | None = ...,
    ) -> None: ...

def linearise(
    test: Test, law: Law, theta: Array, spread: Array, first: Array, column: NDArray[np.intp], variance: Array
) -> tuple[_Six, _Six | None]: ...
def simulate(test: Test, law: Law, theta: Array, setting_error: Array, each_alone: bool = ...) -> Array: ...
def courses(test: Test, law: Law, theta: Array, first_N: Array, most_steps: int) -> tuple[Array, Array]: ...
def chain(
    of: Staircases,
    readings: Array,
    mask: Array,
    variance: Array,
    setting_sd: Array,
    *,
    is_taut: NDArray[np.uint8] | None = ...,
) -> tuple[Array, Array, Array]: ...
def squares_gained(
    drive: Array,
    reached: Array,
    shown: Array,
    which_end: NDArray[np.int64],
    which_read: NDArray[np.int64],
    kept: float,
) -> tuple[Array, Array]: ...
def seen(
    tension: Array,
    by_setting: Array,
    by_creep: Array,
    carry_by_setting: Array,
    carry_by_creep: Array,
    readings: Array,
    mask: Array,
    variance: Array,
    setting_sd: Array,
    carried_mean: Array,
    carried_var: Array,
    shapes: Array,
) -> tuple[Array, Array]: ...
def standardised(
    of: Staircases, readings: Array, mask: Array, variance: Array, setting_sd: Array
) -> tuple[Array, Array]: ...
