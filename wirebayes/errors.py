"""The one error that means: the input is wrong, and here is where."""


class InputError(ValueError):
    """Bad input or usage; its text is the plain line a user reads (exit code 2)."""
