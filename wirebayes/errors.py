"""The one error that means: the input is wrong, and here is where."""


class InputError(ValueError):
    """Bad input or usage; its text is the plain line a user reads (exit code 2).

    Examples
    --------
    >>> wb.fit("experiments.toml", experiment="kite")
    Traceback (most recent call last):
    ...
    wirebayes.errors.InputError: experiments.toml: found no experiment 'kite' (did you mean kite-1.5m?), expected one of
    roc-line-1m, roc-line-1.71m, nylon-1.5m, kite-1.5m
    """


def shown(value: object) -> str:
    """What was found, on one short line."""
    try:
        text = repr(value)
    except ValueError:  # Python does not print integers of thousands of digits
        return "a number of thousands of digits"
    return text if len(text) <= 60 else text[:57] + "..."
