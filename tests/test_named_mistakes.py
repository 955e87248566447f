"""The mistakes that the tests once let pass still have a place in the code where they can be made."""

from analyses.mutants.mistakes import NAMED, named


def test_every_named_mistake_can_be_made() -> None:
    """Code that decides moves to another module; the mutation tests then end with the name of the missing line."""
    found = named()
    assert len(found) == len(NAMED) == 12
