"""Robots that come with the package: their names alone, which a list of them needs without loading the mechanics."""

from importlib import resources


def shipped() -> list[str]:
    """Names of the robots inside the package."""
    folder = resources.files("wirebayes") / "data" / "robots"
    return sorted(entry.name[:-5] for entry in folder.iterdir() if entry.name.endswith(".toml"))
