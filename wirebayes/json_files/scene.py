"""``scene.json``: points of a robot that a page draws and lets turn."""

from typing import TypedDict

from wirebayes.numeric.typing import Array

Points = Array | list[list[float]]


class SceneJson(TypedDict):
    """The whole file, points in m and in the world, a row a wire.

    `wires` are lines about their pulleys, `edges` pairs of platform points. For each of `times`, `drifted` has the
    platform's points and `tensions_N` the wires' median tensions; drift is drawn `exaggeration` times as large.
    """

    name: str
    exits: Points
    platform: Points
    wires: list[Points]
    edges: list[tuple[int, int]]
    drifted: Array | list[list[list[float]]]
    times: list[str]
    tensions_N: Array | list[list[float | None]]
    exaggeration: float
