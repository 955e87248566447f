"""``mixture.json``: the models that a final posterior is one of, where several stay undecided."""

from typing import TypedDict


class Member(TypedDict):
    """A model: the folder of its posterior below that of the final one, ``.`` for this itself."""

    folder: str
    probability: float
    effects: list[str]


class MixtureJson(TypedDict):
    """The whole file; the probabilities sum to one."""

    members: list[Member]
