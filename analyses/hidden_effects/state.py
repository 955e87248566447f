"""Effect amplitudes of a batch of simulations, one row a simulation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .rig import Array, Index


@dataclass(frozen=True)
class Effects:
    """Amplitudes (n,) and shape constants (n,) of the effects at work on one bench; a name left out is neutral."""

    n: int
    amplitudes: dict[str, Array]
    shapes: dict[str, Array]

    def on(self, name: str) -> bool:
        """Whether any row has this effect."""
        return name in self.amplitudes

    def __getitem__(self, name: str) -> Array:
        return self.amplitudes[name]

    def shape(self, key: str) -> Array:
        """Shape constant of every row; 1 where the row does not have the effect."""
        return self.shapes[key]

    def rows(self, index: Index) -> Effects:
        """The chosen rows; effects neutral in all of them are dropped."""
        kept = {name: value[index] for name, value in self.amplitudes.items() if np.any(value[index] != 0)}
        return Effects(len(index), kept, {key: value[index] for key, value in self.shapes.items()})
