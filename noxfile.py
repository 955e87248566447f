"""The tests on other versions of Python than the one of `make test`, and with the lowest versions that are allowed."""

import nox

nox.options.default_venv_backend = "venv"
nox.options.error_on_missing_interpreters = False
FAST = ("-n", "logical", "--maxprocesses", "4", "--dist", "loadfile", "-m", "not slow and not browser")


@nox.session(python=["3.11", "3.12", "3.13"])
def tests(session: nox.Session) -> None:
    """`make test`, apart from the linters."""
    session.install("-c", "constraints.txt", "-e", ".[test]")
    session.run("python", "-m", "pytest", *(session.posargs or FAST))


@nox.session(python="3.11", venv_backend="uv")
def lowest(session: nox.Session) -> None:
    """The lowest version of everything that pyproject.toml names."""
    session.install("--resolution", "lowest-direct", "-e", ".[test]")
    session.run("python", "-m", "pytest", *(session.posargs or FAST))
